// What tx_node subscribes to, and lock-step: commands wait for the end of their frame, and timers are its frames.

#include <utility>

#include <sensor_msgs/Joy.h>
#include <std_msgs/Header.h>
#include <std_srvs/Trigger.h>

#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/nodes/base/service_result.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {
namespace {

constexpr std::uint32_t kServiceThreads = 2;  // hold and run work while a step waits
constexpr double kFrameWait = 5.0;            // [s] without a frame in which X-Plane counts as standing

}  // namespace

void TxNode::makeLockstep() {
  options_.actuation.control.each_frame = true;
  // What an earlier run has left must make no difference.
  options_.actuation.surfaces.mixing_folder.clear();
  lockstep_ = std::make_unique<TxLockstep>(
      common().lockstep, wallClock(), stampNow(), [this] { askFrameReady(); },
      [this](const std::string& why) { requestStop(why, ExitCode::kRuntimeError); });
  events_.mute(true);
  frame_mode_publisher_ = advertiseTopic<ControlMode>(kLockstepModeTopic, kLockstepQueue);
}

void TxNode::advertiseLockstep() {
  advertiseService<LockstepStep::Request, LockstepStep::Response>(
      "lockstep/step",
      [this](const auto& request, auto& response) {
        lockstep_ ? serveStep(request, &response) : serveFreeStep(request, &response);
      },
      &lockstep_queue_);
  const auto advertise = [this](const std::string& service, bool running, const std::string& answer) {
    advertiseService<std_srvs::Trigger::Request, std_srvs::Trigger::Response>(
        "lockstep/" + service,
        [this, running, answer](const auto&, auto& response) {
          const std::string why_not = setRunning(running);
          response.success = why_not.empty();
          response.message = response.success ? answer : why_not;
        },
        &lockstep_queue_);
  };
  advertise("run", true, "flies on");
  advertise("hold", false, "holds the present frame");
  lockstep_spinner_ = std::make_unique<ros::AsyncSpinner>(kServiceThreads, &lockstep_queue_);
}

std::string TxNode::setRunning(bool running) {
  if (lockstep_) {
    running ? lockstep_->run() : lockstep_->step(0);
    return "";
  }
  const RequestResult result = actuation_->setPaused(!running, name() + "/lockstep");
  return result.success() ? "" : result.text;
}

template <class Message>
void TxNode::subscribeCommands(const std::string& topic, int rank, std::function<void(const Message&)> take) {
  if (!lockstep_) {
    subscribeTopic<Message>(topic, 1, [take = std::move(take)](const auto& message) { take(*message); });
    return;
  }
  subscribeEvents<Message>(topic, kLockstepQueue, [this, rank, take](const ros::MessageEvent<const Message>& event) {
    const boost::shared_ptr<const Message>& message = event.getConstMessage();
    lockstep_->takeCommand(event.getPublisherName(), message->header.stamp, rank, [take, message] { take(*message); });
  });
}

template <class Message>
void TxNode::subscribeRequests(const std::string& topic, std::uint32_t queue_size, int rank,
                               std::function<void(const Message&)> take) {
  if (!lockstep_) {
    subscribeTopic<Message>(topic, queue_size, [take = std::move(take)](const auto& message) { take(*message); });
    return;
  }
  subscribeEvents<Message>(topic, kLockstepQueue, [this, rank, take](const ros::MessageEvent<const Message>& event) {
    const boost::shared_ptr<const Message>& message = event.getConstMessage();
    lockstep_->takeRequest(event.getPublisherName(), message->header.stamp, rank, [take, message] { take(*message); });
  });
}

