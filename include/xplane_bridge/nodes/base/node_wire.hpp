#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <ros/serialization.h>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/thread_turns.hpp"
#include "xplane_bridge/core/wire/wire_clock.hpp"
#include "xplane_bridge/nodes/base/clock_timers.hpp"
#include "xplane_bridge/nodes/base/turn_worker.hpp"

namespace xplane_bridge {

/// What reaches a node besides datagrams, while its wire is logged or replayed: messages, calls, timers and the stop.
/// All of it is acted on by the link's thread between datagrams, so that the log has one order of all things. What
/// waits for X-Plane does so on threads that the link's thread gives turns; the stop, too.
class NodeWire : public core::WireTurn {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// @param ended called on the link's thread when a replay is over, with the reason
  NodeWire(core::WireClock clock, core::Clock host, bool replays, std::function<void(const std::string&)> ended);
  ~NodeWire() override;

  const core::WireClock& wireClock() const { return clock_; }
  bool replays() const { return replays_; }
  /// Whether close() stands in the log.
  bool closed() const;
  /// Of the threads that act while the link's waits.
  const std::shared_ptr<core::ThreadTurns>& turns() const { return turns_; }

  /// What an input of that name does when it is replayed. Before the link starts.
  void onInput(const std::string& name, std::function<void(core::ByteView)> act);
  /// Live, from any thread: `act` is called on the link's thread; the log gets `name` and `bytes`.
  void post(const std::string& name, const Bytes& bytes, std::function<void()> act);
  /// The same, and waits until it was done. @throws std::runtime_error where the node ends first
  void call(const std::string& name, const Bytes& bytes, std::function<void()> act);
  /// Live: asked on the link's thread before any other input, until close(); true: it is one of that name. Before the
  /// link starts.
  void poll(const std::string& name, std::function<bool()> asks, std::function<void()> act);
  /// For calls that may wait for X-Plane: the number of a thread for them, which work() takes. Before the link starts.
  std::size_t addWorker();
  /// From the link's thread: lets a worker do it, in its turns. What it throws is thrown away.
  void work(std::size_t worker, std::function<void()> act);
  /// callWorker(): call(), done by a worker. @throws also what `act` throws
  void callWorker(const std::string& name, const Bytes& bytes, std::size_t worker, std::function<void()> act);

  /// The timers to serve; from then on they are served.
  void serve(ClockTimers* timers, std::function<void()> wake);
  /// No timer and no input any more: live, that is an input itself. From here on the calling thread has turns, so that
  /// what it does stands in the log where it belongs, too.
  void close();
  /// Waits until no worker works, `seconds` of the clock at most.
  bool waitForWorkers(double seconds);
  /// The calling thread's turns end where it next wakes the link's thread.
  void leaveOnWake();
  /// The link's thread has ended.
  void free();
  /// Waits for what workers have begun. After free().
  void endWorkers() { workers_.clear(); }

  std::int64_t nextDue() override;
  bool hasInput() override;
  bool takeInput(Bytes* input) override;
  void act(core::ByteView input) override;
  void runDue() override;
  void woken() override;
  void end() override;

 private:
  struct Input {
    Bytes bytes;  // name, zero, what it says
    std::function<void()> act;
  };

  void acceptClose(const std::string& why);

  const core::WireClock clock_;
  const core::Clock host_;
  const bool replays_;
  const std::function<void(const std::string&)> ended_;
  struct Poll {
    Bytes name;
    std::function<bool()> asks;
    std::function<void()> act;
  };

  const std::shared_ptr<core::ThreadTurns> turns_ = std::make_shared<core::ThreadTurns>();
  std::map<std::string, std::function<void(core::ByteView)>> actions_;
  std::vector<Poll> polls_;
  ClockTimers* timers_ = nullptr;
  std::function<void()> wake_;
  mutable std::mutex mutex_;
  core::ClockCondition changed_;
  std::deque<Input> inputs_;
  std::function<void()> taken_;  // of the input that is acted on
  bool closed_ = false;
  bool ends_ = false;                            // no call is waited for any more
  std::size_t working_ = 0;                      // pieces of work that have not ended
  std::unique_ptr<core::ThreadSeat> stop_seat_;  // of the thread that calls close()
  std::atomic<std::thread::id> leaves_on_wake_{};
  std::vector<std::unique_ptr<TurnWorker>> workers_;  // last: they use all of the above
};

/// A message, as ROS sends it.
template <class Message>
NodeWire::Bytes toBytes(const Message& message) {
  NodeWire::Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

template <class Message>
void fromBytes(core::ByteView bytes, Message* message) {
  NodeWire::Bytes copy(bytes.begin(), bytes.end());
  ros::serialization::IStream stream(copy.data(), static_cast<std::uint32_t>(copy.size()));
  ros::serialization::deserialize(stream, *message);
}

}  // namespace xplane_bridge
