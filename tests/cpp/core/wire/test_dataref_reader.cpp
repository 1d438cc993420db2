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
  struct Sent {
    std::string path;
    std::int32_t rate_hz;
    std::int32_t index;
  };

  DatarefReader::Done keep() {
    return [this](const std::vector<DatarefValue>& values) { result_ = values; };
  }

  std::vector<Sent> sent_;
  std::optional<std::vector<DatarefValue>> result_;
  DatarefReader reader_{1000, [this](const std::string& path, std::int32_t rate_hz, std::int32_t index) {
                          sent_.push_back({path, rate_hz, index});
                        }};
};

TEST_F(DatarefReaderTest, AsksAnswersAndStops) {
  reader_.start({"a", "b"}, 0, 1'000 * kMs, keep());
  reader_.update(0);
  ASSERT_EQ(sent_.size(), 2U);
  EXPECT_EQ(sent_[0].path, "a");
  EXPECT_GT(sent_[0].rate_hz, 0);
  EXPECT_EQ(sent_[0].index, 1000);
  EXPECT_EQ(sent_[1].index, 1001);
  EXPECT_TRUE(reader_.answered({1001, 2.0F}, 10 * kMs));
  reader_.update(10 * kMs);
  EXPECT_FALSE(result_.has_value());
  EXPECT_TRUE(reader_.answered({1000, 1.0F}, 20 * kMs));
  reader_.update(20 * kMs);
  ASSERT_TRUE(result_.has_value());
  EXPECT_EQ((*result_)[0], 1.0F);
  EXPECT_EQ((*result_)[1], 2.0F);
  ASSERT_EQ(sent_.size(), 4U);
  EXPECT_EQ(sent_[2].rate_hz, 0);
  EXPECT_EQ(sent_[3].rate_hz, 0);
  EXPECT_TRUE(reader_.idle());
}

TEST_F(DatarefReaderTest, RepeatsWhatIsNotAnswered) {
  reader_.start({"a", "b"}, 0, 1'000 * kMs, keep());
  reader_.update(0);
  reader_.answered({1000, 1.0F}, 10 * kMs);
  reader_.update(100 * kMs);
  EXPECT_EQ(sent_.size(), 2U);
  reader_.update(260 * kMs);
  ASSERT_EQ(sent_.size(), 3U);
  EXPECT_EQ(sent_[2].path, "b");
  EXPECT_EQ(sent_[2].index, 1001);
}

TEST_F(DatarefReaderTest, DeadlineEndsWithWhatThereIs) {
  reader_.start({"a", "b"}, 0, 500 * kMs, keep());
  reader_.update(0);
  reader_.answered({1000, 1.0F}, 10 * kMs);
  reader_.update(499 * kMs);
  EXPECT_FALSE(result_.has_value());
  reader_.update(500 * kMs);
  ASSERT_TRUE(result_.has_value());
  EXPECT_EQ((*result_)[0], 1.0F);
  EXPECT_FALSE((*result_)[1].has_value());
}

TEST_F(DatarefReaderTest, WaitsForAnAcceptableValue) {
  reader_.start({"a"}, 0, 500 * kMs, keep(),
                [](const std::vector<DatarefValue>& values) { return *values[0] == 3.0F; });
  reader_.update(0);
  reader_.answered({1000, 1.0F}, 10 * kMs);
  reader_.update(10 * kMs);
  EXPECT_FALSE(result_.has_value());
  reader_.answered({1000, 3.0F}, 20 * kMs);
  reader_.update(20 * kMs);
  EXPECT_TRUE(result_.has_value());
}

TEST_F(DatarefReaderTest, LateAnswerIsNotTakenForTheNextRead) {
  reader_.start({"a"}, 0, 100 * kMs, keep());
  reader_.update(0);
  reader_.update(100 * kMs);
  result_.reset();
  reader_.start({"a"}, 100 * kMs, 500 * kMs, keep());
  reader_.update(100 * kMs);
  EXPECT_TRUE(reader_.answered({1000, 9.0F}, 110 * kMs)) << "known: from the read before";
  reader_.update(110 * kMs);
  EXPECT_FALSE(result_.has_value());
  reader_.answered({1001, 5.0F}, 120 * kMs);
  reader_.update(120 * kMs);
  EXPECT_EQ((*result_)[0], 5.0F);
}

TEST_F(DatarefReaderTest, StopsAgainWhatGoesOn) {
  reader_.start({"a"}, 0, 100 * kMs, keep());
  reader_.update(0);
  reader_.answered({1000, 1.0F}, 1 * kMs);
  reader_.update(1 * kMs);
  const std::size_t after_stop = sent_.size();
  reader_.answered({1000, 1.0F}, 20 * kMs);
  EXPECT_EQ(sent_.size(), after_stop) << "may still have been under way";
  reader_.answered({1000, 1.0F}, 1'100 * kMs);
  ASSERT_EQ(sent_.size(), after_stop + 1);
  EXPECT_EQ(sent_.back().rate_hz, 0);
  EXPECT_FALSE(reader_.answered({4711, 1.0F}, 0)) << "never asked";
  EXPECT_FALSE(reader_.answered({3, 1.0F}, 0)) << "not of the reader's indices";
}

TEST_F(DatarefReaderTest, CallbackMayStartTheNextRead) {
  reader_.start({"a"}, 0, 100 * kMs,
                [this](const std::vector<DatarefValue>&) { reader_.start({"b"}, 100 * kMs, 200 * kMs, keep()); });
  reader_.update(100 * kMs);
  EXPECT_FALSE(reader_.idle());
  reader_.update(200 * kMs);
  EXPECT_TRUE(result_.has_value());
}

TEST_F(DatarefReaderTest, CancelAnswersAllCallers) {
  reader_.start({"a"}, 0, 100 * kMs, keep());
  reader_.cancelAll();
  ASSERT_TRUE(result_.has_value());
  EXPECT_FALSE((*result_)[0].has_value());
  EXPECT_TRUE(reader_.idle());
}

}  // namespace
}  // namespace xplane_bridge::core
