#include "xplane_bridge/nodes/tx/tx_node.hpp"

#include <algorithm>
#include <utility>

#include <std_srvs/SetBool.h>

#include "xplane_bridge/AppliedCommand.h"
#include "xplane_bridge/ClearFailures.h"
#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/DisturbanceState.h"
#include "xplane_bridge/ExcitationState.h"
#include "xplane_bridge/FailureState.h"
#include "xplane_bridge/IdentifySurfaces.h"
#include "xplane_bridge/InjectExcitation.h"
#include "xplane_bridge/RunCommand.h"
#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/SetDataref.h"
#include "xplane_bridge/SetFailure.h"
#include "xplane_bridge/SetView.h"
#include "xplane_bridge/nodes/base/service_result.hpp"
#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"
#include "xplane_bridge/nodes/tx/actuation_diagnostics.hpp"

namespace xplane_bridge {
namespace {

template <class Response>
void answer(const RequestResult& result, Response* response) {
  response->result = toMessage(result);
  response->success = result.success();
}

}  // namespace

// --- life cycle ---

void TxNode::loadParameters(const ParamLoader& own) { options_ = loadTxOptions(own, common().aircraft); }

void TxNode::advertise() {
  events_.start(advertiseTopic<EventList>("events", 1, true), clock());
  mode_publisher_ = advertiseTopic<ControlMode>("control/mode", 10, true);
  applied_publisher_ = advertiseTopic<AppliedCommand>("control/applied", 100);
  failure_publisher_ = advertiseTopic<FailureState>("failures/state", 10, true);
  excitation_publisher_ = advertiseTopic<ExcitationState>("excitation/state", 10, true);
  disturbance_publisher_ = advertiseTopic<DisturbanceState>("disturbance/state", 100, true);
  if (lockstep()) makeLockstep();
  advertiseLockstep();
  advertiseServices();
  advertiseFailureServices();
  advertiseFlightServices();
  advertiseDiagnostics();
}

core::SimLinkCallbacks TxNode::linkCallbacks() {
  core::SimLinkCallbacks callbacks;
  callbacks.on_state = [this](const core::LinkStatus& status) { onLink(status); };
  return callbacks;
}

void TxNode::start() {
  if (!replays()) guardian_.start();  // it would write to the X-Plane of the recording
  options_.actuation.turns = turns();
  actuation_ = std::make_unique<Actuation>(&link(), options_.actuation, hooks());
  actuation_->start();
  lockstep_spinner_->start();
  startBeating();
}

void TxNode::tick() {
  beat();
  actuation_->tick();
}

void TxNode::onLink(const core::LinkStatus& status) {
  actuation_->onLink(status);
  const auto journal = link().journal();
  if (status.peer.valid() && journal) guardian_.setPeer(status.peer, journal->path());
}

void TxNode::stopInputs() {
  heartbeat_.stop();
  guardian_.rest();
  if (lockstep_) {
    lockstep_->stop();
  }
  lockstep_queue_.disable();
  lockstep_spinner_->stop();
  if (actuation_) actuation_->stop();
}

void TxNode::undo(const Deadline& deadline) {
  // Left undone, the guardian tries once more, and the journal keeps it for the next start.
  if (actuation_ && actuation_->undo(std::max(0.1, deadline.left()))) guardian_.dismiss();
}

void TxNode::publishFinalState() {
  if (actuation_) actuation_->publish();
}

// --- topics ---

template <class Message, class... Values>
void TxNode::publishAs(const ros::Publisher& publisher, const Values&... values) {
  if (held()) return;
  Message message;
  message.header.stamp = stampNow();
  toMessage(values..., &message);
  publisher.publish(message);
}

ActuationHooks TxNode::hooks() {
  ActuationHooks hooks;
  hooks.mode = [this](const auto&... mode) { publishAs<ControlMode>(mode_publisher_, mode...); };
  hooks.applied = [this](const auto&... applied) { publishAs<AppliedCommand>(applied_publisher_, applied...); };
  hooks.surfaces_applied = [this](const auto&... echo) { publishAs<AppliedCommand>(applied_publisher_, echo...); };
  hooks.failures = [this](const auto& snapshot) { publishAs<FailureState>(failure_publisher_, snapshot); };
  hooks.excitation = [this](const auto& label) { publishAs<ExcitationState>(excitation_publisher_, label); };
  hooks.disturbance = [this](const auto& label) { publishAs<DisturbanceState>(disturbance_publisher_, label); };
  hooks.event = [this](const ActuationEvent& event) { onEvent(event); };
  hooks.warn = [](const std::string& text) { ROS_WARN("%s", text.c_str()); };
  hooks.journal_problem = [](const std::string& text) { ROS_ERROR_THROTTLE(5.0, "%s", text.c_str()); };
  hooks.stopping = [this] { return ending(); };
  return hooks;
}

void TxNode::onEvent(const ActuationEvent& event) {
  if (!event.success) {
    ROS_ERROR("%s", event.text.c_str());
  } else if (event.warning) {
    ROS_WARN("%s", event.text.c_str());
  } else {
    ROS_INFO("%s", event.text.c_str());
  }
  events_.add(static_cast<std::uint8_t>(event.kind), event.text, event.sim_time, event.who, event.success,
              event.number);
}

void TxNode::onCommand(core::FlightMode from, const ControlCommand& message) {
  beat();
  ControlPath& path = actuation_->path();
  if (const auto refusal = path.command(from, toCore(message))) {
    ROS_WARN_THROTTLE(1.0, "control/%s is refused: %s", from == core::FlightMode::kManual ? "manual" : "auto",
                      refusal->text.c_str());
  } else if (const auto time_ns = path.deadline()) {
    setAlarm(deadline_, *time_ns);
  }
}

void TxNode::onModeRequest(const ModeRequest& message) {
  actuation_->path().requestMode({message.sequence, message.mode, message.requester, message.header.stamp.toSec()});
}

void TxNode::onSurfaceCommand(const SurfaceCommand& message) {
  const std::string refusal = actuation_->commandSurfaces(message.names, message.deflections_deg, message.sequence);
  if (!refusal.empty()) ROS_WARN_THROTTLE(1.0, "control/surfaces is refused: %s", refusal.c_str());
}

// --- services: they run on the service thread and may wait for X-Plane; the control path never waits for them ---

void TxNode::advertiseServices() {
  advertiseOwn<SetMode>("set_mode", [this](const auto& request, auto* response) { serveSetMode(request, response); });
  advertiseOwn<SetDataref>("set_dataref", [this](const auto& request, auto* response) {
    const auto written = actuation_->settings().setDataref(request.name, request.values);
    answer(written.result, response);
    response->values = written.values;
  });
  advertiseOwn<RunCommand>("run_command", [this](const auto& request, auto* response) {
    answer(actuation_->settings().runCommand(request.name), response);
  });
  advertiseOwn<std_srvs::SetBool>("pause", [this](const auto& request, auto* response) {
    const RequestResult result = actuation_->setPaused(request.data != 0, name() + "/pause");
    response->success = result.success();
    response->message = result.text;
  });
  advertiseOwn<SetView>("set_view", [this](const auto& request, auto* response) {
    const core::ViewWish wish{
        request.view, {request.roll_deg, request.pitch_deg, request.heading_deg}, request.field_of_view_deg};
    answer(actuation_->views().setView(wish), response);
  });
}

void TxNode::serveSetMode(const SetMode::Request& request, SetMode::Response* response) {
  ModeRequest message;
  message.header.stamp = stampNow();
  message.mode = request.mode;
  message.requester = name() + "/set_mode";
  onModeRequest(message);
  const core::ModeStatus status = actuation_->path().mode();
  response->mode = static_cast<std::uint8_t>(status.mode);
  response->success = response->mode == request.mode;
  response->result = response->success ? result(ServiceResult::OK, core::toString(status.mode))
                                       : result(ServiceResult::REFUSED, status.reason);
}

void TxNode::advertiseFailureServices() {
  advertiseOwn<SetFailure>("set_failure", [this](const auto& request, auto* response) {
    answer(actuation_->failures().set(toCore(request), name() + "/set_failure"), response);
  });
  advertiseOwn<ClearFailures>("clear_failures", [this](const auto& request, auto* response) {
    const auto done =
        actuation_->failures().clear(request.names, request.include_simulator, name() + "/clear_failures");
    answer(done.result, response);
    response->cleared = done.cleared;
  });
  advertiseOwn<InjectExcitation>("inject_excitation", [this](const auto& request, auto* response) {
    const auto injected = actuation_->inject(toCore(request), name() + "/inject_excitation");
    answer(injected.result, response);
    response->id = injected.id;
  });
  advertiseOwn<IdentifySurfaces>("identify_surfaces", [this](const auto& request, auto* response) {
    const auto begun = actuation_->identifySurfaces(toCore(request), name() + "/identify_surfaces",
                                                    [this] { return events_.reserve(); });
    answer(begun.result, response);
    response->event_number = begun.event_number;
  });
}

// --- diagnostics ---

void TxNode::advertiseDiagnostics() {
  using Status = diagnostic_updater::DiagnosticStatusWrapper;
  addDiagnostics("control", [this](Status& status) {
    if (actuation_) fillDiagnostics(actuation_->control(), &status);
  });
  addDiagnostics("surfaces", [this](Status& status) {
    if (actuation_) fillDiagnostics(actuation_->surfaces().status(), &status);
  });
  addDiagnostics("failures", [this](Status& status) {
    if (actuation_) fillDiagnostics(actuation_->failures().snapshot(), &status);
  });
}

}  // namespace xplane_bridge