void TxNode::subscribe() {
  subscribeCommands<ControlCommand>(
      "control/manual", 0, [this](const ControlCommand& command) { onCommand(core::FlightMode::kManual, command); });
  subscribeCommands<ControlCommand>(
      "control/auto", 1, [this](const ControlCommand& command) { onCommand(core::FlightMode::kAuto, command); });
  subscribeCommands<SurfaceCommand>("control/surfaces", 2,
                                    [this](const SurfaceCommand& command) { onSurfaceCommand(command); });
  // These are few and none may be lost.
  subscribeRequests<ModeRequest>("control/mode_request", 20, 0,
                                 [this](const ModeRequest& request) { onModeRequest(request); });
  // Of traffic the newest list counts.
  subscribeRequests<TrafficCommand>("traffic/command", 1, 1,
                                    [this](const TrafficCommand& command) { onTraffic(command); });
  if (lockstep_) {
    subscribeEvents<std_msgs::Header>(kLockstepDoneTopic, kLockstepQueue,
                                      [this](const ros::MessageEvent<const std_msgs::Header>& event) {
                                        const auto& done = event.getConstMessage();
                                        lockstep_->takeDone(event.getPublisherName(), done->stamp, done->frame_id);
                                      });
    // Its publisher has answered with it; joystick_mapper_node makes a command of it.
    subscribeEvents<sensor_msgs::Joy>(
        "joy", kLockstepQueue, [this](const ros::MessageEvent<const sensor_msgs::Joy>& event) {
          lockstep_->takeDone(event.getPublisherName(), event.getConstMessage()->header.stamp, "");
        });
    return;
  }
  addTimer(1.0 / options_.actuation.control.rate, [this] { tick(); });
  deadline_ = addAlarm([this] { tick(); });
}

void TxNode::beginFlight() {
  lockstep_->leaveFrameZero();
  events_.mute(false);
  actuation_->beginFlight();
}

void TxNode::beginFrame(const core::LockstepFrame& frame) { lockstep_->open(frame, stampNow()); }

bool TxNode::frameReady(const core::LockstepFrame& frame) {
  return (frame.number > 0 || actuation_->knowsFlight()) && lockstep_->ready();
}

void TxNode::closeFrame(const core::LockstepFrame& frame) {
  if (frame.number > 0) lockstep_->close();
  actuation_->tick();
  if (held()) return;
  frame_mode_.emplace();
  frame_mode_->header.stamp = stampNow();
  toMessage(actuation_->path().mode(), actuation_->simTime(), &*frame_mode_);
}

void TxNode::endFrame(const core::LockstepFrame& frame) {
  link().write(core::kFenceDataref, static_cast<float>(frame.number));
  // While the simulator is at its next frame.
  if (frame_mode_) frame_mode_publisher_.publish(*frame_mode_);
  frame_mode_.reset();
}

void TxNode::serveStep(const LockstepStep::Request& request, LockstepStep::Response* response) {
  const std::uint32_t before = lockstep_->frame();
  lockstep_->step(request.frames);
  response->success = lockstep_->waitUntilHeld();
  response->flown = lockstep_->frame() - before;
  response->sim_time = actuation_->simTime();
  response->result =
      response->success ? result(ServiceResult::OK, "flown and held") : result(ServiceResult::NO_LINK, "tx_node ends");
}

void TxNode::serveFreeStep(const LockstepStep::Request& request, LockstepStep::Response* response) {
  const std::uint64_t before = actuation_->framesFlown();
  const auto flown = [this, before] { return actuation_->framesFlown() - before; };
  std::string why_not = request.frames > 0 ? setRunning(true) : "";
  while (why_not.empty() && flown() < request.frames && !ending()) {
    const std::uint64_t seen = flown();
    if (!link().waitUntil([&] { return flown() != seen || ending(); }, kFrameWait)) why_not = "no frame comes";
  }
  const std::string not_held = setRunning(false);
  if (why_not.empty()) why_not = not_held;
  response->success = why_not.empty();
  response->flown = static_cast<std::uint32_t>(flown());
  response->sim_time = actuation_->simTime();
  response->result = response->success
                         ? result(ServiceResult::OK, "flown and paused: X-Plane does not wait for answers")
                         : result(ServiceResult::NO_LINK, why_not);
}

}  // namespace xplane_bridge
