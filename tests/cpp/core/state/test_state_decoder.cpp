#include "xplane_bridge/core/state/state_decoder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "recorded_flight.hpp"

namespace xplane_bridge::core {
namespace {

/// As one way: no dataref has answered.
template <typename State>
State decodeRows(const Datagram& datagram, std::uint32_t* valid = nullptr, SimulatorVersion version = kXPlane11) {
  const GroupDecoder<State> decoder(Transport::kData, version);
  RowStore rows;
  rows.setOneWay(true);
  rows.update(datagram.data(), 100);
  State state;
  const std::vector<float> unknown(decoder.requests().size(), kNaNf);
  const std::uint32_t bits = decoder.decode(unknown, &rows, 100, &state);
  if (valid != nullptr) *valid = bits;
  return state;
}

// --- rows ---

TEST(RowStore, KeepsTheNewestByIndex) {
  RowStore rows;
  EXPECT_FALSE(rows.has(17));
  rows.update(Datagram::labelled("DATA*").row(17, {1, 2, 3, 4}).row(3, {5}).data(), 10);
  rows.update(Datagram::labelled("DATA*").row(3, {6}).data(), 20);
  EXPECT_TRUE(rows.has(17));
  EXPECT_EQ(rows.receiveTime(17), 10);
  EXPECT_EQ(rows.receiveTime(3), 20);
  EXPECT_EQ(rows.values(17)[2], 3.0F);
  EXPECT_EQ(rows.values(3)[0], 6.0F);
  EXPECT_EQ(rows.values(3)[1], -999.0F);
  rows.clear();
  EXPECT_FALSE(rows.has(17));
}

TEST(RowStore, IgnoresRowsThatCannotBe) {
  RowStore rows;
  rows.update(Datagram::labelled("DATA*").row(-1, {1}).row(200, {1}).row(2147483647, {1}).row(5, {7}).data(), 10);
  EXPECT_EQ(rows.values(5)[0], 7.0F);
}

// A captured packet (packets of real X-Planes, number 05): in flight over Brazil, X-Plane 11.
TEST(StateDecoder, DecodesACapturedPacket) {
  std::ifstream file(XPLANE_BRIDGE_TEST_DATA "/packets/05-data-xp11-rows-3-17-20-in-flight.hex");
  std::string hex;
  file >> hex;
  ASSERT_EQ(hex.size(), 226U);
  const FlightInputs in = decodeRows<FlightInputs>(Datagram::fromHex(hex));
  EXPECT_NEAR(in.roll_deg, -4.7378, 1e-5);
  EXPECT_NEAR(in.pitch_deg, 1.9985056, 1e-6);
  EXPECT_NEAR(in.heading_true_deg, 237.85411, 1e-5);
  EXPECT_NEAR(in.heading_magnetic_deg, 259.2194, 1e-5);
  EXPECT_NEAR(in.indicated_airspeed, 121.93892 * 1852.0 / 3600.0, 1e-5);
  EXPECT_NEAR(in.true_airspeed, 127.03222 * 1852.0 / 3600.0, 1e-5);
  EXPECT_NEAR(in.elevation, 1382.1554 * 0.3048, 1e-4);
  EXPECT_NEAR(in.altitude_agl, 1379.1328 * 0.3048, 1e-4);
  EXPECT_NEAR(in.altitude_indicated, 1224.8766 * 0.3048, 1e-4);
  EXPECT_NEAR(in.origin_latitude, -23.5, 0.0);
  EXPECT_NEAR(in.origin_longitude, -47.0, 0.0);
  EXPECT_TRUE(std::isnan(in.roll_rate));
}

TEST(StateDecoder, Row16ByVersion) {
  const Datagram d = Datagram::labelled("DATA*").row(16, {10.0F, 20.0F, 30.0F});
  const FlightInputs v11 = decodeRows<FlightInputs>(d);
  EXPECT_DOUBLE_EQ(v11.roll_rate, 20.0);
  EXPECT_DOUBLE_EQ(v11.pitch_rate, 10.0);
  EXPECT_DOUBLE_EQ(v11.yaw_rate, 30.0);
  const FlightInputs v12 = decodeRows<FlightInputs>(d, nullptr, kXPlane12);
  EXPECT_NEAR(v12.roll_rate, 0.1745329252, 1e-9);
  EXPECT_NEAR(v12.pitch_rate, 0.3490658504, 1e-9);
  EXPECT_NEAR(v12.yaw_rate, 0.5235987756, 1e-9);
  EXPECT_TRUE(std::isnan(decodeRows<FlightInputs>(d, nullptr, SimulatorVersion{}).roll_rate));
}

// -999 is a value that can occur; only in slots that a row leaves blank, and only bit by bit, it means "unused".
TEST(StateDecoder, MinusNineNineNineIsAValueWhereTheRowIsNeverBlank) {
  const FlightInputs in =
      decodeRows<FlightInputs>(Datagram::labelled("DATA*").row(20, {37, 127, -999.0F, 5, 0, 1, 37.5F, 127}));
  EXPECT_NEAR(in.elevation, -999.0 * 0.3048, 1e-9);
}

TEST(StateDecoder, MinusNineNineNineIsBlankWhereTheRowMayBeBlank) {
  std::uint32_t valid = 0;
  const SurfaceStates s = decodeRows<SurfaceStates>(Datagram::labelled("DATA*")
                                                        .row(74, {1, 2, -999.0F, -998.99994F})
                                                        .row(70, {-999, -999, -999, -999, -999, -999, -999, -999}),
                                                    &valid);
  EXPECT_EQ(s.elevator[0], 1.0F);
  EXPECT_TRUE(std::isnan(s.elevator[2]));
  EXPECT_NEAR(s.elevator[3], -998.99994F, 1e-4);
  EXPECT_NE(valid & SurfaceStates::kValidElevator, 0U);
  EXPECT_EQ(valid & SurfaceStates::kValidAileron1, 0U);
}

TEST(StateDecoder, NonFiniteValuesAreUnknown) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  std::uint32_t valid = 0;
  const ControlStates s = decodeRows<ControlStates>(Datagram::labelled("DATA*").row(8, {nan, inf, 0.5F}), &valid);
  EXPECT_TRUE(std::isnan(s.stick_pitch));
  EXPECT_TRUE(std::isnan(s.stick_roll));
  EXPECT_EQ(s.stick_yaw, 0.5F);
  EXPECT_EQ(valid & ControlStates::kValidStick, 0U);
}

TEST(StateDecoder, StaleRowsAreUnknown) {
  const GroupDecoder<ControlStates> decoder(Transport::kData, kXPlane11);
  RowStore rows;
  rows.update(Datagram::labelled("DATA*").row(8, {0.1F, 0.2F, 0.3F}).data(), 100);
  rows.update(Datagram::labelled("DATA*").row(13, {0, 0, 0, 0.5F, 0.5F, 0, 0, 0}).data(), 200);
  const std::vector<float> unknown(decoder.requests().size(), kNaNf);
  ControlStates s;
  const std::uint32_t valid = decoder.decode(unknown, &rows, 150, &s);
  EXPECT_EQ(valid & ControlStates::kValidStick, 0U);
  EXPECT_NE(valid & ControlStates::kValidFlaps, 0U);
}

TEST(StateDecoder, BitFieldsAreTakenApart) {
  const WarningState s =
      decodeRows<WarningState>(Datagram::labelled("DATA*").row(115, {5, 0, -1, 3, 255, 1e20F, 128, 0}));
  EXPECT_EQ(s.fuel_pressure_low[0], 1.0F);
  EXPECT_EQ(s.fuel_pressure_low[1], 0.0F);
  EXPECT_EQ(s.fuel_pressure_low[2], 1.0F);
  EXPECT_EQ(s.oil_temperature_high[0], 0.0F);
  EXPECT_EQ(s.inverter_off[1], 1.0F);
  EXPECT_TRUE(std::isnan(s.inverter_off[2]));
  EXPECT_EQ(s.generator_off[7], 1.0F);
  EXPECT_EQ(s.engine_fire[7], 1.0F);
  EXPECT_EQ(s.engine_fire[6], 0.0F);
}

TEST(StateDecoder, UnitsBecomeSi) {
  const FlightInputs in = decodeRows<FlightInputs>(Datagram::labelled("DATA*")
                                                       .row(4, {0.2F, -999, 100, -999, 1.5F, 0.25F, -0.125F})
                                                       .row(6, {29.92F, 15, 15, 0.5F, 661, 100, -999, 32})
                                                       .row(64, {0, 0, 0, 10, 20, 30})
                                                       .row(5, {29.92F, 15, -999, 10, 270, 0, 0, 0})
                                                       .row(19, {100, -5})
                                                       .row(21, {1, 2, 3, 4, 5, 6, 0, 0}));
  EXPECT_NEAR(in.static_pressure, 101320.76, 0.1);
  EXPECT_NEAR(in.air_density, 0.6125, 1e-9);
  EXPECT_NEAR(in.dynamic_pressure, 4788.0259, 1e-3);
  EXPECT_NEAR(in.aero_moment.x(), 13.55818, 1e-4);  // L roll
  EXPECT_NEAR(in.aero_moment.z(), 40.67454, 1e-4);  // N yaw
  EXPECT_NEAR(in.wind_speed, 5.14444, 1e-4);
  EXPECT_DOUBLE_EQ(in.wind_from_deg, 270.0);
  EXPECT_DOUBLE_EQ(in.declination_deg, 5.0);  // the row is west positive
  EXPECT_EQ(in.local_position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(in.local_velocity, Eigen::Vector3d(4, 5, 6));
  EXPECT_DOUBLE_EQ(in.load_factor_normal, 1.5);
  EXPECT_DOUBLE_EQ(in.load_factor_axial, 0.25);
  EXPECT_DOUBLE_EQ(in.load_factor_side, -0.125);
}

TEST(StateDecoder, EngineCountBoundsTheArrays) {
  const GroupDecoder<EngineStates> decoder(Transport::kRref, kXPlane11);
  std::vector<float> values(decoder.requests().size(), 1.0F);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (decoder.requests()[i].path == "sim/aircraft/engine/acf_num_engines") values[i] = 2.0F;
  }
  EngineStates s;
  EXPECT_EQ(decoder.decode(values, nullptr, 0, &s), EngineStates::kValidAll);
  EXPECT_EQ(s.count, 2);
  EXPECT_EQ(s.n1[1], 1.0F);
  EXPECT_TRUE(std::isnan(s.n1[2]));
}

TEST(StateDecoder, ArraysOfFewerEnginesThanTheAircraftHasAreNotComplete) {
  const GroupDecoder<EngineStates> decoder(Transport::kRref, kXPlane11, 2);
  std::vector<float> values(decoder.requests().size(), 4.0F);  // the count, too
  EngineStates s;
  EXPECT_EQ(decoder.decode(values, nullptr, 0, &s) & EngineStates::kValidN1, 0U);
  EXPECT_EQ(s.count, 4);
  EXPECT_EQ(s.n1[1], 4.0F);
  EXPECT_TRUE(std::isnan(s.n1[2]));
}

TEST(StateDecoder, WithoutEngineCountNothingOfTheEnginesIsKnown) {
  const GroupDecoder<EngineStates> decoder(Transport::kRref, kXPlane11);
  std::vector<float> values(decoder.requests().size(), 1.0F);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (decoder.requests()[i].path == "sim/aircraft/engine/acf_num_engines") values[i] = kNaNf;
  }
  EngineStates s;
  EXPECT_EQ(decoder.decode(values, nullptr, 0, &s), 0U);
}

