#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "xplane_bridge/actuation/flight_changes.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/thread_turns.hpp"

namespace xplane_bridge {

/// Changes of the flight that were accepted and that X-Plane takes its time for: one after the other, on a thread of
/// their own, each ending in an event that says what X-Plane shows.
class FlightJobs {
 public:
  static constexpr std::size_t kMostWaiting = 8;

  /// The outcome of a job, as the event with the number promised. Called without a lock held, from the jobs' thread, or
  /// from that of a request which comes after stop().
  using Report = std::function<void(std::uint32_t number, const FlightChangeOutcome& outcome, const std::string& who)>;

  /// @param turns of the thread; null: it runs as it likes
  FlightJobs(core::SimulatorPort* link, const FlightChangeOptions& options, FlightChangeHooks hooks, Report report,
             std::shared_ptr<core::ThreadTurns> turns = nullptr);
  /// stop()
  ~FlightJobs();
  FlightJobs(const FlightJobs&) = delete;
  FlightJobs& operator=(const FlightJobs&) = delete;

  /// Starts once what came before has ended. `number`: of the event with the outcome; `who` requested it.
  void reset(const core::FlightStart& start, std::uint32_t number, const std::string& who);
  void reset(const core::AirportStart& start, std::uint32_t number, const std::string& who);
  void setWind(const core::UniformWind& wind, std::uint32_t number, const std::string& who);
  /// See FlightChanges.
  void restoreSettings() { changes_.restoreSettings(); }
  void forgetSettings() { changes_.forgetSettings(); }
  void setTime(const core::TimeSetting& time, std::uint32_t number, const std::string& who);
  void setWeather(const core::Weather& weather, std::uint32_t number, const std::string& who);
  void setAutopilot(const core::AutopilotSetting& setting, std::uint32_t number, const std::string& who);
  void setLoading(const core::Loading& loading, std::uint32_t number, const std::string& who);
  void loadAircraft(const std::string& path, std::int32_t livery, std::uint32_t number, const std::string& who);
  void saveSituation(const std::string& path, std::uint32_t number, const std::string& who);
  void loadSituation(const std::string& path, std::uint32_t number, const std::string& who);

  /// One runs or waits.
  bool busy() const;
  /// Too many wait already.
  bool full() const;
  /// Why X-Plane could not be asked for anything now; nullopt: it could.
  std::optional<RequestResult> refusal() const;
  /// The caller of the job that runs, if that places the aircraft or loads files; empty: none does.
  std::string movingCaller() const;
  /// That job has the aircraft on its way to another flight: reset_flight from its beginning, a load from its first
  /// effect, as X-Plane flies on where it has no such file.
  bool placing() const;
  /// The flight began anew, or X-Plane does not answer: a load that runs takes effect.
  void onEffect();
  /// reset_flight runs: X-Plane is paused for it, and let go on at its end.
  bool resets() const;
  /// The one at it ends where it is, X-Plane resumed if it was paused for it; the others are reported as not begun.
  /// Waits for that.
  void stop();

 private:
  struct Job {
    core::EventKind kind;  // of the event where it does not come to its end
    std::uint32_t number;
    std::string who;
    bool moves;
    std::function<FlightChangeOutcome()> run;
  };

  void add(Job job);
  void reportNotBegun(const Job& job);
  void loop();

  core::SimulatorPort* link_;
  FlightChanges changes_;
  Report report_;
  mutable std::mutex mutex_;
  core::ClockCondition wanted_;
  std::deque<Job> jobs_;
  std::string moving_caller_;
  bool running_ = false;
  bool resets_ = false;
  bool took_effect_ = false;  // the one that runs
  core::ThreadSeat seat_;
  std::thread thread_;  // last: it uses all of the others
};

}  // namespace xplane_bridge
