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

constexpr double kSolvePeriod = 1.0;        // [s] of simulator time
constexpr double kTakeOverWait = 1.0;       // [s] until the override must be shown
constexpr double kShownReleasedWait = 2.0;  // [s] until it must be shown released
constexpr double kRetry = 5.0;              // [s] after an attempt that failed
constexpr double kLongestFrame = 0.1;       // [s] X-Plane slows its time beyond 1/20 s
constexpr double kMovementDeg = 0.05;       // [deg] of a step by which the lag is measured
constexpr double kSettleWait = 2.0;         // [s] of frames in which surfaces must have gone back to the law
constexpr double kSettledDeg = 0.5;         // [deg] off the law that is no jump
constexpr double kFollowsAgain = 0.5;       // [s] after the release until X-Plane must move the surfaces
constexpr double kOffLawDeg = 2.0;          // [deg] off the law that shows a surface left standing
constexpr double kLagSmoothing = 0.1;
constexpr std::size_t kMaxAwaitingReadBack = 64;

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

std::string SurfaceControl::nameOf(std::size_t surface) { return core::surfaceTable()[surface].name; }

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
    paused_ = status.state == core::LinkState::kPaused;
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
      inputs_.watch(sample_);
      if (!flowing_ || overridden) {
        watch_.interrupt();
      } else if (!disturbed_) {
        checkLeft();
        watch_.add(sample_);
        if (!identifying_ && !(time - solved_time_ < kSolvePeriod)) {
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
        clearCommands();
        cancelOffset("X-Plane does not show the surface override");
        not_before_ = now() + kRetry;
        report_("X-Plane does not show the surface override: the surfaces are given back", false);
      }
      break;
    case State::kDriving:
      if (wanted() && !overridden) {
        // The panic tool, or another client: it is not taken again.
        released_by_another_ = released_by_another_ || !commands_.empty();
        abandon("another client has released the surface override");
      } else if (!wanted() && (settled() || !overridden)) {
        giveBack();
      } else if (!blocked_) {
        settling_ = wanted() ? 0.0 : settling_ + dt;
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
      } else if (now() - state_since_ > kShownReleasedWait) {
        enter(State::kIdle);
        report_("X-Plane still shows the surface override: " + heldElsewhere(), false);
      }
      break;
  }
}

/// Surfaces are where X-Plane will have them, or cannot be brought there. In a pause they stand, and run back after it.
bool SurfaceControl::settled() const {
  const bool there = settling_ > 0.0 && driver_->offTarget() <= kSettledDeg;
  return there || settling_ > kSettleWait || !(flowing_ || paused_) || blocked_;
}

bool SurfaceControl::wanted() const { return !failures_.empty() || !commands_.empty() || offset_; }

void SurfaceControl::take() {
  const core::MixingModel* model = watch_.model();
  const bool again = state_ == State::kReleasing && driver_;
  settling_ = 0.0;
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
    if (overrides_->acquire(OverrideHolder::kSurfaces, core::kSurfaceOverride)) {
      drive(0.0);
      return;
    }
  } catch (const core::JournalError& error) {
    report_("the surfaces are not taken over: " + core::whyNotChanged(error), false);
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
  // X-Plane's beta is + with wind from the left [? beta-sign].
  const double from_right = version_.is(core::Otherwise::kBetaSign) ? sample_.beta_deg : -sample_.beta_deg;
  const auto& out = driver_->step(inputs, {sample_.alpha_deg, from_right}, dt);
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

void SurfaceControl::clearCommands() {
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
    overrides_->release(OverrideHolder::kSurfaces, core::kSurfaceOverride);
  } catch (const core::JournalError& error) {
    report_(error.what(), false);
  }
  enter(State::kReleasing);
}

void SurfaceControl::abandon(const std::string& why) {
  const bool was = state_ == State::kTaking || state_ == State::kDriving;
  failures_.clear();
  clearCommands();
  cancelOffset(why);
  if (identifying_) identification_lost_ = why;
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

void SurfaceControl::onAircraft(const std::string& aircraft, const std::string& exactly) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (aircraft == watch_.aircraft()) return;
  abandon("another aircraft was loaded");
  watch_.reset(aircraft);
  keeps_ = true;
  loadModel(exactly);
}

void SurfaceControl::release(const std::string& why) {
  std::lock_guard<std::mutex> lock(mutex_);
  abandon(why);
}

void SurfaceControl::loadModel(const std::string& exactly) {
  file_problem_.clear();
  try {
    std::optional<core::MixingModel> model;
    if (!options_.mixing_folder.empty()) model = readMixingFile(options_.mixing_folder, watch_.aircraft());
    if (!model && !options_.shipped_mixing.empty() && !exactly.empty()) {
      model = readMixingFile(options_.shipped_mixing, exactly);
      if (model) model->aircraft = watch_.aircraft();
    }
    if (model) watch_.adopt(*model);
  } catch (const std::runtime_error& error) {
    file_problem_ = error.what();
    report_(file_problem_, false);
  }
}

/// Says where, or why not; then file_problem_ is set.
std::string SurfaceControl::keepModel() {
  file_problem_.clear();
  if (options_.mixing_folder.empty()) return "not kept in a file: no folder is given";
  try {
    return "kept in " + writeMixingFile(options_.mixing_folder, *watch_.model());
  } catch (const std::runtime_error& error) {
    file_problem_ = error.what();
    return "but could not be kept: " + file_problem_;
  }
}

void SurfaceControl::saveModel() {
  if (!keeps_) return;
  const std::string kept = keepModel();
  report_("the mixing of the surfaces is identified, " + kept, file_problem_.empty());
}

void SurfaceControl::tick(const std::optional<RequestResult>& blocked) {
  std::lock_guard<std::mutex> lock(mutex_);
  blocked_ = blocked;
}

void SurfaceControl::stop() {
  std::lock_guard<std::mutex> lock(mutex_);
  stopped_ = true;
  enter(State::kIdle);
}

}  // namespace xplane_bridge
