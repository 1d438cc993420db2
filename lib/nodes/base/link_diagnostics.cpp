#include "xplane_bridge/nodes/base/link_diagnostics.hpp"

#include <cstdint>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge {
namespace {

using diagnostic_msgs::DiagnosticStatus;

unsigned char severity(core::LinkState state) {
  switch (state) {
    case core::LinkState::kConnected:
    case core::LinkState::kPaused:
      return DiagnosticStatus::OK;
    case core::LinkState::kLost:
      return DiagnosticStatus::ERROR;
    default:
      return DiagnosticStatus::WARN;
  }
}

}  // namespace

void fillLinkDiagnostics(const core::LinkStatus& link, const core::LinkCounters& now, const core::LinkCounters& last,
                         const std::vector<std::string>& unanswered,
                         diagnostic_updater::DiagnosticStatusWrapper* status) {
  status->summary(severity(link.state), std::string(core::toString(link.state)) + ": " + link.reason);
  for (const std::string& problem : link.problems) {
    if (link.reason.find(problem) == std::string::npos) {
      status->mergeSummary(DiagnosticStatus::WARN, problem);
    }
  }
  if (now.udp.dropped > last.udp.dropped) {
    status->mergeSummaryf(DiagnosticStatus::WARN,
                          "the kernel dropped %llu datagrams since the last report: the machine is too busy",
                          static_cast<unsigned long long>(now.udp.dropped - last.udp.dropped));
  }
  if (!unanswered.empty()) {
    const std::string names = core::join(unanswered);
    status->mergeSummary(DiagnosticStatus::WARN, "X-Plane never answers: " + names);
    status->add("Unanswered datarefs", names);
  }

  status->add("X-Plane", link.peer.valid() ? link.peer.toString() : "not found");
  status->add("X-Plane's computer", link.computer_name);
  status->add("X-Plane version", link.version.known() ? std::to_string(link.version.number) : "unknown");
  status->add("DATA comes, nothing answers", link.one_way);
  status->add("Link epoch (-)", link.epoch);
  status->add("Silence (s)", link.silence_s);
  status->add("Beacons heard (-)", link.beacons.size());
  status->add("Datagrams since last report (-)", now.udp.received - last.udp.received);
  status->add("Bytes since last report (-)", now.udp.received_bytes - last.udp.received_bytes);
  status->add("RREF datagrams (-)", now.rref_datagrams);
  status->add("DATA datagrams (-)", now.data_datagrams);
  status->add("RPOS datagrams (-)", now.rpos_datagrams);
  status->add("Beacon datagrams (-)", now.beacons);
  status->add("Dropped by the kernel (-)", now.udp.dropped);
  status->add("Receive buffer (bytes)", now.receive_buffer);
  status->add("Longer than the buffer (-)", now.udp.truncated);
  status->add("From strangers (-)", now.strangers);
  for (std::size_t reason = 1; reason < core::kDecodeErrorCount; ++reason) {
    status->add(std::string("Not decoded, ") + core::toString(static_cast<core::DecodeError>(reason)) + " (-)",
                now.decode_errors[reason]);
  }
  status->add("Unknown DATA rows (-)", now.unknown_rows);
  status->add("Non-finite values (-)", now.non_finite_values);
  status->add("Values not requested (-)", now.unknown_indices);
  status->add("Subscription requests (-)", now.requests);
  status->add("Subscriptions repeated (-)", now.resubscriptions);
  status->add("Calls refused, link behind (-)", now.refused_calls);
  status->add("Send failures (-)", now.udp.send_failures);
  status->add("Port unreachable (-)", now.udp.refused);
}

}  // namespace xplane_bridge
