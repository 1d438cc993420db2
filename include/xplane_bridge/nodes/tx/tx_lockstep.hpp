#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <ros/time.h>

#include "xplane_bridge/actuation/lockstep_barrier.hpp"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/wire/lockstep_hub.hpp"
#include "xplane_bridge/nodes/base/common_options.hpp"

namespace xplane_bridge {

/// tx_node as the barrier of lock-step: keeps what arrives until its frame is answered by all, then carries it out in
/// an order that does not depend on when it came: participants as named, by topic. Ends the run where an answer stays
/// away. Thread-safe.
class TxLockstep {
 public:
  using Action = std::function<void()>;

  /// @param host clock of the watchdog
  /// @param start stamp of frame 0
  /// @param wake lets the link's thread ask ready() again
  /// @param give_up ends the run, in words that say why
  TxLockstep(const LockstepOptions& options, core::Clock host, const ros::Time& start, Action wake,
             std::function<void(const std::string&)> give_up);
  /// stop()
  ~TxLockstep();
  TxLockstep(const TxLockstep&) = delete;
  TxLockstep& operator=(const TxLockstep&) = delete;

  // What arrives. `who`: full name of the node.

  /// A command, which answers the frame of its stamp. `topic` orders those of one node.
  void takeCommand(const std::string& who, const ros::Time& stamp, int topic, Action carry_out);
  /// A request, which answers nothing. It is carried out in the second frame after that of its stamp: it comes over a
  /// connection of its own, perhaps after the command that answers its frame, or together with the next one. Those that
  /// are due together are carried out by stamp, node and `topic`.
  void takeRequest(const std::string& who, const ros::Time& stamp, int topic, Action carry_out);
  /// lockstep/done. `said`: its frame_id.
  void takeDone(const std::string& who, const ros::Time& stamp, const std::string& said);

  // The link's thread.

  void open(const core::LockstepFrame& frame, const ros::Time& stamp);
  /// All of the frame was handled; in frame 0, the flight is known, too. Says whether close() may come.
  bool ready();
  /// Carries out what is due.
  void close();
  /// The first frame that flies is here.
  void leaveFrameZero() { barrier_.close(); }

  // Services.

  enum class Held : std::uint8_t { kHeld, kReplaced, kStopped };
  /// What one call lets fly, until it is held or another call takes its place.
  class Flight;

  /// Takes the place of a step that waits; 0 frames hold it where it is.
  /// @return for waitUntilHeld()
  std::shared_ptr<const Flight> step(std::uint32_t frames);
  /// Takes the place of a step that waits.
  void run();
  /// Waits until a frame is open and was handled, or stop(): a participant may have seen a frame before tx_node has,
  /// and what it asks for belongs to that frame.
  void waitUntilOpen();
  /// Waits until the flight's last frame is answered and held, or another call lets it fly, or stop().
  Held waitUntilHeld(const std::shared_ptr<const Flight>& flight);
  std::uint32_t frame() const { return barrier_.number(); }

  /// Ends the watchdog and all waiting.
  void stop();

 private:
  struct Command {
    std::size_t rank;
    int topic;
    std::int64_t stamp_ns;
    Action carry_out;
  };
  struct Request {
    Command what;
    int frames_waited;
  };

  void beginFlight();  // under mutex_
  /// Lets the link's thread look, if there is something to see: an answer that is not the last one does not wake it.
  void wakeIfAnswered();
  void progress();
  void watch();
  std::string whatIsMissing() const;
  /// What a participant that has not answered has said it waits for, in words; empty: nothing.
  std::string reasonOf(const std::string& participant) const;

  const LockstepOptions options_;
  const core::Clock host_;
  const Action wake_;
  const std::function<void(const std::string&)> give_up_;
  LockstepBarrier barrier_;

  mutable std::mutex mutex_;  // guards the following
  // Each for who waits for that: a frame is answered several times, and a thread that is woken for nothing costs time.
  core::ClockCondition opened_;
  core::ClockCondition held_;
  core::ClockCondition ended_;
  std::vector<Command> commands_;
  std::vector<Request> requests_;
  std::map<std::string, std::string> reasons_;  // full name of a node to what it waits for, until it answers
  std::int64_t stamp_ns_;
  std::int64_t previous_ns_;  // stamp of the frame before
  bool closed_ = false;       // the present frame
  bool handled_ = false;      // the present frame, and it is not closed; of frame 0, until it is answered
  bool node_ready_ = false;   // ready() was called in the present frame
  std::int64_t progress_ns_ = 0;
  std::shared_ptr<Flight> flight_;
  bool stopped_ = false;
  std::thread watchdog_;  // last: it uses all of the above
};

}  // namespace xplane_bridge
