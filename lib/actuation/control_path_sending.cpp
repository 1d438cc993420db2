// ControlPath's way down and back: what is sent to X-Plane, what is left out, and whether X-Plane shows it.

#include <algorithm>
#include <utility>

#include "xplane_bridge/actuation/control_path.hpp"
#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/control/control_rows.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

constexpr double kHandleRepeat = 0.3;             // [s] in which a changed handle is sent with every refresh
constexpr double kMissingTimeout = 2.0;           // [s] of asking for it once
constexpr double kReadBackTimeout = 1.0;          // [s] without read-back until it is said
constexpr std::size_t kMaxAwaitingReadBack = 64;  // two frames of 200 commands and 20 frames a second, three times

void leaveOut(core::Channel channel, core::ArbitratedControls* controls) {
  controls->active.reset(core::index(channel));
  const std::uint32_t field = core::fieldOf(channel);
  controls->fields &= ~field;
  controls->limited &= ~field;
  controls->excited &= ~field;
}

}  // namespace

/// Once for each aircraft, whose file does not change while it is loaded.
void ControlPath::askMissing() {
  missing_.clear();
  missing_reported_.reset();
  link_->read(core::trimDatarefs(), kMissingTimeout, [this](const std::vector<core::DatarefValue>& values) {
    const std::lock_guard<core::HandlerMutex> lock(*mutex_);
    missing_ = core::missingTrims(values);
  });
}

core::ChannelSet ControlPath::missingChannels() const {
  core::ChannelSet out;
  for (const core::MissingChannel& missing : missing_) out.set(core::index(missing.channel));
  return out;
}

/// The rest of a command is flown: a stick goes on though one of its levers has nothing to move.
core::ArbitratedControls ControlPath::withoutMissing(core::ArbitratedControls controls) {
  if (standing_ != Standing::kFlying) return controls;
  for (const core::MissingChannel& missing : missing_) {
    const std::size_t channel = core::index(missing.channel);
    if (!controls.active.test(channel)) continue;
    leaveOut(missing.channel, &controls);
    if (missing_reported_.test(channel)) continue;
    missing_reported_.set(channel);
    hooks_.event(ControlPathHooks::Kind::kMissing, core::channelName(missing.channel) + " is not sent: " + missing.why,
                 "");
  }
  return controls;
}

/// Whether X-Plane can be asked, and has shown whether it is the one of before: what is written with a release is not
/// for another.
bool ControlPath::canGiveBack() const { return link_status_.up() && flight_shown_; }

/// Whether anything is sent. What cannot be is left out of the controls.
bool ControlPath::fly(core::ArbitratedControls* controls, double time) {
  if (controls->active.none()) {
    // What was taken last, be it by a test signal alone, is X-Plane's again as soon as X-Plane can be asked.
    if (taken_ && canGiveBack()) {
      overrides_->setRequired({});
      taken_ = false;
    }
    return false;
  }
  if (standing_ != Standing::kFlying) {
    warnOnce("commands are not sent: " + why_not_);
    if (canGiveBack()) overrides_->setRequired({});
    return false;
  }
  taken_ = true;
  try {
    overrides_->setRequired(core::requiredOverrides(controls->active, encoder_.options()));
    last_warning_.clear();
  } catch (const core::JournalError& error) {
    // What is held is flown on: left alone it would stand where it is, with X-Plane's own stick dead.
    const std::vector<core::Channel> refused = notHeld(controls->active);
    for (const core::Channel channel : refused) leaveOut(channel, controls);
    const bool some = controls->active.any();
    warnOnce("commands" + (some ? " of " + core::join(refused, ", ", core::channelName) : "") +
             " are not sent: " + core::whyNotChanged(error));
    if (!some) return false;
  }
  writes_.clear();
  const core::ChannelSet now = channelsToSend(*controls, time);
  encoder_.encode(controls->values, now, writes_);
  for (const core::DatarefWrite& write : writes_) link_->write(write.dataref, write.value);
  sendRows(*controls, now);
  prepareLevers(*controls);
  last_send_ = time;
  publishApplied(*controls, now);
  watchReadBack(controls->active);
  return true;
}

