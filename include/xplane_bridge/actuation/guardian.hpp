#pragma once

#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string>

#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge {

/// A child process that undoes what this process has in the journal when it dies without dismissing it (kill -9, a
/// crash).
///
/// It holds the reading end of a pipe: when that ends without dismiss(), its parent is gone. It has a session of its
/// own and ignores the terminal's signals, so that Ctrl-C reaches the parent only. It needs neither ROS nor the parent.
class Guardian {
 public:
  Guardian() = default;
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// Starts the program override_guardian that lies beside this one, for the journal entries of this process.
  /// @throws std::runtime_error when it cannot be started
  void start();
  /// Where X-Plane is, and what was changed there, from now on.
  void setPeer(const core::Endpoint& peer, const std::string& journal_path);
  /// Everything is undone: the child ends without doing anything.
  void dismiss();
  bool running() const { return pipe_ >= 0; }

 private:
  void tell(const std::string& line);

  int pipe_ = -1;
  int child_ = -1;
};

/// What the parent has told its guardian.
struct GuardianOrders {
  std::string address;
  std::uint16_t port = 0;
  std::string journal;     ///< path; empty: nothing was ever changed
  bool dismissed = false;  ///< the parent has undone everything itself
};
/// Reads "peer ADDRESS PORT JOURNAL" (the last counts) and "bye" until the parent closes the pipe, deliberately or by
/// dying. Lines that are neither are skipped: the last may be cut off.
GuardianOrders readGuardianOrders(std::istream& lines);
/// The journal in which the entries of `parent` count as left behind, although that may still be there as a process
/// that has not been waited for.
std::shared_ptr<core::Journal> guardedJournal(const std::string& path, std::int64_t parent);
/// Gives back over `link`, whose journal is a guardedJournal(), what was left behind. Waits for X-Plane to be found and
/// to show it. Returns whether nothing is left.
bool releaseLeftBehind(core::SimulatorPort* link, const OverrideManager::Report& report);

/// The whole of override_guardian's main(). Its argument is the process it guards, its standard input the orders.
int runGuardian(int argc, char** argv);

}  // namespace xplane_bridge
