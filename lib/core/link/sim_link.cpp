#include "xplane_bridge/core/link/sim_link.hpp"

#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sim_link_impl.hpp"

namespace xplane_bridge::core {
namespace {

/// Sends what an encoder has written to `buffer`.
template <typename Send>
SendStatus sendEncoded(const std::uint8_t* buffer, const EncodeResult& size, const Send& send) {
  return size.ok() ? send(ByteView(buffer, *size)) : SendStatus::kNotEncoded;
}

}  // namespace

const char* toString(SendStatus status) {
  switch (status) {
    case SendStatus::kSent:
      return "sent";
    case SendStatus::kNoPeer:
      return "X-Plane has not been found";
    case SendStatus::kNotEncoded:
      return "not a valid message";
    case SendStatus::kSocketError:
      return "refused by the operating system";
  }
  return "invalid";
}

SimLink::SimLink(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log,
                 JournalFactory journals)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(callbacks), std::move(clock), std::move(log),
                                   std::move(journals))) {}

SimLink::~SimLink() {
  constexpr double kLastWordS = 1.0;
  impl_->stop(kLastWordS);
}

void SimLink::start() { impl_->start(); }
bool SimLink::stop(double timeout_s) { return impl_->stop(timeout_s); }
void SimLink::step(int timeout_ms) { impl_->step(timeout_ms); }
GroupId SimLink::addGroup(RrefGroup group) { return impl_->addGroup(std::move(group)); }
void SimLink::replaceGroup(GroupId id, RrefGroup group) { impl_->replaceGroup(id, std::move(group)); }
void SimLink::removeGroup(GroupId id) { impl_->removeGroup(id); }
void SimLink::setRposRate(std::int32_t rate_hz) { impl_->setRposRate(rate_hz); }
void SimLink::setDataRows(std::vector<std::int32_t> rows) { impl_->setDataRows(std::move(rows)); }
LinkStatus SimLink::status() const { return impl_->status(); }
LinkCounters SimLink::counters() const { return impl_->counters(); }
std::vector<std::string> SimLink::unansweredDatarefs() const { return impl_->unansweredDatarefs(); }
std::shared_ptr<Journal> SimLink::journal() const { return impl_->journal(); }
std::uint16_t SimLink::dataPort() const { return impl_->dataPort(); }
std::uint16_t SimLink::beaconPort() const { return impl_->beaconPort(); }
SendStatus SimLink::send(ByteView message) { return impl_->send(message); }

SendStatus SimLink::sendDref(std::string_view path, float value) {
  std::array<std::uint8_t, kDrefSize> buffer;
  return sendEncoded(buffer.data(), encodeDref(buffer, path, value), [this](ByteView bytes) { return send(bytes); });
}

SendStatus SimLink::sendCommand(std::string_view path) {
  std::array<std::uint8_t, kMaxCmndSize> buffer;
  return sendEncoded(buffer.data(), encodeCmnd(buffer, path), [this](ByteView bytes) { return send(bytes); });
}

SendStatus SimLink::sendData(const DataRow* rows, std::size_t count) {
  std::array<std::uint8_t, kMaxDataSize> buffer;
  return sendEncoded(buffer.data(), encodeData(buffer, rows, count), [this](ByteView bytes) { return send(bytes); });
}

SendStatus SimLink::sendUndo(const UndoOperation& operation) {
  std::array<std::uint8_t, kMaxUndoSize> buffer;
  return sendEncoded(buffer.data(), encodeUndo(buffer, operation), [this](ByteView bytes) { return send(bytes); });
}

void SimLink::readDatarefs(std::vector<std::string> paths, double timeout_s,
                           std::function<void(const std::vector<DatarefValue>&)> done) {
  impl_->read(std::move(paths), timeout_s, {}, std::move(done));
}

std::vector<DatarefValue> SimLink::readDatarefs(std::vector<std::string> paths, double timeout_s) {
  return impl_->readAndWait(std::move(paths), timeout_s, {});
}

std::vector<DatarefValue> SimLink::readDatarefsUntil(std::vector<std::string> paths, double timeout_s,
                                                     const DatarefReader::Accept& fits) {
  return impl_->readAndWait(std::move(paths), timeout_s, fits);
}

std::pair<bool, DatarefValue> SimLink::waitForDataref(const std::string& path, float expected, float tolerance,
                                                      double timeout_s) {
  const auto fits = [expected, tolerance](const std::vector<DatarefValue>& values) {
    return values[0].has_value() && std::abs(*values[0] - expected) <= tolerance;
  };
  const std::vector<DatarefValue> values = impl_->readAndWait({path}, timeout_s, fits);
  return {fits(values), values[0]};
}

bool SimLink::undo(const std::vector<UndoOperation>& operations, double timeout_s) {
  constexpr float kTolerance = 1e-3F;
  std::vector<std::string> paths;
  std::vector<float> expected;
  bool sent = true;
  for (const UndoOperation& operation : operations) {
    sent = sendUndo(operation) == SendStatus::kSent && sent;
    if (const auto* dref = std::get_if<UndoDref>(&operation)) {
      paths.push_back(dref->path);
      expected.push_back(dref->value);
    }
  }
  if (paths.empty() || !sent) {
    return sent;
  }
  // By value: the link may look at values after the wait was given up.
  const auto fits = [expected](const std::vector<DatarefValue>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!values[i].has_value() || !(std::abs(*values[i] - expected[i]) <= kTolerance)) {
        return false;
      }
    }
    return true;
  };
  return fits(impl_->readAndWait(std::move(paths), timeout_s, fits));
}

}  // namespace xplane_bridge::core
