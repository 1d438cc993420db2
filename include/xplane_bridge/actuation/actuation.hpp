#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/control_path.hpp"
#include "xplane_bridge/actuation/disturbance/disturbance_manager.hpp"
#include "xplane_bridge/actuation/excitation_manager.hpp"
#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/actuation/flight_jobs.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/release_worker.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/actuation/setting_requests.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/actuation/surface_identification.hpp"
#include "xplane_bridge/actuation/traffic_control.hpp"
#include "xplane_bridge/actuation/view_requests.hpp"
#include "xplane_bridge/core/base/message_constants.hpp"
#include "xplane_bridge/core/base/thread_turns.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"
#include "xplane_bridge/core/state/reset_detector.hpp"

namespace xplane_bridge {

struct ActuationOptions {
  double service_timeout = 2.0;  ///< [s] until X-Plane must have shown what a service asked for
  double max_roll_deg = 45.0;    ///< [deg] at which an excitation is aborted unless the request says otherwise
  double max_pitch_deg = 20.0;
  FlightChangeOptions flight;
  ControlPathOptions control;
  SurfaceControlOptions surfaces;
  TrafficOptions traffic;
  std::shared_ptr<core::ThreadTurns> turns;  ///< of the threads that wait for X-Plane; null: they run as they like
};

/// What happened, for the list of events and the log.
struct ActuationEvent {
  core::EventKind kind = core::EventKind::kSetting;
  std::string text;
  std::string who;                 ///< the node or service that asked for it; empty: X-Plane
  bool success = true;             ///< false: an error
  bool warning = false;            ///< nothing is wrong, but the user should know
  std::uint32_t number = 0;        ///< that was promised for it; 0: none was
  double sim_time = std::nan("");  ///< [s] raw simulator time of the newest frame; NaN before the first
};

/// What an Actuation calls; all must be set. None may wait.
struct ActuationHooks {
  std::function<void(const core::ModeStatus& status, double sim_time)> mode;
  /// Controls were sent, or X-Plane has shown them; the surfaces among them that are driven one by one.
  std::function<void(const AppliedControls& applied, const std::vector<core::SurfaceDeflection>& surfaces)> applied;
  /// A command of control/surfaces was sent, or X-Plane has shown it.
  std::function<void(const SurfaceControl::Echo& echo, core::FlightMode mode,
                     const std::vector<core::SurfaceDeflection>& surfaces)>
      surfaces_applied;
  std::function<void(const FailureSnapshot& snapshot)> failures;
  std::function<void(const ExcitationLabel& label)> excitation;
  std::function<void(const DisturbanceLabel& label)> disturbance;
  std::function<void(const ActuationEvent& event)> event;
  /// For the log.
  std::function<void(const std::string& text)> warn;
  /// For the log: the journal cannot be used; called again and again while that lasts.
  std::function<void(const std::string& text)> journal_problem;
  /// Whether the node is to end: waiting for X-Plane ends, too.
  std::function<bool()> stopping;
};

/// What diagnostics show of the controls.
struct ControlSnapshot {
  core::ModeStatus mode;
  Standing standing = Standing::kNotConnected;
  std::string refusal;                             ///< why nothing is sent; empty: it is
  std::vector<std::string> not_followed;           ///< channels that X-Plane does not show as sent
  std::array<core::SourceStatistics, 2> received;  ///< control/manual, control/auto
  std::vector<std::string> overrides;              ///< set now
  std::string aircraft;                            ///< ICAO code of the one that is loaded
};

/// Everything that changes X-Plane, wired together: the control path, driven surfaces, failures, excitations, flight
/// services, single settings, and the overrides all of these take. Passes on to them what X-Plane shows: frames,
/// resets, aircraft, pauses.
///
/// Threads: commands and tick() come on one thread each, X-Plane's answers on the link's, requests on any; flight jobs
/// and releases have threads of their own. One mutex guards what they share; nothing waits while holding it but for the
/// journal's disk.
class Actuation {
 public:
  /// Sends nothing yet. To be made before the link starts. @throws std::invalid_argument for options out of range
  Actuation(core::SimulatorPort* link, const ActuationOptions& options, ActuationHooks hooks);
  Actuation(const Actuation&) = delete;
  Actuation& operator=(const Actuation&) = delete;

  // What drives it.

