#include "xplane_bridge/core/base/thread_turns.hpp"

#include <algorithm>
#include <utility>

namespace xplane_bridge::core {
namespace {

// NOLINTBEGIN(cppcoreguidelines-avoid-non-const-global-variables)
thread_local ThreadTurns* of_thread = nullptr;
thread_local void* place_of_thread = nullptr;  // of of_thread
std::mutex parked_mutex;                       // nothing else is locked while it is held
std::vector<void*> parked;                     // places whose threads wait with a condition
std::atomic<std::size_t> parked_count{0};
// NOLINTEND(cppcoreguidelines-avoid-non-const-global-variables)

}  // namespace

void ThreadTurns::give() {
  for (bool any = true; any;) {
    any = false;
    for (std::size_t i = 0;; ++i) {
      std::unique_lock<std::mutex> lock(mutex_);
      if (i >= places_.size()) break;
      const std::shared_ptr<Place> place = places_[i];
      const auto gone = [&] { return place->left || runsFreely(*place); };
      changed_.wait(lock, [&] { return place->entered || gone(); });
      if (gone() || !(place->notified.exchange(false) || !place->ready || place->ready())) continue;
      any = true;
      place->has_turn = true;
      changed_.notify_all();
      changed_.wait(lock, [&] { return !place->has_turn || gone(); });
    }
  }
}

void ThreadTurns::free() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    free_ = true;
  }
  changed_.notify_all();
}

bool ThreadTurns::taken() {
  return of_thread != nullptr && !of_thread->runsFreely(*static_cast<const Place*>(place_of_thread));
}

void ThreadTurns::pass(std::function<bool()> ready) {
  if (!taken()) return;
  ThreadTurns& turns = *of_thread;
  Place& place = *static_cast<Place*>(place_of_thread);
  std::unique_lock<std::mutex> lock(turns.mutex_);
  place.ready = std::move(ready);
  place.has_turn = false;
  turns.changed_.notify_all();
  turns.changed_.wait(lock, [&] { return place.has_turn || turns.runsFreely(place); });
}

void ThreadTurns::sleep(const ClockCondition& condition, std::unique_lock<std::mutex>* sleeping,
                        const Deadline* deadline) {
  if (!taken()) return;
  Place* const place = static_cast<Place*>(place_of_thread);
  place->notified = false;
  place->condition = &condition;
  {
    const std::lock_guard<std::mutex> lock(parked_mutex);
    parked.push_back(place);
    parked_count = parked.size();
  }
  sleeping->unlock();
  pass([deadline] { return deadline != nullptr && deadline->over(); });
  {
    const std::lock_guard<std::mutex> lock(parked_mutex);
    parked.erase(std::find(parked.begin(), parked.end(), place));
    parked_count = parked.size();
  }
  sleeping->lock();
}

void ThreadTurns::notify(const ClockCondition& condition) {
  if (parked_count == 0) return;
  const std::lock_guard<std::mutex> lock(parked_mutex);
  for (void* const each : parked) {
    Place* const place = static_cast<Place*>(each);
    if (place->condition == &condition) place->notified = true;
  }
}

ThreadSeat::ThreadSeat(std::shared_ptr<ThreadTurns> turns) : turns_(std::move(turns)) {
  if (!turns_) return;
  place_ = std::make_shared<ThreadTurns::Place>();
  const std::lock_guard<std::mutex> lock(turns_->mutex_);
  turns_->places_.push_back(place_);
}

ThreadSeat::~ThreadSeat() {
  if (!turns_) return;
  {
    const std::lock_guard<std::mutex> lock(turns_->mutex_);
    place_->left = true;
    auto& places = turns_->places_;
    places.erase(std::find(places.begin(), places.end(), place_));
  }
  turns_->changed_.notify_all();
}

void ThreadSeat::enter() {
  if (!turns_) return;
  of_thread = turns_.get();
  place_of_thread = place_.get();
  std::unique_lock<std::mutex> lock(turns_->mutex_);
  place_->entered = true;
  turns_->changed_.notify_all();
  turns_->changed_.wait(lock, [this] { return place_->has_turn || turns_->runsFreely(*place_); });
}

void ThreadSeat::leave() {
  if (!turns_) return;
  of_thread = nullptr;
  place_of_thread = nullptr;
  {
    const std::lock_guard<std::mutex> lock(turns_->mutex_);
    place_->left = true;
    place_->has_turn = false;
  }
  turns_->changed_.notify_all();
}

void ThreadSeat::letEnd() {
  if (!turns_) return;
  if (ThreadTurns::taken()) {
    ThreadTurns::pass([place = place_] { return place->left; });
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(turns_->mutex_);
    place_->own_way = true;
  }
  turns_->changed_.notify_all();
}

void TurnMutex::lock() {
  while (ThreadTurns::taken()) {
    if (mutex_.try_lock()) {
      held_ = true;
      return;
    }
    ThreadTurns::pass([this] { return !held_; });
  }
  mutex_.lock();
  held_ = true;
}

void TurnMutex::unlock() {
  held_ = false;
  mutex_.unlock();
}

}  // namespace xplane_bridge::core
