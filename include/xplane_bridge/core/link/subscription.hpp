#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/rref_subscription.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {

/// What is known of a datagram besides its bytes.
struct ReceiveInfo {
  std::int64_t stamp_ns = 0;     ///< [ns] CLOCK_REALTIME when the kernel received it; else when it was read
  bool kernel_stamp = false;     ///< stamp_ns is the kernel's
  std::int64_t steady_ns = 0;    ///< [ns] the injected steady clock when it was read
  std::uint32_t link_epoch = 0;  ///< LinkStatus::epoch at that moment
  Endpoint from;
  std::array<std::uint8_t, kHeaderSize> label{};  ///< the datagram's first bytes; DATA only
};

/// Called from the link's thread with a datagram of a group; must return quickly. The view is valid during the call
/// only; the index of a value is the position of its dataref in the group.
using RrefHandler = std::function<void(const RrefView&, const ReceiveInfo&)>;

/// Held by the link's thread while a handler runs, and by Subscription::replace() and reset(). Recursive, so that these
/// may be called with it held, also from the handler.
using HandlerMutex = std::recursive_mutex;

/// The port's end of a Subscription: hands datagrams to the handler while they are wanted.
class RrefDelivery {
 public:
  /// Without `mutex`, with one of its own.
  explicit RrefDelivery(RrefHandler handler, std::shared_ptr<HandlerMutex> mutex = nullptr);

  /// Calls the handler, unless the list numbered `list` has been replaced or ended.
  void deliver(std::uint32_t list, const RrefView& view, const ReceiveInfo& info);

 private:
  friend class Subscription;

  const RrefHandler handler_;
  const std::shared_ptr<HandlerMutex> mutex_;  // shared: the port may wait for it while its owner goes
  std::uint32_t list_ = 0;                     // whose datagrams are wanted; 0: none
};

/// Owns a group of datarefs that is asked of X-Plane, from its making to reset() or its end, over every loss of the
/// link. Made by SimulatorPort::subscribe(). One thread at a time uses it.
///
/// When replace() or reset() return, or the destructor has run, the handler is not running and no datagram of the old
/// list is handed to it any more; only where they are called from the handler itself, that call still goes on.
///
/// Locks: the handler is called with the HandlerMutex held that was given to subscribe(), and replace(), reset() and
/// the destructor take that mutex. So an owner that guards its data by this mutex may call them while it holds it, and
/// its handler needs no lock. A caller that gives no mutex must not call them while holding a mutex that the handler
/// takes.
class Subscription {
 public:
  /// Asks X-Plane for `group` as list number `list` instead of the list before; nullopt: for nothing any more.
  using Change = std::function<void(std::uint32_t list, std::optional<RrefGroup> group)>;

  Subscription() = default;
  /// Of the ports. Asks for `group` at once; what `change` throws is passed on.
  Subscription(std::shared_ptr<RrefDelivery> delivery, Change change, RrefGroup group);
  ~Subscription() { reset(); }
  Subscription(Subscription&& other) noexcept;
  Subscription& operator=(Subscription&& other) noexcept;
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

  /// Another list or rate for the same handler. Throws as SimulatorPort::subscribe(), and then all stays as it was;
  /// std::logic_error for an empty handle.
  void replace(RrefGroup group);
  /// Ends it; nothing where there is nothing.
  void reset();
  explicit operator bool() const { return delivery_ != nullptr; }

 private:
  std::shared_ptr<RrefDelivery> delivery_;
  Change change_;
  std::uint32_t last_list_ = 0;
};

}  // namespace xplane_bridge::core
