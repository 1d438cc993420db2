#include "xplane_bridge/core/control/axis_map.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge::core {
namespace {

std::string rangeText(ChannelRange range) {
  char text[48];
  std::snprintf(text, sizeof text, "%g..%g", range.low, range.high);
  return text;
}

bool inRange(double value, ChannelRange range) { return value >= range.low && value <= range.high; }

/// A button that another one of them is would do both at once.
std::optional<std::string> checkButtons(const std::vector<std::pair<std::string, int>>& buttons) {
  for (std::size_t i = 0; i < buttons.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (buttons[i].second < 0 || buttons[i].second != buttons[k].second) continue;
      return wrongNumber(buttons[i].first, buttons[i].second, "another button than that of " + buttons[k].first);
    }
  }
  return std::nullopt;
}

template <class Input>
std::optional<std::string> checkSteps(const Input& in) {
  return checkButtons(
      {{in.key + ".increase_button", in.increase_button}, {in.key + ".decrease_button", in.decrease_button}});
}

std::optional<std::string> checkIntegrated(const IntegratedInput& in, StickMode mode) {
  const bool has_axis = in.axis.of(mode) >= 0;
  const bool has_buttons = in.increase_button >= 0 || in.decrease_button >= 0;
  if (has_axis == has_buttons) return in.key + ": expected either an axis or increase_button and decrease_button";
  if (auto text = checkSteps(in)) return text;
  if (!std::isfinite(in.rate) || in.rate == 0.0)
    return wrongNumber(in.key + ".rate", in.rate, "a rate other than 0 [1/s]");
  if (!(in.dead_zone >= 0.0 && in.dead_zone < 1.0))
    return wrongNumber(in.key + ".dead_zone", in.dead_zone, "0 to below 1");
  const ChannelRange range = commandRange(in.target);
  if (!inRange(in.low, range)) return wrongNumber(in.key + ".low", in.low, rangeText(range));
  if (!inRange(in.high, range) || in.high <= in.low) {
    return wrongNumber(in.key + ".high", in.high, rangeText(range) + ", above low");
  }
  if (!inRange(in.initial, {in.low, in.high})) {
    return wrongNumber(in.key + ".initial", in.initial, rangeText({in.low, in.high}));
  }
  for (std::size_t i = 0; i < in.detents.size(); ++i) {
    if (!inRange(in.detents[i], {in.low, in.high}) || (i > 0 && in.detents[i] <= in.detents[i - 1])) {
      return wrongNumber(in.key + ".detents", in.detents[i], "rising values within " + rangeText({in.low, in.high}));
    }
  }
  return std::nullopt;
}

std::optional<std::string> checkSurface(const SurfaceInput& in, StickMode mode) {
  constexpr ChannelRange kTravel{-90.0, 90.0};  // [deg]
  const bool has_axis = in.axis.of(mode) >= 0;
  const bool has_buttons = in.increase_button >= 0 || in.decrease_button >= 0;
  if (has_axis == has_buttons) return in.key + ": expected either an axis or increase_button and decrease_button";
  if (auto text = checkSteps(in)) return text;
  if (!std::isfinite(in.rate)) return wrongNumber(in.key + ".rate", in.rate, "a finite number [1/s]");
  if (has_buttons && in.rate == 0.0)
    return wrongNumber(in.key + ".rate", in.rate, "a rate other than 0 [1/s], for buttons");
  if (!std::isfinite(in.scale) || in.scale == 0.0)
    return wrongNumber(in.key + ".scale", in.scale, "a number other than 0");
  if (in.select_button < 0)
    return wrongNumber(in.key + ".select_button", in.select_button, "the button that chooses it");
  if (!(in.dead_zone >= 0.0 && in.dead_zone < 1.0))
    return wrongNumber(in.key + ".dead_zone", in.dead_zone, "0 to below 1");
  if (!inRange(in.low, kTravel)) return wrongNumber(in.key + ".low", in.low, rangeText(kTravel) + " [deg]");
  if (!inRange(in.high, kTravel) || in.high <= in.low) {
    return wrongNumber(in.key + ".high", in.high, rangeText(kTravel) + " [deg], above low");
  }
  if (inRange(in.initial, {in.low, in.high})) return std::nullopt;
  return wrongNumber(in.key + ".initial", in.initial, rangeText({in.low, in.high}) + " [deg]");
}