/// Those whose overrides are not set.
std::vector<core::Channel> ControlPath::notHeld(const core::ChannelSet& channels) const {
  const std::vector<std::string> set = overrides_->active();
  std::vector<core::Channel> out;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!channels.test(i)) continue;
    core::ChannelSet one;
    one.set(i);
    const std::vector<std::string> needed = core::requiredOverrides(one, encoder_.options());
    const bool held = std::all_of(needed.begin(), needed.end(), [&set](const std::string& name) {
      return std::find(set.begin(), set.end(), name) != set.end();
    });
    if (!held) out.push_back(static_cast<core::Channel>(i));
  }
  return out;
}

void ControlPath::warnOnce(const std::string& text) {
  if (std::exchange(last_warning_, text) != text) hooks_.warn(text);
}

void ControlPath::sendRows(const core::ArbitratedControls& controls, const core::ChannelSet& now) {
  const std::vector<core::DataRow> rows = core::controlRows(controls.values, controls.active, now, encoder_.options());
  if (rows.empty()) return;
  std::array<std::uint8_t, core::kHeaderSize + 4 * core::kDataRowSize> buffer;
  const core::EncodeResult size = core::encodeData(buffer, rows.data(), rows.size());
  if (size) link_->send({buffer.data(), *size});
}

/// When their override ends, motors go by their levers at once: those are to be where the motors are by then.
void ControlPath::prepareLevers(const core::ArbitratedControls& controls) {
  std::vector<core::UndoOperation> levers;
  for (int engine = 0; engine < core::kMaxEngines; ++engine) {
    const std::size_t motor = core::index(core::motorChannel(engine));
    if (!controls.active.test(motor)) continue;
    const core::Channel lever = core::leverChannel(engine);
    const double position = std::clamp(controls.values[motor], options_.reverse_thrust ? -1.0 : 0.0, 1.0);
    levers.emplace_back(core::UndoDref{core::writeDataref(lever, encoder_.options()), core::wireValue(lever, position),
                                       /*confirm=*/false});
  }
  if (levers.empty()) return;
  const char* override_name = core::channelWire(core::motorChannel(0), encoder_.options()).override_name;
  overrides_->prepareRelease(override_name, std::move(levers));
}

core::ChannelSet ControlPath::channelsToSend(const core::ArbitratedControls& controls, double time) {
  const core::ChannelSet commanded = arbiter_.commanded();
  // A handle that is commanded anew is sent, also with the value of before: the cockpit may have moved it since. A
  // change of the mode alone begins no command.
  core::ChannelSet& before = commanded_.at(static_cast<std::size_t>(arbiter_.status().mode));
  ever_sent_ &= ~(commanded & ~std::exchange(before, commanded));
  core::ChannelSet out;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!controls.active.test(i)) continue;
    const auto channel = static_cast<core::Channel>(i);
    if (isHandle(channel)) {
      // What is only held since its source fell silent is not put into a flight that began without it.
      if (!ever_sent_.test(i) && !commanded.test(i)) continue;
      if (!ever_sent_.test(i) || last_values_[i] != controls.values[i]) {
        changed_at_[i] = time;
        handles_shown_.reset(i);
      }
      last_values_[i] = controls.values[i];
      // Sent a few times, because a datagram may be lost; then it may be moved in the cockpit.
      if (time - changed_at_[i] > kHandleRepeat) continue;
    }
    ever_sent_.set(i);
    out.set(i);
  }
  return out;
}

// --- read-back ---

/// X-Plane is no longer where it was sent.
void ControlPath::forgetApplied() {
  ever_sent_.reset();
  awaiting_read_back_.clear();
}

void ControlPath::publishApplied(const core::ArbitratedControls& controls, const core::ChannelSet& sent) {
  AppliedControls applied;
  applied.controls = controls;
  applied.sent = sent;
  applied.sent_ns = link_->clock().system_ns();
  applied.sim_time = watch_.sim_time;
  hooks_.applied(applied);
  // Handles that go by themselves by now, which takes some of them seconds.
  if (sent.none()) applied.sent = controls.active & ever_sent_;
  if (applied.sent.none()) return;
  if (awaiting_read_back_.empty()) last_followed_ = now();  // until now there was nothing to show
  awaiting_read_back_.push_back(applied);
  if (awaiting_read_back_.size() > kMaxAwaitingReadBack) awaiting_read_back_.pop_front();
}

