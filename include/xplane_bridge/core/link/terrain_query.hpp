#pragma once

/// The terrain under any place, asked of NASA's X-Plane Connect plugin.

#include <functional>
#include <optional>
#include <string>

#include "xplane_bridge/core/wire/datagram_source.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

struct TerrainAnswer {
  std::optional<XpcTerrain> terrain;
  std::string problem;  ///< why there is none, in words that say what to do; empty: there is one
};

/// Asks by a port of its own and waits, asking again, for up to `timeout_s` [s] of wall time.
/// @param plugin its address and port on X-Plane's computer
/// @param latitude_deg,longitude_deg the place
/// @param stopping ends the wait
TerrainAnswer askTerrain(const Endpoint& plugin, double latitude_deg, double longitude_deg, double timeout_s,
                         const std::function<bool()>& stopping);

}  // namespace xplane_bridge::core
