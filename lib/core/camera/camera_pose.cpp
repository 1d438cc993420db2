#include "xplane_bridge/core/camera/camera_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/base/unknown.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kSmallOffsetDeg = 0.1;   // a visual offset below this does not matter
constexpr double kOrthonormal = 1e-2;     // of world_matrix: farthest from a rotation
constexpr double kOffsetsNearDeg = 10.0;  // a reference farther than this speaks for neither

Eigen::Matrix3d opticalAxesInFrd() {
  Eigen::Matrix3d axes;
  axes << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return axes;
}

Eigen::Matrix3d fluFrdSwap() { return Eigen::Vector3d(1, -1, -1).asDiagonal(); }

Eigen::Vector3d nedFromOpengl(const Eigen::Vector3d& v) { return {-v.z(), v.x(), -v.y()}; }

/// Turns NED into OpenGL axes.
Eigen::Matrix3d openglFromNed() {
  Eigen::Matrix3d m;
  m << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  return m;
}

bool finite(const AnglesDeg& angles) {
  return std::isfinite(angles.roll) && std::isfinite(angles.pitch) && std::isfinite(angles.heading);
}

double orZero(double value) { return std::isfinite(value) ? value : 0.0; }

Eigen::Matrix3d offsetRotation(const CameraSample& sample) {
  const AnglesDeg& offset = sample.visual_offset;
  return rotation({orZero(offset.roll), orZero(offset.pitch), orZero(offset.heading)});
}

/// Half a step of the float32 that carried a value.
double halfStep(double value) {
  const auto carried = static_cast<float>(std::abs(value));
  return 0.5 * static_cast<double>(std::nextafter(carried, std::numeric_limits<float>::infinity()) - carried);
}

double halfSteps(const AnglesDeg& angles) {
  return halfStep(angles.roll) + halfStep(angles.pitch) + halfStep(angles.heading);
}

double halfSteps(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Vector3d sum;
  for (int i = 0; i < 3; ++i) sum[i] = halfStep(a[i]) + halfStep(b[i]);
  return sum.norm();
}

/// Optical axes to base_link from the camera's forward-right-down axes in the aircraft's.
Eigen::Quaterniond fromFrd(const Eigen::Matrix3d& frd_from_camera) {
  return Eigen::Quaterniond(Eigen::Matrix3d(fluFrdSwap() * frd_from_camera * opticalAxesInFrd())).normalized();
}

Eigen::Vector3d leverArm(const Eigen::Vector3d& camera, const CameraSample& aircraft) {
  const Eigen::Vector3d ned = nedFromOpengl(camera) - nedFromOpengl(aircraft.aircraft_position);
  return fluFromFrd(rotation(aircraft.aircraft).transpose() * ned);
}

}  // namespace

CameraSample::CameraSample()
    : view_position(Eigen::Vector3d::Constant(kNaN)),
      aircraft_position(Eigen::Vector3d::Constant(kNaN)),
      head_position(Eigen::Vector3d::Constant(kNaN)),
      eye_position(Eigen::Vector3d::Constant(kNaN)),
      world(Eigen::Matrix4d::Constant(kNaN)) {}

bool CameraSample::complete() const {
  return finite(view) && finite(aircraft) && view_position.allFinite() && aircraft_position.allFinite();
}

Eigen::Matrix3d rotation(const AnglesDeg& angles) {
  return rotationNedFrd(
      {angles.roll * kRadiansPerDegree, angles.pitch * kRadiansPerDegree, angles.heading * kRadiansPerDegree});
}

std::optional<CameraPose> measuredPose(const CameraSample& view, const CameraSample& aircraft,
                                       const PoseReading& reading) {
  if (!view.complete() || !aircraft.complete()) return std::nullopt;
  const AnglesDeg& body = reading.true_axes ? aircraft.aircraft_true : aircraft.aircraft;
  if (!finite(body)) return std::nullopt;
  Eigen::Matrix3d camera = rotation(body).transpose() * rotation(view.view);
  if (!reading.offsets_within) camera *= offsetRotation(view);
  CameraPose pose;
  pose.orientation = fromFrd(camera);
  pose.position = leverArm(view.view_position, aircraft);
  pose.angle_uncertainty_deg = halfSteps(view.view) + halfSteps(body);
  pose.position_uncertainty = halfSteps(view.view_position, aircraft.aircraft_position);
  return pose;
}

