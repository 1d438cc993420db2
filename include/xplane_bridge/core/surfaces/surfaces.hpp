#pragma once

/// Every control surface X-Plane can show and take one by one: names, datarefs, and commands to single surfaces.
///
/// Deflections in degrees with X-Plane's sign: trailing edge down +, rudder trailing edge right +, spoilers and speed
/// brakes trailing edge up +, yaw brakes open +. docs/control/surfaces.md.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_command.hpp"

namespace xplane_bridge::core {

enum class SurfaceKind : std::uint8_t {
  kAileron,
  kSpoiler,
  kFlap,
  kSpeedbrake,
  kYawBrake,
  kElevator,
  kRudder,
};

struct SurfaceInfo {
  std::string name;     ///< e.g. aileron1_wing2_left, elevator1_right, rudder1_fin1
  std::string dataref;  ///< read and, under kSurfaceOverride, written; deg
  SurfaceKind kind;
  int set;    ///< 1 or 2: aileron1, aileron2
  int place;  ///< wings: 0 wing1 left, 1 wing1 right, 2 wing2 left ..; elevators of the tail: 0 left, 1 right; rudders:
              ///< fin - 1
};

/// All surfaces, in a fixed order. Their positions are the surface numbers used elsewhere.
const std::vector<SurfaceInfo>& surfaceTable();

/// Number of a surface by name.
std::optional<std::size_t> surfaceNumber(const std::string& name);

/// Sign of a deflection with the trailing edge up (rudder: left; yaw brake: open).
double upSign(std::size_t surface);

constexpr double kMaxDeflectionDeg = 90.0;

struct SurfaceDeflection {
  std::size_t surface = 0;
  double deflection_deg = 0.0;
};

/// SurfaceCommand.msg's two lists as deflections, or why the whole command is refused.
struct SurfaceCommandResult {
  std::optional<CommandRefusal> refusal;
  std::vector<SurfaceDeflection> surfaces;
};
SurfaceCommandResult checkSurfaceCommand(const std::vector<std::string>& names,
                                         const std::vector<float>& deflections_deg);

}  // namespace xplane_bridge::core
