#include "xplane_bridge/core/wire/wire_log.hpp"

#include <string>
#include <utility>

namespace xplane_bridge::core {
namespace {

constexpr double kWriteEvery = 0.2;  // [s]

}  // namespace

WireLog::WireLog(WireFileOptions options, Clock host, LogFunction log, std::size_t buffer_bytes)
    : file_(std::move(options)), host_(std::move(host)), log_(std::move(log)), buffer_bytes_(buffer_bytes) {
  for (std::vector<std::uint8_t>* buffer : {&filling_, &writing_}) {
    buffer->resize(buffer_bytes_);  // touches its pages now, not when a datagram comes
    buffer->clear();
  }
  log_(LogLevel::kInfo, "the wire is logged to " + file_.path());
  thread_ = std::thread([this] { run(); });
}

WireLog::~WireLog() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  changed_.notifyAll();
  thread_.join();
}

void WireLog::add(const WireRecord& record) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (filling_.size() + 2 * kWireRecordSize + record.payload.size() > buffer_bytes_) {
    ++gap_;
    ++lost_;
    return;
  }
  closeGap(record);
  appendRecord(record, &filling_);
}

/// Says how many records were left out until now.
void WireLog::closeGap(const WireRecord& now) {
  if (gap_ == 0) return;
  WireRecord gap = now;
  gap.kind = WireKind::kLost;
  gap.count = gap_;
  gap.payload = {};
  appendRecord(gap, &filling_);
  gap_ = 0;
}

std::uint64_t WireLog::lost() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return lost_;
}

void WireLog::run() {
  bool logged = false;
  const auto write = [&](bool last) {
    const bool written = file_.write(writing_) && (!last || file_.finish());
    writing_.clear();
    if (!written && !std::exchange(logged, true)) log_(LogLevel::kError, file_.problem());
  };
  std::unique_lock<std::mutex> lock(mutex_);
  for (bool last = false; !last;) {
    changed_.waitUntil(&lock, Deadline(host_, kWriteEvery), [this] { return ends_; });
    last = ends_;
    if (last) closeGap({});
    filling_.swap(writing_);
    lock.unlock();
    write(last);
    lock.lock();
  }
}

}  // namespace xplane_bridge::core
