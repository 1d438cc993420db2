#include <algorithm>

#include "xplane_bridge/core/surfaces/surfaces.hpp"
#include "xplane_bridge/nodes/joystick/joystick_mapper_node.hpp"

namespace xplane_bridge {
namespace {

constexpr Range<int> kIndex{0, 255};
constexpr Range<int> kIndexOrNone{-1, 255};
constexpr Range<double> kAnyNumber{};

core::JoyTarget targetOf(const ParamLoader& in, const std::string& name) {
  const std::string text = in.text("target", name);
  const auto target = core::joyTargetFrom(text);
  if (!target) {
    if (text == "slats") {
      throw ParamError("parameter " + in.fullKey("target") +
                       ": X-Plane has no handle for slats, they follow that of the flaps; target flaps instead");
    }
    std::string known;
    for (const core::JoyTargetRow& row : core::kJoyTargets)
      known += (known.empty() ? "" : ", ") + std::string(row.name);
    throw ParamError("parameter " + in.fullKey("target") + ": \"" + text +
                     "\" (by default the section's name) is no target; allowed: " + known);
  }
  return *target;
}

// `axis` for both stick modes, or `axis_mode_1` and `axis_mode_2`.
core::AxisIndex axisOf(const ParamLoader& in) {
  if (in.has("axis")) {
    const int axis = in.integer("axis", kIndex);
    return {axis, axis};
  }
  if (!in.has("axis_mode_1") && !in.has("axis_mode_2")) return {};
  return {in.integer("axis_mode_1", kIndex), in.integer("axis_mode_2", kIndex)};
}

core::AxisTravel travelOf(const ParamLoader& in) {
  const std::string text = in.choice("travel", {"symmetric", "full", "positive"}, "symmetric");
  if (text == "full") return core::AxisTravel::kFull;
  return text == "positive" ? core::AxisTravel::kPositive : core::AxisTravel::kSymmetric;
}

core::DirectInput directOf(const std::string& name, const ParamLoader& in) {
  core::DirectInput out;
  out.key = "direct." + name;
  out.target = targetOf(in, name);
  out.axis = axisOf(in);
  out.scale = in.number("scale", kAnyNumber, 1.0);
  out.dead_zone = in.number("dead_zone", {0.0, 0.95}, 0.0);
  out.expo = in.number("expo", {0.0, 1.0}, 0.0);
  out.travel = travelOf(in);
  out.silent_until_moved = in.boolean("silent_until_moved", false);
  return out;
}

core::IntegratedInput integratedOf(const std::string& name, const ParamLoader& in) {
  core::IntegratedInput out;
  out.key = "integrated." + name;
  out.target = targetOf(in, name);
  const core::ChannelRange range = core::commandRange(out.target);
  out.axis = axisOf(in);
  out.increase_button = in.integer("increase_button", kIndexOrNone, -1);
  out.decrease_button = in.integer("decrease_button", kIndexOrNone, -1);
  out.rate = in.number("rate", kAnyNumber);
  out.dead_zone = in.number("dead_zone", {0.0, 0.95}, 0.1);
  out.low = in.number("low", {range.low, range.high}, range.low);
  out.high = in.number("high", {range.low, range.high}, range.high);
  out.initial = in.number("initial", {out.low, out.high}, std::max(out.low, 0.0));
  out.detents = in.numbers("detents", {out.low, out.high});
  out.select_button = in.integer("select_button", kIndexOrNone, -1);
  return out;
}

core::ButtonInput buttonOf(const std::string& name, const ParamLoader& in) {
  core::ButtonInput out;
  out.key = "buttons." + name;
  out.target = targetOf(in, name);
  const core::ChannelRange range = core::commandRange(out.target);
  out.button = in.integer("button", kIndex);
  out.value = in.number("value", {range.low, range.high});
  if (in.has("released")) out.released = in.number("released", {range.low, range.high});
  return out;
}

core::SurfaceInput surfaceOf(const std::string& name, const ParamLoader& in) {
  constexpr Range<double> kTravel{-core::kMaxDeflectionDeg, core::kMaxDeflectionDeg};
  core::SurfaceInput out;
  out.key = "surfaces." + name;
  out.name = name;
  if (!core::surfaceNumber(name)) {
    throw ParamError("parameter " + in.fullKey("") + ": there is no surface \"" + name +
                     "\"; expected one as aileron1_wing2_left, see docs/control/surfaces.md");
  }
  out.axis = axisOf(in);
  out.increase_button = in.integer("increase_button", kIndexOrNone, -1);
  out.decrease_button = in.integer("decrease_button", kIndexOrNone, -1);
  out.select_button = in.integer("select_button", kIndex);
  out.rate = in.number("rate", kAnyNumber, 0.0);
  out.scale = in.number("scale", kAnyNumber, 1.0);
  out.dead_zone = in.number("dead_zone", {0.0, 0.95}, 0.1);
  out.low = in.number("low", kTravel);
  out.high = in.number("high", kTravel);
  out.initial = in.number("initial", {out.low, out.high}, std::clamp(0.0, out.low, out.high));
  return out;
}

}  // namespace

core::JoystickOptions loadJoystickOptions(const ParamLoader& own) {
  core::JoystickOptions out;
  out.device = own.text("device");
  out.stick_mode = own.integer("stick_mode", {1, 2}, 2) == 1 ? core::StickMode::kMode1 : core::StickMode::kMode2;
  out.joy_timeout = own.number("joy_timeout", {0.05, 10.0}, 0.5);
  out.debounce = own.number("debounce", {0.0, 1.0}, 0.05);
  for (const auto& [name, in] : own.section("direct").namedSections()) out.direct.push_back(directOf(name, in));
  for (const auto& [name, in] : own.section("integrated").namedSections()) {
    out.integrated.push_back(integratedOf(name, in));
  }
  for (const auto& [name, in] : own.section("buttons").namedSections()) out.buttons.push_back(buttonOf(name, in));
  for (const auto& [name, in] : own.section("surfaces").namedSections()) out.surfaces.push_back(surfaceOf(name, in));
  for (const JoyFunction& function : loadJoyFunctions(own)) out.actions.push_back({function.key, function.button});
  const ParamLoader mode = own.section("mode");
  out.mode.manual = mode.integer("manual", kIndexOrNone, -1);
  out.mode.automatic = mode.integer("auto", kIndexOrNone, -1);
  out.mode.toggle = mode.integer("toggle", kIndexOrNone, -1);
  if (const auto wrong = core::validate(out)) throw ParamError("parameter " + own.fullKey(*wrong));
  return out;
}

}  // namespace xplane_bridge
