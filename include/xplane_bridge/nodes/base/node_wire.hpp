#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <ros/serialization.h>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/wire/wire_clock.hpp"
#include "xplane_bridge/nodes/base/clock_timers.hpp"

namespace xplane_bridge {

/// What reaches a node besides datagrams, while its wire is logged or replayed: messages, calls, timers and the stop.
/// All of it is acted on by the link's thread between datagrams, so that the log has one order of all things.
class NodeWire : public core::WireTurn {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// @param ended called on the link's thread when a replay is over, with the reason
  NodeWire(core::WireClock clock, core::Clock host, bool replays, std::function<void(const std::string&)> ended);

  const core::WireClock& wireClock() const { return clock_; }
  bool replays() const { return replays_; }

  /// What an input of that name does when it is replayed. Before the link starts.
  void onInput(const std::string& name, std::function<void(core::ByteView)> act);
  /// Live, from any thread: `act` is called on the link's thread; the log gets `name` and `bytes`.
  void post(const std::string& name, const Bytes& bytes, std::function<void()> act);
  /// The same, and waits until it was done. False: the link's thread does not come to it.
  bool call(const std::string& name, const Bytes& bytes, std::function<void()> act);

  /// The timers to serve; from then on they are served.
  void serve(ClockTimers* timers, std::function<void()> wake);
  /// No timer and no input any more: live, that is an input itself.
  void close();
  /// Holds the link's thread until something wakes it, so that the stop begins at a place that the log knows.
  void holdForStop();

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

  void hold();

  const core::WireClock clock_;
  const core::Clock host_;
  const bool replays_;
  const std::function<void(const std::string&)> ended_;
  std::map<std::string, std::function<void(core::ByteView)>> actions_;
  ClockTimers* timers_ = nullptr;
  std::function<void()> wake_;
  std::mutex mutex_;
  core::ClockCondition changed_;
  std::deque<Input> inputs_;
  std::function<void()> taken_;  // of the input that is acted on
  bool closed_ = false;
  bool holds_ = false;  // the link's thread is held
  bool released_ = false;
  bool records_ended_ = false;
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
