#include "xplane_bridge/core/control/control_arbiter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <stdexcept>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kRequestersKept = 100;  // whose sequence numbers are remembered
constexpr std::array<Channel, 3> kStick = {Channel::kRoll, Channel::kPitch, Channel::kYaw};

const char* topicOf(FlightMode mode) { return mode == FlightMode::kManual ? "control/manual" : "control/auto"; }

}  // namespace

std::uint64_t SourceStatistics::refusedTotal() const {
  return std::accumulate(refused.begin(), refused.end(), std::uint64_t{0});
}

ChannelOptions channelDefaults(const ChannelSection& section, Failsafe failsafe, bool reverse_thrust) {
  const ChannelRange range = commandRange(section.first);
  ChannelOptions out;
  out.low = isLever(section.first) && !reverse_thrust ? 0.0 : range.low;
  out.high = range.high;
  const bool handle = channelWire(section.first, {}).refresh == Refresh::kOnChange;
  out.failsafe = handle ? Failsafe::kHold : failsafe;
  return out;
}

ArbiterOptions::ArbiterOptions() {
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    const ChannelRange range = commandRange(static_cast<Channel>(i));
    channels[i].low = range.low;
    channels[i].high = range.high;
    const bool handle = channelWire(static_cast<Channel>(i), {}).refresh == Refresh::kOnChange;
    if (handle) channels[i].failsafe = Failsafe::kHold;
  }
}

std::optional<std::string> validate(const ArbiterOptions& o) {
  if (o.engines < 1 || o.engines > kMaxEngines) return wrongNumber("engines", o.engines, "1..8");
  if (!(o.command_timeout > 0.0)) return wrongNumber("command_timeout", o.command_timeout, "above 0 s");
  if (!(o.resume_grace >= 0.0)) return wrongNumber("resume_grace", o.resume_grace, "0 s or more");
  if (!(o.transition_rate > 0.0)) return wrongNumber("transition_rate", o.transition_rate, "above 0 1/s");
  if (!(o.takeover_threshold >= 0.0)) return wrongNumber("takeover_threshold", o.takeover_threshold, "0 or more");
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    const auto channel = static_cast<Channel>(i);
    const ChannelRange range = commandRange(channel);
    const ChannelOptions& c = o.channels[i];
    const std::string key = "channels." + channelName(channel) + ".";
    char limits[64];
    std::snprintf(limits, sizeof limits, "%g..%g", range.low, range.high);
    if (!(c.low >= range.low && c.low <= range.high)) return wrongNumber(key + "low", c.low, limits);
    if (!(c.high >= c.low && c.high <= range.high)) {
      return wrongNumber(key + "high", c.high, std::string(limits) + ", not below low");
    }
    if (!(c.slew > 0.0)) return wrongNumber(key + "slew", c.slew, "above 0 1/s");
    if (!(c.neutral >= c.low && c.neutral <= c.high)) return wrongNumber(key + "neutral", c.neutral, "low..high");
  }
  return std::nullopt;
}

ControlArbiter::ControlArbiter(const ArbiterOptions& options, double now) : options_(options), now_(now) {
  if (const auto text = validate(options)) throw std::invalid_argument(*text);
  stick_reference_.fill(kUnset);
  status_.mode = options.initial_mode;
  status_.since = now;
}

void ControlArbiter::advance(double now) {
  if (time_running_ && now > now_) running_time_ += now - now_;
  now_ = std::max(now_, now);
}

void ControlArbiter::setTimeRunning(bool running, double now) {
  advance(now);
  if (running && !time_running_) {
    // Sources that were alive when time stopped get time to be heard again: once, however often it stops.
    const auto extend = [this](Expiry* each) {
      if (each->until <= running_time_) return;
      each->until = std::max(each->until, std::min(each->latest, running_time_ + options_.resume_grace));
    };
    extend(&surfaces_);
    for (Source& source : sources_) {
      extend(&source.alive);
      for (Expiry& expires : source.expires) extend(&expires);
    }
  }
  time_running_ = running;
}

