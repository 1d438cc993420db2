#include "xplane_bridge/core/camera/camera_history.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <iterator>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kAboutNs = 100'000'000;  // [ns] by which a sender's time may be off
constexpr std::size_t kMostFrames = 4000;       // 15 s of 266 a second: longer than a picture waits for its state

bool sameFrustum(const Frustum& a, const Frustum& b) {
  return a.horizontal_deg == b.horizontal_deg && a.vertical_deg == b.vertical_deg && a.shift_right == b.shift_right &&
         a.shift_up == b.shift_up && a.known == b.known;
}

/// Of the same frame's time, both.
bool samePose(const std::optional<CheckedPose>& a, const std::optional<CheckedPose>& b) {
  if (!a.has_value() || !b.has_value()) return a.has_value() == b.has_value();
  return a->pose.position == b->pose.position && a->pose.orientation.coeffs() == b->pose.orientation.coeffs();
}

/// What a picture that may be this neighbour's leaves in doubt.
void doubt(const FrameCamera& neighbour, FrameCamera* camera) {
  camera->external = camera->external || neighbour.external;
  camera->frustum.known = camera->frustum.known && sameFrustum(neighbour.frustum, camera->frustum);
}

}  // namespace

void CameraHistory::add(std::int64_t receive_ns, double sim_time, const FrameCamera& camera) {
  frames_.push_back({receive_ns, sim_time, camera});
  if (frames_.size() > kMostFrames) frames_.pop_front();
}

std::optional<FrameCamera> CameraHistory::ofFrame(double sim_time, std::int64_t moment_ns) const {
  const auto off = [moment_ns](const Heard& frame) { return std::abs(frame.receive_ns - moment_ns); };
  const Heard* nearest = nullptr;
  for (const Heard& frame : frames_) {
    if (frame.sim_time == sim_time && (nearest == nullptr || off(frame) <= off(*nearest))) nearest = &frame;
  }
  if (nearest == nullptr) return std::nullopt;
  std::optional<FrameCamera> camera(nearest->camera);
  for (const Heard& frame : frames_) {
    if (frame.sim_time != sim_time || std::abs(frame.receive_ns - nearest->receive_ns) > kAboutNs) continue;
    doubt(frame.camera, &*camera);
    if (camera->pose.has_value() && !samePose(frame.camera.pose, nearest->camera.pose)) camera->pose->sure = false;
  }
  return camera;
}

std::optional<CheckedPose> CameraHistory::poseOf(double sim_time) const {
  const auto found = std::find_if(frames_.rbegin(), frames_.rend(), [sim_time](const Heard& frame) {
    return frame.camera.pose.has_value() && frame.camera.pose->sim_time == sim_time;
  });
  return found == frames_.rend() ? std::nullopt : found->camera.pose;
}

std::optional<FrameCamera> CameraHistory::at(std::int64_t moment_ns) const {
  if (frames_.empty()) return std::nullopt;
  const auto later = [](std::int64_t moment, const Heard& frame) { return moment < frame.receive_ns; };
  auto nearest = std::upper_bound(frames_.begin(), frames_.end(), moment_ns, later);
  if (nearest == frames_.end()) {
    --nearest;
  } else if (nearest != frames_.begin() &&
             moment_ns - std::prev(nearest)->receive_ns <= nearest->receive_ns - moment_ns) {
    --nearest;
  }
  std::optional<FrameCamera> camera(nearest->camera);
  if (nearest != frames_.begin()) doubt(std::prev(nearest)->camera, &*camera);
  if (std::next(nearest) != frames_.end()) doubt(std::next(nearest)->camera, &*camera);
  return camera;
}

}  // namespace xplane_bridge::core
