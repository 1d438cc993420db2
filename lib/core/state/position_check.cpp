#include "xplane_bridge/core/state/position_check.hpp"

#include <algorithm>
#include <cmath>

namespace xplane_bridge::core {

void PositionCheck::addComputed(const GeoPoint& place) {
  if (count_ == kTrack) {
    first_ = (first_ + 1) % kTrack;
    --count_;
  }
  track_[(first_ + count_++) % kTrack] = place;
  if (reference_ && ++points_since_reference_ >= kPointsAfter) {
    compare();
    reference_.reset();
  }
}

void PositionCheck::addReference(const GeoPoint& place) {
  if (reference_ || count_ == 0) return;
  reference_ = place;
  points_since_reference_ = 0;
}

void PositionCheck::reset() {
  count_ = 0;
  reference_.reset();
}

void PositionCheck::compare() {
  const TangentFrame at_reference(*reference_);
  double nearest = std::numeric_limits<double>::infinity();
  double height = 0.0, across = 0.0;
  const auto consider = [&](const Eigen::Vector3d& offset) {
    const double distance = offset.norm();
    if (distance >= nearest) return;
    nearest = distance;
    height = offset.z();
    across = std::hypot(offset.x(), offset.y());
  };
  for (std::size_t i = 0; i < count_; ++i) {
    const Eigen::Vector3d here = at_reference.position(track(i));
    consider(here);
    if (i == 0) continue;
    const Eigen::Vector3d before = at_reference.position(track(i - 1));
    const Eigen::Vector3d piece = here - before;
    const double length2 = piece.squaredNorm();
    if (length2 == 0.0 || length2 > options_.max_segment * options_.max_segment) continue;
    const double along = std::clamp(-before.dot(piece) / length2, 0.0, 1.0);
    consider(before + along * piece);
  }
  height_error_ = height;
  cross_track_error_ = across;
  ++comparisons_;
  const bool agrees = std::abs(height) <= options_.tolerance && across <= options_.tolerance;
  agreements_ = agrees ? agreements_ + 1 : 0;
  disagreements_ = agrees ? 0 : disagreements_ + 1;
  if (agreements_ >= options_.checks) verdict_ = Verdict::kAgrees;
  if (disagreements_ >= options_.checks) verdict_ = Verdict::kDisagrees;
}

}  // namespace xplane_bridge::core
