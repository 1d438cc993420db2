#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"
#include "xplane_bridge/core/simulator/flight_start.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// What the jobs need of their node. Each function is called from the jobs' thread, without a lock held.
struct FlightJobHooks {
  std::function<core::FlightWatch()> watch;  ///< the newest frame
  std::function<unsigned()> resets;          ///< how often the flight was reset until now
  std::function<unsigned()> identities;      ///< how often X-Plane has told its aircraft until now
  std::function<std::string()> aircraft;     ///< the aircraft it told last, in words
  /// Gives everything back and flies nothing until the next call with an empty text; the text says why. Waits until
  /// X-Plane has shown it, or a second.
  std::function<void(const std::string& why)> ground;
  /// `who` is about to pause or resume the flight; empty: it did not come to that.
  std::function<void(const std::string& who)> pausing;
  /// The outcome of a job, as the event with the number promised.
  std::function<void(std::uint32_t number, std::uint8_t kind, const std::string& text, const std::string& who,
                     bool success)>
      report;
};

struct FlightJobOptions {
  double setting_timeout = 10.0;  ///< [s] until X-Plane must show a setting or a placement nearby
  double load_timeout = 120.0;    ///< [s] the same where it loads files
};

/// What tx_node's services have accepted and X-Plane takes its time for: placing the flight, weather, loading,
/// aircraft, situations. One after the other, on a thread of its own, each ending in an event that says what X-Plane
/// shows.
class FlightJobs {
 public:
  static constexpr std::size_t kMostWaiting = 8;

  FlightJobs(core::SimulatorPort* link, const FlightJobOptions& options, FlightJobHooks hooks);
  /// stop()
  ~FlightJobs();
  FlightJobs(const FlightJobs&) = delete;
  FlightJobs& operator=(const FlightJobs&) = delete;

  /// Starts once what came before has ended. `number`: of the event that will tell the outcome; `who` asked for it.
  void reset(const core::FlightStart& start, std::uint32_t number, const std::string& who);
  void setWind(const core::UniformWind& wind, std::uint32_t number, const std::string& who);
  void setLoading(const core::Loading& loading, std::uint32_t number, const std::string& who);
  void loadAircraft(const std::string& path, std::int32_t livery, std::uint32_t number, const std::string& who);
  void saveSituation(const std::string& path, std::uint32_t number, const std::string& who);
  void loadSituation(const std::string& path, std::uint32_t number, const std::string& who);

  /// Too many wait already.
  bool full() const;
  /// Who asked for the job at it, if that places the aircraft or loads files; empty: none does.
  std::string mover() const;
  /// The one at it ends where it is, X-Plane resumed if it was paused for it; the others are dropped. Waits for that.
  void stop();

 private:
  struct Outcome {
    std::uint8_t kind = 0;
    std::string text;
    bool success = false;
  };
  struct Job {
    std::uint32_t number;
    std::string who;
    bool moves;
    std::function<Outcome()> run;
  };

  void add(std::uint32_t number, const std::string& who, bool moves, std::function<Outcome()> run);
  void loop();

  Outcome place(const core::FlightStart& start);
  /// In what the flight differs; empty: it is there.
  std::string placed(const core::FlightStart& start);
  std::optional<core::ShownFlight> shownFlight();
  Outcome blow(const core::UniformWind& wind);
  Outcome load(const core::Loading& loading);
  Outcome change(const std::string& path, std::int32_t livery);
  /// What went wrong; empty: it is loaded, and X-Plane has told which it is.
  std::string changed(const std::string& path, std::int32_t livery);
  Outcome save(const std::string& path);
  Outcome restore(const std::string& path);

  core::Deadline in(double seconds) const { return {link_->clock(), seconds}; }
  /// A stop was asked for, or the deadline is over.
  bool over(const core::Deadline& deadline) const { return stopping_ || deadline.over(); }
  /// Waits until `condition()` is true, a stop is asked for or so many seconds have passed.
  void wait(double seconds, const std::function<bool()>& condition);
  void write(const std::vector<core::DatarefWrite>& writes);
  void pause(bool paused);
  /// Why X-Plane may not have shown it, for the end of a sentence; empty: no reason is known.
  std::string excuse() const;

  core::SimulatorPort* link_;
  FlightJobOptions options_;
  FlightJobHooks hooks_;
  mutable std::mutex mutex_;
  std::condition_variable wanted_;
  std::deque<Job> jobs_;
  std::string mover_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace xplane_bridge
