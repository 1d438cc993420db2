#pragma once

#include <cstdint>
#include <string>

#include "xplane_bridge/core/wire/datagram_source.hpp"

namespace xplane_bridge {

/// What the doctor's card found out of the X-Plane at `peer`, as bits of core::Otherwise. Says in the log what is
/// refuted and what is done about it. A file that is for another version of X-Plane, or cannot be read, is ignored with
/// a warning.
/// @param file parameter conformance_file; empty: the one that the doctor writes into userFolder()
std::uint32_t readConformance(const std::string& file, const core::Endpoint& peer, std::int32_t version);

}  // namespace xplane_bridge
