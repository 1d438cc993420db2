#include "xplane_bridge/core/link/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <tuple>
#include <utility>

#include "journal_format.hpp"

namespace xplane_bridge::core {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw JournalError("journal " + path + ": " + what);
}

[[noreturn]] void failErrno(const std::string& path, const std::string& what) {
  fail(path, what + ": " + std::strerror(errno));
}

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Holds flock on "<path>.lock" while it lives. The lock file is never deleted: that would race with those who wait.
class Lock {
 public:
  Lock(const std::string& path, bool waits) : file_(openLockFile(path + ".lock")) {
    while (flock(file_.get(), waits ? LOCK_EX : LOCK_EX | LOCK_NB) != 0) {
      if (errno == EWOULDBLOCK) {
        fail(path, "another process has it locked: it is writing, or was stopped while it did");
      }
      if (errno != EINTR) {
        failErrno(path, "cannot be locked");
      }
    }
  }

 private:
  static int openLockFile(const std::string& path) {
    const fs::path folder = fs::path(path).parent_path();
    std::error_code error;
    if (!folder.empty()) {
      fs::create_directories(folder, error);
      if (error) {
        fail(path, "its folder cannot be made: " + error.message());
      }
    }
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (fd < 0) {
      failErrno(path, "cannot be opened");
    }
    return fd;
  }

  FileDescriptor file_;
};

/// Moves a file that cannot be understood out of the way. With the lock held.
[[noreturn]] void setAside(const std::string& path, const std::string& why) {
  std::string aside;
  for (int n = 1;; ++n) {
    aside = path + ".damaged-" + std::to_string(n);
    if (!fs::exists(aside)) {
      break;
    }
  }
  std::error_code error;
  fs::rename(path, aside, error);
  fail(path, "cannot be understood (" + why + "); " +
                 (error ? "moving it aside failed: " + error.message()
                        : "it was moved to " + aside +
                              ". What it held was not undone in X-Plane: look there, or restart X-Plane"));
}

JournalContent look(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    if (errno == ENOENT) {
      return {};
    }
    failErrno(path, "cannot be read");
  }
  std::ostringstream text;
  text << file.rdbuf();
  if (file.bad()) {
    fail(path, "cannot be read");
  }
  JournalContent content = parseJournal(text.str());
  if (content.damage.empty() && content.version != kJournalVersion) {
    fail(path, "has version " + std::to_string(content.version) + ", this program knows version " +
                   std::to_string(kJournalVersion) +
                   " only: use the xplane_bridge that wrote it to undo its entries, or delete it");
  }
  return content;
}

/// With the lock held.
std::vector<JournalEntry> read(const std::string& path) {
  JournalContent content = look(path);
  if (!content.damage.empty()) {
    setAside(path, content.damage);
  }
  return std::move(content.entries);
}

void writeAll(int fd, const std::string& text, const std::string& path) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t written = ::write(fd, text.data() + done, text.size() - done);
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      failErrno(path, "cannot be written");
    }
    done += static_cast<std::size_t>(written);
  }
}

void syncFolder(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  const FileDescriptor file(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file.get() < 0 || fsync(file.get()) != 0) {
    failErrno(path, "its folder cannot be synchronised");
  }
}

void write(const std::string& path, const std::vector<JournalEntry>& entries) {
  if (entries.empty()) {
    if (::unlink(path.c_str()) != 0 && errno != ENOENT) {
      failErrno(path, "cannot be deleted");
    }
    syncFolder(path);
    return;
  }
  const std::string text = toText(entries);
  const std::string temporary = path + ".new";
  {
    const FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (file.get() < 0) {
      failErrno(temporary, "cannot be opened");
    }
    writeAll(file.get(), text, temporary);
    if (fsync(file.get()) != 0) {
      failErrno(temporary, "cannot be synchronised");
    }
  }
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    failErrno(path, "cannot be replaced");
  }
  syncFolder(path);
}

