#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"

namespace xplane_bridge {

/// Single datarefs and commands that a client asks for, each sent at once and, where a dataref shows it, waited
/// for. Thread-safe; all but runCommand() wait, up to the time-out.
class SettingRequests {
 public:
  /// `report(text, who, success)`: what was written, for events and the log.
  using Report = std::function<void(const std::string& text, const std::string& who, bool success)>;

  /// @param timeout [s] until X-Plane must have shown what was asked for
  SettingRequests(core::SimulatorPort* link, OverrideManager* overrides, double timeout, Report report);

  struct Written {
    RequestResult result;
    std::vector<float> values;  ///< as X-Plane shows them afterwards, NaN where it does not answer; empty: not written
  };
  /// Writes `values` to `name` and the elements that follow it. An override set so is given back like the bridge's own;
  /// one that X-Plane does not answer for is not set (in lock-step that is not asked).
  /// @param who asks for it
  Written setDataref(const std::string& name, const std::vector<float>& values, const std::string& who);
  RequestResult runCommand(const std::string& name);

 private:
  std::optional<RequestResult> holdOverrides(const std::vector<core::DatarefWrite>& writes);
  RequestResult writeAndConfirm(const std::vector<core::DatarefWrite>& writes, const std::string& what,
                                const std::string& who);
  void confirmLater(const std::vector<core::DatarefWrite>& writes, const std::string& what, const std::string& who);

  core::SimulatorPort* link_;
  OverrideManager* overrides_;
  double timeout_;
  Report report_;
};

}  // namespace xplane_bridge
