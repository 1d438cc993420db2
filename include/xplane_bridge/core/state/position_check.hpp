#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge::core {

/// Compares positions computed on the sphere with RPOS doubles. RPOS carries no time, so the two are compared where the
/// flown track passes nearest to the RPOS point: what counts is the height and the distance across the track.
///
/// Between two positions the track is taken as straight. By how much it bows out there is estimated from how it turns;
/// where that is too much, as in turns at a few positions a second, nothing is compared.
class PositionCheck {
 public:
  enum class Verdict : std::uint8_t { kUnknown, kAgrees, kDisagrees };

  struct Options {
    double tolerance = 0.05;  ///< height and cross-track, beside what the track bows out [m]; that may be as much
    int checks = 5;           ///< comparisons before a verdict
  };

  PositionCheck() = default;
  explicit PositionCheck(const Options& options) : options_(options) {}

  /// A position computed on the sphere, in the order flown.
  void addComputed(const GeoPoint& place);
  /// A position from RPOS. It is compared once the track has passed it.
  void addReference(const GeoPoint& place);
  /// The track so far does not belong to what comes (reset, new origin of the scenery does not count).
  void reset();

  Verdict verdict() const { return verdict_; }
  /// Of the last comparison [m]; NaN before the first.
  double heightError() const { return height_error_; }
  double crossTrackError() const { return cross_track_error_; }
  int comparisons() const { return comparisons_; }

 private:
  static constexpr std::size_t kTrack = 16;
  static constexpr int kPointsAfter = 2;  ///< the track must go on this far beyond a reference

  void compare();
  const GeoPoint& track(std::size_t i) const { return track_[(first_ + i) % kTrack]; }

  Options options_;
  std::array<GeoPoint, kTrack> track_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::optional<GeoPoint> reference_;
  int points_since_reference_ = 0;
  int comparisons_ = 0;
  int agreements_ = 0;     ///< in a row
  int disagreements_ = 0;  ///< in a row
  Verdict verdict_ = Verdict::kUnknown;
  double height_error_ = std::numeric_limits<double>::quiet_NaN();
  double cross_track_error_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace xplane_bridge::core
