#include "xplane_bridge/actuation/surface_control.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xplane_bridge/actuation/mixing_files.hpp"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

constexpr double kSolvePeriod = 1.0;      // [s] of simulator time
constexpr double kTakeOverWait = 1.0;     // [s] until the override must be shown
constexpr double kReleaseWait = 2.0;      // [s] until it must be shown released
constexpr double kRetry = 5.0;            // [s] after an attempt that failed
constexpr double kFollowsDeg = 0.1;       // [deg] between sent and shown; X-Plane keeps float32
constexpr double kDoesNotFollow = 1.0;    // [s] until it is said
constexpr double kLongestFrame = 0.1;     // [s] X-Plane slows its time beyond 1/20 s
constexpr double kTravelMarginDeg = 1.0;  // [deg] a command may go beyond the identified travel
constexpr double kMovementDeg = 0.05;     // [deg] of a step by which the lag is measured
constexpr double kFollowsAgain = 0.5;     // [s] after the release until X-Plane must move the surfaces
constexpr double kOffLawDeg = 2.0;        // [deg] off the law that tells a surface left standing
constexpr double kLagSmoothing = 0.1;
constexpr std::size_t kMaxAwaitingReadBack = 64;

std::string degrees(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string nameOf(std::size_t surface) { return core::surfaceTable()[surface].name; }

std::vector<std::string> surfacesOf(const core::MixingModel& model) {
  std::vector<std::string> out;
  for (const core::SurfaceLaw& law : model.laws) out.push_back(nameOf(law.surface));
  return out;
}

}  // namespace

const char* toString(SurfaceControlState state) {
  switch (state) {
    case SurfaceControlState::kIdle:
      return "X-Plane drives the surfaces";
    case SurfaceControlState::kTaking:
      return "taking over the surfaces";
    case SurfaceControlState::kDriving:
      return "driving the surfaces";
    case SurfaceControlState::kReleasing:
      return "giving the surfaces back";
  }
  return "invalid";
}

SurfaceControl::SurfaceControl(core::SimulatorPort* link, OverrideManager* overrides, SurfaceControlOptions options,
                               Report report, std::function<void()> on_frame)
    : link_(link),
      overrides_(overrides),
      options_(std::move(options)),
      report_(std::move(report)),
      on_frame_(std::move(on_frame)),
      watch_(options_.mixing),
      inputs_(options_.flap_rate, options_.speedbrake_rate),
      stick_{std::nan(""), std::nan(""), std::nan("")},
      not_following_(core::surfaceTable().size(), 0.0) {
  subscribe();
}

double SurfaceControl::now() const { return link_->clock().steadySeconds(); }

void SurfaceControl::subscribe() {
  core::RrefGroup group{"surfaces", core::surfaceWatchDatarefs(version_), core::kEveryFrameRateHz, 1};
  frames_ = std::make_unique<core::RrefFrameAssembler>(group.datarefs.size());
  if (subscription_) {
    subscription_.replace(std::move(group));
    return;
  }
  subscription_ = link_->subscribe(
      std::move(group), [this](const core::RrefView& view, const core::ReceiveInfo& info) { onDatagram(view, info); });
}

void SurfaceControl::onLink(const core::LinkStatus& status) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    flowing_ = status.state == core::LinkState::kConnected;
    if (!flowing_) watch_.interrupt();
    if (!status.version.known() || status.version == version_) return;
    const bool same = core::surfaceWatchDatarefs(status.version) == core::surfaceWatchDatarefs(version_);
    version_ = status.version;
    if (same) return;
  }
  subscribe();
}

void SurfaceControl::onDatagram(const core::RrefView& view, const core::ReceiveInfo& info) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (frames_->add(view, info.stamp_ns) && core::surfaceSampleFrom(frames_->values(), &sample_) && !stopped_) {
      onSample();
    }
  }
  on_frame_();
}

