#include "xplane_bridge/core/state/position_check.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace xplane_bridge::core {
namespace {

/// How far the track lies beside the straight `piece` at the part `along` (0..1) of it, if it is an arc that turns as
/// much as shows between that piece and its neighbour [m].
double bowAt(double along, const Eigen::Vector3d& piece, const Eigen::Vector3d& neighbour) {
  const double length = piece.norm(), other = neighbour.norm();
  if (length == 0.0 || other == 0.0) return 0.0;
  const double turn = (piece / length - neighbour / other).norm();
  return along * (1.0 - along) * length * length * turn / (length + other);
}

}  // namespace

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
  std::vector<Eigen::Vector3d> places;
  for (std::size_t i = 0; i < count_; ++i) places.push_back(at_reference.position(track(i)));
  const auto piece = [&places](std::size_t i) -> Eigen::Vector3d { return places[i] - places[i - 1]; };

  double nearest = std::numeric_limits<double>::infinity();
  std::size_t end = 1;  // of the nearest piece
  double along = 0.0;   // part of that piece
  Eigen::Vector3d offset = places[0];
  for (std::size_t i = 1; i < count_; ++i) {
    const double length2 = piece(i).squaredNorm();
    const double part = length2 > 0.0 ? std::clamp(-places[i - 1].dot(piece(i)) / length2, 0.0, 1.0) : 0.0;
    const Eigen::Vector3d here = places[i - 1] + part * piece(i);
    if (here.norm() >= nearest) continue;
    nearest = here.norm();
    end = i;
    along = part;
    offset = here;
  }
  double bow = 0.0;
  if (end > 1) bow = bowAt(along, piece(end), piece(end - 1));
  if (end + 1 < count_) bow = std::max(bow, bowAt(along, piece(end), piece(end + 1)));
  if (bow > options_.tolerance) return;

  height_error_ = offset.z();
  cross_track_error_ = std::hypot(offset.x(), offset.y());
  ++comparisons_;
  const double limit = options_.tolerance + bow;
  const bool agrees = std::abs(height_error_) <= limit && cross_track_error_ <= limit;
  agreements_ = agrees ? agreements_ + 1 : 0;
  disagreements_ = agrees ? 0 : disagreements_ + 1;
  if (agreements_ >= options_.checks) verdict_ = Verdict::kAgrees;
  if (disagreements_ >= options_.checks) verdict_ = Verdict::kDisagrees;
}

}  // namespace xplane_bridge::core
