#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/simulator/traffic_motion.hpp"

namespace xplane_bridge {

struct TrafficOptions {
  double rate = 30.0;    ///< [1/s] of poses sent for each aircraft; in lock-step each frame
  double timeout = 2.0;  ///< [s] of simulator time without a command, after which all are given back
  bool vehx = false;     ///< by VEHX [? other-aircraft], else by writing their positions [? other-written]
};

/// Other aircraft that clients place: takes them from X-Plane's own flying, moves them smoothly between commands, and
/// gives them back. Each override is in the journal as all others. Thread-safe.
class TrafficControl {
 public:
  /// `report(text, success)`: what happened, for events and the log.
  using Report = std::function<void(const std::string& text, bool success)>;

  TrafficControl(core::SimulatorPort* link, OverrideManager* overrides, TrafficOptions options, Report report);

  /// traffic/command: the complete list. Returns why it is refused; empty: it is taken. Where an aircraft cannot be
  /// taken, because that cannot be noted in the journal, the others are flown.
  /// @param sim_time [s] now
  std::string command(const std::vector<core::TrafficPose>& poses, double sim_time);
  /// Sends what is due. Often.
  void tick(double sim_time);
  /// Gives all back; reports `why`, where there are any.
  void release(const std::string& why);
  /// Another process has given everything back: none is placed any more.
  void forget();

  /// Placed now.
  std::vector<int> numbers() const;

 private:
  std::string take(const std::vector<core::TrafficPose>& poses, std::vector<int>* taken);
  void follow();
  void send(const core::TrafficPose& pose);

  core::SimulatorPort* link_;
  OverrideManager* overrides_;
  const TrafficOptions options_;
  const Report report_;
  const std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();
  std::map<int, core::TrafficMotion> flown_;
  std::set<int> lost_;         // given back by another client while it was commanded
  double commanded_at_ = 0.0;  // [s] simulator time
  double due_ = -1e9;          // [s] steady
  float latitude_ = 0.0F;      // of the scenery's origin, as X-Plane has sent it last
  float longitude_ = 0.0F;
  bool knows_scenery_ = false;
  core::Subscription scenery_;  // last: it ends first
};

}  // namespace xplane_bridge
