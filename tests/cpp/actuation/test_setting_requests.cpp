#include "xplane_bridge/actuation/setting_requests.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "fake_simulator.hpp"

namespace xplane_bridge {
namespace {

using core::ResultCode;
using Reports = std::vector<std::pair<std::string, bool>>;

constexpr const char* kWho = "/tx_node/set_dataref";

constexpr double kTimeout = 2.0;
constexpr const char* kQnh = "sim/weather/barometer_sealevel_inhg";
constexpr const char* kFirst = "sim/cockpit2/engine/actuators/throttle_ratio[0]";
constexpr const char* kSecond = "sim/cockpit2/engine/actuators/throttle_ratio[1]";

class Simulator : public core::FakeSimulator {
 public:
  bool inLockstep() const override { return lockstep; }
  core::SendStatus send(core::ByteView bytes) override {
    return refusal == core::SendStatus::kSent ? FakeSimulator::send(bytes) : refusal;
  }

  bool lockstep = false;
  core::SendStatus refusal = core::SendStatus::kSent;  // of every message
};

class SettingRequestsTest : public testing::Test {
 protected:
  SettingRequestsTest() {
    sim_.set(kQnh, 29.92F);
    sim_.setAll({kFirst, kSecond}, 0.0F);
  }

  Simulator sim_;
  Reports reports_;
  OverrideManager overrides_{&sim_, [](const std::string&, bool) {}};
  SettingRequests settings_{&sim_, &overrides_, kTimeout,
                            [this](const std::string& text, const std::string& who, bool success) {
                              EXPECT_EQ(who, kWho);
                              reports_.emplace_back(text, success);
                            }};
};

TEST_F(SettingRequestsTest, ElementsThatFollowAreWrittenToo) {
  const auto written = settings_.setDataref(kFirst, {0.25F, 0.75F}, kWho);
  EXPECT_EQ(written.result.code, ResultCode::kOk);
  EXPECT_EQ(written.values, (std::vector<float>{0.25F, 0.75F}));
  EXPECT_EQ(sim_.value(kSecond), 0.75F);
  EXPECT_EQ(reports_, (Reports{{std::string("set_dataref ") + kFirst + ": X-Plane shows it", true}}));
}

TEST_F(SettingRequestsTest, WhatIsNoNumberIsRefusedBeforeAnythingIsSent) {
  const float infinite = std::numeric_limits<float>::infinity();
  for (const std::vector<float>& values :
       {std::vector<float>{}, {std::nanf("")}, {infinite}, {0.5F, -infinite}, {std::nanf(""), 0.5F}}) {
    const auto written = settings_.setDataref(kFirst, values, kWho);
    EXPECT_EQ(written.result.code, ResultCode::kRefused);
    EXPECT_EQ(written.result.text, "values: expected one or more finite numbers");
    EXPECT_TRUE(written.values.empty());
  }
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(reports_.empty());
}

TEST_F(SettingRequestsTest, WhatCannotBeSentIsSaidAtOnce) {
  sim_.refusal = core::SendStatus::kNoPeer;
  const double began = sim_.time();
  const auto written = settings_.setDataref(kQnh, {29.5F}, kWho);
  EXPECT_EQ(written.result.code, ResultCode::kRefused);
  EXPECT_EQ(written.result.text, std::string(kQnh) + " is not sent: " + core::toString(core::SendStatus::kNoPeer));
  EXPECT_LT(sim_.time() - began, kTimeout) << "there is nothing to wait for";
  ASSERT_EQ(reports_.size(), 1U);
  EXPECT_FALSE(reports_[0].second);
  const RequestResult command = settings_.runCommand("sim/lights/landing_lights_on");
  EXPECT_EQ(command.code, ResultCode::kRefused);
  EXPECT_NE(command.text.find(core::toString(core::SendStatus::kNoPeer)), std::string::npos) << command.text;
}

TEST_F(SettingRequestsTest, AnOverrideThatXPlaneDoesNotHaveIsNotSet) {
  constexpr const char* kMisspelt = "sim/operation/override/override_joystik";
  const auto written = settings_.setDataref(kMisspelt, {1.0F}, kWho);
  EXPECT_EQ(written.result.code, ResultCode::kTimeout);
  EXPECT_EQ(written.result.text, std::string(kMisspelt) + " does not answer: is the name right?");
  EXPECT_EQ(reports_, (Reports{{std::string("set_dataref ") + kMisspelt + ": " + written.result.text, false}}));
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(sim_.journal()->entries().empty()) << "it could never be seen released";
  EXPECT_TRUE(overrides_.active().empty());
}

TEST_F(SettingRequestsTest, AnOverrideThatCannotBeWrittenDownIsRefusedInWords) {
  constexpr const char* kRoll = "sim/operation/override/override_joystick_roll";
  sim_.set(kRoll, 0.0F);
  sim_.breakJournal();
  const auto written = settings_.setDataref(kRoll, {1.0F}, kWho);
  EXPECT_EQ(written.result.code, ResultCode::kRefused);
  EXPECT_EQ(written.result.text.find("it could not be given back after a crash, should there be one: "), 0U);
  EXPECT_TRUE(written.values.empty());
  EXPECT_EQ(reports_, (Reports{{std::string("set_dataref ") + kRoll + ": " + written.result.text, false}}));
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(SettingRequestsTest, AnOverrideIsHeldUntilItIsGivenBack) {
  constexpr const char* kRoll = "sim/operation/override/override_joystick_roll";
  sim_.set(kRoll, 0.0F);
  EXPECT_EQ(settings_.setDataref(kRoll, {1.0F}, kWho).result.code, ResultCode::kOk);
  EXPECT_EQ(overrides_.active(), std::vector<std::string>{kRoll});
  EXPECT_EQ(settings_.setDataref(kRoll, {0.0F}, kWho).result.code, ResultCode::kOk);
  EXPECT_TRUE(overrides_.active().empty());
}

TEST_F(SettingRequestsTest, AnOverrideThatIsFlownByIsNotGivenBack) {
  constexpr const char* kRoll = "sim/operation/override/override_joystick_roll";
  sim_.set(kRoll, 0.0F);
  overrides_.acquire(OverrideHolder::kRequest, kRoll);  // held by set_dataref as well
  overrides_.setRequired({kRoll});
  sim_.clearMessages();
  const auto written = settings_.setDataref(kRoll, {0.0F}, kWho);
  EXPECT_EQ(written.result.code, ResultCode::kRefused);
  EXPECT_EQ(written.result.text.find(std::string(kRoll) + " is what tx_node flies by"), 0U) << written.result.text;
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(sim_.value(kRoll), 1.0F);
  overrides_.setRequired({});
  EXPECT_EQ(sim_.value(kRoll), 0.0F) << "set_dataref has taken its own hold back";
}

TEST_F(SettingRequestsTest, AnOverrideThatSurfacesOrTrafficNeedIsNotGivenBack) {
  constexpr const char* kPlanePath = "sim/operation/override/override_planepath[1]";
  const std::vector<std::tuple<OverrideHolder, std::string, std::string>> held = {
      {OverrideHolder::kSurfaces, core::kSurfaceOverride,
       "drives the surfaces by: clear their failures, and end control/surfaces and excitations of surfaces"},
      {OverrideHolder::kTraffic, kPlanePath, "places that aircraft by: leave it out of traffic/command"},
  };
  for (const auto& [holder, name, use] : held) {
    sim_.set(name, 0.0F);
    overrides_.acquire(OverrideHolder::kRequest, name);  // held by set_dataref as well
    overrides_.acquire(holder, name);
    sim_.clearMessages();
    const auto written = settings_.setDataref(name, {0.0F}, kWho);
    EXPECT_EQ(written.result.code, ResultCode::kRefused);
    EXPECT_EQ(written.result.text, name + " is what tx_node " + use +
                                       ", and it is given back; or run scripts/release_overrides, which ends all "
                                       "flying");
    EXPECT_TRUE(sim_.messages().empty());
    EXPECT_EQ(overrides_.holders(name), std::set<OverrideHolder>{holder});
    overrides_.release(holder, name);
    EXPECT_EQ(sim_.value(name), 0.0F);
  }
}

TEST_F(SettingRequestsTest, TheOverrideOfDrivenSurfacesIsNotSetToo) {
  const std::string name = core::kSurfaceOverride;
  sim_.set(name, 0.0F);
  overrides_.acquire(OverrideHolder::kSurfaces, name);
  const auto written = settings_.setDataref(name, {1.0F}, kWho);
  EXPECT_EQ(written.result.code, ResultCode::kRefused);
  EXPECT_EQ(written.result.text,
            name +
                " is what tx_node drives the surfaces by: clear their failures, and end control/surfaces and "
                "excitations of surfaces, and set it then: until it is given back, tx_node has it set already");
  overrides_.release(OverrideHolder::kSurfaces, name);
  EXPECT_EQ(sim_.value(name), 0.0F) << "the surfaces are X-Plane's again";
  EXPECT_EQ(settings_.setDataref(name, {1.0F}, kWho).result.code, ResultCode::kOk);
}

TEST_F(SettingRequestsTest, ACommandWithoutANameIsRefusedWithWhatIsExpected) {
  for (const std::string& name : {std::string(), std::string(2000, 'a')}) {
    const RequestResult command = settings_.runCommand(name);
    EXPECT_EQ(command.code, ResultCode::kRefused);
    EXPECT_EQ(command.text, "name is \"" + name.substr(0, 80) +
                                "\": expected one of X-Plane's commands, e.g. sim/operation/pause_toggle");
  }
}

TEST_F(SettingRequestsTest, LargeNumbersAreComparedAsFloatsAre) {
  sim_.set(kQnh, 200000.02F);
  sim_.setReadOnly(kQnh);
  EXPECT_EQ(settings_.setDataref(kQnh, {200000.0F}, kWho).result.code, ResultCode::kOk);
  EXPECT_EQ(settings_.setDataref(kQnh, {200100.0F}, kWho).result.code, ResultCode::kTimeout);
}

// ------------------------------------------------------------------------------------------------- in lock-step

TEST_F(SettingRequestsTest, InLockstepTheOutcomeIsReportedAfterwards) {
  sim_.lockstep = true;
  const double began = sim_.time();
  const auto written = settings_.setDataref(kFirst, {0.25F, 0.75F}, kWho);
  EXPECT_EQ(written.result.code, ResultCode::kAccepted);
  EXPECT_EQ(sim_.time(), began) << "the caller may be awaited";
  EXPECT_TRUE(written.values.empty());
  EXPECT_TRUE(reports_.empty());
  sim_.frame();
  EXPECT_EQ(reports_, (Reports{{std::string("set_dataref ") + kFirst + ": X-Plane shows it", true}}));
}

TEST_F(SettingRequestsTest, InLockstepWhatIsNotShownIsReportedWithItsName) {
  sim_.lockstep = true;
  sim_.setReadOnly(kSecond);
  settings_.setDataref(kFirst, {0.25F, 0.75F}, kWho);
  sim_.run(kTimeout + 0.1);
  settings_.setDataref("sim/no/such", {0.0F}, kWho);
  sim_.run(kTimeout + 0.1);
  EXPECT_EQ(reports_,
            (Reports{{std::string("set_dataref ") + kFirst + ": X-Plane does not show it at " + kSecond, false},
                     {"set_dataref sim/no/such: X-Plane does not show it at sim/no/such", false}}));
}

}  // namespace
}  // namespace xplane_bridge
