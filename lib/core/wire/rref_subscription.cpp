#include "xplane_bridge/core/wire/rref_subscription.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kMinPatienceNs =
    500 * kNanosecondsPerMillisecond;                                // silence before a dataref is asked for again
constexpr std::int64_t kMaxPatienceNs = 10 * kNanosecondsPerSecond;  // between repeats that do not help
constexpr std::int64_t kPeriodsMissed = 3;                           // the same in periods, for slow groups
constexpr int kUnansweredAttempts = 3;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace

std::int64_t Jitter::around(std::int64_t duration_ns) {
  constexpr double kSpread = 0.2;
  return static_cast<std::int64_t>(static_cast<double>(duration_ns) *
                                   std::uniform_real_distribution<double>(1.0 - kSpread, 1.0 + kSpread)(random_));
}

std::size_t RequestPacer::allowance(std::int64_t now_ns, Jitter* jitter) {
  if (!batch_end_ns_.has_value() || now_ns >= *batch_end_ns_) {
    batch_end_ns_ = now_ns + jitter->around(spacing_ns_);
    used_ = 0;
  }
  return batch_size_ - std::min(used_, batch_size_);
}

std::size_t RequestPacer::urgentAllowance(std::int64_t now_ns, Jitter* jitter) {
  constexpr std::size_t kUrgentRequests = 100;
  allowance(now_ns, jitter);
  return kUrgentRequests - std::min(used_, kUrgentRequests);
}

RrefSubscription::RrefSubscription(RrefGroup group)
    : group_(std::move(group)), entries_(group_.datarefs.size()), silent_(entries_.size()) {
  const std::string name = "dataref group '" + group_.name + "': ";
  if (group_.datarefs.empty()) {
    throw std::invalid_argument(name + "it is empty; expected at least one dataref");
  }
  if (group_.rate_hz < 1 || group_.rate_hz > kEveryFrameRateHz) {
    throw std::invalid_argument(name + "rate " + std::to_string(group_.rate_hz) + " Hz, expected 1.." +
                                std::to_string(kEveryFrameRateHz));
  }
  for (const std::string& path : group_.datarefs) {
    std::array<std::uint8_t, kRrefRequestSize> buffer;
    const EncodeResult encoded = encodeRref(buffer, path, group_.rate_hz, 0);
    if (!encoded.ok()) {
      throw std::invalid_argument(
          std::string(name).append("'").append(path).append("' is no dataref (").append(toString(encoded.error())) +
          "); expected a path such as sim/time/paused or sim/x/y[3], at most " + std::to_string(kRrefPathSize - 1) +
          " characters");
    }
  }
  patience_ns_ = std::max(kMinPatienceNs, kPeriodsMissed * kNanosecondsPerSecond / group_.rate_hz);
}

void RrefSubscription::restart(std::int64_t now_ns) {
  suspended_ = false;
  for (Entry& entry : entries_) {
    entry = {now_ns, 0, false};
  }
  silent_ = entries_.size();
  earliest_due_ns_ = now_ns;
}

std::optional<std::size_t> RrefSubscription::nextRequest(std::int64_t now_ns, Jitter* jitter) {
  if (suspended_ || now_ns < earliest_due_ns_) {
    return std::nullopt;
  }
  std::int64_t earliest = kNever;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (entry.due_ns <= now_ns) {
      std::int64_t wait = patience_ns_;
      for (int attempt = 0; attempt < entry.attempts && wait < kMaxPatienceNs; ++attempt) {
        wait *= 2;
      }
      entry.due_ns = now_ns + jitter->around(std::min(wait, std::max(kMaxPatienceNs, patience_ns_)));
      repeats_ += entry.attempts > 0 || entry.answered ? 1U : 0U;
      ++entry.attempts;
      asked_ = true;
      return i;
    }
    earliest = std::min(earliest, entry.due_ns);
  }
  earliest_due_ns_ = earliest;  // until then there is nothing to look for
  return std::nullopt;
}

std::size_t RrefSubscription::answered(const RrefView& values, std::int64_t now_ns) {
  std::size_t unknown = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::int32_t index = values[i].index;
    if (index < 0 || static_cast<std::size_t>(index) >= entries_.size()) {
      ++unknown;
      continue;
    }
    Entry& entry = entries_[static_cast<std::size_t>(index)];
    if (!std::exchange(entry.answered, true)) --silent_;
    entry.attempts = 0;
    entry.due_ns = now_ns + patience_ns_;
  }
  return unknown;
}

std::vector<std::string> RrefSubscription::unanswered() const {
  std::vector<std::string> paths;
  if (suspended_ || silent_ == 0) return paths;  // asked with every datagram: nearly always so
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (!entries_[i].answered && entries_[i].attempts >= kUnansweredAttempts) {
      paths.push_back(group_.datarefs[i]);
    }
  }
  return paths;
}

bool RrefSubscription::settled() const {
  return !suspended_ && std::all_of(entries_.begin(), entries_.end(), [](const Entry& entry) {
    return entry.answered || entry.attempts >= kUnansweredAttempts;
  });
}

}  // namespace xplane_bridge::core
