#include "xplane_bridge/core/surfaces/surface_mixing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace xplane_bridge::core {
namespace {

// A made-up aircraft, written out by hand: ailerons 20 deg up and 15 deg down, elevators 25 up and 18 down with trim,
// a rudder, an elevon-like surface, and flaps.
std::size_t numberOf(const char* name) { return surfaceNumber(name).value(); }

std::vector<double> truth(const MixingInputs& in) {
  std::vector<double> out(surfaceTable().size(), 0.0);
  const double left_up = in.roll < 0 ? -20.0 * -in.roll : 15.0 * in.roll;  // roll right: left trailing edge down
  const double right = in.roll > 0 ? -20.0 * in.roll : 15.0 * -in.roll;
  out[numberOf("aileron1_wing2_left")] = left_up;
  out[numberOf("aileron1_wing2_right")] = right;
  const double elevator = (in.pitch > 0 ? -25.0 * in.pitch : -18.0 * in.pitch) - 6.0 * in.trim_pitch + 1.5;
  out[numberOf("elevator1_left")] = elevator;
  out[numberOf("elevator1_right")] = elevator;
  out[numberOf("rudder1_fin1")] = 22.0 * in.yaw;
  out[numberOf("flap1_wing1_left")] = 30.0 * in.flap1;
  return out;
}

// Sticks moved by sums of incommensurable sines: each axis by itself, to `reach` at most.
MixingInputs flying(int i, double reach) {
  MixingInputs in;
  const double t = 0.1 * i;
  in.roll = reach * std::sin(1.3 * t);
  in.pitch = reach * std::sin(0.83 * t + 1.0);
  in.yaw = reach * std::sin(2.17 * t + 2.0);
  in.trim_pitch = 0.2 * std::sin(0.11 * t);
  in.flap1 = in.flap2 = 0.5 + 0.5 * std::sin(0.07 * t);
  return in;
}

MixingIdentifier flown(int samples, double reach, MixingInputs (*fly)(int, double) = flying) {
  MixingIdentifier identifier;
  for (int i = 0; i < samples; ++i) {
    const MixingInputs in = fly(i, reach);
    EXPECT_TRUE(identifier.addSample(in, truth(in)));
  }
  return identifier;
}

bool asks(const MixingQuality& quality, const std::string& what) {
  return quality.text().find(what) != std::string::npos;
}

double slope(const MixingModel& model, const char* surface, MixingTerm term) {
  const SurfaceLaw* law = model.lawOf(numberOf(surface));
  return law ? law->slopes[static_cast<Eigen::Index>(term)] : std::nan("");
}

TEST(SurfaceMixing, FindsTheSlopesOfEachSideAndTheTrim) {
  const auto solution = flown(600, 0.6).solve("TEST");
  ASSERT_TRUE(solution.quality.good) << solution.quality.text();
  const MixingModel& model = solution.model;
  EXPECT_EQ(model.laws.size(), 6u);
  EXPECT_NEAR(slope(model, "aileron1_wing2_left", MixingTerm::kRollPlus), 15.0, 1e-6);
  EXPECT_NEAR(slope(model, "aileron1_wing2_left", MixingTerm::kRollMinus), 20.0, 1e-6);
  EXPECT_NEAR(slope(model, "aileron1_wing2_right", MixingTerm::kRollPlus), -20.0, 1e-6);
  EXPECT_NEAR(slope(model, "aileron1_wing2_right", MixingTerm::kRollMinus), -15.0, 1e-6);
  EXPECT_NEAR(slope(model, "elevator1_left", MixingTerm::kPitchPlus), -25.0, 1e-6);
  EXPECT_NEAR(slope(model, "elevator1_left", MixingTerm::kPitchMinus), -18.0, 1e-6);
  EXPECT_NEAR(slope(model, "elevator1_left", MixingTerm::kTrimPitch), -6.0, 1e-6);
  EXPECT_NEAR(slope(model, "elevator1_left", MixingTerm::kBias), 1.5, 1e-6);
  EXPECT_NEAR(slope(model, "elevator1_left", MixingTerm::kRollPlus), 0.0, 1e-6);
  EXPECT_NEAR(slope(model, "rudder1_fin1", MixingTerm::kYawMinus), 22.0, 1e-6);
  EXPECT_NEAR(slope(model, "flap1_wing1_left", MixingTerm::kFlap1), 30.0, 1e-6);
  EXPECT_EQ(model.lawOf(numberOf("aileron1_wing1_left")), nullptr) << "a surface the aircraft does not have";
}

TEST(SurfaceMixing, PredictsBeyondWhatWasFlown) {
  const auto solution = flown(600, 0.4).solve("TEST");
  MixingInputs full;
  full.roll = -1.0;
  full.pitch = 1.0;
  full.trim_pitch = 0.5;
  const MixingVector terms = mixingTerms(full);
  EXPECT_NEAR(solution.model.lawOf(numberOf("aileron1_wing2_left"))->deflection(terms), -20.0, 1e-6);
  EXPECT_NEAR(solution.model.lawOf(numberOf("elevator1_right"))->deflection(terms), -26.5, 1e-6);  // -25 - 3 + 1.5
  // Travel: what one axis reaches at full deflection.
  EXPECT_NEAR(solution.model.lawOf(numberOf("aileron1_wing2_left"))->low_deg, -20.0, 1e-6);
  EXPECT_NEAR(solution.model.lawOf(numberOf("aileron1_wing2_left"))->high_deg, 15.0, 1e-6);
  EXPECT_NEAR(solution.model.lawOf(numberOf("elevator1_left"))->low_deg, -23.5, 1e-6);
  EXPECT_NEAR(solution.model.lawOf(numberOf("elevator1_left"))->high_deg, 19.5, 1e-6);
}

TEST(SurfaceMixing, FlapsThatWereMovedALittleCanGoAllTheWay) {
  const auto solution = flown(600, 0.6, [](int i, double reach) {
                          MixingInputs in = flying(i, reach);
                          in.flap1 = 0.4 * in.flap1;
                          in.flap2 = 0.0;
                          return in;
                        }).solve("TEST");
  EXPECT_NEAR(solution.model.lawOf(numberOf("flap1_wing1_left"))->high_deg, 30.0, 1e-6);
}

TEST(SurfaceMixing, ToleratesTheRoundingAndNoiseOfALink) {
  MixingIdentifier identifier;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(-0.2, 0.2);
  for (int i = 0; i < 1200; ++i) {
    const MixingInputs in = flying(i, 0.6);
    auto shown = truth(in);
    for (double& deflection : shown) {
      if (deflection != 0.0) deflection += noise(random);
    }
    identifier.addSample(in, shown);
  }
  const auto solution = identifier.solve("TEST");
  EXPECT_TRUE(solution.quality.good) << solution.quality.text();
  EXPECT_NEAR(slope(solution.model, "aileron1_wing2_left", MixingTerm::kRollMinus), 20.0, 0.15);
  EXPECT_NEAR(solution.quality.worst_residual_deg, 0.4 / std::sqrt(12.0), 0.01);  // rms of a uniform +-0.2
}

TEST(SurfaceMixing, AsksForTheAxisThatWasNotFlown) {
  const auto no_left_rudder = flown(600, 0.6, [](int i, double reach) {
                                MixingInputs in = flying(i, reach);
                                in.yaw = std::abs(in.yaw);
                                return in;
                              }).solve("TEST");
  EXPECT_FALSE(no_left_rudder.quality.good);
  EXPECT_TRUE(asks(no_left_rudder.quality, "yaw left: seen up to 0.00, need 0.30")) << no_left_rudder.quality.text();
  EXPECT_FALSE(asks(no_left_rudder.quality, "yaw right"));
  EXPECT_FALSE(asks(no_left_rudder.quality, "roll"));

  const auto timid = flown(600, 0.2).solve("TEST");
  EXPECT_FALSE(timid.quality.good);
  EXPECT_EQ(timid.quality.needs.size(), 6u) << timid.quality.text();
  EXPECT_TRUE(asks(timid.quality, "pitch nose up: seen up to 0.20, need 0.30")) << timid.quality.text();
}

TEST(SurfaceMixing, AsksForIndependentMovementOfCoupledAxes) {
  const auto coordinated = flown(600, 0.6, [](int i, double reach) {
                             MixingInputs in = flying(i, reach);
                             in.yaw = in.roll;  // turn coordination: rudder always with aileron
                             return in;
                           }).solve("TEST");
  EXPECT_FALSE(coordinated.quality.good);
  EXPECT_TRUE(asks(coordinated.quality, "yaw right: moved alone by 0.00 rms, need 0.03")) << coordinated.quality.text();
}

TEST(SurfaceMixing, AsksForMoreTimeAndForAnyMovement) {
  EXPECT_TRUE(asks(flown(199, 0.6).solve("TEST").quality, "199 samples"));
  MixingIdentifier nothing;
  EXPECT_FALSE(nothing.solve("TEST").quality.good);
  for (int i = 0; i < 300; ++i) {
    nothing.addSample(flying(i, 0.6), std::vector<double>(surfaceTable().size(), 0.0));
  }
  EXPECT_TRUE(asks(nothing.solve("TEST").quality, "no surface has moved"));
}

TEST(SurfaceMixing, RefusesASurfaceThatDoesNotFollow) {
  MixingIdentifier identifier;
  for (int i = 0; i < 600; ++i) {
    const MixingInputs in = flying(i, 0.6);
    auto shown = truth(in);
    shown[numberOf("rudder1_fin1")] = 10.0 * std::sin(5.0 * i);  // moved by something else
    identifier.addSample(in, shown);
  }
  const auto solution = identifier.solve("TEST");
  EXPECT_FALSE(solution.quality.good);
  EXPECT_TRUE(asks(solution.quality, "rudder1_fin1 does not follow")) << solution.quality.text();
  EXPECT_NEAR(solution.quality.worst_residual_deg, 10.0 / std::sqrt(2.0), 0.3);
}

TEST(SurfaceMixing, AConstantTrimAndFlapAreNoNeedButTheirMovementIsSaid) {
  const auto solution = flown(600, 0.6, [](int i, double reach) {
                          MixingInputs in = flying(i, reach);
                          in.trim_pitch = 0.1;
                          in.flap1 = in.flap2 = 0.25;
                          return in;
                        }).solve("TEST");
  ASSERT_TRUE(solution.quality.good) << solution.quality.text();
  EXPECT_FALSE(solution.model.known[static_cast<std::size_t>(MixingTerm::kTrimPitch)]);
  EXPECT_NEAR(slope(solution.model, "elevator1_left", MixingTerm::kBias), 0.9, 1e-6) << "1.5 - 6 * 0.1";
  MixingInputs now;
  now.trim_pitch = 0.12;
  now.flap1 = now.flap2 = 0.25;
  EXPECT_TRUE(solution.model.unknownMovement(now).empty());
  now.flap1 = 0.5;
  EXPECT_EQ(solution.model.unknownMovement(now), std::vector<std::string>{"flap1"});
}

TEST(SurfaceMixing, TwoFlapRatiosThatMoveTogetherCountAsOne) {
  const auto model = flown(600, 0.6).solve("TEST").model;
  EXPECT_TRUE(model.known[static_cast<std::size_t>(MixingTerm::kFlap1)]);
  EXPECT_FALSE(model.known[static_cast<std::size_t>(MixingTerm::kFlap2)]);
}

TEST(SurfaceMixing, SkipsUselessSamplesAndSurfacesKnownOnlySometimes) {
  MixingIdentifier identifier;
  MixingInputs bad;
  bad.roll = std::nan("");
  EXPECT_FALSE(identifier.addSample(bad, truth({})));
  EXPECT_FALSE(identifier.addSample({}, {1.0, 2.0}));
  EXPECT_EQ(identifier.samples(), 0u);
  for (int i = 0; i < 600; ++i) {
    const MixingInputs in = flying(i, 0.6);
    auto shown = truth(in);
    if (i % 2 == 0) shown[numberOf("rudder1_fin1")] = std::nan("");
    identifier.addSample(in, shown);
  }
  EXPECT_EQ(identifier.solve("TEST").model.lawOf(numberOf("rudder1_fin1")), nullptr);
  identifier.reset();
  EXPECT_EQ(identifier.samples(), 0u);
}

TEST(SurfaceMixing, InputsComeInTheOrderOfTheirDatarefs) {
  const MixingInputs in = mixingInputsFrom({1, 2, 3, 4, 5, 6, 7, 8, 9});
  const auto& names = mixingInputDatarefs();
  EXPECT_STREQ(names[0], "sim/cockpit2/controls/total_roll_ratio");
  EXPECT_EQ(in.roll, 1.0);
  EXPECT_STREQ(names[2], "sim/cockpit2/controls/total_heading_ratio");
  EXPECT_EQ(in.yaw, 3.0);
  EXPECT_STREQ(names[4], "sim/cockpit2/controls/elevator_trim");
  EXPECT_EQ(in.trim_pitch, 5.0);
  EXPECT_STREQ(names[6], "sim/flightmodel2/controls/flap1_deploy_ratio");
  EXPECT_EQ(in.flap1, 7.0);
  EXPECT_EQ(in.speedbrake, 9.0);
}

TEST(SurfaceMixing, FileKeepsTheModel) {
  const auto model = flown(600, 0.6).solve("C172").model;
  const auto again = mixingFromText(toText(model));
  EXPECT_EQ(again.aircraft, "C172");
  EXPECT_EQ(again.samples, 600u);
  EXPECT_EQ(again.known, model.known);
  ASSERT_EQ(again.laws.size(), model.laws.size());
  for (std::size_t i = 0; i < model.laws.size(); ++i) {
    EXPECT_EQ(again.laws[i].surface, model.laws[i].surface);
    EXPECT_TRUE(again.laws[i].slopes.isApprox(model.laws[i].slopes, 1e-12));
    EXPECT_DOUBLE_EQ(again.laws[i].low_deg, model.laws[i].low_deg);
  }
  const auto flap2 = static_cast<Eigen::Index>(MixingTerm::kFlap2);
  EXPECT_DOUBLE_EQ(again.level[flap2], model.level[flap2]);
}

TEST(SurfaceMixing, FileErrorsAreSaid) {
  const auto error = [](const std::string& text) -> std::string {
    try {
      mixingFromText(text);
    } catch (const MixingFileError& e) {
      return e.what();
    }
    return "";
  };
  const std::string good = toText(flown(600, 0.6).solve("C172").model);
  EXPECT_EQ(error(good), "");
  EXPECT_NE(error(""), "");
  EXPECT_NE(error("{}"), "");
  EXPECT_NE(error(good.substr(0, good.size() / 2)), "");
  std::string other = good;
  other.replace(other.find("\"version\": 1"), 12, "\"version\": 2");
  EXPECT_NE(error(other).find("version is not 1"), std::string::npos);
  other = good;
  other.replace(other.find("rudder1_fin1"), 12, "rudder9_fin1");
  EXPECT_NE(error(other).find("rudder9_fin1"), std::string::npos);
  other = good;
  other.replace(other.find("\"high_deg\": "), 12, "\"high_deg\": -9");
  EXPECT_NE(error(other).find("high_deg is not above low_deg"), std::string::npos) << error(other);
}

TEST(SurfaceMixing, FileNameIsSafe) {
  EXPECT_EQ(mixingPath("/home/u/.ros/xplane_bridge/mixing", "C172"), "/home/u/.ros/xplane_bridge/mixing/C172.yaml");
  EXPECT_EQ(mixingPath("/m", "Aircraft/My Jet/x.acf"), "/m/Aircraft-My-Jet-x.acf.yaml");
}

}  // namespace
}  // namespace xplane_bridge::core