std::optional<CommandRefusal> ControlArbiter::onCommand(FlightMode from, const ControlCommand& command, double now) {
  advance(now);
  Source& source = sourceOf(from);
  if (auto refusal = checkCommand(command)) {
    ++source.statistics.refused[static_cast<std::size_t>(refusal->reason)];
    source.statistics.last_refusal = refusal->text;
    return refusal;
  }
  ++source.statistics.accepted;
  const bool was_alive = alive(from);
  const Expiry expiry = nextExpiry();
  const auto renew = [&expiry](Expiry* each) { *each = {std::max(each->until, expiry.until), expiry.latest}; };
  source.arrival = now_;
  source.sequence = command.sequence;
  renew(&source.alive);
  heard_ = heard_ || from == status_.mode;

  const std::uint32_t throttle = command.fields & kThrottleFields;
  if (throttle != 0u) {
    // Levers and motors exclude each other: the newer kind ends the older one.
    for (int engine = 0; engine < kMaxEngines; ++engine) {
      source.expires[index(leverChannel(engine))] = {};
      source.expires[index(motorChannel(engine))] = {};
    }
    source.throttle_field = throttle;
  }
  const ExpandedCommand expanded = expand(command, options_.engines);
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    if (!expanded.commanded.test(i)) continue;
    source.values[i] = expanded.values[i];
    renew(&source.expires[i]);
  }
  if (from == FlightMode::kManual) watchStick(expanded.commanded, expanded.values, was_alive, now_);
  return std::nullopt;
}

void ControlArbiter::watchStick(const ChannelSet& commanded, const ChannelValues& values, bool was_alive, double now) {
  // A stick that comes back after a silence is where it is: no movement to take over by.
  if (!was_alive) stick_reference_.fill(kUnset);
  for (std::size_t k = 0; k < kStick.size(); ++k) {
    const std::size_t i = index(kStick[k]);
    if (!commanded.test(i)) continue;
    if (std::isnan(stick_reference_[k])) stick_reference_[k] = values[i];
    const double moved = values[i] - stick_reference_[k];
    if (status_.mode != FlightMode::kAuto || options_.takeover_threshold <= 0.0) continue;
    if (std::abs(moved) > options_.takeover_threshold) {
      char text[96];
      std::snprintf(text, sizeof text, "stick take-over: %s moved by %.2f since AUTO was engaged",
                    channelName(kStick[k]).c_str(), moved);
      setMode(FlightMode::kManual, "control/manual", text, now);
      return;
    }
  }
}

std::string ControlArbiter::refusalOfSurfaces(double now) {
  advance(now);
  if (status_.mode != options_.surfaces_source) {
    return std::string("control/surfaces flies in ") + toString(options_.surfaces_source) + ", and the mode is " +
           toString(status_.mode);
  }
  if (status_.failsafe && heard_) {
    return std::string(topicOf(status_.mode)) + " is silent and the failsafe acts: it must be back, or " +
           toString(status_.mode) + " asked for again";
  }
  return "";
}

void ControlArbiter::onSurfaces(double now) {
  advance(now);
  surfaces_ = nextExpiry();
  surfaces_heard_ = true;
}

std::string ControlArbiter::endingSurfaces() {
  if (!surfacesFly()) return "";
  endSurfaces();
  return "; control/surfaces ends";
}

void ControlArbiter::beginMode() { heard_ = surfaces_heard_ = false; }

RequestOutcome ControlArbiter::onModeRequest(const ModeRequest& request, double now) {
  advance(now);
  if (request.sequence != 0) {
    const auto seen = seen_requests_.find(request.requester);
    if (seen != seen_requests_.end()) {
      const bool restarted = request.sequence < seen->second.sequence && request.stamp > seen->second.stamp;
      if (request.sequence <= seen->second.sequence && !restarted) return RequestOutcome::kIgnored;
    }
    seen_requests_[request.requester] = {request.sequence, request.stamp};
    if (seen_requests_.size() > kRequestersKept) {
      seen_requests_.erase(std::min_element(seen_requests_.begin(), seen_requests_.end(),
                                            [](auto& a, auto& b) { return a.second.stamp < b.second.stamp; }));
    }
  }
  status_.requested_by = request.requester;
  status_.request_sequence = request.sequence;
  ++status_.revision;
  if (request.mode != static_cast<int>(FlightMode::kManual) && request.mode != static_cast<int>(FlightMode::kAuto)) {
    status_.accepted = false;
    status_.reason = "mode is " + std::to_string(request.mode) + ": expected 1 (MANUAL) or 2 (AUTO)";
    return RequestOutcome::kRefused;
  }
  const auto mode = static_cast<FlightMode>(request.mode);
  if (mode == status_.mode) {
    status_.accepted = true;
    status_.reason = "request (already in this mode)";
    beginMode();
    return RequestOutcome::kUnchanged;
  }
  setMode(mode, request.requester, "request", now);
  status_.request_sequence = request.sequence;
  return RequestOutcome::kChanged;
}

