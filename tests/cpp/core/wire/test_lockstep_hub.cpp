// LockstepHub over a list of datagrams: what is handed out when, whatever order the datagrams come in.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scripted_hub.hpp"
#include "xplane_bridge/core/wire/lockstep_hub.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {
namespace {

constexpr Endpoint kXPlane{0x7F000001U, 49000};
constexpr std::int32_t kFence = 0x4C530000;

class LockstepHubTest : public testing::Test {
 protected:
  void SetUp() override {
    auto inner = std::make_unique<ScriptedHub>(wire_);
    LockstepHooks hooks;
    hooks.begin = [this](const LockstepFrame& frame) {
      said_ += " begin" + std::to_string(frame.number);
      pictures_.push_back(frame.picture);
    };
    hooks.ready = [this](const LockstepFrame&) { return ready_; };
    hooks.close = [this](const LockstepFrame& frame) {
      if (frame.number > 0) said_ += " close" + std::to_string(frame.number);
    };
    hooks.end = [this](const LockstepFrame& frame) {
      if (frame.number > 0) said_ += " end" + std::to_string(frame.number);
    };
    hub_ = std::make_unique<LockstepHub>(std::move(inner), clock_, wire_->clock(), hooks);
    a_ = hub_->open("a", port(7001));
    b_ = hub_->open("b", port(7002));
    ask(a_.get());
    ask(b_.get());
  }

  static UdpSocketOptions port(std::uint16_t number) {
    UdpSocketOptions options;
    options.bind_port = number;
    return options;
  }
  static void ask(DatagramSource* source) {
    std::array<std::uint8_t, kRrefRequestSize> message;
    const EncodeResult size = encodeRref(message, "sim/time/paused", 20, 0);
    source->sendTo({message.data(), *size}, kXPlane, nullptr);
  }

  void arrive(const std::string& source, const Pairs& pairs) {
    wire_->arrivals.push_back({wire_->now_ns, source, rref(pairs), kXPlane, 12345});
  }
  void value(const std::string& source, float value) { arrive(source, {{0, value}}); }
  void fence(const std::string& source, float frame, float seconds = 0.0F, float microseconds = 0.0F,
             float picture = 0.0F) {
    arrive(source, {{kFence, frame}, {kFence + 1, seconds}, {kFence + 2, microseconds}, {kFence + 3, picture}});
  }
  /// Of a simulator that sends it to so many sockets, behind a value.
  void countedFence(const std::string& source, float frame, float sockets) {
    arrive(source, {{0, frame},
                    {kFence, frame},
                    {kFence + 1, 0.0F},
                    {kFence + 2, 0.0F},
                    {kFence + 3, 0.0F},
                    {kFence + 8, sockets}});
  }

  /// Requests for fences ("+") and their ends ("-"): by which source, and of what.
  std::vector<std::string> fencesAskedFor() const {
    std::vector<std::string> asked;
    for (const auto& sent : wire_->sent) {
      const std::string text(sent.bytes.begin(), sent.bytes.end());
      const auto at = text.find(kFenceDataref);
      if (at == std::string::npos) continue;
      std::int32_t rate = 0;
      std::memcpy(&rate, sent.bytes.data() + 5, sizeof rate);
      asked.push_back((rate > 0 ? "+" : "-") + sent.source + " " + text.substr(at, text.find(']', at) + 1 - at));
    }
    return asked;
  }

  /// As SimLink's step: waits, then takes what there is, of a first.
  void step() {
    hub_->wait(1);
    for (const auto& [name, source] : {std::pair{"a", a_.get()}, std::pair{"b", b_.get()}}) {
      std::array<std::uint8_t, 100> buffer;
      Received received;
      while (hub_->hasInput(*source) &&
             source->receive({buffer.data(), buffer.size()}, &received) == ReceiveStatus::kReceived) {
        const auto rref = decodeRref({buffer.data(), received.size});
        EXPECT_EQ(received.kernel_stamp_ns, 0);
        said_ += std::string(" ") + name + std::to_string(static_cast<int>((*rref)[0].value));
      }
    }
  }
  std::string steps(int count) {
    said_.clear();
    for (int i = 0; i < count; ++i) step();
    return said_;
  }
  void takeOff() {
    fence("a", 0.0F);
    fence("b", 0.0F);
    steps(3);
    value("a", 1.0F);
    fence("a", 1.0F);
    value("b", 1.0F);
    fence("b", 1.0F);
    steps(8);
  }

