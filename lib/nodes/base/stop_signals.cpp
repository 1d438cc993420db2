#include "xplane_bridge/nodes/base/stop_signals.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

namespace xplane_bridge {
namespace {

std::string takeSignal(int signal_fd) {
  signalfd_siginfo info = {};
  if (read(signal_fd, &info, sizeof(info)) != static_cast<ssize_t>(sizeof(info))) {
    return "";
  }
  switch (info.ssi_signo) {
    case SIGINT:
      return "SIGINT";
    case SIGTERM:
      return "SIGTERM";
    default:
      return "SIGHUP";
  }
}

}  // namespace

StopSignals::StopSignals(std::function<void(const std::string&)> on_signal) : on_signal_(std::move(on_signal)) {
  // A shell starts background jobs with SIGINT ignored, and an ignored signal never reaches a signalfd.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  sigset_t signals;
  sigemptyset(&signals);
  for (int number : {SIGINT, SIGTERM, SIGHUP}) {
    sigaddset(&signals, number);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal_fd_ = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  end_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (signal_fd_ < 0 || end_fd_ < 0) {
    throw std::system_error(errno, std::generic_category(), "cannot watch for SIGINT, SIGTERM and SIGHUP");
  }
  thread_ = std::thread([this] { watch(); });
}

StopSignals::~StopSignals() {
  eventfd_write(end_fd_, 1);
  thread_.join();
  close(signal_fd_);
  close(end_fd_);
}

void StopSignals::watch() const {
  while (true) {
    pollfd ready[] = {{signal_fd_, POLLIN, 0}, {end_fd_, POLLIN, 0}};
    if (poll(ready, 2, -1) < 0) {
      if (errno == EINTR) {
        continue;
      }
      return;
    }
    if (ready[1].revents != 0) {
      return;
    }
    const std::string name = takeSignal(signal_fd_);
    if (!name.empty()) {
      on_signal_(name);
    }
  }
}

}  // namespace xplane_bridge