void ControlArbiter::setMode(FlightMode mode, const std::string& who, const std::string& reason, double now) {
  advance(now);
  status_.accepted = true;
  status_.requested_by = who;
  status_.reason = reason;
  status_.request_sequence = 0;
  ++status_.revision;
  beginMode();
  if (mode == status_.mode) return;
  status_.reason += endingSurfaces();
  status_.previous = status_.mode;
  status_.mode = mode;
  status_.since = now_;
  if (mode != FlightMode::kAuto) return;
  for (std::size_t k = 0; k < kStick.size(); ++k) {
    const std::size_t i = index(kStick[k]);
    stick_reference_[k] = fresh(FlightMode::kManual, i) ? sourceOf(FlightMode::kManual).values[i] : kUnset;
  }
}

void ControlArbiter::forgetCommands(const std::string& reason, double now) {
  advance(now);
  const bool sent_nothing = !surfacesFly() && std::all_of(origin_.begin(), origin_.end(),
                                                          [](Origin origin) { return origin == Origin::kNone; });
  for (Source& source : sources_) {
    source.expires.fill({});
    source.alive = {};
    source.throttle_field = 0;
  }
  stick_reference_.fill(kUnset);
  origin_.fill(Origin::kNone);
  blending_.reset();
  endSurfaces();
  beginMode();
  if (sent_nothing) return updateStatus(false);
  status_.reason = reason;
  status_.requested_by.clear();
  status_.request_sequence = 0;
  ++status_.revision;
  updateStatus(false);
}

void ControlArbiter::forgetSent(const ChannelSet& channels) {
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    if (channels.test(i)) origin_[i] = Origin::kNone;
  }
  blending_ &= ~channels;
}

ChannelSet ControlArbiter::commanded() const {
  ChannelSet out;
  for (std::size_t i = 0; i < kChannelCount; ++i) out.set(i, fresh(status_.mode, i));
  return out;
}

/// Levers or motors: whichever the source that flies commands now takes over where the others are. What it has
/// commanded once and no longer does leaves the others to their failsafe.
void ControlArbiter::dropOtherThrottleKind() {
  const std::uint32_t kind = sourceOf(status_.mode).throttle_field;
  if (kind == 0u) return;
  const auto wanted = kind == kFieldMotors ? motorChannel : leverChannel;
  const auto unwanted = kind == kFieldMotors ? leverChannel : motorChannel;
  bool commanded = false;
  for (int engine = 0; engine < kMaxEngines; ++engine) {
    commanded = commanded || fresh(status_.mode, index(wanted(engine)));
  }
  if (!commanded) return;
  for (int engine = 0; engine < kMaxEngines; ++engine) {
    const std::size_t to = index(wanted(engine)), from = index(unwanted(engine));
    if (origin_[to] == Origin::kNone && fresh(status_.mode, to)) {
      origin_[to] = origin_[from];
      output_[to] = output_[from];
    }
    origin_[from] = Origin::kNone;
  }
}

std::optional<ControlArbiter::Target> ControlArbiter::targetOf(std::size_t i) const {
  const Origin own = status_.mode == FlightMode::kManual ? Origin::kManual : Origin::kAuto;
  if (fresh(status_.mode, i)) return Target{sourceOf(status_.mode).values[i], own};
  if (origin_[i] == Origin::kNone) return std::nullopt;
  const ChannelOptions& options = options_.channels[i];
  switch (options.failsafe) {
    case Failsafe::kHold:
      return Target{output_[i], Origin::kHold};
    case Failsafe::kManual:
      if (fresh(FlightMode::kManual, i)) return Target{sourceOf(FlightMode::kManual).values[i], Origin::kManual};
      break;
    case Failsafe::kNeutral:
      break;
  }
  return Target{options.neutral, Origin::kNeutral};
}

