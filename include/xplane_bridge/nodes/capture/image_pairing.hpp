#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>

#include "xplane_bridge/FlightState.h"
#include "xplane_bridge/FrameState.h"
#include "xplane_bridge/core/camera/camera_history.hpp"
#include "xplane_bridge/core/camera/image_association.hpp"
#include "xplane_bridge/core/camera/pose_check.hpp"
#include "xplane_bridge/core/state/clock_filter.hpp"
#include "xplane_bridge/core/state/mission_state.hpp"

namespace xplane_bridge {

/// Gives every picture its FrameState, in the order of the pictures, exactly one each.
///
/// Simulator frames come from the capture host's own subscription, states from wherever rx_node runs; both meet on the
/// simulator's time axis (core/image_association.hpp). Host times are of one clock, best of one that is never set
/// (PictureClock). All functions may be called from any thread.
class ImagePairing {
 public:
  /// Whose time it is that states are stamped with.
  enum class Stamps : std::uint8_t {
    kHost,
    kFrames,     ///< in lock-step: receive times are the frames' own, the clock has no uncertainty
    kSimulator,  ///< with `publish_clock`: of no use beside the host's times of pictures
  };

  static constexpr double kFirstPictures = 2.0;  ///< [s] from the first one
  using Publish = std::function<void(const FrameState&)>;

  /// @param display_delay [s] from a simulator frame to its display; 0 counts as not measured
  /// @param max_wait [s] after a picture at which it is paired with what is there; the first pictures wait up to
  ///        kFirstPictures as long as there is no state, or no clock, yet
  /// @param publish called under the lock, in order; must not call back
  ImagePairing(double display_delay, double max_wait, Publish publish, Stamps stamps = Stamps::kHost);

  /// A frame heard on the capture host. @param receive_ns [ns] host time, running evenly
  void addFrame(const core::SimStatus& status, float frame_period, std::int64_t receive_ns);
  /// The camera of a frame, before that frame or after it; its pose may be of another one.
  /// @param receive_ns [ns] as of addFrame() @param sim_time [s] raw simulator time
  void addCamera(std::int64_t receive_ns, double sim_time, const core::FrameCamera& camera);
  /// The camera of the frame that a picture shows, as addPicture() will be given it; nothing where no frame was heard.
  /// Where that very frame was not heard, the camera is of the nearest one, and its frustum not known.
  /// @param own_delay [s] the picture's own display delay, where it has a key
  [[nodiscard]] std::optional<core::FrameCamera> cameraOf(std::int64_t shown_ns, std::optional<float> frame_key = {},
                                                          double own_delay = 0.0) const;
  /// The display delay was measured; pictures that wait keep theirs. @param delay [s]
  void setDisplayDelay(double delay);
  /// The link is new or gone: the simulator's clock is to be learnt anew.
  void forgetClock();
  /// @param arrival_ns [ns] host time
  /// @param stamp_ns [ns] the state's stamp in host time, where that is not the wall clock's; empty: as it stands there
  void addState(const FlightState::ConstPtr& state, std::int64_t arrival_ns, std::optional<std::int64_t> stamp_ns = {});
  /// A published picture: its FrameState with everything the capture knows (header, times, view, counts, its quality
  /// bits, the newest pose); the rest is filled in here, and the pose of the very frame.
  /// @param shown_ns [ns] host time, with the display delay
  /// @param frame_key [s] raw simulator time of the frame shown, where the source knows it: then no clock decides, and
  ///        the display delay is the picture's own
  void addPicture(const FrameState& picture, std::int64_t shown_ns, std::int64_t now_ns,
                  std::optional<float> frame_key = {});
  /// Unwrapped simulator time of a host time [s]; while the simulator stands, that of the newest frame; empty as long
  /// as its clock is not known.
  [[nodiscard]] std::optional<double> simTime(std::int64_t host_ns) const;
  /// Publishes what is ready or overdue.
  void flush(std::int64_t now_ns);

  struct Report {
    core::AssociationCounters counters;
    double clock_uncertainty = 0.0;  ///< [s]
    double display_delay = 0.0;      ///< [s] applied
    bool clock_fitted = false;
    double state_to_frame_ratio = 0.0;
    double mean_offset = 0.0;  ///< [s] of the last answers: display minus frame, beyond the display delay
    std::size_t waiting = 0;   ///< pictures without an answer yet
  };
  [[nodiscard]] Report report() const;

 private:
  struct Waiting {
    FrameState answer;
    core::ImageMoment moment;
    std::int64_t deadline_ns;
    std::uint32_t slips = 0;  ///< of the clock when `moment` was mapped
    std::size_t eras = 0;     ///< that had ended then
    bool present = false;     ///< it is of the era that goes on: what its clock does not say yet may come
  };
  /// The simulator's clock until it was paused, went on, or jumped: pictures are of moments before that, too.
  struct Era {
    std::int64_t end_ns;      ///< host time
    core::ClockFilter clock;  ///< as it was then
    float sim_time_raw;       ///< [s] of its last frame, which may have come as the first of a pause
  };
  struct KnownState {
    FlightState::ConstPtr message;
    std::int64_t arrival_ns;
  };

  /// To be called when a frame has ended one. @param before the clock without that frame
  void endEra(const core::ClockFilter& before, float sim_time_raw, std::int64_t receive_ns);
  void map(Waiting* picture) const;
  /// Maps again where the clock has come, or learnt of a slip, since.
  void mapAnew(Waiting* picture) const;
  void flushLocked(std::int64_t now_ns);
  void complete(const core::Association& association, std::int64_t now_ns, Waiting* picture);
  void completePose(const core::Association& association, Waiting* picture) const;
  void forgetOldStates();

  double display_delay_;
  bool delay_measured_;
  const std::int64_t max_wait_ns_;
  const Publish publish_;
  const Stamps stamps_;

  mutable std::mutex mutex_;
  core::ClockFilter clock_;
  core::ImageAssociator associator_;
  std::deque<Era> eras_;  // that have ended, the oldest first
  std::size_t eras_ended_ = 0;
  std::int64_t newest_ns_ = 0;  // host time of the newest frame
  float newest_raw_ = 0.0F;     // [s] of the same
  core::SimStatus status_;
  float frame_period_ = 0.0F;
  std::optional<double> newest_sim_time_;  // [s] unwrapped
  std::map<std::uint64_t, KnownState> states_;
  std::uint64_t next_state_id_ = 0;
  core::CameraHistory cameras_;
  std::deque<Waiting> waiting_;
  std::int64_t grace_until_ns_ = 0;  // 0: no picture yet
  bool state_seen_ = false;
  std::uint32_t unpaired_ = 0;
  double mean_offset_ = 0.0;
};

/// Writes a pose into body_to_camera, its source, uncertainties and quality bit.
void setPose(const core::CheckedPose& checked, FrameState* answer);

}  // namespace xplane_bridge
