#include "xplane_bridge/nodes/tx/tx_lockstep.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <tuple>
#include <utility>

#include "xplane_bridge/core/base/node_name.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<std::mutex>;

constexpr double kWatchPeriod = 0.2;  // [s]
constexpr int kRequestWaits = 2;      // [frames]

std::int64_t nanoseconds(const ros::Time& stamp) { return static_cast<std::int64_t>(stamp.toNSec()); }

}  // namespace

class TxLockstep::Flight {
 public:
  bool isHeld() const { return end_ == Held::kHeld; }
  bool isReplaced() const { return end_ == Held::kReplaced; }
  /// The first of its ends stays: who waits for it may wake when the next flight, too, is held.
  void end(Held how) {
    if (!end_) end_ = how;
  }

 private:
  std::optional<Held> end_;
};

TxLockstep::TxLockstep(const LockstepOptions& options, core::Clock host, const ros::Time& start, Action wake,
                       std::function<void(const std::string&)> give_up)
    : options_(options),
      host_(std::move(host)),
      wake_(std::move(wake)),
      give_up_(std::move(give_up)),
      barrier_(options.participants, kLockstepReader, kLockstepCamera),
      stamp_ns_(nanoseconds(start)),
      previous_ns_(stamp_ns_),
      flight_(std::make_shared<Flight>()) {
  if (options.hold) barrier_.step(0);
  barrier_.open(0, stamp_ns_);
  progress();
  watchdog_ = std::thread([this] { watch(); });
}

TxLockstep::~TxLockstep() { stop(); }

void TxLockstep::stop() {
  {
    const Lock lock(mutex_);
    stopped_ = true;
  }
  opened_.notifyAll();
  held_.notifyAll();
  ended_.notifyAll();
  if (watchdog_.joinable()) watchdog_.join();
}

void TxLockstep::takeCommand(const std::string& who, const ros::Time& stamp, int topic, Action carry_out) {
  {
    const Lock lock(mutex_);
    commands_.push_back({barrier_.rank(who), topic, nanoseconds(stamp), std::move(carry_out)});
  }
  barrier_.answer(who, nanoseconds(stamp));
  wakeIfAnswered();
}

void TxLockstep::takeRequest(const std::string& who, const ros::Time& stamp, int topic, Action carry_out) {
  const Lock lock(mutex_);
  requests_.push_back({{barrier_.rank(who), topic, nanoseconds(stamp), std::move(carry_out)}, 0});
}

void TxLockstep::takeDone(const std::string& who, const ros::Time& stamp, const std::string& said) {
  const bool waits = said.rfind(kLockstepWaits, 0) == 0;
  {
    const Lock lock(mutex_);
    if (waits) {
      reasons_[who] = said;
    } else {
      reasons_.erase(who);
    }
  }
  if (waits) return;
  if (said == kLockstepFrame0) {
    barrier_.answerFrame0(who);
  } else if (said == kLockstepNoState) {
    barrier_.answerForAll(who, nanoseconds(stamp));
  } else {
    barrier_.answer(who, nanoseconds(stamp));
  }
  wakeIfAnswered();
}

void TxLockstep::wakeIfAnswered() {
  if (barrier_.answered()) wake_();
}

void TxLockstep::open(const core::LockstepFrame& frame, const ros::Time& stamp) {
  {
    const Lock lock(mutex_);
    previous_ns_ = std::exchange(stamp_ns_, nanoseconds(stamp));
    closed_ = false;
    node_ready_ = false;
  }
  progress();
  barrier_.open(frame.number, nanoseconds(stamp));
}

bool TxLockstep::ready() {
  const bool complete = barrier_.complete();
  bool opened = false, holds = false;
  {
    const Lock lock(mutex_);
    // Frame 0 is never closed: once it is answered, what is asked for is of the first frame.
    const bool handled = !complete || barrier_.number() > 0;
    opened = handled && !handled_;
    handled_ = handled;
    node_ready_ = true;
    holds = barrier_.holds();
    if (holds) flight_->end(Held::kHeld);
  }
  if (opened) opened_.notifyAll();
  if (holds) held_.notifyAll();
  return complete;
}

