#include "xplane_bridge/vision/video_source.hpp"

#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace vision = xplane_bridge::vision;
using std::chrono::milliseconds;
using vision::Change;
using vision::GrabResult;
using vision::Picture;
using vision::VideoSource;
using vision::VideoSourceOptions;
using vision::WaitResult;

namespace {

std::int64_t steadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// A video of flat pictures, written for one test.
class VideoFile {
 public:
  VideoFile(const std::vector<int>& greys, double fps) {
    static int count = 0;
    path_ = (std::filesystem::temp_directory_path() /
             ("xplane_bridge_" + std::to_string(getpid()) + "_" + std::to_string(count++) + ".avi"))
                .string();
    cv::VideoWriter writer(path_, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), fps, cv::Size(64, 48));
    for (const int grey : greys) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(grey)));
  }
  ~VideoFile() { std::remove(path_.c_str()); }
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

TEST(VideoSource, RefusesBadOptions) {
  EXPECT_THROW(VideoSource({}, steadyNow), std::invalid_argument);
  VideoSourceOptions options;
  options.address = "a";
  options.retry_period = 0.0;
  EXPECT_THROW(VideoSource(options, steadyNow), std::invalid_argument);
}

TEST(VideoSource, GivesThePicturesOfAFileWithItsOwnStamps) {
  const VideoFile file({40, 80, 80, 160, 200, 240}, 25.0);
  VideoSourceOptions options;
  options.address = file.path();
  options.retry_period = 0.01;
  VideoSource source(options, steadyNow);
  std::vector<int> greys;
  std::vector<std::int64_t> known_times;
  int same = 0;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (std::chrono::steady_clock::now() < deadline) {
    Change change;
    const WaitResult result = source.waitChange(milliseconds(20), change);
    if (result == WaitResult::kEnded) break;
    if (result != WaitResult::kChange) continue;
    Picture picture;
    const GrabResult grabbed = source.grab(change, picture);
    ASSERT_NE(grabbed, GrabResult::kLost) << source.problem();
    if (change.time_known) known_times.push_back(change.time_ns);
    if (grabbed == GrabResult::kSame) {
      ++same;
      continue;
    }
    greys.push_back(picture.bgr.ptr<std::uint8_t>(20)[60]);
  }
  ASSERT_EQ(greys.size(), 5U);
  EXPECT_NEAR(greys[0], 40, 4);
  EXPECT_NEAR(greys[4], 240, 4);
  EXPECT_EQ(same, 1);
  ASSERT_GE(known_times.size(), 4U);
  for (std::size_t i = 1; i < known_times.size(); ++i) EXPECT_GT(known_times[i], known_times[i - 1]);
  Change change;
  EXPECT_EQ(source.waitChange(milliseconds(1), change), WaitResult::kEnded);
  EXPECT_NE(source.problem().find("over"), std::string::npos);
}

TEST(VideoSource, LoopsWhenAsked) {
  const VideoFile file({40, 80, 160}, 50.0);
  VideoSourceOptions options;
  options.address = file.path();
  options.loop = true;
  options.paced = false;
  options.retry_period = 0.01;
  VideoSource source(options, steadyNow);
  int pictures = 0;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (pictures < 8 && std::chrono::steady_clock::now() < deadline) {
    Change change;
    Picture picture;
    if (source.waitChange(milliseconds(20), change) != WaitResult::kChange) continue;
    if (source.grab(change, picture) == GrabResult::kNew) ++pictures;
  }
  EXPECT_EQ(pictures, 8);
}

TEST(VideoSource, KeepsLookingForWhatIsNotThere) {
  VideoSourceOptions options;
  options.address = "/nonexistent/flight.avi";
  options.retry_period = 0.01;
  VideoSource source(options, steadyNow);
  Change change;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(source.waitChange(milliseconds(20), change), WaitResult::kLost);
  EXPECT_NE(source.problem().find("/nonexistent/flight.avi"), std::string::npos);
}

#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 6)
TEST(VideoSource, WaitsForASilentStreamForItsTimeOutOnly) {
  const int listening = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(listening, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(listening, 8), 0);  // connects, and says nothing
  ASSERT_EQ(getsockname(listening, reinterpret_cast<sockaddr*>(&address), &size), 0);
  VideoSourceOptions options;
  options.address = "rtsp://127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + "/";
  VideoSource source(options, steadyNow);
  const auto began = std::chrono::steady_clock::now();
  Change change;
  EXPECT_EQ(source.waitChange(milliseconds(10), change), WaitResult::kLost);
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(20));  // OpenCV's own is 30 s
  EXPECT_NE(source.problem().find("cannot be opened"), std::string::npos) << source.problem();
  close(listening);
}
#endif
