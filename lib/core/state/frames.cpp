#include "xplane_bridge/core/state/frames.hpp"

#include <cmath>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/base/unknown.hpp"

namespace xplane_bridge::core {
namespace {

/// Turns NED into ENU and ENU into NED.
Eigen::Matrix3d nedEnuSwap() {
  Eigen::Matrix3d m;
  m << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return m;
}

Eigen::Quaterniond positiveW(Eigen::Quaterniond q) {
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

double wrap(double angle, double lower, double turn) {
  double wrapped = std::fmod(angle - lower, turn);
  if (wrapped < 0.0) wrapped += turn;
  if (wrapped >= turn) wrapped = 0.0;  // a tiny negative remainder plus a turn rounds to the turn itself
  return wrapped + lower;
}

Eigen::Vector3d earthPosition(const GeoPoint& place, double earth_radius) {
  const double latitude = place.latitude_deg * kRadiansPerDegree;
  const double longitude = place.longitude_deg * kRadiansPerDegree;
  const double r = earth_radius + place.height;
  return {r * std::cos(latitude) * std::cos(longitude), r * std::cos(latitude) * std::sin(longitude),
          r * std::sin(latitude)};
}

}  // namespace

double wrapPi(double angle) { return wrap(angle, -kPi, 2.0 * kPi); }
double wrap180(double angle_deg) { return wrap(angle_deg, -180.0, 360.0); }
double wrap360(double angle_deg) { return wrap(angle_deg, 0.0, 360.0); }

Eigen::Matrix3d rotationNedFrd(const EulerAngles& attitude) {
  const double cr = std::cos(attitude.roll), sr = std::sin(attitude.roll);
  const double cp = std::cos(attitude.pitch), sp = std::sin(attitude.pitch);
  const double ch = std::cos(attitude.heading), sh = std::sin(attitude.heading);
  Eigen::Matrix3d R;
  R << ch * cp, ch * sp * sr - sh * cr, ch * sp * cr + sh * sr,  //
      sh * cp, sh * sp * sr + ch * cr, sh * sp * cr - ch * sr,   //
      -sp, cp * sr, cp * cr;
  return R;
}

Eigen::Quaterniond quaternionNedFrd(const EulerAngles& attitude) {
  const double cr = std::cos(attitude.roll / 2), sr = std::sin(attitude.roll / 2);
  const double cp = std::cos(attitude.pitch / 2), sp = std::sin(attitude.pitch / 2);
  const double ch = std::cos(attitude.heading / 2), sh = std::sin(attitude.heading / 2);
  return positiveW({ch * cp * cr + sh * sp * sr, ch * cp * sr - sh * sp * cr, ch * sp * cr + sh * cp * sr,
                    sh * cp * cr - ch * sp * sr});
}

Eigen::Quaterniond quaternionEnuFlu(const Eigen::Quaterniond& q_ned_frd) {
  // q_enu_ned is half a turn about (1, 1, 0)/sqrt2, q_frd_flu half a turn about x.
  const double h = std::sqrt(0.5);
  static const Eigen::Quaterniond q_enu_ned(0.0, h, h, 0.0);
  static const Eigen::Quaterniond q_frd_flu(0.0, 1.0, 0.0, 0.0);
  return positiveW(q_enu_ned * q_ned_frd * q_frd_flu);
}

EulerAngles eulerAngles(const Eigen::Matrix3d& R_ned_frd) {
  const double cos_pitch = std::hypot(R_ned_frd(0, 0), R_ned_frd(1, 0));
  const double pitch = std::atan2(-R_ned_frd(2, 0), cos_pitch);
  constexpr double kGimbalLock = 1e-9;
  if (cos_pitch < kGimbalLock) return {0.0, pitch, wrapPi(std::atan2(-R_ned_frd(0, 1), R_ned_frd(1, 1)))};
  return {wrapPi(std::atan2(R_ned_frd(2, 1), R_ned_frd(2, 2))), pitch,
          wrapPi(std::atan2(R_ned_frd(1, 0), R_ned_frd(0, 0)))};
}

Eigen::Vector3d eulerRates(const EulerAngles& attitude, const Eigen::Vector3d& rates_frd) {
  const double cr = std::cos(attitude.roll), sr = std::sin(attitude.roll);
  const double cp = std::cos(attitude.pitch);
  const double turn = rates_frd.y() * sr + rates_frd.z() * cr;
  const double pitch_rate = rates_frd.y() * cr - rates_frd.z() * sr;
  constexpr double kMinCosPitch = 0.1 * kRadiansPerDegree;
  if (std::abs(cp) < kMinCosPitch) return {kNaN, pitch_rate, kNaN};
  return {rates_frd.x() + turn * std::sin(attitude.pitch) / cp, pitch_rate, turn / cp};
}

Eigen::Vector3d airRelativeVelocity(const Eigen::Matrix3d& R_ned_frd, const Eigen::Vector3d& velocity_ned,
                                    const Eigen::Vector3d& wind_ned) {
  return R_ned_frd.transpose() * (velocity_ned - wind_ned);
}

AirAngles airAngles(const Eigen::Vector3d& v) {
  const double speed = v.norm();
  if (!(speed >= kMinAirspeedForAngles)) return {speed, 0.0, 0.0};
  return {speed, std::atan2(v.z(), v.x()), std::atan2(v.y(), std::hypot(v.x(), v.z()))};
}

Eigen::Vector3d windNedFromDirection(double from_direction, double speed) {
  return {-speed * std::cos(from_direction), -speed * std::sin(from_direction), 0.0};
}

double windFromDirectionDeg(const Eigen::Vector3d& wind_ned) {
  constexpr double kCalm = 1e-3;
  if (!(std::hypot(wind_ned.x(), wind_ned.y()) >= kCalm)) return 0.0;
  return wrap360(std::atan2(-wind_ned.y(), -wind_ned.x()) * kDegreesPerRadian);
}

Eigen::Vector3d specificForce(double axial, double side, double normal) {
  return kStandardGravity * Eigen::Vector3d(axial, side, -normal);
}

Eigen::Matrix3d levelAxes(double latitude_deg, double longitude_deg) {
  const double latitude = latitude_deg * kRadiansPerDegree, longitude = longitude_deg * kRadiansPerDegree;
  const double clat = std::cos(latitude), slat = std::sin(latitude);
  const double clon = std::cos(longitude), slon = std::sin(longitude);
  Eigen::Matrix3d axes;
  axes << -slon, -slat * clon, clat * clon,  //
      clon, -slat * slon, clat * slon,       //
      0.0, clat, slat;
  return axes;
}

double groundDistance(const GeoPoint& a, const GeoPoint& b, double earth_radius) {
  const Eigen::Vector3d up_a = levelAxes(a.latitude_deg, a.longitude_deg).col(2);
  const Eigen::Vector3d up_b = levelAxes(b.latitude_deg, b.longitude_deg).col(2);
  return earth_radius * std::atan2(up_a.cross(up_b).norm(), up_a.dot(up_b));
}

TangentFrame::TangentFrame(const GeoPoint& origin, double earth_radius)
    : origin_(origin),
      earth_radius_(earth_radius),
      axes_(levelAxes(origin.latitude_deg, origin.longitude_deg)),
      origin_earth_(earthPosition(origin, earth_radius)) {}

Eigen::Vector3d TangentFrame::position(const GeoPoint& place) const {
  return axes_.transpose() * (earthPosition(place, earth_radius_) - origin_earth_);
}

GeoPoint TangentFrame::geoPoint(const Eigen::Vector3d& position) const {
  const Eigen::Vector3d p = origin_earth_ + axes_ * position;
  const double equatorial = std::hypot(p.x(), p.y());
  return {std::atan2(p.z(), equatorial) * kDegreesPerRadian, std::atan2(p.y(), p.x()) * kDegreesPerRadian,
          std::hypot(equatorial, p.z()) - earth_radius_};
}

Eigen::Matrix3d TangentFrame::levelFromFrame(double latitude_deg, double longitude_deg) const {
  return levelAxes(latitude_deg, longitude_deg).transpose() * axes_;
}

Eigen::Matrix3d TangentFrame::frameFromLevel(double latitude_deg, double longitude_deg) const {
  return levelFromFrame(latitude_deg, longitude_deg).transpose();
}

Eigen::Quaterniond TangentFrame::orientation(const Eigen::Quaterniond& q_enu_flu, double latitude_deg,
                                             double longitude_deg) const {
  return positiveW(Eigen::Quaterniond(frameFromLevel(latitude_deg, longitude_deg)) * q_enu_flu);
}

Eigen::Matrix3d levelAttitude(const TangentFrame& scenery, const Eigen::Matrix3d& R_originned_frd, double latitude_deg,
                              double longitude_deg) {
  static const Eigen::Matrix3d swap = nedEnuSwap();
  return swap * scenery.levelFromFrame(latitude_deg, longitude_deg) * swap * R_originned_frd;
}

}  // namespace xplane_bridge::core
