#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/control/missing_channels.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// Whether commands are sent to X-Plane, and if not, why. Where several hold, the one further down stands.
enum class Standing : std::uint8_t {
  kFlying,          ///< commands are sent, as soon as there are any
  kWrongAircraft,   ///< the aircraft loaded is not that of the configuration, or not known yet
  kWaitingForMode,  ///< another client has released an override: until a mode is asked for
  kSuspended,       ///< a flight service loads something
  kNotConnected,    ///< no X-Plane, or one that has not shown its flight yet
};
const char* toString(Standing standing);

struct ControlPathOptions {
  core::ArbiterOptions arbiter;
  double rate = 50.0;                 ///< [Hz] of refreshing
  double max_rate = 200.0;            ///< [Hz] of sending commands on arrival
  double stale_after = 1.0;           ///< [s] of X-Plane's silence from which on the arbiter stands still
  bool each_frame = false;            ///< lock-step: sent by tick() only, which is called once a frame
  bool resume_auto = false;           ///< AUTO goes on in a new flight and in a new X-Plane
  bool reverse_thrust = false;        ///< of the levers
  bool rows = false;                  ///< commands go as DATA rows, as far as those can carry them
  std::vector<std::string> aircraft;  ///< ICAO codes, or descriptions, that may be flown; empty: any
  std::string aircraft_file;          ///< where those stand, for messages
};

/// What was sent to X-Plane at one moment, and what X-Plane has shown of it.
struct AppliedControls {
  core::ArbitratedControls controls;
  core::ChannelSet sent;                     ///< of them; handles go out for a while after a change only
  std::int64_t sent_ns = 0;                  ///< [ns] host time
  double sim_time = std::nan("");            ///< [s] of the frame known at sending
  bool read_back = false;                    ///< X-Plane has shown all of it
  double read_back_sim_time = std::nan("");  ///< [s] of the frame that showed it
  double read_back_frames = std::nan("");    ///< between the two
};

/// What a ControlPath calls, with its mutex held; all must be set. None may wait.
struct ControlPathHooks {
  /// Something of core::ModeStatus has changed. `sim_time` [s] of the newest frame; NaN before the first.
  std::function<void(const core::ModeStatus& status, double sim_time)> mode;
  /// Controls were sent, or X-Plane has shown them.
  std::function<void(const AppliedControls& applied)> applied;
  /// Roll, pitch and yaw as sent just now; NaN where none is sent.
  std::function<void(const std::array<double, 3>& stick)> stick;
  /// The test signal to add now; no channels: none.
  std::function<core::ChannelExcitation()> excitation;
  /// That signal, and one of a surface, must end.
  std::function<void(const std::string& why)> end_excitation;
  /// Surfaces that are driven one by one must be given back: they would stand still.
  std::function<void(const std::string& why)> release_surfaces;
  /// The commands of control/surfaces must end; stick or mixing takes those surfaces on from where they are.
  std::function<void()> end_surface_commands;
  /// The mode has changed, a failsafe begins or ends, overrides were released by another client, the aircraft has
  /// nothing for a channel that is commanded: for events.
  enum class Kind : std::uint8_t { kMode, kFailsafe, kOverride, kMissing };
  std::function<void(Kind kind, const std::string& text, const std::string& who)> event;
  /// For the log: why commands are not sent.
  std::function<void(const std::string& text)> warn;
};

/// Commands on their way to X-Plane: arbitrates control/manual and control/auto, sends what is flown, holds the
/// overrides that needs, and watches X-Plane show it. Its one state is its Standing.
///
/// Goes by the link's clock and does nothing by itself: tick() and X-Plane's answers drive it. Thread-safe, by the
/// mutex it is given, which is held during hooks and may be held by those who call.
class ControlPath {
 public:
  /// Sends nothing yet; calls the mode hook. @throws std::invalid_argument for options out of range
  ControlPath(core::SimulatorPort* link, OverrideManager* overrides, const ControlPathOptions& options,
              ControlPathHooks hooks, std::shared_ptr<core::HandlerMutex> mutex);

  // What is asked for.

  /// A command that arrives. It is sent at once, or as soon as `max_rate` allows: see deadline().
  /// @return why it is refused; nullopt: taken
  std::optional<core::CommandRefusal> command(core::FlightMode from, const core::ControlCommand& command);
  core::RequestOutcome requestMode(const core::ModeRequest& request);
  /// Why control/surfaces may not move surfaces now, in words that say what to do; empty: it may.
  std::string refusalOfSurfaces();
  /// A command of control/surfaces that was not refused: of single surfaces, or one that gives all back.
  void onSurfaceCommand(bool gives_back);
  /// Nothing is flown until resume(), because of what `why` says; overrides are given back.
  void suspend(const std::string& why);
  void resume();

  // What drives it.

  void onLink(const core::LinkStatus& status);
  /// X-Plane has shown which aircraft is loaded: another one.
  void onAircraft(const core::AircraftIdentity& aircraft);
  /// X-Plane has shown that it is still the one of the last onAircraft(). Needed after a restart of X-Plane.
  void onSameAircraft();
  /// The flight began anew, or was placed elsewhere: `how`, in words.
  void onNewFlight(const std::string& how);
  /// Another client has released the override under which this node flew: it waits for a mode.
  void onReleasedByAnother(const std::string& override_name);
  /// Everything was given back without this node's doing, because of what `why` says: it waits for a mode, in MANUAL.
  void onGivenBack(const std::string& why);
  /// The next frame is the first one of a simulator in lock-step, which stood until now: that was no gap.
  void beginFlight();
  /// Whether this frame, which onFrame() has not had yet, is of another X-Plane.
  bool showsAnother(const core::FlightWatch& watch);
  /// Every frame of X-Plane.
  void onFrame(const core::FlightWatch& watch);
  /// Refreshes, and notices what others do to overrides. To be called at `rate` or more often, and at deadline().
  void tick();
  /// [ns] steady: when the command that waits for `max_rate` is to be sent; nullopt: none waits.
  std::optional<std::int64_t> deadline() const;

