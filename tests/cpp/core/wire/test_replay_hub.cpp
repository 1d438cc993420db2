#include "xplane_bridge/core/wire/replay_hub.hpp"

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace xplane_bridge::core {
namespace {

using Bytes = std::vector<std::uint8_t>;

class ReplayHubTest : public testing::Test, public WireTurn {
 protected:
  void add(WireKind kind, std::uint16_t source, const std::string& payload, std::int64_t time_ns = 0,
           std::uint32_t count = 0) {
    WireRecord record;
    record.kind = kind;
    record.source = source;
    record.wall_ns = time_ns + 1'000'000;
    record.steady_ns = time_ns;
    record.kernel_ns = kind == WireKind::kReceived ? time_ns + 900'000 : 0;
    record.peer = {kLoopbackAddress, static_cast<std::uint16_t>(kind == WireKind::kOpened ? 50000 + source : 49000)};
    record.count = count;
    record.payload = {reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()};
    appendRecord(record, &records_);
  }
  std::unique_ptr<ReplayHub> hub() {
    const std::string path =
        testing::TempDir() + "records_" + testing::UnitTest::GetInstance()->current_test_info()->name();
    std::ofstream out(path, std::ios::binary);
    out << kReplayMagic;
    out.write(reinterpret_cast<const char*>(records_.data()), static_cast<std::streamsize>(records_.size()));
    out.close();
    return std::make_unique<ReplayHub>(path, clock_, this, progress_,
                                       [this](LogLevel, const std::string& text) { said_.push_back(text); });
  }
  static bool send(DatagramSource* source, const std::string& text) {
    return source->sendTo(Bytes(text.begin(), text.end()), {kLoopbackAddress, 49000});
  }
  std::string receive(DatagramSource* source) {
    std::array<std::uint8_t, 64> buffer;
    if (source->receive(buffer, &received_) != ReceiveStatus::kReceived) return "";
    return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(received_.size)};
  }

  std::int64_t nextDue() override { return 0; }
  bool hasInput() override { return false; }
  bool takeInput(Bytes* /*input*/) override { return false; }
  void act(ByteView input) override {
    acted_.emplace_back(input.begin(), input.end());
    if (on_input_) on_input_();
  }
  void runDue() override { due_.push_back(clock_.steady()); }
  void woken() override {}
  void end() override { ended_ = true; }

  Bytes records_;
  WireClock clock_{Clock{[] { return std::int64_t{5}; }, [] { return std::int64_t{6}; }}};
  std::shared_ptr<ReplayProgress> progress_ = std::make_shared<ReplayProgress>();
  std::vector<std::string> said_;
  std::vector<std::string> acted_;
  std::vector<std::int64_t> due_;
  std::function<void()> on_input_;
  Received received_;
  bool ended_ = false;
};

TEST_F(ReplayHubTest, GivesDatagramsInTheirTurnWithTheirTimes) {
  add(WireKind::kWaited, 0, "", 100);
  add(WireKind::kOpened, 0, "a");
  add(WireKind::kOpened, 1, "b");
  add(WireKind::kWaited, 0, "", 200);
  add(WireKind::kReceived, 1, "first", 210, 4);
  add(WireKind::kReceived, 1, "second", 220, 4);
  add(WireKind::kWaited, 0, "", 300);
  add(WireKind::kReceived, 0, "third", 310);
  const auto replay = hub();
  EXPECT_EQ(clock_.steady(), 100);  // at the start as then
  const auto a = replay->open("a", {});
  const auto b = replay->open("b", {});
  EXPECT_EQ(b->localPort(), 50001);
  replay->wait(20);
  EXPECT_EQ(clock_.steady(), 200);
  EXPECT_FALSE(replay->hasInput(*a));
  ASSERT_TRUE(replay->hasInput(*b));
  EXPECT_EQ(receive(a.get()), "");
  EXPECT_EQ(receive(b.get()), "first");
  EXPECT_EQ(received_.kernel_stamp_ns, 900'210);
  EXPECT_EQ(clock_.wall(), 1'000'210);
  EXPECT_EQ(b->counters().dropped, 4U);
  EXPECT_EQ(receive(b.get()), "second");
  EXPECT_EQ(receive(b.get()), "");
  replay->wait(20);
  EXPECT_EQ(clock_.steady(), 300);
  EXPECT_FALSE(replay->hasInput(*b));
  EXPECT_EQ(receive(a.get()), "third");
  EXPECT_EQ(due_, (std::vector<std::int64_t>{200, 300}));
  EXPECT_FALSE(ended_);
  replay->wait(20);
  EXPECT_TRUE(ended_);
  EXPECT_EQ(clock_.steady(), 310 + 20'000'000);  // time goes on
}

TEST_F(ReplayHubTest, SourcesAreFoundByTheirNames) {
  add(WireKind::kWaited, 0, "", 1);
  add(WireKind::kOpened, 0, "flight");
  add(WireKind::kOpened, 1, "beacon");
  add(WireKind::kOpened, 2, "flight");
  const auto replay = hub();
  EXPECT_EQ(replay->open("beacon", {})->localPort(), 50001);
  EXPECT_EQ(replay->open("flight", {})->localPort(), 50000);
  EXPECT_EQ(replay->open("flight", {})->localPort(), 50002);
  UdpSocketOptions options;
  options.bind_port = 77;
  EXPECT_EQ(replay->open("more", options)->localPort(), 77);  // of another version of the node
}

TEST_F(ReplayHubTest, ASourceMoreThanRecordedHearsWhatTheNewestOfItsNameDoes) {
  add(WireKind::kWaited, 0, "", 1);
  add(WireKind::kOpened, 0, "engines");
  add(WireKind::kOpened, 1, "flight");
  add(WireKind::kWaited, 0, "", 2);
  add(WireKind::kReceived, 0, "first", 2);
  add(WireKind::kWaited, 0, "", 3);
  add(WireKind::kReceived, 0, "second", 3);
  add(WireKind::kReceived, 1, "state", 3);
  const auto replay = hub();
  auto engines = replay->open("engines", {});
  const auto flight = replay->open("flight", {});
  replay->wait(20);
  EXPECT_EQ(receive(engines.get()), "first");
  engines = replay->open("engines", {});  // a list of another length
  EXPECT_EQ(engines->localPort(), 50000);
  replay->wait(20);
  ASSERT_TRUE(replay->hasInput(*engines));
  EXPECT_EQ(receive(engines.get()), "second");
  EXPECT_EQ(receive(flight.get()), "state");
}

TEST_F(ReplayHubTest, DatagramsForASourceThatIsNotOpenHoldUpNothing) {
  add(WireKind::kWaited, 0, "", 1);
  add(WireKind::kOpened, 0, "a");
  add(WireKind::kOpened, 1, "traffic");
  add(WireKind::kOpened, 2, "late");
  add(WireKind::kWaited, 0, "", 2);
  add(WireKind::kReceived, 1, "other aircraft", 2);
  add(WireKind::kSent, 0, "request", 2);
  add(WireKind::kReceived, 2, "too early", 2);
  add(WireKind::kReceived, 0, "state", 3);
  add(WireKind::kReceived, 1, "other aircraft", 3);
  add(WireKind::kRefused, 0, "", 3, 7);
  add(WireKind::kWaited, 0, "", 4);
  add(WireKind::kReceived, 2, "in time", 4);
  const auto replay = hub();
  const auto a = replay->open("a", {});
  replay->wait(20);
  EXPECT_TRUE(send(a.get(), "request"));
  ASSERT_TRUE(replay->hasInput(*a));
  EXPECT_EQ(receive(a.get()), "state");
  EXPECT_EQ(a->counters().refused, 7U);
  EXPECT_EQ(progress_->sent_otherwise, 0U);
  const auto late = replay->open("late", {});
  replay->wait(20);
  EXPECT_EQ(receive(late.get()), "in time");
  EXPECT_EQ(progress_->datagrams, 2U);
}

TEST_F(ReplayHubTest, InputsComeBetweenDatagramsAndSendingsAreCompared) {
  add(WireKind::kWaited, 0, "", 1);
  add(WireKind::kOpened, 0, "a");
  add(WireKind::kWaited, 0, "", 2);
  add(WireKind::kInput, 0, "one", 2);
  add(WireKind::kSent, 0, "answer", 2);
  add(WireKind::kInput, 0, "two", 2);
  add(WireKind::kSent, 0, "refused", 2, 111);
  add(WireKind::kSent, 0, "never again", 2);
  add(WireKind::kWaited, 0, "", 3);
  const auto replay = hub();
  const auto a = replay->open("a", {});
  bool sent = false;
  on_input_ = [&] { sent = send(a.get(), acted_.size() == 1 ? "answer" : "refused"); };
  replay->wait(20);
  EXPECT_EQ(acted_, (std::vector<std::string>{"one", "two"}));
  EXPECT_FALSE(sent);  // as then
  EXPECT_EQ(progress_->sent_otherwise, 0U);
  replay->wait(20);
  EXPECT_EQ(progress_->sent_otherwise, 1U);
  EXPECT_TRUE(send(a.get(), "what was not recorded"));
  EXPECT_EQ(progress_->sent_otherwise, 2U);
  EXPECT_EQ(progress_->sent, 3U);
}

TEST_F(ReplayHubTest, ASourceWithoutMoreDatagramsLeavesWhatIsStillToBeSent) {
  add(WireKind::kWaited, 0, "", 1);
  add(WireKind::kOpened, 0, "a");
  add(WireKind::kOpened, 1, "b");
  add(WireKind::kWaited, 0, "", 2);
  add(WireKind::kReceived, 0, "question", 2);
  add(WireKind::kSent, 0, "answer", 2);
  add(WireKind::kReceived, 1, "other", 2);
  const auto replay = hub();
  const auto a = replay->open("a", {});
  const auto b = replay->open("b", {});
  replay->wait(20);
  EXPECT_EQ(receive(a.get()), "question");
  EXPECT_EQ(receive(a.get()), "");
  EXPECT_TRUE(send(a.get(), "answer"));
  EXPECT_EQ(receive(b.get()), "other");
  EXPECT_EQ(progress_->sent_otherwise, 0U);
}

TEST_F(ReplayHubTest, EndsAtAGap) {
  add(WireKind::kWaited, 0, "", 1);
  add(WireKind::kOpened, 0, "a");
  add(WireKind::kWaited, 0, "", 2);
  add(WireKind::kLost, 0, "", 2, 12);
  add(WireKind::kReceived, 0, "after", 3);
  const auto replay = hub();
  const auto a = replay->open("a", {});
  replay->wait(20);
  EXPECT_EQ(receive(a.get()), "");
  replay->wait(20);
  EXPECT_TRUE(ended_);
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_NE(said_[0].find("a gap of 12 records"), std::string::npos);
}

TEST_F(ReplayHubTest, PlaysACutFileToItsLastWholeRecord) {
  add(WireKind::kWaited, 0, "", 1);
  add(WireKind::kOpened, 0, "a");
  add(WireKind::kWaited, 0, "", 2);
  add(WireKind::kReceived, 0, "whole", 3);
  add(WireKind::kReceived, 0, "cut", 4);
  records_.resize(records_.size() - 2);
  const auto replay = hub();
  const auto a = replay->open("a", {});
  replay->wait(20);
  EXPECT_EQ(receive(a.get()), "whole");
  EXPECT_EQ(receive(a.get()), "");
}

TEST_F(ReplayHubTest, RefusesAnotherFile) {
  EXPECT_THROW(ReplayHub("/nowhere/records", clock_, this, progress_, nullptr), std::runtime_error);
}

}  // namespace
}  // namespace xplane_bridge::core
