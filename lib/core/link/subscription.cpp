#include "xplane_bridge/core/link/subscription.hpp"

#include <stdexcept>
#include <utility>

namespace xplane_bridge::core {

RrefDelivery::RrefDelivery(RrefHandler handler, std::shared_ptr<HandlerMutex> mutex)
    : handler_(std::move(handler)), mutex_(mutex ? std::move(mutex) : std::make_shared<HandlerMutex>()) {
  if (!handler_) {
    throw std::invalid_argument("a subscription needs a handler for its datagrams");
  }
}

void RrefDelivery::deliver(std::uint32_t list, const RrefView& view, const ReceiveInfo& info) {
  const std::lock_guard<HandlerMutex> lock(*mutex_);
  if (list == list_) {
    handler_(view, info);
  }
}

Subscription::Subscription(std::shared_ptr<RrefDelivery> delivery, Change change, RrefGroup group)
    : delivery_(std::move(delivery)), change_(std::move(change)) {
  replace(std::move(group));
}

Subscription::Subscription(Subscription&& other) noexcept
    : delivery_(std::move(other.delivery_)),
      change_(std::exchange(other.change_, nullptr)),
      last_list_(other.last_list_) {}

Subscription& Subscription::operator=(Subscription&& other) noexcept {
  if (this != &other) {
    reset();
    delivery_ = std::move(other.delivery_);
    change_ = std::exchange(other.change_, nullptr);
    last_list_ = other.last_list_;
  }
  return *this;
}

void Subscription::replace(RrefGroup group) {
  if (!delivery_) {
    throw std::logic_error("the datarefs of an empty subscription cannot be replaced; subscribe() first");
  }
  const std::lock_guard<HandlerMutex> lock(*delivery_->mutex_);
  change_(last_list_ + 1, std::move(group));
  delivery_->list_ = ++last_list_;
}

void Subscription::reset() {
  if (!delivery_) {
    return;
  }
  {
    const std::lock_guard<HandlerMutex> lock(*delivery_->mutex_);
    delivery_->list_ = 0;
    change_(0, std::nullopt);
  }
  delivery_.reset();
  change_ = nullptr;
}

}  // namespace xplane_bridge::core
