#pragma once

#include <string>

#include "xplane_bridge/core/link/sim_link.hpp"
#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"

namespace xplane_bridge {

/// Names of the coordinate frames (`frame_id`) that several nodes use.
struct FrameNames {
  std::string map = "map";                      ///< local map, ENU, on X-Plane's sphere
  std::string map_ned = "map_ned";              ///< the same origin, NED
  std::string base_link = "base_link";          ///< the aircraft, FLU
  std::string base_link_frd = "base_link_frd";  ///< the aircraft, FRD
};

/// What all nodes of one namespace must agree on: read from that namespace (config/common.yaml), never from a node's
/// private one.
struct CommonOptions {
  std::string host;       ///< X-Plane's machine, name or IPv4; empty: found by its beacon
  int port = 49000;       ///< UDP port X-Plane listens on; with an empty host the beacon says it
  int data_port = 49003;  ///< UDP port we receive Data Output rows on; 0: any free one
  core::Transport transport = core::Transport::kRref;  ///< how rx_node gets the flight state
  std::string aircraft = "fixed_wing";                 ///< stem of config/aircraft/<name>.yaml
  FrameNames frames;                                   ///< names of coordinate frames
  double display_delay = 0.0;                          ///< [s] from a simulator frame to its picture on the screen

  double stale_after = 0.4;       ///< [s] silence until the link counts as STALE
  double lost_after = 10.0;       ///< [s] silence until it counts as LOST whatever the beacon says
  bool listen_for_beacon = true;  ///< join X-Plane's multicast announcement; needed with an empty host
  int beacon_port = 49707;        ///< UDP port of the announcement
};

/// Reads and checks the shared parameters. A key of the namespace that looks like a misspelt shared parameter is
/// refused; others (of other programs) are none of our business. @throws ParamError
CommonOptions loadCommonOptions(const ParamLoader& shared);

/// The link to X-Plane as these options want it; nodes add what is theirs (Data Output, RPOS).
core::SimLinkOptions linkOptions(const CommonOptions& options);

}  // namespace xplane_bridge
