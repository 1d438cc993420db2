#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include "xplane_bridge/ClearFailures.h"
#include "xplane_bridge/FailureState.h"
#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/SetFailure.h"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/failures/failures.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// What is broken, by the bridge or in the simulator's menu: sets, watches, repairs, labels it (failures/state).
///
/// X-Plane's own failures (rel_*) go through the OverrideManager, so that they are repaired on exit and after a crash;
/// single surfaces that X-Plane cannot break go to SurfaceControl. Thread-safe; only the services wait.
class FailureManager {
 public:
  /// `report(text, who, success)`: what happened, for events and the log.
  using Report = std::function<void(const std::string& text, const std::string& who, bool success)>;

  /// Stamps failures/state and publishes it.
  using Publish = std::function<void(FailureState* message)>;

  /// `timeout` [s]: until X-Plane must show what was asked for.
  FailureManager(core::SimulatorPort* link, OverrideManager* overrides, SurfaceControl* surfaces, double timeout,
                 Publish publish, Report report);

  // What drives it.
  void onLink(const core::LinkStatus& status);
  /// Every frame: triggers.
  void onFrame(const core::FlightWatch& watch);
  /// At least ten times a second; `time` [s] steady.
  void tick(double time);
  /// Nothing is broken any more from here on; what is set is the OverrideManager's to repair.
  void stop();
  /// All that the bridge had broken has been repaired by the OverrideManager.
  void repaired();
  void publish();

  // Services: wait up to the time-out.
  void set(const SetFailure::Request& request, const std::string& who, SetFailure::Response* response);
  void clear(const ClearFailures::Request& request, const std::string& who, ClearFailures::Response* response);

  void fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status) const;

 private:
  /// A failure that came true, until X-Plane has shown it.
  struct Pending {
    core::FailurePlan plan;
    std::string who;
    double since = 0.0;                  // [s] steady
    double sent = 0.0;                   // [s] steady, last
    double confirmed = -1.0;             // [s] steady: the dataref shows it; < 0: not yet
    std::optional<double> expected_deg;  // where X-Plane's own failure must bring the surface
  };

  // All with mutex_ held.
  void carryOut(const core::FailurePlan& plan);
  void useDriver(const Pending& pending);
  bool settled(Pending* pending);
  void watchPending();
  void watchRepairs();
  void undo(const core::FailurePlan& plan);
  void repair(const std::vector<std::string>& datarefs);
  void giveUp(const std::string& name, const std::string& why);
  void end(bool driven_only, const std::string& why);
  void applySurfaces();
  void observe(const std::vector<std::string>& datarefs, const core::RrefView& view);
  void watchOwn();
  void watch(core::Subscription* subscription, core::RrefGroup group);
  void publishLocked();
  std::optional<ServiceResult> add(const core::FailureRequest& request, const std::string& who);
  ServiceResult await(std::unique_lock<core::HandlerMutex>* lock, const std::string& name);

  core::SimulatorPort* link_;
  OverrideManager* overrides_;
  SurfaceControl* surfaces_;
  double timeout_;
  Publish publish_;
  Report report_;

  const std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();
  core::ClockCondition changed_;
  bool stopped_ = false;
  core::LinkStatus link_status_;
  core::SimulatorVersion version_;
  core::FailureRegistry registry_;
  core::FlightConditions now_;
  double tick_time_ = 0.0;     // [s] steady
  double publish_time_ = 0.0;  // [s] steady
  bool dirty_ = true;          // labels changed since they were published
  bool published_driving_ = false;
  std::map<std::string, Pending> pending_;
  std::map<std::string, std::string> asked_by_;   // by name: who asked for it
  std::map<std::string, std::string> not_shown_;  // by name: those X-Plane did not show, and why; for await()
  std::map<std::string, double> undone_;          // [s] steady, by dataref: when it was repaired here
  std::map<std::string, double> repaired_since_;  // [s] steady, by name: ours that X-Plane does not show any more

  std::vector<std::string> menu_datarefs_;
  std::vector<std::string> own_datarefs_;
  // Last: they end first.
  core::Subscription menu_subscription_;
  core::Subscription own_subscription_;
};

}  // namespace xplane_bridge
