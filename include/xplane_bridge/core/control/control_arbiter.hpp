#pragma once

/// Who flies: manual or automatic commands, their limits, time-outs and failsafes.
///
/// All times are seconds of one steady clock passed in by the caller. Not thread-safe: one owner.

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "xplane_bridge/core/control/control_command.hpp"

namespace xplane_bridge::core {

/// What a channel does when the source that flies it is silent for longer than the time-out.
enum class Failsafe : std::uint8_t {
  kNeutral,  ///< goes to the channel's neutral value (the paper's zeros)
  kHold,     ///< keeps what was sent last
  kManual,   ///< follows control/manual while that is alive, else goes to neutral
};

/// Limits and failsafe of one channel, from the aircraft's YAML. Values in the channel's own unit.
struct ChannelOptions {
  double low = -1.0, high = 1.0;                          ///< within commandRange()
  double slew = std::numeric_limits<double>::infinity();  ///< [1/s] fastest change; infinity: unlimited
  Failsafe failsafe = Failsafe::kNeutral;
  double neutral = 0.0;  ///< within [low, high]
};

/// Limits and failsafe that a section of the aircraft's YAML begins with. Sticks, levers, motors and toe brakes follow
/// the aircraft's `failsafe`, handles hold; below 0 a lever means reverse thrust, which most aircraft do not have.
ChannelOptions channelDefaults(const ChannelSection& section, Failsafe failsafe, bool reverse_thrust);

struct ArbiterOptions {
  /// Sticks, levers, motors and toe brakes go to 0; handles and trims hold.
  ArbiterOptions();

  std::array<ChannelOptions, kChannelCount> channels;
  int engines = 1;                  ///< 1..kMaxEngines, for the one lever that moves all
  double command_timeout = 0.5;     ///< [s] since arrival; > 0
  double resume_grace = 1.0;        ///< [s] after a pause or gap in which a source may be heard again; >= 0
  double transition_rate = 2.0;     ///< [1/s] fastest change of a channel that changes hands; > 0
  double takeover_threshold = 0.3;  ///< stick movement since AUTO was engaged that takes over; 0: never
  FlightMode initial_mode = FlightMode::kManual;
  FlightMode surfaces_source = FlightMode::kAuto;  ///< the mode in which control/surfaces flies
};

/// First thing wrong, with the key, given value and expectation; nullopt when all is well.
std::optional<std::string> validate(const ArbiterOptions& options);

/// As on control/mode_request.
struct ModeRequest {
  std::uint32_t sequence = 0;  ///< the sender's counter; 0: not counted, always taken as new
  int mode = 0;                ///< FlightMode
  std::string requester;
  double stamp = 0.0;  ///< [s] the sender's time; distinguishes a restarted counter from an old message
};

enum class RequestOutcome : std::uint8_t {
  kChanged,    ///< the mode is now the one asked for
  kUnchanged,  ///< it was already
  kIgnored,    ///< a duplicate, or older than one already seen from this requester: not answered
  kRefused,    ///< no such mode
};

/// As on control/mode.
struct ModeStatus {
  FlightMode mode = FlightMode::kManual;
  std::optional<FlightMode> previous;  ///< none at the start
  std::string requested_by;
  std::string reason = "start";
  std::uint32_t request_sequence = 0;  ///< 0 when it changed without a request
  bool accepted = true;
  double since = 0.0;  ///< [s] steady time of the last change of mode
  bool manual_alive = false;
  bool auto_alive = false;
  /// The active source is silent and at least one channel follows its failsafe. In the mode of control/surfaces those
  /// commands are a source too, until the mode's own topic is heard.
  bool failsafe = false;
  std::uint32_t revision = 0;  ///< counts changes of any of the above: publish when it differs
};

/// Counters of one source.
struct SourceStatistics {
  std::uint64_t accepted = 0;
  std::array<std::uint64_t, static_cast<std::size_t>(Refusal::kCount)> refused{};
  std::string last_refusal;  ///< in words; empty: none so far
  std::uint64_t refusedTotal() const;
};

/// A test signal added to what was arbitrated.
struct ChannelExcitation {
  ChannelSet channels;     ///< only those that the active source commands are excited, unless `rest` is set
  ChannelValues values{};  ///< added to each of them
  /// Where the channels without a command are meanwhile; they are X-Plane's again afterwards.
  std::optional<double> rest;
};

/// What to send now.
struct ArbitratedControls {
  ChannelValues values{};
  ChannelSet active;  ///< channels to send; none before the first command
  FlightMode mode = FlightMode::kManual;
  CommandSource source = CommandSource::kNone;
  std::uint32_t sequence = 0;  ///< of the active source's last command
  double source_age = 0.0;     ///< [s] since that arrived; 0 while none has
  std::uint32_t fields = 0;    ///< Field bits of `active`
  std::uint32_t limited = 0;   ///< Field bits cut by a limit, slew or transition
  std::uint32_t excited = 0;   ///< Field bits to which an excitation was added
};

class ControlArbiter {
 public:
  /// Throws std::invalid_argument with validate()'s text.
  ControlArbiter(const ArbiterOptions& options, double now);

