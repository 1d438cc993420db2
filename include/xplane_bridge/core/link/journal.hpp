#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/link/journal_owner.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

/// What we changed in X-Plane, written down before it is changed, so that it can be undone by another process: the
/// same node on exit, its guardian, its next start, or scripts/release_overrides. Format: docs/nodes/journal.md.
namespace xplane_bridge::core {

/// The journal could not be read or written. what() has the file and the cause.
class JournalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// What is to be changed is in the journal already, by a process that still runs: a second bridge at one X-Plane.
class JournalTakenError : public JournalError {
 public:
  using JournalError::JournalError;
};
/// Why X-Plane is left as it is when the journal refuses a change, as the end of a sentence.
std::string whyNotChanged(const JournalError& error);

/// Writes `value` to a dataref (DREF).
struct UndoDref {
  std::string path;
  float value = 0.0F;
  bool confirm = true;  ///< it is undone only once X-Plane shows the value; else it is written and not looked at
};
/// Writes one DATA row; -999 gives a slot back (DATA).
struct UndoData {
  DataRow row;
};
/// Takes rows out of Data Output (USEL).
struct UndoUsel {
  std::vector<std::int32_t> rows;
};
/// Switches a network target off (ISE4).
struct UndoIse4 {
  std::int32_t target = kIse4DataOutput;
  std::string address;  ///< dotted decimal
  std::uint16_t port = 0;
};
/// Lets X-Plane go on if it is paused. Has no datagram of its own: before 12.10 there is only a toggle, so what X-Plane
/// shows decides whether anything is sent (xplane_bridge::resumeLeftovers()).
struct UndoPause {};
using UndoOperation = std::variant<UndoDref, UndoData, UndoUsel, UndoIse4, UndoPause>;

/// The datagram that carries out an operation; kOutOfRange for one that has none.
EncodeResult encodeUndo(ByteSpan out, const UndoOperation& operation);
/// Room for any operation's datagram.
constexpr std::size_t kMaxUndoSize = kMaxDselSize;

/// What X-Plane sends to one UDP port of ours until we ask it to stop: by datagrams from that port.
struct JournalSubscription {
  std::uint16_t port = 0;
  std::vector<std::string> datarefs;  ///< RREF, the position is the index
  bool rpos = false;                  ///< the position stream
};

/// One thing that was changed.
struct JournalEntry {
  std::string id;       ///< unique in the file, e.g. "override:sim/operation/override/override_joystick"
  std::string purpose;  ///< who looks after such entries: "data_output", "override", "subscriptions", ...
  JournalOwner owner;
  std::vector<UndoOperation> undo;  ///< in the order in which they are to be carried out
  std::string left = {};            ///< why its process ended without undoing it; empty: it crashed, or still runs
  std::vector<JournalSubscription> subscriptions = {};
};

/// An entry to be written in the name of this process; fields as in JournalEntry.
struct JournalRecord {
  std::string id;
  std::string purpose;
  std::vector<UndoOperation> undo;
  std::vector<JournalSubscription> subscriptions = {};
};

/// The journal of one X-Plane (host and port), shared by all nodes that use it.
///
/// Each call that writes locks the file (flock on "<path>.lock"), reads it, changes it and replaces it atomically
/// (write, fsync, rename), so that several processes use it safely and a crash leaves the old or the new file. Calls
/// that only read see the one or the other and wait for no lock: a process may have been stopped while it holds it.
/// All calls throw JournalError; a file that cannot be understood is moved to "<path>.damaged-<n>" and said so once
/// through the exception, after which the journal is empty and usable. Thread-safe.
class Journal {
 public:
  using AliveFunction = std::function<bool(const JournalOwner&)>;

  /// `path`: see journalPath(). The folder is made when first needed. `self` owns what record() writes. `waits`: for
  /// the lock; otherwise calls that write throw JournalError while another process has it. `alive`: whether an owner
  /// runs; empty: isAlive().
  Journal(std::string path, JournalOwner self, AliveFunction alive = {}, bool waits = true);

  const std::string& path() const { return path_; }
  const JournalOwner& self() const { return self_; }

  /// The journal of subscriptions beside this one, "<host>_<port>_subscriptions.json": a process that gives overrides
  /// back never has to wait for a node that is writing down hundreds of datarefs, or was stopped in the middle of that.
  /// By the address that X-Plane is asked at, `peer`: it ends them for the address that asks, which depends on that.
  std::shared_ptr<Journal> ofSubscriptions(const Endpoint& peer) const;
  /// The same journal for who must not wait for the lock.
  Journal withoutWaiting() const;

