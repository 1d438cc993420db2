#include "xplane_bridge/core/state/consistency_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge::core {
namespace {

using Eigen::Vector3d;
using Fault = std::function<void(FlightState&)>;

constexpr double kRate = 60.0;

/// A flight given by formulas: turns both ways, climbs and descends, speeds up and slows down, in wind. Body rates and
/// specific force are the exact derivatives, taken numerically from the formulas over 2e-5 s, not from the code under
/// test.
class AnalyticFlight {
 public:
  explicit AnalyticFlight(Vector3d wind_ned = Vector3d(6.0, -4.0, 0.0)) : wind_(std::move(wind_ned)) {}

  FlightState at(double t) const {
    constexpr double h = 1e-5;
    FlightState s;
    const EulerAngles a = attitude(t);
    s.sim_time_unwrapped = t;
    s.orientation = quaternionNedFrd(a);
    s.velocity_ned = velocity(t);
    s.vertical_speed = static_cast<float>(-s.velocity_ned.z());
    // Height is the integral of the climb: -vD = 5 sin(0.21 t) -> 5/0.21 (1 - cos(0.21 t)).
    s.altitude_msl = 1000.0 + 5.0 / 0.21 * (1.0 - std::cos(0.21 * t));
    s.wind_ned = wind_;
    s.true_airspeed = static_cast<float>((s.velocity_ned - wind_).norm());
    const Eigen::Matrix3d R = rotationNedFrd(a);
    const Eigen::Matrix3d turn =
        R.transpose() * (rotationNedFrd(attitude(t + h)) - rotationNedFrd(attitude(t - h))) / (2 * h);
    s.angular_velocity = {turn(2, 1), turn(0, 2), turn(1, 0)};
    const Vector3d acceleration = (velocity(t + h) - velocity(t - h)) / (2 * h);
    s.specific_force = R.transpose() * (acceleration - Vector3d(0, 0, kStandardGravity));
    s.position_source = PositionSource::kLocal;
    s.valid = FlightState::kValidAll;
    return s;
  }

 private:
  static EulerAngles attitude(double t) {
    return {0.5 * std::sin(0.5 * t), 0.1 * std::sin(0.33 * t + 1.0), 0.8 * std::sin(0.2 * t) + 0.3};
  }
  static Vector3d velocity(double t) {
    const double heading = 0.8 * std::sin(0.2 * t) + 0.35;
    const double speed = 55.0 + 10.0 * std::sin(0.4 * t);
    return {speed * std::cos(heading), speed * std::sin(heading), -5.0 * std::sin(0.21 * t)};
  }

