#include "xplane_bridge/core/state/consistency_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

using Eigen::Vector3d;
using V = FlightState;

/// A fault explains a disagreement when undoing it leaves no more than this part of the error.
constexpr double kExplains = 0.5;

struct NamedFault {
  ConsistencyFault fault;
  const char* name;
};

constexpr NamedFault kFaultNames[] = {
    {ConsistencyFault::kNone, "none"},
    {ConsistencyFault::kUnexplained, "unexplained"},
    {ConsistencyFault::kSwappedXy, "x and y swapped"},
    {ConsistencyFault::kSwappedYz, "y and z swapped"},
    {ConsistencyFault::kSwappedXz, "x and z swapped"},
    {ConsistencyFault::kReversedX, "sign of x reversed"},
    {ConsistencyFault::kReversedY, "sign of y reversed"},
    {ConsistencyFault::kReversedZ, "sign of z reversed"},
    {ConsistencyFault::kReversed, "all signs reversed"},
    {ConsistencyFault::kDegreesForRadians, "degrees taken for radians"},
    {ConsistencyFault::kRadiansForDegrees, "radians taken for degrees"},
    {ConsistencyFault::kKnotsForMetersPerSecond, "knots taken for m/s"},
    {ConsistencyFault::kMetersPerSecondForKnots, "m/s taken for knots"},
    {ConsistencyFault::kFeetForMeters, "feet taken for metres"},
    {ConsistencyFault::kFeetPerMinuteForMetersPerSecond, "ft/min taken for m/s"},
    {ConsistencyFault::kGForMetersPerSecondSquared, "g taken for m/s^2"},
    {ConsistencyFault::kGravityMissing, "acceleration taken for specific force"},
    {ConsistencyFault::kWindReversed, "wind reversed"},
    {ConsistencyFault::kWindSwapped, "wind north and east swapped"},
    {ConsistencyFault::kWindIgnored, "airspeed without wind"},
};

/// The faults of a vector, each with what undoes it.
Vector3d undo(ConsistencyFault fault, const Vector3d& v) {
  switch (fault) {
    case ConsistencyFault::kSwappedXy:
      return {v.y(), v.x(), v.z()};
    case ConsistencyFault::kSwappedYz:
      return {v.x(), v.z(), v.y()};
    case ConsistencyFault::kSwappedXz:
      return {v.z(), v.y(), v.x()};
    case ConsistencyFault::kReversedX:
      return {-v.x(), v.y(), v.z()};
    case ConsistencyFault::kReversedY:
      return {v.x(), -v.y(), v.z()};
    case ConsistencyFault::kReversedZ:
      return {v.x(), v.y(), -v.z()};
    case ConsistencyFault::kReversed:
      return -v;
    case ConsistencyFault::kDegreesForRadians:
      return kRadiansPerDegree * v;
    case ConsistencyFault::kRadiansForDegrees:
      return kDegreesPerRadian * v;
    case ConsistencyFault::kGForMetersPerSecondSquared:
      return kStandardGravity * v;
    default:
      return v;
  }
}

}  // namespace

const char* toString(ConsistencyCheck check) {
  switch (check) {
    case ConsistencyCheck::kRates:
      return "attitude against p, q, r";
    case ConsistencyCheck::kSpecificForce:
      return "velocity against specific force";
    case ConsistencyCheck::kAirspeed:
      return "velocity and wind against true airspeed";
    case ConsistencyCheck::kClimb:
      return "height against vertical velocity";
  }
  return "unknown";
}

const char* toString(ConsistencyVerdict verdict) {
  switch (verdict) {
    case ConsistencyVerdict::kUnknown:
      return "unknown";
    case ConsistencyVerdict::kConsistent:
      return "consistent";
    case ConsistencyVerdict::kInconsistent:
      return "inconsistent";
  }
  return "unknown";
}

const char* toString(ConsistencyFault fault) {
  for (const NamedFault& named : kFaultNames) {
    if (named.fault == fault) return named.name;
  }
  return "unknown";
}

void ConsistencyMonitor::reset() {
  started_ = false;
  first_ = count_ = 0;
}

