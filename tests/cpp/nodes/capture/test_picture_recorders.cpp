#include "xplane_bridge/nodes/capture/picture_recorders.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace xplane_bridge {
namespace {

const std::vector<std::string> kFirst{"/lab/first/camera/image_raw", "/lab/first/camera/frame_state"};

TEST(PictureRecorders, TopicsOfEachCameraOfTheBridge) {
  EXPECT_TRUE(isOfBridge("/lab/first/camera/image_raw", kFirst, "/lab/first"));
  EXPECT_TRUE(isOfBridge("/lab/first/belly/camera/frame_state", kFirst, "/lab/first"));
  EXPECT_FALSE(isOfBridge("/lab/first/flight_state", kFirst, "/lab/first"));
  const std::vector<std::string> belly{"/lab/first/belly/camera/image_raw"};
  EXPECT_TRUE(isOfBridge("/lab/first/camera/image_raw", belly, "/lab/first"));
  EXPECT_TRUE(isOfBridge("/lab/first/nose/camera/image_raw", belly, "/lab/first"));
}

TEST(PictureRecorders, AnotherBridgeShowsAnotherXPlane) {
  EXPECT_FALSE(isOfBridge("/lab/second/camera/image_raw", kFirst, "/lab/first"));
  EXPECT_FALSE(isOfBridge("/lab/second/belly/camera/image_raw", kFirst, "/lab/first"));
  EXPECT_FALSE(isOfBridge("/lab/first_too/camera/image_raw", kFirst, "/lab/first"));
}

TEST(PictureRecorders, OwnTopicsCountWhateverTheirNames) {
  EXPECT_TRUE(isOfBridge("/elsewhere/picture", {"/elsewhere/picture"}, "/lab/first"));
  EXPECT_FALSE(isOfBridge("/lab/first/picture", {"/elsewhere/picture"}, "/lab/first"));
  EXPECT_TRUE(isOfBridge("/camera/image_raw", {"/camera/image_raw"}, "/"));
  EXPECT_FALSE(isOfBridge("/xplane/camera/image_raw", {"/camera/image_raw"}, "/"));
}

TEST(PictureRecorders, RecordersByTheirNames) {
  for (const char* node : {"/record_1234", "/xplane/record", "/rosbag", "/my_Recorder", "/lab/flight_bag"}) {
    EXPECT_TRUE(isRecorder(node)) << node;
  }
  for (const char* node : {"/xplane/record_watch", "/garbage_detector", "/record/viewer"}) {
    EXPECT_FALSE(isRecorder(node)) << node;
  }
}

}  // namespace
}  // namespace xplane_bridge
