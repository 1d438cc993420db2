#include "xplane_bridge/core/wire/udp_hub.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

[[noreturn]] void fail(const char* what, int error_number) {
  throw SocketError(std::string(what) + ": " + std::strerror(error_number), error_number);
}

// open() makes no other sources.
int fdOf(const DatagramSource& source) { return static_cast<const UdpSocket&>(source).fd(); }

int makeEpoll() {
  const int fd = epoll_create1(EPOLL_CLOEXEC);
  if (fd < 0) {
    fail("cannot make an epoll", errno);
  }
  return fd;
}

/// The tag is compared only.
void addTo(int epoll_fd, int fd, const void* tag) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = const_cast<void*>(tag);
  if (epoll_ctl(epoll_fd, EPOLL_CTL_ADD, fd, &event) != 0) {
    fail("a socket cannot be waited for", errno);
  }
}

}  // namespace

UdpHub::UdpHub() {
  epoll_fd_ = makeEpoll();
  wake_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake_fd_ < 0) {
    const int error_number = errno;
    close(epoll_fd_);
    fail("cannot make an eventfd", error_number);
  }
  addTo(epoll_fd_, wake_fd_, this);
}

UdpHub::~UdpHub() {
  if (narrow_fd_ >= 0) close(narrow_fd_);
  close(wake_fd_);
  close(epoll_fd_);
}

std::shared_ptr<DatagramSource> UdpHub::open(const std::string& name, const UdpSocketOptions& options) {
  static_cast<void>(name);  // X-Plane does not see it
  auto socket = std::make_shared<UdpSocket>(options);
  addTo(epoll_fd_, socket->fd(), static_cast<const DatagramSource*>(socket.get()));
  return socket;
}

void UdpHub::ignore(const DatagramSource& source) { epoll_ctl(epoll_fd_, EPOLL_CTL_DEL, fdOf(source), nullptr); }

void UdpHub::wake() {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the thread is awake anyway.
  [[maybe_unused]] const ssize_t written = ::write(wake_fd_, &one, sizeof(one));
}

void UdpHub::wait(int timeout_ms) {
  constexpr std::size_t kMostAtOnce = 64;
  ready_.resize(kMostAtOnce);
  const int count = epoll_wait(epoll_fd_, ready_.data(), static_cast<int>(ready_.size()), timeout_ms);
  ready_.resize(static_cast<std::size_t>(std::max(0, count)));  // interrupted: nothing
  if (isReady(this)) {
    std::uint64_t woken = 0;
    [[maybe_unused]] const ssize_t size = ::read(wake_fd_, &woken, sizeof(woken));
  }
}

void UdpHub::waitFor(const DatagramSource& source, int timeout_ms) {
  if (timeout_ms != 0) {
    std::array<pollfd, 2> ends{pollfd{wake_fd_, POLLIN, 0}, pollfd{fdOf(source), POLLIN, 0}};
    poll(ends.data(), ends.size(), timeout_ms);  // interrupted: whatever there is
  }
  wait(0);
}

int UdpHub::fdFor(const DatagramSource* source) {
  if (narrow_fd_ < 0) {
    narrow_fd_ = makeEpoll();
    addTo(narrow_fd_, wake_fd_, nullptr);
  }
  const int wanted = source == nullptr ? epoll_fd_ : fdOf(*source);
  if (wanted != narrowed_to_) {
    // In vain for a socket that has been closed: then it is not in there any more.
    if (narrowed_to_ >= 0) epoll_ctl(narrow_fd_, EPOLL_CTL_DEL, narrowed_to_, nullptr);
    addTo(narrow_fd_, wanted, nullptr);
    narrowed_to_ = wanted;
  }
  return narrow_fd_;
}

bool UdpHub::hasInput(const DatagramSource& source) const { return isReady(&source); }

bool UdpHub::isReady(const void* tag) const {
  return std::any_of(ready_.begin(), ready_.end(), [tag](const epoll_event& event) { return event.data.ptr == tag; });
}

}  // namespace xplane_bridge::core
