#include "xplane_bridge/core/state/state_assembler.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "allocation_counter.hpp"
#include "hand_set_frames.hpp"
#include "recorded_flight.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

using V = FlightState;

struct Case {
  int version;
  Transport transport;
};

std::string caseName(const testing::TestParamInfo<Case>& info) {
  return "XPlane" + std::to_string(info.param.version) + (info.param.transport == Transport::kRref ? "Rref" : "Data");
}

/// A recorded flight fed into an assembler as the sockets would.
class Feed {
 public:
  explicit Feed(const Case& c, PositionMode position = PositionMode::kAuto) : flight(c.version), case_(c) {
    FlightStateAssembler::Options options;
    options.transport = c.transport;
    options.version = flight.version();
    options.position = position;
    assembler = std::make_unique<FlightStateAssembler>(options);
  }

  /// Everything X-Plane sends in a frame of the recording. @return the state, or null
  const FlightState* frame(std::size_t i) {
    now = kStart + static_cast<std::int64_t>(count_++) * kFrame;
    const Datagram rref = flight.rref(i, assembler->requests());
    if (case_.transport == Transport::kRref) return assembler->onRref(rref.rref(), now);
    assembler->onRref(rref.rref(), now);
    const Datagram data = flight.data(i);
    return assembler->onData(data.data(), now + 1000);
  }
  /// Enough frames for silent datarefs to be learnt. @return the last state
  const FlightState* all() {
    const FlightState* state = nullptr;
    for (std::size_t i = 0; i < flight.size(); ++i) {
      if (const FlightState* s = frame(i)) state = s;
    }
    return state;
  }

  RecordedFlight flight;
  std::unique_ptr<FlightStateAssembler> assembler;
  std::int64_t now = 0;

 private:
  Case case_;
  std::size_t count_ = 0;
};

class EveryTransport : public testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(Recorded, EveryTransport,
                         testing::Values(Case{11, Transport::kRref}, Case{11, Transport::kData},
                                         Case{12, Transport::kRref}, Case{12, Transport::kData}),
                         caseName);

void expectNear(const Vector3d& actual, const Vector3d& expected, double tolerance) {
  EXPECT_NEAR(actual.x(), expected.x(), tolerance);
  EXPECT_NEAR(actual.y(), expected.y(), tolerance);
  EXPECT_NEAR(actual.z(), expected.z(), tolerance);
}

