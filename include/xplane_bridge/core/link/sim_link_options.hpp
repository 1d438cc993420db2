#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "xplane_bridge/core/link/data_output.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// Where X-Plane is and how long to wait for it. Checked by SimLink's constructor.
struct SimLinkOptions {
  std::string host;                   ///< name or IPv4 address; empty: found by beacon
  std::uint16_t port = kDefaultPort;  ///< X-Plane's listening port; with an empty host the beacon says it
  bool listen_for_beacon = true;
  std::string beacon_group = kBeaconGroup;
  std::uint16_t beacon_port = kBeaconPort;
  double stale_after_s = 0.4;        ///< [s] silence until STALE
  double lost_after_s = 10.0;        ///< [s] silence until LOST whatever the beacon says
  double beacon_timeout_s = 2.5;     ///< [s] without a beacon until it counts as gone
  double beacon_settle_s = 1.2;      ///< [s] waited for a second beacon before the first is chosen
  double probe_period_s = 0.2;       ///< [s] between questions while X-Plane is silent
  std::int32_t status_rate_hz = 20;  ///< of the link's own subscription (version, paused, simulator time)
  /// Subscription requests sent at once. X-Plane takes about 148 in a frame: the flight group of one node (70, and the
  /// link's own status) and a batch of each of two others stay below.
  std::size_t batch_size = 38;
  double batch_frames = 2.0;          ///< X-Plane's frames between batches
  double batch_spacing_s = 0.1;       ///< [s] between batches until X-Plane has said how long a frame is
  bool journal_subscriptions = true;  ///< write subscriptions down, and end those an earlier run of the node has left
  double request_timeout_s = 2.0;     ///< [s] deadline of the link's own read-backs
  std::uint32_t jitter_seed = 1;      ///< retries are spread by up to 20 %
  std::int32_t rpos_rate_hz = 0;      ///< RPOS stream; 0: none
  std::uint16_t xpc_port = 0;         ///< where the X-Plane Connect plugin is asked for the position; 0: not at all
  double xpc_rate_hz = 60.0;          ///< of these questions (each has one answer), up to 1000
  /// xplane_internal_version of an X-Plane that sends Data Output but answers nothing, and whose beacon is not heard
  /// either; 0: unknown.
  std::int32_t unheard_version = 0;
  /// In what this X-Plane is otherwise than others of its version, see SimulatorVersion; asked once its number is
  /// known.
  std::function<std::uint32_t(const Endpoint& peer, std::int32_t number)> otherwise;
  bool lockstep = false;  ///< under a LockstepHub: its state is looked at in every frame
  DataOutputOptions data_output;
};

/// Returns the options. Throws std::invalid_argument with the name, the value and what was expected. `has_journals`:
/// what is changed in X-Plane can be written down.
SimLinkOptions checked(SimLinkOptions options, bool has_journals);
/// Throws std::invalid_argument for rows that Data Output does not have.
void requireRows(const std::vector<std::int32_t>& rows);
/// Throws std::invalid_argument unless `low` <= `value` <= `high`.
void requireRange(const char* name, double value, double low, double high);

}  // namespace xplane_bridge::core
