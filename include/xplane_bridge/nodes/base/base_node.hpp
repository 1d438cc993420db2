#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/ros.h>
#include <boost/make_shared.hpp>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/lockstep_clock.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"
#include "xplane_bridge/core/wire/lockstep_hub.hpp"
#include "xplane_bridge/core/wire/replay_hub.hpp"
#include "xplane_bridge/nodes/base/advertiser.hpp"
#include "xplane_bridge/nodes/base/clock_timers.hpp"
#include "xplane_bridge/nodes/base/common_options.hpp"
#include "xplane_bridge/nodes/base/node_wire.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"
#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/base/service_threads.hpp"
#include "xplane_bridge/nodes/network/immediate_queue.hpp"
#include "xplane_bridge/nodes/network/network_thread_driver.hpp"

namespace xplane_bridge {

/// How a node's process ends.
enum class ExitCode {
  kOk = 0,            ///< stopped on request, everything undone
  kSetupError = 1,    ///< parameters or resources were refused at start; the message says which
  kRuntimeError = 2,  ///< had to stop by itself; the message says why
  kStopTimeout = 3,   ///< the orderly stop hung and was cut off
};

/// What every node of this package is built on: life cycle, parameters, diagnostics and orderly shutdown.
///
/// Life cycle, each step once and in this order, checked:
///
///     constructor       stores handles only; no parameter, topic or virtual call
///     initialize()      loadParameters() -> advertise() -> subscribe()
///     run()             the link is made -> start() -> the link starts -> callbacks until a stop is requested
///                       -> the stop sequence below -> exit code
///
/// Stop sequence, on SIGINT, SIGTERM, SIGHUP, `rosnode kill` (the master's shutdown request) or requestStop():
/// subscriptions, timers and services end -> undo() and the link's own undoing (what was changed in X-Plane, on the
/// node's own socket, at most kUndoTime; then subscriptions end, core::SimLink::kUnsubscribeTime; ROS is still there
/// but is not needed) -> publishFinalState() (latched topics) -> ros::shutdown() -> joinThreads(). If it takes longer
/// than kStopTime in all, the process ends with ExitCode::kStopTimeout and says where it hung.
///
/// Threads: subscriptions and timers are served one at a time by one thread, but for subscriptions that are
/// Served::kWhereRead; services by another one, so that a service waiting for X-Plane never delays a control callback;
/// diagnostics by a third at a steady 1 Hz; the link by a fourth, which knows no ROS and calls linkCallbacks(), or by
/// roscpp's network thread (receivesOnNetworkThread()) and one beside it, one at a time: each of these is the link's
/// thread. Hooks run on the thread that calls initialize() or run().
///
/// Time: stamps, ages, deadlines, timers and the link go by clock(), the one clock of the node. Only what must come
/// about while that clock stands goes by the host's: diagnostics and the stop sequence.
///
/// Lock-step (the shared section `lockstep`): clock() is the simulator's, and all that the node does in a frame is done
/// on the link's thread, in the order of the hooks below; timers too. A node without a link moves its clock itself.
/// That thread is roscpp's network thread, which serves the subscriptions, too (ImmediateQueue): each other thread to
/// wake is a part of a frame.
///
/// With `publish_clock` and without lock-step, only clock()'s system time is the simulator's: stamps. rx_node moves it,
/// and the others follow /clock. Receive times of datagrams stay wallClock()'s.
///
/// With a wire log (`wire_log`, without lock-step), messages, timers and the calls of advertiseInput() are the link's
/// thread's too, and clock() shows the time of the newest datagram or turn (core::WireClock). Services, the node's own
/// threads and the stop sequence run in turns() then. So what the node does follows from the log, and `wire_replay`
/// plays that back.
///
/// SIGINT, SIGTERM and SIGHUP are blocked in all threads (see StopSignals): a child process must unblock them.
class BaseNode {
 public:
  static constexpr std::chrono::milliseconds kUndoTime{1000};
  static constexpr std::chrono::milliseconds kStopTime{5000};

