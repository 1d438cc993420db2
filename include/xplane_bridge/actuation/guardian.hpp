#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge {

/// A child process that undoes what this process has in the journal when it dies without dismissing it (kill -9, a
/// crash), and when it hangs (SIGSTOP, a deadlock).
///
/// It holds the other end of a socket: when that ends without dismiss(), its parent is gone; when no beat() comes for
/// too long, its parent hangs. It has a session of its own and ignores the terminal's signals, so that Ctrl-C reaches
/// the parent only. It needs neither ROS nor the parent. Thread-safe.
class Guardian {
 public:
  Guardian() = default;
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// Starts the program override_guardian that lies beside this one, for the journal entries of this process.
  /// @throws std::runtime_error when it cannot be started
  void start();
  /// Starts it once more where it has ended by itself (killed, out of memory); returns whether it had. To be called now
  /// and then. @throws std::runtime_error when it cannot be started
  bool restartIfEnded();
  /// Where X-Plane is, and what was changed there, from now on.
  void setPeer(const core::Endpoint& peer, const std::string& journal_path);
  /// This process runs, and beat() will be called again within `hang_timeout` [s]; to be called by the thread that must
  /// not hang, as often as it likes.
  void beat(double hang_timeout);
  /// Whether the guardian has given everything back since the last call, because a beat did not come in time. For any
  /// thread.
  bool hasActed();
  /// No beat() is to be expected any more.
  void rest();
  /// Everything is undone: the child ends without doing anything.
  void dismiss();
  bool running() const;

 private:
  void sendLine(const std::string& line);

  mutable std::mutex mutex_;
  int socket_ = -1;
  int child_ = -1;
  double last_beat_ = -1e9;  // [s] steady
  bool wanted_ = false;      // from start() to dismiss()
  std::string peer_line_;    // what setPeer() has sent last
};

/// What the parent has sent its guardian, line by line.
struct GuardianOrders {
  std::string address;
  std::uint16_t port = 0;
  std::string journal;        ///< path; empty: nothing was ever changed
  bool dismissed = false;     ///< the parent has undone everything itself
  double hang_timeout = 0.0;  ///< [s] in which a beat must come; 0: none is to be expected
  unsigned beats = 0;         ///< until now

  /// Takes "peer ADDRESS PORT JOURNAL" (the last counts), "beat SECONDS", "rest" or "bye". Anything else is skipped:
  /// the last line of a parent that died may be cut off.
  void take(const std::string& line);
};

/// Notices when a parent has not shown for too long that it runs. Counts only time in which this process got to run: on
/// a computer that is too busy for both, the parent does not count as hung.
class HangWatch {
 public:
  static constexpr double kLongestLook = 0.1;  ///< [s] that one call of passed() counts at most

  /// The parent runs.
  void beat() { silence_ = 0.0, hangs_ = false; }
  /// `elapsed` [s] have passed since the last call. Returns true once, when no beat() has come for `timeout` [s]; with
  /// 0, none is expected.
  bool passed(double elapsed, double timeout);

 private:
  double silence_ = 0.0;  // [s]
  bool hangs_ = false;
};

/// The journal in which the entries of `parent` count as left behind, although that may still be there as a process
/// that has not been waited for. It waits for no lock: the parent may hang while it has it.
std::shared_ptr<core::Journal> guardedJournal(const std::string& path, std::int64_t parent);
/// Gives back over `link`, whose journal is a guardedJournal(), what was left behind, and lets X-Plane go on if it was
/// left paused. Waits for `time_s` [s] for X-Plane to be found, to show it, and for the journal's lock. Returns whether
/// nothing is left.
bool releaseLeftBehind(core::SimulatorPort* link, double time_s, const OverrideManager::Report& report);

/// The whole of override_guardian's main(). Its argument is the process it guards, its standard input the orders.
int runGuardian(int argc, char** argv);

}  // namespace xplane_bridge
