#include "xplane_bridge/nodes/base/node_wire.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace xplane_bridge {
namespace {

// Of the host: the link's thread takes far less, unless it hangs; then the node's stop must not hang, too.
constexpr double kLongestHold = 1.0;     // [s]
constexpr double kLongestReplay = 2.0;   // [s] of what a recording has of a stop
constexpr double kLongestCall = 5.0;     // [s]
constexpr const char* kClose = "close";  // no timer and no input from here on
constexpr const char* kHold = "stop link";

}  // namespace

NodeWire::NodeWire(core::WireClock clock, core::Clock host, bool replays, std::function<void(const std::string&)> ended)
    : clock_(std::move(clock)), host_(std::move(host)), replays_(replays), ended_(std::move(ended)) {
  onInput(kClose, [this](core::ByteView) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
    }
    ended_("the recorded node was stopped here");
  });
  onInput(kHold, [this](core::ByteView) { hold(); });
}

void NodeWire::onInput(const std::string& name, std::function<void(core::ByteView)> act) {
  actions_[name] = std::move(act);
}

void NodeWire::post(const std::string& name, const Bytes& bytes, std::function<void()> act) {
  Bytes all(name.begin(), name.end());
  all.push_back(0);
  all.insert(all.end(), bytes.begin(), bytes.end());
  std::function<void()> wake;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closed_ && name != kHold) return;
    inputs_.push_back({std::move(all), std::move(act)});
    wake = wake_;
  }
  if (wake) wake();
}

bool NodeWire::call(const std::string& name, const Bytes& bytes, std::function<void()> act) {
  const auto done = std::make_shared<bool>(false);
  post(name, bytes, [this, act = std::move(act), done] {
    act();
    const std::lock_guard<std::mutex> lock(mutex_);
    *done = true;
    changed_.notifyAll();
  });
  std::unique_lock<std::mutex> lock(mutex_);
  return changed_.waitUntil(&lock, core::Deadline(host_, kLongestCall), [&] { return *done; });
}

void NodeWire::serve(ClockTimers* timers, std::function<void()> wake) {
  const std::lock_guard<std::mutex> lock(mutex_);
  timers_ = timers;
  timers_->restart();
  wake_ = std::move(wake);
}

void NodeWire::close() {
  if (replays_) return;
  post(kClose, {}, [this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = true;
    changed_.notifyAll();
  });
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.waitUntil(&lock, core::Deadline(host_, kLongestHold), [this] { return closed_; });
  closed_ = true;
}

void NodeWire::holdForStop() {
  if (!replays_) post(kHold, {}, [this] { hold(); });
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.waitUntil(&lock, core::Deadline(host_, replays_ ? kLongestReplay : kLongestHold),
                     [this] { return holds_ || records_ended_; });
}

void NodeWire::hold() {
  std::unique_lock<std::mutex> lock(mutex_);
  holds_ = true;
  released_ = false;
  changed_.notifyAll();
  changed_.waitUntil(&lock, core::Deadline(host_, replays_ ? kLongestReplay : kLongestHold),
                     [this] { return released_; });
}

std::int64_t NodeWire::nextDue() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return closed_ || timers_ == nullptr ? 0 : timers_->next().value_or(0);
}

bool NodeWire::hasInput() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return !inputs_.empty();
}

bool NodeWire::takeInput(Bytes* input) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (inputs_.empty()) return false;
  *input = std::move(inputs_.front().bytes);
  taken_ = std::move(inputs_.front().act);
  inputs_.pop_front();
  return true;
}

void NodeWire::act(core::ByteView input) {
  if (taken_) {
    std::exchange(taken_, nullptr)();
    return;
  }
  const std::uint8_t* const zero = std::find(input.begin(), input.end(), std::uint8_t{0});
  const auto action = actions_.find(std::string(input.begin(), zero));
  if (action == actions_.end() || zero == input.end()) return;
  action->second({zero + 1, static_cast<std::size_t>(input.end() - zero - 1)});
}

void NodeWire::runDue() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closed_ || timers_ == nullptr) return;
  }
  timers_->runDue();
}

void NodeWire::woken() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    released_ = true;
  }
  changed_.notifyAll();
}

void NodeWire::end() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    records_ended_ = true;
    closed_ = true;
  }
  changed_.notifyAll();
  ended_("the recording ends here");
}

}  // namespace xplane_bridge
