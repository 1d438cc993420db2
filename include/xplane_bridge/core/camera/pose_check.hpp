#pragma once

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <optional>
#include <string>

#include "xplane_bridge/core/camera/camera_pose.hpp"

namespace xplane_bridge::core {

/// The camera's pose of one frame, with what is to be thought of it.
struct CheckedPose {
  double sim_time = 0.0;  ///< [s] of the frame that the pose is of, as received
  CameraPose pose;        ///< its uncertainties grow by what is not settled
  bool sure = false;      ///< nothing that would change it is open
};

/// Finds out while flying how `view_*` are to be read (PoseReading), by what does not move: in views from the cockpit
/// the lever arm and the camera's direction in the aircraft are constant. Of the candidates {scenery's axes, true axes}
/// x {this frame, the frame before} those are wrong whose lever arm or direction changes, or differs from the pilot's
/// head, from the aircraft's own eye point, or from `world_matrix`. What is found holds until reset(), also in views
/// that prove nothing; until then a pose that depends on it is not sure.
///
/// One thread calls.
class PoseCheck {
 public:
  /// Takes the sample of a frame, in order. @return the pose it gives; nothing where X-Plane does not say
  std::optional<CheckedPose> add(const CameraSample& sample);
  /// Forgets everything, as after a new X-Plane.
  void reset() { *this = PoseCheck(); }

  [[nodiscard]] const PoseReading& reading() const { return reading_; }
  /// What was found out and by what, for people.
  [[nodiscard]] std::string report() const;
  /// [m] how far the lever arm moved in the last window from a cockpit; NaN before the first
  [[nodiscard]] double leverScatter() const { return lever_scatter_; }

 private:
  /// One candidate's directions in a window.
  struct Directions {
    std::optional<Eigen::Quaterniond> first;
    double scatter_deg = 0.0;      // farthest from the first
    double from_expected = 0.0;    // [deg] farthest from the head's, where that is known
    double from_matrix_deg = 0.0;  // [deg] farthest from world_matrix's, where that answers
    void add(const Eigen::Quaterniond& q);
  };
  /// One candidate's lever arms in a window, less the pilot's head where that moves the camera.
  struct Levers {
    Eigen::AlignedBox3d box;
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    [[nodiscard]] double scatter() const { return box.isEmpty() ? 0.0 : box.diagonal().norm(); }
    [[nodiscard]] double fromExpected() const { return (box.center() - expected).norm(); }
  };
  struct Window {
    double began = std::numeric_limits<double>::quiet_NaN();  // [s] simulator time
    int samples = 0;
    std::array<Levers, 2> levers;                     // this frame, frame before
    std::array<std::array<Directions, 2>, 2> turned;  // [true axes][frame before]
    bool lever_expected = true;
    bool turn_expected = true;
    bool matrix = true;
    double gap_deg = 0.0;  // most that the two axes differed
  };

  void watch(const CameraSample& sample);
  void judge();
  void judgeFrame();
  void judgeAxes();
  [[nodiscard]] bool continues(const CameraSample& sample) const;
  [[nodiscard]] bool provesSomething(const CameraSample& sample) const;

  PoseReading reading_;
  bool frame_known_ = false;
  bool axes_known_ = false;
  bool offsets_known_ = false;
  bool steady_ = true;  // the lever arm of the last window stood still
  const char* axes_by_ = "";
  const char* frame_by_ = "";
  double lever_scatter_ = std::numeric_limits<double>::quiet_NaN();
  std::optional<CameraSample> before_;
  Window window_;
};

}  // namespace xplane_bridge::core
