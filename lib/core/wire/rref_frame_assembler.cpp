#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

}  // namespace

RrefFrameAssembler::RrefFrameAssembler(std::size_t size, std::int32_t first_index)
    : RrefFrameAssembler(size, first_index, Options{}) {}

RrefFrameAssembler::RrefFrameAssembler(std::size_t size, std::int32_t first_index, const Options& options)
    : options_(options),
      first_index_(first_index),
      values_(size, kNoValue),
      pending_(size, kNoValue),
      seen_(size, 0),
      silent_(size, 0),
      missed_(size, 0) {}

bool RrefFrameAssembler::add(const RrefView& datagram, std::int64_t receive_ns) {
  const std::int64_t window_ns = toNanoseconds(options_.join_window);
  if (open_ && receive_ns - last_piece_ns_ > window_ns) closeFrame(false);
  bool completed = false;
  for (std::size_t i = 0; i < datagram.size(); ++i) {
    const RrefPair pair = datagram[i];
    const auto position = static_cast<std::int64_t>(pair.index) - first_index_;
    if (position < 0 || position >= static_cast<std::int64_t>(size())) {
      ++counters_.foreign_index;
      continue;
    }
    const auto p = static_cast<std::size_t>(position);
    if (open_ && seen_[p] != 0) {
      completed = completed || isWhole();  // one datagram may complete a sample and begin the next
      closeFrame(isWhole());
    }
    if (!open_) beginFrame(receive_ns);
    last_piece_ns_ = receive_ns;
    seen_[p] = 1;
    if (silent_[p] != 0) {
      silent_[p] = 0;
      --silent_count_;
    }
    missed_[p] = 0;
    ++expected_seen_;
    if (std::isfinite(pair.value)) {
      pending_[p] = pair.value;
    } else {
      ++counters_.non_finite;
    }
  }
  if (open_ && isWhole()) {
    closeFrame(true);
    completed = true;
  }
  return completed;
}

void RrefFrameAssembler::reset() {
  std::fill(silent_.begin(), silent_.end(), std::uint8_t{0});
  std::fill(missed_.begin(), missed_.end(), 0);
  silent_count_ = 0;
  open_ = false;
}

void RrefFrameAssembler::beginFrame(std::int64_t receive_ns) {
  open_ = true;
  frame_start_ns_ = receive_ns;
  expected_seen_ = 0;
  std::fill(seen_.begin(), seen_.end(), std::uint8_t{0});
  std::fill(pending_.begin(), pending_.end(), kNoValue);
}

void RrefFrameAssembler::closeFrame(bool complete) {
  open_ = false;
  if (complete) {
    values_.swap(pending_);
    sample_start_ns_ = frame_start_ns_;
    ++counters_.samples;
    return;
  }
  ++counters_.incomplete;
  for (std::size_t p = 0; p < size(); ++p) {
    if (seen_[p] != 0 || silent_[p] != 0) continue;
    if (++missed_[p] >= options_.frames_until_silent) {
      silent_[p] = 1;
      ++silent_count_;
    }
  }
}

}  // namespace xplane_bridge::core