std::vector<JournalEntry>::iterator entryOf(std::vector<JournalEntry>* entries, const std::string& id) {
  return std::find_if(entries->begin(), entries->end(), [&id](const JournalEntry& each) { return each.id == id; });
}

/// Whether both put back the same thing, if perhaps to another value.
bool isSameChange(const UndoOperation& a, const UndoOperation& b) {
  if (a.index() != b.index()) {
    return false;
  }
  if (const auto* dref = std::get_if<UndoDref>(&a)) {
    return dref->path == std::get<UndoDref>(b).path;
  }
  if (const auto* data = std::get_if<UndoData>(&a)) {
    return data->row.index == std::get<UndoData>(b).row.index;
  }
  if (const auto* ise4 = std::get_if<UndoIse4>(&a)) {
    const auto& other = std::get<UndoIse4>(b);
    return std::tie(ise4->target, ise4->address, ise4->port) == std::tie(other.target, other.address, other.port);
  }
  return true;  // the rows of Data Output are one set, and there is one pause
}

/// Adds what `from` undoes. What both put back gets the value of `from`, the earlier of the two: the user's own. It
/// comes first, as an override is given back after what depends on it.
void mergeUndo(const std::vector<UndoOperation>& from, std::vector<UndoOperation>* into) {
  std::vector<UndoOperation> missing;
  for (const UndoOperation& operation : from) {
    const auto same = std::find_if(into->begin(), into->end(),
                                   [&](const UndoOperation& each) { return isSameChange(each, operation); });
    if (same == into->end()) {
      missing.push_back(operation);
    } else if (auto* usel = std::get_if<UndoUsel>(&*same)) {
      const std::vector<std::int32_t> rows = usel->rows;
      const std::vector<std::int32_t>& more = std::get<UndoUsel>(operation).rows;
      std::copy_if(more.begin(), more.end(), std::back_inserter(usel->rows),
                   [&rows](std::int32_t row) { return std::find(rows.begin(), rows.end(), row) == rows.end(); });
    } else {
      *same = operation;
    }
  }
  into->insert(into->begin(), missing.begin(), missing.end());
}

/// Adds the ports of `from`; those of both have been noted there later, with all that was asked for.
void mergeSubscriptions(const std::vector<JournalSubscription>& from, std::vector<JournalSubscription>* into) {
  for (const JournalSubscription& subscription : from) {
    const auto same = std::find_if(into->begin(), into->end(),
                                   [&](const JournalSubscription& each) { return each.port == subscription.port; });
    if (same == into->end()) {
      into->push_back(subscription);
    } else {
      *same = subscription;
    }
  }
}

}  // namespace

std::string whyNotChanged(const JournalError& error) {
  if (dynamic_cast<const JournalTakenError*>(&error) != nullptr) {
    return std::string("another bridge is at this X-Plane: ") + error.what();
  }
  return std::string("it could not be given back after a crash, should there be one: ") + error.what();
}

EncodeResult encodeUndo(ByteSpan out, const UndoOperation& operation) {
  struct Encoder {
    ByteSpan out;
    EncodeResult operator()(const UndoDref& dref) const { return encodeDref(out, dref.path, dref.value); }
    EncodeResult operator()(const UndoData& data) const { return encodeData(out, &data.row, 1); }
    EncodeResult operator()(const UndoUsel& usel) const { return encodeUsel(out, usel.rows.data(), usel.rows.size()); }
    EncodeResult operator()(const UndoIse4& ise4) const {
      return encodeIse4(out, ise4.target, ise4.address, ise4.port, false);
    }
    EncodeResult operator()(const UndoPause&) const { return EncodeError::kOutOfRange; }
  };
  return std::visit(Encoder{out}, operation);
}

Journal::Journal(std::string path, JournalOwner self, AliveFunction alive, bool waits)
    : path_(std::move(path)), self_(std::move(self)), alive_(std::move(alive)), waits_(waits) {
  if (!alive_) {
    alive_ = [file = path_](const JournalOwner& owner) { return isAlive(owner, file); };
  }
}

