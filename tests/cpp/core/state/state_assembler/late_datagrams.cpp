// Frames that overtake each other on the way.

#include <gtest/gtest.h>

#include "../hand_set_frames.hpp"

namespace xplane_bridge::core {
namespace {

// 250 m/s at 16x and 30 frames/s: a frame is 0.53 s of simulator time and 133 m, further than a jump.
TEST(LateDatagram, IsNoJumpHoweverFarBehindItsFrameLies) {
  constexpr double kStep = 16.0 / 30.0;
  constexpr double kSpeed = 250.0;  // [m/s]
  Hand hand;
  hand["sim/time/sim_speed"] = 16.0F;
  hand["sim/operation/misc/frame_rate_period"] = 1.0F / 30.0F;
  hand.setLocal("local_v", openglFromEnu({0.0, kSpeed, 0.0}));
  const GeoPoint begin{37.63, 126.55, 1500.0};
  const auto sendFrame = [&](int frame, double sim_step) {
    hand.place(TangentFrame(begin).geoPoint({0.0, kSpeed * kStep * frame, 0.0}));
    return hand.send(sim_step);
  };
  for (int frame = 0; frame < 10; ++frame) ASSERT_NE(sendFrame(frame, kStep), nullptr);
  ASSERT_NE(sendFrame(11, 2.0 * kStep), nullptr);
  EXPECT_EQ(sendFrame(10, -kStep), nullptr);
  const FlightState* const next = sendFrame(12, 2.0 * kStep);
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->epoch, 0U);
  EXPECT_EQ(hand.assembler.counters().jumps, 0U);
  EXPECT_EQ(hand.assembler.counters().out_of_order, 1U);
}

TEST(LateDatagram, IsNotOneThatIsFartherBackThanAnyArrives) {
  Hand hand;
  const FlightState before = *hand.send();
  hand.place({before.latitude + 0.05, before.longitude, before.altitude_msl});
  const FlightState* const state = hand.send(-1.5);
  ASSERT_NE(state, nullptr);
  EXPECT_EQ(state->epoch, before.epoch + 1);
  EXPECT_EQ(hand.assembler.counters().jumps, 1U);
}

}  // namespace
}  // namespace xplane_bridge::core
