#include "xplane_bridge/nodes/joystick/joy_functions.hpp"

#include <utility>

#include <ros/service.h>
#include <std_srvs/SetBool.h>

#include "xplane_bridge/ClearFailures.h"
#include "xplane_bridge/RunCommand.h"
#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/SetFailure.h"
#include "xplane_bridge/SetView.h"

namespace xplane_bridge {
namespace {

constexpr std::size_t kMostWaiting = 8;
constexpr Range<int> kButtons{0, 255};
const std::vector<std::string> kKinds = {"pause", "command", "view", "failure"};
const std::vector<std::string> kViews = {"forward", "rear", "down", "cockpit"};  // in the order of SetView's numbers

/// Also what X-Plane has not shown in time, or not as it should, may stand, or come true when it goes on.
bool mayBeBroken(const ServiceResult& result) {
  return result.code == ServiceResult::OK || result.code == ServiceResult::ACCEPTED ||
         result.code == ServiceResult::TIMEOUT;
}

JoyFunction functionOf(const std::string& name, const ParamLoader& in) {
  JoyFunction out;
  out.key = "functions." + name;
  out.button = in.integer("button", kButtons);
  const std::string kind = in.choice("does", kKinds);
  if (kind == "command") {
    out.kind = JoyFunction::Kind::kCommand;
    out.name = in.text("command");
  }
  if (kind == "view") {
    out.kind = JoyFunction::Kind::kView;
    const std::string view = in.choice("view", kViews);
    out.view = SetView::Request::FORWARD;
    for (std::size_t i = 0; i < kViews.size() && kViews[i] != view; ++i) ++out.view;
  }
  if (kind == "failure") {
    out.kind = JoyFunction::Kind::kFailure;
    out.name = in.text("name");
    out.failure = in.text("kind");
    if (in.has("value")) out.value = static_cast<float>(in.number("value", {}));
  }
  return out;
}

}  // namespace

std::vector<JoyFunction> loadJoyFunctions(const ParamLoader& own) {
  std::vector<JoyFunction> out;
  for (const auto& [name, in] : own.section("functions").namedSections()) out.push_back(functionOf(name, in));
  return out;
}

JoyFunctions::JoyFunctions(std::vector<JoyFunction> functions, Report report)
    : functions_(std::move(functions)),
      report_(std::move(report)),
      worker_(kMostWaiting, [this](std::size_t index) { carryOut(index); }) {}

void JoyFunctions::press(std::size_t function) { worker_.pushDroppingOldest(function); }

void JoyFunctions::carryOut(std::size_t index) {
  const JoyFunction& function = functions_[index];
  std::string problem;
  switch (function.kind) {
    case JoyFunction::Kind::kPause:
      problem = pause();
      break;
    case JoyFunction::Kind::kCommand:
      problem = runCommand(function);
      break;
    case JoyFunction::Kind::kView:
      problem = setView(function);
      break;
    case JoyFunction::Kind::kFailure:
      problem = toggleFailure(function);
      break;
  }
  report_(function.key + ": " + (problem.empty() ? "done" : problem), problem.empty());
}

template <class Service>
std::string JoyFunctions::call(const std::string& service, Service* message) {
  const std::string name = handle_.resolveName("tx_node/" + service);
  return ros::service::call(name, *message) ? "" : name + " does not answer: does tx_node run?";
}

std::string JoyFunctions::pause() {
  std_srvs::SetBool message;
  message.request.data = static_cast<std::uint8_t>(!paused_);
  std::string problem = call("pause", &message);
  if (!problem.empty()) return problem;
  if (!message.response.success) return message.response.message;
  paused_ = message.request.data != 0;
  return "";
}

std::string JoyFunctions::runCommand(const JoyFunction& function) {
  RunCommand message;
  message.request.name = function.name;
  std::string problem = call("run_command", &message);
  if (!problem.empty()) return problem;
  return message.response.success ? "" : message.response.result.message;
}

std::string JoyFunctions::setView(const JoyFunction& function) {
  SetView message;
  message.request.view = function.view;
  std::string problem = call("set_view", &message);
  if (!problem.empty()) return problem;
  return message.response.success ? "" : message.response.result.message;
}

std::string JoyFunctions::toggleFailure(const JoyFunction& function) {
  const auto broken = broken_.find(function.name);
  if (broken == broken_.end()) return setFailure(function);
  ClearFailures message;
  message.request.names = {function.name};
  std::string problem = call("clear_failures", &message);
  if (!problem.empty()) return problem;
  // tx_node has given up what X-Plane did not show in time: nothing was broken that this press could repair.
  const bool given_up =
      broken->second == ServiceResult::TIMEOUT && message.response.result.code == ServiceResult::REFUSED;
  // Whatever the answer: what another client has repaired is refused, and would be so at every press.
  broken_.erase(broken);
  if (given_up) return setFailure(function);
  return message.response.success ? "" : message.response.result.message;
}

std::string JoyFunctions::setFailure(const JoyFunction& function) {
  SetFailure message;
  message.request.name = function.name;
  message.request.kind = function.failure;
  message.request.has_value = static_cast<std::uint8_t>(function.value.has_value());
  message.request.value = function.value.value_or(0.0F);
  std::string problem = call("set_failure", &message);
  if (!problem.empty()) return problem;
  const ServiceResult& result = message.response.result;
  if (mayBeBroken(result)) broken_[function.name] = result.code;
  return message.response.success ? "" : result.message;
}

}  // namespace xplane_bridge