  BaseNode();
  virtual ~BaseNode();
  BaseNode(const BaseNode&) = delete;
  BaseNode(BaseNode&&) = delete;
  BaseNode& operator=(const BaseNode&) = delete;
  BaseNode& operator=(BaseNode&&) = delete;

  /// Reads and validates all parameters, then advertises and subscribes. Nothing is sent to X-Plane before run().
  /// @throws ParamError on parameters, std::runtime_error on resources; std::logic_error when called twice
  void initialize();

  /// Blocks until a stop is requested and carried out. @throws std::logic_error unless initialized
  ExitCode run();

  /// Asks run() to end, from any thread; the first request counts. `reason` goes to the log.
  void requestStop(const std::string& reason, ExitCode code = ExitCode::kOk);

  /// True as soon as a stop is requested.
  bool stopping() const { return stop_requested_; }

 protected:
  using Deadline = core::Deadline;

  // Hooks, in the order they are called.

  /// Fill option structs from `own` (the node's private namespace), throw ParamError on anything wrong. Keys not
  /// asked for are refused afterwards. The shared ones are in common() already.
  virtual void loadParameters(const ParamLoader& own) = 0;
  virtual void advertise() {}
  virtual void subscribe() {}
  /// Whether the node talks to X-Plane; false for one that only talks to other nodes.
  virtual bool usesLink() const { return true; }
  /// What the node wants of its link beyond the shared parameters.
  virtual void configureLink(core::SimLinkOptions* options) { static_cast<void>(options); }
  /// Called from the link's thread; must return quickly.
  virtual core::SimLinkCallbacks linkCallbacks() { return {}; }
  /// Whether roscpp's network thread receives, because what comes is published at once: what its callbacks do must be
  /// short. In lock-step it always does; where the wire is logged in its order, never.
  virtual bool receivesOnNetworkThread() const { return false; }
  /// Whether all that the node does follows from datagrams, messages, timers and inputs, so that it can be replayed.
  virtual bool wireIsOrdered() const { return false; }
  /// Subscribe datarefs with link(), open sockets, start threads. Callbacks come once this returns.
  virtual void start() {}
  /// Subscriptions, timers and services have ended; end the node's own inputs.
  virtual void stopInputs() {}
  /// Take back what was changed in X-Plane and read it back, until `deadline` (of the host's clock) at most.
  virtual void undo(const Deadline& deadline) { static_cast<void>(deadline); }
  /// Publish the last word on latched topics.
  virtual void publishFinalState() {}
  /// Join the node's own threads; ROS is down.
  virtual void joinThreads() {}

  // Hooks of lock-step, from the link's thread.

  /// The simulator's first frame is here; what was seen of frame 0 was no flight.
  virtual void beginFlight() {}
  /// All of a frame is here and clock() shows its time; nothing of it was handled.
  virtual void beginFrame(const core::LockstepFrame& frame) { static_cast<void>(frame); }
  /// All of it was handled; whether closeFrame() may come. Frame 0: whether the flight may begin.
  virtual bool frameReady(const core::LockstepFrame& frame) {
    static_cast<void>(frame);
    return true;
  }
  /// To do and send what the frame leads to. Then timers are served.
  virtual void closeFrame(const core::LockstepFrame& frame) { static_cast<void>(frame); }
  /// All of that was sent. Frame 0: more than once.
  virtual void endFrame(const core::LockstepFrame& frame) { static_cast<void>(frame); }

  /// Whether stamps are simulator time without lock-step (`publish_clock`).
  bool stampsBySimulator() const { return common_.publish_clock && !lockstep(); }
  /// Whether the node moves them itself, by setStampTime(), and follows no other clock.
  virtual bool leadsClock() const { return false; }
  /// With stampsBySimulator(): stamps from now on. @param sim_time [s]
  void setStampTime(double sim_time) { *stamp_ns_ = stampOf(sim_time); }
  /// [ns] the stamp of a simulator time [s].
  std::int64_t stampOf(double sim_time) const {
    return core::toNanoseconds(common_.lockstep.start_time) + core::toNanoseconds(sim_time);
  }

