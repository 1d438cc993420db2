#include "xplane_bridge/core/state/state_assembler.hpp"

#include <algorithm>
#include <cmath>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

/// Position by scenery coordinates and by float32 latitude, longitude may differ by the latter's steps and no more [m].
constexpr double kFloat32Tolerance = 3.0;
/// How long values that no row carries wait for each other [s].
constexpr double kSupplementJoinWindow = 0.1;

/// Distance on the ground and in height [m].
double distance(const GeoPoint& a, const GeoPoint& b) { return std::hypot(groundDistance(a, b), a.height - b.height); }

// What a group's fields need beyond unit conversion.

template <typename State>
void finish(State&, const ClockFilter&) {}

void finish(SurfaceStates& surfaces, const ClockFilter&) { computeEquivalentDeflections(surfaces); }

void finish(AutopilotState& autopilot, const ClockFilter&) {
  // One dial, in knots or in Mach; no aircraft flies at 10 kt on autopilot, none at Mach 10.
  constexpr float kLargestMach = 10.0F;
  const float dial = autopilot.target_airspeed;
  const bool mach = std::isfinite(autopilot.airspeed_is_mach) ? autopilot.airspeed_is_mach > 0.5F : dial < kLargestMach;
  autopilot.target_mach = mach ? dial : kNaNf;
  autopilot.target_airspeed = mach ? kNaNf : static_cast<float>(static_cast<double>(dial) * kMetersPerSecondPerKnot);
}

void finish(EngineStates& engines, const ClockFilter&) { computeCelsius(engines); }

/// Frames per second of host time; NaN where only the clock can say it and has no fit.
float frameRate(const SimStatus& status, const ClockFilter& clock) {
  if (!(status.frame_period > 0.0F)) return kNaNf;
  const float acceleration = timeAcceleration(status.time_ratio_requested);
  const float simulated = status.frame_period * acceleration;
  if (!clock.mayHaveLastedLonger(simulated, acceleration)) return 1.0F / status.frame_period;
  return static_cast<float>(clock.timeRatio()) / simulated;
}

void finish(SimStatus& status, const ClockFilter& clock) {
  status.time_ratio = static_cast<float>(clock.timeRatio());
  status.frames_missed = static_cast<std::uint32_t>(clock.missedFrames());
  if (!std::isfinite(status.frame_rate)) status.frame_rate = frameRate(status, clock);
  if (std::isnan(status.frame_rate)) status.valid &= ~SimStatus::kValidRate;
}

void finish(EnvironmentState& world, const ClockFilter&) {
  world.terrain_height = world.altitude_msl - world.height_above_ground;
}

}  // namespace

// --- flight ---

FlightStateAssembler::FlightStateAssembler(const Options& options)
    : options_(options), decoder_(FieldGroup::kFlight, options.transport, options.version), clock_(options.clock) {
  frames_ = makeFrames();
}

std::unique_ptr<RrefFrameAssembler> FlightStateAssembler::makeFrames() const {
  RrefFrameAssembler::Options frames = RrefFrameAssembler::Options::atRate(options_.rate);
  if (options_.transport != Transport::kRref) frames.join_window = std::max(frames.join_window, kSupplementJoinWindow);
  return std::make_unique<RrefFrameAssembler>(decoder_.requests().size(), 0, frames);
}

bool FlightStateAssembler::wantsRpos() const {
  return options_.position == PositionMode::kAuto || options_.position == PositionMode::kRpos;
}

void FlightStateAssembler::setVersion(SimulatorVersion version) {
  if (version == options_.version) return;
  options_.version = version;
  decoder_ = StateDecoder(FieldGroup::kFlight, options_.transport, version);
  frames_ = makeFrames();
}

const FlightState* FlightStateAssembler::onRref(const RrefView& datagram, std::int64_t receive_ns) {
  if (!frames_->add(datagram, receive_ns) || options_.transport != Transport::kRref) return nullptr;
  inputs_ = FlightInputs{};
  decoder_.decode(frames_->values(), nullptr, RowStore::kNever, &inputs_);
  return assemble(frames_->receiveTime(), AttitudeReference::kLocalLevel);
}

const FlightState* FlightStateAssembler::onData(const DataView& datagram, std::int64_t receive_ns) {
  if (options_.transport != Transport::kData) return nullptr;
  row_store_.update(datagram, receive_ns);
  inputs_ = FlightInputs{};
  const bool fresh = frames_->counters().samples > 0 &&
                     receive_ns - frames_->receiveTime() <= toNanoseconds(options_.max_supplement_age);
  decoder_.decode(fresh ? frames_->values() : unknown(frames_->size()), &row_store_, receive_ns, &inputs_);
  const bool origin = options_.version.is(Otherwise::kRow17Axes);
  return assemble(receive_ns, origin ? AttitudeReference::kSceneryOrigin : options_.row_attitude_reference);
}

