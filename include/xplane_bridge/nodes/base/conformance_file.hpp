#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "xplane_bridge/core/wire/datagram_source.hpp"

namespace xplane_bridge {

/// What the doctor's card found out of the X-Plane at `peer`, as bits of core::Otherwise. Says in the log what is
/// refuted and what is done about it. A file that is for another version of X-Plane, or cannot be read, is ignored with
/// a warning.
/// @param file parameter conformance_file; empty: the one that the doctor writes into userFolder()
/// @param replays whether the addresses are those of another time, and maybe of another computer
std::uint32_t readConformance(const std::string& file, const core::Endpoint& peer, std::int32_t version, bool replays);

/// Adds the file of this computer's X-Plane under each of the computer's addresses, for a log: a replay does not know
/// which addresses the computer had.
/// @param files of userFolder(), by their names in it
void nameByEachAddress(std::map<std::string, std::filesystem::path>* files);

}  // namespace xplane_bridge