  bool lockstep() const { return lockstep_clock_.has_value(); }
  /// In lock-step, before the first frame.
  bool held() const { return lockstep() && lockstep_clock_->phase() == core::LockstepClock::Phase::kHeld; }
  /// In lock-step, for a node without a link: moves clock() to a frame's stamp and serves the timers that are due.
  void moveClock(const ros::Time& stamp);
  /// Asks frameReady() again. From any thread.
  void askFrameReady() {
    if (hub_ != nullptr) hub_->wake();
  }

  const CommonOptions& common() const { return common_; }
  /// What they were read from. From loadParameters() on.
  const ParamLoader& shared() const { return *shared_; }
  /// The clock everything in the node goes by. From loadParameters() on.
  const core::Clock& clock() const { return clock_; }
  /// For what must come about while clock() stands.
  const core::Clock& wallClock() const { return host_clock_; }
  /// The time at which something came; of the recording, in a replay.
  const core::Clock& receiveClock() const { return receive_clock_; }
  /// The clock's time as a stamp.
  ros::Time stampNow() const { return toRosTime(clock_.system_ns()); }
  /// Valid from start() to the end of undo(), only with usesLink(). What a node changes in X-Plane it records in
  /// link().journal() first.
  core::SimLink& link() { return *link_; }
  /// Relative names: topics, services.
  ros::NodeHandle& handle() { return handle_; }
  /// The node's full name.
  const std::string& name() const { return ros::this_node::getName(); }

  template <class Message>
  ros::Publisher advertiseTopic(const std::string& topic, uint32_t queue_size, bool latch = false) {
    return topics_.advertise<Message>(topic, queue_size, latch);
  }
  const Advertiser& topics() const { return topics_; }
  /// Whether all that the node does is logged, or replayed.
  bool wired() const { return wire_ != nullptr; }
  /// Whether a log is played to the node.
  bool replays() const;
  /// What a thread of the node's own needs that sends datagrams. Null without wired().
  std::shared_ptr<core::ThreadTurns> turns() const { return wire_ ? wire_->turns() : nullptr; }
  /// What else is to be asked, with wired(): `asks` before any other input of the link's thread; true: `act` follows,
  /// and is part of the wire log. From start() at the latest.
  void pollInput(const std::string& name, std::function<bool()> asks, std::function<void()> act) {
    wire_->poll(name, std::move(asks), std::move(act));
  }
  /// For what waits for X-Plane: whether to give up, because the node is stopping.
  bool ending() const { return wire_ ? wire_->closed() : stopping(); }

  /// Which thread calls back for a message.
  enum class Served {
    kInTurn,    ///< that of the timers, never beside one of them
    kWhereRead  ///< roscpp's network thread, so that no other one has to be woken: for what is short and locks what the
                ///< timers use. In lock-step all are; where the wire is logged, none is.
  };

  /// Subscribes without Nagle's delay. Use queue size 1 for control topics: the newest command counts. (What is served
  /// where it is read has no queue: after a pause of the thread, each message that waited in the socket is served.)
  template <class Message>
  void subscribeTopic(const std::string& topic, uint32_t queue_size,
                      std::function<void(const boost::shared_ptr<const Message>&)> callback,
                      Served served = Served::kInTurn) {
    if (wire_) callback = throughWire<Message>("topic " + topic, std::move(callback));
    if (wire_ && wire_->replays()) return;
    ros::SubscribeOptions options;
    options.init<Message>(topic, queue_size, std::move(callback));
    subscribeWith(&options, served);
  }

  /// The same for a callback that needs to know the publisher.
  template <class Message>
  void subscribeEvents(const std::string& topic, uint32_t queue_size,
                       std::function<void(const ros::MessageEvent<const Message>&)> callback,
                       Served served = Served::kInTurn) {
    ros::SubscribeOptions options;
    options.initByFullCallbackType<const ros::MessageEvent<const Message>&>(topic, queue_size, std::move(callback));
    subscribeWith(&options, served);
  }