void SurfaceControl::onSample() {
  const double time = sample_.sim_time;
  if (time < last_time_ - core::kOvertaking) abandon("X-Plane was restarted");
  const double step = time > last_time_ ? std::min(sample_.frame_period, kLongestFrame) : 0.0;
  const double dt = std::isfinite(step) ? std::max(step, 0.0) : 0.0;
  last_time_ = time;
  const bool overridden = sample_.override_shown != 0.0;
  switch (state_) {
    case State::kIdle:
      if (!flowing_ || overridden) {
        watch_.interrupt();
      } else if (!disturbed_) {
        checkLeft();
        watch_.add(sample_);
        if (!(time - solved_time_ < kSolvePeriod)) {
          solved_time_ = time;
          if (watch_.solve()) saveModel();
        }
      }
      if (wanted() && now() >= not_before_ && blockReasonLocked().empty()) take();
      break;
    case State::kTaking:
      drive(dt);
      link_->write(core::kSurfaceOverride, 1.0F);  // it is held; a datagram may have been lost
      if (overridden) {
        enter(State::kDriving);
        report_("the surfaces are driven by their identified mixing", true);
      } else if (now() - state_since_ > kTakeOverWait) {
        giveBack();
        driver_.reset();  // not resumed before not_before_
        endCommands();
        cancelOffset("X-Plane does not show the surface override");
        not_before_ = now() + kRetry;
        report_("X-Plane does not show the surface override: the surfaces are given back", false);
      }
      break;
    case State::kDriving:
      if (!wanted()) {
        giveBack();
      } else if (!overridden) {
        // The panic tool, or another client: it is not taken again.
        abandon("somebody else has released the surface override");
      } else if (blocked_reason_.empty()) {
        drive(dt);
        measureLag();
        watchCommand();
      }
      break;
    case State::kReleasing:
      if (wanted() && blockReasonLocked().empty()) {
        take();
      } else if (!overridden) {
        left_ = sent_;
        left_time_ = time;
        enter(State::kIdle);
        report_("X-Plane drives the surfaces again", true);
      } else if (now() - state_since_ > kReleaseWait) {
        enter(State::kIdle);
        report_("X-Plane still shows the surface override", false);
      }
      break;
  }
}

bool SurfaceControl::wanted() const { return !failures_.empty() || !commands_.empty() || offset_; }

void SurfaceControl::take() {
  const core::MixingModel* model = watch_.model();
  const bool again = state_ == State::kReleasing && driver_;
  if (!again) {
    driver_ = std::make_unique<core::SurfaceDriver>(*model, options_.driver);
    try {
      driver_->engage(sample_.deflections_deg, watch_.bias());
    } catch (const std::invalid_argument& error) {
      driver_.reset();
      not_before_ = now() + kRetry;
      cancelOffset("the surfaces could not be taken over");
      report_(std::string("the surfaces are not taken over: ") + error.what(), false);
      return;
    }
    inputs_.begin(sample_);
    lag_frames_ = std::nan("");
  }
  std::fill(not_following_.begin(), not_following_.end(), 0.0);
  awaiting_read_back_.clear();
  enter(State::kTaking);
  drive(0.0);  // the snapshot goes ahead of the override
  try {
    if (overrides_->acquire(core::kSurfaceOverride)) {
      drive(0.0);
      return;
    }
  } catch (const core::JournalError& error) {
    report_(std::string("the surfaces are not taken over, because they could not be given back after a crash: ") +
                error.what(),
            false);
  }
  cancelOffset("the surfaces could not be taken over");
  enter(State::kIdle);
  not_before_ = now() + kRetry;
}

void SurfaceControl::drive(double dt) {
  driver_->setFailures(failures_);
  driver_->setCommands(commands_);
  driver_->setOffset(offset_ ? offset_->surface : 0, offset_ ? offset_->deflection_deg : 0.0);
  const core::MixingInputs inputs = inputs_.step(sample_, stick_, dt);
  const auto& out = driver_->step(inputs, {sample_.alpha_deg, sample_.beta_deg}, dt);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const core::SurfaceDeflection& surface = out[i];
    link_->write(core::surfaceTable()[surface.surface].dataref, static_cast<float>(surface.deflection_deg));
    double& waiting = not_following_[surface.surface];
    waiting = followsLocked(surface.surface) ? 0.0 : waiting + dt;
    const bool same_list = i < sent_.size() && sent_[i].surface == surface.surface;
    if (same_list && std::abs(sent_[i].deflection_deg - surface.deflection_deg) > kMovementDeg) {
      awaiting_read_back_.push_back({sample_.sim_time, surface.surface, surface.deflection_deg});
      if (awaiting_read_back_.size() > kMaxAwaitingReadBack) awaiting_read_back_.pop_front();
    }
  }
  sent_ = out;
  if (!command_sent_) {
    command_sent_ = true;
    commands_awaiting_read_back_.push_back({command_sequence_, sample_.sim_time, commands_});
    if (commands_awaiting_read_back_.size() > kMaxAwaitingReadBack) commands_awaiting_read_back_.pop_front();
    addEcho({command_sequence_, false, std::nan(""), std::nan("")});
  }
}

