#include "xplane_bridge/nodes/capture/capture_options.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace xplane_bridge {
namespace {

using XmlRpc::XmlRpcValue;

/// What is said of frames in capture_node's parameters; empty: they are taken.
std::string refusalOf(const XmlRpcValue& frames) {
  try {
    loadCaptureOptions(ParamLoader("/xplane/capture_node", frames));
  } catch (const ParamError& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(CaptureOptions, TakesFramesOfEachCamerasOwn) {
  XmlRpcValue frames;
  frames["frame_measured"] = std::string("belly_optical");
  frames["frame_down"] = std::string("belly_down_optical");
  EXPECT_EQ(refusalOf(frames), "");
}

TEST(CaptureOptions, RefusesFramesThatTfDoesNotTake) {
  for (const char* key : {"frame_measured", "frame_forward", "frame_rear", "frame_down"}) {
    for (const char* name : {"", "/camera"}) {
      XmlRpcValue frames;
      frames[key] = std::string(name);
      const std::string refusal = refusalOf(frames);
      EXPECT_TRUE(contains(refusal, std::string(key) + " is \"" + name + "\"")) << refusal;
      EXPECT_TRUE(contains(refusal, "not empty and without a leading slash")) << refusal;
    }
  }
}

TEST(CaptureOptions, RefusesFractionsOfPixels) {
  const auto refusal = [](const char* key, const std::vector<double>& numbers) {
    XmlRpcValue parameters;
    for (std::size_t i = 0; i < numbers.size(); ++i) parameters["window"][key][static_cast<int>(i)] = numbers[i];
    return refusalOf(parameters);
  };
  EXPECT_EQ(refusal("region", {0.0, 8.0, 640.0, 480.0}), "");
  EXPECT_EQ(refusal("point", {-100.0, 20.0}), "");
  for (const std::vector<double>& region : {std::vector<double>{0.5, 8.0, 640.0, 480.0},
                                            {0.0, 8.5, 640.0, 480.0},
                                            {0.0, 8.0, 640.9, 480.0},
                                            {0.0, 8.0, 640.0, 480.1}}) {
    EXPECT_TRUE(contains(refusal("region", region), "must be [x, y, width, height] in pixels of the screen"));
  }
  for (const std::vector<double>& point : {std::vector<double>{100.5, 20.0}, {-100.0, -0.5}}) {
    EXPECT_TRUE(contains(refusal("point", point), "must be [x, y] in pixels of the screen"));
  }
}

TEST(CaptureOptions, RefusesTheSameFrameForTwoViews) {
  XmlRpcValue frames;
  frames["frame_rear"] = std::string("camera");
  frames["frame_measured"] = std::string("camera");
  EXPECT_TRUE(contains(refusalOf(frames), "frame_measured is \"camera\", but must be another name"))
      << refusalOf(frames);
  XmlRpcValue as_default;
  as_default["frame_forward"] = std::string("camera_down_optical");
  EXPECT_TRUE(contains(refusalOf(as_default), "frame_forward is \"camera_down_optical\"")) << refusalOf(as_default);
}

}  // namespace
}  // namespace xplane_bridge
