// The first flight state of a simulator whose time stands, as before the first frame of lock-step.

#include <gtest/gtest.h>

#include "hand_set_frames.hpp"

namespace xplane_bridge::core {
namespace {

TEST(FirstState, WhatWasTakenWhileDatarefsWereStillAskedForIsTakenAnew) {
  FlightStateAssembler::Options options = Hand::withVersion();
  options.clock.exact = true;
  Hand hand(options);
  constexpr std::size_t kAskedFirst = 17;
  const FlightState* state = nullptr;
  for (int i = 0; i < 5 && state == nullptr; ++i) state = hand.send(0.0, kAskedFirst);
  ASSERT_NE(state, nullptr) << "the others count as silent";
  EXPECT_TRUE(state->has(FlightState::kValidPosition));
  EXPECT_FALSE(state->has(FlightState::kValidAttitude));
  for (int i = 0; i < 5; ++i) EXPECT_EQ(hand.send(0.0), nullptr) << "its time is that of the last one";
  hand.assembler.restart();
  for (int i = 0; i < 3 && (state = hand.send(0.0)) == nullptr;) ++i;
  ASSERT_NE(state, nullptr);
  EXPECT_EQ(state->valid, FlightState::kValidAll);
}

}  // namespace
}  // namespace xplane_bridge::core
