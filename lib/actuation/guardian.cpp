#include "xplane_bridge/actuation/guardian.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "xplane_bridge/actuation/pausing.hpp"
#include "xplane_bridge/actuation/release_worker.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"

namespace xplane_bridge {
namespace {

constexpr double kUndoTime = 10.0;     // [s] X-Plane answers within a frame or two, after a hitch, or it is gone too
constexpr double kHangTime = 2.0;      // [s] the same while the parent may go on, and record anew what it takes
constexpr double kAttemptTime = 0.5;   // [s] until a release that is not shown is sent again
constexpr double kJournalAgain = 0.1;  // [s] until a journal that another process has locked is tried again
constexpr double kBeatPeriod = 0.05;   // [s] at most often
constexpr int kLookMs = 50;            // [ms] without hearing the parent

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

// --- of the parent ---

Guardian::~Guardian() {
  if (socket_ >= 0) close(socket_);
}

void Guardian::start() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) fail("has no socket", errno);
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
  const std::lock_guard<std::mutex> lock(mutex_);
  socket_ = ends[1];
  child_ = child;
  wanted_ = true;
  if (!peer_line_.empty()) sendLine(peer_line_);
}

bool Guardian::restartIfEnded() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!wanted_) return false;
    // One that took its end of the socket for its parent's undoes what it knows, and ends.
    if (child_ > 0 && waitpid(child_, nullptr, WNOHANG) == 0) return false;
    child_ = -1;
    if (socket_ >= 0) close(socket_);
    socket_ = -1;
  }
  start();
  return true;
}

/// With mutex_ held.
void Guardian::sendLine(const std::string& line) {
  if (socket_ < 0) return;
  const ssize_t sent = send(socket_, line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  // Half a line would spoil the next one; a child that does not read for so long does not guard any more.
  if (sent == static_cast<ssize_t>(line.size()) || (sent < 0 && errno == EINTR)) return;
  close(socket_);
  socket_ = -1;
}

bool Guardian::running() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return socket_ >= 0;
}

void Guardian::setPeer(const core::Endpoint& peer, const std::string& journal_path) {
  const std::lock_guard<std::mutex> lock(mutex_);
  peer_line_ = "peer " + peer.addressString() + " " + std::to_string(peer.port) + " " + journal_path + "\n";
  sendLine(peer_line_);
}

void Guardian::beat(double hang_timeout) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double now = core::hostClock().steadySeconds();
  if (socket_ < 0 || now - last_beat_ < kBeatPeriod) return;
  last_beat_ = now;
  sendLine("beat " + std::to_string(hang_timeout) + "\n");
}

bool Guardian::hasActed() {
  const std::lock_guard<std::mutex> lock(mutex_);
  char released = 0;
  bool undone = false;
  while (recv(socket_, &released, 1, MSG_DONTWAIT) == 1) undone = true;
  return undone;
}

void Guardian::rest() {
  const std::lock_guard<std::mutex> lock(mutex_);
  sendLine("rest\n");
}

void Guardian::dismiss() {
  const std::lock_guard<std::mutex> lock(mutex_);
  wanted_ = false;
  sendLine("bye\n");
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
  int status = 0;
  if (child_ > 0) waitpid(child_, &status, 0);
  child_ = -1;
}

// --- of the child ---

void GuardianOrders::take(const std::string& line) {
  std::istringstream words(line);
  std::string verb;
  words >> verb;
  if (verb == "bye") dismissed = true;
  if (verb == "rest") hang_timeout = 0.0;
  if (verb == "beat") {
    double timeout = 0.0;
    if (!(words >> timeout) || timeout <= 0.0) return;
    hang_timeout = timeout;
    ++beats;
  }
  if (verb != "peer") return;
  std::string new_address, new_journal;
  int new_port = 0;
  words >> new_address >> new_port;
  std::getline(words >> std::ws, new_journal);
  if (new_port < 1 || new_port > std::numeric_limits<std::uint16_t>::max() || new_journal.empty()) return;
  address = new_address;
  port = static_cast<std::uint16_t>(new_port);
  journal = new_journal;
}

bool HangWatch::passed(double elapsed, double timeout) {
  if (timeout <= 0.0 || hangs_) return false;
  silence_ += std::min(elapsed, kLongestLook);
  hangs_ = silence_ >= timeout;
  return hangs_;
}

