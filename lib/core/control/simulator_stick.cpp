#include "xplane_bridge/core/control/simulator_stick.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace xplane_bridge::core {
namespace {

const std::string kJoystickFolder = "sim/joystick/";
constexpr std::size_t kRoll = 0, kPitch = 1, kYaw = 2;  // of kStickFunctions
constexpr float kPressed = 0.5F;

std::string joystickElement(const char* name, int index) {
  return kJoystickFolder + name + "[" + std::to_string(index) + "]";
}

RrefFrameAssembler assemblerOf(std::size_t size, int rate) {
  return RrefFrameAssembler(size, 0, RrefFrameAssembler::Options::atRate(rate));
}

}  // namespace

SimulatorStick::SimulatorStick(const Options& options)
    : options_(options),
      settings_(assemblerOf(2 * static_cast<std::size_t>(options.axes), kSettingsRateHz)),
      axes_(std::size(kStickFunctions), 0.0F),
      buttons_(static_cast<std::size_t>(options.buttons), 0) {
  for (int axis = 0; axis < options_.axes; ++axis) {
    setting_requests_.push_back(joystickElement("joystick_axis_assignments", axis));
    setting_requests_.push_back(joystickElement("joystick_axis_reverse", axis));
  }
  askForValues();
}

SimulatorStick::Sources SimulatorStick::sourcesOf(const std::vector<float>& settings) const {
  const auto first = [&](int assignment) {
    for (int axis = 0; axis < options_.axes; ++axis) {
      const float reported = settings[2 * static_cast<std::size_t>(axis)];
      if (assignment != 0 && reported == static_cast<float>(assignment)) return axis;
    }
    return -1;
  };
  Sources out;
  for (const StickFunction& function : kStickFunctions) {
    Source source;
    source.axis = first(function.assignment);
    if (source.axis < 0) source.axis = first(function.other_assignment);
    // X-Plane writes the axis' number, or 1.
    if (source.axis >= 0) source.reversed = settings[2 * static_cast<std::size_t>(source.axis) + 1] > 0.0F;
    out.push_back(source);
  }
  return out;
}

bool SimulatorStick::addSettings(const RrefView& datagram, std::int64_t receive_ns) {
  if (!settings_.add(datagram, receive_ns)) return false;
  Sources reported = sourcesOf(settings_.values());
  const bool changed = !sources_ || !std::equal(reported.begin(), reported.end(), sources_->begin(),
                                                [](const Source& a, const Source& b) { return !(a != b); });
  if (!changed) return false;
  sources_ = std::move(reported);
  askForValues();
  return true;
}

void SimulatorStick::askForValues() {
  value_requests_ = {kJoystickFolder + "has_joystick"};
  for (int button = 0; button < options_.buttons; ++button) {
    value_requests_.push_back(joystickElement("joystick_button_values", options_.first_button + button));
  }
  if (sources_) {
    for (const Source& source : *sources_) {
      if (source.axis >= 0) value_requests_.push_back(joystickElement("joystick_axis_values", source.axis));
    }
  }
  values_ = assemblerOf(value_requests_.size(), options_.rate);
}

bool SimulatorStick::addValues(const RrefView& datagram, std::int64_t receive_ns) {
  if (!values_.add(datagram, receive_ns)) return false;
  const std::vector<float>& values = values_.values();
  attached_ = values[0] >= kPressed;  // also of NaN: unknown to this X-Plane
  if (!usable()) return false;
  for (std::size_t i = 0; i < buttons_.size(); ++i) buttons_[i] = values[1 + i] >= kPressed ? 1 : 0;
  std::size_t next = 1 + buttons_.size();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const Source& source = (*sources_)[i];
    const float value = source.axis < 0 ? std::numeric_limits<float>::quiet_NaN() : values[next++];
    if (!std::isfinite(value)) {
      if (i <= kYaw) axes_[i] = 0.0F;  // a lever that is gone stays where it was: 0 would be half of its travel
      continue;
    }
    const float shown = 2.0F * std::clamp(value, 0.0F, 1.0F) - 1.0F;
    axes_[i] = kStickFunctions[i].sign * (source.reversed ? -shown : shown);
  }
  return true;
}

std::string SimulatorStick::problem() const {
  if (!attached_) return "X-Plane has not shown its joystick yet";
  if (!*attached_) return "X-Plane has no joystick: plug one in at its computer";
  if (!sources_) return "X-Plane has not reported yet what its axes are assigned to";
  if ((*sources_)[kRoll].axis >= 0 || (*sources_)[kPitch].axis >= 0) return "";
  return "none of X-Plane's first " + std::to_string(options_.axes) +
         " axes rolls or pitches: assign them in X-Plane's joystick settings, or raise the parameter axes";
}

std::string SimulatorStick::describe() const {
  std::string out;
  if (!sources_) return out;
  for (std::size_t i = 0; i < sources_->size(); ++i) {
    const Source& source = (*sources_)[i];
    if (source.axis < 0) continue;
    out += (out.empty() ? "" : ", ") + std::string(kStickFunctions[i].name) + " " + std::to_string(source.axis) +
           (source.reversed ? " (reversed)" : "");
  }
  return out;
}

}  // namespace xplane_bridge::core