// The emulator's truth in doubles against what the wire's float32 leaves: the whole way from bytes to SI, both
// transports, both versions, 40 km from the scenery origin, in a climbing turn in wind.
TEST_P(EveryTransport, StateMatchesTheTruth) {
  Feed feed(GetParam());
  const FlightState* s = feed.all();
  ASSERT_NE(s, nullptr);
  const std::size_t last = feed.flight.size() - 1;
  const auto truth = [&](const char* name) { return feed.flight.truth(last, name); };

  EXPECT_EQ(s->valid, static_cast<std::uint32_t>(V::kValidAll)) << std::hex << s->valid;

  // Position: 5 mm where float32 latitude and longitude would leave half a metre.
  EXPECT_NEAR(s->altitude_msl, truth("altitude_m"), 0.005);
  EXPECT_LT(groundDistance({s->latitude, s->longitude, 0}, {truth("latitude_deg"), truth("longitude_deg"), 0}), 0.005);
  EXPECT_EQ(s->position_source, PositionSource::kLocalUnchecked);
  EXPECT_NEAR(s->altitude_agl, truth("agl_m"), 0.01);
  EXPECT_NEAR(s->altitude_pressure, truth("pressure_altitude_m"), 0.5);

  EXPECT_NEAR(s->roll_deg, truth("roll_rad") * kDegreesPerRadian, 1e-4);
  EXPECT_NEAR(s->pitch_deg, truth("pitch_rad") * kDegreesPerRadian, 1e-4);
  EXPECT_NEAR(s->heading_true_deg, truth("heading_rad") * kDegreesPerRadian, 1e-4);
  EXPECT_NEAR(wrap180(s->heading_magnetic_deg + s->declination_deg - s->heading_true_deg), 0.0, 1e-3);

  expectNear(s->angular_velocity, {truth("p_rad_s"), truth("q_rad_s"), truth("r_rad_s")}, 1e-6);
  expectNear(s->angular_acceleration, {truth("p_dot_rad_s2"), truth("q_dot_rad_s2"), truth("r_dot_rad_s2")}, 1e-6);
  expectNear(s->velocity_ned, {truth("v_north_mps"), truth("v_east_mps"), truth("v_down_mps")}, 1e-4);
  expectNear(s->velocity_body, {truth("u_mps"), truth("v_mps"), truth("w_mps")}, 1e-3);
  expectNear(s->specific_force,
             {truth("specific_force_x_mps2"), truth("specific_force_y_mps2"), truth("specific_force_z_mps2")}, 1e-4);
  expectNear(s->wind_ned, {truth("wind_north_mps"), truth("wind_east_mps"), truth("wind_down_mps")}, 1e-3);
  EXPECT_NEAR(s->wind_from_deg, 240.0, 0.01);
  EXPECT_NEAR(s->wind_speed, 9.0, 1e-3);

  EXPECT_NEAR(s->air_velocity_body.norm(), truth("true_airspeed_mps"), 2e-3);
  EXPECT_NEAR(s->alpha_deg, truth("alpha_rad") * kDegreesPerRadian, 2e-3);
  EXPECT_NEAR(s->beta_deg, truth("beta_rad") * kDegreesPerRadian, 2e-3);
  EXPECT_NEAR(s->true_airspeed, truth("true_airspeed_mps"), 1e-4);
  EXPECT_NEAR(s->equivalent_airspeed, truth("equivalent_airspeed_mps"), 1e-3);
  EXPECT_NEAR(s->calibrated_airspeed, truth("calibrated_airspeed_mps"), 0.02);
  EXPECT_NEAR(s->mach, truth("mach"), 1e-6);
  EXPECT_NEAR(s->dynamic_pressure, truth("dynamic_pressure_pa"), 0.01);
  EXPECT_NEAR(s->air_density, truth("air_density_kg_m3"), 1e-5);

  EXPECT_NEAR(s->ground_speed, std::hypot(truth("v_north_mps"), truth("v_east_mps")), 1e-4);
  EXPECT_NEAR(s->track_deg, wrap360(std::atan2(truth("v_east_mps"), truth("v_north_mps")) * kDegreesPerRadian), 1e-3);
  EXPECT_NEAR(s->vertical_speed, -truth("v_down_mps"), 1e-4);
  EXPECT_NEAR(s->control_roll, 0.4, 1e-6);
  EXPECT_NEAR(s->control_pitch, 0.25, 1e-6);
  EXPECT_NEAR(s->control_yaw, 0.2, 1e-6);
  EXPECT_FALSE(s->on_ground);
  EXPECT_FALSE(s->paused);
  EXPECT_NEAR(s->sim_time, 5000.0 + 132.0 / 60.0, 1e-3);
  EXPECT_NEAR(s->frame_period, 1.0 / 60.0, 1e-6);
}

TEST_P(EveryTransport, FramesThatDidNotComeAreCounted) {
  Feed whole(GetParam());
  whole.all();
  ASSERT_GE(whole.assembler->counters().states, 9U);
  EXPECT_EQ(whole.assembler->clock().missedFrames(), 0U);

  Feed feed(GetParam());
  for (std::size_t i = 0; i < feed.flight.size(); ++i) {
    if (i != 5 && i != 8 && i != 9) feed.frame(i);  // lost: one, and two in a row
  }
  EXPECT_EQ(feed.assembler->clock().missedFrames(), 3U);
  feed.frame(2);  // time goes back: another epoch
  EXPECT_EQ(feed.assembler->clock().missedFrames(), 3U);
}

// At 4x each frame of 1/60 s is 4/60 s of simulator time.
TEST(FlightStateAssembler, TimeAccelerationIsNoFrameThatDidNotCome) {
  Hand hand;
  for (int i = 0; i < 20; ++i) hand.send();
  hand["sim/time/sim_speed"] = 4.0F;
  for (int i = 0; i < 20; ++i) hand.send(4.0 / 60.0);
  EXPECT_EQ(hand.assembler.clock().missedFrames(), 0U);
  hand.send(12.0 / 60.0);  // two were lost
  EXPECT_EQ(hand.assembler.clock().missedFrames(), 2U);
  hand["sim/time/sim_speed"] = 1.0F;
  for (int i = 0; i < 20; ++i) hand.send();
  EXPECT_EQ(hand.assembler.clock().missedFrames(), 2U);
}