std::shared_ptr<core::Journal> guardedJournal(const std::string& path, std::int64_t parent) {
  const auto runs = [parent, path](const core::JournalOwner& owner) {
    return !core::isProcess(owner, parent) && core::isAlive(owner, path);
  };
  return std::make_shared<core::Journal>(path, core::thisProcess("override_guardian"), runs, false);
}

bool releaseLeftBehind(core::SimulatorPort* link, double time_s, const OverrideManager::Report& report) {
  const core::Deadline deadline(link->clock(), time_s);
  if (!link->waitUntil([link] { return link->journal() != nullptr; }, time_s)) return false;
  OverrideManager overrides(link, report);
  std::string problem;  // of the journal
  do {
    problem.clear();
    if (giveBackLeftovers(link, &overrides, kAttemptTime, &problem)) return true;
    if (!problem.empty()) link->waitUntil([] { return false; }, kJournalAgain);
  } while (!deadline.over());
  if (!problem.empty()) report(problem, false);
  return false;
}

namespace {

/// Gives back what the parent has in the journal, for so long [s]. Returns whether nothing is left.
bool undoFor(const GuardianOrders& orders, std::int64_t parent, double time_s) {
  if (orders.journal.empty()) return true;
  try {
    auto journal = guardedJournal(orders.journal, parent);
    if (journal->orphans(kOverridePurpose).empty() && journal->orphans(kPausePurpose).empty()) return true;
    core::SimLinkOptions options;
    options.host = orders.address;
    options.port = orders.port;
    options.listen_for_beacon = false;
    options.journal_subscriptions = false;
    core::SimLink link(
        options, {}, core::hostClock(), [](core::LogLevel, const std::string&) {},
        [journal](const core::Endpoint&) { return journal; });
    link.start();
    const bool done = releaseLeftBehind(&link, time_s, [](const std::string& text, bool success) {
      std::fprintf(stderr, "override_guardian: %s%s\n", success ? "" : "NOT DONE: ", text.c_str());
    });
    link.stop();
    return done;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "override_guardian: %s\n", error.what());
    return false;
  }
}

/// Until the parent is gone; acts while it hangs. Returns the last orders.
GuardianOrders guard(std::int64_t parent) {
  GuardianOrders orders;
  HangWatch watch;
  std::string heard;  // the beginning of a line
  double looked = core::hostClock().steadySeconds();
  for (;;) {
    pollfd ear{STDIN_FILENO, POLLIN, 0};
    const bool speaks = poll(&ear, 1, kLookMs) > 0;
    const double now = core::hostClock().steadySeconds();
    const double elapsed = now - std::exchange(looked, now);
    if (speaks) {
      std::array<char, 4096> text{};
      const ssize_t length = read(STDIN_FILENO, text.data(), text.size());
      if (length < 0 && errno == EINTR) continue;
      if (length <= 0) return orders;
      heard.append(text.data(), static_cast<std::size_t>(length));
    }
    const unsigned beats = orders.beats;
    for (std::size_t end = heard.find('\n'); end != std::string::npos; end = heard.find('\n')) {
      orders.take(heard.substr(0, end));
      heard.erase(0, end + 1);
    }
    if (orders.beats != beats) watch.beat();
    if (!watch.passed(elapsed, orders.hang_timeout)) continue;
    std::fprintf(stderr, "override_guardian: process %lld has not run for %.1f s: giving back what it has set\n",
                 static_cast<long long>(parent), orders.hang_timeout);
    // First it must learn that it may not go on as before.
    static_cast<void>(send(STDIN_FILENO, "!", 1, MSG_NOSIGNAL | MSG_DONTWAIT));
    undoFor(orders, parent, kHangTime);
    looked = core::hostClock().steadySeconds();
  }
}

}  // namespace

int runGuardian(int argc, char** argv) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP, SIGPIPE}) std::signal(number, SIG_IGN);
  if (argc != 2) {
    std::fprintf(stderr, "override_guardian: started by tx_node, not by hand; see scripts/release_overrides\n");
    return 1;
  }
  // The parent's sockets are not ours: held open here, its peers would not see it die.
  const auto last = static_cast<int>(std::min<long>(sysconf(_SC_OPEN_MAX), 4096));
  for (int descriptor = STDERR_FILENO + 1; descriptor < last; ++descriptor) close(descriptor);
  const std::int64_t parent = std::strtoll(argv[1], nullptr, 10);
  const GuardianOrders orders = guard(parent);
  return orders.dismissed || undoFor(orders, parent, kUndoTime) ? 0 : 1;
}

}  // namespace xplane_bridge