  /// Advertises a service on the service thread, or on other `threads`. While stopping, calls fail at once. An
  /// exception fails the call and is logged.
  template <class Request, class Response>
  void advertiseService(const std::string& service, std::function<void(const Request&, Response&)> serve,
                        ServiceThreads* threads = nullptr) {
    if (wire_) serve = throughWorker<Request, Response>("service " + service, std::move(serve), threads != nullptr);
    advertiseApart<Request, Response>(service, std::move(serve), threads);
  }

  /// The same for a service that does not wait, and on which later topics depend: the wire log has it done by the
  /// link's thread.
  template <class Request, class Response>
  void advertiseInput(const std::string& service, std::function<void(const Request&, Response&)> serve) {
    const std::string input = "service " + service;
    if (wire_) {
      wire_->onInput(input, [serve](core::ByteView bytes) {
        Request request;
        Response response;
        fromBytes(bytes, &request);
        serve(request, response);
      });
      serve = [this, serve, input](const Request& request, Response& response) {
        const auto given = std::make_shared<std::pair<Request, Response>>(request, Response());
        wire_->call(input, toBytes(request), [serve, given] { serve(given->first, given->second); });
        response = given->second;
      };
    }
    advertiseApart<Request, Response>(service, std::move(serve));
  }

  /// The same for a service on which nothing else of the node depends: it is no part of the wire log.
  template <class Request, class Response>
  void advertiseApart(const std::string& service, std::function<void(const Request&, Response&)> serve,
                      ServiceThreads* threads = nullptr) {
    if (replays()) return;
    ros::AdvertiseServiceOptions options;
    options.init<Request, Response>(service, [this, service, serve](Request& request, Response& response) {
      return guardedService(service, [&] { serve(request, response); });
    });
    options.callback_queue = (threads != nullptr ? threads : &service_threads_)->queue();
    services_.push_back(handle_.advertiseService(options));
  }

  /// Calls `callback` every `period` [s] of clock(), on the thread of Served::kInTurn. From advertise() and
  /// subscribe() only.
  void addTimer(double period, std::function<void()> callback);

  /// A timer that is due once each time it is set, on the same thread. From advertise() and subscribe() only.
  using Alarm = core::TimerSchedule::Timer;
  Alarm addAlarm(std::function<void()> callback);
  /// Lets an alarm go off at `due_ns` [ns] of clock()'s steady time, instead of what it was set to before.
  void setAlarm(Alarm alarm, std::int64_t due_ns);

  /// Adds a status to /diagnostics, filled at 1 Hz on the diagnostics thread: `fill` must lock what it reads.
  void addDiagnostics(const std::string& status_name,
                      std::function<void(diagnostic_updater::DiagnosticStatusWrapper&)> fill);
  /// What the diagnostics are about, e.g. "X-Plane 11.55 at 192.168.1.20:49000".
  void setHardwareId(const std::string& id);

 private:
  enum class State { kCreated, kInitialized, kRunning, kStopped };

