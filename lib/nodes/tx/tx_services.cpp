#include "xplane_bridge/nodes/tx/tx_services.hpp"

#include <cstdint>
#include <optional>
#include <utility>

#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/nodes/base/service_result.hpp"
#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"
#include "xplane_bridge/nodes/messages/flight_conversions.hpp"

namespace xplane_bridge {
namespace {

template <class Response>
void answer(const RequestResult& result, Response* response) {
  response->result = toMessage(result);
  response->success = result.success();
}

template <class Request>
bool setsWind(const Request& /*request*/) {
  return false;
}
bool setsWind(const SetWind::Request& /*request*/) { return true; }
bool setsWind(const SetWeather::Request& /*request*/) { return true; }

}  // namespace

TxServices::TxServices(Actuation* actuation, EventLog* events, std::function<ros::Time()> now)
    : actuation_(*actuation), events_(*events), now_(std::move(now)) {}

void TxServices::serve(const SetMode::Request& request, SetMode::Response* response, const std::string& who) {
  actuation_.path().requestMode({0, request.mode, who, now_().toSec()});
  const core::ModeStatus status = actuation_.path().mode();
  response->mode = static_cast<std::uint8_t>(status.mode);
  response->success = response->mode == request.mode;
  response->result = response->success ? result(ServiceResult::OK, core::toString(status.mode))
                                       : result(ServiceResult::REFUSED, status.reason);
}

void TxServices::serve(const SetDataref::Request& request, SetDataref::Response* response, const std::string& who) {
  const auto written = actuation_.settings().setDataref(request.name, request.values, who);
  answer(written.result, response);
  response->values = written.values;
}

void TxServices::serve(const RunCommand::Request& request, RunCommand::Response* response, const std::string& /*who*/) {
  answer(actuation_.settings().runCommand(request.name), response);
}

void TxServices::serve(const SetView::Request& request, SetView::Response* response, const std::string& who) {
  const core::ViewWish wish{
      request.view, {request.roll_deg, request.pitch_deg, request.heading_deg}, request.field_of_view_deg};
  answer(actuation_.views().setView(wish, who), response);
}

void TxServices::serve(const std_srvs::SetBool::Request& request, std_srvs::SetBool::Response* response,
                       const std::string& who) {
  const RequestResult result = actuation_.setPaused(request.data != 0, who);
  response->success = result.success();
  response->message = result.text;
}

// --- failures, excitations, disturbances ---

void TxServices::serve(const SetFailure::Request& request, SetFailure::Response* response, const std::string& who) {
  answer(actuation_.failures().set(toCore(request), who), response);
}

void TxServices::serve(const ClearFailures::Request& request, ClearFailures::Response* response,
                       const std::string& who) {
  const auto done = actuation_.failures().clear(request.names, request.include_simulator, who);
  answer(done.result, response);
  response->cleared = done.cleared;
}

void TxServices::serve(const InjectExcitation::Request& request, InjectExcitation::Response* response,
                       const std::string& who) {
  const auto injected = actuation_.inject(toCore(request), who);
  answer(injected.result, response);
  response->id = injected.id;
}

void TxServices::serve(const IdentifySurfaces::Request& request, IdentifySurfaces::Response* response,
                       const std::string& who) {
  const auto begun = actuation_.identifySurfaces(toCore(request), who, [this] { return events_.reserve(); });
  answer(begun.result, response);
  response->event_number = begun.event_number;
}

void TxServices::serve(const SetDisturbance::Request& request, SetDisturbance::Response* response,
                       const std::string& who) {
  const auto disturbed = actuation_.disturb(request.kind, toCore(request), who);
  answer(disturbed.result, response);
  response->id = disturbed.id;
}

// --- changes of the flight ---

template <class Request, class Response, class Begin>
void TxServices::accept(const Request& request, Response* response, const Begin& begin) {
  if (const auto wrong = wrongWith(request)) {
    response->result = result(ServiceResult::REFUSED, *wrong);
  } else if (const auto running = setsWind(request) ? actuation_.windRefusal() : std::nullopt) {
    response->result = toMessage(*running);
  } else if (const auto refusal = actuation_.jobs().refusal()) {
    response->result = toMessage(*refusal);
  } else {
    response->success = true;
    response->event_number = events_.reserve();
    response->result =
        result(ServiceResult::ACCEPTED, "event " + std::to_string(response->event_number) + " will report the outcome");
    begin(&actuation_.jobs(), response->event_number);
  }
}

void TxServices::serve(const ResetFlight::Request& request, ResetFlight::Response* response, const std::string& who) {
  accept(request, response, [&](FlightJobs* jobs, std::uint32_t event) { beginReset(jobs, request, event, who); });
}

void TxServices::serve(const SetWind::Request& request, SetWind::Response* response, const std::string& who) {
  accept(request, response, [&](FlightJobs* jobs, std::uint32_t event) { jobs->setWind(toCore(request), event, who); });
}

void TxServices::serve(const SetTime::Request& request, SetTime::Response* response, const std::string& who) {
  accept(request, response, [&](FlightJobs* jobs, std::uint32_t event) { jobs->setTime(toCore(request), event, who); });
}

void TxServices::serve(const SetWeather::Request& request, SetWeather::Response* response, const std::string& who) {
  accept(request, response,
         [&](FlightJobs* jobs, std::uint32_t event) { jobs->setWeather(toCore(request), event, who); });
}

void TxServices::serve(const SetAutopilot::Request& request, SetAutopilot::Response* response, const std::string& who) {
  accept(request, response,
         [&](FlightJobs* jobs, std::uint32_t event) { jobs->setAutopilot(toCore(request), event, who); });
}

void TxServices::serve(const SetLoading::Request& request, SetLoading::Response* response, const std::string& who) {
  accept(request, response,
         [&](FlightJobs* jobs, std::uint32_t event) { jobs->setLoading(toCore(request), event, who); });
}

void TxServices::serve(const LoadAircraft::Request& request, LoadAircraft::Response* response, const std::string& who) {
  accept(request, response,
         [&](FlightJobs* jobs, std::uint32_t event) { jobs->loadAircraft(request.path, request.livery, event, who); });
}

void TxServices::saveSituation(const Situation::Request& request, Situation::Response* response,
                               const std::string& who) {
  accept(request, response,
         [&](FlightJobs* jobs, std::uint32_t event) { jobs->saveSituation(request.path, event, who); });
}

void TxServices::loadSituation(const Situation::Request& request, Situation::Response* response,
                               const std::string& who) {
  accept(request, response,
         [&](FlightJobs* jobs, std::uint32_t event) { jobs->loadSituation(request.path, event, who); });
}

}  // namespace xplane_bridge
