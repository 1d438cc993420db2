#include "xplane_bridge/core/camera/pose_check.hpp"

#include <algorithm>
#include <cmath>

namespace xplane_bridge::core {
namespace {

constexpr double kWindow = 2.0;           // [s] simulator time
constexpr int kFewestSamples = 10;        // of a window
constexpr double kSteadyLever = 0.05;     // [m] a lever arm that moves less is constant
constexpr double kLeverMatters = 0.01;    // [m] candidates nearer to each other need no decision
constexpr double kAxesMatterDeg = 0.02;   // likewise
constexpr double kJump = 200.0;           // [m] in one frame: another flight, or another origin of the scenery
constexpr double kLongestFrame = 1.0;     // [s]
constexpr double kSameAngleDeg = 1e-3;    // of the visual offset
constexpr double kTurnedEnoughDeg = 0.1;  // scatter of the wrong axes that proves them wrong
constexpr double kCockpitFirst = 1000.0, kCockpitLast = 1026.0;  // numbers of views from the cockpit

bool sameAngles(const AnglesDeg& a, const AnglesDeg& b) {
  const auto same = [](double x, double y) {
    return (std::isnan(x) && std::isnan(y)) || std::abs(x - y) < kSameAngleDeg;
  };
  return same(a.roll, b.roll) && same(a.pitch, b.pitch) && same(a.heading, b.heading);
}

/// X-Plane's right, up, aft to forward, left, up.
Eigen::Vector3d fluFromAircraft(const Eigen::Vector3d& v) { return {-v.z(), -v.x(), v.y()}; }

/// One of two is right by a reference: it lies near it, and the other does not. 0, 1; -1: neither is shown.
int nearer(double first, double second, double gap) {
  if (first < 0.3 * gap && second > 0.7 * gap) return 0;
  if (second < 0.3 * gap && first > 0.7 * gap) return 1;
  return -1;
}

}  // namespace

void PoseCheck::Directions::add(const Eigen::Quaterniond& q) {
  if (!first) first = q;
  scatter_deg = std::max(scatter_deg, angleBetweenDeg(*first, q));
}

bool PoseCheck::continues(const CameraSample& sample) const {
  if (!before_ || !before_->complete()) return false;
  const double step = sample.sim_time - before_->sim_time;
  return step > 0.0 && step < kLongestFrame && sample.view_type == before_->view_type &&
         sample.external == before_->external && sameAngles(sample.visual_offset, before_->visual_offset) &&
         (sample.aircraft_position - before_->aircraft_position).norm() < kJump;
}

bool PoseCheck::provesSomething(const CameraSample& sample) const {
  return !sample.external && sample.view_type >= kCockpitFirst && sample.view_type <= kCockpitLast;
}

std::optional<CheckedPose> PoseCheck::add(const CameraSample& sample) {
  if (!sample.complete() || !std::isfinite(sample.sim_time)) {
    before_.reset();
    window_ = Window();
    return std::nullopt;
  }
  const bool moves = !sample.paused && (!before_ || sample.sim_time != before_->sim_time);
  const bool follows = continues(sample);
  if (moves && follows && provesSomething(sample)) {
    watch(sample);
  } else if (moves) {
    window_ = Window();
  }
  const CameraSample& aircraft = reading_.frame_before && follows ? *before_ : sample;
  if (const auto within = offsetsWithin(sample, aircraft, reading_)) {
    if (offsetAngleDeg(sample) > kTurnedEnoughDeg) {
      reading_.offsets_within = *within;
      offsets_known_ = true;
    }
  }
  const auto pose = measuredPose(sample, aircraft, reading_);
  if (!pose) return std::nullopt;

  CheckedPose checked{aircraft.sim_time, *pose, steady_};
  if (!follows && !sample.paused && (!frame_known_ || reading_.frame_before)) checked.sure = false;
  // What the other candidates would say, where it is open which one is right.
  const auto compare = [&](const CameraSample& other_aircraft, const PoseReading& other) {
    const auto candidate = measuredPose(sample, other_aircraft, other);
    if (!candidate) return;
    const double turn = angleBetweenDeg(candidate->orientation, pose->orientation);
    const double shift = (candidate->position - pose->position).norm();
    if (turn > kAxesMatterDeg || shift > kLeverMatters) checked.sure = false;
    checked.pose.angle_uncertainty_deg = std::max(checked.pose.angle_uncertainty_deg, turn);
    checked.pose.position_uncertainty = std::max(checked.pose.position_uncertainty, shift);
  };
  if (!frame_known_ && follows) compare(reading_.frame_before ? sample : *before_, reading_);
  if (!axes_known_) {
    PoseReading other = reading_;
    other.true_axes = !other.true_axes;
    compare(aircraft, other);
  }
  if (!offsets_known_ && offsetAngleDeg(sample) > kTurnedEnoughDeg) {
    PoseReading other = reading_;
    other.offsets_within = !other.offsets_within;
    compare(aircraft, other);
  }
  if (moves || !before_) before_ = sample;
  return checked;
}

void PoseCheck::watch(const CameraSample& sample) {
  if (std::isnan(window_.began)) window_.began = sample.sim_time;
  ++window_.samples;
  const bool head_moves = sample.isView(ViewType::kCockpit3d) && sample.head_position.allFinite();
  const auto expected_turn = offsetAngleDeg(sample) < kTurnedEnoughDeg &&
                                     (sample.isView(ViewType::kCockpit3d) || sample.isView(ViewType::kNothing))
                                 ? expectedOrientation(sample)
                                 : std::nullopt;
  const auto matrix = worldMatrixPose(sample);
  window_.lever_expected = window_.lever_expected && (head_moves || sample.eye_position.allFinite());
  window_.turn_expected = window_.turn_expected && expected_turn.has_value();
  window_.matrix = window_.matrix && matrix.has_value();
  for (const bool frame_before : {false, true}) {
    const CameraSample& aircraft = frame_before ? *before_ : sample;
    PoseReading reading = reading_;
    reading.frame_before = frame_before;
    std::array<std::optional<CameraPose>, 2> poses;
    for (const bool true_axes : {false, true}) {
      reading.true_axes = true_axes;
      poses[true_axes] = measuredPose(sample, aircraft, reading);
      if (!poses[true_axes]) continue;
      Directions& directions = window_.turned[true_axes][frame_before];
      const Eigen::Quaterniond& turn = poses[true_axes]->orientation;
      // A head that turns is taken out.
      directions.add(expected_turn ? expected_turn->conjugate() * turn : turn);
      if (expected_turn)
        directions.from_expected = std::max(directions.from_expected, angleBetweenDeg(turn, *expected_turn));
      if (matrix) {
        directions.from_matrix_deg = std::max(directions.from_matrix_deg, angleBetweenDeg(turn, matrix->orientation));
      }
    }
    if (poses[0]) {
      const Eigen::Vector3d head =
          head_moves ? fluFromAircraft(sample.head_position) : Eigen::Vector3d(Eigen::Vector3d::Zero());
      window_.levers[frame_before].box.extend(Eigen::Vector3d(poses[0]->position - head));
      window_.levers[frame_before].expected = head_moves || !sample.eye_position.allFinite()
                                                  ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                                  : fluFromAircraft(sample.eye_position);
    }
    if (poses[0] && poses[1] && !frame_before) {
      window_.gap_deg = std::max(window_.gap_deg, angleBetweenDeg(poses[0]->orientation, poses[1]->orientation));
    }
  }
  if (sample.sim_time - window_.began >= kWindow && window_.samples >= kFewestSamples) {
    judge();
    window_ = Window();
  }
}

void PoseCheck::judge() {
  judgeFrame();
  judgeAxes();
  lever_scatter_ = window_.levers[reading_.frame_before].scatter();
  steady_ = lever_scatter_ < kSteadyLever;
}

void PoseCheck::judgeFrame() {
  const Levers& now = window_.levers[0];
  const Levers& before = window_.levers[1];
  const double apart = (now.box.center() - before.box.center()).norm();
  const bool now_steady = now.scatter() < kSteadyLever, before_steady = before.scatter() < kSteadyLever;
  if (now_steady != before_steady) {
    reading_.frame_before = before_steady;
    frame_known_ = true;
    frame_by_ = "the lever arm that stands still";
  } else if (now_steady && window_.lever_expected && apart > kSteadyLever) {
    // Even frames in level flight: both stand still, a frame's way from each other.
    const int right = nearer(now.fromExpected(), before.fromExpected(), apart);
    if (right < 0) return;
    reading_.frame_before = right == 1;
    frame_known_ = true;
    frame_by_ = "the pilot's eye";
  }
}

void PoseCheck::judgeAxes() {
  if (window_.gap_deg < kAxesMatterDeg) return;
  const Directions& scenery = window_.turned[0][reading_.frame_before];
  const Directions& true_ones = window_.turned[1][reading_.frame_before];
  int right = -1;
  const char* by = "";
  if (window_.matrix) {
    right = nearer(scenery.from_matrix_deg, true_ones.from_matrix_deg, window_.gap_deg);
    by = "world_matrix";
  }
  if (right < 0 && window_.turn_expected) {
    right = nearer(scenery.from_expected, true_ones.from_expected, window_.gap_deg);
    by = "the head's angles";
  }
  if (right < 0 && std::max(scenery.scatter_deg, true_ones.scatter_deg) > kTurnedEnoughDeg) {
    right = nearer(scenery.scatter_deg, true_ones.scatter_deg, std::max(scenery.scatter_deg, true_ones.scatter_deg));
    by = "the direction that stands still";
  }
  if (right < 0) return;
  reading_.true_axes = right == 1;
  axes_known_ = true;
  axes_by_ = by;
}

std::string PoseCheck::report() const {
  std::string text = reading_.true_axes ? "true axes" : "scenery's axes";
  text += axes_known_ ? std::string(" (by ") + axes_by_ + ")" : std::string(" (assumed)");
  text += reading_.frame_before ? ", frame before" : ", this frame";
  text += frame_known_ ? std::string(" (by ") + frame_by_ + ")" : std::string(" (assumed)");
  if (offsets_known_) text += reading_.offsets_within ? ", visual offset contained" : ", visual offset not contained";
  if (!steady_) text += "; the camera moves in the cockpit";
  return text;
}

}  // namespace xplane_bridge::core
