#include "xplane_bridge/core/simulator/traffic_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kFastest = 600.0;  // [m/s]

std::optional<std::string> outside(int number, const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return std::nullopt;
  char text[128];
  std::snprintf(text, sizeof text, "aircraft %d: %s is %g: expected %g..%g", number, name, value, low, high);
  return text;
}

std::optional<std::string> wrongWith(const TrafficPose& pose) {
  struct Bound {
    const char* name;
    double value, low, high;
  };
  const double degrees = kDegreesPerRadian, round_off = 1e-6;
  const std::array<Bound, 9> bounds{{{"latitude", pose.place.latitude_deg, -90.0, 90.0},
                                     {"longitude", pose.place.longitude_deg, -180.0, 180.0},
                                     {"altitude_msl", pose.place.height, -1000.0, 30000.0},
                                     {"roll_deg", pose.attitude.roll * degrees, -180.0 - round_off, 180.0 + round_off},
                                     {"pitch_deg", pose.attitude.pitch * degrees, -90.0 - round_off, 90.0 + round_off},
                                     {"heading_true_deg", pose.attitude.heading * degrees, -360.1, 360.1},
                                     {"velocity_north", pose.velocity_ned.x(), -kFastest, kFastest},
                                     {"velocity_east", pose.velocity_ned.y(), -kFastest, kFastest},
                                     {"velocity_down", pose.velocity_ned.z(), -kFastest, kFastest}}};
  for (const Bound& each : bounds) {
    if (auto wrong = outside(pose.number, each.name, each.value, each.low, each.high)) return wrong;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> check(const std::vector<TrafficPose>& poses) {
  std::set<int> seen;
  for (const TrafficPose& pose : poses) {
    if (pose.number < 1 || pose.number > kMaxOtherAircraft) {
      return "number is " + std::to_string(pose.number) + ": expected 1.." + std::to_string(kMaxOtherAircraft) +
             "; 0 is the user's aircraft, which reset_flight places";
    }
    if (!seen.insert(pose.number).second) {
      return "number " + std::to_string(pose.number) + " is given twice: expected each once";
    }
    if (auto wrong = wrongWith(pose)) return wrong;
  }
  return std::nullopt;
}

EulerAngles attitudeOf(double roll_deg, double pitch_deg, double heading_deg) {
  return {roll_deg * kRadiansPerDegree, pitch_deg * kRadiansPerDegree, heading_deg * kRadiansPerDegree};
}

std::string trafficOverride(int number) {
  return "sim/operation/override/override_planepath[" + std::to_string(number) + "]";
}

void TrafficMotion::command(const TrafficPose& pose, double sim_time) {
  if (known_) {
    const TrafficPose shown = at(sim_time);
    off_ned_ = nedFromEnu(TangentFrame(pose.place).position(shown.place));
    off_ = {wrapPi(shown.attitude.roll - pose.attitude.roll), shown.attitude.pitch - pose.attitude.pitch,
            wrapPi(shown.attitude.heading - pose.attitude.heading)};
  }
  if (!known_ || off_ned_.norm() > kJump) {
    off_ned_.setZero();
    off_ = {};
  }
  commanded_ = pose;
  since_ = sim_time;
  known_ = true;
}

TrafficPose TrafficMotion::at(double sim_time) const {
  const double elapsed = std::max(0.0, sim_time - since_);
  const double left = std::max(0.0, 1.0 - elapsed / kCorrection);
  TrafficPose out = commanded_;
  const Eigen::Vector3d way = commanded_.velocity_ned * elapsed + off_ned_ * left;
  out.place = TangentFrame(commanded_.place).geoPoint(enuFromNed(way));
  // Flown level, the height stays; the plane of the tangent leaves the sphere.
  out.place.height = commanded_.place.height - way.z();
  out.attitude.roll = wrapPi(commanded_.attitude.roll + off_.roll * left);
  out.attitude.pitch += off_.pitch * left;
  out.attitude.heading = wrapPi(commanded_.attitude.heading + off_.heading * left);
  return out;
}

const std::vector<std::string>& sceneryDatarefs() {
  static const std::vector<std::string> names{"sim/flightmodel/position/lat_ref", "sim/flightmodel/position/lon_ref"};
  return names;
}

std::vector<DatarefWrite> trafficWrites(const TrafficPose& pose, const TangentFrame& scenery) {
  const double latitude = pose.place.latitude_deg, longitude = pose.place.longitude_deg;
  const Eigen::Matrix3d from_level = scenery.frameFromLevel(latitude, longitude);
  const Eigen::Vector3d place = openglFromEnu(scenery.position(pose.place));
  const Eigen::Vector3d velocity = openglFromEnu(from_level * enuFromNed(pose.velocity_ned));
  Eigen::Matrix3d swap;  // NED and ENU
  swap << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const EulerAngles angles = eulerAngles(swap * from_level * swap * rotationNedFrd(pose.attitude));
  const std::string plane = std::string("sim/multiplayer/position/") + "plane" + std::to_string(pose.number) + "_";
  const auto write = [&plane](const char* leaf, double value) {
    return DatarefWrite{plane + leaf, static_cast<float>(value)};
  };
  return {write("x", place.x()),
          write("y", place.y()),
          write("z", place.z()),
          write("the", angles.pitch * kDegreesPerRadian),
          write("phi", angles.roll * kDegreesPerRadian),
          write("psi", wrap360(angles.heading * kDegreesPerRadian)),
          write("v_x", velocity.x()),
          write("v_y", velocity.y()),
          write("v_z", velocity.z())};
}

VehiclePose vehicleOf(const TrafficPose& pose) {
  VehiclePose out;
  out.aircraft = pose.number;
  out.latitude_deg = pose.place.latitude_deg;
  out.longitude_deg = pose.place.longitude_deg;
  out.elevation_m = pose.place.height;
  out.true_heading_deg = static_cast<float>(wrap360(pose.attitude.heading * kDegreesPerRadian));
  out.pitch_deg = static_cast<float>(pose.attitude.pitch * kDegreesPerRadian);
  out.roll_deg = static_cast<float>(pose.attitude.roll * kDegreesPerRadian);
  return out;
}

}  // namespace xplane_bridge::core
