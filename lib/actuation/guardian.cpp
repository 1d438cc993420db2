#include "xplane_bridge/actuation/guardian.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "xplane_bridge/core/link/sim_link.hpp"

extern char** environ;

namespace xplane_bridge {
namespace {

constexpr double kFindTime = 2.0;     // [s] until X-Plane's address is known: a name may have to be resolved
constexpr double kUndoTime = 2.0;     // [s] X-Plane answers within a frame or two, or it is gone too
constexpr double kAttemptTime = 0.5;  // [s] until a release that is not shown is sent again

[[noreturn]] void fail(const std::string& what, int error) {
  throw std::runtime_error("the guardian process " + what + ": " + std::strerror(error));
}

std::string siblingProgram(const char* name) {
  std::array<char, 4096> path{};
  const ssize_t length = readlink("/proc/self/exe", path.data(), path.size() - 1);
  if (length <= 0) fail("cannot be found", errno);
  const std::string self(path.data(), static_cast<std::size_t>(length));
  return self.substr(0, self.rfind('/') + 1) + name;
}

}  // namespace

Guardian::~Guardian() {
  if (pipe_ >= 0) close(pipe_);
}

void Guardian::start() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail("has no pipe", errno);
  const std::string program = siblingProgram("override_guardian");
  std::string owner = std::to_string(getpid());
  std::array<char*, 3> arguments = {const_cast<char*>(program.c_str()), owner.data(), nullptr};

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, ends[0], STDIN_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);  // the node blocks SIGINT and its like in all its threads
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
  pid_t child = -1;
  const int error = posix_spawn(&child, program.c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  close(ends[0]);
  if (error != 0) {
    close(ends[1]);
    fail(program + " cannot be started", error);
  }
  pipe_ = ends[1];
  child_ = child;
}

void Guardian::tell(const std::string& line) {
  if (pipe_ < 0) return;
  // The child reads all the time, so a pipe that does not take a line at once has no reader any more.
  if (write(pipe_, line.data(), line.size()) == static_cast<ssize_t>(line.size())) return;
  close(pipe_);
  pipe_ = -1;
}

void Guardian::setPeer(const core::Endpoint& peer, const std::string& journal_path) {
  tell("peer " + peer.addressString() + " " + std::to_string(peer.port) + " " + journal_path + "\n");
}

void Guardian::dismiss() {
  tell("bye\n");
  if (pipe_ >= 0) close(pipe_);
  pipe_ = -1;
  int status = 0;
  if (child_ > 0) waitpid(child_, &status, 0);
  child_ = -1;
}

GuardianOrders readGuardianOrders(std::istream& lines) {
  GuardianOrders orders;
  std::string line;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string verb, address, journal;
    int port = 0;
    words >> verb;
    if (verb == "bye") orders.dismissed = true;
    if (verb != "peer") continue;
    words >> address >> port;
    std::getline(words >> std::ws, journal);
    if (port < 1 || port > std::numeric_limits<std::uint16_t>::max() || journal.empty()) continue;
    orders.address = address;
    orders.port = static_cast<std::uint16_t>(port);
    orders.journal = journal;
  }
  return orders;
}

std::shared_ptr<core::Journal> guardedJournal(const std::string& path, std::int64_t parent) {
  const auto runs = [parent](const core::JournalOwner& owner) { return owner.pid != parent && core::isAlive(owner); };
  return std::make_shared<core::Journal>(path, core::thisProcess("override_guardian"), runs);
}

bool releaseLeftBehind(core::SimulatorPort* link, const OverrideManager::Report& report) {
  if (!link->waitUntil([link] { return link->journal() != nullptr; }, kFindTime)) return false;
  OverrideManager overrides(link, report);
  const core::Deadline deadline(link->clock(), kUndoTime);
  do {
    if (overrides.releaseLeftovers(kAttemptTime)) return true;
  } while (!deadline.over());
  return false;
}

int runGuardian(int argc, char** argv) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP, SIGPIPE}) std::signal(number, SIG_IGN);
  if (argc != 2) {
    std::fprintf(stderr, "override_guardian: started by tx_node, not by hand; see scripts/release_overrides\n");
    return 1;
  }
  // The parent's sockets are not ours: held open here, its peers would not see it die.
  const auto last = static_cast<int>(std::min<long>(sysconf(_SC_OPEN_MAX), 4096));
  for (int descriptor = STDERR_FILENO + 1; descriptor < last; ++descriptor) close(descriptor);
  const GuardianOrders orders = readGuardianOrders(std::cin);
  if (orders.dismissed || orders.journal.empty()) return 0;

  try {
    const auto journal = guardedJournal(orders.journal, std::strtoll(argv[1], nullptr, 10));
    if (journal->orphans(kOverridePurpose).empty()) return 0;
    core::SimLinkOptions options;
    options.host = orders.address;
    options.port = orders.port;
    options.listen_for_beacon = false;
    core::SimLink link(
        options, {}, core::hostClock(), [](core::LogLevel, const std::string&) {},
        [journal](const core::Endpoint&) { return journal; });
    link.start();
    const bool done = releaseLeftBehind(&link, [](const std::string& text, bool success) {
      std::fprintf(stderr, "override_guardian: %s%s\n", success ? "" : "NOT DONE: ", text.c_str());
    });
    link.stop();
    return done ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "override_guardian: %s\n", error.what());
    return 1;
  }
}

}  // namespace xplane_bridge
