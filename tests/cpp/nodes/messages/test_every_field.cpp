// Every field of every message that rx_node makes of datagrams: each dataref and each slot carries a number of its own,
// and each number is found under its field's name in the serialised message. The names in the message are ROS's
// (message_fields.hpp), those on the wire the field table's: two fields swapped anywhere between them turn this red.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "datagram.hpp"
#include "expected_fields.hpp"
#include "xplane_bridge/core/state/air_data.hpp"
#include "xplane_bridge/core/state/state_assembler.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"

namespace xplane_bridge {
namespace {

using core::FieldGroup;
using core::FieldSpec;
using core::Transport;

constexpr std::int64_t kNow = 1'700'000'000'000'000'000;
constexpr std::int64_t kFrame = 20'000'000;

struct Case {
  core::SimulatorVersion version;
  Transport transport;
};
const Case kCases[] = {{core::kXPlane11, Transport::kRref},
                       {core::kXPlane11, Transport::kData},
                       {core::kXPlane12, Transport::kRref},
                       {core::kXPlane12, Transport::kData}};

std::string described(const Case& c) {
  return std::to_string(c.version.number) + (c.transport == Transport::kRref ? " rref" : " data");
}

/// What X-Plane sends for one group: a number for each dataref and slot, and what it is in the table's fields.
class Wire {
 public:
  /// @param chosen SI values of fields whose number must make sense; all others count up
  Wire(FieldGroup group, const Case& c, const MessageLayout& layout, unsigned pass, const MessageValues& chosen)
      : case_(c), requests_(core::datarefRequests(group, c.transport, c.version)) {
    std::size_t flags = 0, bitfields = 0;
    for (const FieldSpec& field : core::fieldTable()) {
      if (field.group != group || field.store == nullptr) continue;
      const bool is_flag = isField(layout, field.field) && layout.leaf(field.field).type == "bool";
      const std::size_t flag_number = is_flag ? flags++ : 0;
      const std::size_t code = field.row.bitfield ? ++bitfields : 0;
      for (int element = 0; element < field.count; ++element) {
        const auto given = chosen.find(field.field);
        const double value = given != chosen.end() ? given->second.at(static_cast<std::size_t>(element))
                             : is_flag             ? (flag(flag_number, pass) ? 1.0 : 0.0)
                                                   : std::nan("");
        place(field, element, value, code);
      }
    }
  }

  const std::vector<core::DatarefRequest>& requests() const { return requests_; }
  bool hasRows() const { return !rows_.empty(); }
  /// SI values of the table's fields; a field that nothing carries is not in it.
  const MessageValues& sent() const { return sent_; }

  core::Datagram rref() const {
    core::Datagram datagram = core::Datagram::labelled("RREF,");
    for (std::size_t i = 0; i < requests_.size(); ++i) {
      datagram.pair(static_cast<std::int32_t>(i), datarefs_.at(requests_[i].path));
    }
    return datagram;
  }
  core::Datagram data() const {
    core::Datagram datagram = core::Datagram::labelled("DATA*");
    for (const auto& [row, slots] : rows_) datagram.row(row, slots);
    return datagram;
  }

 private:
  static bool isField(const MessageLayout& layout, const std::string& name) {
    const std::vector<std::string> names = layout.fields();
    return std::find(names.begin(), names.end(), name) != names.end();
  }

  /// A whole number no other place has, or the one nearest to what gives `si`.
  float number(double si, const core::Conversion& conversion) {
    if (std::isnan(si)) return static_cast<float>(++last_);
    return static_cast<float>((si - conversion.offset) / conversion.factor);
  }

  void place(const FieldSpec& field, int element, double si, std::size_t code) {
    const bool newer = case_.version.is12();
    if (case_.transport == Transport::kData && field.row.row11 >= 0) {
      if (element >= field.row.count) return;
      const core::Conversion& conversion = newer ? field.row.conversion12 : field.row.conversion11;
      const int row = newer ? field.row.row12 : field.row.row11;
      const int slot = (newer ? field.row.slot12 : field.row.slot11) + (field.row.bitfield ? 0 : element);
      std::vector<float>& slots = rows_.try_emplace(row, 8, std::nanf("")).first->second;
      float& wire = slots[static_cast<std::size_t>(slot)];
      if (field.row.bitfield) {
        wire = static_cast<float>(code);
        sent_[field.field].push_back((code >> element & 1U) != 0 ? 1.0 : 0.0);
        return;
      }
      if (std::isnan(wire)) wire = number(si, conversion);
      sent_[field.field].push_back(static_cast<double>(wire) * conversion.factor + conversion.offset);
      return;
    }
    for (const core::DatarefRequest& request : requests_) {
      if (request.field != &field || request.element != element) continue;
      const core::Conversion& conversion = core::datarefOf(field, case_.version)->conversion;
      const float wire = datarefs_.try_emplace(request.path, number(si, conversion)).first->second;
      sent_[field.field].push_back(static_cast<double>(wire) * conversion.factor + conversion.offset);
    }
  }