void ConsistencyMonitor::add(const FlightState& state) {
  const bool usable = !state.paused && !state.replay && !state.on_ground && state.has(V::kValidAttitude);
  if (!usable) {
    started_ = false;
    return;
  }
  const double dt = state.sim_time_unwrapped - previous_.sim_time_unwrapped;
  if (!started_ || state.epoch != previous_.epoch || !(dt > 0.0) || dt > options_.max_interval) {
    begin(state);
    return;
  }
  // Trapezoids: the mean of the ends stands for the step between.
  elapsed_ += dt;
  rates_sum_ += dt / 2.0 * (state.angular_velocity + previous_.angular_velocity);
  force_sum_ += dt / 2.0 * (state.specific_force + previous_.specific_force);
  velocity_sum_ += dt / 2.0 * (state.velocity_ned + previous_.velocity_ned);
  wind_sum_ += dt / 2.0 * (state.wind_ned + previous_.wind_ned);
  airspeed_sum_ += dt / 2.0 * static_cast<double>(state.true_airspeed + previous_.true_airspeed);
  climb_sum_ += dt / 2.0 * static_cast<double>(state.vertical_speed + previous_.vertical_speed);
  valid_ &= state.valid;
  previous_ = state;
  if (elapsed_ < options_.interval) return;
  close(state, elapsed_);
  begin(state);
}

void ConsistencyMonitor::begin(const FlightState& state) {
  started_ = true;
  begin_ = previous_ = state;
  elapsed_ = 0.0;
  rates_sum_ = force_sum_ = velocity_sum_ = wind_sum_ = Vector3d::Zero();
  airspeed_sum_ = climb_sum_ = 0.0;
  valid_ = state.valid;
}

void ConsistencyMonitor::close(const FlightState& state, double elapsed) {
  Interval i{};
  // Rotation from begin to end, in body axes; its vector over time is the mean body rate.
  const Eigen::AngleAxisd turn(begin_.orientation.conjugate() * state.orientation);
  const double angle = turn.angle() > kPi ? turn.angle() - 2.0 * kPi : turn.angle();
  i.rates_expected = turn.axis() * (angle / elapsed);
  i.rates_received = rates_sum_ / elapsed;
  const Eigen::Quaterniond middle = begin_.orientation.slerp(0.5, state.orientation);
  const Vector3d acceleration = (state.velocity_ned - begin_.velocity_ned) / elapsed;
  i.acceleration_body = middle.conjugate() * acceleration;
  i.force_expected = middle.conjugate() * (acceleration - Vector3d(0.0, 0.0, kStandardGravity));
  i.force_received = force_sum_ / elapsed;
  i.velocity = velocity_sum_ / elapsed;
  i.wind = wind_sum_ / elapsed;
  i.airspeed_received = airspeed_sum_ / elapsed;
  i.climb_expected = (state.altitude_msl - begin_.altitude_msl) / elapsed;
  i.climb_received = climb_sum_ / elapsed;
  const auto known = [this](std::uint32_t bits) { return (valid_ & bits) == bits; };
  i.has_rates = known(V::kValidAttitude | V::kValidRates);
  i.has_force = known(V::kValidAttitude | V::kValidVelocity | V::kValidLoad);
  i.has_airspeed = known(V::kValidVelocity | V::kValidWind | V::kValidAirspeeds);
  i.has_climb = known(V::kValidPosition | V::kValidVelocity) && state.position_source == begin_.position_source;
  if (count_ == kWindow) {
    first_ = (first_ + 1) % kWindow;
    --count_;
  }
  intervals_[(first_ + count_++) % kWindow] = i;
}

std::array<ConsistencyResult, kConsistencyCheckCount> ConsistencyMonitor::evaluate() const {
  return {evaluateRates(), evaluateForce(), evaluateAirspeed(), evaluateClimb()};
}

template <typename Known, typename SquaredError>
ConsistencyResult ConsistencyMonitor::compare(const Known& known, const SquaredError& squared_error,
                                              const Limits& limits,
                                              std::initializer_list<ConsistencyFault> faults) const {
  const auto error = [&](ConsistencyFault fault) {
    double sum = 0.0;
    int n = 0;
    for (std::size_t k = 0; k < count_; ++k) {
      if (!known(interval(k))) continue;
      sum += squared_error(interval(k), fault);
      ++n;
    }
    return n > 0 ? std::sqrt(sum / n) : 0.0;
  };
  ConsistencyResult result;
  double sum = 0.0;
  for (std::size_t k = 0; k < count_; ++k) {
    if (!known(interval(k))) continue;
    sum += limits.squared_expected(interval(k));
    ++result.samples;
  }
  if (result.samples > 0) result.excitation = std::sqrt(sum / result.samples);
  result.error = error(ConsistencyFault::kNone);
  result.tolerance = std::max(limits.floor, limits.relative * result.excitation);
  if (result.samples < options_.min_samples) return result;
  // While nothing moves, agreement means nothing; a disagreement does, where the values should then be zero.
  const bool excited = result.excitation >= limits.min_excitation;
  if (!excited && (result.error <= result.tolerance || limits.silent_without_excitation)) return result;
  if (result.error <= result.tolerance) {
    result.verdict = ConsistencyVerdict::kConsistent;
    return result;
  }
  result.verdict = ConsistencyVerdict::kInconsistent;
  result.fault = ConsistencyFault::kUnexplained;
  double best = kExplains * result.error;
  for (const ConsistencyFault fault : faults) {
    const double left = error(fault);
    if (left >= best) continue;
    best = left;
    result.fault = fault;
  }
  return result;
}

