#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "xplane_bridge/nodes/base/latest_worker.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"

namespace xplane_bridge {

/// What a press of a button asks of tx_node.
struct JoyFunction {
  enum class Kind : std::uint8_t { kPause, kCommand, kView, kFailure };
  std::string key;  ///< YAML key, for messages
  int button = -1;
  Kind kind = Kind::kPause;
  std::uint8_t view = 0;       ///< SetView's
  std::string name;            ///< of X-Plane's command, or of what a failure breaks
  std::string failure;         ///< its kind
  std::optional<float> value;  ///< of the failure, where it takes one
};

/// `functions` of a joystick's file. @throws ParamError
std::vector<JoyFunction> loadJoyFunctions(const ParamLoader& own);

/// Calls tx_node's services for buttons, one after the other on a thread of its own, as they take their time.
class JoyFunctions {
 public:
  /// `report(text, success)`: what became of a press. Called from the thread.
  using Report = std::function<void(const std::string& text, bool success)>;

  JoyFunctions(std::vector<JoyFunction> functions, Report report);

  /// The button of a function was pressed.
  void press(std::size_t function);
  /// What X-Plane is, for the next press on pause.
  void setPaused(bool paused) { paused_ = paused; }
  void stop() { worker_.stop(); }

 private:
  void carryOut(std::size_t index);
  /// Sentence of what became of it; empty: it is done.
  std::string pause();
  std::string runCommand(const JoyFunction& function);
  std::string setView(const JoyFunction& function);
  std::string toggleFailure(const JoyFunction& function);
  std::string setFailure(const JoyFunction& function);
  template <class Service>
  std::string call(const std::string& service, Service* message);

  ros::NodeHandle handle_;
  const std::vector<JoyFunction> functions_;
  Report report_;
  std::atomic<bool> paused_{false};
  /// By a press, as far as is known, with ServiceResult's code of the answer; of the thread.
  std::map<std::string, std::uint8_t> broken_;
  LatestWorker<std::size_t> worker_;  // last: it uses all of the above
};

}  // namespace xplane_bridge
