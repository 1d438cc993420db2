#include "xplane_bridge/actuation/view_requests.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <mutex>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/camera/view_stream.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge {
namespace {

using core::ResultCode;

constexpr const char* kEntry = "view:camera";
constexpr double kViewReadWait = 0.6;  // [s] for what X-Plane shows now
constexpr double kAttemptWait = 0.5;   // [s] until the writes are sent once more: the view's command may undo them
constexpr int kAttempts = 2;           // a second in all
constexpr double kToleranceDeg = 2.0;  // of the measured pose; a frame of a roll at 60 deg/s is 1 deg
constexpr float kFieldTolerance = 1e-2F;

/// Which places of core::cameraDatarefs() have answered, and all values; NaN where there was none.
std::vector<float> filled(const std::vector<std::string>& asked, const std::vector<core::DatarefValue>& values) {
  const std::vector<std::string>& all = core::cameraDatarefs();
  std::vector<float> out(all.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < asked.size() && i < values.size(); ++i) {
    const auto place = std::find(all.begin(), all.end(), asked[i]) - all.begin();
    if (values[i]) out[static_cast<std::size_t>(place)] = *values[i];
  }
  return out;
}

std::optional<std::pair<int, core::CameraPose>> measured(const std::vector<float>& values) {
  const core::CameraSample sample = core::cameraSample(values.data());
  core::PoseReading reading;
  reading.offsets_within = core::offsetsWithin(sample, sample, reading).value_or(false);
  // With a matrix that answers, what it shows counts: the visual offset may turn nothing.
  auto pose = core::worldMatrixPose(sample);
  if (!pose) pose = core::measuredPose(sample, sample, reading);
  if (!pose || !std::isfinite(sample.view_type)) return std::nullopt;
  return std::make_pair(static_cast<int>(std::lround(sample.view_type)), *pose);
}

std::string described(const core::CameraPose& pose, int view_type) {
  const core::AnglesDeg turn = core::anglesInBase(pose.orientation);
  const auto tenths = [](double degrees) { return std::round(10.0 * degrees) / 10.0 + 0.0; };  // never -0.0
  char text[160];
  std::snprintf(text, sizeof(text), "heading %.1f, pitch %.1f, roll %.1f deg in the aircraft, X-Plane's view %d",
                tenths(turn.heading), tenths(turn.pitch), tenths(turn.roll), view_type);
  return text;
}

}  // namespace

ViewRequests::ViewRequests(core::SimulatorPort* link, Report report) : link_(link), report_(std::move(report)) {}

RequestResult ViewRequests::setView(const core::ViewWish& wish, const std::string& who) {
  if (const auto problem = core::check(wish)) return {ResultCode::kRefused, *problem};
  if (link_->inLockstep()) {
    return {ResultCode::kNotSupported,
            "in lock-step there are no pictures, and the camera is not measured between frames"};
  }
  const std::lock_guard<core::TurnMutex> lock(mutex_);
  RequestResult result;
  try {
    result = setViewLocked(wish);
  } catch (const core::JournalError& error) {
    result = {ResultCode::kRefused, core::whyNotChanged(error)};
  }
  report_("set_view: " + result.text, who, result.success());
  return result;
}

RequestResult ViewRequests::setViewLocked(const core::ViewWish& wish) {
  if (!link_->status().up()) return noLink();
  const std::string problem = remember(wish.field_of_view_deg != 0.0);
  if (!problem.empty()) return {ResultCode::kTimeout, problem};
  const Eigen::Quaterniond wanted = core::orientationOf(wish);
  std::optional<Shown> shown;
  for (const core::ViewWay& way : core::waysTo(wish)) {
    takeOver(way.writes);
    bool there = false;
    std::tie(there, shown) = tryWay(way, wanted);
    if (!there) continue;
    RequestResult field = setFieldOfView(wish.field_of_view_deg);
    if (!field.success()) return field;
    return {ResultCode::kOk, "the camera is at " + described(shown->pose, shown->view_type)};
  }
  giveBackLocked(kAttemptWait);
  return {ResultCode::kTimeout,
          shown ? "no way leads there; the last one led to " + described(shown->pose, shown->view_type) + "; given back"
                : "X-Plane does not say where its camera is; given back"};
}

