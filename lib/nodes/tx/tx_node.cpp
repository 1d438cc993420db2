#include "xplane_bridge/nodes/tx/tx_node.hpp"

#include <algorithm>
#include <utility>

#include <sensor_msgs/Joy.h>
#include <std_msgs/Header.h>
#include <std_srvs/Trigger.h>

#include "xplane_bridge/nodes/messages/control_conversions.hpp"
#include "xplane_bridge/nodes/tx/actuation_diagnostics.hpp"

namespace xplane_bridge {
namespace {

constexpr double kOldestPoses = 1.0;  // [s] in lock-step; what is older has no stamp of the flight

}  // namespace

// --- life cycle ---

void TxNode::loadParameters(const ParamLoader& own) { options_ = loadTxOptions(own, common().aircraft); }

void TxNode::advertise() {
  publishers_.advertise(topics(), clock(), [this] { return held(); });
  if (lockstep()) makeLockstep();
  advertiseLockstep();
  advertiseServices();
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
  ActuationHooks hooks = publishers_.hooks();
  hooks.stopping = [this] { return ending(); };
  actuation_ = std::make_unique<Actuation>(&link(), options_.actuation, std::move(hooks));
  intake_ = std::make_unique<CommandIntake>(actuation_.get());
  services_ = std::make_unique<TxServices>(actuation_.get(), &publishers_.events(), [this] { return stampNow(); });
  lockstep_services_ = std::make_unique<LockstepServices>(
      lockstep_.get(), actuation_.get(), &link(), [this] { return ending(); }, name() + "/lockstep");
  actuation_->start();
  step_threads_.start();
  hold_threads_.start();
  startBeating();
  mode_threads_.start();  // its calls look at the heartbeat
}

void TxNode::startBeating() {
  if (lockstep()) return;  // a frame may take long: the guardian acts on death only
  const auto beat = [this] { guardian_.beat(options_.hang_timeout); };
  const auto acted = [this] { return guardian_.hasActed(); };
  const auto on_hang = [this] { actuation_->onHang(); };
  if (wired()) {
    pollInput(
        "hang",
        [beat, acted] {
          const bool hung = acted();
          beat();
          return hung;
        },
        on_hang);
  } else {
    heartbeat_.start(handle(), {beat, acted, on_hang});
  }
}

void TxNode::tick() {
  heartbeat_.beat();  // first: after a hang nothing may be sent as before
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
  if (lockstep_) lockstep_->stop();
  mode_threads_.stop();
  step_threads_.stop();
  hold_threads_.stop();
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

template <class Message>
void TxNode::subscribeInFrames(const std::string& topic, std::uint32_t queue_size, Answers answers, int rank,
                               std::function<void(const Message&)> take, Served served) {
  if (!lockstep_) {
    const auto take_now = [this, take = std::move(take)](const auto& message) {
      heartbeat_.look();  // no beat: it does not show that the timers go on
      take(*message);
    };
    subscribeTopic<Message>(topic, queue_size, take_now, served);
    return;
  }
  subscribeEvents<Message>(
      topic, kLockstepQueue, [this, answers, rank, take](const ros::MessageEvent<const Message>& event) {
        const auto& message = event.getConstMessage();
        const auto carry_out = [take, message] { take(*message); };
        answers == Answers::kFrames
            ? lockstep_->takeCommand(event.getPublisherName(), message->header.stamp, rank, carry_out)
            : lockstep_->takeRequest(event.getPublisherName(), message->header.stamp, rank, carry_out);
      });
}

void TxNode::subscribe() {
  subscribeInFrames<ControlCommand>("control/manual", 1, Answers::kFrames, 0,
                                    [this](const auto& command) { onCommand(core::FlightMode::kManual, command); });
  subscribeInFrames<ControlCommand>("control/auto", 1, Answers::kFrames, 1,
                                    [this](const auto& command) { onCommand(core::FlightMode::kAuto, command); });
  subscribeInFrames<SurfaceCommand>("control/surfaces", 1, Answers::kFrames, 2,
                                    [this](const auto& command) { intake_->onSurfaceCommand(command); });
  // These are few and none may be lost.
  subscribeInFrames<ModeRequest>("control/mode_request", 20, Answers::kNothing, 0,
                                 [this](const auto& request) { intake_->onModeRequest(request); });
  // Of traffic the newest list counts; each aircraft taken is a wait for the journal's disk.
  subscribeInFrames<TrafficCommand>(
      "traffic/command", 1, Answers::kNothing, 1, [this](const auto& command) { onTraffic(command); }, Served::kInTurn);
  if (lockstep_) {
    subscribeAnswers();
    return;
  }
  addTimer(1.0 / options_.actuation.control.rate, [this] { tick(); });
  deadline_ = addAlarm([this] { tick(); });
}

void TxNode::onCommand(core::FlightMode from, const ControlCommand& message) {
  if (const auto time_ns = intake_->onCommand(from, message)) setAlarm(deadline_, *time_ns);
}

void TxNode::onTraffic(const TrafficCommand& message) {
  // In lock-step it is carried out some frames after its own, whose time its stamp is.
  const double age = lockstep_ ? (stampNow() - message.header.stamp).toSec() : 0.0;
  intake_->onTraffic(message, age > 0.0 && age < kOldestPoses ? age : 0.0);
}

// --- services ---

template <class Service, class Serve>
void TxNode::advertiseOwn(const std::string& service, Serve serve, ServiceThreads* threads) {
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  const std::string full_name = name() + "/" + service;
  const auto serve_now = [this, serve, full_name](const Request& request, Response& response) {
    if (lockstep_) lockstep_->waitUntilOpen();
    heartbeat_.look();
    serve(request, &response, full_name);
  };
  advertiseService<Request, Response>(full_name, serve_now, threads);
}

template <class Service>
void TxNode::advertiseOwn(const std::string& service, ServiceThreads* threads) {
  const auto serve = [this](const auto& request, auto* response, const std::string& who) {
    services_->serve(request, response, who);
  };
  advertiseOwn<Service>(service, serve, threads);
}

void TxNode::advertiseServices() {
  advertiseOwn<SetMode>("set_mode", &mode_threads_);
  advertiseOwn<SetDataref>("set_dataref");
  advertiseOwn<RunCommand>("run_command");
  advertiseOwn<std_srvs::SetBool>("pause");
  advertiseOwn<SetView>("set_view");
  advertiseOwn<SetFailure>("set_failure");
  advertiseOwn<ClearFailures>("clear_failures");
  advertiseOwn<InjectExcitation>("inject_excitation");
  advertiseOwn<IdentifySurfaces>("identify_surfaces");
  advertiseOwn<ResetFlight>("reset_flight");
  advertiseOwn<SetWind>("set_wind");
  advertiseOwn<SetTime>("set_time");
  advertiseOwn<SetWeather>("set_weather");
  advertiseOwn<SetAutopilot>("set_autopilot");
  advertiseOwn<SetLoading>("set_loading");
  advertiseOwn<LoadAircraft>("load_aircraft");
  advertiseOwn<Situation>("save_state", [this](const auto&... call) { services_->saveSituation(call...); });
  advertiseOwn<Situation>("load_state", [this](const auto&... call) { services_->loadSituation(call...); });
  advertiseOwn<SetDisturbance>("disturb");
}

void TxNode::advertiseLockstep() {
  advertiseService<LockstepStep::Request, LockstepStep::Response>(
      "lockstep/step", [this](const auto& request, auto& response) { lockstep_services_->step(request, &response); },
      &step_threads_);
  const auto advertise = [this](const std::string& service, bool running, const std::string& answer) {
    advertiseService<std_srvs::Trigger::Request, std_srvs::Trigger::Response>(
        "lockstep/" + service,
        [this, running, answer](const auto&, auto& response) {
          const std::string why_not = lockstep_services_->setRunning(running);
          response.success = why_not.empty();
          response.message = response.success ? answer : why_not;
        },
        &hold_threads_);
  };
  advertise("run", true, "flies on");
  advertise("hold", false, "holds the present frame");
}

// --- diagnostics ---

void TxNode::advertiseDiagnostics() {
  using Status = diagnostic_updater::DiagnosticStatusWrapper;
  addDiagnostics("control", [this](Status& status) {
    if (actuation_) fillDiagnostics(actuation_->control(), &status);
  });
  addDiagnostics("guardian", [this](Status& status) { watchGuardian(&guardian_, &status); });
  addDiagnostics("surfaces", [this](Status& status) {
    if (actuation_) fillDiagnostics(actuation_->surfaces().status(), &status);
  });
  addDiagnostics("failures", [this](Status& status) {
    if (actuation_) fillDiagnostics(actuation_->failures().snapshot(), &status);
  });
}

// --- lock-step: commands wait for the end of their frame, and the node's timers are its frames ---

void TxNode::makeLockstep() {
  options_.actuation.control.each_frame = true;
  // What an earlier run has left must make no difference.
  options_.actuation.surfaces.mixing_folder.clear();
  lockstep_ = std::make_unique<TxLockstep>(
      common().lockstep, wallClock(), stampNow(), [this] { askFrameReady(); },
      [this](const std::string& why) { requestStop(why, ExitCode::kRuntimeError); });
  publishers_.events().mute(true);
  frame_mode_publisher_ = advertiseTopic<ControlMode>(kLockstepModeTopic, kLockstepQueue);
}

void TxNode::subscribeAnswers() {
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
}

void TxNode::beginFlight() {
  lockstep_->leaveFrameZero();
  publishers_.events().mute(false);
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

}  // namespace xplane_bridge
