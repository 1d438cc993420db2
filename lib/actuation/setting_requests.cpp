#include "xplane_bridge/actuation/setting_requests.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/simulator/simulator_settings.hpp"

namespace xplane_bridge {
namespace {

using core::ResultCode;

constexpr const char* kNoAnswer = " does not answer: is the name right?";
constexpr std::size_t kShownOfName = 80;  // [characters] of a name that is too long

// X-Plane keeps float32; integers come back exactly.
float toleranceOf(float value) { return 1e-4F * std::max(1.0F, std::abs(value)); }

/// What an override is held for, which set_dataref must not release, and how it comes to be given back; nullopt: no
/// part of tx_node but set_dataref holds it.
std::optional<std::string> useOf(const std::set<OverrideHolder>& holders) {
  if (holders.count(OverrideHolder::kControls) != 0) return "flies by: leave its controls out of the commands";
  if (holders.count(OverrideHolder::kSurfaces) != 0) {
    return "drives the surfaces by: clear their failures, and end control/surfaces and excitations of surfaces";
  }
  if (holders.count(OverrideHolder::kTraffic) != 0) return "places that aircraft by: leave it out of traffic/command";
  return std::nullopt;
}

}  // namespace

SettingRequests::SettingRequests(core::SimulatorPort* link, OverrideManager* overrides, double timeout, Report report)
    : link_(link), overrides_(overrides), timeout_(timeout), report_(std::move(report)) {}

/// In lock-step X-Plane shows it in the next frame, for which the caller may be awaited.
void SettingRequests::confirmLater(const std::vector<core::DatarefWrite>& writes, const std::string& what,
                                   const std::string& who) {
  std::vector<std::string> names;
  names.reserve(writes.size());
  for (const core::DatarefWrite& write : writes) names.push_back(write.dataref);
  link_->read(names, timeout_, [this, writes, what, who](const std::vector<core::DatarefValue>& values) {
    for (std::size_t i = 0; i < writes.size(); ++i) {
      if (values[i] && std::abs(*values[i] - writes[i].value) <= toleranceOf(writes[i].value)) continue;
      report_(what + ": X-Plane does not show it at " + writes[i].dataref, who, false);
      return;
    }
    report_(what + ": X-Plane shows it", who, true);
  });
}

RequestResult SettingRequests::writeAndConfirm(const std::vector<core::DatarefWrite>& writes, const std::string& what,
                                               const std::string& who) {
  if (!link_->status().up()) return noLink();
  const core::Deadline deadline(link_->clock(), timeout_);
  for (const core::DatarefWrite& write : writes) {
    const core::SendStatus sent = link_->write(write.dataref, write.value);
    if (sent != core::SendStatus::kSent) {
      return {ResultCode::kRefused, write.dataref + " is not sent: " + core::toString(sent)};
    }
  }
  if (link_->inLockstep()) {
    confirmLater(writes, what, who);
    return {ResultCode::kAccepted, "sent; an event will report whether X-Plane shows it"};
  }
  for (const core::DatarefWrite& write : writes) {
    const auto [fits, shown] =
        link_->waitForDataref(write.dataref, write.value, toleranceOf(write.value), std::max(deadline.left(), 0.01));
    if (fits) continue;
    return {ResultCode::kTimeout,
            write.dataref + (shown ? " shows " + std::to_string(*shown) + ", not " + std::to_string(write.value)
                                   : std::string(kNoAnswer))};
  }
  return {ResultCode::kOk, "X-Plane shows it"};
}

/// Those among what is to be written that are set are held from now on, those that are not are given back.
std::optional<RequestResult> SettingRequests::holdOverrides(const std::vector<core::DatarefWrite>& writes) {
  std::vector<std::string> set;
  for (const core::DatarefWrite& write : writes) {
    const auto release = core::releaseOf(write.dataref);
    if (!release) continue;
    const std::set<OverrideHolder> holders = overrides_->holders(write.dataref);
    const auto use = useOf(holders);
    const bool sets = write.value != release->value;
    if (sets) set.push_back(write.dataref);
    // Set on after driving has ended, that of the surfaces would leave them standing.
    if (!use || (sets && holders.count(OverrideHolder::kSurfaces) == 0)) continue;
    if (!sets) overrides_->release(OverrideHolder::kRequest, write.dataref);  // from now on only the others hold it
    return RequestResult{
        ResultCode::kRefused,
        write.dataref + " is what tx_node " + *use +
            (sets ? ", and set it then: until it is given back, tx_node has it set already"
                  : ", and it is given back; or run scripts/release_overrides, which ends all flying")};
  }
  // One that X-Plane does not have could never be seen released.
  if (!set.empty() && !link_->inLockstep()) {
    const auto shown = link_->read(set, timeout_);
    for (std::size_t i = 0; i < set.size(); ++i) {
      if (!shown[i]) return RequestResult{ResultCode::kTimeout, set[i] + kNoAnswer};
    }
  }
  try {
    for (const core::DatarefWrite& write : writes) {
      const auto release = core::releaseOf(write.dataref);
      if (!release) continue;
      if (write.value != release->value) {
        overrides_->acquire(OverrideHolder::kRequest, write.dataref, write.value);
      } else {
        overrides_->release(OverrideHolder::kRequest, write.dataref);
      }
    }
  } catch (const core::JournalError& error) {
    return RequestResult{ResultCode::kRefused, core::whyNotChanged(error)};
  }
  return std::nullopt;
}

SettingRequests::Written SettingRequests::setDataref(const std::string& name, const std::vector<float>& values,
                                                     const std::string& who) {
  const bool finite = std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
  if (values.empty() || !finite) {
    return {{ResultCode::kRefused, "values: expected one or more finite numbers"}, {}};
  }
  std::vector<std::string> names;
  try {
    names = core::consecutiveElements(name, values.size());
  } catch (const std::invalid_argument& error) {
    return {{ResultCode::kRefused, error.what()}, {}};
  }
  if (!link_->status().up()) return {noLink(), {}};
  std::vector<core::DatarefWrite> writes;
  for (std::size_t i = 0; i < names.size(); ++i) writes.push_back({names[i], values[i]});
  Written out;
  if (const auto refused = holdOverrides(writes)) {
    out.result = *refused;
    report_("set_dataref " + name + ": " + out.result.text, who, false);
    return out;
  }
  out.result = writeAndConfirm(writes, "set_dataref " + name, who);
  if (link_->inLockstep()) return out;
  for (const auto& value : link_->read(names, timeout_)) out.values.push_back(value.value_or(std::nanf("")));
  report_("set_dataref " + name + ": " + out.result.text, who, out.result.code == ResultCode::kOk);
  return out;
}

RequestResult SettingRequests::runCommand(const std::string& name) {
  if (!link_->status().up()) return noLink();
  const core::SendStatus sent = link_->command(name);
  if (sent == core::SendStatus::kNotEncoded) {
    return {ResultCode::kRefused, "name is \"" + name.substr(0, kShownOfName) +
                                      "\": expected one of X-Plane's commands, e.g. sim/operation/pause_toggle"};
  }
  if (sent != core::SendStatus::kSent) return {ResultCode::kRefused, name + ": " + core::toString(sent)};
  return {ResultCode::kAccepted, "sent; X-Plane never answers to a command"};
}

}  // namespace xplane_bridge
