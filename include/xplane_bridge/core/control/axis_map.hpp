#pragma once

/// Joystick axes and buttons to commands: the paper's equations (1) and (2).
///
/// (1)  delta = xi * j                      primary controls; j after dead zone and expo, saturated to the channel
/// (2)  delta = sat[map{integ(xi * j)}]     secondary controls from hats, arrow keys and self-centring sticks
///
/// Axes are as in sensor_msgs/Joy: -1..1. Times are seconds of one steady clock passed in by the caller.

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/control/control_command.hpp"

namespace xplane_bridge::core {

/// Which stick of a two-stick device does what. Mode 1 (the paper's): pitch on the left stick's vertical, throttle on
/// the right's. Mode 2: throttle left, pitch right.
enum class StickMode : std::uint8_t { kMode1 = 1, kMode2 = 2 };

/// An axis index that may differ by stick mode; -1: none.
struct AxisIndex {
  int mode_1 = -1, mode_2 = -1;
  int of(StickMode mode) const { return mode == StickMode::kMode1 ? mode_1 : mode_2; }
};

/// By the name in YAML ("roll", "trim_pitch", "brakes", ...); nullopt for another.
std::optional<JoyTarget> joyTargetFrom(const std::string& name);
const char* toString(JoyTarget target);
ChannelRange commandRange(JoyTarget target);

enum class AxisTravel : std::uint8_t {
  kSymmetric,  ///< -1..1 stays -1..1: sticks
  kFull,       ///< the whole travel becomes 0..1: throttle levers and knobs, triggers; (1 + xi j) / 2
  kPositive,   ///< the positive half becomes 0..1, the negative half 0
};

/// Equation (1).
struct DirectInput {
  std::string key;  ///< YAML key, for messages
  JoyTarget target = JoyTarget::kRoll;
  AxisIndex axis;
  double scale = 1.0;      ///< xi: sign and scale; not 0
  double dead_zone = 0.0;  ///< [0, 1) of the travel from the centre; the rest is stretched to the full range
  double expo = 0.0;       ///< [0, 1]: (1 - e) j + e j^3
  AxisTravel travel = AxisTravel::kSymmetric;
  /// Drivers report 0 for levers and triggers until they are first moved: nothing is commanded before that.
  bool silent_until_moved = false;
};

/// Equation (2). The state is a fraction 0..1 of the travel, mapped to [low, high].
struct IntegratedInput {
  std::string key;  ///< YAML key, for messages
  JoyTarget target = JoyTarget::kTrimPitch;
  AxisIndex axis;            ///< a hat or stick axis, or
  int increase_button = -1;  ///< j = 1 while pressed
  int decrease_button = -1;  ///< j = -1 while pressed
  double rate = 0.2;         ///< xi [1/s]: fraction of the travel per second at j = 1; not 0; negative reverses
  double dead_zone = 0.1;    ///< [0, 1)
  double low = -1.0, high = 1.0;
  double initial = 0.0;         ///< in [low, high]; where it begins, also when the device comes back
  std::vector<double> detents;  ///< rising; the output snaps to the nearest one; empty: none
  /// Inputs of one axis or button pair share it: a press of this button selects this one, the first is selected at the
  /// start. -1: the only one.
  int select_button = -1;
};

/// A button that sets a value.
struct ButtonInput {
  std::string key;
  JoyTarget target = JoyTarget::kGear;
  int button = -1;
  double value = 1.0;
  std::optional<double> released;  ///< value while not pressed, once it has been pressed; none: the value stays
};

/// A single surface, set by an axis, a hat or two buttons once its button has chosen it. One is chosen at a time; those
/// chosen before stay where they were set. A press on the button of the chosen one gives that surface back.
struct SurfaceInput {
  std::string key;   ///< YAML key, for messages
  std::string name;  ///< of the surface
  AxisIndex axis;    ///< or
  int increase_button = -1;
  int decrease_button = -1;
  int select_button = -1;
  double rate = 0.0;             ///< [1/s] fraction of the travel, as IntegratedInput's; 0: the axis sets it
  double scale = 1.0;            ///< sign and scale of an axis that sets it; not 0
  double dead_zone = 0.1;        ///< [0, 1)
  double low = 0.0, high = 0.0;  ///< [deg] ends of the travel
  double initial = 0.0;          ///< [deg] where it goes when it is chosen first
};

/// A button that asks for something other than a command; for what, its owner knows.
struct ActionButton {
  std::string key;
  int button = -1;
};

/// Buttons for automatic and manual; -1: none.
struct ModeButtons {
  int manual = -1;
  int automatic = -1;
  int toggle = -1;  ///< asks for the mode that is not the present one
};

struct JoystickOptions {
  std::string device;  ///< name for messages
  StickMode stick_mode = StickMode::kMode2;
  double joy_timeout = 0.5;  ///< [s] without a message after which the device counts as dead; > 0
  double debounce = 0.05;    ///< [s] in which a button may not change again; >= 0
  std::vector<DirectInput> direct;
  std::vector<IntegratedInput> integrated;
  std::vector<ButtonInput> buttons;
  std::vector<SurfaceInput> surfaces;
  std::vector<ActionButton> actions;
  ModeButtons mode;
};

/// Whether both are driven by one axis or button pair.
bool sameSource(const IntegratedInput& a, const IntegratedInput& b, StickMode mode);

/// First thing wrong, with key, given value and expectation.
std::optional<std::string> validate(const JoystickOptions& options);

/// Dead zone and expo of equation (1), before xi. j outside -1..1 is saturated.
double shapeAxis(double j, double dead_zone, double expo);

/// The integrator of equation (2): fraction of the travel, never beyond its ends (no wind-up).
class TravelIntegrator {
 public:
  TravelIntegrator(double low, double high, double initial, std::vector<double> detents = {});
  /// Adds rate * j * dt. rate [1/s], dt [s] >= 0.
  void integrate(double rate, double j, double dt);
  /// map and sat: the fraction as a value in [low, high], at the nearest detent where there are any.
  double value() const { return valueAt(fraction_); }
  /// Whether going on at this rate would leave the value as it is.
  bool isAtEnd(double rate) const { return value() == valueAt(rate > 0.0 ? 1.0 : 0.0); }
  double fraction() const { return fraction_; }