void ControlPath::watchReadBack(const core::ChannelSet& channels) {
  if (channels == watched_) return;
  watched_ = channels;
  watched_order_.clear();
  read_back_known_.reset();
  core::RrefGroup group{"read-back", {core::flightWatchDatarefs().front()}, core::kEveryFrameRateHz, 1};
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!channels.test(i)) continue;
    watched_order_.push_back(static_cast<core::Channel>(i));
    group.datarefs.push_back(core::readBackDataref(static_cast<core::Channel>(i), encoder_.options()));
  }
  if (read_back_) {
    read_back_.replace(std::move(group));
  } else {
    read_back_ = link_->subscribe(
        std::move(group), [this](const core::RrefView& view, const core::ReceiveInfo&) { onReadBack(view); }, mutex_);
  }
}

void ControlPath::onReadBack(const core::RrefView& view) {
  double sim_time = watch_.sim_time;
  for (std::size_t i = 0; i < view.size(); ++i) {
    const core::RrefPair pair = view[i];
    if (pair.index == 0) sim_time = static_cast<double>(pair.value);
    if (pair.index < 1 || static_cast<std::size_t>(pair.index) > watched_order_.size()) continue;
    const std::size_t channel = core::index(watched_order_[static_cast<std::size_t>(pair.index) - 1]);
    read_back_values_[channel] = static_cast<double>(pair.value);
    read_back_known_.set(channel);
    if (isHandle(static_cast<core::Channel>(channel)) && ever_sent_.test(channel) &&
        isShown(channel, last_values_[channel])) {
      handles_shown_.set(channel);
    }
  }
  // The newest that fits: older ones were overtaken.
  for (auto it = awaiting_read_back_.rbegin(); it != awaiting_read_back_.rend(); ++it) {
    bool all = true;
    for (std::size_t i = 0; i < core::kChannelCount && all; ++i) {
      // A handle that was shown may be moved in the cockpit, also while it is still repeated.
      if (!it->sent.test(i) || handles_shown_.test(i)) continue;
      all = isShown(i, it->controls.values[i]);
    }
    // What stood there before the command reached X-Plane is not its doing.
    const bool too_early = link_status_.state != core::LinkState::kPaused && sim_time <= it->sim_time;
    if (!all || too_early) continue;
    it->read_back = true;
    it->read_back_sim_time = sim_time;
    it->read_back_frames = (sim_time - it->sim_time) / watch_.frame_period;
    hooks_.applied(*it);
    last_followed_ = now();
    awaiting_read_back_.erase(awaiting_read_back_.begin(), it.base());
    return;
  }
}

std::vector<std::string> ControlPath::notFollowed() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  std::vector<std::string> out;
  if (link_status_.state != core::LinkState::kConnected) return out;
  const double time = now();
  const bool waits = !awaiting_read_back_.empty() && time - last_followed_ > kReadBackTimeout;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    const auto channel = static_cast<core::Channel>(i);
    bool late = false;
    if (isHandle(channel)) {
      late =
          watched_.test(i) && ever_sent_.test(i) && !handles_shown_.test(i) && time - changed_at_[i] > kReadBackTimeout;
    } else if (waits && awaiting_read_back_.back().sent.test(i)) {
      late = !isShown(i, awaiting_read_back_.back().controls.values[i]);
    }
    if (late) out.push_back(core::channelName(channel));
  }
  return out;
}

/// One that is sent for a while after a change, and may be moved in the cockpit after that.
bool ControlPath::isHandle(core::Channel channel) const {
  return core::channelWire(channel, encoder_.options()).refresh == core::Refresh::kOnChange;
}

bool ControlPath::isShown(std::size_t channel, double value) const {
  return read_back_known_.test(channel) &&
         encoder_.matches(static_cast<core::Channel>(channel), value, read_back_values_[channel]);
}

}  // namespace xplane_bridge