void TxLockstep::close() {
  std::vector<Command> commands, requests;
  {
    const Lock lock(mutex_);
    const auto due = [this](const Command& command) {
      const bool named = command.rank <= options_.participants.size();  // rx_node is the first
      return !named || command.stamp_ns <= stamp_ns_;
    };
    const auto later = std::stable_partition(commands_.begin(), commands_.end(), due);
    std::move(commands_.begin(), later, std::back_inserter(commands));
    commands_.erase(commands_.begin(), later);
    std::vector<Request> kept;
    for (Request& request : requests_) {
      if (request.frames_waited++ == kRequestWaits || request.what.stamp_ns < previous_ns_) {
        requests.push_back(std::move(request.what));
      } else {
        kept.push_back(std::move(request));
      }
    }
    requests_ = std::move(kept);
    closed_ = true;
    handled_ = false;
  }
  std::stable_sort(commands.begin(), commands.end(), [](const Command& a, const Command& b) {
    return std::tie(a.rank, a.topic) < std::tie(b.rank, b.topic);
  });
  std::stable_sort(requests.begin(), requests.end(), [](const Command& a, const Command& b) {
    return std::tie(a.stamp_ns, a.rank, a.topic) < std::tie(b.stamp_ns, b.rank, b.topic);
  });
  for (const Command& request : requests) request.carry_out();
  for (const Command& command : commands) command.carry_out();
  barrier_.close();
  progress();
}

void TxLockstep::beginFlight() {
  flight_->end(Held::kReplaced);
  flight_ = std::make_shared<Flight>();
}

std::shared_ptr<const TxLockstep::Flight> TxLockstep::step(std::uint32_t frames) {
  std::shared_ptr<const Flight> flight;
  {
    const Lock lock(mutex_);
    if (frames > 0) beginFlight();
    flight = flight_;
    barrier_.step(frames);
  }
  progress();
  held_.notifyAll();
  wake_();
  return flight;
}

void TxLockstep::run() {
  {
    const Lock lock(mutex_);
    beginFlight();
    barrier_.run();
  }
  progress();
  held_.notifyAll();
  wake_();
}

void TxLockstep::waitUntilOpen() {
  std::unique_lock<std::mutex> lock(mutex_);
  opened_.wait(&lock, [this] { return stopped_ || handled_; });
}

TxLockstep::Held TxLockstep::waitUntilHeld(const std::shared_ptr<const Flight>& flight) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto isHeld = [&] { return flight->isHeld() || (flight == flight_ && barrier_.holds()); };
  held_.wait(&lock, [&] { return stopped_ || flight->isReplaced() || isHeld(); });
  if (stopped_) return Held::kStopped;
  return isHeld() ? Held::kHeld : Held::kReplaced;
}

void TxLockstep::progress() {
  const Lock lock(mutex_);
  progress_ns_ = host_.steady_ns();
}

std::string TxLockstep::whatIsMissing() const {
  const std::string frame = "frame " + std::to_string(barrier_.number());
  std::vector<std::string> missing = barrier_.missing();
  for (std::string& each : missing) each += reasonOf(each);
  if (!node_ready_ && !closed_) {
    const bool begins = barrier_.number() == 0;
    missing.emplace_back(begins ? "tx_node itself, which waits for the simulator's answers" : "tx_node itself");
  }
  if (closed_ || missing.empty()) return "the simulator has not gone on from " + frame;
  return frame + " was not answered by " + core::join(missing);
}

std::string TxLockstep::reasonOf(const std::string& participant) const {
  for (const auto& [who, said] : reasons_) {
    if (core::isNamed(who, participant)) return ", which " + said;
  }
  return "";
}

void TxLockstep::watch() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ended_.waitUntil(&lock, core::Deadline(host_, kWatchPeriod), [this] { return stopped_; })) {
    if (barrier_.holds()) progress_ns_ = host_.steady_ns();
    const double silence = core::toSeconds(host_.steady_ns() - progress_ns_);
    if (silence < options_.watchdog) continue;
    progress_ns_ = host_.steady_ns();
    const std::string text = "lock-step ends: for " + std::to_string(std::lround(silence)) + " s " + whatIsMissing();
    lock.unlock();
    give_up_(text);
    lock.lock();
  }
}

}  // namespace xplane_bridge
