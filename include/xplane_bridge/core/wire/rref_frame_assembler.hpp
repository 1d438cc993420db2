#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// Joins the RREF datagrams of one simulator frame into one sample.
///
/// X-Plane may put a frame's values into one datagram or several [? samples-whole]. A sample is complete when every
/// index that answers at all has come; an index that comes again, or a piece after a long pause, begins the next
/// frame. An index that stays away for several frames is taken as unknown [? unknown-omitted]: silent() names it, its
/// value is NaN and it does not hold up samples. It counts again as soon as it answers.
///
/// Allocates in the constructor only. One thread calls.
class RrefFrameAssembler {
 public:
  struct Options {
    /// A piece this long after the one before it belongs to another frame [s].
    double join_window = 0.005;
    /// Frames in a row without an index before it is taken as silent.
    int frames_until_silent = 3;

    /// For a group that is asked for at this rate: below the frame rate X-Plane may answer its indices in different
    /// frames of a period, for example one whose first request was lost. What comes nearly a period later belongs to
    /// the next sample: after a loss, the end of one and the beginning of the next would be joined from then on.
    /// Above 3/4 of the frame rate that is less than a frame: samples are of one frame each, and one that lacks an
    /// index is given up.
    static Options atRate(int rate_hz) {
      constexpr double kPeriods = 0.75;
      Options options;
      options.join_window = std::max(options.join_window, kPeriods / rate_hz);
      return options;
    }
  };

  struct Counters {
    std::uint64_t samples = 0;
    std::uint64_t incomplete = 0;     ///< frames given up because pieces were missing
    std::uint64_t foreign_index = 0;  ///< pairs with an index that was not requested
    std::uint64_t non_finite = 0;     ///< NaN or infinite values
  };

  /// @param size number of indices asked for
  /// @param first_index index of the first; the others follow
  explicit RrefFrameAssembler(std::size_t size, std::int32_t first_index = 0);
  RrefFrameAssembler(std::size_t size, std::int32_t first_index, const Options& options);

  /// @param receive_ns host receive time of the datagram
  /// @return true when this datagram completed a sample: values() and receiveTime() are of that sample until the next
  /// call.
  bool add(const RrefView& datagram, std::int64_t receive_ns);

  std::size_t size() const { return values_.size(); }
  /// By position (index - first_index). NaN: silent, or not finite on the wire.
  const std::vector<float>& values() const { return values_; }
  /// Of the first piece of the sample [ns].
  std::int64_t receiveTime() const { return sample_start_ns_; }
  /// Position is taken as never answering. Meaningful once some frames have come.
  bool isSilent(std::size_t position) const { return silent_[position] != 0; }
  std::size_t silentCount() const { return silent_count_; }
  const Counters& counters() const { return counters_; }
  /// Forgets the current frame and what was learnt, as after a new subscription.
  void reset();

 private:
  /// Whether every index that answers has come for the open frame.
  bool isWhole() const { return expected_seen_ + silent_count_ == size(); }
  void closeFrame(bool complete);
  void beginFrame(std::int64_t receive_ns);

  Options options_;
  std::int32_t first_index_;
  std::vector<float> values_;
  std::vector<float> pending_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::uint8_t> silent_;
  std::vector<int> missed_;  ///< frames in a row without it
  std::size_t expected_seen_ = 0;
  std::size_t silent_count_ = 0;
  bool open_ = false;
  std::int64_t frame_start_ns_ = 0;
  std::int64_t last_piece_ns_ = 0;  ///< of the open frame
  std::int64_t sample_start_ns_ = 0;
  Counters counters_;
};

}  // namespace xplane_bridge::core