std::shared_ptr<Journal> Journal::ofSubscriptions(const Endpoint& peer) const {
  // Whichever loopback address is asked, X-Plane sees the same one asking.
  const std::uint32_t address = isSameHost(peer.address, kLoopbackAddress) ? kLoopbackAddress : peer.address;
  const fs::path named(
      journalPath(fs::path(path_).parent_path().string(), Endpoint{address, 0}.addressString(), peer.port));
  const fs::path beside = named.parent_path() / (named.stem().string() + "_subscriptions" + named.extension().string());
  return std::make_shared<Journal>(beside.string(), self_, alive_, waits_);
}

Journal Journal::withoutWaiting() const { return Journal(path_, self_, alive_, false); }

std::vector<JournalEntry> Journal::entries() const {
  JournalContent content = look(path_);
  if (content.damage.empty()) {
    return std::move(content.entries);
  }
  // Looked at again with the lock: another process may have moved it aside meanwhile, and written the next one.
  const Lock lock(path_, false);
  return read(path_);
}

std::vector<JournalEntry> Journal::orphans(const std::string& purpose) const {
  std::vector<JournalEntry> found = entries();
  found.erase(std::remove_if(found.begin(), found.end(),
                             [&](const JournalEntry& entry) {
                               return entry.purpose != purpose || entry.owner == self_ || alive_(entry.owner);
                             }),
              found.end());
  return found;
}

std::vector<JournalEntry> Journal::own() const {
  std::vector<JournalEntry> found = entries();
  found.erase(
      std::remove_if(found.begin(), found.end(), [&](const JournalEntry& entry) { return entry.owner != self_; }),
      found.end());
  return found;
}

void Journal::record(const std::string& id, const std::string& purpose, std::vector<UndoOperation> undo,
                     std::vector<JournalSubscription> subscriptions) {
  record({JournalRecord{id, purpose, std::move(undo), std::move(subscriptions)}});
}

void Journal::record(std::vector<JournalRecord> records) {
  if (records.empty()) {
    return;
  }
  const Lock lock(path_, waits_);
  showAlive(self_, path_);
  std::vector<JournalEntry> entries = read(path_);
  for (JournalRecord& record : records) {
    JournalEntry entry{record.id, record.purpose, self_, std::move(record.undo), "", std::move(record.subscriptions)};
    const auto same = entryOf(&entries, record.id);
    if (same == entries.end()) {
      entries.push_back(std::move(entry));
    } else if (same->owner != self_ && alive_(same->owner)) {
      throw JournalTakenError("'" + record.id + "' belongs to " + same->owner.node + " (process " +
                              std::to_string(same->owner.pid) + " on " + same->owner.computer +
                              "), which still runs: end it first");
    } else {
      *same = std::move(entry);
    }
  }
  write(path_, entries);
}

std::vector<UndoOperation> Journal::handOver(const std::string& id) {
  const auto is_own = [&](const JournalEntry& each) { return each.id == id && each.owner == self_; };
  std::vector<JournalEntry> entries = this->entries();
  const auto is_shared = [&](const UndoOperation& operation) {
    const auto* dref = std::get_if<UndoDref>(&operation);
    return dref != nullptr && std::any_of(entries.begin(), entries.end(), [&](const JournalEntry& each) {
             return each.owner != self_ && valueBefore({each}, dref->path) && alive_(each.owner);
           });
  };
  auto own = std::find_if(entries.begin(), entries.end(), is_own);
  if (own == entries.end() || std::none_of(own->undo.begin(), own->undo.end(), is_shared)) {
    return own == entries.end() ? std::vector<UndoOperation>() : own->undo;
  }
  const Lock lock(path_, waits_);
  entries = read(path_);
  own = std::find_if(entries.begin(), entries.end(), is_own);
  if (own == entries.end()) {
    return {};
  }
  std::vector<UndoOperation> left = own->undo;
  left.erase(std::remove_if(left.begin(), left.end(), is_shared), left.end());
  own->undo = left;
  if (left.empty()) {
    entries.erase(own);
  }
  write(path_, entries);
  return left;
}

