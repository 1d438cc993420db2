// Services of rx_node. They run on the service thread and may wait.

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "xplane_bridge/core/link/terrain_query.hpp"
#include "xplane_bridge/core/wire/dataref_path.hpp"
#include "xplane_bridge/nodes/base/service_result.hpp"
#include "xplane_bridge/nodes/rx/rx_node.hpp"

namespace xplane_bridge {
namespace {

constexpr double kDefaultReadTimeout = 1.0;   // [s]
constexpr double kLongestReadTimeout = 10.0;  // [s]

}  // namespace

void RxNode::setOrigin(const SetOrigin::Request& request, SetOrigin::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  response.position_epoch = flight_->positionEpoch();
  core::GeoPoint origin{request.latitude, request.longitude, request.altitude_msl};
  if (request.here) {
    if (!last_state_ || !last_state_->has(core::FlightState::kValidPosition)) {
      response.result = result(ServiceResult::REFUSED, "the aircraft's position is not known yet");
      return;
    }
    origin = {last_state_->latitude, last_state_->longitude, last_state_->altitude_msl};
  } else if (request.latitude == 0.0 && request.longitude == 0.0) {
    response.result = result(ServiceResult::REFUSED,
                             "no place is given: expected here, or latitude and longitude, of "
                             "which one is not 0");
    return;
  }
  if (!(std::abs(origin.latitude_deg) <= 90.0 && std::abs(origin.longitude_deg) <= 180.0 &&
        origin.height >= RxOptions::kOriginAltitude.lowest && origin.height <= RxOptions::kOriginAltitude.highest)) {
    response.result = result(ServiceResult::REFUSED,
                             "latitude must be from -90 to 90, longitude from -180 to 180, altitude_msl from -1000 to "
                             "100000 m");
    return;
  }
  flight_->setMapOrigin(origin);
  response.position_epoch = flight_->positionEpoch();
  flight_publisher_->publishOrigin(*flight_->map(), response.position_epoch, clock().system_ns());
  response.result = result(ServiceResult::OK, "the next states refer to the new origin");
  response.success = true;
}

void RxNode::getDataref(const GetDataref::Request& request, GetDataref::Response& response) {
  const auto newest_time = [this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    return last_state_ ? last_state_->sim_time : std::numeric_limits<float>::quiet_NaN();
  };
  response.sim_time = newest_time();
  if (!(request.timeout >= 0.0 && request.timeout <= kLongestReadTimeout)) {
    response.result = result(ServiceResult::REFUSED, "timeout must be from 0 (the default of 1 s) to 10 s");
    return;
  }
  std::vector<std::string> paths;
  try {
    paths = core::datarefElements(request.name);
  } catch (const std::invalid_argument& error) {
    response.result = result(ServiceResult::REFUSED, error.what());
    return;
  }
  if (!link().status().peer.valid()) {
    response.result = result(ServiceResult::NO_LINK, "X-Plane has not been found");
    return;
  }
  const double timeout = request.timeout > 0.0 ? request.timeout : kDefaultReadTimeout;
  for (const core::DatarefValue& value : link().read(paths, timeout)) {
    response.values.push_back(value.value_or(std::numeric_limits<float>::quiet_NaN()));
  }
  response.sim_time = newest_time();  // a read may last seconds
  const auto missing =
      std::find_if(response.values.begin(), response.values.end(), [](float value) { return std::isnan(value); });
  if (missing != response.values.end()) {
    const std::string path = paths[static_cast<std::size_t>(missing - response.values.begin())];
    response.result = result(ServiceResult::TIMEOUT,
                             "X-Plane did not answer for " + path + ": unknown to it, or the link is down" +
                                 (paths.size() > 1 ? ", or not all " + std::to_string(paths.size()) +
                                                         " elements could be asked for in time: set a longer timeout"
                                                   : ""));
    return;
  }
  response.result = result(ServiceResult::OK, "read");
  response.success = true;
}

void RxNode::getTerrain(const GetTerrain::Request& request, GetTerrain::Response& response) {
  response.latitude = response.longitude = response.terrain_height = std::numeric_limits<double>::quiet_NaN();
  if (!(std::abs(request.latitude) <= 90.0 && std::abs(request.longitude) <= 180.0) ||
      (request.latitude == 0.0 && request.longitude == 0.0)) {
    response.result =
        result(ServiceResult::REFUSED,
               "latitude must be from -90 to 90 and longitude from -180 to 180, not both 0: give a place");
    return;
  }
  if (!(request.timeout >= 0.0 && request.timeout <= kLongestReadTimeout)) {
    response.result = result(ServiceResult::REFUSED, "timeout must be from 0 (the default of 1 s) to 10 s");
    return;
  }
  const core::Endpoint peer = link().status().peer;
  if (!peer.valid()) {
    response.result = result(ServiceResult::NO_LINK, "X-Plane has not been found");
    return;
  }
  const core::TerrainAnswer answer = core::askTerrain(
      {peer.address, static_cast<std::uint16_t>(options_.xpc_port)}, request.latitude, request.longitude,
      request.timeout > 0.0 ? request.timeout : kDefaultReadTimeout, [this] { return stopping(); });
  if (!answer.terrain) {
    response.result = result(ServiceResult::TIMEOUT, answer.problem);
    return;
  }
  response.latitude = answer.terrain->latitude_deg;
  response.longitude = answer.terrain->longitude_deg;
  response.terrain_height = answer.terrain->terrain_elevation_m;
  response.is_water = answer.terrain->is_wet != 0;
  response.result = result(ServiceResult::OK, "X-Plane Connect answered");
  response.success = true;
}

}  // namespace xplane_bridge
