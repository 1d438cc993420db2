#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace xplane_bridge::vision {

/// Whether a picture is (almost) black: a window that is not drawn, a blanked screen, a loading screen.
/// @param bgr CV_8UC3 or CV_8UC4
/// @return true when at least 99.5 % of sparsely taken pixels have every colour below 16 of 255
[[nodiscard]] bool isBlack(const cv::Mat& bgr);

/// Whether two pictures of any type have the same size, type and pixels.
[[nodiscard]] bool samePixels(const cv::Mat& a, const cv::Mat& b);

/// Notices a picture that stands still while the aircraft moves. Pure bookkeeping; times are the caller's.
class FrozenCheck {
 public:
  /// @param after_ns [ns] for how long the picture must have stood still while the state moved, > 0
  explicit FrozenCheck(std::int64_t after_ns) : after_ns_(after_ns), pause_ns_(std::max(after_ns, kPauseNs)) {}

  /// The picture changed.
  void pictureChanged() {
    ever_ = true;
    beginAnew(0);
  }

  /// No pictures are looked at for now, or there are none: nothing is known of them until the next, or beginAnew().
  void interrupt() { looked_at_ = false; }

  /// Pictures are looked at again: what has stood since before counts from then on, if there ever was a picture.
  /// @param from_ns [ns] movements before do not count
  void beginAnew(std::int64_t from_ns) {
    looked_at_ = ever_;
    from_ns_ = from_ns;
    moving_since_ns_.reset();
  }

  /// The flight state moved (attitude or position clearly different from before).
  void stateMoved(std::int64_t now_ns) {
    if (now_ns < from_ns_) return;
    if (!moving_since_ns_ || now_ns - moved_at_ns_ >= pause_ns_) {
      moving_since_ns_ = now_ns;
      longest_gap_ns_ = 0;
    } else {
      longest_gap_ns_ = std::max(longest_gap_ns_, now_ns - moved_at_ns_);
    }
    moved_at_ns_ = now_ns;
  }

  /// True when the state has moved for longer than the limit, and still moves, while the picture stood still.
  [[nodiscard]] bool frozen(std::int64_t now_ns) const {
    // The longest gap may be a short pause, after which the first state that moves comes before the first picture that
    // does: it does not count.
    return looked_at_ && moving_since_ns_ && moved_at_ns_ - *moving_since_ns_ - longest_gap_ns_ > after_ns_ &&
           now_ns - moved_at_ns_ < pause_ns_;
  }

 private:
  static constexpr std::int64_t kPauseNs = 2'000'000'000;  // a slow aircraft moves more often

  std::int64_t after_ns_;
  std::int64_t pause_ns_;  // a state that stands for so long moves no more
  bool ever_ = false;      // there was a picture
  bool looked_at_ = false;
  std::int64_t from_ns_ = 0;
  std::optional<std::int64_t> moving_since_ns_;  // without a pause since the picture last changed
  std::int64_t moved_at_ns_ = 0;
  std::int64_t longest_gap_ns_ = 0;  // between two movements since then
};

/// Finds out when a picture that stands, as in a pause, has to be shown to those who came after its last change: once,
/// where none has changed for a while since the first of them.
class StandingCheck {
 public:
  /// @param after_ns [ns] for how long to wait for a change, > 0
  explicit StandingCheck(std::int64_t after_ns) : after_ns_(after_ns) {}

  /// A picture was taken for them.
  void pictureTaken() { shown_ = true; }

  /// @param wanted whether there are subscribers @return whether it is to be shown now
  bool due(bool wanted, std::int64_t now_ns) {
    if (!wanted || !since_ns_) {
      shown_ = false;
      since_ns_ = wanted ? std::optional<std::int64_t>(now_ns) : std::nullopt;
    }
    if (!since_ns_ || shown_ || now_ns - *since_ns_ < after_ns_) return false;
    return shown_ = true;
  }

 private:
  std::int64_t after_ns_;
  std::optional<std::int64_t> since_ns_;  // they are there
  bool shown_ = false;
};

/// Periods between pictures, the latest kPeriods of them. Allocates nothing after its construction but in summary().
class PeriodMeter {
 public:
  static constexpr std::size_t kPeriods = 1024;

  struct Summary {
    std::size_t count = 0;  ///< periods it is of; 0: the others are 0
    double mean = 0.0;      ///< [s]
    double p99 = 0.0;       ///< 99 of 100 are not longer [s]
    double worst = 0.0;     ///< [s]
  };

  /// A picture; of one that is not later than the last nothing is counted.
  void add(std::int64_t time_ns);
  /// The next picture begins anew: there was a pause of pictures that is no period.
  void interrupt() { last_ns_ = 0; }
  [[nodiscard]] Summary summary() const;

 private:
  std::array<float, kPeriods> periods_{};  // [s], a ring
  std::size_t count_ = 0;                  // ever
  std::int64_t last_ns_ = 0;               // 0: none
};

}  // namespace xplane_bridge::vision
