#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/failures/failures.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// As FailureState.msg.
struct FailureSnapshot {
  double sim_time = std::nan("");  ///< [s] of the newest frame
  std::vector<core::FailureLabel> labels;
  bool surrogate_mixing = false;  ///< the surfaces are driven to express a failure
  double surrogate_lag_frames = std::nan("");
};

/// What is broken, by the bridge or in the simulator's menu: sets, watches, repairs and labels it.
///
/// X-Plane's own failures (rel_*) go through the OverrideManager, so that they are repaired on exit and after a crash;
/// single surfaces that X-Plane cannot break go to SurfaceControl. Goes by the link's clock. Thread-safe; only set()
/// and clear() wait.
class FailureManager {
 public:
  /// `report(text, who, success)`: what happened, for events and the log.
  using Report = std::function<void(const std::string& text, const std::string& who, bool success)>;

  using Publish = std::function<void(const FailureSnapshot& snapshot)>;

  /// `timeout` [s]: until X-Plane must show what was asked for. `publish` is called from tick(): on every change and
  /// once a second.
  FailureManager(core::SimulatorPort* link, OverrideManager* overrides, SurfaceControl* surfaces, double timeout,
                 Publish publish, Report report);

  // What drives it.
  void onLink(const core::LinkStatus& status);
  /// Every frame: triggers. `placing`: the aircraft is on its way to another flight, whose heights and speeds are not
  /// flown; those of a pause and of a replay are not either.
  void onFrame(const core::FlightWatch& watch, bool placing);
  /// The next frame is of another X-Plane, or of another flight after a gap: all end, armed ones too.
  void onRestart();
  /// At least ten times a second.
  void tick();
  /// Nothing is broken any more from here on; what is set is the OverrideManager's to repair.
  void stop();
  /// All that the bridge had broken has been repaired by the OverrideManager, because of what `why` says: all end,
  /// armed ones too.
  void repaired(const std::string& why);
  /// Publishes the snapshot once more.
  void publish();

  // Requests: wait up to the time-out. `who` asked for it.

  /// Breaks something: at once, which is waited for, or when its trigger comes.
  RequestResult set(const core::FailureRequest& request, const std::string& who);
  struct ClearResult {
    RequestResult result;
    std::vector<std::string> cleared;  ///< names that were broken or armed and are not any more
  };
  /// Repairs `names`; all of the bridge's where there are none. With `include_simulator` also what was set in X-Plane's
  /// menu.
  ClearResult clear(const std::vector<std::string>& names, bool include_simulator, const std::string& who);

  FailureSnapshot snapshot() const;
  /// What is broken of the controls, and what repairs it, in words; empty: nothing.
  std::string brokenControls() const;

 private:
  /// A failure that came true, until X-Plane has shown it.
  struct Pending {
    core::FailurePlan plan;
    std::string who;
    double since = 0.0;                  // [s] steady; when X-Plane was first asked for it
    double sent = 0.0;                   // [s] steady, last
    double confirmed = -1.0;             // [s] steady: the dataref shows it; < 0: not yet
    int frames_shown = 0;                // of simulator time since then
    std::optional<double> expected_deg;  // where X-Plane's own failure must bring the surface
  };

  /// X-Plane's own failure of a surface, which stood where it says; kept as long as it lasts.
  struct Obeyed {
    Pending failure;    // expected_deg: where it stood
    double last = 0.0;  // [s] steady: the surface was there
  };

  static constexpr double kBehaviourWait = 1.0;  // [s] in which X-Plane's own failure must move the surface as it says

  static std::string described(const core::FailurePlan& plan);
  double now() const;

  // All with mutex_ held.
  void countFrame();
  void carryOut(const core::FailurePlan& plan);
  void useDriver(const Pending& pending);
  bool staysXPlanes(const Pending& pending);
  bool settled(Pending* pending);
  void watchPending();
  void watchObeyed();
  void watchRepairs();
  void undo(const core::FailurePlan& plan);
  void repair(const std::vector<std::string>& datarefs);
  void giveUp(const std::string& name, const std::string& why);
  void end(bool driven_only, const std::string& why);
  void applySurfaces();
  bool disturbs(const core::FailureLabel& label) const;
  void observe(const std::vector<std::string>& datarefs, const core::RrefView& view);
  void watchOwn();
  void watch(core::Subscription* subscription, core::RrefGroup group);
  FailureSnapshot snapshotLocked() const;
  void publishLocked();
  std::optional<RequestResult> add(const core::FailureRequest& request, const std::string& who);
  bool gone() const;
  std::string alsoBroken(const core::FailurePlan& plan) const;

  // All without it.
  std::optional<RequestResult> unanswered(const core::FailurePlan& plan);
  RequestResult await(const core::FailurePlan& plan);
  RequestResult awaitRepair(const std::vector<std::string>& datarefs, bool given_back);

  core::SimulatorPort* link_;
  OverrideManager* overrides_;
  SurfaceControl* surfaces_;
  double timeout_;
  Publish publish_;
  Report report_;

  const std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();
  bool stopped_ = false;
  core::LinkStatus link_status_;
  core::SimulatorVersion version_;
  core::FailureRegistry registry_;
  core::FlightConditions flight_;
  bool replay_ = false;
  double publish_time_ = -1e9;  // [s] steady
  bool dirty_ = true;           // labels changed since they were published
  bool published_driving_ = false;
  std::map<std::string, Pending> pending_;
  std::map<std::string, Obeyed> obeyed_;
  std::map<std::string, std::string> asked_by_;   // by name: who asked for it
  std::map<std::string, std::string> not_shown_;  // by name: those that ended, or do not act, and why; for await()
  std::map<std::string, double> undone_;          // [s] steady, by dataref: when it was repaired here
  std::map<std::string, double> repaired_since_;  // [s] steady, by name: ours that X-Plane does not show any more

  std::vector<std::string> menu_datarefs_;
  std::vector<std::string> own_datarefs_;
  // Last: they end first.
  core::Subscription menu_subscription_;
  core::Subscription own_subscription_;
};

}  // namespace xplane_bridge
