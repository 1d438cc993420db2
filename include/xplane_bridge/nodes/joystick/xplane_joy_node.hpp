#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <ros/publisher.h>

#include "xplane_bridge/core/control/simulator_stick.hpp"
#include "xplane_bridge/core/link/subscription.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"

namespace xplane_bridge {

/// The joystick at X-Plane's own computer on `joy`, by the functions that X-Plane's settings give its axes. Publishes
/// at `rate` while X-Plane shows one; changes nothing in X-Plane.
class XplaneJoyNode : public BaseNode {
 protected:
  void loadParameters(const ParamLoader& own) override;
  void advertise() override;
  void start() override;
  void undo(const Deadline& deadline) override;

 private:
  void onSettings(const core::RrefView& datagram, const core::ReceiveInfo& info);
  void onValues(const core::RrefView& datagram, const core::ReceiveInfo& info);
  core::RrefGroup valueGroup() const;
  void report();
  void fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status);

  // Held by the handlers, and by the diagnostics thread.
  const std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();
  core::SimulatorStick::Options options_;
  std::unique_ptr<core::SimulatorStick> stick_;
  core::Subscription settings_;
  core::Subscription values_;
  ros::Publisher publisher_;
  std::uint64_t count_ = 0;
  double heard_ = 0.0;  // [s] steady, of the last message
  std::string reported_;
};

}  // namespace xplane_bridge
