#include "xplane_bridge/core/control/axis_map.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace xplane_bridge::core {
namespace {

// Drivers divide by 32767 or 32768, so full travel may come out a little above 1.
constexpr double kAxisTolerance = 1e-3;
// A command that differs by so little for so long [s] is a change to tx_node, which sends the handle again.
constexpr double kNudge = 1e-6;
constexpr double kNudgeTime = 0.1;

const JoyTargetRow& rowOf(JoyTarget target) {
  return *std::find_if(std::begin(kJoyTargets), std::end(kJoyTargets),
                       [&](const JoyTargetRow& r) { return r.target == target; });
}

void command(JoyTarget target, double value, ControlCommand& out) {
  const JoyTargetRow& row = rowOf(target);
  const ChannelRange range = commandRange(row.range);
  const double saturated = std::clamp(value, range.low, range.high);
  out.fields |= row.field;
  if (target == JoyTarget::kBrakes) {
    out.left_brake = out.right_brake = saturated;
  } else {
    out.*row.value = saturated;
  }
}

double commanded(JoyTarget target, const ControlCommand& in) {
  return target == JoyTarget::kBrakes ? in.left_brake : in.*rowOf(target).value;
}

TravelIntegrator integratorOf(const IntegratedInput& in) { return {in.low, in.high, in.initial, in.detents}; }

}  // namespace

std::optional<JoyTarget> joyTargetFrom(const std::string& name) {
  for (const auto& row : kJoyTargets) {
    if (name == row.name) return row.target;
  }
  return std::nullopt;
}

const char* toString(JoyTarget target) { return rowOf(target).name; }

ChannelRange commandRange(JoyTarget target) { return commandRange(rowOf(target).range); }

double shapeAxis(double j, double dead_zone, double expo) {
  const double saturated = std::clamp(j, -1.0, 1.0);
  const double beyond = std::max(0.0, std::abs(saturated) - dead_zone) / (1.0 - dead_zone);
  return std::copysign((1.0 - expo) * beyond + expo * beyond * beyond * beyond, saturated);
}

TravelIntegrator::TravelIntegrator(double low, double high, double initial, std::vector<double> detents)
    : low_(low), high_(high), fraction_((initial - low) / (high - low)), detents_(std::move(detents)) {}

void TravelIntegrator::integrate(double rate, double j, double dt) {
  fraction_ = std::clamp(fraction_ + rate * j * dt, 0.0, 1.0);
}

double TravelIntegrator::valueAt(double fraction) const {
  const double value = std::clamp(low_ + fraction * (high_ - low_), low_, high_);
  if (detents_.empty()) return value;
  return *std::min_element(detents_.begin(), detents_.end(),
                           [value](double a, double b) { return std::abs(a - value) < std::abs(b - value); });
}

JoystickMapper::JoystickMapper(const JoystickOptions& options) : options_(options) {
  if (const auto text = validate(options)) throw std::invalid_argument(*text);
  for (std::size_t i = 0; i < options_.integrated.size(); ++i) {
    const IntegratedInput& in = options_.integrated[i];
    std::size_t group = selected_of_group_.size();
    for (std::size_t k = 0; k < i; ++k) {
      if (sameSource(in, options_.integrated[k], options_.stick_mode)) group = integrated_[k].group;
    }
    if (group == selected_of_group_.size()) selected_of_group_.push_back(i);
    integrated_.push_back({integratorOf(in), group});
  }
}

void JoystickMapper::checkAxis(int axis, const std::string& key, const std::vector<float>& axes) {
  if (axis < 0) return;
  const auto report = [&](JoyProblem::Kind kind, const std::string& what) {
    problems_.push_back(
        {kind, axis, key, options_.device + ": axis " + std::to_string(axis) + " (" + key + ") " + what});
  };
  if (static_cast<std::size_t>(axis) >= axes.size()) {
    report(JoyProblem::Kind::kAxisMissing,
           "does not exist: the device has " + std::to_string(axes.size()) + " axes; it is not commanded");
    return;
  }
  const auto value = static_cast<double>(axes[static_cast<std::size_t>(axis)]);
  if (!std::isfinite(value)) {
    report(JoyProblem::Kind::kNotFinite, "is not a finite number; the message is dropped");
  } else if (std::abs(value) > 1.0 + kAxisTolerance) {
    report(JoyProblem::Kind::kOutOfRange, "is " + std::to_string(value) + ", outside -1..1; the message is dropped");
  }
}

