#include "xplane_bridge/core/wire/dataref_reader.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kMs = kNanosecondsPerMillisecond;

class DatarefReaderTest : public testing::Test {
 protected:
  DatarefReader::Done keep() {
    return [this](const std::vector<DatarefValue>& values) { result_ = values; };
  }

  /// Ends what is over, then sends up to `allowance` requests.
  void update(std::int64_t now_ns, std::size_t allowance = 100) {
    reader_.update(now_ns);
    for (; allowance > 0; --allowance) {
      const std::optional<DatarefReader::Request> request = reader_.nextRequest(now_ns);
      if (!request.has_value()) {
        return;
      }
      sent_.push_back(*request);
    }
  }

  std::vector<DatarefReader::Request> sent_;
  std::optional<std::vector<DatarefValue>> result_;
  DatarefReader reader_{1000};
};

TEST_F(DatarefReaderTest, AsksAnswersAndStops) {
  reader_.start({"a", "b"}, 1'000 * kMs, keep());
  update(0);
  ASSERT_EQ(sent_.size(), 2U);
  EXPECT_EQ(sent_[0].path, "a");
  EXPECT_GT(sent_[0].rate_hz, 0);
  EXPECT_EQ(sent_[0].index, 1000);
  EXPECT_EQ(sent_[1].index, 1001);
  EXPECT_TRUE(reader_.answered({1001, 2.0F}, 10 * kMs));
  update(10 * kMs);
  EXPECT_FALSE(result_.has_value());
  EXPECT_TRUE(reader_.answered({1000, 1.0F}, 20 * kMs));
  update(20 * kMs);
  ASSERT_TRUE(result_.has_value());
  EXPECT_EQ((*result_)[0], 1.0F);
  EXPECT_EQ((*result_)[1], 2.0F);
  ASSERT_EQ(sent_.size(), 4U);
  EXPECT_EQ(sent_[2].rate_hz, 0);
  EXPECT_EQ(sent_[3].rate_hz, 0);
  EXPECT_TRUE(reader_.idle());
}

TEST_F(DatarefReaderTest, RepeatsWhatIsNotAnswered) {
  reader_.start({"a", "b"}, 1'000 * kMs, keep());
  update(0);
  reader_.answered({1000, 1.0F}, 10 * kMs);
  update(100 * kMs);
  EXPECT_EQ(sent_.size(), 2U);
  update(260 * kMs);
  ASSERT_EQ(sent_.size(), 3U);
  EXPECT_EQ(sent_[2].path, "b");
  EXPECT_EQ(sent_[2].index, 1001);
}

TEST_F(DatarefReaderTest, RepeatsCountFromWhenARequestIsSent) {
  reader_.start({"a", "b", "c", "d"}, 2'000 * kMs, keep());
  for (int k = 0; k < 20; ++k) {
    update(k * 100 * kMs, 1);  // one request in 100 ms
  }
  ASSERT_EQ(sent_.size(), 20U);
  for (std::size_t k = 0; k < sent_.size(); ++k) {
    EXPECT_EQ(sent_[k].index, 1000 + static_cast<std::int32_t>(k % 4)) << k;
  }
}

TEST_F(DatarefReaderTest, WhatIsOverLeavesTheNextReadItsTurn) {
  reader_.start(std::vector<std::string>(50, "a"), 500 * kMs, keep());
  update(0, 10);
  update(500 * kMs, 0);
  ASSERT_TRUE(result_.has_value());
  reader_.start({"b"}, 1'000 * kMs, keep());
  update(510 * kMs, 10);
  ASSERT_EQ(sent_.size(), 20U);
  EXPECT_EQ(sent_[10].path, "b") << "before the ends of the other";
  reader_.answered({sent_[10].index, 1.0F}, 520 * kMs);
  update(520 * kMs);
  EXPECT_EQ(sent_.size(), 22U) << "only what was asked for is ended";
  EXPECT_EQ(sent_[20].path, "a");
  EXPECT_EQ(sent_[20].rate_hz, 0);
  EXPECT_EQ(sent_[21].path, "b");
  EXPECT_TRUE(reader_.idle());
}

TEST_F(DatarefReaderTest, DeadlineEndsWithWhatThereIs) {
  reader_.start({"a", "b"}, 500 * kMs, keep());
  update(0);
  reader_.answered({1000, 1.0F}, 10 * kMs);
  update(499 * kMs);
  EXPECT_FALSE(result_.has_value());
  update(500 * kMs);
  ASSERT_TRUE(result_.has_value());
  EXPECT_EQ((*result_)[0], 1.0F);
  EXPECT_FALSE((*result_)[1].has_value());
}

TEST_F(DatarefReaderTest, WaitsForAnAcceptableValue) {
  reader_.start({"a"}, 500 * kMs, keep(), [](const std::vector<DatarefValue>& values) { return *values[0] == 3.0F; });
  update(0);
  reader_.answered({1000, 1.0F}, 10 * kMs);
  update(10 * kMs);
  EXPECT_FALSE(result_.has_value());
  reader_.answered({1000, 3.0F}, 20 * kMs);
  update(20 * kMs);
  EXPECT_TRUE(result_.has_value());
}

TEST_F(DatarefReaderTest, LateAnswerIsNotTakenForTheNextRead) {
  reader_.start({"a"}, 100 * kMs, keep());
  update(0);
  update(100 * kMs);
  result_.reset();
  reader_.start({"a"}, 500 * kMs, keep());
  update(100 * kMs);
  EXPECT_TRUE(reader_.answered({1000, 9.0F}, 110 * kMs)) << "known: from the read before";
  update(110 * kMs);
  EXPECT_FALSE(result_.has_value());
  reader_.answered({1001, 5.0F}, 120 * kMs);
  update(120 * kMs);
  EXPECT_EQ((*result_)[0], 5.0F);
}

TEST_F(DatarefReaderTest, StopsAgainWhatGoesOn) {
  reader_.start({"a"}, 100 * kMs, keep());
  update(0);
  reader_.answered({1000, 1.0F}, 1 * kMs);
  update(1 * kMs);
  const std::size_t after_stop = sent_.size();
  reader_.answered({1000, 1.0F}, 20 * kMs);
  update(20 * kMs);
  EXPECT_EQ(sent_.size(), after_stop) << "may still have been under way";
  reader_.answered({1000, 1.0F}, 1'100 * kMs);
  reader_.answered({1000, 1.0F}, 1'110 * kMs);
  update(1'110 * kMs);
  ASSERT_EQ(sent_.size(), after_stop + 1);
  EXPECT_EQ(sent_.back().rate_hz, 0);
  EXPECT_FALSE(reader_.answered({4711, 1.0F}, 0)) << "never asked";
  EXPECT_FALSE(reader_.answered({3, 1.0F}, 0)) << "not of the reader's indices";
}

TEST_F(DatarefReaderTest, CallbackMayStartTheNextRead) {
  reader_.start({"a"}, 100 * kMs,
                [this](const std::vector<DatarefValue>&) { reader_.start({"b"}, 200 * kMs, keep()); });
  update(100 * kMs);
  EXPECT_FALSE(reader_.idle());
  update(200 * kMs);
  EXPECT_TRUE(result_.has_value());
}

TEST_F(DatarefReaderTest, CancelAnswersAllCallers) {
  reader_.start({"a"}, 100 * kMs, keep());
  reader_.cancelAll();
  ASSERT_TRUE(result_.has_value());
  EXPECT_FALSE((*result_)[0].has_value());
  EXPECT_TRUE(reader_.idle()) << "what was never asked for needs no end";
}

}  // namespace
}  // namespace xplane_bridge::core
