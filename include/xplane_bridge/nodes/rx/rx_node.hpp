#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/DataRows.h"
#include "xplane_bridge/GetDataref.h"
#include "xplane_bridge/GetTerrain.h"
#include "xplane_bridge/SetOrigin.h"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/state/clock_filter.hpp"
#include "xplane_bridge/core/state/consistency_monitor.hpp"
#include "xplane_bridge/core/state/state_assembler.hpp"
#include "xplane_bridge/core/state/xplane_settings.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/rate_meter.hpp"
#include "xplane_bridge/nodes/rx/dataref_publisher.hpp"
#include "xplane_bridge/nodes/rx/experiment_publisher.hpp"
#include "xplane_bridge/nodes/rx/flight_publisher.hpp"
#include "xplane_bridge/nodes/rx/mission_publisher.hpp"
#include "xplane_bridge/nodes/rx/rx_options.hpp"
#include "xplane_bridge/nodes/rx/traffic_publisher.hpp"

namespace xplane_bridge {

/// X-Plane -> ROS: flight state, mission state, standard messages, any dataref (docs/nodes/rx_node.md).
///
/// Data are published as they arrive, by roscpp's network thread, which then sends them; where the wire is logged in
/// its order, by a thread of the link's own. A timer on the subscription thread looks after what is asked of
/// X-Plane: it changes with X-Plane's version and with the aircraft. mutex_ guards everything both touch; it is never
/// held while the link is called, except from the link's own callbacks.
class RxNode : public BaseNode {
 protected:
  void loadParameters(const ParamLoader& own) override;
  void advertise() override;
  void configureLink(core::SimLinkOptions* options) override;
  core::SimLinkCallbacks linkCallbacks() override;
  bool receivesOnNetworkThread() const override { return true; }
  void publishFinalState() override;
  void beginFlight() override;
  void beginFrame(const core::LockstepFrame& frame) override;
  bool frameReady(const core::LockstepFrame& frame) override;
  void endFrame(const core::LockstepFrame& frame) override;

 private:
  /// One group of datarefs kept subscribed.
  struct DatarefStream {
    std::string name;
    int rate = 0;
    int priority = 0;
    std::function<std::vector<std::string>()> requests;
    std::function<void(const core::RrefView&, std::int64_t receive_ns)> receive;
    bool current = false;             ///< X-Plane was asked for requests(); else answers belong to an older list
    core::Subscription subscription;  ///< of the timer; empty while nothing is requested
  };

  // Link's thread.
  void onRref(std::size_t stream, const core::RrefView& datagram, const core::ReceiveInfo& info);
  void onData(const core::DataView& datagram, const core::ReceiveInfo& info);
  void onRpos(const core::Rpos& position, const core::ReceiveInfo& info);
  void onXpc(const core::XpcPosition& position, const core::ReceiveInfo& info);
  void onLinkState(const core::LinkStatus& status);
  /// Begins every callback: the time of receipt, after noticing that the link came up anew.
  std::int64_t begin(const core::ReceiveInfo& info);
  void publishState(const core::FlightState* state, std::int64_t receive_ns);
  void publishRows(const core::DataView& datagram, const core::ReceiveInfo& info, std::int64_t receive_ns);

  // Timer.
  void supervise();
  void adoptVersion(const core::LinkStatus& status);
  void renewSubscriptions();
  void wantTraffic(bool wanted);
  void supervisePositionCheck();
  std::vector<std::int32_t> wantedRows() const;

  void addStreams();
  void mute(bool muted);
  void publishClock();
  /// With the stamp that it is published with.
  core::FlightState stamped(const core::FlightState& state) const;
  bool wireIsOrdered() const override { return true; }
  bool leadsClock() const override { return true; }
  /// [ns] now, of the clock that receive times are of.
  std::int64_t receiveNow() const { return lockstep() ? clock().system_ns() : receiveClock().system_ns(); }
  void publishLinkState(const core::LinkStatus& status);
  /// Once X-Plane has said which it is, what is loaded and what is set.
  void publishExperiment();
  float nearSimTime(std::int64_t receive_ns) const;

  void setOrigin(const SetOrigin::Request& request, SetOrigin::Response& response);
  void getDataref(const GetDataref::Request& request, GetDataref::Response& response);
  void getTerrain(const GetTerrain::Request& request, GetTerrain::Response& response);

  // Diagnostics (rx_node_diagnostics.cpp).
  void addAllDiagnostics();
  void diagnoseFlight(diagnostic_updater::DiagnosticStatusWrapper* status);
  void diagnoseClock(diagnostic_updater::DiagnosticStatusWrapper* status);
  void diagnosePosition(diagnostic_updater::DiagnosticStatusWrapper* status);
  void diagnosePhysics(diagnostic_updater::DiagnosticStatusWrapper* status);
  void diagnoseMission(diagnostic_updater::DiagnosticStatusWrapper* status);
  void diagnoseExperiment(diagnostic_updater::DiagnosticStatusWrapper* status);

  RxOptions options_;

  std::mutex mutex_;
  std::unique_ptr<core::FlightStateAssembler> flight_;
  std::unique_ptr<FlightPublisher> flight_publisher_;
  std::vector<std::unique_ptr<MissionPublisher>> missions_;
  std::unique_ptr<DatarefPublisher> datarefs_;
  std::unique_ptr<TrafficPublisher> traffic_;  ///< null: not wanted
  std::size_t traffic_stream_ = 0;
  core::AircraftIdentityReader aircraft_;
  core::XPlaneSettings settings_;
  std::unique_ptr<ExperimentPublisher> experiment_;
  core::RowStore rows_;
  core::ReceiveClock receive_clock_;
  core::ConsistencyMonitor consistency_;
  std::uint32_t link_epoch_ = 0;
  std::optional<core::FlightState> last_state_;
  std::int64_t last_state_received_ns_ = 0;
  core::LinkStatus last_status_;
  bool state_is_new_ = false;  // of the frame in lock-step
  std::optional<std::uint32_t> ended_frame_;

  // Timer only.
  std::optional<core::SimulatorVersion> adopted_version_;
  std::optional<core::Deadline> version_patience_;   ///< running while X-Plane answers without saying its version
  std::optional<core::Deadline> search_word_pause_;  ///< running since SEARCHING or LOST was published last
  std::int32_t rpos_rate_ = 0;

  // Diagnostics thread only.
  RateMeter state_rate_;
  std::vector<RateMeter> mission_rates_;
  int parameters_age_ = 0;  ///< [diagnostics] since the parameters were read

  ros::Publisher link_state_publisher_;
  ros::Publisher rows_publisher_;
  DataRows rows_message_;
  ros::Publisher clock_publisher_;
  ros::Publisher done_publisher_;

  std::vector<DatarefStream> streams_;  // last: their subscriptions end first
};

}  // namespace xplane_bridge