TEST(StateDecoder, OneWayRowsShowTheEnginesWithoutTheirCount) {
  std::uint32_t valid = 0;
  const Datagram d = Datagram::labelled("DATA*").row(25, {0.5F, 0.6F, 0, 0, 0, 0, 0, 0}).row(41, {90, kNaNf});
  const EngineStates s = decodeRows<EngineStates>(d, &valid);
  EXPECT_EQ(valid, EngineStates::kValidThrottleCommand) << "of row 41 not all is known";
  EXPECT_EQ(s.count, 0);
  EXPECT_EQ(s.throttle_command[1], 0.6F);
  EXPECT_EQ(s.throttle_command[7], 0.0F);
  EXPECT_EQ(s.n1[0], 90.0F);
  EXPECT_TRUE(std::isnan(s.running[0])) << "no row carries it";
}

TEST(StateDecoder, RowsOfEnginesWaitForTheirCountWhereDatarefsAnswer) {
  const GroupDecoder<EngineStates> decoder(Transport::kData, kXPlane11);
  const std::vector<float> unknown(decoder.requests().size(), kNaNf);
  RowStore rows;
  rows.update(Datagram::labelled("DATA*").row(25, {0.5F, 0.6F, 0, 0, 0, 0, 0, 0}).data(), 100);
  EngineStates s;
  EXPECT_EQ(decoder.decode(unknown, &rows, 100, &s), 0U);
  EXPECT_TRUE(std::isnan(s.throttle_command[0]));
}

