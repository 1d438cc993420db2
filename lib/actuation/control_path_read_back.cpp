// ControlPath's way back: what was sent, and whether X-Plane shows it.

#include <utility>

#include "xplane_bridge/actuation/control_path.hpp"

namespace xplane_bridge {
namespace {

constexpr double kReadBackTimeout = 1.0;          // [s] without read-back until it is said
constexpr std::size_t kMaxAwaitingReadBack = 64;  // two frames of 200 commands and 20 frames a second, three times

}  // namespace

void ControlPath::publishApplied(const core::ArbitratedControls& controls) {
  AppliedControls applied;
  applied.controls = controls;
  applied.sent_ns = link_->clock().system_ns();
  applied.sim_time = watch_.sim_time;
  hooks_.applied(applied);
  if (awaiting_read_back_.empty()) last_followed_ = now();  // until now there was nothing to show
  awaiting_read_back_.push_back(applied);
  if (awaiting_read_back_.size() > kMaxAwaitingReadBack) awaiting_read_back_.pop_front();
}

void ControlPath::watchReadBack(const core::ChannelSet& channels) {
  if (channels == watched_) return;
  watched_ = channels;
  watched_order_.clear();
  read_back_known_.reset();
  core::RrefGroup group{"read-back", {core::flightWatchDatarefs().front()}, core::kEveryFrameRateHz, 1};
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!channels.test(i)) continue;
    watched_order_.push_back(static_cast<core::Channel>(i));
    group.datarefs.push_back(core::readBackDataref(static_cast<core::Channel>(i), encoder_.options()));
  }
  if (read_back_) {
    read_back_.replace(std::move(group));
  } else {
    read_back_ = link_->subscribe(
        std::move(group), [this](const core::RrefView& view, const core::ReceiveInfo&) { onReadBack(view); }, mutex_);
  }
}

void ControlPath::onReadBack(const core::RrefView& view) {
  double sim_time = watch_.sim_time;
  for (std::size_t i = 0; i < view.size(); ++i) {
    const core::RrefPair pair = view[i];
    if (pair.index == 0) sim_time = static_cast<double>(pair.value);
    if (pair.index < 1 || static_cast<std::size_t>(pair.index) > watched_order_.size()) continue;
    const std::size_t channel = core::index(watched_order_[static_cast<std::size_t>(pair.index) - 1]);
    read_back_values_[channel] = static_cast<double>(pair.value);
    read_back_known_.set(channel);
  }
  // The newest that fits: older ones were overtaken.
  for (auto it = awaiting_read_back_.rbegin(); it != awaiting_read_back_.rend(); ++it) {
    bool all = true;
    for (std::size_t i = 0; i < core::kChannelCount && all; ++i) {
      if (!it->controls.active.test(i)) continue;
      all = read_back_known_.test(i) &&
            encoder_.matches(static_cast<core::Channel>(i), it->controls.values[i], read_back_values_[i]);
    }
    // What stood there before the command reached X-Plane is not its doing.
    const bool too_early = link_status_.state != core::LinkState::kPaused && sim_time <= it->sim_time;
    if (!all || too_early) continue;
    it->read_back = true;
    it->read_back_sim_time = sim_time;
    it->read_back_frames = (sim_time - it->sim_time) / watch_.frame_period;
    hooks_.applied(*it);
    last_followed_ = now();
    awaiting_read_back_.erase(awaiting_read_back_.begin(), it.base());
    return;
  }
}

std::vector<std::string> ControlPath::notFollowed() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  std::vector<std::string> out;
  if (awaiting_read_back_.empty() || link_status_.state != core::LinkState::kConnected ||
      now() - last_followed_ <= kReadBackTimeout) {
    return out;
  }
  const core::ArbitratedControls& last = awaiting_read_back_.back().controls;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    const auto channel = static_cast<core::Channel>(i);
    if (!last.active.test(i) ||
        (read_back_known_.test(i) && encoder_.matches(channel, last.values[i], read_back_values_[i])))
      continue;
    out.push_back(core::channelName(channel));
  }
  return out;
}

}  // namespace xplane_bridge
