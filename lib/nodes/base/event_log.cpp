#include "xplane_bridge/nodes/base/event_log.hpp"

#include "xplane_bridge/nodes/base/ros_time.hpp"

namespace xplane_bridge {

std::uint32_t EventLog::add(std::uint8_t kind, const std::string& text, double sim_time,
                            const std::string& requested_by, bool success, std::uint32_t number) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (muted_) return 0;
  Event event;
  event.number = number != 0 ? number : ++number_;
  event.stamp = toRosTime(clock_.system_ns());
  event.sim_time = static_cast<float>(sim_time);
  event.kind = kind;
  event.text = text;
  event.requested_by = requested_by;
  event.success = success;
  list_.events.push_back(event);
  if (list_.events.size() > kKept) list_.events.erase(list_.events.begin());
  list_.header.stamp = event.stamp;
  publisher_.publish(list_);
  return event.number;
}

void EventLog::mute(bool muted) {
  std::lock_guard<std::mutex> lock(mutex_);
  muted_ = muted;
  number_ = 0;
  list_.events.clear();
}

std::uint32_t EventLog::reserve() {
  std::lock_guard<std::mutex> lock(mutex_);
  return ++number_;
}

}  // namespace xplane_bridge