  /// Everything in the file; empty when there is none.
  std::vector<JournalEntry> entries() const;
  /// The entries of a purpose whose process is gone: to be undone, then removed.
  std::vector<JournalEntry> orphans(const std::string& purpose) const;
  /// The entries of this process.
  std::vector<JournalEntry> own() const;

  /// Adds an entry in the name of this process, or replaces the one with the same id. Returns once it is on disk: only
  /// then may X-Plane be changed. Refuses to replace an entry of another process that still runs (JournalTakenError);
  /// the entry of one that is gone is replaced, so look at orphans() first. Refuses a value that is not finite.
  void record(const std::string& id, const std::string& purpose, std::vector<UndoOperation> undo,
              std::vector<JournalSubscription> subscriptions = {});
  /// The same of several at the price of one, the file being replaced once: all of them or, when it throws, none.
  void record(std::vector<JournalRecord> records);
  /// Takes out of this process's entry of that id the datarefs that entries of other processes hold which run: the last
  /// of them gives them back. Under the lock, so that of two that end at once one does; without it where nothing is
  /// shared. Returns what is left to be undone; empty: the entry is gone.
  std::vector<UndoOperation> handOver(const std::string& id);
  /// Writes into this process's entries of these ids why they are left behind.
  void leave(const std::vector<std::string>& ids, const std::string& why);
  /// Removes entries by id; unknown ids are no error. The file goes with its last entry.
  void remove(const std::vector<std::string>& ids);
  /// Removes what was found by orphans() and has been undone, but not what record() has taken over since.
  void removeUndone(const std::vector<JournalEntry>& undone);
  /// Adds entries of the same X-Plane from another file, under their owners, and returns those; there they are to be
  /// removed afterwards (removeUndone()), so that a crash loses none. With one of the same id here, of the same owner
  /// or of one that is gone, an entry is merged, and the values here are put back; that of another process that runs
  /// stays as it is, and the entry is not taken.
  std::vector<JournalEntry> adopt(const std::vector<JournalEntry>& offered);

 private:
  void removeIf(const std::function<bool(const JournalEntry&)>& chosen);

  std::string path_;
  JournalOwner self_;
  AliveFunction alive_;
  bool waits_;
};

/// "<folder>/<host>_<port>.json" with characters that do not belong in a file name replaced by '-'.
/// By convention the folder is ~/.ros/xplane_bridge.
std::string journalPath(const std::string& folder, const std::string& host, std::uint16_t port);

/// Opens the journal of the X-Plane at `peer`, once that is known.
using JournalFactory = std::function<std::shared_ptr<Journal>(const Endpoint& peer)>;
/// Journals in `folder` (by convention ~/.ros/xplane_bridge) in the name of this process as `node`. An X-Plane of this
/// computer has one, whichever of its addresses it is called by. Where earlier versions have left entries under another
/// one, and their processes are gone, they are taken over; `log` says where that fails.
JournalFactory journalsIn(const std::string& folder, const std::string& node, LogFunction log);

/// This process's entry of that id; nullopt: there is none, or the guardian, scripts/release_overrides or the loss of
/// its X-Plane has ended it, so that nothing of it is to be undone any more. Throws JournalError.
inline std::optional<JournalEntry> ownEntry(const Journal& journal, const std::string& id) {
  std::vector<JournalEntry> own = journal.own();
  const auto found = std::find_if(own.begin(), own.end(), [&id](const JournalEntry& entry) { return entry.id == id; });
  if (found == own.end()) return std::nullopt;
  return std::move(*found);
}

/// What X-Plane had in a dataref before the first change of those that entries undo: the user's own value, which
/// X-Plane does not show meanwhile. nullopt: none of them has changed it. Look at entries read after the dataref was.
inline std::optional<float> valueBefore(const std::vector<JournalEntry>& entries, const std::string& dataref) {
  for (const JournalEntry& entry : entries) {
    for (const UndoOperation& operation : entry.undo) {
      const auto* dref = std::get_if<UndoDref>(&operation);
      if (dref != nullptr && dref->path == dataref) {
        return dref->value;
      }
    }
  }
  return std::nullopt;
}

}  // namespace xplane_bridge::core
