#include "xplane_bridge/core/simulator/flight_start.hpp"

#include <algorithm>
#include <cmath>

#include "setting_texts.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kNear = 1000.0;   // [m]
constexpr double kFlownOn = 0.2;   // [s] between what was sent and what is read
constexpr double kPlace = 2.0;     // [m]
constexpr double kAngleDeg = 3.0;  // [deg]
constexpr double kVelocity = 2.0;  // [m/s]

constexpr std::size_t kOrigin = 0, kRadius = 2, kPosition = 3, kQuaternion = 6, kVelocityAt = 10, kWind = 13;
constexpr std::size_t kCount = 15;

struct Range {
  const char* name;
  double FlightStart::*value;
  double low, high;
  const char* unit;
};
constexpr Range kRanges[] = {
    {"latitude", &FlightStart::latitude_deg, -89.9, 89.9, "deg, north +"},
    {"longitude", &FlightStart::longitude_deg, -180.0, 180.0, "deg, east +"},
    {"altitude_msl", &FlightStart::altitude_msl, -500.0, 30000.0, "m"},
    {"roll_deg", &FlightStart::roll_deg, -180.0, 180.0, "deg, right +"},
    {"pitch_deg", &FlightStart::pitch_deg, -90.0, 90.0, "deg, nose up +"},
    {"heading_true_deg", &FlightStart::heading_true_deg, 0.0, 360.0, "deg"},
    {"true_airspeed", &FlightStart::true_airspeed, 0.0, 600.0, "m/s"},
    {"flight_path_angle_deg", &FlightStart::flight_path_angle_deg, -90.0, 90.0, "deg, climbing +"},
};

EulerAngles attitudeOf(const FlightStart& start) {
  return {start.roll_deg * kRadiansPerDegree, start.pitch_deg * kRadiansPerDegree,
          start.heading_true_deg * kRadiansPerDegree};
}

Eigen::Vector3d velocityOf(const FlightStart& start, const Eigen::Vector3d& wind_ned) {
  const double path = start.flight_path_angle_deg * kRadiansPerDegree;
  const double heading = start.heading_true_deg * kRadiansPerDegree;
  const Eigen::Vector3d through_air(std::cos(path) * std::cos(heading), std::cos(path) * std::sin(heading),
                                    -std::sin(path));
  return start.true_airspeed * through_air + wind_ned;
}

/// R_originned_ned at the place.
Eigen::Matrix3d originFromLevel(const TangentFrame& scenery, const GeoPoint& place) {
  const Eigen::Matrix3d enu = scenery.frameFromLevel(place.latitude_deg, place.longitude_deg);
  Eigen::Matrix3d out;
  for (int column = 0; column < 3; ++column) {
    out.col(column) = nedFromEnu(enu * enuFromNed(Eigen::Vector3d::Unit(column)));
  }
  return out;
}

}  // namespace

std::optional<std::string> check(const FlightStart& start) {
  for (const Range& range : kRanges) {
    if (auto wrong = outside(range.name, start.*range.value, range.low, range.high, range.unit)) return wrong;
  }
  return noPlace(start.latitude_deg, start.longitude_deg);
}

Placement placementOf(const FlightStart& start) {
  Placement out;
  out.start = StartType::kLatLonElevation;
  out.latitude_deg = start.latitude_deg;
  out.longitude_deg = start.longitude_deg;
  out.elevation_m = start.altitude_msl;
  out.true_heading_deg = start.heading_true_deg;
  out.speed_mps = start.true_airspeed;
  return out;
}

VehiclePose poseOf(const FlightStart& start) {
  VehiclePose out;
  out.latitude_deg = start.latitude_deg;
  out.longitude_deg = start.longitude_deg;
  out.elevation_m = start.altitude_msl;
  out.true_heading_deg = static_cast<float>(start.heading_true_deg);
  out.pitch_deg = static_cast<float>(start.pitch_deg);
  out.roll_deg = static_cast<float>(start.roll_deg);
  return out;
}

std::vector<std::string> shownFlightDatarefs(SimulatorVersion version) {
  const std::string at = "sim/flightmodel/position/";
  std::vector<std::string> out{at + "lat_ref", at + "lon_ref", "sim/physics/earth_radius_m"};
  for (const char* axis : {"x", "y", "z"}) out.push_back(at + "local_" + axis);
  for (const char* element : {"0", "1", "2", "3"}) out.push_back(at + "q[" + element + "]");
  for (const char* axis : {"x", "y", "z"}) out.push_back(at + "local_v" + axis);
  for (const std::string& name : shownWindDatarefs(version)) out.push_back(name);
  return out;
}

