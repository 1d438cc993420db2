#include "xplane_bridge/core/surfaces/surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace xplane_bridge::core {
namespace {

constexpr const char* kControls = "sim/flightmodel/controls/";
constexpr int kWingParts = 8;

std::string wingPlace(int part) {
  return "_wing" + std::to_string(part / 2 + 1) + (part % 2 == 0 ? "_left" : "_right");
}

void addWingSurfaces(std::vector<SurfaceInfo>& out, const char* name, SurfaceKind kind, int set, const char* suffix) {
  for (int part = 0; part < kWingParts; ++part) {
    const std::string dataref =
        std::string(kControls) + "wing" + std::to_string(part / 2 + 1) + (part % 2 == 0 ? "l_" : "r_") + suffix + "def";
    out.push_back({name + wingPlace(part), dataref, kind, set, part});
  }
}

std::vector<SurfaceInfo> makeTable() {
  std::vector<SurfaceInfo> out;
  addWingSurfaces(out, "aileron1", SurfaceKind::kAileron, 1, "ail1");
  addWingSurfaces(out, "aileron2", SurfaceKind::kAileron, 2, "ail2");
  addWingSurfaces(out, "spoiler1", SurfaceKind::kSpoiler, 1, "spo1");
  addWingSurfaces(out, "spoiler2", SurfaceKind::kSpoiler, 2, "spo2");
  addWingSurfaces(out, "flap1", SurfaceKind::kFlap, 1, "fla1");
  addWingSurfaces(out, "flap2", SurfaceKind::kFlap, 2, "fla2");
  for (int set = 1; set <= 2; ++set) {
    // No wing1l_... dataref exists for speed brakes; the array of wing parts does.
    for (int part = 0; part < kWingParts; ++part) {
      const std::string name = "speedbrake" + std::to_string(set);
      out.push_back({name + wingPlace(part), "sim/flightmodel2/wing/" + name + "_deg[" + std::to_string(part) + "]",
                     SurfaceKind::kSpeedbrake, set, part});
    }
  }
  addWingSurfaces(out, "yaw_brake", SurfaceKind::kYawBrake, 1, "yawb");
  for (int set = 1; set <= 2; ++set) {
    for (int side = 0; side < 2; ++side) {
      out.push_back({"elevator" + std::to_string(set) + (side == 0 ? "_left" : "_right"),
                     std::string(kControls) + "hstab" + std::to_string(side + 1) + "_elv" + std::to_string(set) + "def",
                     SurfaceKind::kElevator, set, side});
    }
  }
  for (int set = 1; set <= 2; ++set) {
    for (int fin = 0; fin < 2; ++fin) {
      out.push_back({"rudder" + std::to_string(set) + "_fin" + std::to_string(fin + 1),
                     std::string(kControls) + "vstab" + std::to_string(fin + 1) + "_rud" + std::to_string(set) + "def",
                     SurfaceKind::kRudder, set, fin});
    }
  }
  addWingSurfaces(out, "elevator1", SurfaceKind::kElevator, 1, "elv1");  // elevons, canards
  addWingSurfaces(out, "elevator2", SurfaceKind::kElevator, 2, "elv2");
  return out;
}

CommandRefusal refuse(Refusal reason, const std::string& text) { return {reason, text}; }

}  // namespace

const std::vector<SurfaceInfo>& surfaceTable() {
  static const std::vector<SurfaceInfo> table = makeTable();
  return table;
}

std::optional<std::size_t> surfaceNumber(const std::string& name) {
  const auto& table = surfaceTable();
  const auto it = std::find_if(table.begin(), table.end(), [&](const SurfaceInfo& s) { return s.name == name; });
  if (it == table.end()) return std::nullopt;
  return static_cast<std::size_t>(it - table.begin());
}

double upSign(std::size_t surface) {
  const SurfaceKind kind = surfaceTable()[surface].kind;
  const bool opens =
      kind == SurfaceKind::kSpoiler || kind == SurfaceKind::kSpeedbrake || kind == SurfaceKind::kYawBrake;
  return opens ? 1.0 : -1.0;
}

SurfaceCommandResult checkSurfaceCommand(const std::vector<std::string>& names,
                                         const std::vector<float>& deflections_deg) {
  SurfaceCommandResult out;
  if (names.size() != deflections_deg.size()) {
    out.refusal =
        refuse(Refusal::kLengthMismatch, "names has " + std::to_string(names.size()) + " entries and deflections_deg " +
                                             std::to_string(deflections_deg.size()) + ": expected as many");
    return out;
  }
  std::vector<SurfaceDeflection> surfaces;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto number = surfaceNumber(names[i]);
    if (!number) {
      out.refusal = refuse(Refusal::kUnknownSurface,
                           "\"" + names[i] + "\" is no surface: expected a name of docs/control/surfaces.md");
      return out;
    }
    if (std::any_of(surfaces.begin(), surfaces.end(), [&](const auto& s) { return s.surface == *number; })) {
      out.refusal = refuse(Refusal::kDuplicateSurface, names[i] + " is named twice: expected once");
      return out;
    }
    const auto deflection = static_cast<double>(deflections_deg[i]);
    char text[160];
    if (!std::isfinite(deflection)) {
      std::snprintf(text, sizeof text, "%s is %g deg: expected a finite number", names[i].c_str(), deflection);
      out.refusal = refuse(Refusal::kNotFinite, text);
      return out;
    }
    if (std::abs(deflection) > kMaxDeflectionDeg) {
      std::snprintf(text, sizeof text, "%s is %g deg: expected -90..90", names[i].c_str(), deflection);
      out.refusal = refuse(Refusal::kOutOfRange, text);
      return out;
    }
    surfaces.push_back({*number, deflection});
  }
  out.surfaces = std::move(surfaces);
  return out;
}

}  // namespace xplane_bridge::core