void JoystickMapper::checkButton(int button, const std::string& key, std::size_t count) {
  if (button < 0 || static_cast<std::size_t>(button) < count) return;
  problems_.push_back({JoyProblem::Kind::kButtonMissing, button, key,
                       options_.device + ": button " + std::to_string(button) + " (" + key +
                           ") does not exist: the device has " + std::to_string(count) +
                           " buttons; it counts as never pressed"});
}

bool JoystickMapper::check(const std::vector<float>& axes, std::size_t button_count) {
  problems_.clear();
  for (const auto& in : options_.direct) checkAxis(in.axis.of(options_.stick_mode), in.key + ".axis", axes);
  for (const auto& in : options_.integrated) {
    checkAxis(in.axis.of(options_.stick_mode), in.key + ".axis", axes);
    checkButton(in.increase_button, in.key + ".increase_button", button_count);
    checkButton(in.decrease_button, in.key + ".decrease_button", button_count);
    checkButton(in.select_button, in.key + ".select_button", button_count);
  }
  for (const auto& in : options_.surfaces) {
    checkAxis(in.axis.of(options_.stick_mode), in.key + ".axis", axes);
    checkButton(in.increase_button, in.key + ".increase_button", button_count);
    checkButton(in.decrease_button, in.key + ".decrease_button", button_count);
    checkButton(in.select_button, in.key + ".select_button", button_count);
  }
  for (const auto& in : options_.buttons) checkButton(in.button, in.key + ".button", button_count);
  for (const auto& in : options_.actions) checkButton(in.button, in.key + ".button", button_count);
  checkButton(options_.mode.manual, "mode.manual", button_count);
  checkButton(options_.mode.automatic, "mode.auto", button_count);
  checkButton(options_.mode.toggle, "mode.toggle", button_count);
  return std::none_of(problems_.begin(), problems_.end(), [](const JoyProblem& p) {
    return p.kind == JoyProblem::Kind::kNotFinite || p.kind == JoyProblem::Kind::kOutOfRange;
  });
}

std::optional<double> JoystickMapper::axis(int index) const {
  if (index < 0 || static_cast<std::size_t>(index) >= axes_.size()) return std::nullopt;
  return axes_[static_cast<std::size_t>(index)];
}

bool JoystickMapper::lacksAxis(AxisIndex wanted) const {
  const int index = wanted.of(options_.stick_mode);
  return index >= 0 && !axis(index);
}

bool JoystickMapper::held(int button) const {
  return button >= 0 && static_cast<std::size_t>(button) < buttons_.size() &&
         buttons_[static_cast<std::size_t>(button)].raw;
}

bool JoystickMapper::pressed(int button) const {
  return button >= 0 && static_cast<std::size_t>(button) < buttons_.size() &&
         buttons_[static_cast<std::size_t>(button)].pressed;
}

template <class Input>
double JoystickMapper::source(const Input& input) const {
  const int index = input.axis.of(options_.stick_mode);
  if (index >= 0) return shapeAxis(axis(index).value_or(0.0), input.dead_zone, 0.0);
  return (held(input.increase_button) ? 1.0 : 0.0) - (held(input.decrease_button) ? 1.0 : 0.0);
}

void JoystickMapper::integrateUpTo(double now) {
  const double dt = now - integrated_until_;
  if (dt > 0.0) {
    for (const std::size_t i : selected_of_group_) {
      const double j = source(options_.integrated[i]);
      integrated_[i].state.integrate(options_.integrated[i].rate, j, dt);
      if (j != 0.0) integrated_[i].moved = true;
    }
    moveSurface(dt);
  }
  integrated_until_ = std::max(integrated_until_, now);
}

