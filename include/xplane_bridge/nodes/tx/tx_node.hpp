#pragma once

#include <atomic>
#include <deque>
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
#include "xplane_bridge/actuation/excitation_manager.hpp"
#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/actuation/flight_jobs.hpp"
#include "xplane_bridge/actuation/guardian.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"
#include "xplane_bridge/core/state/reset_detector.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/event_log.hpp"
#include "xplane_bridge/nodes/tx/tx_options.hpp"

namespace xplane_bridge {

/// Commands into X-Plane: arbitrates control/manual and control/auto, sends what is flown, holds the overrides that
/// needs and gives them back, whatever happens. Topics, services and parameters: README.md, config/tx.yaml.
///
/// Threads: commands and the refresh timer come on the subscription thread, X-Plane's answers on the link's, services
/// on their own, waiting for releases on the worker's. mutex_ guards everything they share; nothing waits while holding
/// it except for the journal's disk.
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
  /// What was sent at one moment, until X-Plane shows it.
  struct Sent {
    AppliedCommand message;
    core::ChannelValues values{};
    core::ChannelSet channels;
    double sim_time = std::nan("");  // [s] known at sending
    double time = 0.0;               // [s] steady
  };

  double now() const;  // [s] steady

  // Control path.
  void onCommand(core::FlightMode from, const ControlCommand& message);
  void onModeRequest(const ModeRequest& message);
  void onModeChange();
  void onSurfaceCommand(const SurfaceCommand& message);
  void onTimer();
  void sendControls(double time);
  bool fly(const core::ArbitratedControls& controls, double time);
  std::string refusalToFly() const;
  core::ChannelSet channelsToSend(const core::ArbitratedControls& controls, double time);
  void publishMode();
  void publishApplied(const core::ArbitratedControls& controls, double time);
  void watchReadBack(const core::ChannelSet& channels);
  void startAfresh(double time);

  // Link.
  void onLinkState(const core::LinkStatus& status);
  void subscribeToXPlane();
  void onWatch(const core::RrefView& view);
  void onReadBack(const core::RrefView& view);
  void onIdentity();
  void askIdentity();
  void onReset(const std::string& how);
  void watchReleases(double time);
  void work();

  // Single surfaces and failures (tx_node_surfaces.cpp).
  void makeSurfaceControl();
  void setCommandedStick(const core::ArbitratedControls* sent);
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
  void ground(const std::string& why);
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
  std::unique_ptr<core::ControlArbiter> arbiter_;
  std::unique_ptr<core::ControlEncoder> encoder_;
  core::LinkStatus link_status_;
  core::AircraftIdentityReader identity_;
  core::FlightWatch watch_;
  core::ResetDetector reset_detector_;
  unsigned resets_ = 0;         // of the flight, since the start
  std::string grounded_;        // why nothing is flown for a while; empty: it is
  std::string released_;        // what somebody else has released, and what to do; empty: nothing
  std::string pause_by_;        // who has asked for a pause or its end that has not come yet
  bool came_back_ = false;      // the link came up anew: commands from before count only if somebody still flies
  double last_command_ = -1e9;  // [s] steady, of any source
  double last_send_ = -1e9;     // [s] steady
  double last_refresh_ = -1e9;  // [s] steady, of the overrides
  bool send_pending_ = false;
  std::optional<std::uint32_t> published_revision_;
  core::ChannelValues last_values_{};                     // of kOnChange channels
  std::array<double, core::kChannelCount> changed_at_{};  // [s] steady; of kOnChange channels
  core::ChannelSet ever_sent_;
  std::vector<core::DatarefWrite> writes_;
  std::deque<Sent> unseen_;  // oldest first
  core::ChannelSet read_back_channels_;
  std::vector<core::Channel> read_back_order_;
  core::ChannelValues shown_{};
  core::ChannelSet shown_known_;
  double last_seen_ = -1e9;  // [s] steady: X-Plane last showed what was sent
  std::string refusal_said_;

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
  core::Subscription read_back_subscription_;
};

}  // namespace xplane_bridge
