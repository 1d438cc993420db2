#include "xplane_bridge/nodes/tx/actuation_diagnostics.hpp"

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/console.h>

#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

using Level = diagnostic_msgs::DiagnosticStatus;

}  // namespace

void fillDiagnostics(const ControlSnapshot& control, diagnostic_updater::DiagnosticStatusWrapper* status) {
  if (!control.refusal.empty()) {
    status->summary(Level::WARN, "commands are not sent: " + control.refusal);
  } else if (control.mode.failsafe) {
    status->summary(Level::WARN, std::string(core::toString(control.mode.mode)) + ", failsafe: " + control.mode.reason);
  } else if (!control.not_followed.empty()) {
    status->summary(Level::WARN, "X-Plane does not show what is sent: " + core::join(control.not_followed));
  } else {
    status->summary(Level::OK, core::toString(control.mode.mode));
  }
  status->add("Standing", toString(control.standing));
  status->add("Mode", core::toString(control.mode.mode));
  status->add("Reason", control.mode.reason);
  const std::array<std::string, 2> names = {"control/manual", "control/auto"};
  for (std::size_t source = 0; source < names.size(); ++source) {
    const std::string& name = names[source];
    const core::SourceStatistics& statistics = control.received[source];
    status->add(name + " accepted (-)", statistics.accepted);
    status->add(name + " refused (-)", statistics.refusedTotal());
    for (std::size_t i = 0; i < statistics.refused.size(); ++i) {
      if (statistics.refused[i] == 0) continue;
      status->add(name + " refused, " + core::toString(static_cast<core::Refusal>(i)) + " (-)", statistics.refused[i]);
    }
    if (!statistics.last_refusal.empty()) status->add(name + " last refusal", statistics.last_refusal);
  }
  const std::string active = core::join(control.overrides, ", ", core::afterLastSlash);
  status->add("Overrides set", active.empty() ? "none" : active);
  status->add("Aircraft loaded", control.aircraft);
}

void fillDiagnostics(const SurfaceControlStatus& surfaces, diagnostic_updater::DiagnosticStatusWrapper* status) {
  const std::string& blocked = surfaces.blocked_reason;
  if (!surfaces.file_problem.empty()) {
    status->summary(Level::WARN, surfaces.file_problem);
  } else if (!surfaces.not_following.empty()) {
    status->summary(Level::WARN, "X-Plane does not show what is sent to " + core::join(surfaces.not_following));
  } else if (surfaces.state != SurfaceControlState::kIdle) {
    status->summary(Level::OK, toString(surfaces.state));
  } else if (surfaces.wanted) {
    status->summary(Level::WARN, "the surfaces are not driven: " + blocked);
  } else {
    status->summary(Level::OK, blocked.empty() ? "ready to drive single surfaces" : blocked);
  }
  status->add("State", toString(surfaces.state));
  status->add("Aircraft", surfaces.aircraft);
  status->add("Mixing known", surfaces.mixing_known);
  if (surfaces.mixing_known) {
    status->add("Surfaces of the mixing", core::join(surfaces.mixed_surfaces));
    status->add("Moved, with an effect that the mixing does not know",
                surfaces.unknown_moved.empty() ? "none" : core::join(surfaces.unknown_moved));
  }
  status->add("Identification of this flight", surfaces.identification);
  status->add("Samples of this flight (-)", surfaces.samples);
  status->add("Worst residual (deg)", surfaces.worst_residual_deg);
  status->add("Lag of driven surfaces (frames)", surfaces.lag_frames);
  status->add("control/surfaces accepted (-)", surfaces.commands_accepted);
  status->add("control/surfaces refused (-)", surfaces.commands_refused);
  status->add("control/surfaces answers dropped (-)", surfaces.answers_dropped);
  if (!surfaces.last_refusal.empty()) status->add("control/surfaces last refusal", surfaces.last_refusal);
}

void fillDiagnostics(const FailureSnapshot& failures, diagnostic_updater::DiagnosticStatusWrapper* status) {
  std::vector<std::string> broken, unconfirmed;
  for (const core::FailureLabel& label : failures.labels) {
    broken.push_back(label.name);
    if (label.active && !label.confirmed) unconfirmed.push_back(label.name);
    status->add(label.name, label.kind + (label.by_bridge ? ", by the bridge" : ", by the simulator") +
                                (!label.active     ? ", armed"
                                 : label.confirmed ? ", seen"
                                                   : ", not seen"));
  }
  if (!unconfirmed.empty()) {
    status->summary(Level::WARN, "X-Plane does not show the failure of " + core::join(unconfirmed));
  } else {
    status->summary(Level::OK, broken.empty() ? "nothing is broken" : "broken: " + core::join(broken));
  }
}

void watchGuardian(Guardian* guardian, diagnostic_updater::DiagnosticStatusWrapper* status) {
  try {
    if (!guardian->restartIfEnded()) return status->summary(Level::OK, "runs");
    status->summary(Level::WARN, "had ended, and was started again");
    ROS_WARN("its guardian process had ended, and was started again: until then a kill -9 would have left overrides");
  } catch (const std::runtime_error& error) {
    status->summary(Level::ERROR, std::string("has ended: after a kill -9 overrides stay held until the next start; ") +
                                      error.what());
  }
}

}  // namespace xplane_bridge