void SurfaceControl::measureLag() {
  // The newest movement that the frame shows; a surface shows each angle of a movement for one frame only.
  for (auto it = awaiting_read_back_.rbegin(); it != awaiting_read_back_.rend(); ++it) {
    if (it->sim_time >= sample_.sim_time) continue;
    if (std::abs(sample_.deflections_deg[it->surface] - it->deflection_deg) > kMovementDeg / 10.0) continue;
    const double frames = (sample_.sim_time - it->sim_time) / sample_.frame_period;
    if (std::isfinite(frames)) {
      lag_frames_ = std::isfinite(lag_frames_) ? lag_frames_ + kLagSmoothing * (frames - lag_frames_) : frames;
    }
    awaiting_read_back_.erase(awaiting_read_back_.begin(), it.base());
    return;
  }
}

void SurfaceControl::watchCommand() {
  // The newest that fits: older ones were overtaken.
  for (auto it = commands_awaiting_read_back_.rbegin(); it != commands_awaiting_read_back_.rend(); ++it) {
    const bool shown = std::all_of(it->surfaces.begin(), it->surfaces.end(), [this](const auto& command) {
      return std::abs(sample_.deflections_deg[command.surface] - command.deflection_deg) <= kFollowsDeg;
    });
    if (!shown || !(sample_.sim_time > it->sim_time)) continue;
    addEcho({it->sequence, true, sample_.sim_time, (sample_.sim_time - it->sim_time) / sample_.frame_period});
    commands_awaiting_read_back_.erase(commands_awaiting_read_back_.begin(), it.base());
    return;
  }
}

void SurfaceControl::addEcho(const Echo& echo) {
  echoes_.push_back(echo);
  if (echoes_.size() <= kMaxAwaitingReadBack) return;
  echoes_.pop_front();
  ++echoes_dropped_;
}

void SurfaceControl::endCommands() {
  commands_.clear();
  commands_awaiting_read_back_.clear();
}

void SurfaceControl::checkLeft() {
  if (left_.empty() || sample_.sim_time < left_time_ + kFollowsAgain) return;
  const core::MixingVector terms = core::mixingTerms(sample_.inputs);
  std::vector<std::string> standing;
  for (const core::SurfaceDeflection& left : left_) {
    const core::SurfaceLaw* law = watch_.model() ? watch_.model()->lawOf(left.surface) : nullptr;
    const double shown = sample_.deflections_deg[left.surface];
    const bool stands = std::abs(shown - left.deflection_deg) <= kFollowsDeg;
    if (!law || !stands || std::abs(law->deflection(terms) - shown) <= kOffLawDeg) continue;
    standing.push_back(nameOf(left.surface));
  }
  left_.clear();
  if (!standing.empty()) report_("X-Plane does not drive again: " + core::join(standing), false);
}

void SurfaceControl::giveBack() {
  try {
    overrides_->release(core::kSurfaceOverride);
  } catch (const core::JournalError& error) {
    report_(error.what(), false);
  }
  enter(State::kReleasing);
}

void SurfaceControl::abandon(const std::string& why) {
  const bool was = state_ == State::kTaking || state_ == State::kDriving;
  failures_.clear();
  endCommands();
  cancelOffset(why);
  abandoned_ = why;
  watch_.recheck();
  if (was) giveBack();
  driver_.reset();  // do not resume this driver while the override is being released
  if (!was) return;
  report_("the surfaces are given back: " + why, true);
}

void SurfaceControl::cancelOffset(const std::string& why) {
  if (!offset_) return;
  offset_.reset();
  offset_lost_ = why;
}

void SurfaceControl::enter(State state) {
  state_ = state;
  state_since_ = now();
  if (state != State::kIdle) return;
  driver_.reset();
  sent_.clear();
  awaiting_read_back_.clear();
  lag_frames_ = std::nan("");
  watch_.interrupt();
}

void SurfaceControl::onAircraft(const std::string& aircraft) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (aircraft == watch_.aircraft()) return;
  abandon("another aircraft was loaded");
  watch_.reset(aircraft);
  loadModel();
}

void SurfaceControl::release(const std::string& why) {
  std::lock_guard<std::mutex> lock(mutex_);
  abandon(why);
}

void SurfaceControl::loadModel() {
  file_problem_.clear();
  try {
    if (const auto model = readMixingFile(options_.mixing_folder, watch_.aircraft())) watch_.adopt(*model);
  } catch (const std::runtime_error& error) {
    file_problem_ = error.what();
    report_(file_problem_, false);
  }
}

