#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/link/sim_link.hpp"
#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"

namespace xplane_bridge {

/// The name of a coordinate frame, without a prefix. @throws ParamError where it is empty or begins with a slash
std::string loadFrameName(const ParamLoader& in, const std::string& key, const std::string& fallback);

/// Names of the coordinate frames (`frame_id`) that several nodes use.
struct FrameNames {
  std::string prefix;                           ///< stands before the names, of those below already
  std::string map = "map";                      ///< local map, ENU, on X-Plane's sphere
  std::string map_ned = "map_ned";              ///< the same origin, NED
  std::string base_link = "base_link";          ///< the aircraft, FLU
  std::string base_link_frd = "base_link_frd";  ///< the aircraft, FRD
};

/// Whole-loop lock-step (docs/experiments/lockstep.md): the section `lockstep` of the shared parameters.
struct LockstepOptions {
  bool enabled = false;
  std::vector<std::string> participants;  ///< nodes that answer every frame; rx_node does so without being named
  std::string stick;                      ///< the one of them that publishes joy; empty: none
  bool hold = false;                      ///< the flight waits for lockstep/run or lockstep/step
  double watchdog = 60.0;                 ///< [s] wall time without a frame until the run ends
  double start_time = 1e9;                ///< [s] since 1970: all stamps at simulated time 0
};

/// Messages that wait at most, in publishers and subscriptions of which none may be lost.
constexpr std::uint32_t kLockstepQueue = 100;
/// std_msgs/Header of a node that has done all it does in the frame of that stamp.
constexpr const char* kLockstepDoneTopic = "lockstep/done";
/// The node whose answer says that a frame's flight_state is published, or that there is none.
constexpr const char* kLockstepReader = "rx_node";
/// The participant that reads the simulator as well. A frame is sent once, so the first one waits until it listens.
constexpr const char* kLockstepCamera = "capture_node";
/// ControlMode as of the end of every frame, so that participants know that they have missed none.
constexpr const char* kLockstepModeTopic = "lockstep/mode";
/// Of lockstep/done: its frame_id where rx_node has published no flight_state in that frame: no participant can answer
/// it.
constexpr const char* kLockstepNoState = "no flight_state";
/// The same of frame 0, whose stamp the first frame that flies may have as well.
constexpr const char* kLockstepFrame0 = "frame 0";
/// Of lockstep/done: its frame_id begins so where a participant has not answered and says what it waits for.
constexpr const char* kLockstepWaits = "waits for ";

/// What all nodes of one namespace must agree on: read from that namespace (config/common.yaml), never from a node's
/// private one.
struct CommonOptions {
  std::string host;       ///< X-Plane's machine, name or IPv4; empty: found by its beacon
  int port = 49000;       ///< UDP port X-Plane listens on; with an empty host the beacon says it
  int data_port = 49003;  ///< UDP port we receive Data Output rows on; 0: any free one
  core::Transport transport = core::Transport::kRref;  ///< how rx_node gets the flight state
  std::string conformance_file;         ///< of the doctor's card; empty: the one it writes for this X-Plane
  std::string aircraft = "fixed_wing";  ///< stem of config/aircraft/<name>.yaml
  FrameNames frames;                    ///< names of coordinate frames
  double display_delay = 0.0;           ///< [s] from a simulator frame to its picture on the screen

  double stale_after = 0.4;       ///< [s] silence until the link counts as STALE
  double lost_after = 10.0;       ///< [s] silence until it counts as LOST whatever the beacon says
  bool listen_for_beacon = true;  ///< join X-Plane's multicast announcement; needed with an empty host
  int beacon_port = 49707;        ///< UDP port of the announcement
  bool publish_clock = false;     ///< stamps are lockstep.start_time + simulator time, on /clock too

  std::string wire_log;  ///< file of the wire log, without the node's name (docs/experiments/wire_log.md); empty: none
  int wire_log_size = 1000;  ///< [MB] of one part of it
  int wire_log_parts = 4;    ///< parts kept; the oldest is deleted for a further one

  LockstepOptions lockstep;
};

/// Reads and checks the shared parameters. A key of the namespace that looks like a misspelt shared parameter is
/// refused; others (of other programs) are none of our business. @throws ParamError
CommonOptions loadCommonOptions(const ParamLoader& shared);

/// The link to X-Plane as these options want it; nodes add what is theirs (Data Output, RPOS).
core::SimLinkOptions linkOptions(const CommonOptions& options);

}  // namespace xplane_bridge