 private:
  double valueAt(double fraction) const;

  double low_, high_, fraction_;
  std::vector<double> detents_;
};

/// Something about the device or its file that a user must know.
struct JoyProblem {
  enum class Kind : std::uint8_t {
    kAxisMissing,    ///< what the axis drives is not commanded
    kButtonMissing,  ///< the button counts as never pressed
    kNotFinite,      ///< the message is dropped, as if it had not come
    kOutOfRange,     ///< dropped too
  };
  Kind kind;
  int index;
  std::string key;
  std::string text;  ///< device, index and YAML key in one sentence
};

struct SurfaceSetting {
  std::string name;
  double deflection_deg = 0.0;
};

struct JoystickCommand {
  bool alive = false;                    ///< false: nothing must be published
  ControlCommand command;                ///< `fields`: what is commanded; `sequence` is the caller's
  std::vector<SurfaceSetting> surfaces;  ///< that are commanded, beside it
};

/// One device. Not thread-safe.
class JoystickMapper {
 public:
  /// Throws std::invalid_argument with validate()'s text.
  explicit JoystickMapper(const JoystickOptions& options);

  /// A message that arrived at `now`. Returns false if it is dropped (see JoyProblem).
  bool onJoy(const std::vector<float>& axes, const std::vector<std::int32_t>& buttons, double now);

  /// Integrates up to `now` and gives the command.
  JoystickCommand update(double now);

  /// Mode changes asked for by buttons since the last call, in order.
  std::vector<FlightMode> takeModeRequests();
  /// Actions whose buttons were pressed since the last call, in order: their places in JoystickOptions::actions.
  std::vector<std::size_t> takeActions();
  /// The present mode, for the toggle button.
  void setMode(FlightMode mode) { mode_ = mode; }

  bool alive(double now) const { return now < last_joy_ + options_.joy_timeout; }
  /// Problems of the newest message; empty when it was sound.
  const std::vector<JoyProblem>& problems() const { return problems_; }
  std::uint64_t dropped() const { return dropped_; }
  /// Keys of the integrated inputs, and of the surface, that are selected now.
  std::vector<std::string> selected() const;
  const JoystickOptions& options() const { return options_; }

 private:
  struct Button {
    bool raw = false, pressed = false;
    double changed = -std::numeric_limits<double>::infinity();
  };
  struct Integrated {
    TravelIntegrator state;
    std::size_t group;
    bool moved = false;
    bool pushed = false;
  };

  struct Surface {
    TravelIntegrator state;
    double deflection_deg;
    bool commanded = false;
  };

  void checkAxis(int axis, const std::string& key, const std::vector<float>& axes);
  void checkButton(int button, const std::string& key, std::size_t count);
  bool check(const std::vector<float>& axes, std::size_t button_count);
  std::optional<double> axis(int index) const;
  bool lacksAxis(AxisIndex wanted) const;  // false where none is wanted
  bool held(int button) const;             // as the device says
  bool pressed(int button) const;          // debounced
  template <class Input>
  double source(const Input& input) const;
  void startAnew(double now);
  void integrateUpTo(double now);
  void settleButtons(double now, bool edges);
  void settleHats(double now, bool edges);
  void onPress(int button, double now);
  void askAgain(JoyTarget target, double value, double now);

  void moveSurface(double dt);
  void chooseSurface(int button);

  JoystickOptions options_;
  std::vector<double> axes_;
  std::vector<Button> buttons_;
  std::vector<Integrated> integrated_;
  std::vector<std::size_t> selected_of_group_;
  std::vector<char> direct_moved_;
  std::vector<char> button_used_;
  ControlCommand last_;                       // as of the last update, without nudges
  std::map<JoyTarget, double> nudged_until_;  // [s]
  std::vector<Surface> surfaces_;
  std::optional<std::size_t> chosen_surface_;
  std::vector<FlightMode> requests_;
  std::vector<std::size_t> actions_;
  std::vector<JoyProblem> problems_;
  FlightMode mode_ = FlightMode::kManual;
  double last_joy_ = -std::numeric_limits<double>::infinity();
  double integrated_until_ = -std::numeric_limits<double>::infinity();
  std::uint64_t dropped_ = 0;
};

}  // namespace xplane_bridge::core
