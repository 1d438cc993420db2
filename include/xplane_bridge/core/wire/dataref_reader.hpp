#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// One value of a read: empty when X-Plane did not answer in time.
using DatarefValue = std::optional<float>;

/// Reads datarefs once, by a subscription that is stopped as soon as the values are there. No I/O: requests are fetched
/// with nextRequest() when they may be sent. Times are the steady clock's [ns]. Each read has indices of its own, so
/// that a late answer to an old one is never taken for the new one's.
class DatarefReader {
 public:
  /// RREF(path, rate, index).
  struct Request {
    std::string path;
    std::int32_t rate_hz = 0;
    std::int32_t index = 0;
  };
  using Done = std::function<void(const std::vector<DatarefValue>&)>;
  using Accept = std::function<bool(const std::vector<DatarefValue>&)>;

  /// Indices from `first_index` on are this reader's.
  explicit DatarefReader(std::int32_t first_index) : first_index_(first_index), next_index_(first_index) {}

  /// Starts a read. It ends, with `done` being called, once every value has arrived and `accept` (if given) likes them,
  /// at the latest at `deadline_ns`.
  void start(std::vector<std::string> paths, std::int64_t deadline_ns, Done done, Accept accept = {});

  /// The next request to send; empty: none at the moment. What is taken is sent. First what was never asked for, then
  /// what has not answered, then the ends of reads that are over.
  std::optional<Request> nextRequest(std::int64_t now_ns);
  /// Takes note of a value; false when the index is none of this reader's.
  bool answered(const RrefPair& pair, std::int64_t now_ns);
  /// Ends what is over.
  void update(std::int64_t now_ns);
  /// Ends everything, with the values that are there.
  void cancelAll();

  /// Nothing is read, and all that was asked for has been ended.
  bool idle() const { return reads_.empty() && to_stop_.empty(); }

 private:
  struct Read {
    std::vector<std::string> paths;
    std::int32_t base = 0;
    std::vector<DatarefValue> values;
    std::vector<std::int64_t> asked_ns;  // the last time; of the first ones, as they are asked for in order
    std::int64_t deadline_ns = 0;
    Done done;
    Accept accept;
  };
  struct Ended {
    std::string path;
    std::optional<std::int64_t> stopped_ns;  // empty: in to_stop_
  };

  bool isComplete(const Read& read) const;
  void finish(Read read);

  std::int32_t first_index_;
  std::int32_t next_index_;
  std::deque<Read> reads_;
  std::map<std::int32_t, Ended> ended_;  // by index: the latest, to be stopped again if X-Plane missed it
  std::deque<std::int32_t> to_stop_;     // indices of ended_
};

}  // namespace xplane_bridge::core