  void stampBySimulator();
  void subscribeWith(ros::SubscribeOptions* options, Served served);
  void showRosTime() const;
  void openWire(const ParamLoader& own);
  void startWire();
  void logUserFiles();
  /// Reports what was replayed; returns when who asked for the replay has all that was published.
  void waitForReplayDelivery();
  /// A message's callback that goes through the wire log.
  template <class Message>
  std::function<void(const boost::shared_ptr<const Message>&)> throughWire(
      const std::string& input, std::function<void(const boost::shared_ptr<const Message>&)> callback) {
    wire_->onInput(input, [callback](core::ByteView bytes) {
      const auto message = boost::make_shared<Message>();
      fromBytes(bytes, message.get());
      callback(message);
    });
    return [this, input, callback](const boost::shared_ptr<const Message>& message) {
      wire_->post(input, toBytes(*message), [callback, message] { callback(message); });
    };
  }
  /// A service that a worker serves, so that it goes through the wire log and may wait. @param alone it has its own
  template <class Request, class Response>
  std::function<void(const Request&, Response&)> throughWorker(const std::string& input,
                                                               std::function<void(const Request&, Response&)> serve,
                                                               bool alone) {
    if (!alone && !service_worker_) service_worker_ = wire_->addWorker();
    const std::size_t worker = alone ? wire_->addWorker() : *service_worker_;
    wire_->onInput(input, [this, serve, worker](core::ByteView bytes) {
      const auto request = std::make_shared<Request>();
      fromBytes(bytes, request.get());
      wire_->work(worker, [serve, request] {
        Response response;
        serve(*request, response);
      });
    });
    return [this, serve, worker, input](const Request& request, Response& response) {
      const auto given = std::make_shared<std::pair<Request, Response>>(request, Response());
      wire_->callWorker(input, toBytes(request), worker, [serve, given] { serve(given->first, given->second); });
      response = given->second;
    };
  }
  void makeLink();
  core::LockstepHooks lockstepHooks();
  void startLink();
  void stopLink(const Deadline& deadline);
  void requireState(State wanted, const char* call) const;
  bool guardedService(const std::string& service, const std::function<void()>& serve);
  void takeOverShutdownRequest();
  void waitForStopRequest();
  void stop();
  void endInputs();
  void flushPublishers();
  void diagnosticsLoop();

  State state_ = State::kCreated;
  bool started_ = false;
  ros::NodeHandle handle_;
  ros::NodeHandle private_handle_;
  Advertiser topics_;
  std::optional<ParamLoader> shared_;  // from initialize() on
  CommonOptions common_;
  const core::Clock host_clock_ = core::hostClock();
  core::Clock clock_;
  core::Clock receive_clock_ = host_clock_;
  std::optional<core::LockstepClock> lockstep_clock_;
  std::shared_ptr<std::atomic<std::int64_t>> stamp_ns_;  // with stampsBySimulator()
  bool moves_ros_time_ = false;                          // `use_sim_time` is set

  ImmediateQueue immediate_;  // of the subscriptions that are served where they are read
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;
  ServiceThreads service_threads_{1};
  std::unique_ptr<ClockTimers> timers_;

  std::unique_ptr<NodeWire> wire_;  // null: the wire is neither logged nor replayed, or not in order
  std::optional<std::size_t> service_worker_;
  const std::shared_ptr<core::ReplayProgress> replayed_ = std::make_shared<core::ReplayProgress>();
  std::unique_ptr<core::DatagramHub> hub_of_link_;  // until there is a link
  core::DatagramHub* waking_ = nullptr;             // the link's
  std::unique_ptr<core::SimLink> link_;
  core::LockstepHub* hub_ = nullptr;             // of the link, in lock-step
  std::unique_ptr<NetworkThreadDriver> driver_;  // of the link, where it has no thread of its own

  std::mutex service_mutex_;
  core::ClockCondition service_idle_;
  int service_calls_ = 0;  // under way, of any queue

  std::mutex diagnostics_mutex_;
  std::unique_ptr<diagnostic_updater::Updater> diagnostics_;
  std::thread diagnostics_thread_;

  mutable std::mutex stop_mutex_;
  core::ClockCondition stop_changed_;
  std::atomic<bool> stop_requested_{false};
  std::string stop_reason_;
  ExitCode exit_code_ = ExitCode::kOk;
};

/// The whole of a node's main(): initialises ROS without its own signal handler, waits for the master (Ctrl-C ends the
/// wait), builds the node, initialises and runs it. Errors go to the log and stderr. Returns the process's exit code.
int runNode(int argc, char** argv, const std::string& default_name,
            const std::function<std::unique_ptr<BaseNode>()>& make_node);

template <class Node>
int runNode(int argc, char** argv, const std::string& default_name) {
  return runNode(argc, argv, default_name, [] { return std::make_unique<Node>(); });
}

}  // namespace xplane_bridge
