#pragma once

#include <cstdint>
#include <limits>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace xplane_bridge {

/// Whether a frame of a simulator in lock-step is answered: by every participant, with the frame's own stamp.
/// Thread-safe.
///
/// An answer to another frame than the present one does not count for it; one that comes before its frame waits for it,
/// because the network may bring the answer first. While the simulator is paused, frames share a stamp: then an answer
/// counts for the frame that is open when it comes. Frame 0 may share that of the first frame that flies: it has an
/// answer of its own, and all others are of that frame.
class LockstepBarrier {
 public:
  /// @param participants names of nodes: "/a/b" is that one, "b" is /b and any /.../b
  /// @param reader the node without which no participant can answer; its answer is awaited like the others'
  /// @param camera name of those participants that read the simulator, too
  LockstepBarrier(std::vector<std::string> participants, std::string reader, std::string camera);

  /// The next frame is here. Number 0 is answered by the reader and the cameras alone: the others see nothing of it.
  void open(std::uint32_t number, std::int64_t stamp_ns);
  /// `who`, the full name of a node, has answered frame 0.
  void answerFrame0(const std::string& who);
  /// `who`, the full name of a node, has answered the frame of this stamp.
  void answer(const std::string& who, std::int64_t stamp_ns);
  /// The reader has answered, and has nothing in this frame that others could answer.
  void answerForAll(const std::string& reader, std::int64_t stamp_ns);

  /// Whether the frame may be closed: all have answered it, and it is not held.
  bool complete() const;
  /// It is: answers from now on belong to later frames. One of those that step() has granted is used up.
  void close();

  /// Flies so many frames and holds then; 0 holds at the present one.
  void step(std::uint64_t frames);
  /// Flies on without end.
  void run();
  /// Whether the present frame is answered, and held.
  bool holds() const;
  /// Whether the present frame is answered: complete() or holds().
  bool answered() const;
  /// Who has not answered the present frame, as named.
  std::vector<std::string> missing() const;
  std::uint32_t number() const;
  /// Position of a node among the participants, for an order that does not depend on time; those not named come last.
  std::size_t rank(const std::string& who) const;

 private:
  static constexpr std::uint64_t kEndless = std::numeric_limits<std::uint64_t>::max();

  std::size_t find(const std::string& who) const;
  void take(std::size_t participant, std::int64_t stamp_ns, bool for_all);
  bool readsSimulator(std::size_t participant) const;
  bool isMissing(std::size_t participant) const;
  bool answeredLocked() const;

  struct Early {
    std::int64_t stamp_ns;
    std::size_t participant;
    bool for_all;
    bool operator<(const Early& other) const {
      return stamp_ns != other.stamp_ns ? stamp_ns < other.stamp_ns : participant < other.participant;
    }
  };

  const std::vector<std::string> names_;  // the reader first
  const std::string camera_;
  mutable std::mutex mutex_;  // guards the following
  bool open_ = false;
  std::uint32_t number_ = 0;
  std::int64_t stamp_ns_ = 0;
  bool for_all_ = false;
  std::set<std::size_t> answered_;
  std::set<Early> early_;
  std::uint64_t granted_ = kEndless;
};

}  // namespace xplane_bridge