ConsistencyResult ConsistencyMonitor::evaluateRates() const {
  const Limits limits{options_.rates_floor, options_.relative_tolerance, options_.min_rates, false,
                      [](const Interval& i) { return i.rates_expected.squaredNorm(); }};
  return compare(
      [](const Interval& i) { return i.has_rates; },
      [](const Interval& i, ConsistencyFault fault) {
        return (undo(fault, i.rates_received) - i.rates_expected).squaredNorm();
      },
      limits,
      {ConsistencyFault::kSwappedXy, ConsistencyFault::kSwappedYz, ConsistencyFault::kSwappedXz,
       ConsistencyFault::kReversedX, ConsistencyFault::kReversedY, ConsistencyFault::kReversedZ,
       ConsistencyFault::kReversed, ConsistencyFault::kDegreesForRadians, ConsistencyFault::kRadiansForDegrees});
}

ConsistencyResult ConsistencyMonitor::evaluateForce() const {
  // Gravity makes the excitation 9.8 m/s^2 in any flight: a share of it as tolerance would hide a wrong axial sign.
  const Limits limits{options_.force_floor, 0.0, 0.0, false,
                      [](const Interval& i) { return i.force_expected.squaredNorm(); }};
  return compare(
      [](const Interval& i) { return i.has_force; },
      [](const Interval& i, ConsistencyFault fault) {
        const bool no_gravity = fault == ConsistencyFault::kGravityMissing;
        const Vector3d& expected = no_gravity ? i.acceleration_body : i.force_expected;
        return (undo(fault, i.force_received) - expected).squaredNorm();
      },
      limits,
      {ConsistencyFault::kSwappedXy, ConsistencyFault::kSwappedYz, ConsistencyFault::kSwappedXz,
       ConsistencyFault::kReversedX, ConsistencyFault::kReversedY, ConsistencyFault::kReversedZ,
       ConsistencyFault::kReversed, ConsistencyFault::kGForMetersPerSecondSquared, ConsistencyFault::kGravityMissing});
}

ConsistencyResult ConsistencyMonitor::evaluateAirspeed() const {
  const Limits limits{options_.speed_floor, 0.0, options_.min_airspeed, true,
                      [](const Interval& i) { return (i.velocity - i.wind).squaredNorm(); }};
  return compare([](const Interval& i) { return i.has_airspeed; },
                 [](const Interval& i, ConsistencyFault fault) {
                   Vector3d wind = i.wind;
                   double airspeed = i.airspeed_received;
                   if (fault == ConsistencyFault::kWindReversed) wind = -wind;
                   if (fault == ConsistencyFault::kWindSwapped) std::swap(wind.x(), wind.y());
                   if (fault == ConsistencyFault::kWindIgnored) wind.setZero();
                   if (fault == ConsistencyFault::kKnotsForMetersPerSecond) airspeed *= kMetersPerSecondPerKnot;
                   if (fault == ConsistencyFault::kMetersPerSecondForKnots) airspeed /= kMetersPerSecondPerKnot;
                   const double difference = airspeed - (i.velocity - wind).norm();
                   return difference * difference;
                 },
                 limits,
                 {ConsistencyFault::kWindReversed, ConsistencyFault::kWindSwapped, ConsistencyFault::kWindIgnored,
                  ConsistencyFault::kKnotsForMetersPerSecond, ConsistencyFault::kMetersPerSecondForKnots});
}

ConsistencyResult ConsistencyMonitor::evaluateClimb() const {
  const Limits limits{options_.climb_floor, options_.relative_tolerance, options_.min_climb, false,
                      [](const Interval& i) { return i.climb_expected * i.climb_expected; }};
  return compare([](const Interval& i) { return i.has_climb; },
                 [](const Interval& i, ConsistencyFault fault) {
                   double climb = i.climb_received;
                   if (fault == ConsistencyFault::kReversed) climb = -climb;
                   if (fault == ConsistencyFault::kFeetForMeters) climb *= kMetersPerFoot;
                   if (fault == ConsistencyFault::kFeetPerMinuteForMetersPerSecond) {
                     climb *= kMetersPerSecondPerFootPerMinute;
                   }
                   const double difference = climb - i.climb_expected;
                   return difference * difference;
                 },
                 limits,
                 {ConsistencyFault::kReversed, ConsistencyFault::kFeetForMeters,
                  ConsistencyFault::kFeetPerMinuteForMetersPerSecond});
}

}  // namespace xplane_bridge::core