std::optional<ShownFlight> shownFlightFrom(const std::vector<DatarefValue>& values) {
  if (values.size() != kCount) return std::nullopt;
  std::array<double, kCount> v{};
  for (std::size_t i = 0; i < kCount; ++i) {
    if (!values[i]) return std::nullopt;
    v[i] = static_cast<double>(*values[i]);
  }
  ShownFlight out;
  out.scenery = TangentFrame({v[kOrigin], v[kOrigin + 1], 0.0}, v[kRadius] > 1e6 ? v[kRadius] : kEarthRadius);
  out.place = out.scenery.geoPoint(enuFromOpengl({v[kPosition], v[kPosition + 1], v[kPosition + 2]}));
  const Eigen::Matrix3d to_level = originFromLevel(out.scenery, out.place).transpose();
  const Eigen::Quaterniond q(v[kQuaternion], v[kQuaternion + 1], v[kQuaternion + 2], v[kQuaternion + 3]);
  out.attitude = eulerAngles(to_level * q.normalized().toRotationMatrix());
  out.velocity_ned = to_level * nedFromEnu(enuFromOpengl({v[kVelocityAt], v[kVelocityAt + 1], v[kVelocityAt + 2]}));
  out.wind_ned = windNedFromDirection(v[kWind + 1] * kRadiansPerDegree, v[kWind]);
  return out;
}

bool isNear(const FlightStart& start, const ShownFlight& shown) {
  const GeoPoint wanted{start.latitude_deg, start.longitude_deg, start.altitude_msl};
  return groundDistance(wanted, shown.place) < kNear && std::abs(shown.place.height - start.altitude_msl) < kNear;
}

std::vector<DatarefWrite> motionWrites(const FlightStart& start, const ShownFlight& shown) {
  const GeoPoint place{start.latitude_deg, start.longitude_deg, start.altitude_msl};
  const Eigen::Matrix3d from_level = originFromLevel(shown.scenery, place);
  const Eigen::Quaterniond q(Eigen::Matrix3d(from_level * rotationNedFrd(attitudeOf(start))));
  const Eigen::Vector3d velocity = openglFromEnu(enuFromNed(from_level * velocityOf(start, shown.wind_ned)));
  const std::string at = "sim/flightmodel/position/";
  const auto value = [](double x) { return static_cast<float>(x); };
  return {{at + "q[0]", value(q.w())},
          {at + "q[1]", value(q.x())},
          {at + "q[2]", value(q.y())},
          {at + "q[3]", value(q.z())},
          {at + "local_vx", value(velocity.x())},
          {at + "local_vy", value(velocity.y())},
          {at + "local_vz", value(velocity.z())},
          {at + "Prad", 0.0F},
          {at + "Qrad", 0.0F},
          {at + "Rrad", 0.0F}};
}

std::string placeDifferenceOf(const FlightStart& start, const ShownFlight& shown) {
  std::vector<std::string> out;
  const double reach = kPlace + kFlownOn * velocityOf(start, shown.wind_ned).norm();
  const double away = groundDistance({start.latitude_deg, start.longitude_deg, 0.0}, shown.place);
  if (!(away <= reach)) out.push_back("it is " + number(away) + " m away");
  if (!(std::abs(shown.place.height - start.altitude_msl) <= reach)) {
    out.push_back("its altitude is " + number(shown.place.height) + " m, not " + number(start.altitude_msl));
  }
  return join(out);
}

std::string differenceOf(const FlightStart& start, const ShownFlight& shown) {
  std::vector<std::string> out;
  if (const std::string place = placeDifferenceOf(start, shown); !place.empty()) out.push_back(place);
  // By the angle of the one rotation between both, because roll and heading mean little near +-90 deg of pitch.
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(rotationNedFrd(attitudeOf(start)).transpose() * rotationNedFrd(shown.attitude)));
  if (!(turn.angle() * kDegreesPerRadian <= kAngleDeg)) {
    out.push_back("its attitude is " + number(turn.angle() * kDegreesPerRadian) + " deg off");
  }
  const double off = (velocityOf(start, shown.wind_ned) - shown.velocity_ned).norm();
  if (!(off <= kVelocity + kFlownOn * kStandardGravity)) {
    out.push_back("its velocity is " + number(off) + " m/s off");
  }
  return join(out);
}

}  // namespace xplane_bridge::core
