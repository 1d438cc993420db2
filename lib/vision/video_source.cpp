#include "xplane_bridge/vision/video_source.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/version.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "xplane_bridge/vision/picture_checks.hpp"
#include "xplane_bridge/vision/server_clock.hpp"

namespace xplane_bridge::vision {
namespace {

using SteadyClock = std::chrono::steady_clock;

// A stamp that stands still or runs backwards so often in a row is none.
constexpr int kUselessStamps = 3;
#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 6)
constexpr int kReadTimeoutMs = 2000;  // so that a silent stream does not hold up the shutdown
#endif

bool isDevice(const std::string& address) {
  return address.rfind("/dev/", 0) == 0 ||
         (!address.empty() && std::all_of(address.begin(), address.end(), [](char c) { return c >= '0' && c <= '9'; }));
}

bool isStream(const std::string& address) { return address.find("://") != std::string::npos; }

}  // namespace

class VideoSource::Impl {
 public:
  Impl(const VideoSourceOptions& options, Clock clock) : options_(options), clock_(std::move(clock)) {
    if (options_.address.empty()) {
      throw std::invalid_argument("video address \"\": expected a device, a file or a URL");
    }
    if (!(options_.retry_period > 0.0 && options_.retry_period <= 60.0)) {
      throw std::invalid_argument("video retry period " + std::to_string(options_.retry_period) +
                                  " s: expected (0, 60]");
    }
    problem_ = "\"" + options_.address + "\" is not open yet";
  }

  WaitResult waitChange(std::chrono::milliseconds timeout, Change& change) {
    const auto deadline = SteadyClock::now() + timeout;
    if (ended_) {
      std::this_thread::sleep_until(deadline);
      return WaitResult::kEnded;
    }
    if (!video_.isOpened()) {
      if (SteadyClock::now() < next_open_) {
        std::this_thread::sleep_until(std::min(deadline, next_open_));
        return WaitResult::kLost;
      }
      if (!open()) return WaitResult::kLost;
    }
    if (!pending_) {
      if (!video_.grab()) return atEnd();
      pending_ = true;
      read_at_ns_ = clock_();
      stamp_ms_ = video_.get(cv::CAP_PROP_POS_MSEC);
      if (paced()) due_ = dueTime();
    }
    if (paced()) {
      std::this_thread::sleep_until(std::min(deadline, due_));
      if (SteadyClock::now() < due_) return WaitResult::kTimeout;
      read_at_ns_ = clock_();
    }
    pending_ = false;
    change = changeOf();
    return WaitResult::kChange;
  }

  GrabResult grab(const Change& change, Picture& picture) {
    cv::Mat& now = pictures_[turn_];
    picture.grab_time_ns = clock_();
    if (!video_.isOpened() || !video_.retrieve(now) || now.empty()) {
      problem_ = "\"" + options_.address + "\": a picture could not be decoded";
      return GrabResult::kLost;
    }
    problem_.clear();
    if (now.type() != CV_8UC3 && now.type() != CV_8UC4) {
      problem_ = "\"" + options_.address + "\" gives pictures of " + std::to_string(now.channels()) +
                 " channels; expected 8-bit colour";
      return GrabResult::kLost;
    }
    const bool same = samePixels(now, pictures_[1 - turn_]);
    picture.bgr = now;
    picture.display_time_ns = change.time_ns;
    picture.display_time_known = change.time_known;
    turn_ = 1 - turn_;
    return same ? GrabResult::kSame : GrabResult::kNew;
  }

  [[nodiscard]] std::string describe() const {
    std::string text = "video \"" + options_.address + "\"";
    if (!video_.isOpened()) return text + " (" + problem_ + ")";
    text += ", " + video_.getBackendName();
    return text + (stampsUseful() ? ", the stream's own time stamps" : ", no usable time stamps");
  }
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  [[nodiscard]] bool paced() const {
    return options_.paced && !isDevice(options_.address) && !isStream(options_.address);
  }
  [[nodiscard]] bool stampsUseful() const { return useless_stamps_ < kUselessStamps; }

