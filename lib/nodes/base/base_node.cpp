#include "xplane_bridge/nodes/base/base_node.hpp"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>

#include <ros/xmlrpc_manager.h>
#include <rosgraph_msgs/Clock.h>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/base/stop_signals.hpp"

namespace xplane_bridge {
namespace {

constexpr std::int64_t kDiagnosticsPeriodNs = core::kNanosecondsPerSecond;
constexpr double kServiceGrace = 0.3;      // [s]
constexpr double kReplayStopTime = 150.0;  // [s] with all that is still to be delivered
constexpr std::chrono::milliseconds kFlushTime{100};
constexpr std::chrono::milliseconds kMasterPollPeriod{200};

/// Ends the process when the stop sequence hangs; says in which step.
class StopWatchdog {
 public:
  StopWatchdog(const core::Clock& host_clock, double stop_time)
      : deadline_(host_clock, stop_time), thread_([this] { watch(); }) {}

  ~StopWatchdog() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      done_ = true;
    }
    changed_.notifyAll();
    thread_.join();
  }

  void enter(const char* step) { step_ = step; }

 private:
  void watch() {
    std::unique_lock<std::mutex> lock(mutex_);
    if (!changed_.waitUntil(&lock, deadline_, [this] { return done_; })) {
      std::fprintf(stderr, "the stop sequence hangs in: %s; ending the process\n", step_.load());
      std::_Exit(static_cast<int>(ExitCode::kStopTimeout));
    }
  }

  const core::Deadline deadline_;
  std::mutex mutex_;
  core::ClockCondition changed_;
  bool done_ = false;
  std::atomic<const char*> step_{"start"};
  std::thread thread_;
};

/// One line with the parameters that are not defaults: those of the node's own with a leading ~, as in ROS's names.
std::string givenText(const ParamLoader& shared, const ParamLoader& own) {
  std::vector<std::string> texts = shared.given();
  for (const std::string& text : own.given()) {
    texts.push_back("~" + text);
  }
  return texts.empty() ? "defaults only" : core::join(texts);
}

}  // namespace

BaseNode::BaseNode() : private_handle_("~"), topics_(&handle_) {}

BaseNode::~BaseNode() {
  if (diagnostics_thread_.joinable()) {
    requestStop("destroyed");
    diagnostics_thread_.join();
  }
}

void BaseNode::requireState(State wanted, const char* call) const {
  if (state_ != wanted) {
    throw std::logic_error(std::string(call) + " called out of order: the order is constructor, initialize, run");
  }
}

void BaseNode::initialize() {
  requireState(State::kCreated, "initialize");
  shared_ = ParamLoader::fromServer(handle_.getNamespace());
  common_ = loadCommonOptions(*shared_);
  if (common_.lockstep.enabled) {
    lockstep_clock_.emplace(host_clock_, core::toNanoseconds(common_.lockstep.start_time));
    topics_.keepAll();
  }
  clock_ = lockstep() ? lockstep_clock_->clock() : host_clock_;
  moves_ros_time_ = movesRosTime();
  showRosTime();
  const ParamLoader own = ParamLoader::fromServer(private_handle_.getNamespace());
  openWire(own);
  if (stampsBySimulator()) stampBySimulator();
  timers_ = std::make_unique<ClockTimers>(clock_, ros::getGlobalCallbackQueue());
  loadParameters(own);
  own.refuseUnknown();

  takeOverShutdownRequest();
  // With its first log line roscpp registers the node once more, for a cached parameter. Were that the line that says
  // why it ends, the master would take the old node for a new one and end the node that has replaced it.
  ROS_INFO("%s starts with %s", ros::this_node::getName().c_str(), givenText(*shared_, own).c_str());
  diagnostics_ = std::make_unique<diagnostic_updater::Updater>(handle_, private_handle_);
  diagnostics_->setHardwareID("none");
  if (moves_ros_time_ && !lockstep()) subscribers_.push_back(followClock(&immediate_));
  advertise();
  subscribe();
  state_ = State::kInitialized;
}

void BaseNode::stampBySimulator() {
  stamp_ns_ = std::make_shared<std::atomic<std::int64_t>>(stampOf(0.0));
  clock_.system_ns = [stamp = stamp_ns_] { return stamp->load(); };
  if (leadsClock()) return;
  subscribeTopic<rosgraph_msgs::Clock>(kClockTopic, 1, [this](const rosgraph_msgs::ClockConstPtr& clock) {
    *stamp_ns_ = static_cast<std::int64_t>(clock->clock.toNSec());
  });
}