void JoystickMapper::moveSurface(double dt) {
  if (!chosen_surface_) return;
  const SurfaceInput& in = options_.surfaces[*chosen_surface_];
  if (lacksAxis(in.axis)) return;
  Surface& surface = surfaces_[*chosen_surface_];
  if (in.rate != 0.0) {
    surface.state.integrate(in.rate, source(in), dt);
    surface.deflection_deg = surface.state.value();
    return;
  }
  const double j = std::clamp(in.scale * source(in), -1.0, 1.0);
  if (in.low < 0.0 && in.high > 0.0) {
    surface.deflection_deg = j < 0.0 ? -j * in.low : j * in.high;  // faired where the axis rests
  } else {
    surface.deflection_deg = in.low + 0.5 * (1.0 + j) * (in.high - in.low);
  }
}

void JoystickMapper::chooseSurface(int button) {
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    if (options_.surfaces[i].select_button != button) continue;
    if (chosen_surface_ != i && lacksAxis(options_.surfaces[i].axis)) return;
    surfaces_[i].commanded = chosen_surface_ != i;
    chosen_surface_ = surfaces_[i].commanded ? std::optional(i) : std::nullopt;
    return;
  }
}

/// A press on what is commanded already: the cockpit may have moved it since.
void JoystickMapper::askAgain(JoyTarget target, double value, double now) {
  if ((last_.fields & rowOf(target).field) == 0u || commanded(target, last_) != value) return;
  nudged_until_[target] = now + kNudgeTime;
}

void JoystickMapper::settleHats(double now, bool edges) {
  for (std::size_t i = 0; i < integrated_.size(); ++i) {
    const IntegratedInput& in = options_.integrated[i];
    Integrated& hat = integrated_[i];
    const double j = selected_of_group_[hat.group] == i ? source(in) : 0.0;
    if (edges && !hat.pushed && j != 0.0 && hat.state.isAtEnd(in.rate * j)) askAgain(in.target, hat.state.value(), now);
    hat.pushed = j != 0.0;
  }
}

void JoystickMapper::settleButtons(double now, bool edges) {
  for (std::size_t i = 0; i < buttons_.size(); ++i) {
    Button& button = buttons_[i];
    if (button.raw == button.pressed) continue;
    if (edges && now - button.changed < options_.debounce) continue;
    button.pressed = button.raw;
    button.changed = now;
    if (edges && button.pressed) onPress(static_cast<int>(i), now);
  }
}

void JoystickMapper::onPress(int button, double now) {
  for (std::size_t i = 0; i < integrated_.size(); ++i) {
    if (options_.integrated[i].select_button == button) selected_of_group_[integrated_[i].group] = i;
  }
  for (std::size_t i = 0; i < options_.buttons.size(); ++i) {
    if (options_.buttons[i].button != button) continue;
    // The newest press on a target decides it.
    for (std::size_t k = 0; k < options_.buttons.size(); ++k) {
      if (options_.buttons[k].target == options_.buttons[i].target) button_used_[k] = 0;
    }
    button_used_[i] = 1;
    askAgain(options_.buttons[i].target, options_.buttons[i].value, now);
  }
  chooseSurface(button);
  for (std::size_t i = 0; i < options_.actions.size(); ++i) {
    if (options_.actions[i].button == button) actions_.push_back(i);
  }
  const auto ask = [this](FlightMode mode) {
    requests_.push_back(mode);
    mode_ = mode;
  };
  if (button == options_.mode.manual) ask(FlightMode::kManual);
  if (button == options_.mode.automatic) ask(FlightMode::kAuto);
  if (button == options_.mode.toggle) {
    ask(mode_ == FlightMode::kManual ? FlightMode::kAuto : FlightMode::kManual);
  }
}

