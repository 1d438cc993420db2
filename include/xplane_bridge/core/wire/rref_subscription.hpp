#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// RREF rate that means "every frame": X-Plane never sends more than one value a frame, so any number above every
/// frame rate does [? rate-above-99].
constexpr std::int32_t kEveryFrameRateHz = 1000;

/// Datarefs received together on a socket of their own. Values come back with the position in `datarefs` as index.
struct RrefGroup {
  std::string name;  ///< for messages: "flight"
  std::vector<std::string> datarefs;
  std::int32_t rate_hz = kEveryFrameRateHz;
  int priority = 0;  ///< higher is subscribed first
};

/// Spreads a time by up to 20 % so that several clients, and several groups of one, do not ask in step.
class Jitter {
 public:
  explicit Jitter(std::uint32_t seed) : random_(seed) {}
  std::int64_t around(std::int64_t duration_ns);

 private:
  std::minstd_rand random_;
};

/// Groups of this priority or a higher one are asked for at once, and do not wait for their place in a batch.
constexpr int kUrgentPriority = 10;

/// Lets through so many requests at once that X-Plane loses none; above about 148 a frame it does [? requests-a-frame].
class RequestPacer {
 public:
  RequestPacer(std::size_t batch_size, double spacing_s)
      : batch_size_(batch_size), spacing_ns_(toNanoseconds(spacing_s)) {}

  /// Between batches, from the next one on.
  void setSpacing(double spacing_s) { spacing_ns_ = toNanoseconds(spacing_s); }
  /// Requests that may be sent now.
  std::size_t allowance(std::int64_t now_ns, Jitter* jitter);
  /// Urgent ones that may be sent now, for which there is room for as many again as X-Plane takes.
  std::size_t urgentAllowance(std::int64_t now_ns, Jitter* jitter);
  void spend(std::size_t requests) { used_ += requests; }

 private:
  std::size_t batch_size_;
  std::int64_t spacing_ns_;
  std::size_t used_ = 0;
  std::optional<std::int64_t> batch_end_ns_;
};

/// Which datarefs of one group have to be asked for (again), judged by the answers. No I/O; times are the steady
/// clock's [ns].
///
/// Each dataref is asked for when the subscription (re)starts, and again when it stays silent, at growing intervals.
class RrefSubscription {
 public:
  /// Throws std::invalid_argument: empty group, empty or over-long path, rate outside 1..kEveryFrameRateHz.
  explicit RrefSubscription(RrefGroup group);

  const RrefGroup& group() const { return group_; }

  bool urgent() const { return group_.priority >= kUrgentPriority; }
  /// Whether anything was ever asked for.
  bool asked() const { return asked_; }

  /// Everything has to be asked for again: X-Plane is new, or was away.
  void restart(std::int64_t now_ns);
  /// Nothing is asked for until restart(): X-Plane answers no client.
  void suspend() { suspended_ = true; }

  /// The next dataref to ask for at `now_ns`; marks it as asked. Empty: none is due.
  std::optional<std::size_t> nextRequest(std::int64_t now_ns, Jitter* jitter);

  /// Takes note of the values of a datagram. Returns how many have an index that was never asked for.
  std::size_t answered(const RrefView& values, std::int64_t now_ns);

  /// Datarefs that did not answer although asked several times since restart().
  std::vector<std::string> unanswered() const;
  /// Each dataref has answered since restart(), or was asked for in vain.
  bool settled() const;
  /// Requests beyond the first of each dataref since construction.
  std::uint64_t repeats() const { return repeats_; }

 private:
  struct Entry {
    std::int64_t due_ns = 0;  // when it is asked for, unless it answers before
    int attempts = 0;         // since restart() or its last answer
    bool answered = false;    // since restart()
  };

  RrefGroup group_;
  std::vector<Entry> entries_;
  std::size_t silent_;  // entries that have not answered since restart()
  std::int64_t patience_ns_;
  std::int64_t earliest_due_ns_ = 0;
  bool suspended_ = true;
  bool asked_ = false;
  std::uint64_t repeats_ = 0;
};

}  // namespace xplane_bridge::core