  /// Starts the thread that confirms releases.
  void start() { releases_.start(); }
  /// From the link's thread.
  void onLink(const core::LinkStatus& status);
  /// At the refresh rate of the control path or more often, and at its deadline().
  void tick();
  /// The guardian has given everything back because this process hung: nothing is broken, excited, driven or flown
  /// until a mode is asked for.
  void onHang();
  /// What was seen until now was no flight, but frames of a simulator that stands (lock-step): reports all once more.
  void beginFlight();
  /// Ends what moves and what waits; nothing is broken, excited or driven from here on. Waits for jobs.
  void stop();
  /// Gives everything back and waits until X-Plane shows it, up to `timeout` [s]. Returns whether it does; what it does
  /// not stays in the journal.
  bool undo(double timeout);
  /// Publishes mode, failures, excitation and disturbance once more.
  void publish();

  // Requests. `who` asks.

  /// control/surfaces: returns why it is refused; empty: it is taken.
  std::string commandSurfaces(const std::vector<std::string>& names, const std::vector<float>& deflections_deg,
                              std::uint32_t sequence);
  struct Injected {
    RequestResult result;
    std::uint32_t id = 0;  ///< of the excitation that runs, or ran last
  };
  Injected inject(const ExcitationRequest& request, const std::string& who);
  struct Disturbed {
    RequestResult result;
    std::uint32_t id = 0;  ///< of the disturbance that begins, or ran last
  };
  /// @param kind of SetDisturbance.srv: which replaces the one of `spec`, or "stop"
  Disturbed disturb(const std::string& kind, core::DisturbanceSpec spec, const std::string& who);
  struct Identifying {
    RequestResult result;
    std::uint32_t event_number = 0;  ///< of the event with the outcome; 0: refused
  };
  /// @param reserve gives the number of the event; called if it begins
  Identifying identifySurfaces(const IdentificationRequest& request, const std::string& who,
                               const std::function<std::uint32_t()>& reserve);
  /// Pauses X-Plane or lets it go on. Waits.
  RequestResult setPaused(bool paused, const std::string& who);
  ControlPath& path() { return path_; }
  FailureManager& failures() { return failures_; }
  FlightJobs& jobs() { return jobs_; }
  SettingRequests& settings() { return settings_; }
  ViewRequests& views() { return views_; }
  TrafficControl& traffic() { return traffic_; }
  /// Why set_wind and set_weather must not change the weather now; nullopt: they may.
  std::optional<RequestResult> windRefusal();

  // What is.

  const SurfaceControl& surfaces() const { return surfaces_; }
  ControlSnapshot control() const;
  /// X-Plane has shown its version, its time and the aircraft.
  bool knowsFlight() const;
  /// [s] raw simulator time of the newest frame; NaN before the first
  double simTime() const { return sim_time_; }
  /// Frames seen in which simulator time went on, since the start.
  std::uint64_t framesFlown() const { return frames_flown_; }

 private:
  ControlPathHooks pathHooks();
  FlightChangeHooks changeHooks();
  void subscribe();
  void say(core::EventKind kind, const std::string& text, const std::string& who = "", bool success = true);
  /// The same as a hook: (text, who, success).
  std::function<void(const std::string&, const std::string&, bool)> saying(core::EventKind kind);
  void endSignals(const std::string& why);
  IdentificationConditions conditions() const;
  void suspend(const std::string& reason);
  void setPausing(const std::string& who);
  void onWatch(const core::RrefView& view);
  void onSurfaces();
  void onCharacters(const std::function<bool()>& add);
  void onIdentity();
  void askIdentity();
  void onReset(const std::string& how);

  core::SimulatorPort* link_;
  const ActuationOptions options_;
  const ActuationHooks hooks_;
  const std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();

  std::atomic<double> sim_time_{std::nan("")};  // [s] for events of any thread
  std::atomic<std::uint64_t> frames_flown_{0};
  core::LinkStatus link_status_;
  core::AircraftIdentityReader identity_;
  core::FlightWatch watch_;
  std::uint32_t watch_epoch_ = 0;  // of the link, at that frame
  core::ResetDetector reset_detector_;
  unsigned resets_ = 0;   // of the flight, since the start
  std::string pause_by_;  // who has asked for a pause or its end that has not come yet

  OverrideManager overrides_;
  SurfaceControl surfaces_;
  FailureManager failures_;
  ExcitationManager excitation_;          // guarded by mutex_
  SurfaceIdentification identification_;  // guarded by mutex_
  ControlPath path_;
  SettingRequests settings_;
  ViewRequests views_;
  TrafficControl traffic_;
  DisturbanceManager disturbance_;
  ReleaseWorker releases_;
  FlightJobs jobs_;

  // Last: they end first.
  core::Subscription watch_subscription_;
  core::Subscription identity_subscription_;
};

}  // namespace xplane_bridge
