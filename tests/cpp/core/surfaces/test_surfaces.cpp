#include "xplane_bridge/core/surfaces/surfaces.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace xplane_bridge::core {
namespace {

std::string datarefOf(const std::string& name) {
  const auto number = surfaceNumber(name);
  return number ? surfaceTable()[*number].dataref : "no such surface";
}

TEST(Surfaces, NamesLeadToTheDatarefsOfTheReference) {
  EXPECT_EQ(datarefOf("aileron1_wing2_left"), "sim/flightmodel/controls/wing2l_ail1def");
  EXPECT_EQ(datarefOf("aileron2_wing4_right"), "sim/flightmodel/controls/wing4r_ail2def");
  EXPECT_EQ(datarefOf("spoiler2_wing1_right"), "sim/flightmodel/controls/wing1r_spo2def");
  EXPECT_EQ(datarefOf("flap1_wing1_right"), "sim/flightmodel/controls/wing1r_fla1def");
  EXPECT_EQ(datarefOf("yaw_brake_wing3_left"), "sim/flightmodel/controls/wing3l_yawbdef");
  EXPECT_EQ(datarefOf("speedbrake2_wing2_left"), "sim/flightmodel2/wing/speedbrake2_deg[2]");
  EXPECT_EQ(datarefOf("elevator1_left"), "sim/flightmodel/controls/hstab1_elv1def");
  EXPECT_EQ(datarefOf("elevator2_right"), "sim/flightmodel/controls/hstab2_elv2def");
  EXPECT_EQ(datarefOf("rudder1_fin1"), "sim/flightmodel/controls/vstab1_rud1def");
  EXPECT_EQ(datarefOf("rudder2_fin1"), "sim/flightmodel/controls/vstab1_rud2def");
  EXPECT_EQ(datarefOf("elevator1_wing1_left"), "sim/flightmodel/controls/wing1l_elv1def") << "an elevon";
  EXPECT_EQ(datarefOf("elevator2_wing3_right"), "sim/flightmodel/controls/wing3r_elv2def");
  EXPECT_FALSE(surfaceNumber("aileron"));
}

TEST(Surfaces, TableHasEachOnce) {
  std::set<std::string> names, datarefs;
  for (const auto& s : surfaceTable()) {
    names.insert(s.name);
    datarefs.insert(s.dataref);
  }
  EXPECT_EQ(surfaceTable().size(), 96u);  // 11 kinds on 8 wing parts, 4 elevators of the tail, 4 rudders
  EXPECT_EQ(names.size(), 96u);
  EXPECT_EQ(datarefs.size(), 96u);
}

TEST(Surfaces, WhatOpensHasItsPlusUp) {
  for (const char* name : {"spoiler1_wing1_left", "speedbrake2_wing2_right", "yaw_brake_wing3_left"}) {
    EXPECT_EQ(upSign(surfaceNumber(name).value()), 1.0) << name;
  }
  for (const char* name : {"aileron1_wing2_left", "flap1_wing1_right", "elevator1_left", "rudder1_fin1"}) {
    EXPECT_EQ(upSign(surfaceNumber(name).value()), -1.0) << name;
  }
}

TEST(Surfaces, CommandIsTakenWhole) {
  const auto good = checkSurfaceCommand({"aileron1_wing1_left", "rudder1_fin1"}, {5.0f, -90.0f});
  ASSERT_FALSE(good.refusal);
  ASSERT_EQ(good.surfaces.size(), 2u);
  EXPECT_EQ(surfaceTable()[good.surfaces[0].surface].name, "aileron1_wing1_left");
  EXPECT_DOUBLE_EQ(good.surfaces[1].deflection_deg, -90.0);
  EXPECT_FALSE(checkSurfaceCommand({}, {}).refusal);
}

TEST(Surfaces, CommandIsRefusedWhole) {
  const struct {
    std::vector<std::string> names;
    std::vector<float> values;
    Refusal reason;
  } cases[] = {{{"rudder1_fin1"}, {}, Refusal::kLengthMismatch},
               {{}, {1.0f}, Refusal::kLengthMismatch},
               {{"rudder1_fin1", "rudder"}, {1.0f, 1.0f}, Refusal::kUnknownSurface},
               {{"rudder1_fin1", "rudder1_fin1"}, {1.0f, 1.0f}, Refusal::kDuplicateSurface},
               {{"rudder1_fin1"}, {NAN}, Refusal::kNotFinite},
               {{"rudder1_fin1"}, {90.1f}, Refusal::kOutOfRange}};
  for (const auto& c : cases) {
    const auto out = checkSurfaceCommand(c.names, c.values);
    ASSERT_TRUE(out.refusal);
    EXPECT_EQ(out.refusal->reason, c.reason) << out.refusal->text;
    EXPECT_TRUE(out.surfaces.empty());
  }
}

}  // namespace
}  // namespace xplane_bridge::core
