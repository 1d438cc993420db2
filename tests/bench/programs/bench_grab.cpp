// Time that grabbing a window's picture and turning it into the published pixels takes, without ROS.
//
//   bench_grab title=TEXT width=PX height=PX seconds=S
//
// Prints a line of JSON.

#include <cstdio>
#include <vector>

#include "bench_picture.hpp"
#include "bench_settings.hpp"
#include "xplane_bridge/vision/picture_scaler.hpp"
#include "xplane_bridge/vision/x11_window_source.hpp"

int main(int argc, char** argv) {
  using namespace xplane_bridge;
  try {
    const bench::Settings settings(argc, argv);
    vision::X11SourceOptions options;
    options.title = settings.text("title");
    vision::X11WindowSource source(options, bench::wallTime);
    const auto width = static_cast<int>(settings.number("width"));
    const auto height = static_cast<int>(settings.number("height"));
    vision::PictureScaler scaler(width, height, vision::FitMode::kCrop);
    cv::Mat bgr(height, width, CV_8UC3);
    std::vector<double> times;
    const std::int64_t end = bench::now_ns() + static_cast<std::int64_t>(settings.number("seconds") * 1e9);
    while (bench::now_ns() < end) {
      vision::Change change;
      if (source.waitChange(std::chrono::milliseconds(100), change) != vision::WaitResult::kChange) continue;
      vision::Picture picture;
      const std::int64_t began = bench::now_ns();
      if (source.grab(change, picture) != vision::GrabResult::kNew) continue;
      scaler.scale(picture.bgr, bgr);
      times.push_back(1e-6 * static_cast<double>(bench::now_ns() - began));
    }
    std::printf("{\"pictures\": %zu, \"p50_ms\": %f, \"p95_ms\": %f}\n", times.size(), bench::percentile(times, 0.5),
                bench::percentile(times, 0.95));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_grab: %s\n", error.what());
    return 1;
  }
  return 0;
}