std::string ViewRequests::remember(bool field_of_view) {
  const auto journal = link_->journal();
  if (!journal) return "there is no journal yet, so that nothing is changed: try again in a second";
  const std::vector<std::string>& camera = core::cameraDatarefs();
  const auto now = link_->read(camera, kViewReadWait);
  answered_.clear();
  for (std::size_t i = 0; i < camera.size(); ++i) {
    if (now[i]) answered_.push_back(camera[i]);
  }
  const auto shown = measured(filled(camera, now));
  if (!shown) return "X-Plane does not say where its camera is (sim/graphics/view/view_*)";
  if (!core::ownEntry(*journal, kEntry)) before_.clear();
  std::vector<std::string> changed;
  if (before_.empty()) changed = core::viewDatarefs();
  if (field_of_view && before_.count(core::kFieldOfViewDataref) == 0) {
    changed.emplace_back(core::kFieldOfViewDataref);
  }
  if (changed.empty()) return "";
  const auto values = link_->read(changed, kViewReadWait);
  const std::vector<core::JournalEntry> entries = journal->entries();
  std::map<std::string, float> found;
  std::vector<std::string> unknown;
  for (std::size_t i = 0; i < changed.size(); ++i) {
    if (values[i] && std::isfinite(*values[i])) {
      // The field of view may be capture_node's, and its steps while it measures a delay.
      found[changed[i]] = core::valueBefore(entries, changed[i]).value_or(*values[i]);
    } else {
      unknown.push_back(changed[i]);
    }
  }
  if (!unknown.empty()) {
    return "X-Plane does not report " + core::join(unknown) + ", which could not be given back" +
           linkCondition(link_->status());
  }
  if (before_.empty()) view_before_ = shown->first;
  before_.merge(found);
  return "";
}

void ViewRequests::takeOver(const std::vector<core::DatarefWrite>& writes) {
  const auto journal = link_->journal();
  if (!journal) return;
  const auto entry = core::ownEntry(*journal, kEntry);
  std::vector<core::UndoOperation> undo = entry ? entry->undo : std::vector<core::UndoOperation>();
  const std::size_t known = undo.size();
  for (const core::DatarefWrite& write : writes) {
    const bool there = std::any_of(undo.begin(), undo.end(), [&](const core::UndoOperation& operation) {
      return std::get<core::UndoDref>(operation).path == write.dataref;
    });
    const auto before = before_.find(write.dataref);
    if (!there && before != before_.end()) undo.emplace_back(core::UndoDref{write.dataref, before->second});
  }
  // On disk before X-Plane is changed.
  if (undo.size() != known) journal->record(kEntry, kOverridePurpose, std::move(undo));
}

std::pair<bool, std::optional<ViewRequests::Shown>> ViewRequests::tryWay(const core::ViewWay& way,
                                                                         const Eigen::Quaterniond& wanted) {
  link_->command(way.command);
  const auto accept = [asked = answered_, wanted, type = static_cast<int>(way.view_type)](const auto& values) {
    const auto shown = measured(filled(asked, values));
    return shown && shown->first == type && core::angleBetweenDeg(shown->second.orientation, wanted) <= kToleranceDeg;
  };
  std::optional<Shown> shown;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    for (const core::DatarefWrite& write : way.writes) link_->write(write.dataref, write.value);
    const auto values = link_->readUntil(answered_, kAttemptWait, accept);
    if (const auto now = measured(filled(answered_, values))) shown = Shown{now->first, now->second};
    if (accept(values)) return {true, shown};
  }
  return {false, shown};
}

RequestResult ViewRequests::setFieldOfView(double field_of_view_deg) {
  if (field_of_view_deg == 0.0) return {ResultCode::kOk, ""};
  const auto wanted = static_cast<float>(field_of_view_deg);
  takeOver({{core::kFieldOfViewDataref, wanted}});
  link_->write(core::kFieldOfViewDataref, wanted);
  const auto [fits, shown] = link_->waitForDataref(core::kFieldOfViewDataref, wanted, kFieldTolerance, kAttemptWait);
  if (fits) return {ResultCode::kOk, ""};
  return {ResultCode::kTimeout, "the view is as wanted, the field of view is not: X-Plane shows " +
                                    (shown ? std::to_string(*shown) + " deg" : std::string("none"))};
}

bool ViewRequests::giveBack(double timeout_s) {
  const std::lock_guard<core::TurnMutex> lock(mutex_);
  try {
    return giveBackLocked(timeout_s);
  } catch (const core::JournalError& error) {
    report_(error.what(), "", false);
    return false;
  }
}

bool ViewRequests::giveBackLocked(double timeout_s) {
  if (before_.empty()) return true;
  const auto journal = link_->journal();
  if (!journal) return false;
  const auto entry = core::ownEntry(*journal, kEntry);
  before_.clear();
  if (!entry) return true;
  const std::string command = core::commandOf(view_before_);
  if (!command.empty()) link_->command(command);
  if (link_->undo(journal->handOver(kEntry), timeout_s)) {
    journal->removeUndone({*entry});
    return true;
  }
  const bool up = link_->status().up();
  journal->leave({kEntry}, up ? "X-Plane did not show the view given back" : "X-Plane went first");
  return false;
}

void ViewRequests::forget() {
  const auto journal = link_->journal();
  if (!journal) return;
  try {
    if (const auto entry = core::ownEntry(*journal, kEntry)) journal->removeUndone({*entry});
  } catch (const core::JournalError&) {
    // It is given back at the end or by the next start, to whichever X-Plane is there.
  }
}

}  // namespace xplane_bridge
