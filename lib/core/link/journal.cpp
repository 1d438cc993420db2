#include "xplane_bridge/core/link/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "xplane_bridge/core/base/whole_number.hpp"

namespace xplane_bridge::core {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kFormat = "xplane_bridge journal";
constexpr int kVersion = 1;

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

/// JSON has no other numbers: with null in the place of one the whole file could not be read any more.
void requireFinite(const std::string& what, float value) {
  if (!std::isfinite(value)) {
    throw JournalError("the journal cannot hold " + std::to_string(value) + " as what " + what +
                       " is to be put back to: expected a finite number");
  }
}

json toJson(const UndoOperation& operation) {
  struct Writer {
    json operator()(const UndoDref& dref) const {
      requireFinite(dref.path, dref.value);
      json out = {{"op", "dref"}, {"path", dref.path}, {"value", dref.value}};
      if (!dref.confirm) {
        out["confirm"] = false;
      }
      return out;
    }
    json operator()(const UndoData& data) const {
      for (const float value : data.row.values) {
        requireFinite("row " + std::to_string(data.row.index), value);
      }
      return {{"op", "data"}, {"row", data.row.index}, {"values", data.row.values}};
    }
    json operator()(const UndoUsel& usel) const { return {{"op", "usel"}, {"rows", usel.rows}}; }
    json operator()(const UndoIse4& ise4) const {
      return {{"op", "ise4_off"}, {"target", ise4.target}, {"address", ise4.address}, {"port", ise4.port}};
    }
    json operator()(const UndoPause&) const { return {{"op", "resume"}}; }
  };
  return std::visit(Writer{}, operation);
}

UndoOperation operationFrom(const json& document) {
  const std::string op = document.at("op");
  if (op == "dref") {
    return UndoDref{document.at("path"), document.at("value"), document.value("confirm", true)};
  }
  if (op == "data") {
    return UndoData{DataRow{wholeNumber<std::int32_t>(document.at("row")), document.at("values")}};
  }
  if (op == "usel") {
    UndoUsel usel;
    for (const json& row : document.at("rows")) {
      usel.rows.push_back(wholeNumber<std::int32_t>(row));
    }
    return usel;
  }
  if (op == "ise4_off") {
    return UndoIse4{wholeNumber<std::int32_t>(document.at("target")), document.at("address"),
                    wholeNumber<std::uint16_t>(document.at("port"))};
  }
  if (op == "resume") {
    return UndoPause{};
  }
  throw JournalError("unknown operation '" + op + "'");
}

json toJson(const JournalEntry& entry) {
  json undo = json::array();
  for (const UndoOperation& operation : entry.undo) {
    undo.push_back(toJson(operation));
  }
  json document = {{"id", entry.id},
                   {"purpose", entry.purpose},
                   {"owner",
                    {{"node", entry.owner.node},
                     {"pid", entry.owner.pid},
                     {"start_ticks", entry.owner.start_ticks},
                     {"boot_id", entry.owner.boot_id},
                     {"computer", entry.owner.computer}}},
                   {"undo", undo}};
  if (!entry.left.empty()) {
    document["left"] = entry.left;
  }
  for (const JournalSubscription& subscription : entry.subscriptions) {
    document["subscriptions"].push_back(
        {{"port", subscription.port}, {"datarefs", subscription.datarefs}, {"rpos", subscription.rpos}});
  }
  return document;
}

JournalEntry entryFrom(const json& document) {
  JournalEntry entry;
  entry.id = document.at("id");
  entry.purpose = document.at("purpose");
  const json& owner = document.at("owner");
  entry.owner.node = owner.at("node");
  entry.owner.pid = wholeNumber<std::int64_t>(owner.at("pid"));
  entry.owner.start_ticks = wholeNumber<std::int64_t>(owner.at("start_ticks"));
  entry.owner.boot_id = owner.at("boot_id");
  entry.owner.computer = owner.at("computer");
  for (const json& operation : document.at("undo")) {
    entry.undo.push_back(operationFrom(operation));
  }
  entry.left = document.value("left", "");
  for (const json& subscription : document.value("subscriptions", json::array())) {
    entry.subscriptions.push_back({wholeNumber<std::uint16_t>(subscription.at("port")),
                                   subscription.at("datarefs").get<std::vector<std::string>>(),
                                   subscription.at("rpos")});
  }
  return entry;
}

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

/// What a file holds, or why it cannot be understood.
struct Content {
  std::vector<JournalEntry> entries;
  std::string damage;
};

Content look(const std::string& path) {
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
  int version = 0;
  Content content;
  try {
    const json document = json::parse(text.str());
    if (document.at("format") != kFormat) {
      content.damage = "format is not '" + std::string(kFormat) + "'";
    } else {
      version = wholeNumber<int>(document.at("version"));
    }
    if (version == kVersion) {
      for (const json& entry : document.at("entries")) {
        content.entries.push_back(entryFrom(entry));
      }
    }
  } catch (const json::exception& error) {
    content.damage = error.what();
  } catch (const JournalError& error) {
    content.damage = error.what();
  } catch (const std::out_of_range& error) {
    content.damage = error.what();
  }
  if (content.damage.empty() && version != kVersion) {
    fail(path, "has version " + std::to_string(version) + ", this program knows version " + std::to_string(kVersion) +
                   " only: use the xplane_bridge that wrote it to undo its entries, or delete it");
  }
  return content;
}

/// With the lock held.
std::vector<JournalEntry> read(const std::string& path) {
  Content content = look(path);
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
  json document = {{"format", kFormat}, {"version", kVersion}, {"entries", json::array()}};
  for (const JournalEntry& entry : entries) {
    document["entries"].push_back(toJson(entry));
  }
  const std::string temporary = path + ".new";
  {
    const FileDescriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (file.get() < 0) {
      failErrno(temporary, "cannot be opened");
    }
    writeAll(file.get(), document.dump(2) + "\n", temporary);
    if (fsync(file.get()) != 0) {
      failErrno(temporary, "cannot be synchronised");
    }
  }
  if (::rename(temporary.c_str(), path.c_str()) != 0) {
    failErrno(path, "cannot be replaced");
  }
  syncFolder(path);
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

std::shared_ptr<Journal> Journal::ofSubscriptions() const {
  const fs::path path(path_);
  const fs::path beside = path.parent_path() / (path.stem().string() + "_subscriptions" + path.extension().string());
  return std::make_shared<Journal>(beside.string(), self_, alive_, waits_);
}

std::vector<JournalEntry> Journal::entries() const {
  Content content = look(path_);
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
    const auto same =
        std::find_if(entries.begin(), entries.end(), [&](const JournalEntry& each) { return each.id == record.id; });
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

JournalFactory journalsIn(const std::string& folder, const std::string& node) {
  return [folder, node](const Endpoint& peer) {
    // One file whatever loopback address the X-Plane of this computer is called by.
    const Endpoint named{isSameHost(peer.address, kLoopbackAddress) ? kLoopbackAddress : peer.address, peer.port};
    return std::make_shared<Journal>(journalPath(folder, named.addressString(), named.port), thisProcess(node));
  };
}

}  // namespace xplane_bridge::core
