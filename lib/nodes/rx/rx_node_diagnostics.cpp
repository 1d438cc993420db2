// What rx_node says in /diagnostics, beside the link's own status (link_diagnostics.cpp).

#include <array>
#include <limits>
#include <string>
#include <utility>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/nodes/base/build_info.hpp"
#include "xplane_bridge/nodes/rx/rx_node.hpp"

namespace xplane_bridge {
namespace {

using diagnostic_msgs::DiagnosticStatus;

struct GroupName {
  std::uint32_t bit;
  const char* name;
};

constexpr int kParametersPeriod = 5;  // [diagnostics] between two readings of the parameters

constexpr GroupName kFlightGroups[] = {
    {core::FlightState::kValidSim, "simulator"},
    {core::FlightState::kValidPosition, "position"},
    {core::FlightState::kValidAgl, "height above ground"},
    {core::FlightState::kValidBaro, "barometric altitudes"},
    {core::FlightState::kValidAttitude, "attitude"},
    {core::FlightState::kValidMagnetic, "magnetic heading"},
    {core::FlightState::kValidRates, "rates"},
    {core::FlightState::kValidAngularAccel, "angular acceleration"},
    {core::FlightState::kValidVelocity, "velocity"},
    {core::FlightState::kValidAirVelocity, "velocity through the air"},
    {core::FlightState::kValidAirspeeds, "airspeeds"},
    {core::FlightState::kValidAtmosphere, "atmosphere"},
    {core::FlightState::kValidLoad, "load factors"},
    {core::FlightState::kValidRawAirflow, "X-Plane's airflow angles"},
    {core::FlightState::kValidWind, "wind"},
    {core::FlightState::kValidMoments, "aerodynamic moments"},
    {core::FlightState::kValidControls, "controls"},
    {core::FlightState::kValidContact, "ground contact"},
};

constexpr std::uint32_t allGroups() {
  std::uint32_t bits = 0;
  for (const GroupName& group : kFlightGroups) bits |= group.bit;
  return bits;
}
static_assert(allGroups() == core::FlightState::kValidAll, "every group of FlightState has a name here");

std::string missingGroups(std::uint32_t valid) {
  std::vector<std::string> names;
  for (const GroupName& group : kFlightGroups) {
    if ((valid & group.bit) == 0) {
      names.emplace_back(group.name);
    }
  }
  return core::join(names);
}

const char* nameOf(core::PositionSource source) {
  switch (source) {
    case core::PositionSource::kNone:
      return "none";
    case core::PositionSource::kLocal:
      return "scenery coordinates, agree with RPOS";
    case core::PositionSource::kLocalUnchecked:
      return "scenery coordinates, not compared with RPOS yet";
    case core::PositionSource::kRpos:
      return "RPOS";
    case core::PositionSource::kXpc:
      return "X-Plane Connect";
    case core::PositionSource::kFloat32:
      return "float32 latitude and longitude (steps of 0.4 to 1.35 m)";
  }
  return "unknown";
}

constexpr const char* kNotConnected = "not connected";

// A group counts as not arriving when its last message is older than this many of its periods and a bit.
constexpr double kLatePeriods = 2.5;
constexpr double kLateMargin = 0.5;  // [s]

}  // namespace

void RxNode::addAllDiagnostics() {
  mission_rates_.resize(missions_.size());
  addDiagnostics("flight state", [this](auto& status) { diagnoseFlight(&status); });
  addDiagnostics("clock", [this](auto& status) { diagnoseClock(&status); });
  addDiagnostics("position", [this](auto& status) { diagnosePosition(&status); });
  addDiagnostics("physics", [this](auto& status) { diagnosePhysics(&status); });
  if (!missions_.empty()) {
    addDiagnostics("mission state", [this](auto& status) { diagnoseMission(&status); });
  }
  addDiagnostics("experiment", [this](auto& status) { diagnoseExperiment(&status); });
}

void RxNode::diagnoseExperiment(diagnostic_updater::DiagnosticStatusWrapper* status) {
  // Here, because asking the parameter server may take long, and for nodes that are started later.
  if (!lockstep() && ++parameters_age_ >= kParametersPeriod) {
    parameters_age_ = 0;
    const XmlRpc::XmlRpcValue parameters = experiment_->readParameters(handle());
    const std::lock_guard<std::mutex> lock(mutex_);
    if (parameters.valid()) experiment_->setParameters(parameters);
  }
  const std::string commit = packageCommit();
  status->summaryf(DiagnosticStatus::OK, "xplane_bridge %s%s", packageVersion(),
                   commit.empty() ? "" : (", commit " + commit).c_str());
}

void RxNode::diagnoseFlight(diagnostic_updater::DiagnosticStatusWrapper* status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto& counters = flight_->counters();
  const double rate = state_rate_.update(counters.states, clock().steady_ns());
  const bool flowing = rate > 0.0;
  const bool should_flow = last_status_.state == core::LinkState::kConnected;
  if (flight_->noFlight()) {
    status->summary(DiagnosticStatus::WARN, "no flight is loaded in X-Plane (all values are 0)");
  } else if (should_flow && !flowing && counters.without_time > 0) {
    status->summary(DiagnosticStatus::WARN,
                    "what X-Plane sends has no simulator time: with transport data, select row 1 (times)");
  } else if (!flowing) {
    status->summary(should_flow ? DiagnosticStatus::WARN : DiagnosticStatus::OK,
                    should_flow ? "X-Plane answers, but no flight state comes" : "no flight state while not connected");
  } else if (!flight_publisher_->started()) {
    status->summary(DiagnosticStatus::WARN, "waiting for attitude, position and rates");
  } else {
    status->summaryf(DiagnosticStatus::OK, "%.1f states/s", rate);
    const std::string missing = last_state_ ? missingGroups(last_state_->valid) : "";
    if (!missing.empty()) {
      status->mergeSummary(DiagnosticStatus::WARN, "not known: " + missing);
    }
  }
  status->addf("States (1/s)", "%.1f", rate);
  status->add("States published (-)", flight_publisher_->published());
  status->add("Groups not known", last_state_ ? missingGroups(last_state_->valid) : "all");
  if (last_state_) {
    status->addf("Age of the last state (s)", "%.3f", core::toSeconds(receiveNow() - last_state_received_ns_));
    status->addf("Frame period (s)", "%.4f", static_cast<double>(last_state_->frame_period));
  }
  status->add("Epoch (-)", flight_->clock().epoch());
  status->add("Duplicate frames dropped (-)", counters.duplicates);
  status->add("Frames out of order dropped (-)", counters.out_of_order);
  status->add("Datagrams without simulator time (-)", counters.without_time);
  status->add("Frames of X-Plane not received (-)", flight_->clock().missedFrames());
  status->add("Incomplete frames (-)", flight_->frames().counters().incomplete);
  status->add("Datarefs that never answer (-)", flight_->frames().silentCount());
  status->add("Jumps of position (-)", counters.jumps);
  status->add("Moves of the scenery's origin (-)", counters.origin_shifts);
}

void RxNode::diagnoseClock(diagnostic_updater::DiagnosticStatusWrapper* status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const core::ClockFilter& clock = flight_->clock();
  if (!last_status_.up()) {
    status->summary(DiagnosticStatus::WARN, kNotConnected);
  } else if (!last_state_) {
    status->summary(DiagnosticStatus::OK, "no simulator time yet");
  } else if (clock.paused()) {
    status->summary(DiagnosticStatus::OK, "simulator time stands");
  } else if (!clock.fitted()) {
    status->summary(DiagnosticStatus::OK, "simulator time and host time are being compared");
  } else {
    status->summaryf(DiagnosticStatus::OK, "simulator time is known to %.1f ms", clock.uncertainty() * 1e3);
    constexpr double kNoticeableSlowness = 0.02;
    if (clock.timeRatio() < 1.0 - kNoticeableSlowness) {
      status->mergeSummaryf(DiagnosticStatus::WARN,
                            "the simulator runs at %.0f %% of real time: its frame rate is too low",
                            clock.timeRatio() * 1e2);
    }
  }
  status->addf("Uncertainty (s)", "%.6f", clock.uncertainty());
  status->addf("Simulator time over host time (-)", "%.4f", clock.timeRatio());
  status->add("Fitted", clock.fitted());
  status->add("Steps of the host's clock followed (-)", receive_clock_.steps());
}

void RxNode::diagnosePosition(diagnostic_updater::DiagnosticStatusWrapper* status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const core::PositionCheck& check = flight_->positionCheck();
  const core::PositionSource source = last_state_ ? last_state_->position_source : core::PositionSource::kNone;
  status->summary(DiagnosticStatus::OK, nameOf(source));
  if (!last_status_.up()) status->summary(DiagnosticStatus::WARN, kNotConnected);
  if (check.verdict() == core::PositionCheck::Verdict::kDisagrees) {
    status->mergeSummary(DiagnosticStatus::WARN,
                         "positions computed on the sphere disagree with RPOS: this X-Plane may use another earth");
  }
  if (source == core::PositionSource::kFloat32 && options_.position_source != core::PositionMode::kFloat32) {
    status->mergeSummary(DiagnosticStatus::WARN, "coarse: neither scenery coordinates nor RPOS can be used");
  }
  if (options_.position_source == core::PositionMode::kXpc && link().counters().xpc_datagrams == 0) {
    status->mergeSummary(DiagnosticStatus::WARN, "X-Plane Connect does not answer on UDP port " +
                                                     std::to_string(options_.xpc_port) +
                                                     ": is the plugin installed, and position_source meant?");
  }
  status->add("Source", nameOf(source));
  status->add("Comparisons with RPOS (-)", check.comparisons());
  status->addf("Height error at the last comparison (m)", "%.4f", check.heightError());
  status->addf("Cross-track error at the last comparison (m)", "%.4f", check.crossTrackError());
  status->add("Position epoch (-)", flight_->positionEpoch());
}

void RxNode::diagnosePhysics(diagnostic_updater::DiagnosticStatusWrapper* status) {
  std::array<core::ConsistencyResult, core::kConsistencyCheckCount> results;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    results = consistency_.evaluate();
  }
  std::size_t consistent = 0;
  status->summary(DiagnosticStatus::OK, "");
  for (std::size_t i = 0; i < results.size(); ++i) {
    const core::ConsistencyResult& result = results[i];
    const std::string check = core::toString(static_cast<core::ConsistencyCheck>(i));
    consistent += result.verdict == core::ConsistencyVerdict::kConsistent ? 1U : 0U;
    if (result.verdict == core::ConsistencyVerdict::kInconsistent) {
      status->mergeSummary(DiagnosticStatus::WARN, check + " disagree: " + core::toString(result.fault));
    }
    status->add(check, core::toString(result.verdict));
    status->addf(check + ", disagreement (SI units)", "%.4f", result.error);
    status->addf(check + ", tolerated (SI units)", "%.4f", result.tolerance);
  }
  if (status->level == DiagnosticStatus::OK) {
    status->summary(DiagnosticStatus::OK, consistent == results.size()
                                              ? "all quantities agree"
                                              : "nothing disagrees; the flight does not show all quantities");
  }
}