/// In lock-step, ROS's time is that of the node.
void BaseNode::showRosTime() const {
  if (moves_ros_time_ && lockstep()) ros::Time::setNow(stampNow());
}

void BaseNode::subscribeWith(ros::SubscribeOptions* options, Served served) {
  options->transport_hints = ros::TransportHints().tcpNoDelay();
  if (lockstep() || (served == Served::kWhereRead && !wire_)) options->callback_queue = &immediate_;
  subscribers_.push_back(handle_.subscribe(*options));
}

void BaseNode::takeOverShutdownRequest() {
  // roscpp's own handler would call ros::shutdown() before anything is undone.
  const ros::XMLRPCManagerPtr& manager = ros::XMLRPCManager::instance();
  manager->unbind("shutdown");
  manager->bind("shutdown", [this](XmlRpc::XmlRpcValue& request, XmlRpc::XmlRpcValue& response) {
    std::string reason = "shutdown request";
    if (request.getType() == XmlRpc::XmlRpcValue::TypeArray && request.size() > 1 &&
        request[1].getType() == XmlRpc::XmlRpcValue::TypeString) {
      reason += ": " + static_cast<std::string>(request[1]);
    }
    requestStop(reason);
    response = ros::xmlrpc::responseInt(1, "", 0);
  });
}

ExitCode BaseNode::run() {
  requireState(State::kInitialized, "run");
  state_ = State::kRunning;
  try {
    if (!stopping()) {
      makeLink();
      started_ = true;
      start();
      startWire();
      startLink();
    }
  } catch (const std::exception& error) {
    requestStop(error.what(), ExitCode::kSetupError);
  }
  spinner_ = std::make_unique<ros::AsyncSpinner>(1);
  if (!stopping()) {
    spinner_->start();
    service_threads_.start();
    immediate_.open();
    if (!lockstep() && !wire_) timers_->start();
  }
  diagnostics_thread_ = std::thread([this] { diagnosticsLoop(); });
  waitForStopRequest();
  stop();
  state_ = State::kStopped;
  return exit_code_;
}

void BaseNode::requestStop(const std::string& reason, ExitCode code) {
  {
    std::lock_guard<std::mutex> lock(stop_mutex_);
    if (stop_requested_) {
      return;
    }
    stop_reason_ = reason;
    exit_code_ = code;
    stop_requested_ = true;
  }
  stop_changed_.notifyAll();
}

void BaseNode::waitForStopRequest() {
  std::unique_lock<std::mutex> lock(stop_mutex_);
  stop_changed_.wait(&lock, [this] { return stop_requested_.load(); });
  const std::string reason = stop_reason_;
  const bool failed = exit_code_ != ExitCode::kOk;
  lock.unlock();
  if (failed) {
    ROS_FATAL("stopping: %s", reason.c_str());
  } else {
    ROS_INFO("stopping: %s", reason.c_str());
  }
}

void BaseNode::stop() {
  const double stop_time = replays() ? kReplayStopTime : std::chrono::duration<double>(kStopTime).count();
  StopWatchdog watchdog(host_clock_, stop_time);
  const auto step = [&watchdog](const char* step_name, const std::function<void()>& action) {
    watchdog.enter(step_name);
    try {
      action();
    } catch (const std::exception& error) {
      ROS_ERROR("while stopping (%s): %s", step_name, error.what());
    }
  };
  if (lockstep()) {
    lockstep_clock_->release();
  }
  if (started_) {
    step("end inputs", [this] { endInputs(); });
    const Deadline deadline(wire_ ? clock_ : host_clock_, std::chrono::duration<double>(kUndoTime).count());
    step("undo in X-Plane", [&] { undo(deadline); });
    step("stop the link", [&] { stopLink(deadline); });
    step("publish the final state", [this] {
      publishFinalState();
      flushPublishers();
    });
  }
  step("shut ROS down", [] { ros::shutdown(); });
  step("join threads", [this] {
    diagnostics_thread_.join();
    if (started_) {
      joinThreads();
    }
    service_threads_.stop();
    if (wire_) wire_->endWorkers();
  });
}