TEST(FlightStateAssembler, RowsCarryTimeAccelerationToo) {
  for (const float ratio : {4.0F, 1.0F, -999.0F}) {
    FlightStateAssembler::Options options;
    options.transport = Transport::kData;
    FlightStateAssembler assembler(options);
    for (int i = 0; i < 20; ++i) {
      const float sim_time = 1000.0F + std::max(ratio, 1.0F) / 60.0F * static_cast<float>(i);
      const Datagram rows = Datagram::labelled("DATA*")
                                .row(0, {60, 60, -999, 1.0F / 60.0F, 0, 0, 1, ratio})
                                .row(1, {0, sim_time, 0, -999, 0, 0, 0, -999});
      assembler.onData(rows.data(), kStart + i * kFrame);
    }
    EXPECT_EQ(assembler.counters().states, 20U);
    EXPECT_EQ(assembler.clock().missedFrames(), 0U) << ratio;
  }
}

TEST_P(EveryTransport, FirstPositionIsTheMapOrigin) {
  Feed feed(GetParam());
  EXPECT_FALSE(feed.assembler->map().has_value());
  const FlightState* s = feed.all();
  ASSERT_NE(s, nullptr);
  ASSERT_TRUE(feed.assembler->map().has_value());
  // The recording's frames are 1/60 s apart: a few metres from the first to the last state.
  EXPECT_LT(Vector3d(s->position_north, s->position_east, s->position_down).norm(), 15.0);
  const GeoPoint origin{37.6, 126.5, 100.0};
  feed.assembler->setMapOrigin(origin);
  EXPECT_EQ(feed.assembler->positionEpoch(), 1U);
  s = feed.frame(0);
  // Later than the recording's last frame only in arrival: same simulator time as before, so it is dropped.
  EXPECT_EQ(s, nullptr);
}

TEST_P(EveryTransport, RposCheckMakesThePositionTrusted) {
  Feed feed(GetParam());
  const FlightState* s = nullptr;
  for (std::size_t i = 0; i < feed.flight.size(); ++i) {
    if (const FlightState* state = feed.frame(i)) s = state;
    feed.assembler->onRpos(feed.flight.rpos(i), feed.now);
  }
  // Two positions after each reference: a dozen frames give a handful of comparisons.
  EXPECT_GE(feed.assembler->positionCheck().comparisons(), 3);
  EXPECT_LT(std::abs(feed.assembler->positionCheck().heightError()), 0.01);
  EXPECT_LT(feed.assembler->positionCheck().crossTrackError(), 0.01);
  ASSERT_NE(s, nullptr);
}

TEST_P(EveryTransport, NothingIsAllocatedPerDatagram) {
  Feed feed(GetParam());
  feed.all();
  const Datagram rref = feed.flight.rref(feed.flight.size() - 1, feed.assembler->requests());
  const Datagram data = feed.flight.data(feed.flight.size() - 1);
  const RrefView rref_view = rref.rref();
  const DataView data_view = data.data();
  const std::size_t before = allocationCount();
  for (int i = 0; i < 100; ++i) {
    feed.assembler->onRref(rref_view, feed.now + i * kFrame);
    feed.assembler->onData(data_view, feed.now + i * kFrame);
  }
  EXPECT_EQ(allocationCount(), before);
}

// --- what goes wrong on the way ---

TEST(FlightStateAssembler, NoFlightLoadedIsNoState) {
  Hand hand;
  hand.zero();
  const FlightState* s = hand.send();
  ASSERT_NE(s, nullptr);
  EXPECT_EQ(s->valid & ~static_cast<std::uint32_t>(V::kValidSim), 0U);
  EXPECT_TRUE(hand.assembler.noFlight());
  EXPECT_TRUE(std::isnan(s->latitude));
  EXPECT_TRUE(std::isnan(s->roll_deg));
  EXPECT_EQ(s->position_source, PositionSource::kNone);
}

TEST(FlightStateAssembler, OriginShiftIsNoReset) {
  Hand hand;
  FlightState before = *hand.send();
  hand.moveOrigin(37.5, 126.0);
  const FlightState* after = hand.send();
  ASSERT_NE(after, nullptr);
  EXPECT_EQ(after->epoch, before.epoch);
  EXPECT_EQ(hand.assembler.counters().origin_shifts, 1U);
  EXPECT_EQ(hand.assembler.counters().jumps, 0U);
  EXPECT_LT(groundDistance({after->latitude, after->longitude, 0}, {before.latitude, before.longitude, 0}), 0.01);
  expectNear(after->velocity_ned, before.velocity_ned, 1e-4);
  EXPECT_NEAR(after->position_north, before.position_north, 0.01);
}

