#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/actuation/pausing.hpp"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/message_constants.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/simulator/airport_start.hpp"
#include "xplane_bridge/core/simulator/autopilot_settings.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"
#include "xplane_bridge/core/simulator/flight_start.hpp"
#include "xplane_bridge/core/simulator/world_settings.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// What FlightChanges needs of its node. Each function is called from the thread that changes, without a lock held.
struct FlightChangeHooks {
  std::function<core::FlightWatch()> watch;  ///< the newest frame
  std::function<unsigned()> resets;          ///< how often the flight was reset until now, see core::ResetDetector
  std::function<void()> placed;              ///< the flight was placed anew, which resets() has not counted
  std::function<unsigned()> identities;      ///< how often X-Plane has shown its aircraft until now
  std::function<std::string()> aircraft;     ///< the aircraft it showed last, in words
  /// Gives everything back and flies nothing until the next call with an empty text; the text says why. Waits until
  /// X-Plane has shown it, or a second.
  std::function<void(const std::string& reason)> suspend_control;
  /// `who` is about to pause or resume the flight; empty: it did not come to that.
  std::function<void(const std::string& who)> pausing;
  std::function<std::vector<std::string>()> overrides;  ///< that are set now
  std::function<void()> pause_left = [] {};             ///< leavePause() was called
};

struct FlightChangeOptions {
  double setting_timeout = 10.0;  ///< [s] until X-Plane must show a setting, or attitude and velocity
  double load_timeout = 120.0;    ///< [s] the same of a place, an aircraft or a situation: it may load files
  std::string airport_data{};     ///< path of X-Plane's apt.dat, for names of ramps and runways; empty: none
};

/// How a change ended, for an event.
struct FlightChangeOutcome {
  core::EventKind kind = core::EventKind::kSetting;
  std::string text;
  bool success = false;
};

/// Places the flight, sets weather and loading, loads aircraft and situations. Each call waits until X-Plane shows it.
/// Goes by the link's clock. One thread changes; any may stop it.
class FlightChanges {
 public:
  FlightChanges(core::SimulatorPort* link, const FlightChangeOptions& options, FlightChangeHooks hooks);

  /// Puts the aircraft there, with that attitude and velocity; `who` asked for it. X-Plane stands still meanwhile, and
  /// is as it was afterwards: paused or running.
  FlightChangeOutcome place(const core::FlightStart& start, const std::string& who);
  /// The same at an airport: a new flight on its ramp or runway, or from there before the runway.
  FlightChangeOutcome placeAt(const core::AirportStart& start, const std::string& who);
  FlightChangeOutcome applyWind(const core::UniformWind& wind);
  FlightChangeOutcome applyLoading(const core::Loading& loading);
  FlightChangeOutcome applyTime(const core::TimeSetting& time);
  FlightChangeOutcome applyWeather(const core::Weather& weather);
  FlightChangeOutcome applyAutopilot(const core::AutopilotSetting& setting);
  FlightChangeOutcome applyAircraft(const std::string& path, std::int32_t livery);
  FlightChangeOutcome saveSituation(const std::string& path);
  FlightChangeOutcome applySituation(const std::string& path);

  /// Puts back what X-Plane had before settings that were to end with the node, as far as the journal still holds it.
  /// What cannot be sent stays there, for the node's next start.
  void restoreSettings() { endSettings(true); }
  /// X-Plane is another one, whose time and weather are its own user's: nothing of the last one's comes back.
  void forgetSettings() { endSettings(false); }

  /// The change that is under way ends where it is, X-Plane resumed if it was paused for it, and so does every later
  /// one.
  void stop() { stopping_ = true; }
  bool stopping() const { return stopping_; }

 private:
  using Outcome = FlightChangeOutcome;

  static constexpr double kPoll = 0.2;  // [s] longest wait without looking at anything else

  /// A flight that is to begin.
  struct Beginning {
    core::Placement placement;
    std::function<bool(const std::optional<core::ShownFlight>& shown)> there;
    bool visible;         ///< X-Plane will show that the flight begins anew
    bool may_be_refused;  ///< if X-Plane answers and begins none, it never will
  };

  // Of place() and placeAt(). `shown` is what X-Plane shows last.
  bool movesAircraft() const;
  /// `visible` as in Beginning.
  std::string waitForPlacement(const core::FlightStart& start, bool visible, std::optional<core::ShownFlight>* shown);
  bool moveThere(const core::FlightStart& start, const core::Deadline& deadline,
                 std::optional<core::ShownFlight>* shown);
  bool beginThere(const Beginning& wanted, const core::Deadline& deadline, std::optional<core::ShownFlight>* shown);
  /// What went wrong; empty: nothing.
  std::string waitForAirport(const core::AirportStart& start, std::optional<core::ShownFlight>* shown);
  /// Paused or running as the first of both says, which were asked for on the way.
  void endSettings(bool restore);
  PauseOutcome firstPause(const std::string& who);
  std::string pauseAsBefore(PauseOutcome before, PauseOutcome again, const std::string& who);
  std::string waitForMotion(const core::FlightStart& start, std::optional<core::ShownFlight>* shown);
  std::optional<core::ShownFlight> shownFlight();
  /// Sends them until X-Plane shows them; `done` is the text for when it does.
  Outcome applySettings(const std::vector<core::SettingWrite>& settings, const std::string& service,
                        const std::string& done, bool restore);
  /// Presses until X-Plane shows it; returns what it shows instead, empty: it does.
  std::string press(const core::AutopilotStep& step);
  /// Writes into the journal what X-Plane has now; returns what went wrong, empty: nothing.
  std::string remember(const std::vector<core::SettingWrite>& settings);
  PauseOutcome pause(bool paused, const std::string& who);

  /// What went wrong; empty: it is loaded, and X-Plane has shown which it is.
  std::string waitForAircraft(const std::string& path, std::int32_t livery);

  core::Deadline deadlineAfter(double seconds) const { return {link_->clock(), seconds}; }
  /// A stop was asked for, or the deadline is over.
  bool expired(const core::Deadline& deadline) const { return stopping_ || deadline.over(); }
  /// Waits until `condition()` is true, a stop is asked for or so many seconds have passed; returns whether it is.
  bool waitFor(double seconds, const std::function<bool()>& condition);
  /// Waits until the flight is old enough to show when it begins anew, unless it stands still; returns whether it is.
  bool beginningIsVisible();
  void write(const std::vector<core::DatarefWrite>& writes);
  bool isUp() const;
  /// Why X-Plane may not have shown it, for the end of a sentence; empty: no reason is known.
  std::string linkCondition() const { return xplane_bridge::linkCondition(link_->status()); }

  core::SimulatorPort* link_;
  const FlightChangeOptions options_;
  const FlightChangeHooks hooks_;
  std::atomic<bool> stopping_{false};
  std::mutex restores_mutex_;  ///< held while the journal's entry of settings that end with the node is changed
};

}  // namespace xplane_bridge
