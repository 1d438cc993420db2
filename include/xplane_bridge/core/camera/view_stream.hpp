#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/camera/camera_frustum.hpp"
#include "xplane_bridge/core/camera/camera_pose.hpp"
#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/state/mission_state.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"
#include "xplane_bridge/core/wire/rref_subscription.hpp"

namespace xplane_bridge::core {

/// The datarefs that a camera's pose is made of.
const std::vector<std::string>& cameraDatarefs();
/// A sample from their values, in that order; simulator time and pause are the caller's to fill in.
CameraSample cameraSample(const float* values);

/// From X-Plane 12 on only: vertical shift of the frustum.
inline constexpr const char* kFrustumShiftUpDataref = "sim/graphics/view/field_of_view_vertical_ratio";
/// First version that has it.
inline constexpr std::int32_t kFirstWithFrustumShiftUp = 120000;

/// The subscription of a program that pairs pictures with states: simulator time, frame period, paused, replay, and
/// where the camera is and what it shows, every frame and in one datagram. Sources and units of SimStatus come from the
/// field table.
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
  [[nodiscard]] const CameraSample& camera() const { return camera_; }
  /// Without the vertical shift, which only version 12 has.
  [[nodiscard]] const FrustumSample& frustum() const { return frustum_; }
  /// [ns] receive time of the sample, as given to add()
  [[nodiscard]] std::int64_t receiveTime() const { return assembler_.receiveTime(); }
  /// The frame period in simulator time [s]: what X-Plane reports, times its time acceleration; 0 = unknown.
  [[nodiscard]] float simulatedFramePeriod() const;
  /// Forgets everything, as after a new subscription.
  void reset();

 private:
  std::vector<DatarefRequest> requests_;  // of SimStatus; the camera's and the frustum's datarefs follow
  RrefFrameAssembler assembler_;
  SimStatus status_;
  CameraSample camera_;
  FrustumSample frustum_;
};

}  // namespace xplane_bridge::core