void ControlArbiter::moveTowards(std::size_t i, const Target& target, double dt) {
  const ChannelOptions& options = options_.channels[i];
  const double wanted = std::clamp(target.value, options.low, options.high);
  if (origin_[i] == Origin::kNone) {
    output_[i] = wanted;  // nothing was sent before, so there is nothing to leave gently
  } else {
    if (target.origin != origin_[i]) blending_.set(i);
    const double rate = blending_.test(i) ? std::min(options.slew, options_.transition_rate) : options.slew;
    const double change = wanted - output_[i];
    const bool reaches = std::isinf(rate) || std::abs(change) <= rate * dt;
    output_[i] = reaches ? wanted : output_[i] + std::copysign(rate * dt, change);
  }
  if (output_[i] == wanted) blending_.reset(i);
  origin_[i] = target.origin;
  if (output_[i] != target.value) out_.limited |= fieldOf(static_cast<Channel>(i));
}

/// Whether a channel takes a test signal: commanded, or without a command if the signal brings its own rest. A
/// failsafe that flies takes none.
bool ControlArbiter::takesSignal(std::size_t i, bool has_target, const ChannelExcitation& excitation) const {
  if (!excitation.channels.test(i)) return false;
  return fresh(status_.mode, i) || (excitation.rest && (!has_target || alive(status_.mode)));
}

void ControlArbiter::excite(std::size_t i, double base, double value) {
  const ChannelOptions& options = options_.channels[i];
  const double excited = base + value;
  out_.values[i] = std::clamp(excited, options.low, options.high);
  const std::uint32_t field = fieldOf(static_cast<Channel>(i));
  out_.excited |= field;
  if (out_.values[i] != excited) out_.limited |= field;
}

const ArbitratedControls& ControlArbiter::step(double now, const ChannelExcitation& excitation) {
  advance(now);
  const double dt = running_time_ - last_step_time_;
  last_step_time_ = running_time_;
  const Source& source = sourceOf(status_.mode);

  out_ = {};
  out_.mode = status_.mode;
  out_.sequence = source.sequence;
  out_.source_age = source.statistics.accepted > 0 ? now_ - source.arrival : 0.0;
  dropOtherThrottleKind();
  bool failsafe = false, commanded = false;
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    const auto target = targetOf(i);
    const auto channel = static_cast<Channel>(i);
    if (target) {
      failsafe = failsafe || !fresh(status_.mode, i);
      moveTowards(i, *target, dt);
      out_.values[i] = output_[i];
      commanded = true;
    }
    const bool excited = takesSignal(i, target.has_value(), excitation);
    if (excited) excite(i, target ? output_[i] : *excitation.rest, excitation.values[i]);
    if (!target && !excited) continue;
    out_.active.set(i);
    out_.fields |= fieldOf(channel);
  }
  const auto useOneLever = [&](std::uint32_t& bits) {
    if ((bits & kFieldEngineThrottles) != 0u && source.throttle_field == kFieldThrottle) {
      bits = (bits & ~kFieldEngineThrottles) | kFieldThrottle;
    }
  };
  useOneLever(out_.fields);
  useOneLever(out_.limited);
  useOneLever(out_.excited);
  const bool surfaces_alone = surfacesFly() && !heard_;
  failsafe = failsafe && !alive(status_.mode) && !surfaces_alone;
  if (commanded) {
    const CommandSource own = status_.mode == FlightMode::kManual ? CommandSource::kManual : CommandSource::kAuto;
    out_.source = failsafe ? CommandSource::kFailsafe : own;
  }
  updateStatus(failsafe);
  return out_;
}

void ControlArbiter::updateStatus(bool failsafe) {
  const bool manual_alive = alive(FlightMode::kManual), auto_alive = alive(FlightMode::kAuto);
  if (failsafe && !status_.failsafe) {
    const bool of_surfaces = surfaces_heard_ && !heard_;
    const std::string timeout = std::string("timeout of ") + (of_surfaces ? "control/surfaces" : topicOf(status_.mode));
    const std::string ending = endingSurfaces();
    if (status_.since == now_) {  // the mode began with it: both are the reason
      status_.reason += "; " + timeout + ending;
    } else {
      status_.reason = timeout + ending;
      status_.requested_by.clear();
      status_.request_sequence = 0;
    }
  } else if (!failsafe && status_.failsafe && (alive(status_.mode) || surfacesFly())) {
    status_.reason = std::string(alive(status_.mode) ? topicOf(status_.mode) : "control/surfaces") + " is back";
  }
  if (failsafe != status_.failsafe || manual_alive != status_.manual_alive || auto_alive != status_.auto_alive) {
    ++status_.revision;
  }
  status_.failsafe = failsafe;
  status_.manual_alive = manual_alive;
  status_.auto_alive = auto_alive;
}

}  // namespace xplane_bridge::core