  // What is.

  /// Whether the configuration is for this aircraft.
  bool fits(const core::AircraftIdentity& aircraft) const;
  Standing standing() const;
  /// Why nothing is sent to X-Plane now, in words that say what to do; empty: it is.
  std::string refusal() const;
  /// What a request that needs commands is refused with now: kNoLink where waiting helps; nullopt: they are sent.
  std::optional<RequestResult> requestRefusal() const;
  core::ModeStatus mode() const;
  core::SourceStatistics statistics(core::FlightMode source) const;
  /// The channels that a living source commands and X-Plane gets.
  core::ChannelSet commanded() const;
  /// Channels that X-Plane has not shown as sent for a second, by name.
  std::vector<std::string> notFollowed() const;

 private:
  double now() const;
  void settle();
  bool timeRuns(double time);
  void halt(const std::string& why, double time);
  void resetAfterReconnect(bool same_flight, double time);
  bool isAnotherXPlane(const core::FlightWatch& watch) const;
  bool ranOn(double before, double after) const;
  bool continues(const core::FlightWatch& watch) const;
  void endAuto(const std::string& why, double time);
  void watchFailsafe();
  double& lastCommandOf(core::FlightMode mode) { return last_command_of_[mode == core::FlightMode::kManual ? 0 : 1]; }
  void afterModeChange(core::FlightMode before);
  void sendCommand(double time);
  void send(double time);
  bool canGiveBack() const;
  bool fly(core::ArbitratedControls* controls, double time);
  std::vector<core::Channel> notHeld(const core::ChannelSet& channels) const;
  void warnOnce(const std::string& text);
  void sendRows(const core::ArbitratedControls& controls, const core::ChannelSet& now);
  void prepareLevers(const core::ArbitratedControls& controls);
  core::ChannelSet channelsToSend(const core::ArbitratedControls& controls, double time);
  void publishMode();
  void publishApplied(const core::ArbitratedControls& controls, const core::ChannelSet& sent);
  void forgetApplied();
  void watchReadBack(const core::ChannelSet& channels);
  void onReadBack(const core::RrefView& view);
  bool isHandle(core::Channel channel) const;
  bool isShown(std::size_t channel, double value) const;
  void askMissing();
  core::ChannelSet missingChannels() const;
  core::ArbitratedControls withoutMissing(core::ArbitratedControls controls);
  void watchReleases();
  void watchSurfaces();

  core::SimulatorPort* link_;
  OverrideManager* overrides_;
  const ControlPathOptions options_;
  const ControlPathHooks hooks_;
  const std::shared_ptr<core::HandlerMutex> mutex_;

  Standing standing_ = Standing::kNotConnected;
  std::string why_not_;  // empty while flying
  // What the standing follows from; see settle().
  core::LinkStatus link_status_;
  bool flight_shown_ = true;    // a frame has come since the link came up anew
  bool aircraft_shown_ = true;  // and which aircraft that X-Plane has loaded
  std::string suspension_;      // why; empty: not suspended
  std::string halted_;          // why a mode must be asked for; empty: it need not
  core::AircraftIdentity aircraft_;
  std::vector<core::MissingChannel> missing_;  // of it
  core::ChannelSet missing_reported_;

  core::ControlArbiter arbiter_;
  core::ControlEncoder encoder_;
  std::optional<std::uint32_t> published_revision_;
  core::FlightWatch watch_;
  double last_frame_ = -1e9;                           // [s] steady
  bool failsafe_ = false;                              // as published last
  std::array<double, 2> last_command_of_{-1e9, -1e9};  // [s] steady; MANUAL, AUTO with its surfaces
  std::int64_t next_command_ns_ = 0;                   // [ns] steady; when the next one may be sent
  bool command_waits_ = false;                         // for that
  double last_send_ = -1e9;                            // [s] steady
  double last_override_refresh_ = -1e9;                // [s] steady
  bool surfaces_fly_ = false;  // control/surfaces commands, as far as end_surface_commands has not been called
  bool excited_ = false;       // what was sent last
  bool taken_ = false;         // overrides may be held
  std::string last_warning_;   // why commands are not sent, as warned of last

  core::ChannelValues last_values_{};                     // of Refresh::kOnChange channels
  std::array<double, core::kChannelCount> changed_at_{};  // [s] steady; of the same
  core::ChannelSet ever_sent_;                            // since forgetApplied(); handles as commanded now
  std::array<core::ChannelSet, 3> commanded_;             // in each mode, as of the last sending in it
  core::ChannelSet handles_shown_;                        // by X-Plane, since they were changed
  std::vector<core::DatarefWrite> writes_;

  std::deque<AppliedControls> awaiting_read_back_;  // oldest first
  core::ChannelSet watched_;
  std::vector<core::Channel> watched_order_;  // as subscribed, after the time
  core::ChannelValues read_back_values_{};
  core::ChannelSet read_back_known_;
  double last_followed_ = -1e9;   // [s] steady; X-Plane last showed all that was sent
  core::Subscription read_back_;  // last: it ends first
};

}  // namespace xplane_bridge
