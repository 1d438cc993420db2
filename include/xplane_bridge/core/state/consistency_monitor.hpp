#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "xplane_bridge/core/state/flight_state.hpp"

namespace xplane_bridge::core {

/// Quantities that physics ties together, as the bridge has them from independent sources.
enum class ConsistencyCheck : std::uint8_t {
  kRates,          ///< change of attitude against p, q, r
  kSpecificForce,  ///< change of velocity, less gravity, against the accelerometers
  kAirspeed,       ///< |velocity - wind| against true airspeed
  kClimb,          ///< change of height against -velocity_ned.z
};
inline constexpr std::size_t kConsistencyCheckCount = 4;
const char* toString(ConsistencyCheck check);

enum class ConsistencyVerdict : std::uint8_t {
  kUnknown,  ///< too few samples, or the flight does not show it (no turns, no wind, no climb)
  kConsistent,
  kInconsistent,  ///< `fault` says what would explain it
};
const char* toString(ConsistencyVerdict verdict);

/// What, done to the received values, makes them agree.
enum class ConsistencyFault : std::uint8_t {
  kNone,
  kUnexplained,  ///< they disagree, and none of the others explains it
  kSwappedXy,    ///< x and y (p and q, north and east) exchanged
  kSwappedYz,
  kSwappedXz,
  kReversedX,  ///< wrong sign
  kReversedY,
  kReversedZ,
  kReversed,           ///< all signs wrong
  kDegreesForRadians,  ///< values are degrees where radians are expected
  kRadiansForDegrees,
  kKnotsForMetersPerSecond,
  kMetersPerSecondForKnots,  ///< converted from knots though it was m/s
  kFeetForMeters,
  kFeetPerMinuteForMetersPerSecond,
  kGForMetersPerSecondSquared,  ///< values are in g
  kGravityMissing,              ///< acceleration instead of specific force
  kWindReversed,                ///< where the wind comes from taken for where it goes
  kWindSwapped,                 ///< north and east of the wind exchanged
  kWindIgnored,                 ///< airspeed agrees with the speed over ground instead
};
const char* toString(ConsistencyFault fault);

struct ConsistencyResult {
  ConsistencyVerdict verdict = ConsistencyVerdict::kUnknown;
  ConsistencyFault fault = ConsistencyFault::kNone;
  double error = 0.0;       ///< rms disagreement (rad/s, m/s^2, m/s, m/s)
  double tolerance = 0.0;   ///< what of it is still taken as agreement
  double excitation = 0.0;  ///< rms of the expected quantity, same unit
  int samples = 0;          ///< intervals compared
};

/// Watches a stream of flight states for contradictions: swapped axes, degrees taken for radians, a wind with the wrong
/// sign, on a simulator that has not been tried yet.
///
/// The states are compared over intervals of about a tenth of a second in a sliding window. A check answers only when
/// the flight moves enough for the answer to mean something. Intervals across an epoch, a pause, a gap or ground
/// contact do not count. Allocates nothing; evaluate() is meant for a timer, add() for every state. One thread calls,
/// or the caller locks.
class ConsistencyMonitor {
 public:
  struct Options {
    double interval = 0.1;             ///< shortest interval compared [s]
    double max_interval = 0.4;         ///< longer ones are gaps [s]
    int min_samples = 30;              ///< before a check answers
    double relative_tolerance = 0.25;  ///< of the excitation
    double rates_floor = 0.01;         ///< tolerance at least [rad/s]
    double force_floor = 0.4;          ///< [m/s^2]
    double speed_floor = 0.7;          ///< [m/s]
    double climb_floor = 0.3;          ///< [m/s]
    double min_rates = 0.02;           ///< excitation needed [rad/s]
    double min_airspeed = 10.0;        ///< [m/s]
    double min_climb = 1.0;            ///< [m/s]
  };

  ConsistencyMonitor() = default;
  explicit ConsistencyMonitor(const Options& options) : options_(options) {}

  void add(const FlightState& state);
  std::array<ConsistencyResult, kConsistencyCheckCount> evaluate() const;
  void reset();

 private:
  static constexpr std::size_t kWindow = 256;

  /// Expected and received values of one interval.
  struct Interval {
    Eigen::Vector3d rates_expected;
    Eigen::Vector3d rates_received;
    Eigen::Vector3d force_expected;  ///< FRD
    Eigen::Vector3d force_received;
    Eigen::Vector3d acceleration_body;  ///< dv/dt without gravity taken out, FRD
    Eigen::Vector3d velocity;           ///< NED
    Eigen::Vector3d wind;               ///< NED
    double airspeed_received;
    double climb_expected;  ///< from the height
    double climb_received;
    bool has_rates, has_force, has_airspeed, has_climb;
  };

  void close(const FlightState& state, double elapsed);
  void begin(const FlightState& state);
  const Interval& interval(std::size_t i) const { return intervals_[(first_ + i) % kWindow]; }

  struct Limits {
    double floor;                    ///< tolerance at least
    double relative;                 ///< tolerance as a share of the excitation
    double min_excitation;           ///< below it agreement means nothing
    bool silent_without_excitation;  ///< below it disagreement means nothing either
    double (*squared_expected)(const Interval&);
  };
  /// @param known whether an interval can be compared
  /// @param squared_error of an interval, with a fault undone
  template <typename Known, typename SquaredError>
  ConsistencyResult compare(const Known& known, const SquaredError& squared_error, const Limits& limits,
                            std::initializer_list<ConsistencyFault> faults) const;
  ConsistencyResult evaluateRates() const;
  ConsistencyResult evaluateForce() const;
  ConsistencyResult evaluateAirspeed() const;
  ConsistencyResult evaluateClimb() const;

  Options options_;
  bool started_ = false;
  FlightState previous_;
  // Sums over the current interval, weighted by time.
  FlightState begin_;
  double elapsed_ = 0.0;
  Eigen::Vector3d rates_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d wind_sum_ = Eigen::Vector3d::Zero();
  double airspeed_sum_ = 0.0;
  double climb_sum_ = 0.0;
  std::uint32_t valid_ = 0;

  std::array<Interval, kWindow> intervals_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace xplane_bridge::core
