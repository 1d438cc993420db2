#include "xplane_bridge/core/failures/failures.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace xplane_bridge::core {
namespace {

constexpr auto k11 = kXPlane11;
constexpr auto k12 = kXPlane12;

FailureRequest request(const std::string& name, const std::string& kind = "failed",
                       std::optional<double> value = std::nullopt, int trigger = 0, double trigger_value = 0.0) {
  return {name, kind, value, trigger, trigger_value};
}

std::vector<std::string> datarefs(const std::string& name, SimulatorVersion version = k11) {
  return planFailure(request(name), version).plan.datarefs;
}

std::string fcon(const std::string& name, const std::string& kind, std::optional<double> value = std::nullopt) {
  const auto out = planFailure(request(name, kind, value), k12);
  return out.plan.datarefs.empty() ? "" : out.plan.datarefs[0];
}

FlightConditions at(double sim_time, double height = NAN, double speed = NAN) { return {sim_time, height, speed}; }

TEST(Failures, SystemsHaveTheirDatarefs) {
  using List = std::vector<std::string>;
  EXPECT_EQ(datarefs("engine_1"), List{"sim/operation/failures/rel_engfai0"});
  EXPECT_EQ(datarefs("engine_8"), List{"sim/operation/failures/rel_engfai7"});
  EXPECT_EQ(datarefs("bus_1"), List{"sim/operation/failures/rel_esys"});
  EXPECT_EQ(datarefs("bus_6"), List{"sim/operation/failures/rel_esys6"});
  EXPECT_EQ(datarefs("generator_2"), List{"sim/operation/failures/rel_genera1"});
  EXPECT_EQ(datarefs("battery_1"), List{"sim/operation/failures/rel_batter0"});
  EXPECT_EQ(datarefs("pitot_1"), List{"sim/operation/failures/rel_pitot"});
  EXPECT_EQ(datarefs("static_2"), List{"sim/operation/failures/rel_static2"});
  EXPECT_EQ(datarefs("gyro_2"), (List{"sim/operation/failures/rel_cop_ahz", "sim/operation/failures/rel_cop_dgy"}));
  EXPECT_EQ(datarefs("rel_smoke_cpit"), List{"sim/operation/failures/rel_smoke_cpit"});
  EXPECT_EQ(datarefs("sim/operation/failures/rel_otto"), List{"sim/operation/failures/rel_otto"});
  EXPECT_EQ(planFailure(request("sim/operation/failures/rel_otto"), k11).plan.name, "rel_otto");
}

TEST(Failures, UnknownNamesAndKindsAreRefusedInWords) {
  const auto text = [](const FailureRequest& r, FailureError error = FailureError::kInvalid) {
    const auto out = planFailure(r, k11);
    EXPECT_EQ(out.error, error) << r.name;
    return out.text;
  };
  EXPECT_NE(text(request("engine_9")).find("expected engine_1 to engine_8"), std::string::npos);
  EXPECT_NE(text(request("engine_0")).find("engine_1"), std::string::npos);
  EXPECT_NE(text(request("pitot_3")).find("pitot_2"), std::string::npos);
  EXPECT_NE(text(request("wing")).find("name is \"wing\""), std::string::npos);
  EXPECT_NE(text(request("rel_")).find("name is"), std::string::npos);
  EXPECT_NE(text(request("rel_pitot;rm")).find("name is"), std::string::npos);
  EXPECT_NE(text(request("rel_" + std::string(500, 'x'))).find("name is"), std::string::npos);
  EXPECT_NE(text(request("engine_1", "stuck")).find("expected failed"), std::string::npos);
  EXPECT_NE(text(request("rudder1_fin1", "failed")).find("expected stuck"), std::string::npos);
  EXPECT_NE(text(request("rudder1_fin1", "reduced")).find("value is missing"), std::string::npos);
  EXPECT_NE(text(request("rudder1_fin1", "gone"), FailureError::kNotSupported).find("X-Plane 11"), std::string::npos);
  EXPECT_NE(text(request("engine_1", "failed", {}, 6)).find("trigger is 6"), std::string::npos);
  EXPECT_NE(text(request("engine_1", "failed", {}, 2, NAN)).find("trigger_value"), std::string::npos);
  EXPECT_NE(text(request("engine_1", "failed", {}, 1, -1.0)).find("trigger_value"), std::string::npos);
}

TEST(Failures, WhatAFailureDoesNotUseIsRefused) {
  const auto text = [](const FailureRequest& r, SimulatorVersion version) {
    const auto out = planFailure(r, version);
    EXPECT_EQ(out.error, FailureError::kInvalid) << r.name << " " << r.kind;
    return out.text;
  };
  for (const SimulatorVersion version : {k11, k12}) {
    for (const char* name : {"engine_1", "rel_pitot"}) {
      EXPECT_EQ(text(request(name, "failed", 0.5), version),
                "value is 0.5: expected none (has_value: false) for kind failed; stuck, reduced and slow take one");
    }
    for (const char* kind : {"hard_over_up", "hard_over_down", "centred", "floating", "gone"}) {
      EXPECT_EQ(text(request("rudder1_fin1", kind, 3.0), version).rfind("value is 3: expected none", 0), 0U);
    }
    for (const char* kind : {"stuck", "reduced", "slow"}) {
      EXPECT_EQ(planFailure(request("rudder1_fin1", kind, 0.5), version).error, FailureError::kNone);
    }
    EXPECT_EQ(text(request("engine_1", "failed", {}, 0, 3000.0), version),
              "trigger_value is 3000: expected 0 with trigger 0 (NOW): choose one of 1..5 to wait");
    EXPECT_NE(text(request("engine_1", "failed", {}, 0, NAN), version), "");
  }
}

TEST(Failures, XPlane11FliesEverySurfaceFailure) {
  const auto out = planFailure(request("aileron1_wing2_left", "stuck", 5.0), k11);
  ASSERT_EQ(out.error, FailureError::kNone);
  EXPECT_TRUE(out.plan.datarefs.empty());
  ASSERT_TRUE(out.plan.surface);
  EXPECT_EQ(out.plan.surface->fault, SurfaceFault::kStuck);
  EXPECT_EQ(out.plan.surface->value, 5.0);
}

TEST(Failures, XPlane12sOwnFailuresWhereTheyExpressTheWish) {
  const std::string folder = "sim/operation/failures/";
  EXPECT_EQ(fcon("aileron1_wing2_left", "stuck"), folder + "rel_fcon_ailn_1_lft_lock");
  EXPECT_EQ(fcon("aileron1_wing2_left", "stuck", 5.0), "") << "a chosen angle is flown";
  EXPECT_EQ(fcon("elevator2_right", "hard_over_up"), folder + "rel_fcon_elev_2_rgt_mxup");
  EXPECT_EQ(fcon("rudder1_fin1", "centred"), folder + "rel_fcon_rudd_1_ctr_cntr");
  EXPECT_EQ(fcon("spoiler2_wing1_right", "hard_over_down"), folder + "rel_fcon_rspo_2_rgt_mxdn");
  EXPECT_EQ(fcon("yaw_brake_wing3_left", "gone"), folder + "rel_fcon_yawb_x_lft_gone");
  EXPECT_EQ(fcon("flap1_wing1_left", "slow", 1.0), "");
  EXPECT_EQ(fcon("flap1_wing1_left", "hard_over_down"), folder + "rel_fcon_flap_1_lft_mxdn");
  EXPECT_EQ(fcon("flap1_wing1_left", "centred"), "") << "in no list";
  EXPECT_EQ(fcon("speedbrake2_wing1_right", "centred"), "") << "in no list";
  // Flown after all where read-back shows that X-Plane does not obey.
  EXPECT_TRUE(planFailure(request("rudder1_fin1", "centred"), k12).plan.surface);
  EXPECT_FALSE(planFailure(request("rudder1_fin1", "gone"), k12).plan.surface);
}

TEST(Failures, WhereXPlanesOwnDoNotActEverySurfaceFailureIsFlown) {
  const SimulatorVersion ignored{k12.number, static_cast<std::uint32_t>(Otherwise::kFconActs)};
  const auto out = planFailure(request("aileron1_wing2_left", "stuck"), ignored);
  ASSERT_EQ(out.error, FailureError::kNone);
  EXPECT_TRUE(out.plan.datarefs.empty());
  ASSERT_TRUE(out.plan.surface);
  EXPECT_EQ(planFailure(request("rudder1_fin1", "gone"), ignored).error, FailureError::kNotSupported);
}

TEST(FailureRegistry, TriggersWaitForTheirCondition) {
  const struct {
    int trigger;
    double value;
    FlightConditions before, unknown, after;
  } cases[] = {
      {1, 5.0, at(104.9), at(NAN), at(105.0)},
      {2, 300.0, at(100, 299), at(100, NAN), at(100, 300)},
      {3, 50.0, at(100, 51), at(100, NAN), at(100, 50)},
      {4, 60.0, at(100, NAN, 59), at(100, NAN, NAN), at(100, NAN, 60)},
      {5, 30.0, at(100, NAN, 31), at(100, NAN, NAN), at(100, NAN, 30)},
  };
  for (const auto& c : cases) {
    FailureRegistry registry;
    const auto r = request("engine_1", "failed", {}, c.trigger, c.value);
    registry.add(r, planFailure(r, k11).plan, at(100.0));
    EXPECT_TRUE(registry.due(c.before).empty()) << c.trigger;
    EXPECT_TRUE(registry.due(c.unknown).empty()) << c.trigger;
    EXPECT_FALSE(registry.labels()[0].active);
    EXPECT_TRUE(std::isnan(registry.labels()[0].since_sim_time));
    ASSERT_EQ(registry.due(c.after).size(), 1u) << c.trigger;
    EXPECT_TRUE(registry.due(c.after).empty()) << "once";
    EXPECT_TRUE(registry.labels()[0].active);
    EXPECT_DOUBLE_EQ(registry.labels()[0].since_sim_time, c.after.sim_time);
  }
}

TEST(FailureRegistry, ConfirmsByReadBackAndSeesTheSimulatorsOwn) {
  FailureRegistry registry;
  const auto r = request("engine_1");
  registry.add(r, planFailure(r, k11).plan, at(10.0));
  EXPECT_TRUE(registry.observe("sim/operation/failures/rel_engfai0", 6, 10.0)) << "not active yet: it is the menu's";
  registry.due(at(10.0));
  EXPECT_TRUE(registry.observe("sim/operation/failures/rel_engfai0", 6, 10.1));
  EXPECT_TRUE(registry.labels()[0].confirmed);
  EXPECT_FALSE(registry.observe("sim/operation/failures/rel_engfai0", 6, 10.2)) << "nothing new";

  EXPECT_FALSE(registry.observe("sim/operation/failures/rel_pitot", 0, 11.0));
  EXPECT_TRUE(registry.observe("sim/operation/failures/rel_pitot", 6, 12.0));
  ASSERT_EQ(registry.labels().size(), 2u);
  const FailureLabel pitot = registry.labels()[1];
  EXPECT_EQ(pitot.name, "rel_pitot");
  EXPECT_FALSE(pitot.by_bridge);
  EXPECT_TRUE(pitot.active && pitot.confirmed);
  EXPECT_DOUBLE_EQ(pitot.since_sim_time, 12.0);
  EXPECT_TRUE(registry.observe("sim/operation/failures/rel_pitot", 0, 13.0));
  EXPECT_EQ(registry.labels().size(), 1u);
}

TEST(FailureRegistry, IsConfirmedWhenAllItsDatarefsShowIt) {
  const std::string horizon = "sim/operation/failures/rel_ss_ahz", gyro = "sim/operation/failures/rel_ss_dgy";
  FailureRegistry registry;
  const auto r = request("gyro_1");
  registry.add(r, planFailure(r, k11).plan, at(1.0));
  registry.due(at(1.0));
  EXPECT_FALSE(registry.observe(horizon, 6, 1.1));
  EXPECT_FALSE(registry.observe(gyro, 0, 1.1));
  EXPECT_FALSE(registry.labels()[0].confirmed) << "one of two";
  EXPECT_TRUE(registry.observe(gyro, 6, 1.2));
  EXPECT_TRUE(registry.labels()[0].confirmed);
  EXPECT_TRUE(registry.observe(horizon, 0, 1.3));
  EXPECT_FALSE(registry.labels()[0].confirmed);
}

TEST(FailureRegistry, OneDatarefHasOneName) {
  FailureRegistry registry;
  registry.observe("sim/operation/failures/rel_static", 6, 1.0);  // in the menu
  const auto ours = planFailure(request("static_1"), k11).plan;
  EXPECT_EQ(registry.sameAs(ours), std::nullopt) << "what the simulator has failed may be failed";
  registry.add(request("static_1"), ours, at(2.0));
  registry.due(at(2.0));
  ASSERT_EQ(registry.labels().size(), 1u) << "and is the bridge's from then on";
  EXPECT_TRUE(registry.labels()[0].by_bridge);
  EXPECT_TRUE(registry.observe("sim/operation/failures/rel_static", 6, 2.1));
  EXPECT_TRUE(registry.labels()[0].confirmed);
  EXPECT_EQ(registry.sameAs(ours), std::nullopt) << "itself is replaced";
  EXPECT_EQ(registry.sameAs(planFailure(request("rel_static"), k11).plan), "static_1");
  EXPECT_EQ(registry.sameAs(planFailure(request("rel_pitot"), k11).plan), std::nullopt);
}

TEST(FailureRegistry, OneOfTheMenuStandsBesideOneThatIsArmed) {
  const std::string pitot = "sim/operation/failures/rel_pitot";
  for (const char* name : {"pitot_1", "rel_pitot"}) {
    SCOPED_TRACE(name);
    FailureRegistry registry;
    const auto armed = request(name, "failed", {}, 1, 100.0);
    registry.add(armed, planFailure(armed, k11).plan, at(1.0));
    EXPECT_FALSE(registry.observe(pitot, 0, 1.5));
    EXPECT_TRUE(registry.observe(pitot, 6, 2.0));
    EXPECT_FALSE(registry.observe(pitot, 6, 3.0));
    ASSERT_EQ(registry.labels().size(), 2u);
    EXPECT_FALSE(registry.labels()[0].active);
    EXPECT_TRUE(registry.labels()[0].by_bridge);
    const FailureLabel menu = registry.labels()[1];
    EXPECT_EQ(menu.name, "rel_pitot");
    EXPECT_TRUE(!menu.by_bridge && menu.active && menu.confirmed);
    EXPECT_DOUBLE_EQ(menu.since_sim_time, 2.0);
    EXPECT_TRUE(registry.observe(pitot, 0, 4.0)) << "repaired in the menu";
    ASSERT_EQ(registry.labels().size(), 1u);
    EXPECT_FALSE(registry.isOfMenu("rel_pitot"));

    registry.observe(pitot, 6, 5.0);
    const FailureRegistry before = registry;
    EXPECT_TRUE(registry.clear({name}, false).undo.empty()) << "the armed one has nothing to undo";
    ASSERT_EQ(registry.labels().size(), 1u);
    EXPECT_FALSE(registry.labels()[0].by_bridge);

    registry = before;
    EXPECT_EQ(registry.clear({}, true).undo.size(), 1u);
    EXPECT_TRUE(registry.labels().empty());

    registry = before;
    EXPECT_EQ(registry.due(at(101.5)).size(), 1u);
    ASSERT_EQ(registry.labels().size(), 1u) << "it is the bridge's from then on";
    EXPECT_TRUE(registry.labels()[0].by_bridge);
    EXPECT_TRUE(registry.observe(pitot, 6, 101.6));
    EXPECT_TRUE(registry.labels()[0].confirmed);
  }
}

TEST(FailureRegistry, ClearsOnlyWhatItIsAskedTo) {
  FailureRegistry registry;
  for (const char* name : {"engine_1", "engine_2"}) {
    const auto r = request(name);
    registry.add(r, planFailure(r, k11).plan, at(1.0));
  }
  registry.due(at(1.0));
  const auto armed = request("bus_1", "failed", {}, 1, 100.0);
  registry.add(armed, planFailure(armed, k11).plan, at(1.0));
  registry.observe("sim/operation/failures/rel_pitot", 6, 2.0);

  auto out = registry.clear({"engine_2", "rel_pitot", "no_such"}, false);
  EXPECT_EQ(out.names, std::vector<std::string>{"engine_2"});
  ASSERT_EQ(out.undo.size(), 1u);
  EXPECT_EQ(out.undo[0].datarefs[0], "sim/operation/failures/rel_engfai1");
  out = registry.clear({}, false);
  EXPECT_EQ(out.names, (std::vector<std::string>{"bus_1", "engine_1"}));
  EXPECT_EQ(out.undo.size(), 1u) << "an armed one has nothing to undo";
  out = registry.clear({}, true);
  EXPECT_EQ(out.names, std::vector<std::string>{"rel_pitot"});
  EXPECT_TRUE(registry.labels().empty());
}

TEST(FailureRegistry, DriverFliesWhatXPlaneCannotOrDoesNot) {
  FailureRegistry registry;
  const auto angle = request("aileron1_wing2_left", "stuck", 5.0);
  const auto lock = request("rudder1_fin1", "stuck");
  registry.add(angle, planFailure(angle, k12).plan, at(1.0));
  registry.add(lock, planFailure(lock, k12).plan, at(1.0));
  EXPECT_TRUE(registry.drivenSurfaces().empty()) << "armed";
  registry.due(at(1.0));
  ASSERT_EQ(registry.drivenSurfaces().size(), 1u);
  EXPECT_EQ(registry.drivenSurfaces()[0].value, 5.0);
  registry.confirm("rudder1_fin1", true);
  registry.useDriver("rudder1_fin1", 3.0);
  EXPECT_EQ(registry.drivenSurfaces().size(), 2u);
  // X-Plane has shown its own failure, but not this one yet, which begins now.
  EXPECT_FALSE(registry.labels()[1].confirmed);
  EXPECT_DOUBLE_EQ(registry.labels()[1].since_sim_time, 3.0);
}

TEST(FailureRegistry, XPlanesFailureThatDidNotActIsFreeForOthers) {
  const std::string up = "sim/operation/failures/rel_fcon_rudd_1_ctr_mxup";
  FailureRegistry registry;
  const auto first = request("rudder1_fin1", "hard_over_up");
  const auto second = planFailure(request("rudder1_fin2", "hard_over_up"), k12).plan;
  registry.add(first, planFailure(first, k12).plan, at(1.0));
  registry.due(at(1.0));
  EXPECT_EQ(registry.sameAs(second), "rudder1_fin1");
  registry.useDriver("rudder1_fin1", 3.0);
  EXPECT_EQ(registry.sameAs(second), std::nullopt);
  EXPECT_TRUE(registry.observe(up, 6, 4.0)) << "set in the menu";
  EXPECT_TRUE(registry.isOfMenu("rel_fcon_rudd_1_ctr_mxup"));
  const auto cleared = registry.clear({}, false);
  EXPECT_EQ(cleared.names, std::vector<std::string>{"rudder1_fin1"});
  ASSERT_EQ(cleared.undo.size(), 1u);
  EXPECT_TRUE(cleared.undo[0].datarefs.empty()) << "the menu's stays set";
}

TEST(FailureRegistry, SecondRequestOfANameReplacesTheFirst) {
  FailureRegistry registry;
  auto r = request("aileron1_wing2_left", "stuck", 5.0);
  registry.add(r, planFailure(r, k11).plan, at(1.0));
  registry.due(at(1.0));
  r.value = 10.0;
  registry.add(r, planFailure(r, k11).plan, at(2.0));
  ASSERT_EQ(registry.due(at(2.0)).size(), 1u);
  ASSERT_EQ(registry.drivenSurfaces().size(), 1u);
  EXPECT_EQ(registry.drivenSurfaces()[0].value, 10.0);
}

TEST(FailureRegistry, ReportsWhatIsDrivenAndWhatShowsAFailure) {
  FailureRegistry registry;
  const auto stuck = request("aileron1_wing2_left", "stuck");
  registry.add(stuck, planFailure(stuck, k12).plan, at(1.0));
  EXPECT_TRUE(registry.datarefsOf("aileron1_wing2_left").empty()) << "armed";
  registry.due(at(1.0));
  EXPECT_FALSE(registry.isDriven("aileron1_wing2_left"));
  EXPECT_EQ(registry.datarefsOf("aileron1_wing2_left").front(), "sim/operation/failures/rel_fcon_ailn_1_lft_lock");
  registry.setValue("aileron1_wing2_left", 4.5);
  EXPECT_EQ(registry.labels().front().value, 4.5);
  registry.useDriver("aileron1_wing2_left", 2.0);
  EXPECT_TRUE(registry.isDriven("aileron1_wing2_left"));
  EXPECT_TRUE(registry.datarefsOf("aileron1_wing2_left").empty());
  EXPECT_FALSE(registry.drivenSurfaces().front().value) << "the label's value is no wish";
  registry.useDriver("aileron1_wing2_left", 2.0, 4.5);
  EXPECT_EQ(registry.drivenSurfaces().front().value, 4.5);
  EXPECT_FALSE(registry.isDriven("engine_1"));
  EXPECT_EQ(failureName("sim/operation/failures/rel_otto"), "rel_otto");
  EXPECT_EQ(failureName("engine_1"), "engine_1");
}

}  // namespace
}  // namespace xplane_bridge::core