TEST(FlightStateAssembler, JumpOfPositionRaisesTheEpochWithThatState) {
  Hand hand;
  const FlightState before = *hand.send();
  hand.place({before.latitude + 0.05, before.longitude, before.altitude_msl});
  const FlightState* s = hand.send();
  ASSERT_NE(s, nullptr);
  EXPECT_EQ(s->epoch, before.epoch + 1);
  EXPECT_EQ(hand.send()->epoch, before.epoch + 1);
  EXPECT_EQ(hand.assembler.counters().jumps, 1U);
}

TEST(FlightStateAssembler, FlightOverAGapIsNoJump) {
  Hand hand;
  const FlightState before = *hand.send();
  // Three seconds of silence at 60 m/s: 180 m on.
  const Vector3d moved = enuFromOpengl(hand.local("local_")) + 3.0 * enuFromOpengl(hand.local("local_v"));
  hand.place(hand.frame().geoPoint(moved));
  hand.now += 3'000'000'000;
  EXPECT_EQ(hand.send(3.0)->epoch, before.epoch);
}

TEST(FlightStateAssembler, TimeGoingBackRaisesTheEpoch) {
  Hand hand;
  const FlightState before = *hand.send();
  EXPECT_EQ(hand.send(-500.0)->epoch, before.epoch + 1);
}

// X-Plane 10 sends the tile's corner as origin, a later X-Plane may send something else: millimetres of the wrong
// place.
TEST(FlightStateAssembler, OriginThatContradictsTheCoarsePositionIsNotUsed) {
  Hand hand;
  hand["sim/flightmodel/position/lat_ref"] = 37.0F;
  hand["sim/flightmodel/position/lon_ref"] = 126.0F;
  const FlightState* s = hand.send();
  ASSERT_NE(s, nullptr);
  EXPECT_EQ(s->position_source, PositionSource::kFloat32);
  EXPECT_NEAR(s->latitude, 37.63, 0.01);
}

TEST(FlightStateAssembler, RposTakesOverWhereTheSphereDoesNot) {
  Hand hand;
  hand["sim/flightmodel/position/lat_ref"] = 37.0F;
  Rpos rpos;
  rpos.latitude_deg = 37.6300001;
  rpos.longitude_deg = 126.5500001;
  rpos.elevation_m = 1500.5;
  hand.assembler.onRpos(rpos, hand.now + kFrame);
  const FlightState* s = hand.send();
  EXPECT_EQ(s->position_source, PositionSource::kRpos);
  EXPECT_NEAR(s->latitude, 37.6300001, 1e-9);
  EXPECT_NEAR(s->altitude_msl, 1500.5, 1e-3);
  // One frame later, moved along the velocity: 60 m/s over 1/60 s is a metre.
  s = hand.send();
  EXPECT_EQ(s->position_source, PositionSource::kRpos);
  EXPECT_NEAR(groundDistance({s->latitude, s->longitude, 0}, {37.6300001, 126.5500001, 0}), s->ground_speed / 60.0,
              0.02);
  // And old positions are not used.
  hand.now += 1'000'000'000;
  EXPECT_EQ(hand.send(1.0)->position_source, PositionSource::kFloat32);
}

TEST(FlightStateAssembler, APositionOfAnotherFrameIsMovedBySimulatedTime) {
  FlightStateAssembler::Options options = Hand::withVersion();
  options.position = PositionMode::kRpos;
  for (const double time_ratio : {1.0, 4.0, 0.0}) {  // 0: paused; one frame in four has a position of its own
    Hand hand(options);
    hand.setLocal("local_v", openglFromEnu({0.0, 100.0, 0.0}));
    hand["sim/time/paused"] = time_ratio == 0.0 ? 1.0F : 0.0F;
    hand["sim/time/sim_speed"] = std::max(1.0F, static_cast<float>(time_ratio));
    GeoPoint there{37.5, 126.5, 1000.0};
    for (int frame = 0; frame < 40; ++frame) {
      there = TangentFrame(there).geoPoint({0.0, 100.0 * time_ratio / 60.0, 0.0});
      Rpos rpos;
      rpos.latitude_deg = there.latitude_deg;
      rpos.longitude_deg = there.longitude_deg;
      if (frame % 4 == 0) hand.assembler.onRpos(rpos, hand.now + kFrame);
      const FlightState* const state = hand.send(time_ratio / 60.0);
      EXPECT_LT(groundDistance({state->latitude, state->longitude, 0.0}, there), 0.1) << time_ratio;
    }
  }
}