/// Of a device that appears, or comes back: its levers read 0 until they are touched, and the cockpit may have moved
/// what they, its hats and buttons commanded before.
void JoystickMapper::startAnew(double now) {
  integrated_until_ = now;
  direct_moved_.assign(options_.direct.size(), 0);
  button_used_.assign(options_.buttons.size(), 0);
  for (std::size_t i = 0; i < integrated_.size(); ++i) {
    integrated_[i].state = integratorOf(options_.integrated[i]);
    integrated_[i].moved = false;
  }
  surfaces_.clear();
  for (const SurfaceInput& in : options_.surfaces) {
    surfaces_.push_back({TravelIntegrator(in.low, in.high, in.initial), in.initial});
  }
  chosen_surface_.reset();
  last_ = {};
  nudged_until_.clear();
}

bool JoystickMapper::onJoy(const std::vector<float>& axes, const std::vector<std::int32_t>& buttons, double now) {
  if (!check(axes, buttons.size())) {
    ++dropped_;
    return false;
  }
  const bool first = !alive(now);
  if (first) {
    startAnew(now);
  } else {
    integrateUpTo(now);
  }
  last_joy_ = now;
  axes_.assign(axes.begin(), axes.end());
  buttons_.resize(buttons.size());
  for (std::size_t i = 0; i < buttons.size(); ++i) buttons_[i].raw = buttons[i] != 0;
  // What is held down when the device appears was not pressed for us.
  settleButtons(now, !first);
  settleHats(now, !first);
  for (std::size_t i = 0; i < options_.direct.size(); ++i) {
    const auto value = axis(options_.direct[i].axis.of(options_.stick_mode));
    if (value && *value != 0.0) direct_moved_[i] = 1;
  }
  return true;
}

JoystickCommand JoystickMapper::update(double now) {
  JoystickCommand out;
  out.alive = alive(now);
  if (!out.alive) return out;
  integrateUpTo(now);
  settleButtons(now, true);
  for (std::size_t i = 0; i < options_.direct.size(); ++i) {
    const DirectInput& in = options_.direct[i];
    const auto j = axis(in.axis.of(options_.stick_mode));
    if (!j || (in.silent_until_moved && !direct_moved_[i])) continue;
    const double delta = in.scale * shapeAxis(*j, in.dead_zone, in.expo);
    switch (in.travel) {
      case AxisTravel::kSymmetric:
        command(in.target, delta, out.command);
        break;
      case AxisTravel::kFull:
        command(in.target, std::clamp(0.5 * (1.0 + delta), 0.0, 1.0), out.command);
        break;
      case AxisTravel::kPositive:
        command(in.target, std::clamp(delta, 0.0, 1.0), out.command);
        break;
    }
  }
  for (std::size_t i = 0; i < integrated_.size(); ++i) {
    const IntegratedInput& in = options_.integrated[i];
    if (integrated_[i].moved && !lacksAxis(in.axis)) command(in.target, integrated_[i].state.value(), out.command);
  }
  for (std::size_t i = 0; i < options_.buttons.size(); ++i) {
    const ButtonInput& in = options_.buttons[i];
    if (!button_used_[i]) continue;
    command(in.target, pressed(in.button) || !in.released ? in.value : *in.released, out.command);
  }
  last_ = out.command;
  for (const auto& [target, until] : nudged_until_) {
    if (now >= until) continue;
    const ChannelRange range = commandRange(target);
    const double value = commanded(target, last_);
    command(target, value > 0.5 * (range.low + range.high) ? value - kNudge : value + kNudge, out.command);
  }
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    const SurfaceInput& in = options_.surfaces[i];
    if (surfaces_[i].commanded && !lacksAxis(in.axis)) out.surfaces.push_back({in.name, surfaces_[i].deflection_deg});
  }
  return out;
}

std::vector<FlightMode> JoystickMapper::takeModeRequests() {
  std::vector<FlightMode> out;
  out.swap(requests_);
  return out;
}

std::vector<std::size_t> JoystickMapper::takeActions() {
  std::vector<std::size_t> out;
  out.swap(actions_);
  return out;
}

std::vector<std::string> JoystickMapper::selected() const {
  std::vector<std::string> out;
  for (const std::size_t i : selected_of_group_) out.push_back(options_.integrated[i].key);
  if (chosen_surface_) out.push_back(options_.surfaces[*chosen_surface_].key);
  return out;
}

}  // namespace xplane_bridge::core
