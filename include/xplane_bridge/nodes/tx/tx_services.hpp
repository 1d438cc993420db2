#pragma once

#include <functional>
#include <string>

#include <ros/time.h>
#include <std_srvs/SetBool.h>

#include "xplane_bridge/ClearFailures.h"
#include "xplane_bridge/IdentifySurfaces.h"
#include "xplane_bridge/InjectExcitation.h"
#include "xplane_bridge/LoadAircraft.h"
#include "xplane_bridge/ResetFlight.h"
#include "xplane_bridge/RunCommand.h"
#include "xplane_bridge/SetAutopilot.h"
#include "xplane_bridge/SetDataref.h"
#include "xplane_bridge/SetDisturbance.h"
#include "xplane_bridge/SetFailure.h"
#include "xplane_bridge/SetLoading.h"
#include "xplane_bridge/SetMode.h"
#include "xplane_bridge/SetTime.h"
#include "xplane_bridge/SetView.h"
#include "xplane_bridge/SetWeather.h"
#include "xplane_bridge/SetWind.h"
#include "xplane_bridge/Situation.h"
#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/nodes/base/event_log.hpp"

namespace xplane_bridge {

/// What tx_node's services ask of its Actuation. They may wait for X-Plane; the control path never waits for them.
/// `who` is the full name of the service that was called.
class TxServices {
 public:
  /// @param now stamp of a request
  TxServices(Actuation* actuation, EventLog* events, std::function<ros::Time()> now);

  void serve(const SetMode::Request& request, SetMode::Response* response, const std::string& who);
  void serve(const SetDataref::Request& request, SetDataref::Response* response, const std::string& who);
  void serve(const RunCommand::Request& request, RunCommand::Response* response, const std::string& who);
  void serve(const SetView::Request& request, SetView::Response* response, const std::string& who);
  /// Pauses or flies on.
  void serve(const std_srvs::SetBool::Request& request, std_srvs::SetBool::Response* response, const std::string& who);

  void serve(const SetFailure::Request& request, SetFailure::Response* response, const std::string& who);
  void serve(const ClearFailures::Request& request, ClearFailures::Response* response, const std::string& who);
  void serve(const InjectExcitation::Request& request, InjectExcitation::Response* response, const std::string& who);
  void serve(const IdentifySurfaces::Request& request, IdentifySurfaces::Response* response, const std::string& who);
  void serve(const SetDisturbance::Request& request, SetDisturbance::Response* response, const std::string& who);

  // Changes of the flight: refused for what the request itself says or as X-Plane is now, or accepted, with an event
  // promised, and begun.
  void serve(const ResetFlight::Request& request, ResetFlight::Response* response, const std::string& who);
  void serve(const SetWind::Request& request, SetWind::Response* response, const std::string& who);
  void serve(const SetTime::Request& request, SetTime::Response* response, const std::string& who);
  void serve(const SetWeather::Request& request, SetWeather::Response* response, const std::string& who);
  void serve(const SetAutopilot::Request& request, SetAutopilot::Response* response, const std::string& who);
  void serve(const SetLoading::Request& request, SetLoading::Response* response, const std::string& who);
  void serve(const LoadAircraft::Request& request, LoadAircraft::Response* response, const std::string& who);
  void saveSituation(const Situation::Request& request, Situation::Response* response, const std::string& who);
  void loadSituation(const Situation::Request& request, Situation::Response* response, const std::string& who);

 private:
  template <class Request, class Response, class Begin>
  void accept(const Request& request, Response* response, const Begin& begin);

  Actuation& actuation_;
  EventLog& events_;
  const std::function<ros::Time()> now_;
};

}  // namespace xplane_bridge