void FlightStateAssembler::onRpos(const Rpos& position, std::int64_t receive_ns) {
  rpos_ = {{position.latitude_deg, position.longitude_deg, position.elevation_m}, receive_ns, true};
  position_check_.addReference(rpos_.place);
}

void FlightStateAssembler::onXpc(const XpcPosition& position, std::int64_t receive_ns) {
  xpc_ = {{position.latitude_deg, position.longitude_deg, position.elevation_m}, receive_ns, true};
}

void FlightStateAssembler::setMapOrigin(const GeoPoint& origin) {
  map_ = TangentFrame(origin, usableEarthRadius(inputs_));
  ++position_epoch_;
}

void FlightStateAssembler::raiseEpoch() {
  clock_.raiseEpoch();
  has_previous_ = false;
  position_check_.reset();
}

void FlightStateAssembler::reset() {
  frames_->reset();
  clock_.reset();
  has_previous_ = false;
  position_check_ = PositionCheck();
  rpos_.known = xpc_.known = false;
  frame_count_ = 0;
}

void FlightStateAssembler::restart() {
  clock_ = ClockFilter(options_.clock);
  has_previous_ = false;
  frame_count_ = 0;
}

const std::vector<float>& FlightStateAssembler::unknown(std::size_t size) {
  unknown_.assign(size, kNaNf);
  return unknown_;
}

const FlightState* FlightStateAssembler::assemble(std::int64_t receive_ns, AttitudeReference attitude_reference) {
  if (!std::isfinite(inputs_.sim_time)) {
    ++counters_.without_time;
    return nullptr;
  }
  no_flight_ = isNoFlight(inputs_);
  const PositionFix position = no_flight_ ? PositionFix{} : choosePosition(receive_ns);
  if (!map_ && position.source != PositionSource::kNone) {
    map_ = TangentFrame(position.place, usableEarthRadius(inputs_));
  }
  FlightState state = computeFlightState(inputs_, position, map_ ? *map_ : TangentFrame(), attitude_reference);

  if (jumped(state)) {
    ++counters_.jumps;
    raiseEpoch();
  }
  ClockSample sample;
  sample.receive_ns = receive_ns;
  sample.sim_time = static_cast<float>(inputs_.sim_time);
  sample.acceleration = timeAcceleration(static_cast<float>(inputs_.time_ratio_requested));
  sample.frame_period = static_cast<float>(inputs_.frame_period) * sample.acceleration;
  sample.paused = state.paused;
  sample.replay = state.replay;
  const ClockEstimate clock = clock_.update(sample);
  if (!clock.usable) {
    ++(clock.event == ClockEvent::kDuplicate ? counters_.duplicates : counters_.out_of_order);
    return nullptr;
  }

  state.stamp_ns = clock.stamp_ns;
  state.sim_time_unwrapped = clock.sim_time;
  state.stamp_uncertainty = clock.uncertainty;
  state.epoch = clock.epoch;
  state.frame_count = ++frame_count_;
  state.position_epoch = position_epoch_;
  has_previous_ = state.has(FlightState::kValidPosition);
  state_ = state;
  ++counters_.states;
  noteOriginShift();
  return &state_;
}

PositionFix FlightStateAssembler::choosePosition(std::int64_t receive_ns) {
  const PositionFix coarse = float32Position(inputs_);
  PositionFix local = localPosition(inputs_);
  // Other sphere, other origin convention (X-Plane 10), garbage: millimetres of a wrong place are no position.
  const bool plausible =
      local.source != PositionSource::kNone &&
      (coarse.source == PositionSource::kNone || distance(local.place, coarse.place) < kFloat32Tolerance);
  if (!plausible) local = PositionFix{};
  if (plausible) position_check_.addComputed(local.place);
  const PositionFix rpos = fromExternalPosition(rpos_, PositionSource::kRpos, receive_ns);

  switch (options_.position) {
    case PositionMode::kLocal:
      return local;
    case PositionMode::kRpos:
      return rpos;
    case PositionMode::kXpc:
      return fromExternalPosition(xpc_, PositionSource::kXpc, receive_ns);
    case PositionMode::kFloat32:
      return coarse;
    case PositionMode::kAuto:
      break;
  }
  const PositionCheck::Verdict verdict = position_check_.verdict();
  const bool trusted = plausible && verdict != PositionCheck::Verdict::kDisagrees;
  if (trusted) {
    if (verdict == PositionCheck::Verdict::kAgrees) local.source = PositionSource::kLocal;
    return local;
  }
  if (rpos.source != PositionSource::kNone) return rpos;
  return coarse;
}