  Vector3d wind_;
};

std::array<ConsistencyResult, kConsistencyCheckCount> watch(const Fault& fault, double seconds = 25.0,
                                                            const AnalyticFlight& flight = AnalyticFlight()) {
  ConsistencyMonitor monitor;
  for (int i = 0; i < static_cast<int>(seconds * kRate); ++i) {
    FlightState state = flight.at(i / kRate);
    fault(state);
    monitor.add(state);
  }
  return monitor.evaluate();
}

const ConsistencyResult& of(const std::array<ConsistencyResult, kConsistencyCheckCount>& results,
                            ConsistencyCheck check) {
  return results[static_cast<std::size_t>(check)];
}

void expectNamed(const Fault& fault, ConsistencyCheck check, ConsistencyFault expected) {
  const auto results = watch(fault);
  const ConsistencyResult& result = of(results, check);
  EXPECT_EQ(result.verdict, ConsistencyVerdict::kInconsistent) << toString(check) << " error " << result.error;
  EXPECT_EQ(result.fault, expected) << toString(check) << ": " << toString(result.fault);
}

TEST(ConsistencyMonitor, HealthyFlightIsConsistent) {
  const auto results = watch([](FlightState&) {});
  for (std::size_t i = 0; i < results.size(); ++i) {
    SCOPED_TRACE(toString(static_cast<ConsistencyCheck>(i)));
    EXPECT_EQ(results[i].verdict, ConsistencyVerdict::kConsistent) << results[i].error;
    EXPECT_EQ(results[i].fault, ConsistencyFault::kNone);
    EXPECT_LT(results[i].error, 0.2 * results[i].tolerance);
    EXPECT_GT(results[i].samples, 100);
  }
}

TEST(ConsistencyMonitor, NamesSwappedRates) {
  const auto rates = ConsistencyCheck::kRates;
  expectNamed([](FlightState& s) { std::swap(s.angular_velocity.x(), s.angular_velocity.y()); }, rates,
              ConsistencyFault::kSwappedXy);
  expectNamed([](FlightState& s) { std::swap(s.angular_velocity.y(), s.angular_velocity.z()); }, rates,
              ConsistencyFault::kSwappedYz);
  expectNamed([](FlightState& s) { std::swap(s.angular_velocity.x(), s.angular_velocity.z()); }, rates,
              ConsistencyFault::kSwappedXz);
}

TEST(ConsistencyMonitor, NamesReversedRates) {
  const auto rates = ConsistencyCheck::kRates;
  expectNamed([](FlightState& s) { s.angular_velocity.x() *= -1; }, rates, ConsistencyFault::kReversedX);
  expectNamed([](FlightState& s) { s.angular_velocity.z() *= -1; }, rates, ConsistencyFault::kReversedZ);
  expectNamed([](FlightState& s) { s.angular_velocity *= -1; }, rates, ConsistencyFault::kReversed);
}

TEST(ConsistencyMonitor, NamesDegreesTakenForRadians) {
  expectNamed([](FlightState& s) { s.angular_velocity *= kDegreesPerRadian; }, ConsistencyCheck::kRates,
              ConsistencyFault::kDegreesForRadians);
  expectNamed([](FlightState& s) { s.angular_velocity *= kRadiansPerDegree; }, ConsistencyCheck::kRates,
              ConsistencyFault::kRadiansForDegrees);
}

TEST(ConsistencyMonitor, NamesWrongSpecificForce) {
  const auto force = ConsistencyCheck::kSpecificForce;
  expectNamed([](FlightState& s) { s.specific_force.x() *= -1; }, force, ConsistencyFault::kReversedX);
  expectNamed([](FlightState& s) { s.specific_force.y() *= -1; }, force, ConsistencyFault::kReversedY);
  expectNamed([](FlightState& s) { s.specific_force.z() *= -1; }, force, ConsistencyFault::kReversedZ);
  expectNamed([](FlightState& s) { std::swap(s.specific_force.x(), s.specific_force.y()); }, force,
              ConsistencyFault::kSwappedXy);
  expectNamed([](FlightState& s) { s.specific_force /= kStandardGravity; }, force,
              ConsistencyFault::kGForMetersPerSecondSquared);
  expectNamed([](FlightState& s) { s.specific_force += s.orientation.conjugate() * Vector3d(0, 0, kStandardGravity); },
              force, ConsistencyFault::kGravityMissing);
}

TEST(ConsistencyMonitor, NamesWrongWind) {
  const auto airspeed = ConsistencyCheck::kAirspeed;
  expectNamed([](FlightState& s) { s.wind_ned *= -1; }, airspeed, ConsistencyFault::kWindReversed);
  expectNamed([](FlightState& s) { std::swap(s.wind_ned.x(), s.wind_ned.y()); }, airspeed,
              ConsistencyFault::kWindSwapped);
  expectNamed([](FlightState& s) { s.true_airspeed = static_cast<float>(s.velocity_ned.norm()); }, airspeed,
              ConsistencyFault::kWindIgnored);
  expectNamed([](FlightState& s) { s.true_airspeed = static_cast<float>(s.true_airspeed / kMetersPerSecondPerKnot); },
              airspeed, ConsistencyFault::kKnotsForMetersPerSecond);
}

TEST(ConsistencyMonitor, NamesWrongClimb) {
  const auto climb = ConsistencyCheck::kClimb;
  expectNamed([](FlightState& s) { s.vertical_speed *= -1; }, climb, ConsistencyFault::kReversed);
  expectNamed([](FlightState& s) { s.vertical_speed = static_cast<float>(s.vertical_speed / kMetersPerFoot); }, climb,
              ConsistencyFault::kFeetForMeters);
  expectNamed(
      [](FlightState& s) {
        s.vertical_speed = static_cast<float>(s.vertical_speed / kMetersPerSecondPerFootPerMinute);
      },
      climb, ConsistencyFault::kFeetPerMinuteForMetersPerSecond);
}

TEST(ConsistencyMonitor, SaysWhenNothingExplainsIt) {
  const auto results = watch([](FlightState& s) { s.true_airspeed += 20.0F; });
  EXPECT_EQ(of(results, ConsistencyCheck::kAirspeed).verdict, ConsistencyVerdict::kInconsistent);
  EXPECT_EQ(of(results, ConsistencyCheck::kAirspeed).fault, ConsistencyFault::kUnexplained);
}

TEST(ConsistencyMonitor, OneFaultDoesNotAlarmTheOtherChecks) {
  const auto results = watch([](FlightState& s) { s.angular_velocity *= -1; });
  EXPECT_EQ(of(results, ConsistencyCheck::kSpecificForce).verdict, ConsistencyVerdict::kConsistent);
  EXPECT_EQ(of(results, ConsistencyCheck::kAirspeed).verdict, ConsistencyVerdict::kConsistent);
  EXPECT_EQ(of(results, ConsistencyCheck::kClimb).verdict, ConsistencyVerdict::kConsistent);
}

TEST(ConsistencyMonitor, KnowsNothingBeforeEnoughSamples) {
  for (const ConsistencyResult& result : watch([](FlightState& s) { s.angular_velocity *= -1; }, 1.0)) {
    EXPECT_EQ(result.verdict, ConsistencyVerdict::kUnknown);
  }
}

TEST(ConsistencyMonitor, ParkedPausedAndUnknownStatesDoNotCount) {
  for (const Fault& fault :
       {Fault([](FlightState& s) { s.on_ground = true; }), Fault([](FlightState& s) { s.paused = true; }),
        Fault([](FlightState& s) { s.valid = 0; })}) {
    for (const ConsistencyResult& result : watch(fault)) {
      EXPECT_EQ(result.verdict, ConsistencyVerdict::kUnknown);
      EXPECT_EQ(result.samples, 0);
    }
  }
  const auto results = watch([](FlightState& s) {
    s.valid &= ~FlightState::kValidWind;
    s.wind_ned = nanVector();
  });
  EXPECT_EQ(of(results, ConsistencyCheck::kAirspeed).verdict, ConsistencyVerdict::kUnknown);
  EXPECT_EQ(of(results, ConsistencyCheck::kRates).verdict, ConsistencyVerdict::kConsistent);
}

// A reset puts the aircraft elsewhere: the interval across it must not count.
TEST(ConsistencyMonitor, EpochsAreNotCompared) {
  ConsistencyMonitor monitor;
  const AnalyticFlight flight;
  for (int i = 0; i < 1500; ++i) {
    FlightState state = flight.at(i / kRate);
    state.epoch = static_cast<std::uint32_t>(i / 100);
    state.altitude_msl += 500.0 * state.epoch;
    state.velocity_ned.x() += 30.0 * state.epoch;
    state.true_airspeed = static_cast<float>((state.velocity_ned - state.wind_ned).norm());
    monitor.add(state);
  }
  for (const ConsistencyResult& result : monitor.evaluate())
    EXPECT_NE(result.verdict, ConsistencyVerdict::kInconsistent);
}

TEST(ConsistencyMonitor, WrongWindCannotShowInCalmAir) {
  const auto results = watch([](FlightState& s) { s.wind_ned *= -1; }, 25.0, AnalyticFlight(Vector3d::Zero()));
  EXPECT_EQ(of(results, ConsistencyCheck::kAirspeed).verdict, ConsistencyVerdict::kConsistent);
}

}  // namespace
}  // namespace xplane_bridge::core
