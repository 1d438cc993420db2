#include "surface_identification/fixture.hpp"

namespace xplane_bridge {
namespace {

TEST_F(SurfaceIdentificationTest, FindsTheMixingOfAllSurfacesInFifteenSeconds) {
  EXPECT_NE(setCentred().find("call identify_surfaces"), std::string::npos);
  begin();
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_EQ(outcome().kind, EventKind::kSetting);
  EXPECT_EQ(outcome().who, "test");
  EXPECT_EQ(outcome().text, "the mixing of 4 surfaces of DA62 is identified, kept in " + folder() + "/DA62.yaml");
  EXPECT_EQ(actuation_->surfaces().blockReason(), "") << "single surfaces move at once";
  const auto kept = readMixingFile(folder(), "DA62");
  ASSERT_TRUE(kept);
  const core::MixingModel expected = FakeAirframe::mixing("DA62");
  ASSERT_EQ(kept->laws.size(), expected.laws.size());
  for (std::size_t i = 0; i < expected.laws.size(); ++i) {
    EXPECT_EQ(kept->laws[i].surface, expected.laws[i].surface);
    EXPECT_NEAR((kept->laws[i].slopes - expected.laws[i].slopes).cwiseAbs().maxCoeff(), 0.0, 0.01);
  }
}

TEST_F(SurfaceIdentificationTest, MovesEachAxisALittleAndGivesItBack) {
  begin();
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(ever_taken_[i]);
    EXPECT_EQ(sim_.value(kOverrides[i]), 0.0F) << "the pilot's again";
    // A quarter more than the fifth of full stick that it takes.
    EXPECT_NEAR(high_[i], 0.25, 0.005);
    EXPECT_NEAR(low_[i], -0.25, 0.005);
  }
  std::vector<std::string> done;
  for (const ExcitationLabel& label : labels_) {
    if (label.result == "done") done.push_back(label.target);
  }
  EXPECT_EQ(done, (std::vector<std::string>{"roll", "pitch", "yaw"}));
}

TEST_F(SurfaceIdentificationTest, StartsFromWhereThePilotHoldsTheStick) {
  pilot_ = {0.0, 0.2, 0.0};
  run(1.0);
  begin();
  run(18.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_NEAR(high_[1], 0.65, 0.01) << "0.2 + 0.25 to the other side of the middle, and as much to this side";
  EXPECT_NEAR(low_[1], -0.25, 0.01);
  EXPECT_NEAR(sim_.value(core::mixingInputDatarefs()[1]), 0.2, 1e-6);
}

TEST_F(SurfaceIdentificationTest, AddsToWhatAControllerFliesAndMovesMoreAgainstIt) {
  // A controller that takes half of the signal away again, as an attitude loop does.
  double answer = 0.0;
  each_frame_ = [&] {
    core::ControlCommand command;
    command.fields = core::kFieldRoll | core::kFieldPitch | core::kFieldYaw;
    command.roll = answer;
    actuation_->path().command(core::FlightMode::kManual, command);
    answer = -0.5 * (static_cast<double>(sim_.value(kSticks[0])) - answer);
  };
  run(0.5);
  begin();
  run(25.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_GT(std::count_if(labels_.begin(), labels_.end(),
                          [](const auto& label) { return label.target == "roll" && label.result == "done"; }),
            1)
      << "once more, with more";
  EXPECT_EQ(sim_.value(kOverrides[0]), 1.0F) << "the controller flies on";
}

TEST_F(SurfaceIdentificationTest, WorksParked) {
  sim_.set(kOnGround, 1.0F);
  sim_.set(kPosition + "y_agl", 0.0F);
  sim_.set(kPosition + "indicated_airspeed", 0.0F);
  sim_.set(kPosition + "groundspeed", 0.0F);
  run(0.1);
  begin();
  run(15.0);
  EXPECT_TRUE(outcome().success) << outcome().text;
}

TEST_F(SurfaceIdentificationTest, IsNotSavedIfAskedNotTo) {
  IdentificationRequest request;
  request.save = false;
  begin(request);
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_EQ(outcome().text, "the mixing of 4 surfaces of DA62 is identified, not kept in a file, as asked for");
  EXPECT_EQ(actuation_->surfaces().blockReason(), "");
  // Half a minute of stick would be worth a file otherwise.
  each_frame_ = [this] {
    const double angle = 2.0 * sim_.time();
    pilot_ = {0.4 * std::sin(angle), 0.4 * std::sin(1.3 * angle), 0.4 * std::sin(1.7 * angle)};
  };
  run(60.0);
  EXPECT_FALSE(std::filesystem::exists(folder()));
}

TEST_F(SurfaceIdentificationTest, SaysWhatIsMissingWhereASurfaceDoesNotFollow) {
  // The left aileron flutters.
  each_frame_ = [this] {
    sim_.set(FakeAirframe::dataref(FakeAirframe::kLeft), static_cast<float>(3.0 * std::sin(9.0 * sim_.time())));
  };
  begin();
  run(15.0);
  EXPECT_FALSE(outcome().success);
  EXPECT_EQ(outcome().text.find("the mixing is not identified: "), 0U) << outcome().text;
  EXPECT_NE(outcome().text.find("aileron1_wing2_left does not follow"), std::string::npos) << outcome().text;
  EXPECT_FALSE(std::filesystem::exists(folder()));
}

TEST_F(SurfaceIdentificationTest, SaysWhatIsMissingWhereAnAxisDoesNotMove) {
  sim_.setReadOnly(kSticks[2]);
  begin();
  run(25.0);
  EXPECT_FALSE(outcome().success);
  EXPECT_NE(outcome().text.find("yaw right: seen up to 0.00, need 0.20 of full stick"), std::string::npos)
      << outcome().text;
}

TEST_F(SurfaceIdentificationTest, KeepsAMixingThatKnowsMore) {
  writeMixingFile(folder(), FakeAirframe::mixing("QUAD"));
  showAircraft("QUAD");
  run(2.0);
  const auto before = readMixingFile(folder(), "QUAD");
  begin();
  run(15.0);
  EXPECT_TRUE(outcome().success);
  EXPECT_NE(outcome().text.find("the mixing known already holds"), std::string::npos) << outcome().text;
  EXPECT_EQ(core::toText(*readMixingFile(folder(), "QUAD")), core::toText(*before));
}

TEST_F(SurfaceIdentificationTest, ReplacesAMixingThatDoesNotFit) {
  core::MixingModel wrong = FakeAirframe::mixing("QUAD");
  wrong.laws[0].slopes[0] = 8.0;  // its bias
  writeMixingFile(folder(), wrong);
  showAircraft("QUAD");
  run(2.0);
  ASSERT_NE(actuation_->surfaces().blockReason().find("call identify_surfaces"), std::string::npos);
  begin();
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_NEAR(readMixingFile(folder(), "QUAD")->laws[0].slopes[0], 0.0, 0.01);
}

// ---------------------------------------------------------------------------------------------------- it is refused

}  // namespace
}  // namespace xplane_bridge
