#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <optional>

namespace xplane_bridge::core {

/// @file
/// Where the camera is in the aircraft, from what X-Plane says of both in one frame.
///
/// Optical axes are right, down, forward (REP 103), base_link is forward, left, up. X-Plane's own axes ("OpenGL"): X
/// east, Y up, Z south of the scenery's origin.

/// Numbers of X-Plane's views (`sim/graphics/view/view_type`).
enum class ViewType : int {
  kPanel2d = 1000,       ///< forward, with the 2-D panel
  kBack = 1010,          ///< glance to the rear
  kHud = 1023,           ///< forward, head-up display
  kNothing = 1024,       ///< forward, without a cockpit
  kStraightDown = 1025,  ///< glance straight down
  kCockpit3d = 1026,     ///< the only one in which the pilot's head turns the camera
};

/// Roll, pitch and heading [deg] in X-Plane's order: heading, then pitch, then roll. NaN: not answered.
struct AnglesDeg {
  double roll = std::numeric_limits<double>::quiet_NaN();
  double pitch = std::numeric_limits<double>::quiet_NaN();
  double heading = std::numeric_limits<double>::quiet_NaN();
};

/// @return forward-right-down axes so turned, in those they are turned in.
Eigen::Matrix3d rotation(const AnglesDeg& angles);

/// What X-Plane says of camera and aircraft in one datagram, as float32 from the wire. NaN: not answered.
struct CameraSample {
  double sim_time = std::numeric_limits<double>::quiet_NaN();   ///< [s]
  double view_type = std::numeric_limits<double>::quiet_NaN();  ///< of ViewType, or another of X-Plane's
  bool external = false;                                        ///< the camera is outside the aircraft
  bool paused = false;                                          ///< or in replay

  AnglesDeg view;                 ///< `view_roll`, `view_pitch`, `view_heading`
  Eigen::Vector3d view_position;  ///< [m] `view_x`, `_y`, `_z`, OpenGL axes
  AnglesDeg visual_offset;  ///< of the picture, for several monitors: `field_of_view_roll_deg`, `_vertical_deg` (up
                            ///< +), `_horizontal_deg` (right +)

  AnglesDeg aircraft;                 ///< `phi`, `theta`, `psi`: against the scenery's axes
  AnglesDeg aircraft_true;            ///< `true_phi`, `true_theta`, `true_psi`: against the local level
  Eigen::Vector3d aircraft_position;  ///< [m] `local_x`, `_y`, `_z`, OpenGL axes

  AnglesDeg head;                 ///< of the pilot in the aircraft; obeyed in the 3-D cockpit only
  Eigen::Vector3d head_position;  ///< [m] `pilots_head_x`, `_y`, `_z`: right, up, aft
  Eigen::Vector3d eye_position;   ///< [m] `acf_peX`, `Y`, `Z`: right, up, aft: where the aircraft's file puts the eye

  Eigen::Matrix4d world;  ///< `world_matrix`: OpenGL axes into the camera's right, up, back

  CameraSample();

  /// Whether angles and positions of camera and aircraft are all there.
  [[nodiscard]] bool complete() const;
  [[nodiscard]] bool isView(ViewType type) const { return view_type == static_cast<double>(type); }
};

/// How `view_*` are to be read: no document settles it, so that PoseCheck finds it out.
struct PoseReading {
  bool true_axes = false;       ///< `view_heading` etc. are against the local level, not the scenery's axes
  bool frame_before = false;    ///< `view_*` are of the frame before the aircraft's position in the same datagram
  bool offsets_within = false;  ///< `view_*` contain the visual offset already
};

/// The camera in base_link.
struct CameraPose {
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< turns optical vectors into base_link
  Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< [m] lever arm, forward, left, up
  double angle_uncertainty_deg = 0.0;                               ///< bound, from the steps of float32
  double position_uncertainty = 0.0;                                ///< [m] likewise
};

/// The camera from `view_*`.
/// @param view the sample with the camera
/// @param aircraft the sample with the aircraft of that moment: the same one, or with PoseReading::frame_before the one
///        before it
/// @return nothing where one of the samples is not complete
std::optional<CameraPose> measuredPose(const CameraSample& view, const CameraSample& aircraft,
                                       const PoseReading& reading);

/// The camera from `world_matrix`: a check, as no document says of which frame and drawing pass it is.
/// @return nothing where it is not answered or is no rotation
std::optional<CameraPose> worldMatrixPose(const CameraSample& sample);

/// Which rotation the camera has in the aircraft by what X-Plane's view is, without the visual offset: the head's in
/// the 3-D cockpit, else that of the view. Optical axes to base_link; nothing for views of which that is not known.
std::optional<Eigen::Quaterniond> expectedOrientation(const CameraSample& sample);

/// Whether `view_*` contain the visual offset.
/// @return nothing where no reference shows it
std::optional<bool> offsetsWithin(const CameraSample& view, const CameraSample& aircraft, PoseReading reading);

/// [deg] of the picture's turn by the visual offset.
double offsetAngleDeg(const CameraSample& sample);

/// [deg] between two orientations.
double angleBetweenDeg(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// Turns the optical vectors of a camera that is turned so in the aircraft into base_link.
Eigen::Quaterniond orientationInBase(const AnglesDeg& angles);
/// The inverse: how a camera is turned in the aircraft.
AnglesDeg anglesInBase(const Eigen::Quaterniond& orientation);

}  // namespace xplane_bridge::core
