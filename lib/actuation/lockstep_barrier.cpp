#include "xplane_bridge/actuation/lockstep_barrier.hpp"

#include <algorithm>

#include "xplane_bridge/core/base/node_name.hpp"

namespace xplane_bridge {
namespace {

using BarrierLock = std::lock_guard<std::mutex>;

constexpr std::size_t kReader = 0;

std::vector<std::string> readerFirst(std::vector<std::string> participants, std::string reader) {
  participants.insert(participants.begin(), std::move(reader));
  return participants;
}

}  // namespace

LockstepBarrier::LockstepBarrier(std::vector<std::string> participants, std::string reader, std::string camera)
    : names_(readerFirst(std::move(participants), std::move(reader))), camera_(std::move(camera)) {}

std::size_t LockstepBarrier::find(const std::string& who) const {
  const auto found =
      std::find_if(names_.begin(), names_.end(), [&who](const std::string& name) { return core::isNamed(who, name); });
  return static_cast<std::size_t>(found - names_.begin());
}

std::size_t LockstepBarrier::rank(const std::string& who) const { return find(who); }

void LockstepBarrier::open(std::uint32_t number, std::int64_t stamp_ns) {
  const BarrierLock lock(mutex_);
  open_ = true;
  number_ = number;
  stamp_ns_ = stamp_ns;
  for_all_ = false;
  answered_.clear();
  const std::set<Early> early = std::exchange(early_, {});
  for (const Early& each : early) {
    if (each.stamp_ns >= stamp_ns) take(each.participant, each.stamp_ns, each.for_all);
  }
}

void LockstepBarrier::take(std::size_t participant, std::int64_t stamp_ns, bool for_all) {
  if (participant == names_.size()) return;
  const bool now = open_ && number_ > 0;
  if (now && stamp_ns == stamp_ns_) {
    answered_.insert(participant);
    for_all_ = for_all_ || for_all;
  } else if (stamp_ns > stamp_ns_ || (!now && stamp_ns == stamp_ns_)) {
    early_.insert({stamp_ns, participant, for_all});
  }
}

void LockstepBarrier::answerFrame0(const std::string& who) {
  const BarrierLock lock(mutex_);
  const std::size_t participant = find(who);
  if (number_ == 0 && participant < names_.size()) answered_.insert(participant);
}

void LockstepBarrier::answer(const std::string& who, std::int64_t stamp_ns) {
  const BarrierLock lock(mutex_);
  take(find(who), stamp_ns, false);
}

void LockstepBarrier::answerForAll(const std::string& reader, std::int64_t stamp_ns) {
  const BarrierLock lock(mutex_);
  take(find(reader), stamp_ns, true);
}

bool LockstepBarrier::readsSimulator(std::size_t participant) const {
  return participant == kReader || core::isNamed(names_[participant], camera_);
}

bool LockstepBarrier::isMissing(std::size_t participant) const {
  const bool spared = number_ == 0 ? !readsSimulator(participant) : for_all_ && participant != kReader;
  return !spared && answered_.count(participant) == 0;
}

bool LockstepBarrier::answeredLocked() const {
  if (!open_) return false;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (isMissing(i)) return false;
  }
  return true;
}

std::vector<std::string> LockstepBarrier::missing() const {
  const BarrierLock lock(mutex_);
  std::vector<std::string> out;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (isMissing(i)) out.push_back(names_[i]);
  }
  return out;
}

bool LockstepBarrier::complete() const {
  const BarrierLock lock(mutex_);
  return granted_ > 0 && answeredLocked();
}

bool LockstepBarrier::holds() const {
  const BarrierLock lock(mutex_);
  return granted_ == 0 && answeredLocked();
}

bool LockstepBarrier::answered() const {
  const BarrierLock lock(mutex_);
  return answeredLocked();
}

void LockstepBarrier::close() {
  const BarrierLock lock(mutex_);
  open_ = false;
  if (granted_ != kEndless && granted_ > 0) --granted_;
}

void LockstepBarrier::step(std::uint64_t frames) {
  const BarrierLock lock(mutex_);
  granted_ = frames;
}

void LockstepBarrier::run() {
  const BarrierLock lock(mutex_);
  granted_ = kEndless;
}

std::uint32_t LockstepBarrier::number() const {
  const BarrierLock lock(mutex_);
  return number_;
}

}  // namespace xplane_bridge
