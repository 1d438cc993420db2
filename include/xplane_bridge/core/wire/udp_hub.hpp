#pragma once

#include <sys/epoll.h>

#include <memory>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/datagram_source.hpp"

namespace xplane_bridge::core {

/// The computer's UDP sockets, waited for with epoll.
class UdpHub : public DatagramHub {
 public:
  /// Throws SocketError.
  UdpHub();
  ~UdpHub() override;
  UdpHub(const UdpHub&) = delete;
  UdpHub& operator=(const UdpHub&) = delete;

  std::shared_ptr<DatagramSource> open(const std::string& name, const UdpSocketOptions& options) override;
  void wake() override;
  void ignore(const DatagramSource& source) override;
  void wait(int timeout_ms) override;
  void waitFor(const DatagramSource& source, int timeout_ms) override;
  bool hasInput(const DatagramSource& source) const override;
  int fd() const override { return epoll_fd_; }
  int fdFor(const DatagramSource* source) override;

 private:
  bool isReady(const void* tag) const;

  int epoll_fd_ = -1;
  int wake_fd_ = -1;
  int narrow_fd_ = -1;              // an epoll of wake_fd_ and the next; made when it is first asked for
  int narrowed_to_ = -1;            // a socket, or epoll_fd_
  std::vector<epoll_event> ready_;  // as the last wait() found them
};

}  // namespace xplane_bridge::core