void BaseNode::endInputs() {
  for (ros::Subscriber& subscriber : subscribers_) {
    subscriber.shutdown();
  }
  if (wire_) wire_->close();
  timers_->stop();
  spinner_->stop();
  service_threads_.refuse();
  stopInputs();
  const bool workers_idle = !wire_ || wire_->waitForWorkers(kServiceGrace);
  std::unique_lock<std::mutex> lock(service_mutex_);
  const auto idle = [this] { return service_calls_ == 0; };
  if (!wire_) service_idle_.waitUntil(&lock, Deadline(host_clock_, kServiceGrace), idle);
  const bool services_idle = idle();
  lock.unlock();
  if (!workers_idle || (!wire_ && !services_idle)) {
    ROS_WARN("a service call is still waiting for X-Plane; stopping without it");
  }
  // roscpp's thread does not sleep at a queue that is disabled: it would take a whole processor until the end.
  if (services_idle) service_threads_.stop();
}

void BaseNode::flushPublishers() {
  if (replays()) {
    waitForReplayDelivery();
    return;
  }
  // roscpp hands messages to its network thread and offers no way to learn when they are written.
  std::this_thread::sleep_for(kFlushTime);
}

bool BaseNode::guardedService(const std::string& service, const std::function<void()>& serve) {
  {
    std::lock_guard<std::mutex> lock(service_mutex_);
    if (stopping()) {
      ROS_WARN("%s refused: the node is stopping", service.c_str());
      return false;
    }
    ++service_calls_;
  }
  bool served = false;
  try {
    serve();
    served = true;
  } catch (const std::exception& error) {
    ROS_ERROR("%s failed: %s", service.c_str(), error.what());
  }
  {
    std::lock_guard<std::mutex> lock(service_mutex_);
    --service_calls_;
  }
  service_idle_.notifyAll();
  return served;
}

void BaseNode::addTimer(double period, std::function<void()> callback) { timers_->add(period, std::move(callback)); }

BaseNode::Alarm BaseNode::addAlarm(std::function<void()> callback) { return timers_->addAlarm(std::move(callback)); }

void BaseNode::setAlarm(Alarm alarm, std::int64_t due_ns) { timers_->setAlarm(alarm, due_ns); }

void BaseNode::addDiagnostics(const std::string& status_name,
                              std::function<void(diagnostic_updater::DiagnosticStatusWrapper&)> fill) {
  std::lock_guard<std::mutex> lock(diagnostics_mutex_);
  diagnostics_->add(status_name, std::move(fill));
}

void BaseNode::setHardwareId(const std::string& id) {
  std::lock_guard<std::mutex> lock(diagnostics_mutex_);
  diagnostics_->setHardwareID(id);
}

void BaseNode::diagnosticsLoop() {
  std::int64_t next_ns = host_clock_.steady_ns();
  std::unique_lock<std::mutex> lock(stop_mutex_);
  while (!stop_requested_) {
    lock.unlock();
    {
      std::lock_guard<std::mutex> updating(diagnostics_mutex_);
      diagnostics_->force_update();
    }
    lock.lock();
    next_ns += kDiagnosticsPeriodNs;
    stop_changed_.waitUntil(&lock, Deadline::at(host_clock_, next_ns), [this] { return stop_requested_.load(); });
  }
}

int runNode(int argc, char** argv, const std::string& default_name,
            const std::function<std::unique_ptr<BaseNode>()>& make_node) {
  // A file gets every line when it is said, as a terminal does; otherwise it would get whole blocks.
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  // Outlives the signal thread, which refers to it.
  std::unique_ptr<BaseNode> node;
  std::atomic<BaseNode*> made{nullptr};
  std::atomic<bool> initialized{false};
  try {
    const StopSignals signals([&](const std::string& signal) {
      BaseNode* const target = made;
      if (target == nullptr) {
        std::_Exit(static_cast<int>(ExitCode::kOk));  // ros::init() may be waiting for a master; nothing to undo yet
      }
      target->requestStop(signal);
      if (!initialized) {
        ros::shutdown();  // initialize() may be waiting for a master that has gone
      }
    });
    initWithOwnTime(&argc, argv, default_name, ros::init_options::NoSigintHandler);
    for (bool logged = false; !ros::master::check(); logged = true) {
      if (!logged) {
        ROS_WARN("no ROS master at %s yet; waiting (start one with roslaunch or roscore)",
                 ros::master::getURI().c_str());
      }
      std::this_thread::sleep_for(kMasterPollPeriod);
    }
    node = make_node();
    made = node.get();
    node->initialize();
    initialized = true;
    return static_cast<int>(node->run());
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    ros::shutdown();
    return static_cast<int>(ExitCode::kSetupError);
  }
}

}  // namespace xplane_bridge
