#include "xplane_bridge/actuation/flight_jobs.hpp"

#include <exception>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr std::int32_t kOldest = 110000;  // X-Plane 11.00: earlier ones have other messages for placing and loading

}  // namespace

FlightJobs::FlightJobs(core::SimulatorPort* link, const FlightChangeOptions& options, FlightChangeHooks hooks,
                       Report report, std::shared_ptr<core::ThreadTurns> turns)
    : link_(link),
      changes_(link, options, std::move(hooks)),
      report_(std::move(report)),
      seat_(std::move(turns)),
      thread_([this] { loop(); }) {}

FlightJobs::~FlightJobs() { stop(); }

void FlightJobs::stop() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    changes_.stop();
  }
  wanted_.notifyAll();
  if (!thread_.joinable()) return;
  seat_.letEnd();
  thread_.join();
}

bool FlightJobs::busy() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return running_ || !jobs_.empty();
}

bool FlightJobs::full() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return changes_.stopping() || jobs_.size() >= kMostWaiting;
}

std::optional<RequestResult> FlightJobs::refusal() const {
  const core::LinkStatus status = link_->status();
  const std::int32_t version = status.version.number;
  if (!status.up() || version == 0) return noLink();
  if (version < kOldest) {
    return RequestResult{core::ResultCode::kNotSupported, "this is X-Plane " + std::to_string(version) +
                                                              ": its messages for this are not known before 11.00"};
  }
  if (full()) {
    return RequestResult{core::ResultCode::kRefused,
                         std::to_string(kMostWaiting) + " requests wait already: wait for their events"};
  }
  return std::nullopt;
}

std::string FlightJobs::movingCaller() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return moving_caller_;
}

bool FlightJobs::placing() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return !moving_caller_.empty() && (resets_ || took_effect_);
}

void FlightJobs::onEffect() {
  std::lock_guard<std::mutex> lock(mutex_);
  took_effect_ = running_;
}

bool FlightJobs::resets() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return resets_;
}

void FlightJobs::add(Job job) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (changes_.stopping()) {
    lock.unlock();
    return reportNotBegun(job);
  }
  jobs_.push_back(std::move(job));
  lock.unlock();
  wanted_.notifyAll();
}

void FlightJobs::reportNotBegun(const Job& job) {
  const std::string service(core::afterLastSlash(job.who));
  report_(job.number, {job.kind, service + ": not begun, tx_node ends", false}, job.who);
}

void FlightJobs::loop() {
  const core::ThreadSeat::Taken turns(&seat_);
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    wanted_.wait(&lock, [this] { return changes_.stopping() || !jobs_.empty(); });
    if (changes_.stopping()) break;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    if (job.moves) moving_caller_ = job.who;
    resets_ = job.kind == core::EventKind::kReset;
    running_ = true;
    lock.unlock();
    FlightChangeOutcome outcome;
    try {
      outcome = job.run();
    } catch (const std::exception& error) {  // the journal's disk
      outcome = {job.kind, job.who + ": " + error.what(), false};
    }
    if (changes_.stopping() && !outcome.success) outcome.text += " (tx_node ends)";
    report_(job.number, outcome, job.who);
    lock.lock();
    moving_caller_.clear();
    resets_ = false;
    took_effect_ = false;
    running_ = false;
  }
  const std::deque<Job> waiting = std::exchange(jobs_, {});  // none is added any more
  lock.unlock();
  for (const Job& job : waiting) reportNotBegun(job);
}

void FlightJobs::reset(const core::FlightStart& start, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kReset, number, who, true, [this, start, who] { return changes_.place(start, who); }});
}

void FlightJobs::reset(const core::AirportStart& start, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kReset, number, who, true, [this, start, who] { return changes_.placeAt(start, who); }});
}

void FlightJobs::setWind(const core::UniformWind& wind, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kSetting, number, who, false, [this, wind] { return changes_.applyWind(wind); }});
}

void FlightJobs::setLoading(const core::Loading& loading, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kSetting, number, who, false, [this, loading] { return changes_.applyLoading(loading); }});
}

void FlightJobs::setTime(const core::TimeSetting& time, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kSetting, number, who, false, [this, time] { return changes_.applyTime(time); }});
}

void FlightJobs::setWeather(const core::Weather& weather, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kSetting, number, who, false, [this, weather] { return changes_.applyWeather(weather); }});
}

void FlightJobs::setAutopilot(const core::AutopilotSetting& setting, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kSetting, number, who, false, [this, setting] { return changes_.applyAutopilot(setting); }});
}

void FlightJobs::loadAircraft(const std::string& path, std::int32_t livery, std::uint32_t number,
                              const std::string& who) {
  add({core::EventKind::kAircraft, number, who, true,
       [this, path, livery] { return changes_.applyAircraft(path, livery); }});
}

void FlightJobs::saveSituation(const std::string& path, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kSituation, number, who, false, [this, path] { return changes_.saveSituation(path); }});
}

void FlightJobs::loadSituation(const std::string& path, std::uint32_t number, const std::string& who) {
  add({core::EventKind::kSituation, number, who, true, [this, path] { return changes_.applySituation(path); }});
}

}  // namespace xplane_bridge
