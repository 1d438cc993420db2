#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// One value of a read: empty when X-Plane did not answer in time.
using DatarefValue = std::optional<float>;

/// Reads datarefs once, by a subscription that is stopped as soon as the values are there. No I/O: requests go through
/// a function. Times are the steady clock's [ns]. Each read has indices of its own, so that a late answer to an old one
/// is never taken for the new one's.
class DatarefReader {
 public:
  /// Sends RREF(path, rate, index).
  using Send = std::function<void(const std::string& path, std::int32_t rate_hz, std::int32_t index)>;
  using Done = std::function<void(const std::vector<DatarefValue>&)>;
  using Accept = std::function<bool(const std::vector<DatarefValue>&)>;

  /// Indices from `first_index` on are this reader's.
  DatarefReader(std::int32_t first_index, Send send)
      : first_index_(first_index), next_index_(first_index), send_(std::move(send)) {}

  /// Starts a read. It ends, with `done` being called, once every value has arrived and `accept` (if given) likes them,
  /// at the latest at `deadline_ns`.
  void start(std::vector<std::string> paths, std::int64_t now_ns, std::int64_t deadline_ns, Done done,
             Accept accept = {});

  /// Takes note of a value; false when the index is none of this reader's.
  bool answered(const RrefPair& pair, std::int64_t now_ns);
  /// Repeats unanswered requests and ends what is over.
  void update(std::int64_t now_ns);
  /// Ends everything, with the values that are there.
  void cancelAll();

  bool idle() const { return reads_.empty(); }

 private:
  struct Read {
    std::vector<std::string> paths;
    std::int32_t base = 0;
    std::vector<DatarefValue> values;
    std::int64_t deadline_ns = 0;
    std::int64_t repeat_ns = 0;
    Done done;
    Accept accept;
  };
  struct Ended {
    std::string path;
    std::int32_t index = 0;
    std::int64_t stopped_ns = 0;
  };

  bool isComplete(const Read& read) const;
  void finish(Read read, std::int64_t now_ns);

  std::int32_t first_index_;
  std::int32_t next_index_;
  Send send_;
  std::deque<Read> reads_;
  std::deque<Ended> ended_;  // the latest, to be stopped again if X-Plane missed it
};

}  // namespace xplane_bridge::core
