// SurfaceControl's requests and answers: what others want driven, why it cannot be, and what is; and the files of
// mixings. How the surfaces are taken, driven and given back: surface_control.cpp.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "xplane_bridge/actuation/mixing_files.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr double kReadBackTimeout = 1.0;  // [s] until it is said
constexpr double kTravelMarginDeg = 1.0;  // [deg] a command may go beyond the identified travel

std::string degrees(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::vector<std::string> surfacesOf(const core::MixingModel& model) {
  std::vector<std::string> out;
  for (const core::SurfaceLaw& law : model.laws) out.push_back(core::surfaceTable()[law.surface].name);
  return out;
}

}  // namespace

void SurfaceControl::restart() {
  std::lock_guard<std::mutex> lock(mutex_);
  std::optional<core::MixingModel> known;
  if (watch_.model() != nullptr) known = *watch_.model();
  watch_.reset(watch_.aircraft());
  if (known) watch_.adopt(*known);
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
    countRefused(*wrong);
    return wrong;
  }
  ++commands_accepted_;
  commands_ = std::move(checked.surfaces);
  command_sequence_ = sequence;
  command_sent_ = commands_.empty();
  if (commands_.empty()) clearCommands();
  return std::nullopt;
}

void SurfaceControl::countRefused(const std::string& why) {
  ++commands_refused_;
  last_refusal_ = why;
}

void SurfaceControl::refuseCommand(const std::string& why) {
  std::lock_guard<std::mutex> lock(mutex_);
  countRefused(why);
}

void SurfaceControl::endCommands() {
  std::lock_guard<std::mutex> lock(mutex_);
  clearCommands();
}

bool SurfaceControl::takeReleasedByAnother() {
  std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(released_by_another_, false);
}

std::string SurfaceControl::beginOffset(std::size_t surface, double amplitude_deg) {
  std::lock_guard<std::mutex> lock(mutex_);
  std::string blocked = blockReasonForLocked(surface);
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

// --- identification by test signals ---

std::string SurfaceControl::beginIdentification() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (blocked_) return blocked_->text;
  if (state_ != State::kIdle || wanted()) return "the surfaces are driven one by one: end that first";
  if (sample_.override_shown != 0.0) return blockReasonLocked();
  if (!core::mixingTerms(sample_.inputs).allFinite()) return "X-Plane does not show what moves the surfaces";
  identifying_ = true;
  identification_lost_.clear();
  watch_.beginIdentification();
  return "";
}

std::string SurfaceControl::identificationProblem() const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!identifying_) return "";
  if (!identification_lost_.empty()) return identification_lost_;
  if (state_ != State::kIdle || wanted()) return "the surfaces are driven one by one";
  return sample_.override_shown == 0.0 ? "" : heldElsewhere();
}

SurfaceControl::Identified SurfaceControl::concludeIdentification(bool save) {
  std::lock_guard<std::mutex> lock(mutex_);
  identifying_ = false;
  const core::MixingWatch::Found found = watch_.concludeIdentification();
  if (!found.good()) return {false, "the mixing is not identified: " + found.quality.text()};
  if (!found.adopted) return {true, "the mixing known already holds, and stays: it knows more than was seen now"};
  keeps_ = save;
  const std::string kept = save ? keepModel() : "not kept in a file, as asked for";
  return {true, "the mixing of " + std::to_string(watch_.model()->laws.size()) + " surfaces of " + watch_.aircraft() +
                    " is identified, " + kept};
}

void SurfaceControl::cancelIdentification() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!std::exchange(identifying_, false)) return;
  watch_.cancelIdentification();
}

double SurfaceControl::excursionNeeded() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return watch_.excursionNeeded();
}

SurfaceControl::Sticks SurfaceControl::sticks() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return {sample_.stick, {sample_.inputs.roll, sample_.inputs.pitch, sample_.inputs.yaw}};
}

// --- what is ---

/// What keeps the surface override set where this does not.
std::string SurfaceControl::heldElsewhere() const {
  if (overrides_->holders(core::kSurfaceOverride).count(OverrideHolder::kRequest) != 0) {
    return "set_dataref has set override_control_surfaces: set it to 0 by set_dataref first";
  }
  if (overrides_->releasePending(core::kSurfaceOverride)) {
    return "tx_node's release of override_control_surfaces is not shown yet, and is repeated; where that lasts, "
           "another program sets it and must give it back";
  }
  return "another program has set override_control_surfaces and must give it back";
}

std::string SurfaceControl::blockReasonLocked() const {
  if (blocked_) return blocked_->text;
  if (state_ == State::kTaking || state_ == State::kDriving) return "";
  if (state_ == State::kReleasing && driver_) return "";
  if (now() < not_before_) return "X-Plane did not let the surfaces be taken over a moment ago";
  if (sample_.override_shown != 0.0) {
    return std::isfinite(sample_.override_shown) ? heldElsewhere() : "X-Plane does not show its surfaces";
  }
  return watch_.refusal();
}

std::string SurfaceControl::blockReason() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return blockReasonLocked();
}

std::optional<RequestResult> SurfaceControl::refusalFor(std::size_t surface) const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::string why = blockReasonForLocked(surface);
  if (why.empty()) return std::nullopt;
  return RequestResult{blocked_ ? blocked_->code : core::ResultCode::kRefused, std::move(why)};
}

std::string SurfaceControl::blockReasonForLocked(std::size_t surface) const {
  std::string blocked = blockReasonLocked();
  return blocked.empty() ? unknownReasonLocked(surface) : blocked;
}

std::string SurfaceControl::unknownReason(std::size_t surface) const {
  std::lock_guard<std::mutex> lock(mutex_);
  return unknownReasonLocked(surface);
}

std::string SurfaceControl::unknownReasonLocked(std::size_t surface) const {
  const core::MixingModel* model = watch_.model();
  if (!model || model->lawOf(surface)) return "";
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

double SurfaceControl::readBack(std::size_t surface) const {
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
    if (not_following_[i] > kReadBackTimeout) out.not_following.push_back(nameOf(i));
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

// --- files of mixings ---

std::optional<core::MixingModel> readMixingFile(const std::string& folder, const std::string& aircraft) {
  const std::string path = core::mixingPath(folder, aircraft);
  std::ifstream file(path);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  try {
    core::MixingModel model = core::mixingFromText(text.str());
    if (model.aircraft != aircraft) {
      throw core::MixingFileError("mixing file: is of aircraft " + model.aircraft + ", expected " + aircraft);
    }
    return model;
  } catch (const core::MixingFileError& error) {
    throw core::MixingFileError(path + ": " + error.what());
  }
}

std::string writeMixingFile(const std::string& folder, const core::MixingModel& model) {
  std::string path = core::mixingPath(folder, model.aircraft);
  const std::string fresh = path + ".new";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::ofstream file(fresh);
  file << core::toText(model);
  file.close();
  if (!file || std::rename(fresh.c_str(), path.c_str()) != 0) {
    throw core::MixingFileError(path + " cannot be written");
  }
  return path;
}

}  // namespace xplane_bridge