/// The last of two inputs of a kind with one target would decide alone.
template <class Input>
std::optional<std::string> checkTargets(const std::vector<Input>& inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (inputs[i].target != inputs[k].target) continue;
      return inputs[i].key + ".target is " + toString(inputs[i].target) + ": expected another than that of " +
             inputs[k].key;
    }
  }
  return std::nullopt;
}

}  // namespace

bool sameSource(const IntegratedInput& a, const IntegratedInput& b, StickMode mode) {
  return a.axis.of(mode) == b.axis.of(mode) && a.increase_button == b.increase_button &&
         a.decrease_button == b.decrease_button;
}

std::optional<std::string> validate(const JoystickOptions& o) {
  if (!(o.joy_timeout > 0.0)) return wrongNumber("joy_timeout", o.joy_timeout, "above 0 s");
  if (!(o.debounce >= 0.0)) return wrongNumber("debounce", o.debounce, "0 s or more");
  for (const DirectInput& in : o.direct) {
    if (in.axis.of(o.stick_mode) < 0) return wrongNumber(in.key + ".axis", in.axis.of(o.stick_mode), "an index from 0");
    if (!std::isfinite(in.scale) || in.scale == 0.0)
      return wrongNumber(in.key + ".scale", in.scale, "a number other than 0");
    if (!(in.dead_zone >= 0.0 && in.dead_zone < 1.0))
      return wrongNumber(in.key + ".dead_zone", in.dead_zone, "0 to below 1");
    if (!(in.expo >= 0.0 && in.expo <= 1.0)) return wrongNumber(in.key + ".expo", in.expo, "0..1");
  }
  if (auto text = checkTargets(o.direct)) return text;
  if (auto text = checkTargets(o.integrated)) return text;
  for (std::size_t i = 0; i < o.integrated.size(); ++i) {
    if (auto text = checkIntegrated(o.integrated[i], o.stick_mode)) return text;
    for (std::size_t k = 0; k < o.integrated.size(); ++k) {
      if (k == i || !sameSource(o.integrated[i], o.integrated[k], o.stick_mode)) continue;
      if (o.integrated[i].select_button < 0) {
        return wrongNumber(o.integrated[i].key + ".select_button", o.integrated[i].select_button,
                           "a button, because " + o.integrated[k].key + " has the same axis or buttons");
      }
      if (auto text = checkButtons({{o.integrated[k].key + ".select_button", o.integrated[k].select_button},
                                    {o.integrated[i].key + ".select_button", o.integrated[i].select_button}})) {
        return text;
      }
    }
  }
  for (const ButtonInput& in : o.buttons) {
    if (in.button < 0) return wrongNumber(in.key + ".button", in.button, "an index from 0");
    const ChannelRange range = commandRange(in.target);
    if (!inRange(in.value, range)) return wrongNumber(in.key + ".value", in.value, rangeText(range));
    if (in.released && !inRange(*in.released, range))
      return wrongNumber(in.key + ".released", *in.released, rangeText(range));
  }
  std::vector<std::pair<std::string, int>> chosen_by;
  for (const SurfaceInput& in : o.surfaces) {
    if (auto text = checkSurface(in, o.stick_mode)) return text;
    chosen_by.emplace_back(in.key + ".select_button", in.select_button);
  }
  if (auto text = checkButtons(chosen_by)) return text;
  for (const ActionButton& in : o.actions) {
    if (in.button < 0) return wrongNumber(in.key + ".button", in.button, "an index from 0");
  }
  return checkButtons(
      {{"mode.manual", o.mode.manual}, {"mode.auto", o.mode.automatic}, {"mode.toggle", o.mode.toggle}});
}

}  // namespace xplane_bridge::core