TEST(FlightStateAssembler, CheckAgainstRposDecidesOnTheSource) {
  for (const bool right : {true, false}) {
    Hand hand;
    const FlightState first = *hand.send();
    EXPECT_EQ(first.position_source, PositionSource::kLocalUnchecked);
    Rpos rpos;
    rpos.latitude_deg = first.latitude;
    rpos.longitude_deg = first.longitude;
    rpos.elevation_m = first.altitude_msl + (right ? 0.01 : 0.2);
    const FlightState* s = nullptr;
    for (int i = 0; i < 60; ++i) {
      hand.assembler.onRpos(rpos, hand.now);
      s = hand.send();
    }
    ASSERT_NE(s, nullptr);
    EXPECT_EQ(s->position_source, right ? PositionSource::kLocal : PositionSource::kRpos);
    EXPECT_EQ(s->epoch, first.epoch);
  }
}

TEST(FlightStateAssembler, PositionModesAreObeyed) {
  auto options = Hand::withVersion();
  options.position = PositionMode::kFloat32;
  EXPECT_EQ(Hand(options).send()->position_source, PositionSource::kFloat32);
  options.position = PositionMode::kRpos;
  Hand without(options);
  const FlightState* s = without.send();
  EXPECT_EQ(s->position_source, PositionSource::kNone);
  EXPECT_FALSE(s->has(V::kValidPosition));
  EXPECT_FALSE(s->has(V::kValidVelocity));  // its axes cannot be turned
  options.position = PositionMode::kXpc;
  Hand xpc(options);
  XpcPosition position;
  position.latitude_deg = 37.63;
  position.longitude_deg = 126.55;
  position.elevation_m = 1500.0;
  xpc.assembler.onXpc(position, xpc.now + kFrame);
  EXPECT_EQ(xpc.send()->position_source, PositionSource::kXpc);
}

TEST(FlightStateAssembler, NonFiniteValuesClearTheirGroupOnly) {
  Hand hand;
  hand["sim/flightmodel/forces/g_side"] = std::nanf("");
  const FlightState* s = hand.send();
  ASSERT_NE(s, nullptr);
  EXPECT_EQ(s->valid, static_cast<std::uint32_t>(V::kValidAll & ~V::kValidLoad));
  EXPECT_TRUE(std::isnan(s->specific_force.x()));
  EXPECT_TRUE(std::isnan(s->load_factor_normal));
}

TEST(FlightStateAssembler, DuplicatesAndLateDatagramsAreDropped) {
  Hand hand;
  ASSERT_NE(hand.send(), nullptr);
  EXPECT_EQ(hand.send(0.0), nullptr);
  EXPECT_EQ(hand.assembler.counters().duplicates, 1U);
  ASSERT_NE(hand.send(), nullptr);
  EXPECT_EQ(hand.send(-1.0 / 60.0), nullptr);
  EXPECT_EQ(hand.assembler.counters().out_of_order, 1U);
}

TEST(FlightStateAssembler, PausedStatesKeepComingWithRisingStamps) {
  Hand hand;
  hand.send();
  hand["sim/time/paused"] = 1.0F;
  std::int64_t last = 0;
  for (int i = 0; i < 10; ++i) {
    const FlightState* s = hand.send(0.0);
    ASSERT_NE(s, nullptr);
    EXPECT_TRUE(s->paused);
    EXPECT_GT(s->stamp_ns, last);
    last = s->stamp_ns;
  }
}

TEST(FlightStateAssembler, CountsStates) {
  Hand hand;
  EXPECT_EQ(hand.send()->frame_count, 1U);
  EXPECT_EQ(hand.send()->frame_count, 2U);
  hand.assembler.reset();
  EXPECT_EQ(hand.send()->frame_count, 1U);
  EXPECT_EQ(hand.assembler.clock().epoch(), 1U);
}

