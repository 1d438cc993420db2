#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <ros/publisher.h>
#include <ros/steady_timer.h>

#include "xplane_bridge/ControlCommand.h"
#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/LockstepStep.h"
#include "xplane_bridge/ModeRequest.h"
#include "xplane_bridge/SetMode.h"
#include "xplane_bridge/SurfaceCommand.h"
#include "xplane_bridge/TrafficCommand.h"
#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/actuation/guardian.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/event_log.hpp"
#include "xplane_bridge/nodes/tx/tx_lockstep.hpp"
#include "xplane_bridge/nodes/tx/tx_options.hpp"

namespace xplane_bridge {

/// Commands into X-Plane, whatever is broken or excited there, and services that change the flight: the topics,
/// services and diagnostics of an Actuation. Topics, services and parameters: README.md, config/tx.yaml.
class TxNode : public BaseNode {
 protected:
  void loadParameters(const ParamLoader& own) override;
  void advertise() override;
  void subscribe() override;
  core::SimLinkCallbacks linkCallbacks() override;
  bool wireIsOrdered() const override { return true; }
  void start() override;
  void stopInputs() override;
  void undo(const Deadline& deadline) override;
  void publishFinalState() override;
  void beginFlight() override;
  void beginFrame(const core::LockstepFrame& frame) override;
  bool frameReady(const core::LockstepFrame& frame) override;
  void closeFrame(const core::LockstepFrame& frame) override;
  void endFrame(const core::LockstepFrame& frame) override;

 private:
  ActuationHooks hooks();
  void tick();
  void startBeating();  // tx_guard.cpp
  void beat();
  void onLink(const core::LinkStatus& status);
  void onEvent(const ActuationEvent& event);
  void onCommand(core::FlightMode from, const ControlCommand& message);
  void onModeRequest(const ModeRequest& message);
  void onSurfaceCommand(const SurfaceCommand& message);
  void onTraffic(const TrafficCommand& message);  // tx_world.cpp

  // Lock-step (tx_lockstep_hooks.cpp).
  void makeLockstep();
  /// Commands on a topic; in lock-step they wait for their frame's end, and `rank` orders the topics.
  template <class Message>
  void subscribeCommands(const std::string& topic, int rank, std::function<void(const Message&)> take);
  /// Requests on a topic, which answer no frame; in lock-step they are carried out some frames later.
  template <class Message>
  void subscribeRequests(const std::string& topic, std::uint32_t queue_size, int rank,
                         std::function<void(const Message&)> take);
  void advertiseLockstep();
  void serveStep(const LockstepStep::Request& request, LockstepStep::Response* response);
  /// The same of a simulator that does not wait for participants.
  void serveFreeStep(const LockstepStep::Request& request, LockstepStep::Response* response);
  /// lockstep/run and lockstep/hold: answers `done`, or what was in the way.
  std::string setRunning(bool running);

  void advertiseServices();
  void advertiseFailureServices();
  void advertiseFlightServices();
  void advertiseDiagnostics();
  void serveSetMode(const SetMode::Request& request, SetMode::Response* response);
  /// A service below the node's name.
  template <class Service, class Serve>
  void advertiseOwn(const std::string& service, Serve serve);
  template <class Service, class Begin>
  void advertiseJob(const std::string& service, Begin begin);
  /// The message of these values, by toMessage().
  template <class Message, class... Values>
  void publishAs(const ros::Publisher& publisher, const Values&... values);

  TxOptions options_;
  std::unique_ptr<TxLockstep> lockstep_;
  ros::Publisher frame_mode_publisher_;    // in lock-step
  std::optional<ControlMode> frame_mode_;  // to be published at the frame's end
  ros::CallbackQueue lockstep_queue_;      // lockstep/step waits for frames, which wait for other services
  std::unique_ptr<ros::AsyncSpinner> lockstep_spinner_;
  EventLog events_;
  Guardian guardian_;
  ros::SteadyTimer heartbeat_;  // also while the node's clock stands
  Alarm deadline_ = 0;          // of a command that waits
  ros::Publisher applied_publisher_;
  ros::Publisher mode_publisher_;
  ros::Publisher failure_publisher_;
  ros::Publisher excitation_publisher_;
  ros::Publisher disturbance_publisher_;
  std::unique_ptr<Actuation> actuation_;  // from start() on
};

template <class Service, class Serve>
void TxNode::advertiseOwn(const std::string& service, Serve serve) {
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  advertiseService<Request, Response>(name() + "/" + service,
                                      [this, serve](const Request& request, Response& response) {
                                        if (lockstep_) lockstep_->waitUntilOpen();
                                        serve(request, &response);
                                      });
}

}  // namespace xplane_bridge
