#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "xplane_bridge/core/link/journal_owner.hpp"

namespace xplane_bridge {

/// The lock of a journal, as a process has it that hangs, or was stopped, while it was writing.
class HeldLock {
 public:
  explicit HeldLock(const std::string& journal)
      : fd_(open((journal + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
    EXPECT_EQ(flock(fd_, LOCK_EX), 0);
  }
  ~HeldLock() { close(fd_); }
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;

  /// Until `count` threads or processes wait for it.
  void awaitWaiters(int count) const {
    struct stat of {};
    ASSERT_EQ(fstat(fd_, &of), 0);
    const std::string inode = ":" + std::to_string(of.st_ino) + " ";
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    for (int waiting = 0; waiting < count && std::chrono::steady_clock::now() < end; std::this_thread::yield()) {
      std::ifstream locks("/proc/locks");
      waiting = 0;
      for (std::string line; std::getline(locks, line);) {
        waiting += line.find("->") != std::string::npos && line.find(inode) != std::string::npos ? 1 : 0;
      }
    }
  }

 private:
  int fd_;
};

/// The byte of an owner in the file beside the journal, as docs/nodes/journal.md has it: locked while the owner runs.
class OwnerByte {
 public:
  OwnerByte(const std::string& journal, const core::JournalOwner& owner)
      : fd_(open((std::filesystem::path(journal).parent_path() / "owners.lock").c_str(), O_RDONLY | O_CREAT | O_CLOEXEC,
                 0644)),
        start_(owner.start_ticks * 4194304 + owner.pid) {}
  ~OwnerByte() { close(fd_); }
  OwnerByte(const OwnerByte&) = delete;
  OwnerByte& operator=(const OwnerByte&) = delete;

  void lock() const {
    struct flock byte = of(F_RDLCK);
    EXPECT_EQ(fcntl(fd_, F_OFD_SETLK, &byte), 0);
  }
  void unlock() const {
    struct flock byte = of(F_UNLCK);
    EXPECT_EQ(fcntl(fd_, F_OFD_SETLK, &byte), 0);
  }
  bool isLockedByAnother() const {
    struct flock byte = of(F_WRLCK);
    EXPECT_EQ(fcntl(fd_, F_OFD_GETLK, &byte), 0);
    return byte.l_type != F_UNLCK;
  }

 private:
  struct flock of(int type) const {
    struct flock byte {};
    byte.l_type = static_cast<decltype(byte.l_type)>(type);
    byte.l_whence = SEEK_SET;
    byte.l_start = start_;
    byte.l_len = 1;
    return byte;
  }

  int fd_;
  off_t start_;
};

/// How often a file of a folder has been replaced by another one since.
class Replacements {
 public:
  explicit Replacements(const std::string& folder) {
    // Both: the kernel may take several equal events in a row for one.
    EXPECT_GE(inotify_add_watch(fd_, folder.c_str(), IN_MOVED_FROM | IN_MOVED_TO), 0);
  }
  ~Replacements() { close(fd_); }
  Replacements(const Replacements&) = delete;
  Replacements& operator=(const Replacements&) = delete;

  std::size_t count() const {
    std::size_t out = 0;
    std::array<char, 8192> events{};
    const ssize_t length = read(fd_, events.data(), events.size());
    for (ssize_t at = 0; at < length;) {
      inotify_event event{};
      std::memcpy(&event, events.data() + at, sizeof event);
      out += (event.mask & IN_MOVED_TO) != 0 ? 1U : 0U;
      at += static_cast<ssize_t>(sizeof event + event.len);
    }
    return out;
  }

 private:
  int fd_ = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
};

}  // namespace xplane_bridge