TEST(StateDecoder, AnAircraftWithoutEnginesHasNoneInRows) {
  const GroupDecoder<EngineStates> decoder(Transport::kData, kXPlane11);
  std::vector<float> values(decoder.requests().size(), kNaNf);
  values[0] = 0.0F;
  ASSERT_EQ(decoder.requests()[0].path, "sim/aircraft/engine/acf_num_engines");
  RowStore rows;
  rows.setOneWay(true);
  rows.update(Datagram::labelled("DATA*").row(25, {0, 0, 0, 0, 0, 0, 0, 0}).data(), 100);
  EngineStates s;
  EXPECT_EQ(decoder.decode(values, &rows, 100, &s), 0U);
  EXPECT_TRUE(std::isnan(s.throttle_command[0]));
}

// --- equivalent deflections ---

// Left aileron down 10, right up 6 on wing 2; wing 1 has none: (10 - -6) / 2 = 8, rolls right. Elevators -4 and -6:
// mean -5 (trailing edge up, nose up). Rudder +7 trailing edge right: aerospace sign -7.
TEST(EquivalentDeflections, MatchHandWorkedNumbers) {
  SurfaceStates s;
  s.valid = SurfaceStates::kValidAll;
  s.aileron1.fill(0.0F);
  s.aileron2.fill(0.0F);
  s.aileron1[2] = 10.0F;
  s.aileron1[3] = -6.0F;
  s.elevator = {-4.0F, -6.0F, 0.0F, 0.0F};
  s.rudder = {7.0F, 0.0F, 0.0F, 0.0F};
  computeEquivalentDeflections(s);
  EXPECT_FLOAT_EQ(s.delta_aileron, 8.0F);
  EXPECT_FLOAT_EQ(s.delta_elevator, -5.0F);
  EXPECT_FLOAT_EQ(s.delta_rudder, -7.0F);
}

