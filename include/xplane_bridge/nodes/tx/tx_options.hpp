#pragma once

#include <string>

#include "xplane_bridge/actuation/control_path.hpp"
#include "xplane_bridge/core/surfaces/surface_driver.hpp"
#include "xplane_bridge/core/surfaces/surface_mixing.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"

namespace xplane_bridge {

/// One of config/aircraft/, loaded into tx_node's private namespace under `aircraft`.
struct AircraftOptions {
  double max_roll_deg = 45.0;  ///< [deg] at which an excitation is aborted unless the request says otherwise
  double max_pitch_deg = 20.0;
  core::DriverOptions surfaces;
  double flap_rate = 0.15;       ///< [1/s] of full travel, while surfaces are driven one by one
  double speedbrake_rate = 1.0;  ///< [1/s] of full travel
};

/// config/tx.yaml and the aircraft's file.
struct TxOptions {
  double setting_timeout = 10.0;  ///< [s] until X-Plane must show what was accepted
  double load_timeout = 120.0;    ///< [s] the same where it loads files
  double service_timeout = 2.0;   ///< [s] until X-Plane must have shown what a service asked for
  ControlPathOptions control;
  AircraftOptions aircraft;
  core::MixingRequirements mixing;
};

/// @param aircraft the shared parameter: the name of the aircraft's file
/// @throws ParamError
TxOptions loadTxOptions(const ParamLoader& own, const std::string& aircraft);

}  // namespace xplane_bridge
