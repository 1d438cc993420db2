#include "xplane_bridge/nodes/network/immediate_queue.hpp"

#include <algorithm>
#include <thread>

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<std::mutex>;

/// roscpp asks for another attempt while a second thread hands the subscription a latched message.
void serve(const ros::CallbackInterfacePtr& callback) {
  while (callback->call() == ros::CallbackInterface::TryAgain) std::this_thread::yield();
}

}  // namespace

void ImmediateQueue::open() {
  const Lock lock(mutex_);
  for (; !kept_.empty(); kept_.pop_front()) serve(kept_.front().second);
  open_ = true;
}

void ImmediateQueue::addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) {
  const Lock lock(mutex_);
  if (open_) {
    serve(callback);
  } else {
    kept_.emplace_back(owner, callback);
  }
}

void ImmediateQueue::removeByID(std::uint64_t owner) {
  const Lock lock(mutex_);
  const auto is_its = [owner](const auto& each) { return each.first == owner; };
  kept_.erase(std::remove_if(kept_.begin(), kept_.end(), is_its), kept_.end());
}

}  // namespace xplane_bridge
