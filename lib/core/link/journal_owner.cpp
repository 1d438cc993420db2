#include "xplane_bridge/core/link/journal_owner.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

namespace xplane_bridge::core {
namespace {

std::string firstLine(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::string bootId() { return firstLine("/proc/sys/kernel/random/boot_id"); }

std::string computerName() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) {
    name[0] = '\0';
  }
  return name.data();
}

struct ProcessStatus {
  char state = 'X';              ///< as in /proc/<pid>/stat: 'Z' has ended and was not waited for
  std::int64_t start_ticks = 0;  ///< [clock ticks] since boot; 0 when there is no such process
};

ProcessStatus processStatus(std::int64_t pid) {
  const std::string stat = firstLine("/proc/" + std::to_string(pid) + "/stat");
  // The second field is the program's name in brackets and may hold anything; fields are counted from behind it.
  const std::size_t bracket = stat.rfind(')');
  if (bracket == std::string::npos) {
    return {};
  }
  constexpr int kFieldsBetween = 18;  // fields 3 (state) and 22
  std::istringstream fields(stat.substr(bracket + 1));
  ProcessStatus status;
  fields >> status.state;
  std::string skipped;
  for (int i = 0; i < kFieldsBetween; ++i) {
    fields >> skipped;
  }
  fields >> status.start_ticks;
  return status;
}

bool isStartOf(const JournalOwner& owner, const ProcessStatus& status) {
  return owner.start_ticks != 0 && owner.start_ticks == status.start_ticks && owner.boot_id == bootId();
}

/// Opens the file beside the journal of which each owner has a byte locked. Never deleted, as its locks would go.
int openOwners(const std::string& journal, int flags) {
  const std::filesystem::path file = std::filesystem::path(journal).parent_path() / "owners.lock";
  return ::open(file.c_str(), O_RDONLY | O_CLOEXEC | flags, 0644);  // also where it is another user's
}

/// The owner's byte: a process number has 22 bits at most.
struct flock byteOf(const JournalOwner& owner, short type) {
  constexpr unsigned kPidBits = 22;
  constexpr std::uint64_t kOffsets = std::numeric_limits<std::int64_t>::max();
  struct flock byte {};
  byte.l_type = type;
  byte.l_whence = SEEK_SET;
  byte.l_start = static_cast<off_t>(
      ((static_cast<std::uint64_t>(owner.start_ticks) << kPidBits) | static_cast<std::uint64_t>(owner.pid)) & kOffsets);
  byte.l_len = 1;
  return byte;
}

bool isShownAlive(const JournalOwner& owner, const std::string& journal) {
  const int file = openOwners(journal, 0);
  if (file < 0) {
    return false;
  }
  struct flock byte = byteOf(owner, F_WRLCK);  // which every other lock refuses
  const bool held = fcntl(file, F_OFD_GETLK, &byte) == 0 && byte.l_type != F_UNLCK;
  ::close(file);
  return held;
}

}  // namespace

JournalOwner thisProcess(const std::string& node) {
  return {node, getpid(), processStatus(getpid()).start_ticks, bootId(), computerName()};
}

bool isProcess(const JournalOwner& owner, std::int64_t pid) {
  return owner.pid == pid && isStartOf(owner, processStatus(pid));
}

bool isAlive(const JournalOwner& owner, const std::string& journal) {
  if (owner.boot_id != bootId()) {
    return owner.computer != computerName();
  }
  const ProcessStatus status = processStatus(owner.pid);
  const bool runs_here = isStartOf(owner, status) && status.state != 'Z' && status.state != 'X';
  return runs_here || isShownAlive(owner, journal);
}

void showAlive(const JournalOwner& owner, const std::string& journal) {
  if (!isProcess(owner, getpid()) || isShownAlive(owner, journal)) {
    return;
  }
  const int file = openOwners(journal, O_CREAT);
  if (file < 0) {
    return;  // no container but this one's sees it then; the journal is as good as before
  }
  // The lock is the open file's, not the process's as those of F_SETLK are, which any close() of the file would take.
  struct flock byte = byteOf(owner, F_RDLCK);
  if (fcntl(file, F_OFD_SETLK, &byte) != 0) {
    ::close(file);
  }
  // Else it stays open until the process ends.
}

}  // namespace xplane_bridge::core
