#pragma once

#include <string>

#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"

namespace xplane_bridge {

/// config/tx.yaml, and of config/aircraft/ the file that is loaded into tx_node's private namespace under `aircraft`.
struct TxOptions {
  double hang_timeout = 1.0;  ///< [s] without running until the guardian gives everything back
  ActuationOptions actuation;
};

/// @param aircraft the shared parameter: the name of the aircraft's file
/// @throws ParamError
TxOptions loadTxOptions(const ParamLoader& own, const std::string& aircraft);

}  // namespace xplane_bridge
