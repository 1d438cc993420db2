#pragma once

/// Disturbances of the wind that tx_node's `disturb` commands.

#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "xplane_bridge/core/base/message_constants.hpp"
#include "xplane_bridge/core/simulator/dryden_turbulence.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge::core {

/// As SetDisturbance.srv.
struct DisturbanceSpec {
  DisturbanceKind kind = DisturbanceKind::kGust;
  bool horizontal_only = false;  ///< its vertical part is left out of what is commanded
  double duration = 0.0;         ///< [s]
  double from_deg = 0.0;         ///< true, where it comes from
  double speed = 0.0;            ///< [m/s]
  double vertical_speed = 0.0;   ///< [m/s] up +
  double length = 0.0;           ///< [m]
  double gradient = 0.0;         ///< [1/s]
  double roughness = 0.0;        ///< [m]
  std::uint32_t seed = 0;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double radius = 0.0;  ///< [m]
  double height = 0.0;  ///< [m] above ground
};

/// What is wrong with it, in words (field, given value, expected); nullopt: nothing.
std::optional<std::string> check(const DisturbanceSpec& spec);
/// What no version of X-Plane can be sent of it, in words; nullopt: nothing, or it is to be left out.
std::optional<std::string> refusalBy(const DisturbanceSpec& spec);

/// Where and when the air is looked at.
struct AirPlace {
  double time = 0.0;      ///< [s] since the disturbance began
  double airspeed = 0.0;  ///< [m/s] true
  GeoPoint place;         ///< its height is above ground, not above mean sea level
};

/// One that check() has passed, flown through. Immutable but for the way flown and the turbulence drawn on it.
class Disturbance {
 public:
  explicit Disturbance(const DisturbanceSpec& spec);

  const DisturbanceSpec& spec() const { return spec_; }
  /// @return velocity that the model adds to the air there, NED [m/s], the vertical part with it; 0 once it is over()
  Eigen::Vector3d step(const AirPlace& at);
  bool over() const { return over_; }

 private:
  DisturbanceSpec spec_;
  Eigen::Vector3d towards_;  // NED, unit: where it blows to
  DrydenTurbulence turbulence_;
  double time_ = 0.0;   // [s] of the last step
  double flown_ = 0.0;  // [m] through the air
  bool over_ = false;
};

}  // namespace xplane_bridge::core
