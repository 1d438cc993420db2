#include "xplane_bridge/core/link/sim_link.hpp"

#include <optional>
#include <utility>

#include "sim_link_impl.hpp"

namespace xplane_bridge::core {

SimLink::SimLink(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log,
                 JournalFactory journals)
    : impl_(std::make_shared<Impl>(std::move(options), std::move(callbacks), std::move(clock), std::move(log),
                                   std::move(journals))) {}

SimLink::~SimLink() {
  constexpr double kLastWordS = 1.0;
  impl_->stop(kLastWordS);
}

void SimLink::start() { impl_->start(); }
bool SimLink::stop(double timeout_s) { return impl_->stop(timeout_s); }
void SimLink::step(int timeout_ms) { impl_->step(timeout_ms); }
void SimLink::setRposRate(std::int32_t rate_hz) { impl_->setRposRate(rate_hz); }
void SimLink::setDataRows(std::vector<std::int32_t> rows) { impl_->setDataRows(std::move(rows)); }
LinkStatus SimLink::status() const { return impl_->status(); }
LinkCounters SimLink::counters() const { return impl_->counters(); }
std::vector<std::string> SimLink::unansweredDatarefs() const { return impl_->unansweredDatarefs(); }
std::shared_ptr<Journal> SimLink::journal() const { return impl_->journal(); }
std::uint16_t SimLink::dataPort() const { return impl_->dataPort(); }
std::uint16_t SimLink::beaconPort() const { return impl_->beaconPort(); }
const Clock& SimLink::clock() const { return impl_->clock(); }
SendStatus SimLink::send(ByteView message) { return impl_->send(message); }

Subscription SimLink::subscribe(RrefGroup group, RrefHandler handler, std::shared_ptr<HandlerMutex> mutex) {
  auto delivery = std::make_shared<RrefDelivery>(std::move(handler), std::move(mutex));
  const auto change = [link = std::weak_ptr<Impl>(impl_), delivery](std::uint32_t list,
                                                                    std::optional<RrefGroup> group_now) {
    if (const std::shared_ptr<Impl> impl = link.lock()) {
      impl->changeGroup(delivery, list, std::move(group_now));
    }
  };
  return {delivery, change, std::move(group)};
}

void SimLink::read(std::vector<std::string> paths, double timeout_s, DatarefReader::Done done) {
  impl_->read(std::move(paths), timeout_s, {}, std::move(done));
}

std::vector<DatarefValue> SimLink::readUntil(std::vector<std::string> paths, double timeout_s,
                                             DatarefReader::Accept accept) {
  return impl_->readAndWait(std::move(paths), timeout_s, accept);
}

bool SimLink::waitUntil(const std::function<bool()>& condition, double timeout_s) {
  return impl_->waitUntil(condition, timeout_s);
}

}  // namespace xplane_bridge::core