TEST(EquivalentDeflections, CountASurfaceAtExactlyZeroBesideOneThatIsNot) {
  SurfaceStates s;
  s.valid = SurfaceStates::kValidAll;
  s.elevator = {0.0F, 10.0F, 0.0F, 0.0F};
  s.wing_elevator1.fill(0.0F);
  s.wing_elevator2.fill(0.0F);
  computeEquivalentDeflections(s);
  EXPECT_FLOAT_EQ(s.delta_elevator, 5.0F) << "the left one is stuck";
  s.elevator[1] = -0.0F;
  computeEquivalentDeflections(s);
  EXPECT_EQ(s.delta_elevator, 0.0F);
}

// A flying wing: its elevons up 10 and 2 pitch it up like an elevator at -6; the tail that it does not have shows 0.
TEST(EquivalentDeflections, CountElevatorsOnWings) {
  SurfaceStates s;
  s.valid = SurfaceStates::kValidAll;
  s.elevator.fill(0.0F);
  s.wing_elevator1.fill(0.0F);
  s.wing_elevator2.fill(0.0F);
  s.wing_elevator1[0] = s.wing_elevator1[1] = -10.0F;
  s.wing_elevator2[2] = s.wing_elevator2[3] = -2.0F;
  computeEquivalentDeflections(s);
  EXPECT_FLOAT_EQ(s.delta_elevator, -6.0F);
  s.valid &= ~SurfaceStates::kValidWingElevator2;
  computeEquivalentDeflections(s);
  EXPECT_FLOAT_EQ(s.delta_elevator, -10.0F) << "what is not known does not count";
}

