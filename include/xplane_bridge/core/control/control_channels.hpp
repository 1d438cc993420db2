#pragma once

/// Channels to X-Plane's datarefs: the one place that knows their names (docs/protocol.md 5.1).

#include <string>
#include <vector>

#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/control/control_command.hpp"

namespace xplane_bridge::core {

/// How often a channel has to be written.
enum class Refresh : std::uint8_t {
  kContinuous,  ///< owned through an override, or moved by others as well: sent at every refresh
  kOnChange,    ///< a handle in the cockpit: sent when the command changes, so that it can be moved there in between
};

/// One dataref to write.
struct DatarefWrite {
  std::string dataref;  ///< with [i] for an element
  float value = 0.0f;   ///< in the dataref's own unit
};

/// How one channel reaches X-Plane.
struct ChannelWire {
  const char* write = nullptr;          ///< dataref; engine channels get [engine]
  const char* read_back = nullptr;      ///< dataref that shows the command once X-Plane took it
  const char* override_name = nullptr;  ///< dataref that must be 1 for the write to have an effect; nullptr: none
  Refresh refresh = Refresh::kContinuous;
  double read_back_tolerance = 0.0;  ///< |shown - sent| that counts as shown
};

/// What decides between alternative datarefs.
struct EncoderOptions {
  SimulatorVersion version;
  /// Levers go through the dataref whose negative half is reverse thrust. Without it levers below 0 have no meaning and
  /// the arbiter's limits must keep them at 0 and above.
  bool reverse_thrust = false;
  /// What DATA rows can carry (control_rows.hpp) goes in them; all else, and overrides, as datarefs.
  bool rows = false;
};

/// The wire of a channel.
const ChannelWire& channelWire(Channel channel, const EncoderOptions& options);

/// Dataref of `channel` to write, with [i] where it is an element.
std::string writeDataref(Channel channel, const EncoderOptions& options);
/// Dataref of `channel` to read back, with [i] where it is an element.
std::string readBackDataref(Channel channel, const EncoderOptions& options);

/// Overrides the commanded channels need, each once, in a fixed order; behind them the DATA rows that hold them.
std::vector<std::string> requiredOverrides(const ChannelSet& channels, const EncoderOptions& options);

/// Overrides whose effect is on all surfaces (docs/protocol.md 5.2).
extern const char* const kSurfaceOverride;

/// A throttle for all engines in place of their levers'; -2 gives it back.
extern const char* const kThrottleOverride;

/// The write that gives back what the bridge took: overrides to 0, ENGN_thro_override to -2 (X-Plane 11's own "not
/// overridden"). Anything else is not the bridge's to release: nullopt.
std::optional<DatarefWrite> releaseOf(const std::string& dataref);

/// Turns channel values into writes. Holds the dataref names of one version, so nothing is put together per command.
class ControlEncoder {
 public:
  explicit ControlEncoder(const EncoderOptions& options);

  const EncoderOptions& options() const { return options_; }

  /// Appends one write for each channel of `channels`, in channel order; not of those that rows carry.
  void encode(const ChannelValues& values, const ChannelSet& channels, std::vector<DatarefWrite>& out) const;

  /// True if X-Plane's `shown` is the `sent` value of `channel`.
  bool matches(Channel channel, double sent, double shown) const;

 private:
  EncoderOptions options_;
  std::array<std::string, kChannelCount> names_;
  ChannelSet in_rows_;
};

/// Value as written for a channel: gear becomes 0 or 1 (down from 0.5), everything else is passed on.
float wireValue(Channel channel, double value);

}  // namespace xplane_bridge::core
