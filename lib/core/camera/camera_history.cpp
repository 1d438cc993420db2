#include "xplane_bridge/core/camera/camera_history.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace xplane_bridge::core {
namespace {

constexpr std::size_t kMostFrames = 4000;  // 15 s of 266 a second: longer than a picture waits for its state

bool sameFrustum(const Frustum& a, const Frustum& b) {
  return a.horizontal_deg == b.horizontal_deg && a.vertical_deg == b.vertical_deg && a.shift_right == b.shift_right &&
         a.shift_up == b.shift_up && a.known == b.known;
}

}  // namespace

void CameraHistory::add(std::int64_t receive_ns, double sim_time, const FrameCamera& camera) {
  frames_.push_back({receive_ns, sim_time, camera});
  if (frames_.size() > kMostFrames) frames_.pop_front();
}

std::optional<FrameCamera> CameraHistory::ofFrame(double sim_time) const {
  const auto found = std::find_if(frames_.rbegin(), frames_.rend(),
                                  [sim_time](const Heard& frame) { return frame.sim_time == sim_time; });
  return found == frames_.rend() ? std::nullopt : std::optional<FrameCamera>(found->camera);
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
  bool external = nearest->camera.external;
  bool known = nearest->camera.frustum.known;
  const auto doubt = [&](const Heard& neighbour) {
    external = external || neighbour.camera.external;
    known = known && sameFrustum(neighbour.camera.frustum, nearest->camera.frustum);
  };
  if (nearest != frames_.begin()) doubt(*std::prev(nearest));
  if (std::next(nearest) != frames_.end()) doubt(*std::next(nearest));
  std::optional<FrameCamera> camera(nearest->camera);
  camera->external = external;
  camera->frustum.known = known;
  return camera;
}

}  // namespace xplane_bridge::core
