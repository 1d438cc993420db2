#include "xplane_bridge/nodes/rx/rx_node.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

#include <rosgraph_msgs/Clock.h>
#include <std_msgs/Header.h>

#include "xplane_bridge/LinkState.h"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"

namespace xplane_bridge {
namespace {

constexpr double kSupervisePeriod = 0.1;  // [s]
// An X-Plane that answers but does not say its version within this is treated as of unknown version.
constexpr double kVersionPatience = 2.0;    // [s]
constexpr double kAwayPublishPeriod = 1.0;  // [s]
constexpr std::int32_t kRposCheckRateHz = 20;
// Further away, a flight state says nothing about the time of another datagram.
constexpr double kNearState = 0.1;  // [s]

constexpr int kFlightPriority = 10;
constexpr int kDatarefPriority = 1;
constexpr int kMissionPriority = 0;
constexpr int kIdentityPriority = -1;
constexpr int kLockstepFlightPriority = -2;  // handled last: who answers a state has all else of its frame

constexpr std::uint32_t kRowsQueueSize = 100;

std::vector<std::string> pathsOf(const std::vector<core::DatarefRequest>& requests) {
  std::vector<std::string> paths;
  paths.reserve(requests.size());
  for (const core::DatarefRequest& request : requests) paths.push_back(request.path);
  return paths;
}

const char* nameOf(core::Transport transport) { return transport == core::Transport::kData ? "data" : "rref"; }

}  // namespace

void RxNode::loadParameters(const ParamLoader& own) {
  options_ = loadRxOptions(own);
  options_.publish_unheard = lockstep() || wired();
  options_.latch_state = lockstep();
  if (lockstep() && options_.position_source == core::PositionMode::kXpc) {
    own.refuse("position_source", "auto, local, rpos or float32 with lockstep/enabled: X-Plane Connect has no frames");
  }
  if (common().transport == core::Transport::kData && common().data_port == 0 && !options_.configure_xplane) {
    own.refuse("configure_xplane", "true while the shared parameter data_port is 0: X-Plane has to be given the port");
  }
  core::FlightStateAssembler::Options assembler;
  assembler.transport = common().transport;
  assembler.rate = options_.rates[static_cast<std::size_t>(core::FieldGroup::kFlight)];
  assembler.position = options_.position_source;
  assembler.clock = core::ClockFilter::Options::atRate(
      assembler.transport == core::Transport::kData ? options_.data_output_rate : assembler.rate);
  assembler.clock.exact = lockstep();
  flight_ = std::make_unique<core::FlightStateAssembler>(assembler);
  if (options_.origin) {
    flight_->setMapOrigin(*options_.origin);
  }
  flight_publisher_ = std::make_unique<FlightPublisher>(options_, common().frames);
  std::optional<SimulatorStamps> stamps;
  std::optional<core::Clock> stamp_clock;
  if (stampsBySimulator()) {
    stamps = SimulatorStamps{clock(), stampOf(0.0)};
    stamp_clock = clock();
  }
  missions_ =
      makeMissionPublishers(options_.rates, common().transport, common().frames, options_.publish_unheard, stamps);
  datarefs_ = std::make_unique<DatarefPublisher>(options_.datarefs, options_.publish_unheard, stamp_clock);
  experiment_ = std::make_unique<ExperimentPublisher>(common(), shared());
  if (options_.traffic_rate > 0) traffic_ = std::make_unique<TrafficPublisher>(options_.traffic_rate, stamps);
  addStreams();
}

void RxNode::addStreams() {
  const auto add = [this](DatarefStream stream) { streams_.push_back(std::move(stream)); };
  add({"flight",
       options_.rates[static_cast<std::size_t>(core::FieldGroup::kFlight)],
       lockstep() ? kLockstepFlightPriority : kFlightPriority,
       [this] { return pathsOf(flight_->requests()); },
       [this](const core::RrefView& datagram, std::int64_t receive_ns) {
         publishState(flight_->onRref(datagram, receive_ns), receive_ns);
       },
       false,
       {}});
  for (std::size_t i = 0; i < missions_.size(); ++i) {
    MissionPublisher* const mission = missions_[i].get();
    const std::size_t own_index = streams_.size();
    add({core::toString(mission->group()),
         mission->rate(),
         kMissionPriority,
         [mission] { return mission->requests(); },
         [this, mission, own_index](const core::RrefView& datagram, std::int64_t receive_ns) {
           if (mission->onRref(datagram, receive_ns, flight_->clock())) {
             streams_[own_index].current = false;
           }
         },
         false,
         {}});
  }
  for (std::size_t batch = 0; batch < datarefs_->batches(); ++batch) {
    add({"datarefs at " + std::to_string(datarefs_->rate(batch)) + " Hz",
         datarefs_->rate(batch),
         kDatarefPriority,
         [this, batch] { return datarefs_->requests(batch); },
         [this, batch](const core::RrefView& datagram, std::int64_t receive_ns) {
           datarefs_->onRref(batch, datagram, receive_ns, nearSimTime(receive_ns), flight_->clock().epoch());
         },
         false,
         {}});
  }
  if (traffic_) {
    traffic_stream_ = streams_.size();
    add({"traffic",
         options_.traffic_rate,
         kMissionPriority,
         [this] { return traffic_->requests(); },
         [this](const core::RrefView& datagram, std::int64_t receive_ns) {
           traffic_->onRref(datagram, receive_ns, flight_->clock());
         },
         false,
         {}});
  }
  add({"aircraft",
       core::AircraftIdentityReader::kRateHz,
       kIdentityPriority,
       [] { return core::AircraftIdentityReader::datarefs(); },
       [this](const core::RrefView& datagram, std::int64_t receive_ns) {
         const bool another = aircraft_.known();
         if (aircraft_.add(datagram, receive_ns)) {
           if (another) {
             flight_->raiseEpoch();
           }
           publishLinkState(last_status_);
         }
       },
       false,
       {}});
  add({"settings",
       core::XPlaneSettings::kRateHz,
       kIdentityPriority,
       [] { return core::XPlaneSettings::datarefs(); },
       [this](const core::RrefView& datagram, std::int64_t receive_ns) { settings_.add(datagram, receive_ns); },
       false,
       {}});
}

void RxNode::advertise() {
  // What is published at once is sent in this order: in lock-step who answers a state has all else of its frame.
  if (lockstep() || stampsBySimulator()) {
    clock_publisher_ = topics().advertise<rosgraph_msgs::Clock>(kClockTopic, 1, true);
  }
  if (!lockstep()) flight_publisher_->advertise(topics());
  for (const auto& mission : missions_) {
    mission->advertise(topics());
  }
  datarefs_->advertise(topics());
  if (traffic_) traffic_->advertise(topics());
  if (traffic_ && wired()) {
    // Logged, so that a replay asks X-Plane when the node did, with or without subscribers there.
    for (const bool wanted : {true, false}) {
      const auto turns = [this, wanted] { return traffic_->demanded() == wanted && traffic_->wanted() != wanted; };
      pollInput(wanted ? "traffic wanted" : "traffic not wanted", turns, [this, wanted] {
        const std::lock_guard<std::mutex> lock(mutex_);
        wantTraffic(wanted);
      });
    }
  }
  if (common().transport == core::Transport::kData) {
    rows_publisher_ = advertiseTopic<DataRows>("data_rows", kRowsQueueSize);
  }
  link_state_publisher_ = advertiseTopic<LinkState>("link_state", 1, true);
  if (lockstep()) flight_publisher_->advertise(topics());
  advertiseInput<SetOrigin::Request, SetOrigin::Response>(
      "set_origin", [this](const auto& request, auto& response) { setOrigin(request, response); });
  advertiseService<GetDataref::Request, GetDataref::Response>(
      "get_dataref", [this](const auto& request, auto& response) { getDataref(request, response); });
  advertiseApart<GetTerrain::Request, GetTerrain::Response>(
      "get_terrain", [this](const auto& request, auto& response) { getTerrain(request, response); });
  addTimer(kSupervisePeriod, [this] { supervise(); });
  addAllDiagnostics();
  experiment_->advertise(&handle());
  experiment_->setParameters(experiment_->readParameters(handle()));
  if (lockstep()) {
    done_publisher_ = advertiseTopic<std_msgs::Header>(kLockstepDoneTopic, 1, true);
    mute(true);
    publishClock();  // the time is known before the flight, as recorders want it
  }
}

void RxNode::configureLink(core::SimLinkOptions* options) {
  options->data_output.restore_leftovers = true;
  if (options_.position_source == core::PositionMode::kXpc) {
    options->xpc_port = static_cast<std::uint16_t>(options_.xpc_port);
  }
  if (common().transport != core::Transport::kData) {
    return;
  }
  options->unheard_version = options_.xplane_version;
  options->data_output.enabled = true;
  options->data_output.port = static_cast<std::uint16_t>(common().data_port);
  options->data_output.configure = options_.configure_xplane;
  options->data_output.rate_hz = options_.data_output_rate;
  options->data_output.address = options_.data_address;
  options->data_output.rows = wantedRows();
}

core::SimLinkCallbacks RxNode::linkCallbacks() {
  core::SimLinkCallbacks callbacks;
  callbacks.on_data = [this](const core::DataView& datagram, const core::ReceiveInfo& info) { onData(datagram, info); };
  callbacks.on_rpos = [this](const core::Rpos& position, const core::ReceiveInfo& info) { onRpos(position, info); };
  callbacks.on_xpc = [this](const core::XpcPosition& position, const core::ReceiveInfo& info) {
    onXpc(position, info);
  };
  callbacks.on_state = [this](const core::LinkStatus& status) { onLinkState(status); };
  return callbacks;
}

std::int64_t RxNode::begin(const core::ReceiveInfo& info) {
  if (info.link_epoch != link_epoch_) {
    link_epoch_ = info.link_epoch;
    flight_->reset();
    flight_publisher_->restart();
    for (const auto& mission : missions_) {
      mission->reset();
    }
    datarefs_->reset();
    if (traffic_) traffic_->reset();
    aircraft_.reset();
    settings_.reset();
    rows_.clear();
    consistency_.reset();
    last_state_.reset();
  }
  if (lockstep()) return clock().system_ns();
  const std::int64_t wall_ns = receiveClock().system_ns();
  return receive_clock_.toHostTime(info.kernel_stamp ? info.stamp_ns : wall_ns, wall_ns, clock().steady_ns());
}

void RxNode::onRref(std::size_t stream, const core::RrefView& datagram, const core::ReceiveInfo& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::int64_t receive_ns = begin(info);
  if (streams_[stream].current) {
    streams_[stream].receive(datagram, receive_ns);
  }
}

void RxNode::onData(const core::DataView& datagram, const core::ReceiveInfo& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::int64_t receive_ns = begin(info);
  publishState(flight_->onData(datagram, receive_ns), receive_ns);
  rows_.update(datagram, receive_ns);
  for (const auto& mission : missions_) {
    mission->onRows(rows_, receive_ns, flight_->clock());
  }
  if (options_.publish_unheard || rows_publisher_.getNumSubscribers() > 0) {
    publishRows(datagram, info, receive_ns);
  }
}

void RxNode::onRpos(const core::Rpos& position, const core::ReceiveInfo& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  flight_->onRpos(position, begin(info));
}

void RxNode::onXpc(const core::XpcPosition& position, const core::ReceiveInfo& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  flight_->onXpc(position, begin(info));
}

void RxNode::onLinkState(const core::LinkStatus& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_status_ = status;
  // Rows may come so slowly that the link is silent between two of them; that does not end one way.
  if (status.up()) rows_.setOneWay(status.one_way);
  publishLinkState(status);
}

void RxNode::publishState(const core::FlightState* state, std::int64_t receive_ns) {
  if (state == nullptr) {
    return;
  }
  state_is_new_ = true;
  if (stampsBySimulator()) {
    setStampTime(state->sim_time_unwrapped);
    publishClock();
  }
  if (flight_->map() && !held()) {
    flight_publisher_->publish(stamped(*state), *flight_->map(), receive_ns);
  }
  last_state_ = *state;
  last_state_received_ns_ = receive_ns;
  consistency_.add(*state);
}

core::FlightState RxNode::stamped(const core::FlightState& state) const {
  core::FlightState out = state;
  if (stampsBySimulator()) {
    out.stamp_ns = clock().system_ns();
    out.stamp_uncertainty = 0.0F;
  }
  return out;
}

void RxNode::publishRows(const core::DataView& datagram, const core::ReceiveInfo& info, std::int64_t receive_ns) {
  const bool has_state = last_state_ && last_state_received_ns_ == receive_ns;
  rows_message_.header.stamp =
      stampsBySimulator() ? stampNow() : toRosTime(has_state ? last_state_->stamp_ns : receive_ns);
  rows_message_.label.assign(info.label.begin(), info.label.end());
  rows_message_.index.clear();
  rows_message_.values.clear();
  for (std::size_t k = 0; k < datagram.size(); ++k) {
    const core::DataRowView row = datagram[k];
    rows_message_.index.push_back(row.index());
    for (std::size_t slot = 0; slot < core::kDataSlots; ++slot) {
      rows_message_.values.push_back(row.value(slot));
    }
  }
  rows_publisher_.publish(rows_message_);
}

float RxNode::nearSimTime(std::int64_t receive_ns) const {
  const double age = core::toSeconds(receive_ns - last_state_received_ns_);
  return last_state_ && std::abs(age) < kNearState ? last_state_->sim_time : std::numeric_limits<float>::quiet_NaN();
}

void RxNode::publishLinkState(const core::LinkStatus& status) {
  if (held()) return;
  LinkState message;
  toMessage(status, nameOf(common().transport), &message);
  message.header.stamp = stampNow();
  if (lockstep()) {  // the same in each run
    message.host.clear();
    message.port = 0;
  }
  message.aircraft_icao = aircraft_.identity().icao;
  message.aircraft_description = aircraft_.identity().description;
  link_state_publisher_.publish(message);
}

void RxNode::publishExperiment() {
  if (!adopted_version_ || aircraft_.answers() == 0 || settings_.values().empty()) {
    return;
  }
  experiment_->publish(*adopted_version_, aircraft_.identity(), settings_, stampNow());
}

void RxNode::supervise() {
  const core::LinkStatus status = link().status();
  adoptVersion(status);
  if (adopted_version_) {
    if (traffic_ && !wired()) {
      const std::lock_guard<std::mutex> lock(mutex_);
      wantTraffic(traffic_->demanded());
    }
    renewSubscriptions();
    supervisePositionCheck();
  }
  if (!lockstep()) {
    const std::lock_guard<std::mutex> lock(mutex_);
    publishExperiment();
  }
  const bool away = status.state == core::LinkState::kSearching || status.state == core::LinkState::kLost;
  if (away && (!search_word_pause_ || search_word_pause_->over())) {
    search_word_pause_.emplace(clock(), kAwayPublishPeriod);
    const std::lock_guard<std::mutex> lock(mutex_);
    publishLinkState(status);
  }
}

void RxNode::adoptVersion(const core::LinkStatus& status) {
  const core::SimulatorVersion version = status.version;
  if (version.known()) {
    version_patience_.reset();
  } else {
    if (!status.up()) {
      version_patience_.reset();
      return;
    }
    if (!version_patience_) {
      version_patience_.emplace(clock(), kVersionPatience);
    }
    if (!version_patience_->over()) {
      return;
    }
  }
  if (adopted_version_ == version) {
    return;
  }
  adopted_version_ = version;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    flight_->setVersion(version);
    flight_publisher_->expectRates(version.known() || common().transport != core::Transport::kData);
    for (const auto& mission : missions_) {
      mission->configure(version);
    }
    if (traffic_) traffic_->configure(version);
    for (DatarefStream& stream : streams_) {
      stream.current = false;
    }
  }
  if (common().transport == core::Transport::kData) {
    link().setDataRows(wantedRows());
  }
}