PositionFix FlightStateAssembler::fromExternalPosition(const ExternalPosition& position, PositionSource source,
                                                       std::int64_t receive_ns) const {
  const double age = toSeconds(receive_ns - position.receive_ns);
  if (!position.known || std::abs(age) > options_.max_external_position_age) return {};
  // The position has no simulator time: it is moved by its age along the velocity. Origin axes do, over so short a way.
  const Eigen::Vector3d velocity = enuFromOpengl(inputs_.local_velocity);  // which X-Plane keeps through a pause
  if (!velocity.allFinite() || inputs_.paused > 0.5) return {position.place, source};
  const double flown = age * static_cast<double>(timeAcceleration(static_cast<float>(inputs_.time_ratio_requested)));
  return {TangentFrame(position.place, usableEarthRadius(inputs_)).geoPoint(velocity * flown), source};
}

bool FlightStateAssembler::jumped(const FlightState& state) const {
  if (!has_previous_ || !state.has(FlightState::kValidPosition)) return false;
  if (state.position_source != state_.position_source &&
      (state.position_source == PositionSource::kFloat32 || state_.position_source == PositionSource::kFloat32)) {
    return false;
  }
  const double step = inputs_.sim_time - static_cast<double>(state_.sim_time);
  // A late datagram, which the clock drops: under time acceleration its frame may lie far behind.
  if (step < 0.0 && step >= -options_.clock.backward_tolerance) return false;
  const double elapsed = std::max(0.0, step);
  const double speed = state_.has(FlightState::kValidVelocity) ? state_.velocity_ned.norm() : 0.0;
  // Twice the way it could have flown: accelerations over a gap in the stream are no jump.
  const double reach = options_.jump_distance + 2.0 * speed * elapsed;
  return distance({state.latitude, state.longitude, state.altitude_msl},
                  {state_.latitude, state_.longitude, state_.altitude_msl}) > reach;
}

void FlightStateAssembler::noteOriginShift() {
  const bool known = std::isfinite(last_origin_latitude_);
  if (known &&
      (inputs_.origin_latitude != last_origin_latitude_ || inputs_.origin_longitude != last_origin_longitude_)) {
    ++counters_.origin_shifts;
  }
  last_origin_latitude_ = inputs_.origin_latitude;
  last_origin_longitude_ = inputs_.origin_longitude;
}

// --- mission groups ---

template <typename State>
MissionAssembler<State>::MissionAssembler(const Options& options)
    : options_(options),
      decoder_(options.transport, options.version, options.engines),
      frames_(decoder_.requests().size(), 0, RrefFrameAssembler::Options::atRate(std::max(options.rate, 1))),
      unknown_(decoder_.requests().size(), kNaNf) {}

template <typename State>
State MissionAssembler<State>::assemble(const RowStore* rows, std::int64_t now_ns, const ClockFilter& clock) const {
  constexpr double kPeriods = 2.0;
  const std::int64_t oldest_ns =
      now_ns - toNanoseconds(std::max(options_.max_age, kPeriods / std::max(options_.rate, 1)));
  const bool fresh = frames_.counters().samples > 0 && frames_.receiveTime() >= oldest_ns;
  State state;
  state.valid = decoder_.decode(fresh ? frames_.values() : unknown_, rows, oldest_ns, &state);
  state.epoch = clock.epoch();
  state.stamp_ns = fresh && rows == nullptr ? frames_.receiveTime() : now_ns;
  if (std::isfinite(state.sim_time)) {
    if (const auto host = clock.hostTime(clock.unwrap(state.sim_time))) state.stamp_ns = std::min(*host, now_ns);
  }
  finish(state, clock);
  return state;
}

template class MissionAssembler<EngineStates>;
template class MissionAssembler<SurfaceStates>;
template class MissionAssembler<ControlStates>;
template class MissionAssembler<ElectricalState>;
template class MissionAssembler<AutopilotState>;
template class MissionAssembler<WarningState>;
template class MissionAssembler<FuelState>;
template class MissionAssembler<SimStatus>;
template class MissionAssembler<NavigationState>;
template class MissionAssembler<InstrumentState>;
template class MissionAssembler<EnvironmentState>;

}  // namespace xplane_bridge::core
