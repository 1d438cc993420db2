#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hand_set_frames.hpp"
#include "recorded_flight.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/state/state_assembler.hpp"

namespace xplane_bridge::core {
namespace {

ClockFilter noClock() { return ClockFilter(); }

template <typename State>
State assembleRref(const RecordedFlight& flight, std::size_t frame = 0) {
  typename MissionAssembler<State>::Options options;
  options.version = flight.version();
  MissionAssembler<State> assembler(options);
  const Datagram d = flight.rref(frame, assembler.requests());
  for (int i = 0; i < 5; ++i) assembler.add(d.rref(), kStart + i * 1'000'000'000LL);
  return assembler.assemble(nullptr, kStart + 4'000'000'100LL, noClock());
}

template <typename State>
State assembleData(const RecordedFlight& flight, std::size_t frame = 0) {
  typename MissionAssembler<State>::Options options;
  options.transport = Transport::kData;
  options.version = flight.version();
  MissionAssembler<State> assembler(options);
  if (!assembler.requests().empty()) {
    const Datagram d = flight.rref(frame, assembler.requests());
    for (int i = 0; i < 5; ++i) assembler.add(d.rref(), kStart + i * 1'000'000'000LL);
  }
  RowStore rows;
  const Datagram d = flight.data(frame);
  rows.update(d.data(), kStart + 4'000'000'000LL);
  return assembler.assemble(&rows, kStart + 4'000'000'100LL, noClock());
}

template <typename State>
class MissionGroup : public testing::Test {};
using Groups = testing::Types<EngineStates, SurfaceStates, ControlStates, ElectricalState, AutopilotState, WarningState,
                              FuelState, SimStatus, NavigationState, InstrumentState, EnvironmentState>;
TYPED_TEST_SUITE(MissionGroup, Groups);

template <typename State>
constexpr std::uint32_t validAll() {
  return static_cast<std::uint32_t>(State::kValidAll);
}

TYPED_TEST(MissionGroup, IsCompleteByBothTransportsAndVersions) {
  for (const int version : {11, 12}) {
    const RecordedFlight flight(version);
    EXPECT_EQ(assembleRref<TypeParam>(flight).valid, validAll<TypeParam>()) << "rref " << version;
    EXPECT_EQ(assembleData<TypeParam>(flight).valid, validAll<TypeParam>()) << "data " << version;
  }
}

TYPED_TEST(MissionGroup, KnowsNothingWithoutData) {
  for (const Transport transport : {Transport::kRref, Transport::kData}) {
    typename MissionAssembler<TypeParam>::Options options;
    options.transport = transport;
    options.version = kXPlane11;
    const MissionAssembler<TypeParam> assembler(options);
    const RowStore rows;
    const TypeParam state = assembler.assemble(transport == Transport::kData ? &rows : nullptr, kStart, noClock());
    EXPECT_EQ(state.valid, 0U);
    EXPECT_TRUE(std::isnan(state.sim_time));
  }
}

TYPED_TEST(MissionGroup, ForgetsOldValues) {
  const RecordedFlight flight(11);
  typename MissionAssembler<TypeParam>::Options options;
  options.version = kXPlane11;
  MissionAssembler<TypeParam> assembler(options);
  const Datagram d = flight.rref(0, assembler.requests());
  for (int i = 0; i < 5; ++i) assembler.add(d.rref(), kStart + i * 1'000'000'000LL);
  EXPECT_NE(assembler.assemble(nullptr, kStart + 4'100'000'000LL, noClock()).valid, 0U);
  EXPECT_EQ(assembler.assemble(nullptr, kStart + 9'000'000'000LL, noClock()).valid, 0U);
}

// The same frame by datarefs (kg/s, N m, ...) and by rows (lb/h, ft lb, ...) must come out as the same SI values.
TEST(MissionGroups, TransportsAgree) {
  const RecordedFlight flight(11);
  const auto near = [](const auto& a, const auto& b, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_NEAR(a[i], b[i], 1e-4 * std::abs(b[i]) + 1e-6) << i;
    }
  };
  const EngineStates er = assembleRref<EngineStates>(flight), ed = assembleData<EngineStates>(flight);
  ASSERT_GE(er.count, 1);
  EXPECT_EQ(er.count, ed.count);
  for (const auto field : {&EngineStates::throttle_command, &EngineStates::throttle_actual, &EngineStates::engine_speed,
                           &EngineStates::propeller_speed, &EngineStates::n1, &EngineStates::manifold_pressure,
                           &EngineStates::torque, &EngineStates::thrust, &EngineStates::power, &EngineStates::fuel_flow,
                           &EngineStates::oil_pressure, &EngineStates::fuel_pressure}) {
    near(er.*field, ed.*field, er.count);
  }
  EXPECT_TRUE(std::isnan(er.thrust[er.count]));
  EXPECT_TRUE(std::isnan(ed.thrust[ed.count]));

  const FuelState fr = assembleRref<FuelState>(flight), fd = assembleData<FuelState>(flight);
  near(fr.fuel_tank, fd.fuel_tank, 8);
  EXPECT_NEAR(fr.total_mass, flight.truth(0, "mass_kg"), 0.01);
  EXPECT_NEAR(fd.total_mass, flight.truth(0, "mass_kg"), 0.01);
  EXPECT_NEAR(fr.empty_mass, flight.truth(0, "empty_mass_kg"), 0.01);
  EXPECT_NEAR(fd.empty_mass, flight.truth(0, "empty_mass_kg"), 0.01);

  const SurfaceStates sr = assembleRref<SurfaceStates>(flight), sd = assembleData<SurfaceStates>(flight);
  near(sr.aileron1, sd.aileron1, 8);
  near(sr.elevator, sd.elevator, 4);
  near(sr.rudder, sd.rudder, 2);
  EXPECT_NEAR(sr.delta_aileron, sd.delta_aileron, 1e-4);
  // The stick is to the right, back, with right pedal: roll right +, elevator trailing edge up, rudder trailing edge
  // right.
  EXPECT_GT(sr.delta_aileron, 1.0F);
  EXPECT_LT(sr.delta_elevator, -1.0F);
  EXPECT_LT(sr.delta_rudder, -1.0F);

  const SimStatus tr = assembleRref<SimStatus>(flight), td = assembleData<SimStatus>(flight);
  EXPECT_NEAR(tr.zulu_time, td.zulu_time, 0.02);
  EXPECT_NEAR(tr.flight_time, td.flight_time, 1e-3);
  EXPECT_GT(tr.frame_rate, 0.0F);
}

// 100 deg C are 212 deg F, -40 are the same in both.
TEST(MissionGroups, TemperaturesAreCelsiusWhateverTheGaugesShow) {
  for (const float in_celsius : {1.0F, 0.0F, kNaNf}) {
    SCOPED_TRACE(in_celsius);
    MissionAssembler<EngineStates>::Options options;
    options.version = kXPlane11;
    MissionAssembler<EngineStates> assembler(options);
    Datagram d = Datagram::labelled("RREF,");
    for (std::size_t i = 0; i < assembler.requests().size(); ++i) {
      const std::string& path = assembler.requests()[i].path;
      float value = 2.0F;
      if (path == "sim/aircraft/engine/acf_CHT_is_C") value = in_celsius;
      if (path == "sim/flightmodel/engine/ENGN_CHT_c[0]") value = 212.0F;
      if (path == "sim/flightmodel/engine/ENGN_CHT_c[1]") value = -40.0F;
      d.pair(static_cast<std::int32_t>(i), value);
    }
    ASSERT_TRUE(assembler.add(d.rref(), kStart));
    const EngineStates s = assembler.assemble(nullptr, kStart, noClock());
    EXPECT_EQ((s.valid & EngineStates::kValidCht) != 0, std::isfinite(in_celsius));
    EXPECT_EQ(s.egt[0], 2.0F);  // its gauge is another
    if (std::isnan(in_celsius)) {
      EXPECT_TRUE(std::isnan(s.cht[0]));
    } else {
      EXPECT_FLOAT_EQ(s.cht[0], in_celsius > 0.5F ? 212.0F : 100.0F);
      EXPECT_FLOAT_EQ(s.cht[1], -40.0F);
    }
  }
}

TEST(MissionGroups, AirspeedDialIsKnotsOrMach) {
  struct Dial {
    float dial, is_mach;
    double airspeed, mach;
  };
  // The last two: airspeed_is_mach does not answer. 120 kt are 61.7333 m/s, 8 kt 4.1156 m/s.
  for (const Dial& c :
       {Dial{120.0F, 0.0F, 61.7333, kNaN}, Dial{0.78F, 1.0F, kNaN, 0.78}, Dial{8.0F, 0.0F, 4.1156, kNaN},
        Dial{120.0F, kNaNf, 61.7333, kNaN}, Dial{0.78F, kNaNf, kNaN, 0.78}}) {
    SCOPED_TRACE(c.dial);
    MissionAssembler<AutopilotState>::Options options;
    options.version = kXPlane11;
    MissionAssembler<AutopilotState> assembler(options);
    Datagram d = Datagram::labelled("RREF,");
    for (std::size_t i = 0; i < assembler.requests().size(); ++i) {
      const std::string& path = assembler.requests()[i].path;
      const bool dial = path == "sim/cockpit2/autopilot/airspeed_dial_kts_mach";
      const bool is_mach = path == "sim/cockpit2/autopilot/airspeed_is_mach";
      d.pair(static_cast<std::int32_t>(i), dial ? c.dial : is_mach ? c.is_mach : 0.0F);
    }
    ASSERT_TRUE(assembler.add(d.rref(), kStart));
    const AutopilotState s = assembler.assemble(nullptr, kStart, noClock());
    EXPECT_EQ(std::isnan(s.target_airspeed), std::isnan(c.airspeed));
    EXPECT_EQ(std::isnan(s.target_mach), std::isnan(c.mach));
    if (!std::isnan(c.airspeed)) {
      EXPECT_NEAR(s.target_airspeed, c.airspeed, 1e-3);
    }
    if (!std::isnan(c.mach)) {
      EXPECT_NEAR(s.target_mach, c.mach, 1e-6);
    }
  }
}

/// SimStatus by RREF with this frame_rate_period and sim_speed, at a clock whose frames come so far apart.
SimStatus statusAt(float frame_period, float sim_speed, double host_period, const ClockFilter::Options& options = {}) {
  ClockFilter clock(options);
  const double step = static_cast<double>(frame_period * timeAcceleration(sim_speed));
  for (int i = 0; i < 100; ++i) {
    ClockSample sample;
    sample.receive_ns = kStart + toNanoseconds(i * host_period);
    sample.sim_time = static_cast<float>(100.0 + i * step);
    sample.acceleration = timeAcceleration(sim_speed);
    sample.frame_period = static_cast<float>(step);
    if (host_period > 0.0) clock.update(sample);
  }
  EXPECT_EQ(clock.fitted(), host_period > 0.0 && !options.exact);
  MissionAssembler<SimStatus>::Options group;
  group.version = kXPlane11;
  MissionAssembler<SimStatus> assembler(group);
  Datagram d = Datagram::labelled("RREF,");
  for (std::size_t i = 0; i < assembler.requests().size(); ++i) {
    const std::string& path = assembler.requests()[i].path;
    const bool period = path == "sim/operation/misc/frame_rate_period";
    d.pair(static_cast<std::int32_t>(i), period ? frame_period : path == "sim/time/sim_speed" ? sim_speed : 1.0F);
  }
  EXPECT_TRUE(assembler.add(d.rref(), kStart));
  return assembler.assemble(nullptr, kStart, clock);
}

// X-Plane simulates at most 1/19.9 s in a frame, however long it lasts.
TEST(MissionGroups, FrameRateIsThatOfRealTimeAlsoBelowTwentyFrames) {
  constexpr float kLongest = 1.0F / 19.9F;
  constexpr double kNoClock = 0.0;
  ClockFilter::Options lockstep;
  lockstep.exact = true;
  EXPECT_NEAR(statusAt(kLongest, 1.0F, 0.1).frame_rate, 10.0, 1e-2);
  EXPECT_NEAR(statusAt(kLongest, 4.0F, 0.1).frame_rate, 10.0, 1e-2);
  EXPECT_NEAR(statusAt(1.0F / 60.0F, 4.0F, 1.0 / 60.0).frame_rate, 60.0, 1e-3);
  EXPECT_NEAR(statusAt(1.0F / 60.0F, 1.0F, kNoClock).frame_rate, 60.0, 1e-3);
  EXPECT_NEAR(statusAt(0.05F, 1.0F, 0.05, lockstep).frame_rate, 20.0, 1e-3);
  const SimStatus unknown = statusAt(kLongest, 1.0F, kNoClock);
  EXPECT_TRUE(std::isnan(unknown.frame_rate));
  EXPECT_FLOAT_EQ(unknown.frame_period, kLongest);
  EXPECT_EQ(unknown.valid, SimStatus::kValidAll & ~SimStatus::kValidRate);
}

// The stamp of a slower group is that of its simulator time, by the flight group's clock.
TEST(MissionGroups, StampComesFromTheSimulatorsTime) {
  ClockFilter clock;
  for (int i = 0; i < 300; ++i) {
    ClockSample sample;
    sample.receive_ns = kStart + i * kFrame;
    sample.sim_time = static_cast<float>(5000.0 + i / 60.0);
    sample.frame_period = 1.0F / 60.0F;
    clock.update(sample);
  }
  ASSERT_TRUE(clock.fitted());
  MissionAssembler<FuelState>::Options options;
  options.version = kXPlane11;
  MissionAssembler<FuelState> assembler(options);
  Datagram d = Datagram::labelled("RREF,");
  for (std::size_t i = 0; i < assembler.requests().size(); ++i) {
    const bool time = assembler.requests()[i].path == "sim/time/total_running_time_sec";
    d.pair(static_cast<std::int32_t>(i), time ? static_cast<float>(5000.0 + 240 / 60.0) : 1.0F);
  }
  const std::int64_t late = kStart + 290 * kFrame;
  ASSERT_TRUE(assembler.add(d.rref(), late));
  const FuelState state = assembler.assemble(nullptr, late, clock);
  EXPECT_NEAR(static_cast<double>(state.stamp_ns - (kStart + 240 * kFrame)) * 1e-9, 0.0, 1e-3);
  EXPECT_EQ(state.epoch, clock.epoch());
}

}  // namespace
}  // namespace xplane_bridge::core
