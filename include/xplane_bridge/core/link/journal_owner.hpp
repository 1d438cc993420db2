#pragma once

#include <cstdint>
#include <string>

namespace xplane_bridge::core {

/// The process that made a change. A process id alone may have been given to another process since.
struct JournalOwner {
  std::string node;  ///< for people: "/xplane/tx_node"
  std::int64_t pid = 0;
  std::int64_t start_ticks = 0;  ///< start time of the process, /proc/<pid>/stat field 22
  std::string boot_id;           ///< /proc/sys/kernel/random/boot_id
  std::string computer;          ///< host name

  friend bool operator==(const JournalOwner& a, const JournalOwner& b) {
    return a.pid == b.pid && a.start_ticks == b.start_ticks && a.boot_id == b.boot_id;
  }
  friend bool operator!=(const JournalOwner& a, const JournalOwner& b) { return !(a == b); }
};

/// This process, under the name `node`.
JournalOwner thisProcess(const std::string& node);
/// Whether `owner` is the process of this number here, one that has ended and was not waited for included.
bool isProcess(const JournalOwner& owner, std::int64_t pid);
/// Whether the process that wrote an entry into the journal at that path still runs, here or in another container,
/// whose processes have no numbers here. A process of another computer (other host name and boot id; the file may lie
/// on a shared disk) is taken to run: its changes are not ours to undo.
bool isAlive(const JournalOwner& owner, const std::string& journal);
/// Lets isAlive() of other containers see `owner`, if it is this process, for as long as it runs: by a lock beside the
/// journal, which the system takes away when the process ends, however it ends.
void showAlive(const JournalOwner& owner, const std::string& journal);

}  // namespace xplane_bridge::core