  /// True while X-Plane runs: connected, not paused, not stale. Otherwise no time-out advances and no slew moves.
  void setTimeRunning(bool running, double now);

  /// A command that arrived at `now`. A refused one changes nothing: the last good command goes on until its time-out.
  std::optional<CommandRefusal> onCommand(FlightMode from, const ControlCommand& command, double now);

  /// Why control/surfaces may not command single surfaces now; empty: it may. They belong to one mode, and what ends
  /// that mode or its source ends them.
  std::string refusalOfSurfaces(double now);
  /// A command of single surfaces that arrived at `now` and may fly. It has to be repeated like any other.
  void onSurfaces(double now);
  /// They were given up by those who command them.
  void endSurfaces() { surfaces_ = {}; }
  /// Single surfaces are commanded, as of the last call.
  bool surfacesFly() const { return surfaces_.until > running_time_; }

  RequestOutcome onModeRequest(const ModeRequest& request, double now);

  /// Changes the mode from inside, e.g. by a service; `reason` and `who` are shown on control/mode.
  void setMode(FlightMode mode, const std::string& who, const std::string& reason, double now);

  /// Nothing is sent any more before the next command, as before the first one. The mode stays; where anything was
  /// sent, `reason` is shown on control/mode.
  void forgetCommands(const std::string& reason, double now);
  /// What these channels were sent last has been given back since: they are sent what is commanded, from there on, and
  /// nothing before a command.
  void forgetSent(const ChannelSet& channels);

  /// Advances to `now` and says what to send. Call at the sending rate and right after each accepted command.
  const ArbitratedControls& step(double now, const ChannelExcitation& excitation = {});

  const ModeStatus& status() const { return status_; }
  /// Channels for which the source that flies has a command younger than its time-out, as of the last call.
  ChannelSet commanded() const;
  const SourceStatistics& statistics(FlightMode source) const { return sourceOf(source).statistics; }
  const ArbiterOptions& options() const { return options_; }

 private:
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  /// When something falls silent, by running_time_.
  struct Expiry {
    double until = kNever;   // kNever: not commanded
    double latest = kNever;  // until then a pause may put it off
  };
  struct Source {
    ChannelValues values{};
    std::array<Expiry, kChannelCount> expires;
    Expiry alive;
    double arrival = 0.0;
    std::uint32_t sequence = 0;
    std::uint32_t throttle_field = 0;  // the kind commanded last
    SourceStatistics statistics;
  };
  enum class Origin : std::uint8_t { kNone, kManual, kAuto, kNeutral, kHold };
  struct Target {
    double value;
    Origin origin;
  };

  Source& sourceOf(FlightMode mode) { return sources_[mode == FlightMode::kManual ? 0 : 1]; }
  const Source& sourceOf(FlightMode mode) const { return sources_[mode == FlightMode::kManual ? 0 : 1]; }
  bool fresh(FlightMode mode, std::size_t channel) const {
    return sourceOf(mode).expires[channel].until > running_time_;
  }
  bool alive(FlightMode mode) const { return sourceOf(mode).alive.until > running_time_; }
  void advance(double now);
  /// Of what is commanded now.
  Expiry nextExpiry() const {
    const double until = running_time_ + options_.command_timeout;
    return {until, until + options_.resume_grace};
  }
  void watchStick(const ChannelSet& commanded, const ChannelValues& values, bool was_alive, double now);
  void dropOtherThrottleKind();
  std::optional<Target> targetOf(std::size_t channel) const;
  void moveTowards(std::size_t channel, const Target& target, double dt);
  bool takesSignal(std::size_t channel, bool has_target, const ChannelExcitation& excitation) const;
  void excite(std::size_t channel, double base, double value);
  void updateStatus(bool failsafe);
  std::string endingSurfaces();
  void beginMode();

  ArbiterOptions options_;
  std::array<Source, 2> sources_;
  bool time_running_ = true;
  double now_;
  double running_time_ = 0.0;    // [s] advances while X-Plane runs, see setTimeRunning
  double last_step_time_ = 0.0;  // running_time_ of the previous step
  std::array<double, kChannelCount> output_{};
  std::array<Origin, kChannelCount> origin_{};
  std::bitset<kChannelCount> blending_;  // changes hands: transition_rate applies until it has caught up
  std::array<double, 3> stick_reference_;
  Expiry surfaces_;
  bool heard_ = false;           // the topic of the mode, since the mode was asked for
  bool surfaces_heard_ = false;  // control/surfaces, likewise
  struct Seen {
    std::uint32_t sequence;
    double stamp;
  };
  std::map<std::string, Seen> seen_requests_;
  ModeStatus status_;
  ArbitratedControls out_;
};

}  // namespace xplane_bridge::core
