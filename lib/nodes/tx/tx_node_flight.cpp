// Flight services of tx_node: what they refuse, and what of the node FlightJobs needs.

#include <cmath>

#include "xplane_bridge/Event.h"
#include "xplane_bridge/nodes/base/service_result.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {
namespace {

constexpr double kSuspensionWait = 1.0;   // [s] until everything must be given back
constexpr std::int32_t kOldest = 110000;  // X-Plane 11.00: earlier ones have other messages for placing and loading

std::optional<double> given(float value) {
  return std::isnan(value) ? std::nullopt : std::optional<double>(static_cast<double>(value));
}

core::FlightStart toCore(const ResetFlight::Request& q) {
  core::FlightStart out;
  out.latitude_deg = q.latitude;
  out.longitude_deg = q.longitude;
  out.altitude_msl = q.altitude_msl;
  out.roll_deg = static_cast<double>(q.roll_deg);
  out.pitch_deg = static_cast<double>(q.pitch_deg);
  out.heading_true_deg = static_cast<double>(q.heading_true_deg);
  out.true_airspeed = static_cast<double>(q.true_airspeed);
  out.flight_path_angle_deg = static_cast<double>(q.flight_path_angle_deg);
  return out;
}

core::Loading toCore(const SetLoading::Request& q) {
  core::Loading out;
  out.fuel_tank.assign(q.fuel_tank.begin(), q.fuel_tank.end());
  out.payload_mass = given(q.payload_mass);
  out.cg_offset = given(q.cg_offset);
  return out;
}

}  // namespace

void TxNode::makeFlightJobs() {
  FlightChangeHooks hooks;
  hooks.watch = [this] {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    return watch_;
  };
  hooks.resets = [this] {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    return resets_;
  };
  hooks.identities = [this] {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    return identity_.told();
  };
  hooks.aircraft = [this] {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    return described(identity_.identity());
  };
  hooks.suspend_control = [this](const std::string& reason) { suspendControl(reason); };
  hooks.pausing = [this](const std::string& who) {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    pause_by_ = who;
  };
  auto jobs = std::make_unique<FlightJobs>(
      &link(), FlightChangeOptions{options_.setting_timeout, options_.load_timeout}, std::move(hooks),
      [this](std::uint32_t number, const FlightChangeOutcome& outcome, const std::string& who) {
        logEvent(static_cast<std::uint8_t>(outcome.kind), outcome.text, who, outcome.success, number);
      });
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  jobs_ = std::move(jobs);
}

void TxNode::suspendControl(const std::string& reason) {
  if (reason.empty()) return path_->resume();
  path_->suspend(reason);
  link().waitUntil([this] { return !(surfaces_->driving() || overrides_->releasesPending()); }, kSuspensionWait);
}

std::optional<ServiceResult> TxNode::refusalOfJob(const std::optional<std::string>& wrong) const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const std::int32_t version = link_status_.version.number;
  if (wrong) return result(ServiceResult::REFUSED, *wrong);
  if (!linkIsUp() || version == 0 || !jobs_) return result(ServiceResult::NO_LINK, "X-Plane is not connected");
  if (version < kOldest) {
    return result(ServiceResult::NOT_SUPPORTED,
                  "this is X-Plane " + std::to_string(version) + ": its messages for this are not known before 11.00");
  }
  if (jobs_->full()) {
    return result(ServiceResult::REFUSED,
                  std::to_string(FlightJobs::kMostWaiting) + " requests wait already: wait for their events");
  }
  return std::nullopt;
}

template <class Response>
void TxNode::serveJob(const std::string& service, const std::optional<std::string>& wrong, Response* response,
                      const std::function<void(std::uint32_t, const std::string&)>& begin) {
  if (const auto refusal = refusalOfJob(wrong)) {
    response->result = *refusal;
    return;
  }
  response->success = true;
  response->event_number = events_.reserve();
  response->result =
      result(ServiceResult::ACCEPTED, "event " + std::to_string(response->event_number) + " will tell the outcome");
  begin(response->event_number, name() + "/" + service);
}

void TxNode::advertiseFlightServices() {
  advertiseService<ResetFlight::Request, ResetFlight::Response>(
      name() + "/reset_flight", [this](const ResetFlight::Request& q, ResetFlight::Response& r) {
        const core::FlightStart start = toCore(q);
        serveJob("reset_flight", core::check(start), &r,
                 [&](std::uint32_t number, const std::string& who) { jobs_->reset(start, number, who); });
      });
  advertiseService<SetWind::Request, SetWind::Response>(
      name() + "/set_wind", [this](const SetWind::Request& q, SetWind::Response& r) {
        const core::UniformWind wind{static_cast<double>(q.speed), static_cast<double>(q.from_deg),
                                     static_cast<double>(q.turbulence)};
        serveJob("set_wind", core::check(wind), &r,
                 [&](std::uint32_t number, const std::string& who) { jobs_->setWind(wind, number, who); });
      });
  advertiseService<SetLoading::Request, SetLoading::Response>(
      name() + "/set_loading", [this](const SetLoading::Request& q, SetLoading::Response& r) {
        const core::Loading loading = toCore(q);
        serveJob("set_loading", core::check(loading), &r,
                 [&](std::uint32_t number, const std::string& who) { jobs_->setLoading(loading, number, who); });
      });
  advertiseService<LoadAircraft::Request, LoadAircraft::Response>(
      name() + "/load_aircraft", [this](const LoadAircraft::Request& q, LoadAircraft::Response& r) {
        auto wrong = core::checkXPlanePath(q.path, ".acf");
        if (!wrong && q.livery < 0) {
          wrong = "livery is " + std::to_string(q.livery) + ": expected 0 (the default) or more";
        }
        serveJob("load_aircraft", wrong, &r, [&](std::uint32_t number, const std::string& who) {
          jobs_->loadAircraft(q.path, q.livery, number, who);
        });
      });
  advertiseService<Situation::Request, Situation::Response>(
      name() + "/save_state", [this](const Situation::Request& q, Situation::Response& r) {
        serveJob("save_state", core::checkXPlanePath(q.path, ".sit"), &r,
                 [&](std::uint32_t number, const std::string& who) { jobs_->saveSituation(q.path, number, who); });
      });
  advertiseService<Situation::Request, Situation::Response>(
      name() + "/load_state", [this](const Situation::Request& q, Situation::Response& r) {
        serveJob("load_state", core::checkXPlanePath(q.path, ".sit"), &r,
                 [&](std::uint32_t number, const std::string& who) { jobs_->loadSituation(q.path, number, who); });
      });
}

}  // namespace xplane_bridge
