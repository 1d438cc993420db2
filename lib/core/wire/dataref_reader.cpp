#include "xplane_bridge/core/wire/dataref_reader.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/wire/rref_subscription.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kRepeatNs = 250 * kNanosecondsPerMillisecond;
constexpr std::int64_t kStopAgainNs = kNanosecondsPerSecond;
constexpr std::size_t kRemembered = 2048;

}  // namespace

void DatarefReader::start(std::vector<std::string> paths, std::int64_t deadline_ns, Done done, Accept accept) {
  const auto count = static_cast<std::int32_t>(paths.size());
  if (next_index_ > std::numeric_limits<std::int32_t>::max() - count) {
    next_index_ = first_index_;
  }
  Read read;
  read.values.resize(paths.size());
  read.paths = std::move(paths);
  read.base = next_index_;
  read.deadline_ns = deadline_ns;
  read.done = std::move(done);
  read.accept = std::move(accept);
  next_index_ += count;
  reads_.push_back(std::move(read));
}

std::optional<DatarefReader::Request> DatarefReader::nextRequest(std::int64_t now_ns) {
  const auto request = [](const Read& read, std::size_t i) {
    return Request{read.paths[i], kEveryFrameRateHz, read.base + static_cast<std::int32_t>(i)};
  };
  for (Read& read : reads_) {
    if (read.asked_ns.size() < read.paths.size()) {
      read.asked_ns.push_back(now_ns);
      return request(read, read.asked_ns.size() - 1);
    }
  }
  std::int64_t oldest_ns = now_ns - kRepeatNs + 1;
  std::optional<Request> repeat;
  std::int64_t* asked_ns = nullptr;
  for (Read& read : reads_) {
    for (std::size_t i = 0; i < read.asked_ns.size(); ++i) {
      if (!read.values[i].has_value() && read.asked_ns[i] < oldest_ns) {
        oldest_ns = read.asked_ns[i];
        asked_ns = &read.asked_ns[i];
        repeat = request(read, i);
      }
    }
  }
  if (repeat.has_value()) {
    *asked_ns = now_ns;
    return repeat;
  }
  if (to_stop_.empty()) {
    return std::nullopt;
  }
  const std::int32_t index = to_stop_.front();
  to_stop_.pop_front();
  Ended& ended = ended_.at(index);
  ended.stopped_ns = now_ns;
  Request end{ended.path, 0, index};
  while (ended_.size() > kRemembered && ended_.begin()->second.stopped_ns.has_value()) {
    ended_.erase(ended_.begin());
  }
  return end;
}

bool DatarefReader::answered(const RrefPair& pair, std::int64_t now_ns) {
  if (pair.index < first_index_) {
    return false;
  }
  for (Read& read : reads_) {
    const std::int32_t offset = pair.index - read.base;
    if (offset >= 0 && static_cast<std::size_t>(offset) < read.values.size()) {
      read.values[static_cast<std::size_t>(offset)] = pair.value;
      return true;
    }
  }
  const auto ended = ended_.find(pair.index);
  if (ended == ended_.end()) {
    return false;
  }
  std::optional<std::int64_t>& stopped_ns = ended->second.stopped_ns;
  if (stopped_ns.has_value() && now_ns - *stopped_ns >= kStopAgainNs) {
    stopped_ns.reset();
    to_stop_.push_back(pair.index);
  }
  return true;
}

bool DatarefReader::isComplete(const Read& read) const {
  const bool all =
      std::all_of(read.values.begin(), read.values.end(), [](const DatarefValue& value) { return value.has_value(); });
  return all && (!read.accept || read.accept(read.values));
}

void DatarefReader::update(std::int64_t now_ns) {
  std::vector<Read> over;
  for (auto read = reads_.begin(); read != reads_.end();) {
    if (isComplete(*read) || now_ns >= read->deadline_ns) {
      over.push_back(std::move(*read));
      read = reads_.erase(read);
    } else {
      ++read;
    }
  }
  // Afterwards, because a callback may start the next read.
  for (Read& read : over) {
    finish(std::move(read));
  }
}

void DatarefReader::cancelAll() {
  std::deque<Read> reads;
  std::swap(reads, reads_);
  for (Read& read : reads) {
    finish(std::move(read));
  }
}

void DatarefReader::finish(Read read) {
  for (std::size_t i = 0; i < read.asked_ns.size(); ++i) {
    const std::int32_t index = read.base + static_cast<std::int32_t>(i);
    ended_[index] = {read.paths[i], std::nullopt};
    to_stop_.push_back(index);
  }
  read.done(read.values);
}

}  // namespace xplane_bridge::core
