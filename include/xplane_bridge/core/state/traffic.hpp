#pragma once

/// The other aircraft that X-Plane has: what is asked for, and what the answers say. Datarefs after Laminar's lists of
/// 11.40 to 12.10.

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/state/frames.hpp"
#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

namespace xplane_bridge::core {

/// Others than the user's aircraft, which is number 0.
inline constexpr int kMaxOtherAircraft = 19;

struct OtherAircraft {
  int number = 0;  ///< 1..kMaxOtherAircraft
  GeoPoint place;
  double roll_deg = 0.0;                                   ///< against the local level, right +
  double pitch_deg = 0.0;                                  ///< nose up +
  double heading_deg = 0.0;                                ///< 0..360, true
  Eigen::Vector3d velocity_ned = Eigen::Vector3d::Zero();  ///< [m/s] over ground
  float tcas_distance = std::nanf("");                     ///< [m] from the user's aircraft; NaN: not known
  float tcas_bearing_deg = std::nanf("");                  ///< [deg] -180..180 from the nose, right +
  float tcas_altitude_difference = std::nanf("");          ///< [m] above it +
  std::int32_t mode_s_id = 0;                              ///< 0: none
  std::int32_t transponder_code = 0;                       ///< 0: none
};

struct TrafficState {
  float sim_time = std::nanf("");  ///< [s] raw simulator time
  std::vector<OtherAircraft> aircraft;
};

/// Answers about other aircraft, joined to samples. An aircraft whose position is the scenery's origin to the digit, or
/// that does not answer, is not there. One thread calls.
class TrafficAssembler {
 public:
  struct Options {
    int aircraft = kMaxOtherAircraft;  ///< 1 to this one are asked for
    int rate = 10;                     ///< [1/s]
  };

  explicit TrafficAssembler(const Options& options);

  /// The version is known, or another: requests() change.
  void configure(SimulatorVersion version);
  /// What to subscribe; the position is the index.
  const std::vector<std::string>& requests() const { return requests_; }

  /// Returns whether the datagram completed a sample.
  bool add(const RrefView& datagram, std::int64_t receive_ns) { return frames_.add(datagram, receive_ns); }
  /// Of the sample's first datagram [ns].
  std::int64_t receiveTime() const { return frames_.receiveTime(); }
  /// Of the sample.
  TrafficState state() const;
  void reset() { frames_.reset(); }

 private:
  Options options_;
  std::size_t each_ = 0;  // requests for one aircraft
  std::vector<std::string> requests_;
  RrefFrameAssembler frames_{0};
};

}  // namespace xplane_bridge::core
