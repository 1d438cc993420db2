#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {

/// Lets threads run one at a time, and only when the thread that leads them says so: what they do together follows from
/// what the leader does. A turn ends where its thread waits with a ClockCondition, and the next one comes once that was
/// notified or its deadline is over. Thread-safe.
class ThreadTurns {
 public:
  /// From the leader: a turn for each that has something to go on with, by the order of their seats, until none has.
  /// Waits for each of them. The caller must hold no lock that they may want.
  void give();
  /// From any thread: from here on all of them run as they like.
  void free();

  /// Whether the calling thread runs in a turn.
  static bool taken();
  /// Ends the calling thread's turn. Returns with the next one, which comes once `ready` is true. Called by the leader.
  static void pass(std::function<bool()> ready);

 private:
  friend class ClockCondition;
  friend class ThreadSeat;
  struct Place {
    bool entered = false;
    bool has_turn = false;
    bool left = false;
    std::atomic<bool> own_way{false};           // it takes no turns any more
    std::atomic<bool> notified{false};          // the condition was
    const ClockCondition* condition = nullptr;  // that it waits with
    std::function<bool()> ready;                // empty: it has waited for nothing yet
  };

  /// Waits with a condition whose mutex `sleeping` holds. Returns at once where the calling thread takes no turns.
  static void sleep(const ClockCondition& condition, std::unique_lock<std::mutex>* sleeping, const Deadline* deadline);
  static void notify(const ClockCondition& condition);
  bool runsFreely(const Place& place) const { return free_ || place.own_way; }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::atomic<bool> free_{false};
  std::vector<std::shared_ptr<Place>> places_;
};

/// A thread's place among those that take turns; without turns, nothing.
class ThreadSeat {
 public:
  /// Takes the next place, before the thread starts. @param turns null: the thread runs as it likes
  explicit ThreadSeat(std::shared_ptr<ThreadTurns> turns);
  /// The place is given up.
  ~ThreadSeat();
  ThreadSeat(const ThreadSeat&) = delete;
  ThreadSeat& operator=(const ThreadSeat&) = delete;

  // From its thread.

  /// Waits for the first turn.
  void enter();
  /// Runs as it likes from here on.
  void leave();

  /// From another thread, which is about to join it: where that takes turns itself, others have theirs until the seat
  /// is left; otherwise the seat's thread goes on without turns.
  void letEnd();

  /// Enters and leaves.
  class Taken {
   public:
    explicit Taken(ThreadSeat* seat) : seat_(seat) { seat_->enter(); }
    ~Taken() { seat_->leave(); }
    Taken(const Taken&) = delete;
    Taken& operator=(const Taken&) = delete;

   private:
    ThreadSeat* seat_;
  };

 private:
  const std::shared_ptr<ThreadTurns> turns_;
  std::shared_ptr<ThreadTurns::Place> place_;
};

/// A mutex that may be held while waiting for X-Plane: who wants it meanwhile lets others have their turns.
class TurnMutex {
 public:
  void lock();
  void unlock();

 private:
  std::mutex mutex_;
  std::atomic<bool> held_{false};
};

}  // namespace xplane_bridge::core
