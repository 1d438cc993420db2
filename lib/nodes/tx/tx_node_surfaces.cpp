// tx_node's side of single surfaces, failures and excitations: topics and services to SurfaceControl, FailureManager
// and ExcitationManager.

#include <cmath>
#include <utility>

#include "xplane_bridge/Event.h"
#include "xplane_bridge/nodes/base/user_folder.hpp"
#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"
#include "xplane_bridge/nodes/tx/actuation_diagnostics.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {

void TxNode::makeSurfaceControl() {
  SurfaceControlOptions options;
  options.mixing = options_.mixing;
  options.mixing_folder = userFolder() + "/mixing";
  options.driver = options_.aircraft.surfaces;
  options.flap_rate = options_.aircraft.flap_rate;
  options.speedbrake_rate = options_.aircraft.speedbrake_rate;
  options.command_timeout = options_.control.arbiter.command_timeout;
  auto surfaces = std::make_unique<SurfaceControl>(
      &link(), overrides_.get(), options,
      [this](const std::string& text, bool success) { logEvent(Event::OVERRIDE, text, "", success); },
      [this] { publishSurfacesApplied(); });
  auto failures = std::make_unique<FailureManager>(
      &link(), overrides_.get(), surfaces.get(), options_.service_timeout,
      [this](const FailureSnapshot& snapshot) {
        FailureState message;
        toMessage(snapshot, &message);
        publishStamped(failure_publisher_, &message);
      },
      [this](const std::string& text, const std::string& who, bool success) {
        logEvent(Event::FAILURE, text, who, success);
      });
  auto excitation = std::make_unique<ExcitationManager>(
      surfaces.get(), options_.aircraft.max_roll_deg, options_.aircraft.max_pitch_deg,
      [this](const ExcitationLabel& label) {
        ExcitationState message;
        toMessage(label, &message);
        publishStamped(excitation_publisher_, &message);
      },
      [this](const std::string& text, const std::string& who, bool success) {
        logEvent(Event::EXCITATION, text, who, success);
      });
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  surfaces_ = std::move(surfaces);
  failures_ = std::move(failures);
  excitation_ = std::move(excitation);
}

void TxNode::serveInjectExcitation(const InjectExcitation::Request& request, InjectExcitation::Response* response) {
  const ExcitationRequest wish = toCore(request);
  const ExcitationManager::Plan plan = excitation_->plan(wish);
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const RequestResult result =
      excitation_->inject(wish, plan, name() + "/inject_excitation", watch_, path_->refusal(), path_->commanded());
  response->result = toMessage(result);
  response->success = result.success();
  response->id = excitation_->label().id;
}

void TxNode::onSurfaceCommand(const SurfaceCommand& message) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (!surfaces_) return;
  if (const auto refusal = surfaces_->command(message.names, message.deflections_deg, message.sequence)) {
    ROS_WARN_THROTTLE(1.0, "control/surfaces is refused: %s", refusal->c_str());
  }
}

void TxNode::publishSurfacesApplied() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  while (const auto echo = surfaces_->takeEcho()) {
    AppliedCommand message;
    message.header.stamp = stampNow();
    message.mode = static_cast<std::uint8_t>(path_->mode().mode);
    message.source = AppliedCommand::SOURCE_NONE;
    message.sequence = echo->sequence;
    fillSurfaces(surfaces_->individuallyDriven(), &message);
    message.read_back = echo->read_back;
    message.read_back_sim_time = static_cast<float>(echo->sim_time);
    message.read_back_frames = static_cast<float>(echo->frames);
    applied_publisher_.publish(message);
  }
}

void TxNode::advertiseFailureServices() {
  advertiseService<SetFailure::Request, SetFailure::Response>(
      name() + "/set_failure", [this](const SetFailure::Request& request, SetFailure::Response& response) {
        const RequestResult result = failures_->set(toCore(request), name() + "/set_failure");
        response.result = toMessage(result);
        response.success = result.success();
      });
  advertiseService<ClearFailures::Request, ClearFailures::Response>(
      name() + "/clear_failures", [this](const ClearFailures::Request& request, ClearFailures::Response& response) {
        const auto done = failures_->clear(request.names, request.include_simulator, name() + "/clear_failures");
        response.result = toMessage(done.result);
        response.success = done.result.success();
        response.cleared = done.cleared;
      });
  advertiseService<InjectExcitation::Request, InjectExcitation::Response>(
      name() + "/inject_excitation",
      [this](const InjectExcitation::Request& request, InjectExcitation::Response& response) {
        serveInjectExcitation(request, &response);
      });
  addDiagnostics("surfaces", [this](diagnostic_updater::DiagnosticStatusWrapper& status) {
    if (surfaces_) xplane_bridge::fillDiagnostics(surfaces_->status(), &status);
  });
  addDiagnostics("failures", [this](diagnostic_updater::DiagnosticStatusWrapper& status) {
    if (failures_) xplane_bridge::fillDiagnostics(failures_->snapshot(), &status);
  });
}

}  // namespace xplane_bridge
