#include "xplane_bridge/actuation/traffic_control.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<core::HandlerMutex>;

std::string listed(const std::vector<int>& numbers) {
  std::vector<std::string> texts;
  texts.reserve(numbers.size());
  for (const int number : numbers) texts.push_back(std::to_string(number));
  return core::join(texts, ", ");
}

}  // namespace

TrafficControl::TrafficControl(core::SimulatorPort* link, OverrideManager* overrides, TrafficOptions options,
                               Report report)
    : link_(link), overrides_(overrides), options_(options), report_(std::move(report)) {}

std::string TrafficControl::command(const std::vector<core::TrafficPose>& poses, double sim_time) {
  if (const auto wrong = core::check(poses)) return *wrong;
  if (!link_->status().up()) return noLink().text;
  const Lock lock(*mutex_);
  std::set<int> wanted;
  std::vector<int> taken, given;
  for (const core::TrafficPose& pose : poses) wanted.insert(pose.number);
  for (auto it = flown_.begin(); it != flown_.end();) {
    if (wanted.count(it->first) != 0) {
      ++it;
      continue;
    }
    given.push_back(it->first);
    overrides_->release(OverrideHolder::kTraffic, core::trafficOverride(it->first));
    it = flown_.erase(it);
  }
  for (auto it = lost_.begin(); it != lost_.end();) it = wanted.count(*it) != 0 ? std::next(it) : lost_.erase(it);
  std::string refusal = take(poses, &taken);
  for (const core::TrafficPose& pose : poses) {
    const bool has = flown_.count(pose.number) != 0;
    if (has || std::find(taken.begin(), taken.end(), pose.number) != taken.end()) {
      flown_[pose.number].command(pose, sim_time);
    }
  }
  commanded_at_ = sim_time;
  due_ = std::min(due_, link_->clock().steadySeconds());
  follow();
  if (!taken.empty()) report_("traffic: " + listed(taken) + " placed by command", true);
  if (!given.empty()) report_("traffic: " + listed(given) + " given back", true);
  if (refusal.empty() && !lost_.empty()) {
    refusal = "aircraft " + listed({lost_.begin(), lost_.end()}) +
              " released by another client: not placed until a command leaves them out, and a later one names them";
  }
  return refusal;
}

/// Those that are not had yet, in one write to the disk: many of them must not keep the thread from its other work.
/// Returns why some cannot be had; empty: all are.
std::string TrafficControl::take(const std::vector<core::TrafficPose>& poses, std::vector<int>* taken) {
  std::vector<int> wanted;
  std::vector<std::string> names;
  for (const core::TrafficPose& pose : poses) {
    if (lost_.count(pose.number) != 0 || flown_.count(pose.number) != 0) continue;
    wanted.push_back(pose.number);
    names.push_back(core::trafficOverride(pose.number));
  }
  if (wanted.empty()) return "";
  std::string refusal;
  try {
    overrides_->acquire(OverrideHolder::kTraffic, names);
  } catch (const core::JournalError& error) {
    refusal = core::whyNotChanged(error);
  }
  const std::vector<std::string> active = overrides_->active();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (std::find(active.begin(), active.end(), names[i]) != active.end()) taken->push_back(wanted[i]);
  }
  return refusal.empty() && taken->size() < wanted.size() ? "there is no journal to note it in" : refusal;
}

/// The scenery's origin is looked at while poses are written in its axes.
void TrafficControl::follow() {
  if (flown_.empty() || options_.vehx) {
    scenery_.reset();
    knows_scenery_ = false;
  } else if (!scenery_) {
    scenery_ = link_->subscribe(
        {"scenery", core::sceneryDatarefs(), core::kEveryFrameRateHz, 0},
        [this](const core::RrefView& view, const core::ReceiveInfo&) {
          for (std::size_t i = 0; i < view.size(); ++i) {
            if (view[i].index == 0) latitude_ = view[i].value;
            if (view[i].index == 1) longitude_ = view[i].value;
          }
          knows_scenery_ = view.size() == core::sceneryDatarefs().size() || knows_scenery_;
        },
        mutex_);
  }
}

void TrafficControl::tick(double sim_time) {
  const Lock lock(*mutex_);
  if (flown_.empty()) return;
  if (sim_time - commanded_at_ > options_.timeout) return release("no command came for a while");
  const double now = link_->clock().steadySeconds();
  const bool due = now >= due_ || link_->inLockstep();
  if (!due || (!options_.vehx && !knows_scenery_)) return;
  due_ = std::max(due_ + 1.0 / options_.rate, now - 1.0 / options_.rate);
  const std::vector<std::string> active = overrides_->active();
  for (auto it = flown_.begin(); it != flown_.end();) {
    if (std::find(active.begin(), active.end(), core::trafficOverride(it->first)) == active.end()) {
      lost_.insert(it->first);
      it = flown_.erase(it);
    } else {
      send(it->second.at(sim_time));
      ++it;
    }
  }
}

void TrafficControl::send(const core::TrafficPose& pose) {
  if (options_.vehx) {
    std::array<std::uint8_t, core::kVehicleSize> buffer{};
    const auto size = core::encodeVehx({buffer.data(), buffer.size()}, core::vehicleOf(pose));
    if (size.ok()) link_->send({buffer.data(), size.value()});
    return;
  }
  const core::GeoPoint origin{static_cast<double>(latitude_), static_cast<double>(longitude_), 0.0};
  for (const core::DatarefWrite& each : core::trafficWrites(pose, core::TangentFrame(origin))) {
    link_->write(each.dataref, each.value);
  }
}

void TrafficControl::release(const std::string& why) {
  const Lock lock(*mutex_);
  if (flown_.empty()) return;
  const std::vector<int> given = numbers();
  for (const int number : given) overrides_->release(OverrideHolder::kTraffic, core::trafficOverride(number));
  forget();
  report_("traffic: " + listed(given) + " given back: " + why, true);
}

void TrafficControl::forget() {
  const Lock lock(*mutex_);
  flown_.clear();
  lost_.clear();
  follow();
}

std::vector<int> TrafficControl::numbers() const {
  const Lock lock(*mutex_);
  std::vector<int> out;
  for (const auto& each : flown_) out.push_back(each.first);
  return out;
}

}  // namespace xplane_bridge
