// Flight states of datarefs that are asked for at less than the frame rate.

#include <gtest/gtest.h>

#include "hand_set_frames.hpp"

namespace xplane_bridge::core {
namespace {

TEST(FlightRate, ADatarefThatAnswersInAnotherFrameOfThePeriodHoldsUpNoState) {
  FlightStateAssembler::Options options = Hand::withVersion();
  options.rate = 20;
  FlightStateAssembler assembler(options);
  const std::size_t count = assembler.requests().size();
  const RecordedFlight flight(11);
  int states = 0;
  for (int period = 0; period < 40; ++period) {
    const std::int64_t now = kStart + period * 3 * kFrame;
    for (const bool late : {false, true}) {
      Datagram d = Datagram::labelled("RREF,");
      for (std::size_t i = late ? count - 1 : 0; i < (late ? count : count - 1); ++i) {
        const std::string& path = assembler.requests()[i].path;
        const bool time = path == "sim/time/total_running_time_sec";
        const float value = flight.answers(path) ? flight.value(0, path) : 0.0F;
        d.pair(static_cast<std::int32_t>(i), time ? 1000.0F + 0.05F * static_cast<float>(period) : value);
      }
      const FlightState* state = assembler.onRref(d.rref(), now + (late ? kFrame : 0));
      states += state != nullptr ? 1 : 0;
      EXPECT_EQ(state != nullptr, late) << period;
    }
  }
  EXPECT_EQ(states, 40);
  EXPECT_EQ(assembler.frames().counters().incomplete, 0U);
}

TEST(FlightRate, AtTheFrameRatePiecesOfTwoFramesAreNotJoined) {
  Hand hand;
  const std::size_t count = hand.assembler.requests().size();
  EXPECT_NE(hand.send(), nullptr);
  EXPECT_EQ(hand.send(1.0 / 60.0, count - 1), nullptr) << "its other piece is lost";
  Datagram d = Datagram::labelled("RREF,");
  d.pair(static_cast<std::int32_t>(count - 1), 1.0F);
  EXPECT_EQ(hand.assembler.onRref(d.rref(), hand.now + kFrame), nullptr) << "of the next frame";
}

}  // namespace
}  // namespace xplane_bridge::core
