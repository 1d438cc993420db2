#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <ros/publisher.h>
#include <std_srvs/SetBool.h>

#include "xplane_bridge/AppliedCommand.h"
#include "xplane_bridge/ClearFailures.h"
#include "xplane_bridge/ControlCommand.h"
#include "xplane_bridge/ExcitationState.h"
#include "xplane_bridge/FailureState.h"
#include "xplane_bridge/InjectExcitation.h"
#include "xplane_bridge/LoadAircraft.h"
#include "xplane_bridge/ModeRequest.h"
#include "xplane_bridge/ResetFlight.h"
#include "xplane_bridge/RunCommand.h"
#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/SetDataref.h"
#include "xplane_bridge/SetFailure.h"
#include "xplane_bridge/SetLoading.h"
#include "xplane_bridge/SetMode.h"
#include "xplane_bridge/SetView.h"
#include "xplane_bridge/SetWind.h"
#include "xplane_bridge/Situation.h"
#include "xplane_bridge/SurfaceCommand.h"
#include "xplane_bridge/actuation/control_path.hpp"
#include "xplane_bridge/actuation/excitation_manager.hpp"
#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/actuation/flight_jobs.hpp"
#include "xplane_bridge/actuation/guardian.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"
#include "xplane_bridge/core/state/reset_detector.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/event_log.hpp"
#include "xplane_bridge/nodes/tx/tx_options.hpp"

namespace xplane_bridge {

/// Commands into X-Plane, whatever is broken or excited there, and services that change the flight: topics, services
/// and diagnostics of the classes of actuation/. Topics, services and parameters: README.md, config/tx.yaml.
///
/// Threads: commands and timers come on the subscription thread, X-Plane's answers on the link's, services on their
/// own, waiting for releases on the worker's. mutex_ guards everything they share; nothing waits while holding it
/// except for the journal's disk.
class TxNode : public BaseNode {
 protected:
  void loadParameters(const ParamLoader& own) override;
  void advertise() override;
  void subscribe() override;
  core::SimLinkCallbacks linkCallbacks() override;
  void start() override;
  void stopInputs() override;
  void undo(const Deadline& deadline) override;
  void publishFinalState() override;
  void joinThreads() override;

 private:
  // Control path.
  void makeControlPath();
  void onCommand(core::FlightMode from, const ControlCommand& message);
  core::RequestOutcome onModeRequest(const ModeRequest& message);
  void onSurfaceCommand(const SurfaceCommand& message);
  void onTimer();
  void publishMode(const core::ModeStatus& status, double sim_time);
  void publishApplied(const AppliedControls& applied);

  // Link.
  void onLinkState(const core::LinkStatus& status);
  void subscribeToXPlane();
  void onWatch(const core::RrefView& view);
  void onIdentity();
  void askIdentity();
  void onReset(const std::string& how);
  void work();

  // Single surfaces and failures (tx_node_surfaces.cpp).
  void makeSurfaceControl();
  void publishSurfacesApplied();
  template <class Message>
  void publishStamped(const ros::Publisher& publisher, Message* message) {
    message->header.stamp = stampNow();
    publisher.publish(*message);
  }
  void advertiseFailureServices();
  void serveInjectExcitation(const InjectExcitation::Request& request, InjectExcitation::Response* response);

  // Flight services: accepted, then told on `events` (tx_node_flight.cpp).
  void makeFlightJobs();
  void advertiseFlightServices();
  void suspendControl(const std::string& reason);
  /// Why a flight service is not accepted; `wrong`: what the request itself says. nullopt: it is.
  std::optional<ServiceResult> refusalOfJob(const std::optional<std::string>& wrong) const;
  /// Answers a flight service: refused, or accepted and begun with `begin(number of the event, who)`.
  template <class Response>
  void serveJob(const std::string& service, const std::optional<std::string>& wrong, Response* response,
                const std::function<void(std::uint32_t, const std::string&)>& begin);

  // Services (tx_node_services.cpp).
  void advertiseServices();
  void serveSetMode(const SetMode::Request& request, SetMode::Response* response);
  void serveSetDataref(const SetDataref::Request& request, SetDataref::Response* response);
  void serveRunCommand(const RunCommand::Request& request, RunCommand::Response* response);
  void servePause(bool pause, std_srvs::SetBool::Response* response);
  void serveSetView(const SetView::Request& request, SetView::Response* response);
  /// Writes datarefs and waits until X-Plane shows them.
  ServiceResult writeAndConfirm(const std::vector<core::DatarefWrite>& writes);
  bool linkIsUp() const;
  std::uint32_t logEvent(std::uint8_t kind, const std::string& text, const std::string& who = "", bool success = true,
                         std::uint32_t number = 0);
  void fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status);

  TxOptions options_;
  EventLog events_;
  std::atomic<double> sim_time_{std::nan("")};  // [s] raw simulator time, for events of any thread
  Guardian guardian_;
  std::unique_ptr<OverrideManager> overrides_;
  std::unique_ptr<SurfaceControl> surfaces_;
  std::unique_ptr<FailureManager> failures_;
  std::unique_ptr<ExcitationManager> excitation_;  // guarded by mutex_
  std::unique_ptr<FlightJobs> jobs_;

  const std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();
  std::unique_ptr<ControlPath> path_;
  core::LinkStatus link_status_;
  core::AircraftIdentityReader identity_;
  core::FlightWatch watch_;
  core::ResetDetector reset_detector_;
  unsigned resets_ = 0;   // of the flight, since the start
  std::string pause_by_;  // who has asked for a pause or its end that has not come yet
  Alarm deadline_ = 0;    // of a command that waits

  ros::Publisher applied_publisher_;
  ros::Publisher mode_publisher_;
  ros::Publisher failure_publisher_;
  ros::Publisher excitation_publisher_;

  std::thread worker_;
  core::ClockCondition work_wanted_;
  bool work_now_ = false;  // without waiting for the end of the period
  bool worker_ends_ = false;
  std::uint32_t leftovers_of_epoch_ = 0;  // link epoch whose leftovers were released

  // Last: they end first.
  core::Subscription watch_subscription_;
  core::Subscription identity_subscription_;
};

}  // namespace xplane_bridge