std::optional<CameraPose> worldMatrixPose(const CameraSample& sample) {
  if (!sample.world.allFinite() || !finite(sample.aircraft) || !sample.aircraft_position.allFinite()) {
    return std::nullopt;
  }
  const Eigen::Matrix3d given = sample.world.topLeftCorner<3, 3>();
  const bool rotates = (given * given.transpose() - Eigen::Matrix3d::Identity()).norm() < kOrthonormal;
  if (!rotates || given.determinant() < 0.0) return std::nullopt;
  const Eigen::Matrix3d turn = Eigen::Quaterniond(given).normalized().toRotationMatrix();
  // The camera's eye axes are right, up, back.
  const Eigen::Matrix3d ned_from_optical = openglFromNed().transpose() * turn.transpose() * fluFrdSwap();
  CameraPose pose;
  pose.orientation =
      Eigen::Quaterniond(Eigen::Matrix3d(fluFrdSwap() * rotation(sample.aircraft).transpose() * ned_from_optical));
  pose.orientation.normalize();
  const Eigen::Vector3d translation = sample.world.topRightCorner<3, 1>();
  const Eigen::Vector3d camera = -given.transpose() * translation;
  pose.position = leverArm(camera, sample);
  pose.angle_uncertainty_deg = halfSteps(sample.aircraft) + 9.0 * halfStep(1.0) * kDegreesPerRadian;
  // The translation is the camera's position turned: a step of the rotation's elements acts over the whole distance.
  pose.position_uncertainty = halfSteps(camera, sample.aircraft_position) + 3.0 * halfStep(0.5) * translation.norm() +
                              halfStep(translation.norm());
  return pose;
}

std::optional<Eigen::Quaterniond> expectedOrientation(const CameraSample& sample) {
  if (sample.external) return std::nullopt;
  if (sample.isView(ViewType::kCockpit3d)) {
    return finite(sample.head) ? std::optional<Eigen::Quaterniond>(orientationInBase(sample.head)) : std::nullopt;
  }
  if (sample.isView(ViewType::kBack)) return orientationInBase({0.0, 0.0, 180.0});
  if (sample.isView(ViewType::kStraightDown)) return orientationInBase({0.0, -90.0, 0.0});
  const bool ahead =
      sample.isView(ViewType::kPanel2d) || sample.isView(ViewType::kHud) || sample.isView(ViewType::kNothing);
  return ahead ? std::optional<Eigen::Quaterniond>(orientationInBase({0.0, 0.0, 0.0})) : std::nullopt;
}

std::optional<bool> offsetsWithin(const CameraSample& view, const CameraSample& aircraft, PoseReading reading) {
  if (offsetAngleDeg(view) < kSmallOffsetDeg) return false;
  reading.offsets_within = true;
  const auto within = measuredPose(view, aircraft, reading);
  reading.offsets_within = false;
  const auto apart = measuredPose(view, aircraft, reading);
  if (!within || !apart) return std::nullopt;
  // What the view is turned by, offset included.
  std::optional<Eigen::Quaterniond> reference;
  if (const auto matrix = worldMatrixPose(view)) {
    reference = matrix->orientation;
  } else if (const auto expected = expectedOrientation(view)) {
    // The offset turns the camera in its own axes.
    const Eigen::Quaterniond ahead = orientationInBase({0.0, 0.0, 0.0});
    reference = *expected * ahead.conjugate() * fromFrd(offsetRotation(view));
  }
  if (!reference) return std::nullopt;
  const double if_within = angleBetweenDeg(within->orientation, *reference);
  const double if_apart = angleBetweenDeg(apart->orientation, *reference);
  const double nearest = std::min(if_within, if_apart);
  if (nearest > kOffsetsNearDeg || std::abs(if_within - if_apart) < 0.5 * offsetAngleDeg(view)) return std::nullopt;
  return if_within < if_apart;
}

double offsetAngleDeg(const CameraSample& sample) {
  return angleBetweenDeg(Eigen::Quaterniond(offsetRotation(sample)), Eigen::Quaterniond::Identity());
}

double angleBetweenDeg(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.angularDistance(b) * kDegreesPerRadian;
}

Eigen::Quaterniond orientationInBase(const AnglesDeg& angles) { return fromFrd(rotation(angles)); }

AnglesDeg anglesInBase(const Eigen::Quaterniond& orientation) {
  const EulerAngles turn = eulerAngles(fluFrdSwap() * orientation.toRotationMatrix() * opticalAxesInFrd().transpose());
  return {turn.roll * kDegreesPerRadian, turn.pitch * kDegreesPerRadian, turn.heading * kDegreesPerRadian};
}

}  // namespace xplane_bridge::core
