#include "xplane_bridge/nodes/tx/command_intake.hpp"

#include <gtest/gtest.h>
#include <ros/time.h>

#include <algorithm>
#include <limits>
#include <string>

#include "actuation/actuation_rig.hpp"

namespace xplane_bridge {
namespace {

class CommandIntakeTest : public testing::Test, protected ActuationRig {
 protected:
  CommandIntakeTest() { ros::Time::init(); }  // of the log's "once a second"

  static ControlCommand roll(float value) {
    ControlCommand message;
    message.fields = ControlCommand::ROLL;
    message.roll = value;
    return message;
  }
  /// Messages that place another aircraft.
  std::size_t placements() const {
    const auto& sent = sim_.messages();
    return static_cast<std::size_t>(
        std::count_if(sent.begin(), sent.end(), [](const auto& message) { return message.label == "VEHS"; }));
  }

  CommandIntake intake_{actuation_.get()};
};

TEST_F(CommandIntakeTest, ACommandOfTheModeIsFlown) {
  intake_.onCommand(core::FlightMode::kManual, roll(0.25F));
  run(0.2);
  EXPECT_FLOAT_EQ(sim_.value(kRoll), 0.25F);
  intake_.onCommand(core::FlightMode::kAuto, roll(-0.5F));
  run(0.02);
  EXPECT_FLOAT_EQ(sim_.value(kRoll), 0.25F) << "the other source waits for its mode";
  EXPECT_EQ(actuation_->control().received[1].accepted, 1U);
}

TEST_F(CommandIntakeTest, ACommandThatIsNoNumberIsCountedAndNotFlown) {
  const auto due = intake_.onCommand(core::FlightMode::kManual, roll(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_FALSE(due.has_value());
  run(0.2);
  EXPECT_FLOAT_EQ(sim_.value(kRoll), 0.0F);
  EXPECT_EQ(actuation_->control().received[0].accepted, 0U);
  EXPECT_EQ(actuation_->control().received[0].refusedTotal(), 1U);
}

TEST_F(CommandIntakeTest, AModeRequestIsOfItsRequesterAndTakenOnce) {
  ModeRequest request;
  request.sequence = 4;
  request.mode = ModeRequest::AUTO;
  request.requester = "joystick";
  intake_.onModeRequest(request);
  EXPECT_EQ(actuation_->path().mode().mode, core::FlightMode::kAuto);
  EXPECT_EQ(eventsOf(core::EventKind::kMode).back().who, "joystick");
  request.mode = ModeRequest::MANUAL;
  intake_.onModeRequest(request);
  EXPECT_EQ(actuation_->path().mode().mode, core::FlightMode::kAuto) << "this number was seen already";
}

TEST_F(CommandIntakeTest, AListOfTrafficWithAWrongElementIsRefusedWhole) {
  TrafficCommand list;
  list.number = {1, 2};
  list.latitude = {47.5, 47.6};
  list.longitude = {8.0};  // one is missing
  sim_.clearMessages();
  intake_.onTraffic(list, 0.0);
  run(0.2);
  EXPECT_EQ(placements(), 0U);
}

}  // namespace
}  // namespace xplane_bridge