  Case case_;
  std::vector<core::DatarefRequest> requests_;
  std::map<std::string, float> datarefs_;
  std::map<std::int32_t, std::vector<float>> rows_;
  MessageValues sent_;
  int last_ = 3000;  // no bits of `valid` are as large and as odd
};

// --- mission messages ---

double meanOfMoving(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

std::vector<double> inCelsius(std::vector<double> fahrenheit) {
  for (double& value : fahrenheit) value = (value - 32.0) * 5.0 / 9.0;
  return fahrenheit;
}

// What is not as it was sent. Surfaces: all of them have been sent other numbers than 0.
void addComputed(FieldGroup group, const core::ClockFilter& clock, MessageValues* fields) {
  MessageValues& f = *fields;
  if (group == FieldGroup::kSurfaces) {
    std::vector<double> halves;
    for (const char* set : {"aileron1", "aileron2"}) {
      for (std::size_t left = 0; left < 8; left += 2) halves.push_back((f[set][left] - f[set][left + 1]) / 2.0);
    }
    f["delta_aileron"] = {meanOfMoving(halves)};
    auto elevators = f["elevator"];
    for (const char* wings : {"wing_elevator1", "wing_elevator2"}) {
      elevators.insert(elevators.end(), f[wings].begin(), f[wings].end());
    }
    f["delta_elevator"] = {meanOfMoving(elevators)};
    f["delta_rudder"] = {-meanOfMoving(f["rudder"])};
  } else if (group == FieldGroup::kAutopilot) {
    f["target_mach"] = f["target_airspeed"];  // airspeed_is_mach is a number above 0
    f["target_airspeed"] = {};
  } else if (group == FieldGroup::kEngines) {
    f["itt"] = inCelsius(f["itt"]);
    f["cht"] = inCelsius(f["cht"]);
  } else if (group == FieldGroup::kControls) {
    f.try_emplace("nacelle_angle_deg");  // X-Plane 12 does not have it: nothing is sent, nothing is to be there
  } else if (group == FieldGroup::kSim) {
    f["time_ratio"] = {clock.timeRatio()};
    f["frames_missed"] = {3.0};
    if (f["frame_rate"].empty()) f["frame_rate"] = {1.0 / f["frame_period"][0]};
  } else if (group == FieldGroup::kEnvironment) {
    f["terrain_height"] = {f["altitude_msl"][0] - f["height_above_ground"][0]};
  }
}

// In its fifth epoch, at simulator time 100 and X-Plane's own pace; three frames are missing.
core::ClockFilter someClock() {
  core::ClockFilter clock;
  for (int i = 0; i < 5; ++i) {
    core::ClockSample sample;
    sample.receive_ns = kNow + i * kFrame;
    sample.sim_time = 100.0F + 0.02F * static_cast<float>(i);
    sample.frame_period = 0.02F;
    clock.raiseEpoch();
    clock.update(sample);
  }
  core::ClockSample late;  // after three frames that did not come
  late.receive_ns = kNow + 8 * kFrame;
  late.sim_time = 100.0F + 0.02F * 8.0F;
  late.frame_period = 0.02F;
  clock.update(late);
  for (int i = 0; i < 20; ++i) {  // for long enough to be fitted
    late.receive_ns += kFrame;
    late.sim_time += late.frame_period;
    clock.update(late);
  }
  return clock;
}

template <typename State, typename Message>
void checkMission() {
  const MessageLayout layout = MessageLayout::of<Message>();
  for (const Case& c : kCases) {
    for (unsigned pass = 0; pass < kPasses; ++pass) {
      SCOPED_TRACE(std::string(core::messageName(State::kGroup)) + " " + described(c));
      const core::ClockFilter clock = someClock();
      typename core::MissionAssembler<State>::Options options;
      options.transport = c.transport;
      options.version = c.version;
      core::MissionAssembler<State> assembler(options);
      const Wire wire(State::kGroup, c, layout, pass,
                      {{"count", {8.0}},
                       {"sim_time", {100.1}},
                       {"frame_period", {0.02}},
                       {"gauge_in_celsius", {0.0, 1.0, 0.0, 1.0}}});
      core::RowStore rows;
      // Groups without rows: a datagram with none would be refused.
      if (wire.hasRows()) rows.update(wire.data().data(), kNow);
      EXPECT_EQ(assembler.add(wire.rref().rref(), kNow), !wire.requests().empty());
      const State state = assembler.assemble(c.transport == Transport::kData ? &rows : nullptr, kNow, clock);
      Message message;
      toMessage(state, "frame", &message);
      EXPECT_EQ(message.header.frame_id, "frame");

      MessageValues expected = wire.sent();
      expected["header.stamp"] = {static_cast<double>(state.stamp_ns) * 1e-9};
      expected["epoch"] = {static_cast<double>(clock.epoch())};
      expected["valid"] = {static_cast<double>(Message::VALID_ALL)};
      addComputed(State::kGroup, clock, &expected);
      expectFields(layout, layout.read(message), expected);
    }
  }
}

template <typename... Pairs>
void checkMissions(const std::tuple<Pairs...>*) {
  (checkMission<typename Pairs::first_type, typename Pairs::second_type>(), ...);
}

TEST(EveryField, OfMissionMessagesIsWhatWasSentForIt) {
  ASSERT_EQ(std::tuple_size_v<MissionMessages> + 1, core::kFieldGroupCount);
  checkMissions(static_cast<const MissionMessages*>(nullptr));
}

// --- FlightState ---

// Straight above the scenery's origin, so that its axes are the local level's; heading west, right wing straight down:
// forward is -east, right is down, down is -north.
constexpr double kLatitude = 10.0, kLongitude = 20.0, kHeight = 1000.0;
constexpr double kRoll = 90.0, kPitch = 0.0, kHeading = 270.0;
constexpr double kEast = 61.0, kUp = 4.5, kSouth = -17.0;             // velocity [m/s]
constexpr double kWindEast = -5.0, kWindUp = 0.0, kWindSouth = 12.0;  // rows carry no vertical part [m/s]
const core::GeoPoint kOrigin{9.9, 20.1, 50.0};

const MessageValues kChosen = {
    {"sim_time", {100.1}},
    {"frame_period", {0.02}},
    {"time_ratio_requested", {1.0}},
    {"local_position", {0.0, kHeight, 0.0}},
    {"origin_latitude", {kLatitude}},
    {"origin_longitude", {kLongitude}},
    {"earth_radius", {6378145.0}},
    {"latitude", {kLatitude}},
    {"longitude", {kLongitude}},
    {"elevation", {kHeight}},
    {"roll_deg", {kRoll}},
    {"pitch_deg", {kPitch}},
    {"heading_true_deg", {kHeading}},
    {"heading_magnetic_deg", {275.0}},
    {"roll_rate", {0.11}},
    {"pitch_rate", {0.12}},
    {"yaw_rate", {0.13}},
    {"local_velocity", {kEast, kUp, kSouth}},
    {"wind_local", {kWindEast, kWindUp, kWindSouth}},
    {"wind_speed", {13.0}},
    {"wind_from_deg", {std::atan2(-kWindEast, kWindSouth) * 180.0 / M_PI}},
    {"static_pressure", {80000.0}},
    {"mach", {0.21}},
    {"dynamic_pressure", {3000.0}},
    {"air_density", {1.1}},
    {"true_airspeed", {71.0}},
};

MessageValues computedFlight(const MessageValues& sent) {
  MessageValues f;
  const core::TangentFrame map(kOrigin);
  const Eigen::Vector3d place = core::nedFromEnu(map.position({kLatitude, kLongitude, kHeight}));
  f["latitude"] = {kLatitude};
  f["longitude"] = {kLongitude};
  f["altitude_msl"] = {kHeight};
  f["position_north"] = {place.x()};
  f["position_east"] = {place.y()};
  f["position_down"] = {place.z()};
  f["position_source"] = {FlightState::POSITION_LOCAL_UNCHECKED};
  f["roll_deg"] = {kRoll};
  f["pitch_deg"] = {kPitch};
  f["heading_true_deg"] = {kHeading};
  // Half angles 45 and 135 degrees about x, then z: x = cos 135 sin 45, y = z = sin 135 sin 45, w = cos 135 cos 45; the
  // same rotation with w above 0.
  f["orientation"] = {0.5, -0.5, -0.5, 0.5};  // x, y, z, w
  const double p = sent.at("roll_rate")[0], q = sent.at("pitch_rate")[0], r = sent.at("yaw_rate")[0];
  f["angular_velocity"] = {p, q, r};
  f["euler_rates"] = {p, -r, q};
  f["velocity_ned"] = {-kSouth, kEast, -kUp};
  f["velocity_body"] = {-kEast, -kUp, kSouth};
  f["ground_speed"] = {std::hypot(kSouth, kEast)};
  f["track_deg"] = {std::atan2(kEast, -kSouth) * 180.0 / M_PI};
  f["flight_path_angle_deg"] = {std::atan2(kUp, std::hypot(kSouth, kEast)) * 180.0 / M_PI};
  f["vertical_speed"] = {kUp};
  f["wind_ned"] = {-kWindSouth, kWindEast, -kWindUp};
  f["wind_speed"] = {13.0};  // 5, 12, 13
  f["wind_from_deg"] = {std::atan2(-kWindEast, kWindSouth) * 180.0 / M_PI};
  const double u = -(kEast - kWindEast), v = -(kUp - kWindUp), w = kSouth - kWindSouth;
  f["air_velocity_body"] = {u, v, w};
  f["alpha_deg"] = {std::atan2(w, u) * 180.0 / M_PI};
  f["beta_deg"] = {std::asin(v / std::hypot(u, v, w)) * 180.0 / M_PI};
  const double g = 9.80665;
  f["specific_force"] = {g * sent.at("load_factor_axial")[0], g * sent.at("load_factor_side")[0],
                         -g * sent.at("load_factor_normal")[0]};
  return f;
}

void checkFlight(const Case& c, unsigned pass) {
  const MessageLayout layout = MessageLayout::of<FlightState>();
  core::FlightStateAssembler::Options options;
  options.transport = c.transport;
  options.version = c.version;
  core::FlightStateAssembler assembler(options);
  for (int i = 0; i < 7; ++i) assembler.setMapOrigin(kOrigin);
  const core::FlightState* state = nullptr;
  MessageValues sent;
  constexpr int kFrames = 6, kEpochs = 4;
  for (int frame = 0; frame < kFrames; ++frame) {
    MessageValues chosen = kChosen;
    chosen["sim_time"][0] += 0.02 * frame;
    const Wire wire(FieldGroup::kFlight, c, layout, pass, chosen);
    sent = wire.sent();
    const std::int64_t now = kNow + frame * kFrame;
    if (frame < kEpochs) assembler.raiseEpoch();
    state = assembler.onRref(wire.rref().rref(), now);
    if (c.transport == Transport::kData) state = assembler.onData(wire.data().data(), now);
    ASSERT_NE(state, nullptr);
  }
  FlightState message;
  toMessage(*state, "frame", &message);
  EXPECT_EQ(message.header.frame_id, "frame");

  MessageValues expected = computedFlight(sent);
  for (const auto& [name, values] : sent) expected.try_emplace(name, values);
  expected["header.stamp"] = {static_cast<double>(state->stamp_ns) * 1e-9};
  expected["valid"] = {FlightState::VALID_ALL};
  expected["stamp_uncertainty"] = {state->stamp_uncertainty};
  expected["sim_time_unwrapped"] = {state->sim_time_unwrapped};
  EXPECT_NEAR(state->sim_time_unwrapped, sent["sim_time"][0], 1e-4);
  expected["epoch"] = {static_cast<double>(assembler.clock().epoch())};
  expected["frame_count"] = {kFrames};
  expected["position_epoch"] = {7.0};
  if (expected.count("calibrated_airspeed") == 0) {
    expected["calibrated_airspeed"] = {core::calibratedAirspeed(core::impactPressure(3000.0, 0.21))};
  }
  if (expected.count("equivalent_airspeed") == 0) expected["equivalent_airspeed"] = {71.0 * std::sqrt(1.1 / 1.225)};
  if (expected.count("altitude_pressure") == 0) {  // X-Plane 11 does not have it
    expected["altitude_pressure"] = {core::pressureAltitude(sent.at("static_pressure")[0])};
  }
  // One slot carries both.
  std::set<std::string> same;
  if (c.transport == Transport::kData) same = {"indicated_airspeed"};
  expectFields(layout, layout.read(message), expected, same);
}

TEST(EveryField, OfFlightStateIsWhatWasSentOrWorkedOutForIt) {
  for (const Case& c : kCases) {
    for (unsigned pass = 0; pass < kPasses; ++pass) {
      SCOPED_TRACE(described(c));
      checkFlight(c, pass);
    }
  }
}

}  // namespace
}  // namespace xplane_bridge
