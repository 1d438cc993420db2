#include "xplane_bridge/nodes/base/common_options.hpp"

#include <algorithm>
#include <cstdint>

#include "xplane_bridge/core/base/node_name.hpp"

namespace xplane_bridge {
namespace {

// X-Plane binds this port itself for sending; a client on the same machine must not listen on it.
constexpr int kXPlaneSendingPort = 49001;

/// Each names a node of its own: an answer counts for one name.
void checkParticipants(const ParamLoader& in, const std::vector<std::string>& names) {
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (core::isNamed("/rx_node", *name) || core::isNamed(*name, "rx_node")) {
      in.refuse("participants", "other nodes than rx_node, which answers every frame without being named");
    }
    const auto same = [&name](const std::string& other) {
      return core::isNamed(*name, other) || core::isNamed(other, *name);
    };
    if (std::any_of(names.begin(), name, same)) {
      in.refuse("participants", "each node once: \"" + *name + "\" is named already");
    }
  }
}

LockstepOptions loadLockstep(const ParamLoader& shared, const CommonOptions& common) {
  const ParamLoader in = shared.section("lockstep");
  LockstepOptions out;
  out.enabled = in.boolean("enabled", out.enabled);
  out.participants = in.textList("participants");
  checkParticipants(in, out.participants);
  out.stick = in.text("stick", out.stick);
  out.hold = in.boolean("hold", out.hold);
  out.watchdog = in.number("watchdog", {1.0, 86400.0}, out.watchdog);
  out.start_time = in.number("start_time", {0.0, 4e9}, out.start_time);
  in.refuseUnknown();
  if (!out.enabled) return out;
  if (common.transport != core::Transport::kRref) {
    shared.refuse("transport", "rref with lockstep/enabled: Data Output has no frames that end");
  }
  if (common.host.empty()) {
    shared.refuse("host", "the simulator's address with lockstep/enabled: beacons come by wall time");
  }
  return out;
}

}  // namespace

std::string loadFrameName(const ParamLoader& in, const std::string& key, const std::string& fallback) {
  std::string frame = in.text(key, fallback);
  if (frame.empty() || frame.front() == '/') {
    in.refuse(key, "a text: a frame name, not empty and without a leading slash");
  }
  return frame;
}

CommonOptions loadCommonOptions(const ParamLoader& shared) {
  CommonOptions options;
  options.host = shared.text("host", options.host);
  options.port = shared.integer("port", {1, 65535}, options.port);
  options.data_port = shared.integer("data_port", {0, 65535}, options.data_port);
  if (options.data_port == kXPlaneSendingPort) {
    shared.refuse("data_port", "another port: X-Plane binds 49001 itself");
  }
  options.transport =
      shared.choice("transport", {"rref", "data"}, "rref") == "data" ? core::Transport::kData : core::Transport::kRref;
  options.aircraft = shared.text("aircraft", options.aircraft);
  if (options.aircraft.empty()) {
    shared.refuse("aircraft", "a text: the stem of a file in config/aircraft, such as fixed_wing");
  }
  FrameNames& frames = options.frames;
  frames.prefix = shared.text("frame_prefix", "");
  if (!frames.prefix.empty() && frames.prefix.front() == '/') {
    shared.refuse("frame_prefix", "a text without a leading slash, such as first/");
  }
  frames.map = frames.prefix + loadFrameName(shared, "map_frame", frames.map);
  frames.map_ned = frames.prefix + loadFrameName(shared, "map_ned_frame", frames.map_ned);
  frames.base_link = frames.prefix + loadFrameName(shared, "base_link_frame", frames.base_link);
  frames.base_link_frd = frames.prefix + loadFrameName(shared, "base_link_frd_frame", frames.base_link_frd);
  // A calibration may find a frame's datagram so long behind its picture (core/camera, kLeastDelay).
  options.display_delay = shared.number("display_delay", {-0.02, 1.0}, options.display_delay);
  options.stale_after = shared.number("stale_after", {0.1, 60.0}, options.stale_after);
  options.lost_after = shared.number("lost_after", {options.stale_after, 3600.0}, options.lost_after);
  options.listen_for_beacon = shared.boolean("listen_for_beacon", options.listen_for_beacon);
  if (options.host.empty() && !options.listen_for_beacon) {
    shared.refuse("listen_for_beacon", "true while `host` is empty: X-Plane is then found by its beacon");
  }
  options.conformance_file = shared.text("conformance_file", options.conformance_file);
  options.beacon_port = shared.integer("beacon_port", {1, 65535}, options.beacon_port);
  options.publish_clock = shared.boolean("publish_clock", options.publish_clock);
  options.wire_log = shared.text("wire_log", options.wire_log);
  options.wire_log_size = shared.integer("wire_log_size", {1, 100'000}, options.wire_log_size);
  options.wire_log_parts = shared.integer("wire_log_parts", {1, 1000}, options.wire_log_parts);
  options.lockstep = loadLockstep(shared, options);
  shared.refuseMisspelt();
  return options;
}

core::SimLinkOptions linkOptions(const CommonOptions& options) {
  core::SimLinkOptions link;
  link.host = options.host;
  link.port = static_cast<std::uint16_t>(options.port);
  link.listen_for_beacon = options.listen_for_beacon;
  link.lockstep = options.lockstep.enabled;
  if (link.lockstep) link.listen_for_beacon = false;
  link.beacon_port = static_cast<std::uint16_t>(options.beacon_port);
  link.stale_after_s = options.stale_after;
  link.lost_after_s = options.lost_after;
  return link;
}

}  // namespace xplane_bridge
