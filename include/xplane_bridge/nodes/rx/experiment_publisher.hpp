#pragma once

#include <string>

#include <ros/node_handle.h>

#include "xplane_bridge/Experiment.h"
#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/state/xplane_settings.hpp"
#include "xplane_bridge/nodes/base/common_options.hpp"

namespace xplane_bridge {

/// Publishes `experiment`, the passport of a flight. One thread calls, or the caller locks, except readParameters().
class ExperimentPublisher {
 public:
  /// @param shared what `common` was read from
  ExperimentPublisher(const CommonOptions& common, const ParamLoader& shared)
      : lockstep_(common.lockstep.enabled), shared_(shared) {
    message_.aircraft_file = common.aircraft;
  }

  void advertise(ros::NodeHandle* handle);

  /// All parameters of the namespace, from the parameter server; takes as long as that does. The shared ones are those
  /// that this node goes by: who is started later in the namespace may set others. No valid value: it does not answer.
  XmlRpc::XmlRpcValue readParameters(const ros::NodeHandle& handle) const;
  void setParameters(const XmlRpc::XmlRpcValue& parameters);

  /// Publishes what differs from what was published last.
  void publish(core::SimulatorVersion version, const core::AircraftIdentity& aircraft,
               const core::XPlaneSettings& settings, const ros::Time& stamp);

 private:
  const bool lockstep_;
  const ParamLoader shared_;
  bool changed_ = true;
  Experiment message_;
  ros::Publisher publisher_;
};

}  // namespace xplane_bridge
