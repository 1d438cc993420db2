#pragma once

/// Channels in the DATA rows that X-Plane takes as commands (the paper's Table 2): 8 joystick and 11 flight controls,
/// both with the stick, 13 trims, flaps and speed brake, 25 levers. A slot holds what it was given until -999 comes.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

struct RowSlot {
  std::int32_t row = 0;
  std::size_t slot = 0;
};

/// Where rows carry a channel; empty: no row does, or X-Plane is to be given datarefs.
std::vector<RowSlot> rowSlotsOf(Channel channel, const EncoderOptions& options);

/// The rows of `active`, by rising number: with the values of those of them that are in `now`, -999 elsewhere.
std::vector<DataRow> controlRows(const ChannelValues& values, const ChannelSet& active, const ChannelSet& now,
                                 const EncoderOptions& options);

/// A row among the overrides that are set: "DATA row 8".
std::string rowName(std::int32_t row);
/// The row of such a name; nullopt: it is none.
std::optional<std::int32_t> rowOfName(const std::string& name);

}  // namespace xplane_bridge::core
