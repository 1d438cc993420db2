// The services of tx_node. They run on the service thread and may wait for X-Plane; the control path never waits for
// them.

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "xplane_bridge/Event.h"
#include "xplane_bridge/actuation/pausing.hpp"
#include "xplane_bridge/core/simulator/simulator_settings.hpp"
#include "xplane_bridge/nodes/base/service_result.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {
namespace {

bool isOk(const ServiceResult& r) { return r.code == ServiceResult::OK; }

ServiceResult noLink() { return result(ServiceResult::NO_LINK, "X-Plane is not connected"); }

// X-Plane keeps float32; integers come back exactly.
float toleranceOf(float value) { return 1e-4F * std::max(1.0F, std::abs(value)); }

}  // namespace

void TxNode::advertiseServices() {
  advertiseService<SetMode::Request, SetMode::Response>(
      name() + "/set_mode", [this](const SetMode::Request& q, SetMode::Response& r) { serveSetMode(q, &r); });
  advertiseService<SetDataref::Request, SetDataref::Response>(
      name() + "/set_dataref",
      [this](const SetDataref::Request& q, SetDataref::Response& r) { serveSetDataref(q, &r); });
  advertiseService<RunCommand::Request, RunCommand::Response>(
      name() + "/run_command",
      [this](const RunCommand::Request& q, RunCommand::Response& r) { serveRunCommand(q, &r); });
  advertiseService<std_srvs::SetBool::Request, std_srvs::SetBool::Response>(
      name() + "/pause",
      [this](const std_srvs::SetBool::Request& q, std_srvs::SetBool::Response& r) { servePause(q.data != 0, &r); });
  advertiseService<SetView::Request, SetView::Response>(
      name() + "/set_view", [this](const SetView::Request& q, SetView::Response& r) { serveSetView(q, &r); });
  advertiseFailureServices();
  advertiseFlightServices();
}

void TxNode::serveSetMode(const SetMode::Request& request, SetMode::Response* response) {
  ModeRequest message;
  message.header.stamp = stampNow();
  message.mode = request.mode;
  message.requester = name() + "/set_mode";
  onModeRequest(message);
  const core::ModeStatus status = path_->mode();
  response->mode = static_cast<std::uint8_t>(status.mode);
  response->success = response->mode == request.mode;
  response->result = response->success ? result(ServiceResult::OK, core::toString(status.mode))
                                       : result(ServiceResult::REFUSED, status.reason);
}

ServiceResult TxNode::writeAndConfirm(const std::vector<core::DatarefWrite>& writes) {
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    if (!linkIsUp()) return noLink();
  }
  const Deadline deadline(clock(), options_.service_timeout);
  for (const core::DatarefWrite& write : writes) {
    const core::SendStatus sent = link().write(write.dataref, write.value);
    if (sent != core::SendStatus::kSent) {
      return result(ServiceResult::REFUSED, write.dataref + " is not sent: " + core::toString(sent));
    }
  }
  for (const core::DatarefWrite& write : writes) {
    const auto [fits, shown] =
        link().waitForDataref(write.dataref, write.value, toleranceOf(write.value), std::max(deadline.left(), 0.01));
    if (fits) continue;
    return result(ServiceResult::TIMEOUT,
                  write.dataref + (shown ? " shows " + std::to_string(*shown) + ", not " + std::to_string(write.value)
                                         : std::string(" does not answer: is the name right?")));
  }
  return result(ServiceResult::OK, "X-Plane shows it");
}

void TxNode::serveSetDataref(const SetDataref::Request& request, SetDataref::Response* response) {
  const bool finite =
      std::all_of(request.values.begin(), request.values.end(), [](float v) { return std::isfinite(v); });
  if (request.values.empty() || !finite) {
    response->result = result(ServiceResult::REFUSED, "values: expected one or more finite numbers");
    return;
  }
  std::vector<std::string> names;
  try {
    names = core::consecutiveElements(request.name, request.values.size());
  } catch (const std::invalid_argument& error) {
    response->result = result(ServiceResult::REFUSED, error.what());
    return;
  }
  std::vector<core::DatarefWrite> writes;
  for (std::size_t i = 0; i < names.size(); ++i) writes.push_back({names[i], request.values[i]});
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    if (!linkIsUp()) {
      response->result = noLink();
      return;
    }
  }
  // An override set here is given back like the node's own.
  for (const core::DatarefWrite& write : writes) {
    const auto release = core::releaseOf(write.dataref);
    if (!release) continue;
    if (write.value != release->value) {
      overrides_->acquire(write.dataref, write.value);
    } else {
      overrides_->release(write.dataref);
    }
  }
  response->result = writeAndConfirm(writes);
  response->success = isOk(response->result);
  for (const auto& value : link().read(names, options_.service_timeout)) {
    response->values.push_back(value.value_or(std::nanf("")));
  }
  logEvent(Event::SETTING, "set_dataref " + request.name + ": " + response->result.message, "", response->success);
}

void TxNode::serveRunCommand(const RunCommand::Request& request, RunCommand::Response* response) {
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    if (!linkIsUp()) {
      response->result = noLink();
      return;
    }
  }
  const core::SendStatus sent = link().command(request.name);
  response->success = sent == core::SendStatus::kSent;
  response->result = response->success ? result(ServiceResult::ACCEPTED, "sent; X-Plane never answers to a command")
                                       : result(ServiceResult::REFUSED, request.name + ": " + core::toString(sent));
}

void TxNode::servePause(bool pause, std_srvs::SetBool::Response* response) {
  const auto paused = [this] {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    return linkIsUp() ? link_status_.paused : std::nullopt;
  };
  if (!paused()) {
    response->message = noLink().message;
    return;
  }
  const std::string who = name() + "/pause";
  if (paused() != pause) {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    pause_by_ = who;
  }
  const PauseOutcome outcome =
      setPaused(&link(), pause, options_.service_timeout, [this] { return static_cast<bool>(stopping()); });
  response->success = outcome == PauseOutcome::kWasSo || outcome == PauseOutcome::kFollowed;
  response->message = response->success                   ? (pause ? "paused" : "running")
                      : outcome == PauseOutcome::kUnknown ? "X-Plane does not tell whether it is paused"
                                                          : "X-Plane did not follow in time";
  if (response->success) return;  // told when it happened
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    pause_by_.clear();
  }
  logEvent(Event::PAUSE, pause ? "pause asked for: " + response->message : "resume asked for: " + response->message,
           who, false);
}

void TxNode::serveSetView(const SetView::Request& request, SetView::Response* response) {
  if (request.view < SetView::Request::FORWARD || request.view > SetView::Request::DOWN) {
    response->result = result(ServiceResult::REFUSED, "view is " + std::to_string(request.view) +
                                                          ": expected 1 (FORWARD), 2 (REAR) or 3 (DOWN)");
    return;
  }
  response->result = writeAndConfirm(core::viewWrites(static_cast<core::CameraView>(request.view)));
  response->success = isOk(response->result);
}

}  // namespace xplane_bridge
