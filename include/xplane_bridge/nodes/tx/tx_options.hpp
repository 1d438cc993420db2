#pragma once

#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/surfaces/surface_driver.hpp"
#include "xplane_bridge/core/surfaces/surface_mixing.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"

namespace xplane_bridge {

/// One of config/aircraft/, loaded into tx_node's private namespace under `aircraft`.
struct AircraftOptions {
  std::vector<std::string> identity;  ///< ICAO codes this file is for; empty: any aircraft
  bool reverse_thrust = false;
  double max_roll_deg = 45.0;  ///< [deg] at which an excitation is aborted unless the request says otherwise
  double max_pitch_deg = 20.0;
  core::DriverOptions surfaces;
  double flap_rate = 0.15;       ///< [1/s] of full travel, while surfaces are driven one by one
  double speedbrake_rate = 1.0;  ///< [1/s] of full travel

  /// Whether the file is for the aircraft loaded.
  bool fits(const core::AircraftIdentity& loaded) const;
};

/// config/tx.yaml and the aircraft's file.
struct TxOptions {
  double rate = 50.0;             ///< [Hz] of refreshing
  double max_rate = 200.0;        ///< [Hz] of sending on arrival
  double setting_timeout = 10.0;  ///< [s] until X-Plane must show what was accepted
  double load_timeout = 120.0;    ///< [s] the same where it loads files
  double service_timeout = 2.0;   ///< [s] until X-Plane must have shown what a service asked for
  core::ArbiterOptions arbiter;
  AircraftOptions aircraft;
  core::MixingRequirements mixing;
};

/// @param aircraft the shared parameter: the name of the aircraft's file
/// @throws ParamError
TxOptions loadTxOptions(const ParamLoader& own, const std::string& aircraft);

}  // namespace xplane_bridge