void RxNode::renewSubscriptions() {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    DatarefStream& stream = streams_[i];
    core::RrefGroup group;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (stream.current) {
        continue;
      }
      group = {stream.name, stream.requests(), stream.rate, stream.priority};
    }
    if (group.datarefs.empty()) {
      stream.subscription.reset();
    } else if (stream.subscription) {
      stream.subscription.replace(std::move(group));
    } else {
      stream.subscription = link().subscribe(
          std::move(group),
          [this, i](const core::RrefView& datagram, const core::ReceiveInfo& info) { onRref(i, datagram, info); });
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    stream.current = true;
  }
}

/// With mutex_ locked.
void RxNode::wantTraffic(bool wanted) {
  if (traffic_->want(wanted)) streams_[traffic_stream_].current = false;
}

void RxNode::supervisePositionCheck() {
  std::int32_t wanted = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto verdict = flight_->positionCheck().verdict();
    if (options_.position_source == core::PositionMode::kRpos ||
        (flight_->wantsRpos() && verdict == core::PositionCheck::Verdict::kDisagrees)) {
      wanted = core::kEveryFrameRateHz;
    } else if (flight_->wantsRpos() && verdict == core::PositionCheck::Verdict::kUnknown) {
      wanted = kRposCheckRateHz;
    }
  }
  if (wanted != rpos_rate_) {
    rpos_rate_ = wanted;
    link().setRposRate(wanted);
  }
}

std::vector<std::int32_t> RxNode::wantedRows() const {
  std::set<std::int32_t> rows(flight_->rows().begin(), flight_->rows().end());
  for (const auto& mission : missions_) {
    rows.insert(mission->rows().begin(), mission->rows().end());
  }
  rows.insert(options_.extra_rows.begin(), options_.extra_rows.end());
  return {rows.begin(), rows.end()};
}

void RxNode::publishFinalState() {
  const std::lock_guard<std::mutex> lock(mutex_);
  core::LinkStatus status = last_status_;
  status.state = core::LinkState::kLost;
  status.reason = "rx_node has stopped";
  publishLinkState(status);
}

}  // namespace xplane_bridge
