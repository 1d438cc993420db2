#pragma once

/// The joysticks at X-Plane's own computer: what is asked for, and what the answers say in the order and with the signs
/// of sensor_msgs/Joy. Names after Laminar's lists of 11.40 to 12.10; override_joystick does not stop these values.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

namespace xplane_bridge::core {

/// Of X-Plane's arrays.
constexpr int kMaxStickAxes = 500;
constexpr int kMaxStickButtons = 3200;

/// One axis of the messages: a function that X-Plane's settings give to an axis of a joystick.
struct StickFunction {
  const char* name;      ///< for messages
  int assignment;        ///< in sim/joystick/joystick_axis_assignments
  int other_assignment;  ///< taken where no axis has the first; 0: none
  /// Sign of the message's axis (left, up and forward +) for X-Plane's value, which rises to the right, backward (nose
  /// up) and to full.
  float sign;
};

/// Positions in the message, as config/joysticks/xplane.yaml has them.
inline constexpr StickFunction kStickFunctions[] = {
    {"roll", 2, 0, -1.0F},          {"pitch", 1, 0, -1.0F},         {"yaw", 3, 0, -1.0F},
    {"throttle", 4, 20, 1.0F},      {"left toe brake", 6, 0, 1.0F}, {"right toe brake", 7, 0, 1.0F},
    {"flaps", 11, 0, 1.0F},         {"speedbrake", 14, 0, 1.0F},    {"thrust vector", 12, 0, 1.0F},
    {"elevator trim", 17, 0, 1.0F}, {"aileron trim", 18, 0, 1.0F},  {"rudder trim", 19, 0, 1.0F},
};

/// One thread calls, or the caller locks.
class SimulatorStick {
 public:
  struct Options {
    int axes = 100;        ///< of X-Plane's array, among which functions are looked for; a device has 25 of them
    int first_button = 0;  ///< of X-Plane's array; a device has 160 of them
    int buttons = 32;
    int rate = 50;  ///< [1/s] of values
  };

  static constexpr int kSettingsRateHz = 1;

  explicit SimulatorStick(const Options& options);

  /// What X-Plane's settings make of each axis, at kSettingsRateHz; the position is the index.
  const std::vector<std::string>& settingRequests() const { return setting_requests_; }
  /// An answer to these. Returns whether valueRequests() have changed.
  bool addSettings(const RrefView& datagram, std::int64_t receive_ns);

  /// Where the stick and its buttons are, at the rate of the options.
  const std::vector<std::string>& valueRequests() const { return value_requests_; }
  /// An answer to these. Returns whether axes() and buttons() are to be published: a joystick is there, an axis of it
  /// rolls or pitches, and all of a sample has come.
  bool addValues(const RrefView& datagram, std::int64_t receive_ns);

  /// [-1..1] as kStickFunctions; 0 where no axis has had the function. A stick whose axis is gone is centred, a lever
  /// stays where it was.
  const std::vector<float>& axes() const { return axes_; }
  const std::vector<std::int32_t>& buttons() const { return buttons_; }

  /// Whether axes() go out, or why not, in a sentence.
  bool usable() const { return problem().empty(); }
  std::string problem() const;
  /// Functions and the axes that have them: "roll 0, pitch 1, throttle 3 (reversed)".
  std::string describe() const;

 private:
  struct Source {
    int axis = -1;  ///< of X-Plane's array; -1: none
    bool reversed = false;
    bool operator!=(const Source& other) const { return axis != other.axis || reversed != other.reversed; }
  };
  using Sources = std::vector<Source>;  // as kStickFunctions

  Sources sourcesOf(const std::vector<float>& settings) const;
  void askForValues();

  Options options_;
  std::vector<std::string> setting_requests_;
  RrefFrameAssembler settings_;
  std::optional<Sources> sources_;  // once X-Plane has sent its settings
  std::vector<std::string> value_requests_;
  RrefFrameAssembler values_{0};
  std::optional<bool> attached_;
  std::vector<float> axes_;
  std::vector<std::int32_t> buttons_;
};

}  // namespace xplane_bridge::core