void Journal::leave(const std::vector<std::string>& ids, const std::string& why) {
  const Lock lock(path_, waits_);
  std::vector<JournalEntry> entries = read(path_);
  for (JournalEntry& entry : entries) {
    if (entry.owner == self_ && std::find(ids.begin(), ids.end(), entry.id) != ids.end()) {
      entry.left = why;
    }
  }
  write(path_, entries);
}

void Journal::remove(const std::vector<std::string>& ids) {
  removeIf([&](const JournalEntry& entry) { return std::find(ids.begin(), ids.end(), entry.id) != ids.end(); });
}

void Journal::removeUndone(const std::vector<JournalEntry>& undone) {
  removeIf([&](const JournalEntry& entry) {
    return std::any_of(undone.begin(), undone.end(),
                       [&](const JournalEntry& each) { return each.id == entry.id && each.owner == entry.owner; });
  });
}

std::vector<JournalEntry> Journal::adopt(const std::vector<JournalEntry>& offered) {
  const Lock lock(path_, waits_);
  std::vector<JournalEntry> entries = read(path_);
  std::vector<JournalEntry> adopted;
  for (const JournalEntry& entry : offered) {
    const auto same = entryOf(&entries, entry.id);
    if (same == entries.end()) {
      entries.push_back(entry);
    } else if (same->owner == entry.owner || (same->owner != self_ && !alive_(same->owner))) {
      JournalEntry merged = entry;
      mergeUndo(same->undo, &merged.undo);
      mergeSubscriptions(same->subscriptions, &merged.subscriptions);
      *same = std::move(merged);
    } else {
      continue;
    }
    adopted.push_back(entry);
  }
  if (!adopted.empty()) {
    write(path_, entries);
  }
  return adopted;
}

void Journal::removeIf(const std::function<bool(const JournalEntry&)>& chosen) {
  const Lock lock(path_, waits_);
  std::vector<JournalEntry> entries = read(path_);
  const std::size_t before = entries.size();
  entries.erase(std::remove_if(entries.begin(), entries.end(), chosen), entries.end());
  if (entries.size() != before) {
    write(path_, entries);
  }
}

std::string journalPath(const std::string& folder, const std::string& host, std::uint16_t port) {
  std::string name = host;
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '-' && c != '_'; }, '-');
  return (fs::path(folder) / (name + "_" + std::to_string(port) + ".json")).string();
}

JournalFactory journalsIn(const std::string& folder, const std::string& node, LogFunction log) {
  const auto open = [folder, node](std::uint32_t address, std::uint16_t port) {
    return std::make_shared<Journal>(journalPath(folder, Endpoint{address, port}.addressString(), port),
                                     thisProcess(node));
  };
  return [open, log = std::move(log)](const Endpoint& peer) {
    std::vector<std::uint32_t> own = {kLoopbackAddress};
    try {
      own = ownAddresses();
    } catch (const SocketError& error) {
      log(LogLevel::kError, "whether " + peer.addressString() +
                                " is this computer is not known, and the journal is named after it: " + error.what());
    }
    if (std::none_of(own.begin(), own.end(), [&peer](std::uint32_t each) { return isSameHost(each, peer.address); })) {
      return open(peer.address, peer.port);
    }
    std::shared_ptr<Journal> journal = open(kLoopbackAddress, peer.port);
    for (const std::uint32_t address : own) {
      Journal earlier = open(address, peer.port)->withoutWaiting();
      if (earlier.path() == journal->path()) {
        continue;
      }
      try {
        std::vector<JournalEntry> left = earlier.entries();
        left.erase(std::remove_if(left.begin(), left.end(),
                                  [&](const JournalEntry& entry) { return isAlive(entry.owner, earlier.path()); }),
                   left.end());
        if (!left.empty()) {
          earlier.removeUndone(journal->withoutWaiting().adopt(left));
        }
      } catch (const JournalError& error) {
        log(LogLevel::kError, error.what());
      }
    }
    return journal;
  };
}

}  // namespace xplane_bridge::core
