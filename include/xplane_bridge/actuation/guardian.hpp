#pragma once

#include <string>

#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge {

/// A child process that undoes what this process has in the journal when it dies without a word (kill -9, a crash).
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

/// The whole of override_guardian's main(). Its argument is the process it guards; it reads "peer ADDRESS PORT JOURNAL"
/// and "bye" from its standard input.
int runGuardian(int argc, char** argv);

}  // namespace xplane_bridge
