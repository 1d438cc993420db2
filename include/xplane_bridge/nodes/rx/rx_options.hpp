#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/state/frames.hpp"
#include "xplane_bridge/core/state/state_assembler.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"
#include "xplane_bridge/nodes/rx/geoid.hpp"

namespace xplane_bridge {

/// One entry of rx_node's `datarefs` list.
struct DatarefEntry {
  std::vector<std::string> elements;  ///< single datarefs, in the order of their values
  int rate = 10;                      ///< [1/s]
  std::string topic;                  ///< scalar topic below `datarefs/`; empty: none. Only for a single element
};

/// What rx_node alone decides; what all nodes share is in CommonOptions.
struct RxOptions {
  double max_publish_rate = 0.0;  ///< [1/s] of flight_state and what goes with it; 0: every simulator frame
  double wind_rate = 10.0;        ///< [1/s] highest
  int traffic_rate = 10;          ///< [1/s] of traffic/state; 0: there is no such topic
  /// Requests [1/s] by group, index is core::FieldGroup; 0: the group is not asked for. The flight group's is the rate
  /// of flight_state as long as X-Plane renders that fast.
  std::array<int, core::kFieldGroupCount> rates{};
  core::PositionMode position_source = core::PositionMode::kAuto;
  int xpc_port = core::kXpcPort;
  std::optional<core::GeoPoint> origin;  ///< of `map`; empty: the first valid position
  Geoid geoid;                           ///< its undulation is added to NavSatFix altitudes
  /// Also what has no subscriber: in lock-step and with a wire log, so that counts do not depend on that.
  bool publish_unheard = false;
  bool latch_state = false;  ///< a late subscriber gets the newest flight_state; in lock-step
  bool publish_tf = false;   ///< map -> base_link on /tf
  std::vector<DatarefEntry> datarefs;

  static constexpr Range<double> kOriginAltitude{-1000.0, 100000.0};  ///< [m] of an origin

  // transport `data` only
  bool configure_xplane = true;          ///< set rows, rate and target in X-Plane, and restore them
  int data_output_rate = 99;             ///< [1/s] of X-Plane's Data Output while we run
  std::string data_address;              ///< IPv4 address X-Plane shall send to; empty: ours, as X-Plane sees it
  std::int32_t xplane_version = 0;       ///< of an X-Plane that answers nothing, e.g. 115501; 0: unknown
  std::vector<std::int32_t> extra_rows;  ///< rows wanted on `data_rows` beyond those the state needs
};

/// Reads and checks rx_node's private parameters. @throws ParamError
RxOptions loadRxOptions(const ParamLoader& own);

}  // namespace xplane_bridge
