#include "xplane_bridge/nodes/recorder/lockstep_recorder.hpp"

#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace xplane_bridge {
namespace {

using Words = std::vector<std::string>;

TEST(LockstepRecorder, TakesTheArgumentsThatRosbagTakes) {
  const LockstepRecording plain = LockstepRecording::parse({"--output-name=/a/flight.bag", "/xplane/odom", "/tf"});
  EXPECT_EQ(plain.bag, "/a/flight.bag");
  EXPECT_EQ(plain.topics, (Words{"/xplane/odom", "/tf"}));
  EXPECT_EQ(plain.compression, LockstepRecording::Compression::kNone);
  EXPECT_EQ(plain.chunk_size, 768U * 1024U);
  EXPECT_EQ(plain.bridge, "/xplane");

  const LockstepRecording small =
      LockstepRecording::parse({"--lz4", "--chunksize=64", "--bridge=/north/", "--output-name=b", "/north/odom"});
  EXPECT_EQ(small.compression, LockstepRecording::Compression::kLz4);
  EXPECT_EQ(small.chunk_size, 64U * 1024U);
  EXPECT_EQ(small.bridge, "/north/");
  EXPECT_EQ(LockstepRecording::parse({"--bz2", "--output-name=b", "/tf"}).compression,
            LockstepRecording::Compression::kBz2);
}

TEST(LockstepRecorder, PutsTheDateBehindAPrefix) {
  const std::string bag = LockstepRecording::parse({"--output-prefix=flights/a", "/tf"}).bag;
  const std::string date = "_2026-11-23-18-00-00";
  ASSERT_EQ(bag.size(), std::string("flights/a").size() + date.size() + std::string(".bag").size());
  EXPECT_EQ(bag.substr(0, 12), "flights/a_20");
  EXPECT_EQ(bag.substr(bag.size() - 4), ".bag");
}

/// What it says of arguments that cannot be; empty where it takes them.
std::string refusal(const Words& arguments) {
  try {
    (void)LockstepRecording::parse(arguments);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(LockstepRecorder, SaysWhatItWasGivenAndWhatItExpects) {
  EXPECT_EQ(refusal({"/tf"}), "no file: give --output-name=FILE");
  EXPECT_EQ(refusal({"--output-name=b"}), "no topic: give at least one, for instance /xplane/flight_state");
  EXPECT_NE(refusal({"--output-name=b", "odom"}).find("'odom': expected a topic with its whole name"),
            std::string::npos);
  EXPECT_NE(refusal({"--output-name=b", "--split", "/tf"}).find("'--split': expected"), std::string::npos);
  for (const char* size : {"0", "x", "12k", "-1", "1048577", ""}) {
    EXPECT_EQ(refusal({"--output-name=b", std::string("--chunksize=") + size, "/tf"}),
              std::string("--chunksize=") + size + ": expected 1 to 1048576 [KB]");
  }
}

}  // namespace
}  // namespace xplane_bridge
