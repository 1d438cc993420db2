// What tx_node says of itself on /diagnostics.

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {
namespace {

constexpr double kDoesNotFollow = 1.0;  // [s] without read-back until it is said

}  // namespace

void TxNode::fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const core::ModeStatus& mode = arbiter_->status();
  const double time = now();
  const bool flying = ever_sent_.any();
  const std::string refusal = refusalToFly();
  std::vector<std::string> unseen;
  if (flying && !unseen_.empty() && link_status_.state == core::LinkState::kConnected &&
      time - last_seen_ > kDoesNotFollow) {
    const Sent& last = unseen_.back();
    for (std::size_t i = 0; i < core::kChannelCount; ++i) {
      const auto channel = static_cast<core::Channel>(i);
      if (!last.channels.test(i) || (shown_known_.test(i) && encoder_->shows(channel, last.values[i], shown_[i])))
        continue;
      unseen.push_back(core::channelName(channel));
    }
  }
  if (!refusal.empty()) {
    status->summary(Level::WARN, "commands are not sent: " + refusal);
  } else if (mode.failsafe) {
    status->summary(Level::WARN, std::string(core::toString(mode.mode)) + ", failsafe: " + mode.reason);
  } else if (!unseen.empty()) {
    status->summary(Level::WARN, "X-Plane does not show what is sent: " + core::join(unseen));
  } else {
    status->summary(Level::OK, core::toString(mode.mode));
  }
  status->add("Mode", core::toString(mode.mode));
  status->add("Reason", mode.reason);
  for (const auto source : {core::FlightMode::kManual, core::FlightMode::kAuto}) {
    const std::string name = source == core::FlightMode::kManual ? "control/manual" : "control/auto";
    const core::SourceStatistics& statistics = arbiter_->statistics(source);
    status->add(name + " accepted (-)", statistics.accepted);
    status->add(name + " refused (-)", statistics.refusedTotal());
    for (std::size_t i = 0; i < statistics.refused.size(); ++i) {
      if (statistics.refused[i] == 0) continue;
      status->add(name + " refused, " + core::toString(static_cast<core::Refusal>(i)) + " (-)", statistics.refused[i]);
    }
    if (!statistics.last_refusal.empty()) status->add(name + " last refusal", statistics.last_refusal);
  }
  const std::string active = overrides_ ? core::join(overrides_->active(), ", ", core::afterLastSlash) : "";
  status->add("Overrides set", active.empty() ? "none" : active);
  status->add("Aircraft loaded", identity_.identity().icao);
}

}  // namespace xplane_bridge