  bool open() {
    next_open_ = SteadyClock::now() + std::chrono::duration_cast<SteadyClock::duration>(
                                          std::chrono::duration<double>(options_.retry_period));
    bool opened = false;
    bool silent = false;
    try {
      const bool number = isDevice(options_.address) && options_.address.front() != '/';
      if (number) {
        opened = video_.open(std::stoi(options_.address));
      } else {
#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 6)
        if (isStream(options_.address)) {
          const auto began = SteadyClock::now();
          opened = video_.open(
              options_.address, cv::CAP_FFMPEG,
              {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, kReadTimeoutMs, cv::CAP_PROP_READ_TIMEOUT_MSEC, kReadTimeoutMs});
          silent = SteadyClock::now() - began > std::chrono::milliseconds(kReadTimeoutMs / 2);
        }
#endif
        // Asked once more, without a time-out, a silent stream would be waited for half a minute.
        if (!opened && !silent) opened = video_.open(options_.address);
      }
    } catch (const std::exception& error) {  // OpenCV, or a device number beyond int
      problem_ = "\"" + options_.address + "\": " + error.what();
      return false;
    }
    if (!opened) {
      problem_ = "\"" + options_.address + "\" cannot be opened: expected a capture device, a video file or a URL";
      return false;
    }
    problem_.clear();
    started_.reset();
    last_stamp_ms_.reset();
    useless_stamps_ = 0;
    stream_clock_.reset();
    return true;
  }

  WaitResult atEnd() {
    video_.release();
    const bool file = !isDevice(options_.address) && !isStream(options_.address);
    if (file && !options_.loop) {
      ended_ = true;
      problem_ = "\"" + options_.address + "\" is over";
      return WaitResult::kEnded;
    }
    problem_ = "\"" + options_.address + "\" ended";
    if (file) next_open_ = SteadyClock::now();
    return WaitResult::kLost;
  }

  SteadyClock::time_point dueTime() {
    if (!started_.has_value()) started_ = {SteadyClock::now(), stamp_ms_};
    return started_->first + std::chrono::duration_cast<SteadyClock::duration>(
                                 std::chrono::duration<double, std::milli>(stamp_ms_ - started_->second));
  }

  Change changeOf() {
    const bool advances = !last_stamp_ms_.has_value() || stamp_ms_ > *last_stamp_ms_;
    useless_stamps_ = advances ? 0 : useless_stamps_ + 1;
    // One stamp alone says nothing: a stream without any gives 0 for ever.
    const bool known = advances && last_stamp_ms_.has_value() && std::isfinite(stamp_ms_);
    last_stamp_ms_ = stamp_ms_;
    if (!known) return {read_at_ns_, false};
    const auto milliseconds = static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(stamp_ms_)));
    return {stream_clock_.toHost(milliseconds, read_at_ns_), true};
  }

  VideoSourceOptions options_;
  Clock clock_;
  cv::VideoCapture video_;
  std::string problem_;
  SteadyClock::time_point next_open_{};
  bool ended_ = false;
  bool pending_ = false;  // grabbed inside OpenCV, but not due yet
  SteadyClock::time_point due_{};
  std::optional<std::pair<SteadyClock::time_point, double>> started_;  // file: steady time and stamp of its start
  std::int64_t read_at_ns_ = 0;
  double stamp_ms_ = 0.0;
  std::optional<double> last_stamp_ms_;
  int useless_stamps_ = 0;
  ServerClock stream_clock_;
  cv::Mat pictures_[2];
  std::size_t turn_ = 0;
};

VideoSource::VideoSource(const VideoSourceOptions& options, Clock clock)
    : impl_(std::make_unique<Impl>(options, std::move(clock))) {}
VideoSource::~VideoSource() = default;
WaitResult VideoSource::waitChange(std::chrono::milliseconds timeout, Change& change) {
  return impl_->waitChange(timeout, change);
}
GrabResult VideoSource::grab(const Change& change, Picture& picture) { return impl_->grab(change, picture); }
std::string VideoSource::describe() const { return impl_->describe(); }
std::string VideoSource::problem() const { return impl_->problem(); }

}  // namespace xplane_bridge::vision