void RxNode::diagnoseMission(diagnostic_updater::DiagnosticStatusWrapper* status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::string> silent_groups;
  for (std::size_t i = 0; i < missions_.size(); ++i) {
    const MissionPublisher& mission = *missions_[i];
    const MissionPublisher::Report& report = mission.report();
    const std::string name = core::toString(mission.group());
    const double age = report.stamp_ns == 0 ? std::numeric_limits<double>::infinity()
                                            : core::toSeconds(clock().system_ns() - report.stamp_ns);
    if (age > kLatePeriods / mission.rate() + kLateMargin) {
      silent_groups.push_back(name);
    }
    status->addf(name + " (1/s)", "%.1f", mission_rates_[i].update(report.published, clock().steady_ns()));
    status->addf(name + ", age (s)", "%.2f", age);
    status->addf(name + ", groups not known (bits)", "0x%x", report.missing);
  }
  const bool should_flow = last_status_.state == core::LinkState::kConnected;
  const std::string silent = core::join(silent_groups);
  status->summary(DiagnosticStatus::OK, silent.empty() ? "all groups arrive" : "not arriving: " + silent);
  if (should_flow && !silent.empty()) {
    status->summary(DiagnosticStatus::WARN, "not arriving: " + silent);
  }
}

}  // namespace xplane_bridge
