#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/simulator/disturbance.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// As DisturbanceState.msg.
struct DisturbanceLabel {
  double sim_time = std::nan("");  ///< [s] of the last frame
  bool active = false;
  std::uint32_t id = 0;
  std::optional<core::DisturbanceSpec> spec;  ///< none before the first
  // Velocity of the air, NED [m/s].
  Eigen::Vector3d steady = Eigen::Vector3d::Zero();     ///< that it found and adds to
  Eigen::Vector3d model = Eigen::Vector3d::Zero();      ///< that its model adds
  Eigen::Vector3d commanded = Eigen::Vector3d::Zero();  ///< of that, what X-Plane is sent
  double wind_speed = 0.0;                              ///< [m/s] sent: steady and commanded
  double wind_from_deg = 0.0;                           ///< true, where it comes from
  double start_sim_time = std::nan("");                 ///< [s]
  double end_sim_time = std::nan("");                   ///< [s]
  std::string result;
};

/// One disturbance at a time: asks X-Plane for its weather, notes that in the journal, writes the wind in each frame of
/// flight, and puts the weather back when it ends, by whatever way: twice, a second apart, as X-Plane confirms nothing.
/// What another process has put back, which the journal shows, is put back once more only where frames have changed it
/// since. Thread-safe; waits for nothing but the journal's disk.
class DisturbanceManager {
 public:
  using Publish = std::function<void(const DisturbanceLabel& label)>;
  /// `report(text, who, success)`: what happened, for events and the log; `who` asked for the disturbance.
  using Report = std::function<void(const std::string& text, const std::string& who, bool success)>;

  /// @param purpose of the entry in the journal, see core::JournalEntry
  DisturbanceManager(core::SimulatorPort* link, std::string purpose, Publish publish, Report report);

  /// For what core::check() and core::refusalBy() let pass, while X-Plane is up. Returns why it is refused; empty: it
  /// begins once X-Plane has shown its weather, or is reported as failed.
  std::string begin(const core::DisturbanceSpec& spec, const std::string& who);
  /// In each frame.
  void onFrame(const core::FlightWatch& watch);
  void onLink(const core::LinkStatus& status);
  /// X-Plane is another one, whose weather is its own user's: ends the one that runs, and nothing of the last one's
  /// comes back. To be called before onFrame().
  void forget();
  /// Ends the one that runs, as aborted, and puts the weather back. Returns whether one ran.
  bool abort(const std::string& why);
  /// This process has hung, and its guardian may have put the weather back: to be called as soon as that is known.
  void onHang();
  /// abort() for good: none begins any more, and the weather is put back at once.
  void stop(const std::string& why);
  /// Called now and then, without a lock held: ends the one that runs when another process has put the weather back,
  /// which the journal shows; puts the weather back a second time.
  void watch();

  /// Why the weather cannot be set now; empty: it can, and nothing is put back over it any more.
  std::string windRefusal();
  DisturbanceLabel label() const;
  void publish() const;

 private:
  enum class State : std::uint8_t { kIdle, kAsking, kRunning };

  // All with mutex_ held.
  void onWeather(std::uint32_t id, const std::vector<std::string>& names,
                 const std::vector<core::DatarefValue>& values);
  void send(const Eigen::Vector3d& wind_ned);
  bool isQuiet() const;
  bool isPutBackByAnother() const;
  void putBack();
  enum class PutBack : std::uint8_t { kNow, kLater };
  void end(const std::string& result, bool success, PutBack when = PutBack::kNow);
  void endAsPutBack();

  core::SimulatorPort* link_;
  const std::string purpose_;
  const Publish publish_;
  const Report report_;
  mutable core::HandlerMutex mutex_;
  State state_ = State::kIdle;
  bool up_ = false;
  std::uint32_t epoch_ = 0;
  core::SimulatorVersion version_;
  std::string who_;
  DisturbanceLabel label_;
  std::optional<core::Disturbance> disturbance_;
  std::vector<core::UndoOperation> restores_;  // what is still to be put back
  bool unsure_ = false;                        // whether this X-Plane is theirs: its next frame shows it
  unsigned sent_frames_ = 0;                   // of this disturbance
  unsigned noted_frames_ = 0;                  // of these, sent before the journal was seen to have its entry
  double framed_at_ = 0.0;                     // [s] steady, last
  int times_put_back_ = 0;
  double put_back_again_at_ = 0.0;  // [s] steady
  bool ended_ = false;
  std::vector<core::DatarefWrite> sent_;
  double send_all_at_ = 0.0;  // [s] steady
  double looked_at_ = 0.0;    // [s] steady, at the journal
};

}  // namespace xplane_bridge
