#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/wire/wire_file.hpp"
#include "xplane_bridge/core/wire/wire_record.hpp"

namespace xplane_bridge::core {

/// A wire log: records are taken into memory by whichever thread has them, and written by a thread of their own at
/// least five times a second. Nothing ever waits for the disk: where the memory is full, records are left out, and a
/// record says how many.
class WireLog {
 public:
  /// Twice this much memory is taken at once.
  static constexpr std::size_t kBufferBytes = std::size_t{8} << 20U;

  /// `host`: by whose time it is written. @throws std::runtime_error where the file cannot be made
  WireLog(WireFileOptions options, Clock host, LogFunction log, std::size_t buffer_bytes = kBufferBytes);
  /// Writes what is left.
  ~WireLog();
  WireLog(const WireLog&) = delete;
  WireLog& operator=(const WireLog&) = delete;

  /// From any thread; takes well below a microsecond.
  void add(const WireRecord& record);
  /// Records left out so far.
  std::uint64_t lost() const;

 private:
  void run();
  void closeGap(const WireRecord& now);

  WireFile file_;
  Clock host_;
  LogFunction log_;
  const std::size_t buffer_bytes_;
  mutable std::mutex mutex_;
  ClockCondition changed_;
  std::vector<std::uint8_t> filling_;
  std::vector<std::uint8_t> writing_;  // of the thread
  std::uint32_t gap_ = 0;              // records left out since the last one that was not
  std::uint64_t lost_ = 0;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace xplane_bridge::core