// Calm air, no wind direction: every field of a valid group must still be a number.
TEST(FlightStateAssembler, CalmAndStillHasNoNan) {
  Hand hand;
  for (const char* axis : {"x", "y", "z"}) {
    hand[std::string("sim/weather/wind_now_") + axis + "_msc"] = 0.0F;
    hand[std::string("sim/flightmodel/position/local_v") + axis] = 0.0F;
  }
  const FlightState* s = hand.send();
  EXPECT_EQ(s->valid, static_cast<std::uint32_t>(V::kValidAll));
  EXPECT_EQ(s->wind_from_deg, 0.0F);
  EXPECT_EQ(s->alpha_deg, 0.0F);
  EXPECT_NEAR(s->track_deg, s->heading_true_deg, 1e-3);
  EXPECT_EQ(s->flight_path_angle_deg, 0.0F);
}

// --- transport data ---

TEST(DataTransport, RowsMayBeReorderedAddedAndRemoved) {
  const RecordedFlight flight(11);
  FlightStateAssembler::Options options;
  options.transport = Transport::kData;
  options.version = kXPlane11;
  FlightStateAssembler assembler(options);
  const FlightState* s = assembler.onData(flight.data(0, {21, 17, 20, 1, 0, 16}).data(), kStart);
  ASSERT_NE(s, nullptr);
  EXPECT_TRUE(s->has(V::kValidPosition | V::kValidAttitude | V::kValidRates | V::kValidVelocity));
  EXPECT_FALSE(s->has(V::kValidLoad));
  EXPECT_NEAR(s->roll_deg, flight.truth(0, "roll_rad") * kDegreesPerRadian, 1e-4);

  s = assembler.onData(flight.data(1, {133, 4, 1, 17, 2, 20, 21}).data(), kStart + kFrame);
  ASSERT_NE(s, nullptr);
  EXPECT_TRUE(s->has(V::kValidLoad));
  EXPECT_FALSE(s->has(V::kValidRates));  // row 16 was removed; the old one is not carried on
  EXPECT_TRUE(std::isnan(s->angular_velocity.x()));
}

TEST(DataTransport, WithoutRow1ThereIsNoState) {
  const RecordedFlight flight(11);
  FlightStateAssembler::Options options;
  options.transport = Transport::kData;
  FlightStateAssembler assembler(options);
  EXPECT_EQ(assembler.onData(flight.data(0, {17, 20, 21}).data(), kStart), nullptr);
  EXPECT_EQ(assembler.counters().without_time, 1U);
}

TEST(DataTransport, Row16WaitsForTheVersion) {
  const RecordedFlight flight(12);
  FlightStateAssembler::Options options;
  options.transport = Transport::kData;
  FlightStateAssembler assembler(options);
  EXPECT_EQ(std::count(assembler.rows().begin(), assembler.rows().end(), 16), 1);
  const FlightState* s = assembler.onData(flight.data(0).data(), kStart);
  ASSERT_NE(s, nullptr);
  EXPECT_FALSE(s->has(V::kValidRates));
  EXPECT_TRUE(s->has(V::kValidAttitude));
  assembler.setVersion(kXPlane12);
  s = assembler.onData(flight.data(1).data(), kStart + kFrame);
  ASSERT_NE(s, nullptr);
  EXPECT_TRUE(s->has(V::kValidRates));
  EXPECT_NEAR(s->angular_velocity.x(), flight.truth(1, "p_rad_s"), 1e-6);
}

// What no row carries is unknown when RREF does not answer, and again when it falls silent.
TEST(DataTransport, SupplementAges) {
  Feed feed({11, Transport::kData});
  ASSERT_TRUE(feed.all()->has(V::kValidContact | V::kValidSim));
  const std::size_t last = feed.flight.size() - 1;
  Datagram later = feed.flight.data(last);
  const FlightState* s = nullptr;
  // Row 1 is at byte 5 + 36; its slot 1 at 4 + 4 further on. Two seconds later in simulator and host time.
  storeLittleEndian(
      feed.assembler->inputs().sim_time > 0 ? static_cast<float>(feed.assembler->inputs().sim_time + 2.0) : 0.0F,
      later.bytes.data() + 5 + 36 + 4 + 4);
  s = feed.assembler->onData(later.data(), feed.now + 2'000'000'000);
  ASSERT_NE(s, nullptr);
  EXPECT_FALSE(s->has(V::kValidContact));
  EXPECT_TRUE(s->has(V::kValidAttitude));
  // The sphere's radius falls back to the constant; the position stays.
  EXPECT_TRUE(s->has(V::kValidPosition));
}

}  // namespace
}  // namespace xplane_bridge::core