void SurfaceControl::saveModel() {
  file_problem_.clear();
  try {
    report_(
        "the mixing of the surfaces is identified, kept in " + writeMixingFile(options_.mixing_folder, *watch_.model()),
        true);
  } catch (const std::runtime_error& error) {
    file_problem_ = error.what();
    report_("the mixing of the surfaces is identified, but could not be kept: " + file_problem_, false);
  }
}

void SurfaceControl::tick(const std::string& blocked_reason) {
  std::lock_guard<std::mutex> lock(mutex_);
  const double time = now();
  const double dt = time - last_tick_.value_or(time);
  last_tick_ = time;
  blocked_reason_ = blocked_reason;
  if (flowing_) command_age_ += dt;
  if (!commands_.empty() && command_age_ > options_.command_timeout) endCommands();
}

void SurfaceControl::stop() {
  std::lock_guard<std::mutex> lock(mutex_);
  stopped_ = true;
  enter(State::kIdle);
}

void SurfaceControl::setStick(const std::array<double, 3>& stick) {
  std::lock_guard<std::mutex> lock(mutex_);
  stick_ = stick;
}

void SurfaceControl::setFailures(const std::vector<core::SurfaceFailure>& failures) {
  std::lock_guard<std::mutex> lock(mutex_);
  failures_ = failures;
}

void SurfaceControl::setDisturbed(bool disturbed) {
  std::lock_guard<std::mutex> lock(mutex_);
  disturbed_ = disturbed;
}

std::optional<std::string> SurfaceControl::command(const std::vector<std::string>& names,
                                                   const std::vector<float>& deflections_deg, std::uint32_t sequence) {
  std::lock_guard<std::mutex> lock(mutex_);
  auto checked = core::checkSurfaceCommand(names, deflections_deg);
  std::optional<std::string> wrong;
  if (checked.refusal) {
    wrong = checked.refusal->text;
  }
  for (const core::SurfaceDeflection& surface : checked.surfaces) {
    if (wrong) break;
    const std::string blocked = blockReasonForLocked(surface.surface);
    if (!blocked.empty()) {
      wrong = blocked;
      break;
    }
    const core::SurfaceLaw* law = watch_.model()->lawOf(surface.surface);
    const double low = law->low_deg - kTravelMarginDeg, high = law->high_deg + kTravelMarginDeg;
    if (surface.deflection_deg >= low && surface.deflection_deg <= high) continue;
    wrong = nameOf(surface.surface) + " is " + degrees(surface.deflection_deg) + " deg: expected its travel, " +
            degrees(low) + ".." + degrees(high);
  }
  if (wrong) {
    ++commands_refused_;
    last_refusal_ = *wrong;
    return wrong;
  }
  ++commands_accepted_;
  commands_ = std::move(checked.surfaces);
  command_sequence_ = sequence;
  command_age_ = 0.0;
  command_sent_ = commands_.empty();
  if (commands_.empty()) endCommands();
  return std::nullopt;
}

std::string SurfaceControl::beginOffset(std::size_t surface, double amplitude_deg) {
  std::lock_guard<std::mutex> lock(mutex_);
  const std::string blocked = blockReasonForLocked(surface);
  if (!blocked.empty()) return blocked;
  if (isBroken(surface)) return nameOf(surface) + " is broken";
  const core::SurfaceLaw* law = watch_.model()->lawOf(surface);
  const double half = 0.5 * (law->high_deg - law->low_deg);
  if (amplitude_deg > half) {
    return "amplitude is " + degrees(amplitude_deg) + " deg: expected at most half of its travel, " + degrees(half);
  }
  offset_ = core::SurfaceDeflection{surface, 0.0};
  offset_lost_.clear();
  return "";
}

std::string SurfaceControl::setOffset(double offset_deg) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!offset_) return offset_lost_;
  if (isBroken(offset_->surface)) return nameOf(offset_->surface) + " is broken";
  offset_->deflection_deg = offset_deg;
  return "";
}

bool SurfaceControl::isBroken(std::size_t surface) const {
  return std::any_of(failures_.begin(), failures_.end(), [surface](const auto& f) { return f.surface == surface; });
}

void SurfaceControl::clearOffset() {
  std::lock_guard<std::mutex> lock(mutex_);
  offset_.reset();
}

