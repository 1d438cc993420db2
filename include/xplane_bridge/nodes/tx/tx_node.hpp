#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <ros/publisher.h>

#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/TrafficCommand.h"
#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/actuation/guardian.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/tx/command_intake.hpp"
#include "xplane_bridge/nodes/tx/heartbeat.hpp"
#include "xplane_bridge/nodes/tx/lockstep_services.hpp"
#include "xplane_bridge/nodes/tx/tx_lockstep.hpp"
#include "xplane_bridge/nodes/tx/tx_options.hpp"
#include "xplane_bridge/nodes/tx/tx_publishers.hpp"
#include "xplane_bridge/nodes/tx/tx_services.hpp"

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
  void tick();
  void startBeating();
  void onLink(const core::LinkStatus& status);
  void onCommand(core::FlightMode from, const ControlCommand& message);
  void onTraffic(const TrafficCommand& message);

  void makeLockstep();
  /// A topic whose messages answer frames, or do not: in lock-step they are carried out at the end of theirs, or some
  /// frames later. `rank` orders the topics of one node.
  enum class Answers { kFrames, kNothing };
  template <class Message>
  void subscribeInFrames(const std::string& topic, std::uint32_t queue_size, Answers answers, int rank,
                         std::function<void(const Message&)> take, Served served = Served::kWhereRead);
  void subscribeAnswers();

  void advertiseServices();
  void advertiseLockstep();
  void advertiseDiagnostics();
  /// A service below the node's name: TxServices::serve(), or another of its methods.
  template <class Service>
  void advertiseOwn(const std::string& service, ServiceThreads* threads = nullptr);
  template <class Service, class Serve>
  void advertiseOwn(const std::string& service, Serve serve, ServiceThreads* threads = nullptr);

  TxOptions options_;
  std::unique_ptr<TxLockstep> lockstep_;
  ros::Publisher frame_mode_publisher_;    // in lock-step
  std::optional<ControlMode> frame_mode_;  // to be published at the frame's end
  ServiceThreads mode_threads_{1};         // a pilot's wish does not wait for what X-Plane has not shown yet
  // lockstep/step waits for frames, which wait for other services. However many wait, run and hold are heard, and end
  // those under way.
  ServiceThreads step_threads_{2};
  ServiceThreads hold_threads_{1};
  TxPublishers publishers_;
  Guardian guardian_;
  Heartbeat heartbeat_;
  Alarm deadline_ = 0;  // of a command that waits
  // From start() on.
  std::unique_ptr<Actuation> actuation_;
  std::unique_ptr<CommandIntake> intake_;
  std::unique_ptr<TxServices> services_;
  std::unique_ptr<LockstepServices> lockstep_services_;
};

}  // namespace xplane_bridge
