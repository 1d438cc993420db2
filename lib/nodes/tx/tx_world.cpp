// What tx_node does to the flight and to the world around the aircraft.

#include <optional>

#include "xplane_bridge/LoadAircraft.h"
#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/SetDisturbance.h"
#include "xplane_bridge/SetWeather.h"
#include "xplane_bridge/SetWind.h"
#include "xplane_bridge/Situation.h"
#include "xplane_bridge/nodes/base/service_result.hpp"
#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"
#include "xplane_bridge/nodes/messages/flight_conversions.hpp"
#include "xplane_bridge/nodes/messages/traffic_conversions.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {
namespace {

constexpr double kOldestPoses = 1.0;  // [s] in lock-step; what is older has no stamp of the flight

template <class Request>
bool setsWind(const Request&) {
  return false;
}
bool setsWind(const SetWind::Request&) { return true; }
bool setsWind(const SetWeather::Request&) { return true; }

}  // namespace

/// A flight service: refused for what the request itself says or as X-Plane is now, or accepted, with an event
/// promised, and begun.
template <class Service, class Begin>
void TxNode::advertiseJob(const std::string& service, Begin begin) {
  advertiseOwn<Service>(service, [this, service, begin](const auto& request, auto* response) {
    if (const auto wrong = wrongWith(request)) {
      response->result = result(ServiceResult::REFUSED, *wrong);
    } else if (const auto running = setsWind(request) ? actuation_->windRefusal() : std::nullopt) {
      response->result = toMessage(*running);
    } else if (const auto refusal = actuation_->jobs().refusal()) {
      response->result = toMessage(*refusal);
    } else {
      response->success = true;
      response->event_number = events_.reserve();
      response->result = result(ServiceResult::ACCEPTED,
                                "event " + std::to_string(response->event_number) + " will report the outcome");
      begin(actuation_->jobs(), request, response->event_number, name() + "/" + service);
    }
  });
}

void TxNode::advertiseFlightServices() {
  const auto by = [](auto job) {
    return [job](auto& jobs, const auto& request, auto number, const auto& who) {
      (jobs.*job)(toCore(request), number, who);
    };
  };
  advertiseJob<ResetFlight>("reset_flight", [](auto& jobs, const auto& request, auto number, const auto& who) {
    beginReset(&jobs, request, number, who);
  });
  advertiseJob<SetWind>("set_wind", by(&FlightJobs::setWind));
  advertiseJob<SetTime>("set_time", by(&FlightJobs::setTime));
  advertiseJob<SetWeather>("set_weather", by(&FlightJobs::setWeather));
  advertiseJob<SetAutopilot>("set_autopilot", by(&FlightJobs::setAutopilot));
  advertiseJob<SetLoading>("set_loading", by(&FlightJobs::setLoading));
  advertiseJob<LoadAircraft>("load_aircraft", [](auto& jobs, const auto& request, auto number, const auto& who) {
    jobs.loadAircraft(request.path, request.livery, number, who);
  });
  advertiseJob<Situation>("save_state", [](auto& jobs, const auto& request, auto number, const auto& who) {
    jobs.saveSituation(request.path, number, who);
  });
  advertiseJob<Situation>("load_state", [](auto& jobs, const auto& request, auto number, const auto& who) {
    jobs.loadSituation(request.path, number, who);
  });
  advertiseOwn<SetDisturbance>("disturb", [this](const auto& request, auto* response) {
    const auto disturbed = actuation_->disturb(request.kind, toCore(request), name() + "/disturb");
    response->result = toMessage(disturbed.result);
    response->success = disturbed.result.success();
    response->id = disturbed.id;
  });
}

void TxNode::onTraffic(const TrafficCommand& message) {
  const auto poses = toCore(message);
  double sim_time = actuation_->simTime();
  if (lockstep_) {  // carried out some frames after its own, whose time its stamp is
    const double age = (stampNow() - message.header.stamp).toSec();
    if (age > 0.0 && age < kOldestPoses) sim_time -= age;
  }
  const std::string refusal = std::holds_alternative<std::string>(poses)
                                  ? std::get<std::string>(poses)
                                  : actuation_->traffic().command(std::get<0>(poses), sim_time);
  if (!refusal.empty()) ROS_WARN_THROTTLE(1.0, "traffic/command is refused: %s", refusal.c_str());
}

}  // namespace xplane_bridge
