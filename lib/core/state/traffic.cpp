#include "xplane_bridge/core/state/traffic.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

// Before those of the aircraft.
constexpr const char* kShared[] = {
    "sim/time/total_running_time_sec",
    "sim/flightmodel/position/lat_ref",
    "sim/flightmodel/position/lon_ref",
};
enum SharedIndex : std::size_t { kTime = 0, kLatitude, kLongitude, kSharedCount };
static_assert(std::size(kShared) == kSharedCount);

// Of an aircraft: in all versions, then from 11.50 on.
enum Leaf : std::size_t { kX = 0, kY, kZ, kPitch, kRoll, kHeading, kVx, kVy, kVz };
constexpr const char* kPlanes = "sim/multiplayer/position/";
constexpr const char* kPose[] = {"x", "y", "z", "the", "phi", "psi", "v_x", "v_y", "v_z"};
enum Tcas : std::size_t { kDistance = std::size(kPose), kBearing, kAltitudeDifference, kModeS, kCode };
constexpr const char* kRelative[] = {"relative_distance_mtrs", "relative_bearing_degs", "relative_altitude_mtrs"};
constexpr const char* kTarget[] = {"modeS_id", "modeC_code"};
constexpr std::int32_t kFirstWithTargets = 115000;

std::int32_t whole(float value) { return std::isfinite(value) ? static_cast<std::int32_t>(std::lround(value)) : 0; }

}  // namespace

TrafficAssembler::TrafficAssembler(const Options& options) : options_(options) { configure(SimulatorVersion{}); }

void TrafficAssembler::configure(SimulatorVersion version) {
  requests_.assign(std::begin(kShared), std::end(kShared));
  for (int number = 1; number <= options_.aircraft; ++number) {
    const std::string digits = std::to_string(number);
    const std::string plane = kPlanes + ("plane" + digits + "_");
    for (const char* leaf : kPose) requests_.push_back(std::string(plane).append(leaf));
    const std::string element = "[" + digits + "]";
    for (const char* leaf : kRelative)
      requests_.push_back("sim/cockpit2/tcas/indicators/" + std::string(leaf) + element);
    if (version.number < kFirstWithTargets) continue;
    for (const char* leaf : kTarget) requests_.push_back("sim/cockpit2/tcas/targets/" + std::string(leaf) + element);
  }
  each_ = (requests_.size() - kSharedCount) / static_cast<std::size_t>(options_.aircraft);
  frames_ = RrefFrameAssembler(requests_.size(), 0, RrefFrameAssembler::Options::atRate(options_.rate));
}

TrafficState TrafficAssembler::state() const {
  const std::vector<float>& values = frames_.values();
  TrafficState out;
  out.sim_time = values[kTime];
  const GeoPoint origin{static_cast<double>(values[kLatitude]), static_cast<double>(values[kLongitude]), 0.0};
  if (!std::isfinite(origin.latitude_deg) || !std::isfinite(origin.longitude_deg)) return out;
  const TangentFrame scenery(origin);
  for (int number = 1; number <= options_.aircraft; ++number) {
    const std::size_t first = kSharedCount + static_cast<std::size_t>(number - 1) * each_;
    const auto at = [&](std::size_t leaf) { return static_cast<double>(values[first + leaf]); };
    const auto vector = [&](std::size_t leaf) { return Eigen::Vector3d(at(leaf), at(leaf + 1), at(leaf + 2)); };
    const Eigen::Vector3d position = vector(kX), velocity = vector(kVx), angles = vector(kPitch);
    if (!position.allFinite() || !velocity.allFinite() || !angles.allFinite() || position.isZero(0.0)) continue;
    OtherAircraft other;
    other.number = number;
    other.place = scenery.geoPoint(enuFromOpengl(position));
    const double latitude = other.place.latitude_deg, longitude = other.place.longitude_deg;
    const EulerAngles shown{at(kRoll) * kRadiansPerDegree, at(kPitch) * kRadiansPerDegree,
                            at(kHeading) * kRadiansPerDegree};
    const EulerAngles level = eulerAngles(levelAttitude(scenery, rotationNedFrd(shown), latitude, longitude));
    other.roll_deg = level.roll * kDegreesPerRadian;
    other.pitch_deg = level.pitch * kDegreesPerRadian;
    other.heading_deg = wrap360(level.heading * kDegreesPerRadian);
    other.velocity_ned = nedFromEnu(scenery.levelFromFrame(latitude, longitude) * enuFromOpengl(velocity));
    other.tcas_distance = values[first + kDistance];
    other.tcas_bearing_deg = values[first + kBearing];
    other.tcas_altitude_difference = values[first + kAltitudeDifference];
    if (each_ > kModeS) {
      other.mode_s_id = whole(values[first + kModeS]);
      other.transponder_code = whole(values[first + kCode]);
    }
    out.aircraft.push_back(other);
  }
  return out;
}

}  // namespace xplane_bridge::core
