#include "xplane_bridge/nodes/tx/tx_services.hpp"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "actuation/actuation_rig.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"

namespace xplane_bridge {
namespace {

class TxServicesTest : public testing::Test, protected ActuationRig {
 protected:
  template <class Service>
  typename Service::Response call(const typename Service::Request& request) {
    typename Service::Response response;
    services_.serve(request, &response, "tx_node/the_service");
    return response;
  }
  static SetWind::Request wind() {
    SetWind::Request request;
    request.speed = 5.0F;
    request.from_deg = 270.0F;
    return request;
  }
  /// X-Plane has the datarefs of its wind.
  void showWind() {
    for (const core::DatarefWrite& each : core::windWrites({3.0, 90.0, 0.2}, sim_.status().version)) {
      sim_.set(each.dataref, each.value);
    }
    sim_.setAll(core::shownWindDatarefs(sim_.status().version), 3.0F);
  }

  EventLog log_;
  TxServices services_{actuation_.get(), &log_, [] { return ros::Time(1000.0); }};
};

TEST_F(TxServicesTest, AModeIsAskedForAndAnswered) {
  SetMode::Request request;
  request.mode = SetMode::Request::AUTO;
  const SetMode::Response response = call<SetMode>(request);
  EXPECT_TRUE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::OK);
  EXPECT_EQ(response.mode, SetMode::Request::AUTO);
  EXPECT_EQ(modes_.back().mode, core::FlightMode::kAuto);
  EXPECT_EQ(eventsOf(core::EventKind::kMode).back().who, "tx_node/the_service");
}

TEST_F(TxServicesTest, AModeThatIsNoneIsRefusedInWords) {
  SetMode::Request request;
  request.mode = 7;
  const SetMode::Response response = call<SetMode>(request);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::REFUSED);
  EXPECT_EQ(response.mode, SetMode::Request::MANUAL);
  EXPECT_NE(response.result.message, "");
}

TEST_F(TxServicesTest, ADatarefIsAnsweredAsXPlaneShowsIt) {
  SetDataref::Request request;
  request.name = kRoll;
  request.values = {0.5F};
  SetDataref::Response response = call<SetDataref>(request);
  EXPECT_TRUE(response.success);
  EXPECT_EQ(response.values, std::vector<float>{0.5F});
  sim_.setReadOnly(kRoll);
  request.values = {0.9F};
  response = call<SetDataref>(request);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::TIMEOUT);
  EXPECT_EQ(response.values, std::vector<float>{0.5F});
}

TEST_F(TxServicesTest, APauseThatDoesNotComeIsSaid) {
  std_srvs::SetBool::Request request;
  request.data = 1;
  const std_srvs::SetBool::Response response = call<std_srvs::SetBool>(request);
  EXPECT_EQ(response.success, 0);
  EXPECT_EQ(response.message, "X-Plane did not follow in time");
}

TEST_F(TxServicesTest, WhatIsWrongWithARequestIsSaidAndNoEventIsPromised) {
  const SetWind::Response response = call<SetWind>(SetWind::Request());
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::REFUSED);
  EXPECT_NE(response.result.message, "");
  EXPECT_EQ(response.event_number, 0U);
  EXPECT_EQ(log_.reserve(), 1U);
}

TEST_F(TxServicesTest, WithoutALinkNoEventIsPromised) {
  sim_.setState(core::LinkState::kLost);
  const SetWind::Response response = call<SetWind>(wind());
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::NO_LINK);
  EXPECT_EQ(log_.reserve(), 1U);
}

TEST_F(TxServicesTest, ADisturbanceKeepsTheWindButNotTheClock) {
  showWind();
  SetDisturbance::Request turbulence;
  turbulence.kind = "turbulence";
  turbulence.speed = 5.0F;
  turbulence.from_deg = 270.0F;
  turbulence.horizontal_only = 1;
  const SetDisturbance::Response disturbed = call<SetDisturbance>(turbulence);
  ASSERT_EQ(disturbed.result.code, ServiceResult::ACCEPTED) << disturbed.result.message;
  EXPECT_EQ(disturbed.id, 1U);
  const SetWind::Response refused = call<SetWind>(wind());
  EXPECT_EQ(refused.result.code, ServiceResult::REFUSED);
  EXPECT_NE(refused.result.message.find("disturbance"), std::string::npos) << refused.result.message;
  SetTime::Request noon;
  noon.fields = SetTime::Request::ZULU_TIME;
  noon.zulu_time = 43200.0;
  EXPECT_EQ(call<SetTime>(noon).result.code, ServiceResult::ACCEPTED);
  actuation_->stop();
}

TEST_F(TxServicesTest, TheOutcomeHasThePromisedNumberAndWhoAsked) {
  log_.reserve();  // an event of before
  Situation::Request request;
  request.path = "Output/situations/here.sit";
  Situation::Response response;
  services_.saveSituation(request, &response, "tx_node/save_state");
  EXPECT_TRUE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::ACCEPTED);
  EXPECT_EQ(response.event_number, 2U);
  EXPECT_EQ(response.result.message, "event 2 will report the outcome");
  while (actuation_->jobs().busy()) std::this_thread::yield();
  actuation_->stop();
  ASSERT_FALSE(events_.empty());
  EXPECT_EQ(events_.back().number, 2U);
  EXPECT_EQ(events_.back().who, "tx_node/save_state");
}

}  // namespace
}  // namespace xplane_bridge
