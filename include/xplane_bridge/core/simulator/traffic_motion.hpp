#pragma once

/// Other aircraft that clients place: how they move between two commands, and what X-Plane is sent. Datarefs after
/// Laminar's lists of 11.40 to 12.10.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/state/frames.hpp"
#include "xplane_bridge/core/state/traffic.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// Where another aircraft is to be, and how fast it goes.
struct TrafficPose {
  int number = 0;  ///< 1..kMaxOtherAircraft
  GeoPoint place;
  EulerAngles attitude;                                    ///< [rad] against the local level
  Eigen::Vector3d velocity_ned = Eigen::Vector3d::Zero();  ///< [m/s] over ground
};

/// What is wrong with a list of them, in words; nullopt: nothing.
std::optional<std::string> check(const std::vector<TrafficPose>& poses);

/// Of angles in degrees.
EulerAngles attitudeOf(double roll_deg, double pitch_deg, double heading_deg);

/// Override of its flight by X-Plane.
std::string trafficOverride(int number);

/// One aircraft's way between two commands: it goes on with its velocity, and what a new command corrects comes within
/// kCorrection, steadily; beyond kJump it is elsewhere at once.
class TrafficMotion {
 public:
  static constexpr double kCorrection = 0.2;  ///< [s] of simulator time
  static constexpr double kJump = 200.0;      ///< [m]

  /// @param sim_time [s] simulator time at which `pose` holds
  void command(const TrafficPose& pose, double sim_time);
  TrafficPose at(double sim_time) const;

 private:
  TrafficPose commanded_;
  double since_ = 0.0;
  bool known_ = false;
  // At `since_`, what was shown against what is commanded.
  Eigen::Vector3d off_ned_ = Eigen::Vector3d::Zero();  // [m]
  EulerAngles off_;                                    // [rad]
};

/// Latitude and longitude of the scenery's origin [deg].
const std::vector<std::string>& sceneryDatarefs();
/// How a pose is written, in the axes of the scenery's origin.
std::vector<DatarefWrite> trafficWrites(const TrafficPose& pose, const TangentFrame& scenery);
/// The same as VEHX.
VehiclePose vehicleOf(const TrafficPose& pose);

}  // namespace xplane_bridge::core