TEST(EquivalentDeflections, AreZeroAtNeutralAndUnknownWithoutSurfaces) {
  SurfaceStates s;
  computeEquivalentDeflections(s);
  EXPECT_TRUE(std::isnan(s.delta_aileron));
  EXPECT_TRUE(std::isnan(s.delta_elevator));
  s.valid = SurfaceStates::kValidAll;
  s.aileron1.fill(0.0F);
  s.aileron2.fill(0.0F);
  s.elevator.fill(0.0F);
  s.rudder.fill(0.0F);
  computeEquivalentDeflections(s);
  EXPECT_EQ(s.delta_aileron, 0.0F);
  EXPECT_EQ(s.delta_elevator, 0.0F);
  EXPECT_EQ(s.delta_rudder, 0.0F);
}

// --- rows that are otherwise than assumed ---

SimulatorVersion otherwise(Otherwise what) { return {kXPlane12.number, static_cast<std::uint32_t>(what)}; }

bool asksFor(const StateDecoder& decoder, const std::string& path) {
  const auto& requests = decoder.requests();
  return std::any_of(requests.begin(), requests.end(), [&](const DatarefRequest& each) { return each.path == path; });
}

bool takesRow(const StateDecoder& decoder, std::int32_t row) {
  return std::count(decoder.rows().begin(), decoder.rows().end(), row) != 0;
}

TEST(StateDecoder, TakesDatarefsInsteadOfRowsThatAreOtherwise) {
  const StateDecoder usual(FieldGroup::kFlight, Transport::kData, kXPlane12);
  EXPECT_TRUE(takesRow(usual, 16));
  EXPECT_FALSE(asksFor(usual, "sim/flightmodel/position/Prad"));
  const StateDecoder rates(FieldGroup::kFlight, Transport::kData, otherwise(Otherwise::kRow16));
  EXPECT_FALSE(takesRow(rates, 16));
  EXPECT_TRUE(takesRow(rates, 20));
  EXPECT_TRUE(asksFor(rates, "sim/flightmodel/position/Prad"));
  const StateDecoder place(FieldGroup::kFlight, Transport::kData, otherwise(Otherwise::kRow20));
  EXPECT_FALSE(takesRow(place, 20));
  EXPECT_TRUE(asksFor(place, "sim/flightmodel/position/lat_ref"));
}

TEST(StateDecoder, WithoutTheHoursOfRow1KeepsItsClock) {
  const StateDecoder flight(FieldGroup::kFlight, Transport::kData, otherwise(Otherwise::kRow1Hours));
  EXPECT_TRUE(takesRow(flight, 1));
  EXPECT_FALSE(asksFor(flight, "sim/time/total_running_time_sec"));
  const StateDecoder status(FieldGroup::kSim, Transport::kData, otherwise(Otherwise::kRow1Hours));
  EXPECT_TRUE(asksFor(status, "sim/time/zulu_time_sec"));
}

TEST(StateDecoder, DecodesThoseDatarefs) {
  const StateDecoder decoder(FieldGroup::kFlight, Transport::kData, otherwise(Otherwise::kRow16));
  std::vector<float> values(decoder.requests().size(), kNaNf);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (decoder.requests()[i].path == "sim/flightmodel/position/Qrad") values[i] = 0.25F;
  }
  RowStore rows;
  rows.update(Datagram::labelled("DATA*").row(16, {1, 2, 3}).data(), 100);
  FlightInputs inputs;
  decoder.decode(values, &rows, 100, &inputs);
  EXPECT_DOUBLE_EQ(inputs.pitch_rate, 0.25);
}

}  // namespace
}  // namespace xplane_bridge::core
