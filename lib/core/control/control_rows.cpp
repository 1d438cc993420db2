#include "xplane_bridge/core/control/control_rows.hpp"

#include <algorithm>
#include <cstdlib>

namespace xplane_bridge::core {
namespace {

constexpr std::int32_t kJoystickRow = 8, kFlightControlRow = 11, kTrimRow = 13, kThrottleRow = 25;
const std::string kName = "DATA row ";

}  // namespace

std::vector<RowSlot> rowSlotsOf(Channel channel, const EncoderOptions& options) {
  if (!options.rows) return {};
  // Reverse thrust has a dataref of its own.
  if (isLever(channel) && options.reverse_thrust) return {};
  if (isLever(channel)) return {{kThrottleRow, index(channel) - index(Channel::kLever0)}};
  switch (channel) {
    case Channel::kPitch:
      return {{kJoystickRow, 0}, {kFlightControlRow, 0}};
    case Channel::kRoll:
      return {{kJoystickRow, 1}, {kFlightControlRow, 1}};
    case Channel::kYaw:
      return {{kJoystickRow, 2}, {kFlightControlRow, 2}};
    case Channel::kTrimPitch:
      return {{kTrimRow, 0}};
    case Channel::kTrimRoll:
      return {{kTrimRow, 1}};
    case Channel::kTrimYaw:
      return {{kTrimRow, 2}};
    case Channel::kFlaps:
      return {{kTrimRow, 3}};
    case Channel::kSpeedbrake:
      return {{kTrimRow, 6}};
    default:
      return {};
  }
}

std::vector<DataRow> controlRows(const ChannelValues& values, const ChannelSet& active, const ChannelSet& now,
                                 const EncoderOptions& options) {
  std::vector<DataRow> out;
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    if (!active.test(i)) continue;
    const auto channel = static_cast<Channel>(i);
    for (const RowSlot& at : rowSlotsOf(channel, options)) {
      auto row = std::find_if(out.begin(), out.end(), [&at](const DataRow& each) { return each.index >= at.row; });
      if (row == out.end() || row->index != at.row) {
        row = out.insert(row, DataRow{});
        row->index = at.row;
      }
      if (now.test(i)) row->values[at.slot] = wireValue(channel, values[i]);
    }
  }
  return out;
}

std::string rowName(std::int32_t row) { return kName + std::to_string(row); }

std::optional<std::int32_t> rowOfName(const std::string& name) {
  if (name.compare(0, kName.size(), kName) != 0) return std::nullopt;
  return static_cast<std::int32_t>(std::strtol(name.c_str() + kName.size(), nullptr, 10));
}

}  // namespace xplane_bridge::core
