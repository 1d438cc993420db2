#pragma once

#include <functional>
#include <string>
#include <thread>

namespace xplane_bridge {

/// Turns SIGINT, SIGTERM and SIGHUP into calls on an ordinary thread, so that shutting down is not limited to what a
/// signal handler may do.
///
/// The constructor blocks the three signals in the calling thread and must therefore run before any other thread is
/// started; they stay blocked for the life of the process (a second Ctrl-C does not cut an orderly stop short). A
/// child process inherits the block and has to lift it. A SIGHUP ignored at start (nohup) stays ignored.
class StopSignals {
 public:
  /// Calls `on_signal` with the signal's name ("SIGINT") on a thread of its own, once for every signal.
  /// @throws std::system_error when the kernel refuses a signalfd
  explicit StopSignals(std::function<void(const std::string&)> on_signal);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  void watch() const;

  std::function<void(const std::string&)> on_signal_;
  int signal_fd_ = -1;
  int end_fd_ = -1;
  std::thread thread_;
};

}  // namespace xplane_bridge
