#include "xplane_bridge/nodes/base/node_wire.hpp"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <stdexcept>
#include <utility>

namespace xplane_bridge {
namespace {

// Of the host: the link's thread takes far less, unless it hangs; then the node's stop must not hang, too.
constexpr double kLongestClose = 1.0;    // [s]
constexpr const char* kClose = "close";  // no timer and no input from here on

NodeWire::Bytes inputOf(const std::string& name, const NodeWire::Bytes& bytes) {
  NodeWire::Bytes all(name.begin(), name.end());
  all.push_back(0);
  all.insert(all.end(), bytes.begin(), bytes.end());
  return all;
}

}  // namespace

NodeWire::NodeWire(core::WireClock clock, core::Clock host, bool replays, std::function<void(const std::string&)> ended)
    : clock_(std::move(clock)), host_(std::move(host)), replays_(replays), ended_(std::move(ended)) {
  onInput(kClose, [this](core::ByteView) { acceptClose("the recorded node was stopped here"); });
}

NodeWire::~NodeWire() { free(); }

bool NodeWire::closed() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return closed_;
}

void NodeWire::onInput(const std::string& name, std::function<void(core::ByteView)> act) {
  actions_[name] = std::move(act);
}

void NodeWire::post(const std::string& name, const Bytes& bytes, std::function<void()> act) {
  std::function<void()> wake;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closed_) return;
    inputs_.push_back({inputOf(name, bytes), std::move(act)});
    wake = wake_;
  }
  if (wake) wake();
}

void NodeWire::call(const std::string& name, const Bytes& bytes, std::function<void()> act) {
  const auto done = std::make_shared<bool>(false);
  post(name, bytes, [this, act = std::move(act), done] {
    act();
    const std::lock_guard<std::mutex> lock(mutex_);
    *done = true;
    changed_.notifyAll();
  });
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(&lock, [&] { return *done || ends_; });
  if (!*done) throw std::runtime_error("the node ends");
}

std::size_t NodeWire::addWorker() {
  workers_.push_back(std::make_unique<TurnWorker>(turns_));
  return workers_.size() - 1;
}

void NodeWire::work(std::size_t worker, std::function<void()> act) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++working_;
  }
  workers_[worker]->add([this, act = std::move(act)] {
    try {
      act();
    } catch (const std::exception&) {  // callWorker() has kept it; in a replay no caller waits for it
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    --working_;
    changed_.notifyAll();
  });
}

void NodeWire::callWorker(const std::string& name, const Bytes& bytes, std::size_t worker, std::function<void()> act) {
  struct Outcome {
    bool known = false;
    std::exception_ptr error;
  };
  const auto outcome = std::make_shared<Outcome>();
  post(name, bytes, [this, worker, act = std::move(act), outcome] {
    work(worker, [this, act, outcome] {
      std::exception_ptr error;
      try {
        act();
      } catch (const std::exception&) {
        error = std::current_exception();
      }
      const std::lock_guard<std::mutex> lock(mutex_);
      *outcome = {true, error};
      changed_.notifyAll();
    });
  });
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(&lock, [&] { return outcome->known || ends_; });
  if (!outcome->known) throw std::runtime_error("the node ends");
  if (outcome->error) std::rethrow_exception(outcome->error);
}

void NodeWire::poll(const std::string& name, std::function<bool()> asks, std::function<void()> act) {
  onInput(name, [act](core::ByteView) { act(); });
  polls_.push_back({inputOf(name, {}), std::move(asks), std::move(act)});
}

void NodeWire::serve(ClockTimers* timers, std::function<void()> wake) {
  const std::lock_guard<std::mutex> lock(mutex_);
  timers_ = timers;
  timers_->restart();
  wake_ = std::move(wake);
}

void NodeWire::close() {
  if (!replays_) post(kClose, {}, [this] { acceptClose(""); });
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.waitUntil(&lock, core::Deadline(host_, kLongestClose), [this] { return closed_; });
  closed_ = true;
  ends_ = true;
  changed_.notifyAll();
  lock.unlock();
  if (stop_seat_) {
    stop_seat_->enter();
  } else {
    turns_->free();  // the link's thread does not come to it, or there is none
  }
}

/// On the link's thread. It waits for the thread that stops the node when it next gives turns.
void NodeWire::acceptClose(const std::string& why) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (closed_) return;
    closed_ = true;
    stop_seat_ = std::make_unique<core::ThreadSeat>(turns_);
    changed_.notifyAll();
  }
  ended_(why);
}

bool NodeWire::waitForWorkers(double seconds) {
  std::unique_lock<std::mutex> lock(mutex_);
  return changed_.waitUntil(&lock, core::Deadline(clock_.clock(), seconds), [this] { return working_ == 0; });
}

void NodeWire::leaveOnWake() { leaves_on_wake_ = std::this_thread::get_id(); }

void NodeWire::free() {
  turns_->free();
  const std::lock_guard<std::mutex> lock(mutex_);
  closed_ = true;
  ends_ = true;
  changed_.notifyAll();
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
  if (!closed()) {
    const auto found = std::find_if(polls_.begin(), polls_.end(), [](const Poll& each) { return each.asks(); });
    if (found != polls_.end()) {
      *input = found->name;
      taken_ = found->act;
      return true;
    }
  }
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
  bool timers = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    timers = !closed_ && timers_ != nullptr;
  }
  if (timers) timers_->runDue();
  turns_->give();
}

void NodeWire::woken() {
  if (leaves_on_wake_ != std::this_thread::get_id() || !stop_seat_) return;
  leaves_on_wake_ = std::thread::id();
  stop_seat_->leave();
}

void NodeWire::end() { acceptClose("the recording ends here"); }

}  // namespace xplane_bridge
