#include "xplane_bridge/core/simulator/disturbance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "setting_texts.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/simulator/wind_fields.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kMostSpeed = 50.0;  // [m/s]
constexpr double kLeast = 1e-3;      // of what must be above 0

/// A field that only some kinds use.
struct Use {
  const char* name;
  double value;
  bool used;
};

std::optional<std::string> unused(const DisturbanceSpec& s) {
  const bool gust = s.kind == DisturbanceKind::kGust;
  const bool shear = s.kind == DisturbanceKind::kShear;
  const bool burst = s.kind == DisturbanceKind::kMicroburst;
  const Use uses[] = {{"vertical_speed", s.vertical_speed, gust},
                      {"length", s.length, gust},
                      {"gradient", s.gradient, shear},
                      {"roughness", s.roughness, shear},
                      {"seed", static_cast<double>(s.seed), s.kind == DisturbanceKind::kTurbulence},
                      {"latitude", s.latitude_deg, burst},
                      {"longitude", s.longitude_deg, burst},
                      {"radius", s.radius, burst},
                      {"height", s.height, burst},
                      {"from_deg", s.from_deg, !burst}};
  for (const Use& use : uses) {
    if (use.used || use.value == 0.0) continue;
    return std::string(use.name) + " is " + number(use.value) + ": expected 0, kind " + toString(s.kind) +
           " does not use it";
  }
  return std::nullopt;
}

std::optional<std::string> wrongGust(const DisturbanceSpec& s) {
  if (auto wrong = outside("vertical_speed", s.vertical_speed, -kMostSpeed, kMostSpeed, "m/s")) return wrong;
  if (auto wrong = outside("length", s.length, 0.0, 20000.0, "m")) return wrong;
  if (s.speed == 0.0 && s.vertical_speed == 0.0) return "speed and vertical_speed are 0: expected the peak of the gust";
  if ((s.length > 0.0) != (s.duration > 0.0)) return std::nullopt;
  return "length is " + number(s.length) + " and duration is " + number(s.duration) +
         ": expected one of both above 0, [m] of air flown through or [s]";
}

std::optional<std::string> wrongShear(const DisturbanceSpec& s) {
  if (auto wrong = outside("gradient", s.gradient, -1.0, 1.0, "1/s")) return wrong;
  if (auto wrong = outside("roughness", s.roughness, 0.0, 2.0, "m")) return wrong;
  if ((s.gradient != 0.0) != (s.roughness > 0.0)) return std::nullopt;
  return "gradient is " + number(s.gradient) + " and roughness is " + number(s.roughness) +
         ": expected one of both, for a linear or a logarithmic profile";
}

std::optional<std::string> wrongMicroburst(const DisturbanceSpec& s) {
  if (auto wrong = outside("latitude", s.latitude_deg, -90.0, 90.0, "deg")) return wrong;
  if (auto wrong = outside("longitude", s.longitude_deg, -180.0, 180.0, "deg")) return wrong;
  if (auto wrong = noPlace(s.latitude_deg, s.longitude_deg)) return wrong;
  if (auto wrong = outside("radius", s.radius, 100.0, 10000.0, "m")) return wrong;
  return outside("height", s.height, 10.0, 1000.0, "m above ground");
}

bool isVertical(const DisturbanceSpec& s) {
  return s.kind == DisturbanceKind::kTurbulence || s.kind == DisturbanceKind::kMicroburst || s.vertical_speed != 0.0;
}

}  // namespace

std::optional<std::string> check(const DisturbanceSpec& s) {
  if (auto wrong = unused(s)) return wrong;
  if (auto wrong = outside("duration", s.duration, 0.0, 36000.0, "s")) return wrong;
  if (auto wrong = outside("from_deg", s.from_deg, 0.0, 360.0, "deg true")) return wrong;
  const bool may_be_calm = s.kind == DisturbanceKind::kGust || s.kind == DisturbanceKind::kShear;
  if (auto wrong = outside("speed", s.speed, may_be_calm ? 0.0 : kLeast, kMostSpeed, "m/s")) return wrong;
  switch (s.kind) {
    case DisturbanceKind::kGust:
      return wrongGust(s);
    case DisturbanceKind::kShear:
      return wrongShear(s);
    case DisturbanceKind::kMicroburst:
      return wrongMicroburst(s);
    case DisturbanceKind::kTurbulence:
      break;
  }
  return std::nullopt;
}

std::optional<std::string> refusalBy(const DisturbanceSpec& spec) {
  if (spec.horizontal_only || !isVertical(spec)) return std::nullopt;
  return std::string("a ") + toString(spec.kind) +
         " with a vertical wind cannot be commanded: X-Plane 11 and 12 show the vertical wind (wind_now_y_msc), but no "
         "dataref sets it; ask for horizontal_only to fly its horizontal part";
}

Disturbance::Disturbance(const DisturbanceSpec& spec)
    : spec_(spec), towards_(windNedFromDirection(spec.from_deg * kRadiansPerDegree, 1.0)), turbulence_(spec.seed) {}

Eigen::Vector3d Disturbance::step(const AirPlace& at) {
  const double distance = std::max(0.0, at.airspeed) * std::max(0.0, at.time - time_);
  time_ = std::max(time_, at.time);
  flown_ += distance;
  const DisturbanceSpec& s = spec_;
  over_ = over_ || (s.duration > 0.0 && time_ >= s.duration) || (s.length > 0.0 && flown_ >= s.length);
  if (over_) return Eigen::Vector3d::Zero();
  const double height = at.place.height;
  switch (s.kind) {
    case DisturbanceKind::kGust: {
      const double shape = s.length > 0.0 ? oneMinusCosine(flown_, s.length) : oneMinusCosine(time_, s.duration);
      return shape * (s.speed * towards_ - s.vertical_speed * Eigen::Vector3d::UnitZ());
    }
    case DisturbanceKind::kTurbulence: {
      const Eigen::Vector3d air = turbulence_.step(distance, drydenScales(height, s.speed));
      const Eigen::Vector3d right(-towards_.y(), towards_.x(), 0.0);
      return air.x() * towards_ + air.y() * right + air.z() * Eigen::Vector3d::UnitZ();
    }
    case DisturbanceKind::kShear:
      return towards_ * (s.roughness > 0.0 ? logarithmicShear(s.speed, s.roughness, height)
                                           : linearShear(s.speed, s.gradient, height));
    case DisturbanceKind::kMicroburst: {
      const TangentFrame centre({s.latitude_deg, s.longitude_deg, 0.0});
      const Eigen::Vector3d enu = centre.position({at.place.latitude_deg, at.place.longitude_deg, 0.0});
      return microburstWind({s.radius, s.speed, s.height}, enu.y(), enu.x(), height);
    }
  }
  return Eigen::Vector3d::Zero();
}

}  // namespace xplane_bridge::core
