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
constexpr std::size_t kRemembered = 512;

}  // namespace

void DatarefReader::start(std::vector<std::string> paths, std::int64_t now_ns, std::int64_t deadline_ns, Done done,
                          Accept accept) {
  const auto count = static_cast<std::int32_t>(paths.size());
  if (next_index_ > std::numeric_limits<std::int32_t>::max() - count) {
    next_index_ = first_index_;
  }
  Read read;
  read.values.resize(paths.size());
  read.paths = std::move(paths);
  read.base = next_index_;
  read.deadline_ns = deadline_ns;
  read.repeat_ns = now_ns;
  read.done = std::move(done);
  read.accept = std::move(accept);
  next_index_ += count;
  reads_.push_back(std::move(read));
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
  const auto ended =
      std::find_if(ended_.begin(), ended_.end(), [&](const Ended& each) { return each.index == pair.index; });
  if (ended == ended_.end()) {
    return false;
  }
  if (now_ns - ended->stopped_ns >= kStopAgainNs) {
    send_(ended->path, 0, ended->index);
    ended->stopped_ns = now_ns;
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
      continue;
    }
    if (now_ns >= read->repeat_ns) {
      read->repeat_ns = now_ns + kRepeatNs;
      for (std::size_t i = 0; i < read->paths.size(); ++i) {
        if (!read->values[i].has_value()) {
          send_(read->paths[i], kEveryFrameRateHz, read->base + static_cast<std::int32_t>(i));
        }
      }
    }
    ++read;
  }
  // Afterwards, because a callback may start the next read.
  for (Read& read : over) {
    finish(std::move(read), now_ns);
  }
}

void DatarefReader::cancelAll() {
  std::deque<Read> reads;
  std::swap(reads, reads_);
  for (Read& read : reads) {
    const std::int64_t now_ns = read.repeat_ns;
    finish(std::move(read), now_ns);
  }
}

void DatarefReader::finish(Read read, std::int64_t now_ns) {
  for (std::size_t i = 0; i < read.paths.size(); ++i) {
    const std::int32_t index = read.base + static_cast<std::int32_t>(i);
    send_(read.paths[i], 0, index);
    ended_.push_back({read.paths[i], index, now_ns});
    if (ended_.size() > kRemembered) {
      ended_.pop_front();
    }
  }
  read.done(read.values);
}

}  // namespace xplane_bridge::core
