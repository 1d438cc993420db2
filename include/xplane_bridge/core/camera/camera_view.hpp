#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/message_constants.hpp"
#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/state/mission_state.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"
#include "xplane_bridge/core/wire/rref_subscription.hpp"

namespace xplane_bridge::core {

/// Which of the three views a head attitude is.
/// @param heading_deg of the head in the aircraft, right + (SimStatus.view_heading_deg), any branch
/// @param pitch_deg up + (SimStatus.view_pitch_deg)
/// @param tolerance_deg farthest the line of sight may be from the view's
/// @return kUnknown when it is none of them, or an angle is NaN
CameraView classifyView(double heading_deg, double pitch_deg, double tolerance_deg);

/// Rotation from a view's optical frame (right, down, forward; REP 103) to base_link (FLU).
/// @throws std::invalid_argument for kUnknown
Eigen::Quaterniond opticalOrientation(CameraView view);

/// The small subscription of whoever pairs pictures with states: simulator time, frame period, paused, replay and what
/// the camera shows, every frame and in one datagram. Sources and units come from the field table.
class ViewStream {
 public:
  ViewStream();

  /// What to subscribe; values come back with their position in it as index.
  [[nodiscard]] RrefGroup group() const;

  /// The dataref of the horizontal field of view [deg].
  [[nodiscard]] const std::string& fieldOfViewDataref() const;

  /// Takes a datagram of that group. @return true when it completed a frame's sample
  bool add(const RrefView& datagram, std::int64_t receive_ns);

  /// The last complete sample. Fields X-Plane does not answer are NaN; paused and replay are false then.
  [[nodiscard]] const SimStatus& status() const { return status_; }
  /// [ns] receive time of the sample, as given to add()
  [[nodiscard]] std::int64_t receiveTime() const { return assembler_.receiveTime(); }
  /// The frame period in simulator time [s]: what X-Plane reports, times its time acceleration; 0 = unknown.
  [[nodiscard]] float simulatedFramePeriod() const;
  /// Forgets everything, as after a new subscription.
  void reset();

 private:
  std::vector<DatarefRequest> requests_;
  RrefFrameAssembler assembler_;
  SimStatus status_;
};

}  // namespace xplane_bridge::core
