#include <gtest/gtest.h>

#include "xplane_bridge/actuation/lockstep_barrier.hpp"

namespace xplane_bridge {
namespace {

using Names = std::vector<std::string>;

constexpr std::int64_t kT1 = 1000, kT2 = 2000;

class LockstepBarrierTest : public testing::Test {
 protected:
  void SetUp() override { barrier_.open(1, kT1); }

  LockstepBarrier barrier_{{"controller", "/other/player"}, "rx_node", "capture_node"};
};

TEST_F(LockstepBarrierTest, WaitsForAllParticipantsAndNamesThoseMissing) {
  EXPECT_EQ(barrier_.missing(), (Names{"rx_node", "controller", "/other/player"}));
  barrier_.answer("/xplane/rx_node", kT1);
  barrier_.answer("/xplane/controller", kT1);
  EXPECT_FALSE(barrier_.complete());
  EXPECT_EQ(barrier_.missing(), Names{"/other/player"});
  barrier_.answer("/other/player", kT1);
  EXPECT_TRUE(barrier_.complete());
}

TEST_F(LockstepBarrierTest, IsAnsweredWhenAllHaveAnsweredWhetherItIsHeldOrNot) {
  barrier_.step(0);
  for (const char* who : {"/xplane/rx_node", "/xplane/controller"}) barrier_.answer(who, kT1);
  EXPECT_FALSE(barrier_.answered());
  barrier_.answer("/other/player", kT1);
  EXPECT_TRUE(barrier_.answered());
  EXPECT_TRUE(barrier_.holds());
  barrier_.run();
  EXPECT_TRUE(barrier_.answered());
  barrier_.close();
  EXPECT_FALSE(barrier_.answered());
}

TEST_F(LockstepBarrierTest, TakesAFullNameAsItIsAndAShortOneInAnyNamespace) {
  for (const char* who : {"/xplane/rx_node", "/my_controller", "/player", "/another/other/player", "/controller/x"}) {
    barrier_.answer(who, kT1);
  }
  EXPECT_EQ(barrier_.missing(), (Names{"controller", "/other/player"}));
  barrier_.answer("/controller", kT1);
  EXPECT_EQ(barrier_.missing(), Names{"/other/player"});
}

TEST_F(LockstepBarrierTest, AnAnswerToAFrameThatIsGoneCountsForNone) {
  barrier_.close();
  barrier_.open(2, kT2);
  barrier_.answer("/controller", kT1);
  EXPECT_EQ(barrier_.missing().size(), 3U);
}

TEST_F(LockstepBarrierTest, AnAnswerThatIsEarlyCountsOnceItsFrameIsHere) {
  barrier_.answer("/controller", kT2);
  EXPECT_EQ(barrier_.missing().size(), 3U);
  barrier_.close();
  barrier_.open(2, kT2);
  EXPECT_EQ(barrier_.missing(), (Names{"rx_node", "/other/player"}));
}

TEST_F(LockstepBarrierTest, InAPauseAnAnswerBelongsToTheFrameThatIsOpenWhenItComes) {
  const auto answer_all = [this] {
    for (const char* who : {"/rx_node", "/controller", "/other/player"}) barrier_.answer(who, kT1);
  };
  answer_all();
  EXPECT_TRUE(barrier_.complete());
  barrier_.close();
  barrier_.open(2, kT1);
  EXPECT_FALSE(barrier_.complete());
  answer_all();
  EXPECT_TRUE(barrier_.complete());
  barrier_.close();
  barrier_.answer("/controller", kT1);  // between two frames: of the next
  barrier_.open(3, kT1);
  EXPECT_EQ(barrier_.missing(), (Names{"rx_node", "/other/player"}));
}

TEST_F(LockstepBarrierTest, NoParticipantIsAwaitedInAFrameThatHasNothingToAnswer) {
  barrier_.answerForAll("/xplane/rx_node", kT1);
  EXPECT_TRUE(barrier_.complete());
  barrier_.close();
  barrier_.open(2, kT2);
  barrier_.answer("/xplane/rx_node", kT2);
  EXPECT_FALSE(barrier_.complete());
}

TEST_F(LockstepBarrierTest, Frame0IsTheReadersAlone) {
  barrier_.open(0, 0);
  EXPECT_FALSE(barrier_.complete());
  barrier_.answerFrame0("/xplane/controller");
  EXPECT_FALSE(barrier_.complete());
  barrier_.answerFrame0("/xplane/rx_node");
  EXPECT_TRUE(barrier_.complete());
}

TEST(LockstepBarrierCameras, Frame0WaitsForThoseThatReadTheSimulatorToo) {
  LockstepBarrier barrier({"controller", "/a/capture_node", "/a/b/capture_node"}, "rx_node", "capture_node");
  barrier.open(0, 0);
  barrier.answerFrame0("/a/rx_node");
  EXPECT_EQ(barrier.missing(), (Names{"/a/capture_node", "/a/b/capture_node"}));
  for (const char* who : {"/a/capture_node", "/a/my_capture_node", "/b/capture_node"}) barrier.answerFrame0(who);
  EXPECT_EQ(barrier.missing(), Names{"/a/b/capture_node"});
  EXPECT_FALSE(barrier.complete());
  barrier.answerFrame0("/a/b/capture_node");
  EXPECT_TRUE(barrier.complete());

  LockstepBarrier one({"capture_node"}, "rx_node", "capture_node");
  one.open(0, 0);
  one.answerFrame0("/a/rx_node");
  EXPECT_EQ(one.missing(), Names{"capture_node"});
}

TEST_F(LockstepBarrierTest, AnAnswerWithFrame0sStampIsOfTheFirstFrameThatFlies) {
  barrier_.open(0, 0);
  barrier_.answerFrame0("/xplane/rx_node");
  for (const char* who : {"/rx_node", "/controller"}) barrier_.answer(who, 0);  // the network is faster to tx_node
  barrier_.open(1, 0);
  EXPECT_EQ(barrier_.missing(), Names{"/other/player"});
  barrier_.answerFrame0("/xplane/rx_node");
  EXPECT_FALSE(barrier_.complete());
  barrier_.answer("/other/player", 0);
  EXPECT_TRUE(barrier_.complete());
}

TEST_F(LockstepBarrierTest, Frame0sAnswerIsOfNoOtherFrame) {
  barrier_.answerFrame0("/xplane/rx_node");
  EXPECT_EQ(barrier_.missing(), (Names{"rx_node", "controller", "/other/player"}));
}

TEST(LockstepBarrierSteps, FliesAsManyFramesAsAreGrantedAndHoldsWithTheLastOneAnswered) {
  LockstepBarrier barrier({}, "rx_node", "capture_node");
  barrier.step(0);
  barrier.open(0, 0);
  barrier.answerFrame0("/rx_node");
  EXPECT_FALSE(barrier.complete());
  EXPECT_TRUE(barrier.holds());
  barrier.step(3);
  int flown = 0;
  std::int64_t stamp = 0;
  while (barrier.complete()) {
    barrier.close();
    barrier.open(static_cast<std::uint32_t>(++flown), ++stamp);
    EXPECT_FALSE(barrier.holds()) << "not answered yet";
    barrier.answer("/rx_node", stamp);
  }
  EXPECT_EQ(flown, 3);
  EXPECT_TRUE(barrier.holds());
  barrier.run();
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(barrier.complete());
    barrier.close();
    barrier.open(static_cast<std::uint32_t>(++flown), ++stamp);
    barrier.answer("/rx_node", stamp);
  }
}

TEST_F(LockstepBarrierTest, BetweenTwoFramesItIsNeitherCompleteNorHeld) {
  for (const char* who : {"/rx_node", "/controller", "/other/player"}) barrier_.answer(who, kT1);
  EXPECT_TRUE(barrier_.complete());
  EXPECT_FALSE(barrier_.holds()) << "it may go on";
  barrier_.close();
  EXPECT_FALSE(barrier_.complete());
  barrier_.step(0);
  EXPECT_FALSE(barrier_.holds());
}

TEST_F(LockstepBarrierTest, AFrameThatEndsWithNoneGrantedGrantsNone) {
  barrier_.step(0);
  barrier_.close();
  barrier_.open(2, kT2);
  for (const char* who : {"/rx_node", "/controller", "/other/player"}) barrier_.answer(who, kT2);
  EXPECT_FALSE(barrier_.complete());
  EXPECT_TRUE(barrier_.holds());
}

TEST(LockstepBarrierOrder, RanksParticipantsAsNamed) {
  const LockstepBarrier barrier({"b", "a"}, "rx_node", "capture_node");
  EXPECT_LT(barrier.rank("/x/rx_node"), barrier.rank("/x/b"));
  EXPECT_LT(barrier.rank("/x/b"), barrier.rank("/x/a"));
  EXPECT_LT(barrier.rank("/x/a"), barrier.rank("/x/stranger"));
}

}  // namespace
}  // namespace xplane_bridge
