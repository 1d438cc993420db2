// Measures what a subscriber gets of bench_window's pictures. Prints MEASURING with the first picture, MEASURED after
// `seconds`, and then a line of JSON.
//
//   bench_images topic=IMAGE [states=FRAME_STATE] seconds=S
//
// With `states`, the time of grabbing is read from there instead of the image's stamp.

#include <cstdio>
#include <map>
#include <mutex>
#include <set>
#include <vector>

#include <ros/ros.h>
#include <sensor_msgs/Image.h>

#include "bench_picture.hpp"
#include "bench_settings.hpp"
#include "xplane_bridge/FrameState.h"

namespace {

using namespace xplane_bridge::bench;

struct Arrival {
  Drawn drawn;
  std::int64_t arrival_ns = 0;
  std::uint64_t stamp_ns = 0;
};

class Meter {
 public:
  explicit Meter(const Settings& settings) : settings_(settings) {
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    images_ = handle_.subscribe<sensor_msgs::Image>(settings.text("topic"), 10, &Meter::onImage, this, hints);
    if (!settings.text("states").empty()) {
      states_ =
          handle_.subscribe<xplane_bridge::FrameState>(settings.text("states"), 1000, &Meter::onState, this, hints);
    }
  }

  void run() {
    ros::AsyncSpinner spinner(1);
    spinner.start();
    while (ros::ok() && !started()) ros::WallDuration(0.001).sleep();
    std::printf("MEASURING\n");
    std::fflush(stdout);
    const std::int64_t began = now_ns();
    sleepUntil(began + static_cast<std::int64_t>(settings_.number("seconds") * 1e9));
    std::vector<Arrival> arrivals;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      arrivals = arrivals_;
    }
    const double elapsed = static_cast<double>(now_ns() - began) * 1e-9;
    std::printf("MEASURED\n");
    std::fflush(stdout);
    ros::WallDuration(0.5).sleep();  // the last states are still on their way
    spinner.stop();
    report(arrivals, elapsed);
  }

 private:
  bool started() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !arrivals_.empty();
  }

  void onImage(const sensor_msgs::Image::ConstPtr& image) {
    const std::int64_t arrival = wallTime();
    const auto drawn = readStrip(image->data.data(), image->step, 3);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (drawn.has_value()) {
      arrivals_.push_back({*drawn, arrival, image->header.stamp.toNSec()});
    } else {
      ++unreadable_;
    }
  }

  void onState(const xplane_bridge::FrameState::ConstPtr& state) {
    const std::lock_guard<std::mutex> lock(mutex_);
    grabbed_[state->header.stamp.toNSec()] = static_cast<std::int64_t>(state->grab_time.toNSec());
  }

  void report(const std::vector<Arrival>& arrivals, double elapsed) {
    std::set<std::uint32_t> frames;
    std::vector<double> grab_ages;
    std::vector<double> ages;
    std::vector<double> periods;
    std::int64_t before = 0;
    for (const Arrival& arrival : arrivals) {
      if (frames.insert(arrival.drawn.frame).second) {
        if (before != 0) periods.push_back(1e-6 * static_cast<double>(arrival.arrival_ns - before));
        before = arrival.arrival_ns;
      }
      ages.push_back(1e-6 * static_cast<double>(arrival.arrival_ns - arrival.drawn.time_ns));
      auto grabbed = static_cast<std::int64_t>(arrival.stamp_ns);
      if (!settings_.text("states").empty()) {
        const auto state = grabbed_.find(arrival.stamp_ns);
        if (state == grabbed_.end()) continue;
        grabbed = state->second;
      }
      grab_ages.push_back(1e-6 * static_cast<double>(grabbed - arrival.drawn.time_ns));
    }
    const auto drawn = arrivals.back().drawn.frame - arrivals.front().drawn.frame + 1;
    std::printf(
        "{\"elapsed_s\": %f, \"images\": %zu, \"distinct\": %zu, \"drawn\": %u, \"unreadable\": %zu, "
        "\"grab_p50_ms\": %f, \"grab_p95_ms\": %f, \"age_p50_ms\": %f, \"age_p95_ms\": %f, "
        "\"period_p99_ms\": %f, \"period_worst_ms\": %f}\n",
        elapsed, arrivals.size(), frames.size(), drawn, unreadable_, percentile(grab_ages, 0.5),
        percentile(grab_ages, 0.95), percentile(ages, 0.5), percentile(ages, 0.95), percentile(periods, 0.99),
        percentile(periods, 1.0));
  }

  const Settings& settings_;
  ros::NodeHandle handle_;
  ros::Subscriber images_;
  ros::Subscriber states_;
  std::mutex mutex_;
  std::vector<Arrival> arrivals_;
  std::map<std::uint64_t, std::int64_t> grabbed_;
  std::size_t unreadable_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_images", ros::init_options::AnonymousName);
  try {
    const Settings settings(argc, argv);
    Meter(settings).run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_images: %s\n", error.what());
    return 1;
  }
  return 0;
}
