// What tx_node says of itself on /diagnostics.

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {

void TxNode::fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (!path_) return;
  const core::ModeStatus mode = path_->mode();
  const std::string refusal = path_->refusal();
  const std::vector<std::string> unseen = path_->notFollowed();
  if (!refusal.empty()) {
    status->summary(Level::WARN, "commands are not sent: " + refusal);
  } else if (mode.failsafe) {
    status->summary(Level::WARN, std::string(core::toString(mode.mode)) + ", failsafe: " + mode.reason);
  } else if (!unseen.empty()) {
    status->summary(Level::WARN, "X-Plane does not show what is sent: " + core::join(unseen));
  } else {
    status->summary(Level::OK, core::toString(mode.mode));
  }
  status->add("Standing", toString(path_->standing()));
  status->add("Mode", core::toString(mode.mode));
  status->add("Reason", mode.reason);
  for (const auto source : {core::FlightMode::kManual, core::FlightMode::kAuto}) {
    const std::string name = source == core::FlightMode::kManual ? "control/manual" : "control/auto";
    const core::SourceStatistics statistics = path_->statistics(source);
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