std::string SurfaceControl::blockReasonLocked() const {
  if (!blocked_reason_.empty()) return blocked_reason_;
  if (state_ == State::kTaking || state_ == State::kDriving) return "";
  if (state_ == State::kReleasing && driver_) return "";
  if (now() < not_before_) return "X-Plane did not let the surfaces be taken over a moment ago";
  if (sample_.override_shown != 0.0) {
    return std::isfinite(sample_.override_shown)
               ? std::string("another program has set override_control_surfaces and must give it back")
               : std::string("X-Plane does not show its surfaces");
  }
  return watch_.refusal();
}

std::string SurfaceControl::blockReason() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return blockReasonLocked();
}

std::string SurfaceControl::blockReasonFor(std::size_t surface) const {
  std::lock_guard<std::mutex> lock(mutex_);
  return blockReasonForLocked(surface);
}

std::string SurfaceControl::blockReasonForLocked(std::size_t surface) const {
  const std::string blocked = blockReasonLocked();
  const core::MixingModel* model = watch_.model();
  if (!blocked.empty() || !model || model->lawOf(surface)) return blocked;
  return nameOf(surface) +
         " has not been seen to move: either this aircraft has none, or its handle has to be moved once; those that "
         "moved: " +
         core::join(surfacesOf(*model));
}

bool SurfaceControl::driving() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return state_ != State::kIdle;
}

bool SurfaceControl::givingBack() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return state_ != State::kIdle && !wanted();
}

double SurfaceControl::lagFrames() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return lag_frames_;
}

bool SurfaceControl::followsLocked(std::size_t surface) const {
  const auto it =
      std::find_if(sent_.begin(), sent_.end(), [surface](const auto& sent) { return sent.surface == surface; });
  return it != sent_.end() && std::abs(sample_.deflections_deg[surface] - it->deflection_deg) <= kFollowsDeg;
}

bool SurfaceControl::follows(std::size_t surface) const {
  std::lock_guard<std::mutex> lock(mutex_);
  return state_ == State::kDriving && followsLocked(surface);
}

double SurfaceControl::shown(std::size_t surface) const {
  std::lock_guard<std::mutex> lock(mutex_);
  return surface < sample_.deflections_deg.size() ? sample_.deflections_deg[surface] : std::nan("");
}

std::optional<core::SurfaceLaw> SurfaceControl::lawOf(std::size_t surface) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const core::SurfaceLaw* law = watch_.model() ? watch_.model()->lawOf(surface) : nullptr;
  if (!law) return std::nullopt;
  return *law;
}

std::vector<core::SurfaceDeflection> SurfaceControl::individuallyDriven() const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<core::SurfaceDeflection> out;
  for (const core::SurfaceDeflection& sent : sent_) {
    const auto is_it = [&sent](const auto& other) { return other.surface == sent.surface; };
    if (std::any_of(failures_.begin(), failures_.end(), is_it) ||
        std::any_of(commands_.begin(), commands_.end(), is_it) || (offset_ && is_it(*offset_))) {
      out.push_back(sent);
    }
  }
  return out;
}

std::optional<SurfaceControl::Echo> SurfaceControl::takeEcho() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (echoes_.empty()) return std::nullopt;
  const Echo echo = echoes_.front();
  echoes_.pop_front();
  return echo;
}

std::optional<std::string> SurfaceControl::takeAbandoned() {
  std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(abandoned_, std::nullopt);
}

SurfaceControlStatus SurfaceControl::status() const {
  std::lock_guard<std::mutex> lock(mutex_);
  SurfaceControlStatus out;
  out.state = state_;
  out.wanted = wanted();
  out.blocked_reason = blockReasonLocked();
  out.file_problem = file_problem_;
  for (std::size_t i = 0; i < not_following_.size() && state_ == State::kDriving; ++i) {
    if (not_following_[i] > kDoesNotFollow) out.not_following.push_back(nameOf(i));
  }
  out.aircraft = watch_.aircraft();
  if (const core::MixingModel* model = watch_.model()) {
    out.mixing_known = true;
    out.mixed_surfaces = surfacesOf(*model);
    out.unknown_moved = model->unknownMovement(sample_.inputs);
  }
  out.identification = watch_.quality().text();
  out.samples = watch_.samples();
  out.worst_residual_deg = watch_.quality().worst_residual_deg;
  out.lag_frames = lag_frames_;
  out.commands_accepted = commands_accepted_;
  out.commands_refused = commands_refused_;
  out.answers_dropped = echoes_dropped_;
  out.last_refusal = last_refusal_;
  return out;
}

}  // namespace xplane_bridge