  std::shared_ptr<ScriptedHub::Wire> wire_ = std::make_shared<ScriptedHub::Wire>();
  LockstepClock clock_{wire_->clock(), 0};
  bool ready_ = true;
  std::string said_;
  std::vector<std::uint32_t> pictures_;  // of the frames begun
  std::unique_ptr<LockstepHub> hub_;
  std::shared_ptr<DatagramSource> a_, b_;
};

TEST_F(LockstepHubTest, AsksForTheFenceOnEverySourceThatAsksForSomething) {
  std::vector<std::string> expected;
  for (const std::string source : {"+a ", "+b "}) {
    for (const char* element : {"[0]", "[1]", "[2]", "[3]"}) expected.push_back(source + kFenceDataref + element);
    expected.push_back(source + kFenceGroupDataref + "[7001]");  // the port of the one that asked first
  }
  EXPECT_EQ(fencesAskedFor(), expected);
}

TEST_F(LockstepHubTest, LeavesTheGroupBeforeItEndsItsFence) {
  wire_->sent.clear();
  hub_->ignore(*b_);
  std::vector<std::string> expected = {std::string("-b ") + kFenceGroupDataref + "[7001]"};
  for (const char* element : {"[0]", "[1]", "[2]", "[3]"})
    expected.push_back(std::string("-b ") + kFenceDataref + element);
  EXPECT_EQ(fencesAskedFor(), expected);
}

TEST_F(LockstepHubTest, AnotherGetsEveryFenceBeforeTheOneThatDidEnds) {
  wire_->sent.clear();
  hub_->ignore(*a_);
  std::vector<std::string> expected;
  for (const char* element : {"[0]", "[1]", "[2]", "[3]"})
    expected.push_back(std::string("+b ") + kFenceDataref + element);
  expected.push_back(std::string("+b ") + kFenceGroupDataref + "[7002]");
  expected.push_back(std::string("-a ") + kFenceGroupDataref + "[7001]");
  for (const char* element : {"[0]", "[1]", "[2]", "[3]"})
    expected.push_back(std::string("-a ") + kFenceDataref + element);
  EXPECT_EQ(fencesAskedFor(), expected);
}

TEST_F(LockstepHubTest, HandsOutFrame0AsItComesAndNoFences) {
  value("a", 7.0F);
  EXPECT_EQ(steps(2), " a7");
  fence("a", 0.0F);
  value("a", 8.0F);
  EXPECT_EQ(steps(2), "") << "its fence has not come";
  fence("a", 0.0F);
  EXPECT_EQ(steps(4), " a8");
}

TEST_F(LockstepHubTest, HandsOutAFrameWhenAllSourcesShowItsFenceAndGoesThroughItsStages) {
  takeOff();
  EXPECT_EQ(said_, " begin1 a1 b1 close1 end1");
  value("b", 2.0F);
  fence("b", 2.0F);
  value("a", 2.0F);
  EXPECT_EQ(steps(3), "");
  fence("a", 2.0F, 3.0F, 500000.0F);
  EXPECT_EQ(steps(1), " begin2 a2 b2");
  EXPECT_EQ(clock_.clock().system_ns(), 3'500'000'000);
  EXPECT_EQ(steps(6), " close2 end2");
}

TEST_F(LockstepHubTest, SaysWhichFrameIsOnDisplay) {
  takeOff();
  fence("a", 2.0F, 0.0F, 0.0F, 2.0F);
  fence("b", 2.0F, 0.0F, 0.0F, 2.0F);
  steps(3);
  fence("a", 3.0F, 0.0F, 0.0F, 2.0F);
  fence("b", 3.0F, 0.0F, 0.0F, 2.0F);
  steps(3);
  EXPECT_EQ(pictures_, (std::vector<std::uint32_t>{0, 2, 2}));
}

TEST_F(LockstepHubTest, WaitsForTheSourceWhoseFenceCameLast) {
  takeOff();
  fence("a", 2.0F);
  steps(2);  // the one that comes first shows that the other is the last
  fence("b", 2.0F);
  steps(6);
  wire_->awaited.clear();
  for (const float frame : {3.0F, 4.0F}) {
    fence("a", frame);
    fence("b", frame);
    steps(6);
  }
  ASSERT_FALSE(wire_->awaited.empty());
  for (const std::string& source : wire_->awaited) EXPECT_EQ(source, "b");
}

TEST_F(LockstepHubTest, ListensForTheSourceWhoseFenceIsMissingAndBeforeTheFlightForAny) {
  EXPECT_EQ(hub_->fd(), ScriptedHub::kFd);
  EXPECT_EQ(wire_->listened_to, "any");
  takeOff();
  fence("a", 2.0F);
  steps(1);
  EXPECT_EQ(wire_->listened_to, "b");
  fence("b", 2.0F);
  steps(6);
  countedFence("b", 3.0F, 2.0F);
  steps(1);
  EXPECT_EQ(wire_->listened_to, "a") << "it gets every fence, as the last";
  hub_->ignore(*a_);
  EXPECT_EQ(wire_->listened_to, "any") << "nothing comes to it any more";
}

TEST_F(LockstepHubTest, ListensForAnyAgainOnceTheClockIsReleasedOrTheSourceIsClosed) {
  takeOff();
  auto c = hub_->open("c", port(7003));
  ask(c.get());
  fence("a", 2.0F);
  fence("b", 2.0F);
  steps(1);
  ASSERT_EQ(wire_->listened_to, "c");
  c.reset();
  wire_->arrivals.clear();
  steps(1);
  EXPECT_NE(wire_->listened_to, "c");
  steps(6);
  fence("a", 3.0F);
  steps(1);
  ASSERT_EQ(wire_->listened_to, "b");
  clock_.release();
  steps(1);
  EXPECT_EQ(wire_->listened_to, "any");
}

TEST_F(LockstepHubTest, LeavesTheNextFrameOfASourceWhereItIs) {
  takeOff();
  for (const float frame : {2.0F, 3.0F}) {
    for (const char* source : {"a", "b"}) {
      value(source, frame);
      fence(source, frame);
    }
  }
  EXPECT_EQ(steps(4), " begin2 a2 b2 close2 end2") << "the answer is sent before the next frame is looked for";
  EXPECT_EQ(steps(2), " begin3 a3 b3 close3");
}

TEST_F(LockstepHubTest, GoesOnAtOnceWithAFrameThatIsThereBeforeTheAnswer) {
  takeOff();
  ready_ = false;
  fence("a", 2.0F);
  fence("b", 2.0F);
  EXPECT_EQ(steps(1), " begin2");
  value("a", 3.0F);
  fence("a", 3.0F);
  fence("b", 3.0F);
  EXPECT_EQ(steps(2), "");
  ready_ = true;
  EXPECT_EQ(steps(1), " close2");
  EXPECT_EQ(steps(2), " end2 begin3 a3") << "nothing more comes that would wake who waits by the descriptor";
}

TEST_F(LockstepHubTest, IsBusyFromAFrameToItsAnswerAndFromThatToItsEnd) {
  EXPECT_FALSE(hub_->busy());
  fence("a", 0.0F);
  fence("b", 0.0F);
  steps(1);
  EXPECT_TRUE(hub_->busy()) << "the link sends what the answer to frame 0 is";
  steps(2);
  EXPECT_FALSE(hub_->busy()) << "frame 0 is answered again in its own time";
  value("a", 1.0F);
  fence("a", 1.0F);
  fence("b", 1.0F);
  ready_ = false;
  for (int i = 0; i < 10 && said_ != " begin1 a1"; ++i) steps(1);
  EXPECT_TRUE(hub_->busy()) << "the link has what the frame has brought";
  steps(1);
  EXPECT_FALSE(hub_->busy()) << "the answers of others are missing";
  ready_ = true;
  EXPECT_EQ(steps(1), " close1");
  EXPECT_TRUE(hub_->busy());
  EXPECT_EQ(steps(2), " end1");
  EXPECT_FALSE(hub_->busy());
}

TEST_F(LockstepHubTest, WaitsForAsManySourcesAsTheFenceSaysAndForTheFirstOfThem) {
  takeOff();
  countedFence("a", 2.0F, 1.0F);
  EXPECT_EQ(steps(1), " begin2 a2") << "b gets nothing in this frame";
  EXPECT_EQ(steps(6), " close2 end2");
  wire_->awaited.clear();
  countedFence("b", 3.0F, 2.0F);
  EXPECT_EQ(steps(3), "");
  countedFence("a", 3.0F, 2.0F);
  EXPECT_EQ(steps(1), " begin3 a3 b3");
  ASSERT_FALSE(wire_->awaited.empty());
  for (const std::string& source : wire_->awaited) EXPECT_EQ(source, "a");
}

TEST_F(LockstepHubTest, WhatHasAFenceAndIsNotOfTheGroupStandsForNothingOfTheGroup) {
  takeOff();
  countedFence("a", 2.0F, 2.0F);
  const auto c = hub_->open("c", port(7003));
  fence("c", 2.0F);
  EXPECT_EQ(steps(3), "");
  countedFence("b", 2.0F, 2.0F);
  EXPECT_EQ(steps(1), " begin2 a2 b2");
}

TEST_F(LockstepHubTest, AnotherProgramsFenceIsData) {
  takeOff();
  countedFence("a", 2.0F, 1.0F);
  wire_->arrivals.back().from.port = 49001;
  EXPECT_EQ(steps(3), "");
  countedFence("a", 2.0F, 1.0F);
  EXPECT_EQ(steps(1), " begin2 a2 a2") << "the link looks at where they come from";
}

TEST_F(LockstepHubTest, APartOfAFenceIsNeitherAFenceNorData) {
  takeOff();
  const auto c = hub_->open("c", port(7003));
  ask(c.get());
  arrive("c", {{0, 9.0F}, {kFence + 2, 0.0F}, {kFence + 3, 0.0F}});
  countedFence("a", 2.0F, 1.0F);
  EXPECT_EQ(steps(6), " begin2 a2 close2 end2");
  EXPECT_FALSE(hub_->hasInput(*c)) << "what no fence stands behind belongs to no frame";
  countedFence("c", 3.0F, 2.0F);
  countedFence("a", 3.0F, 2.0F);
  steps(1);
  std::array<std::uint8_t, 100> buffer{};
  Received received;
  ASSERT_EQ(c->receive({buffer.data(), buffer.size()}, &received), ReceiveStatus::kReceived);
  EXPECT_EQ(decodeRref({buffer.data(), received.size})->size(), 1U);
  EXPECT_FALSE(hub_->hasInput(*c));
}

TEST_F(LockstepHubTest, ASourceThatIsIgnoredStillCountsInTheFramesThatAreUnderWay) {
  takeOff();
  hub_->ignore(*b_);
  countedFence("a", 2.0F, 2.0F);
  EXPECT_EQ(steps(2), "");
  countedFence("b", 2.0F, 2.0F);
  EXPECT_EQ(steps(1), " begin2 a2");
  EXPECT_EQ(steps(6), " close2 end2");
  for (const float frame : {3.0F, 4.0F}) {
    countedFence("a", frame, 1.0F);
    steps(6);
  }
  wire_->arrivals.clear();
  countedFence("b", 5.0F, 1.0F);
  EXPECT_EQ(steps(3), "") << "long after, it is not looked at any more";
}

TEST_F(LockstepHubTest, WaitsForTheAnswersAfterTheFrameWasHandled) {
  takeOff();
  ready_ = false;
  for (const char* source : {"a", "b"}) fence(source, 2.0F);
  EXPECT_EQ(steps(5), " begin2");
  ready_ = true;
  EXPECT_EQ(steps(1), " close2");
  EXPECT_EQ(steps(1), "") << "the link sends what close() has led to";
  EXPECT_EQ(steps(1), " end2");
}

TEST_F(LockstepHubTest, LeavesOutFrame0WhereItComesTogetherWithTheFirstFrame) {
  fence("a", 0.0F);
  fence("b", 0.0F);
  steps(3);
  value("a", 99.0F);
  fence("a", 0.0F);
  value("a", 1.0F);
  fence("a", 1.0F);
  fence("b", 1.0F);
  EXPECT_EQ(steps(1), " begin1 a1");
}

TEST_F(LockstepHubTest, ASourceThatIsNotWantedAnyMoreIsNotWaitedFor) {
  takeOff();
  hub_->ignore(*b_);
  fence("a", 2.0F);
  EXPECT_EQ(steps(1), " begin2");
}

TEST_F(LockstepHubTest, ASourceThatJoinsIsWaitedForInTheNextFrame) {
  takeOff();
  const auto c = hub_->open("c", {});
  ask(c.get());
  fence("a", 2.0F);
  fence("b", 2.0F);
  EXPECT_EQ(steps(3), "");
  fence("c", 2.0F);
  EXPECT_EQ(steps(1), " begin2");
}

TEST_F(LockstepHubTest, LetsTheSimulatorFlyOnOnceTheClockIsReleased) {
  takeOff();
  ready_ = false;
  for (const char* source : {"a", "b"}) fence(source, 2.0F);
  steps(3);
  clock_.release();
  EXPECT_EQ(steps(1), " end2");
  value("a", 3.0F);
  for (const char* source : {"a", "b"}) fence(source, 3.0F);
  EXPECT_EQ(steps(2), " a3 end3");
}

}  // namespace
}  // namespace xplane_bridge::core
