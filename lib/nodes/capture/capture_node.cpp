#include "xplane_bridge/nodes/capture/capture_node.hpp"

#include <sys/prctl.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/image_encodings.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"

namespace xplane_bridge {
namespace {

constexpr std::chrono::milliseconds kSourceWait{50};
// [s] between looks at overdue pictures where no picture, frame or state comes, which all look by themselves. Each look
// wakes two of roscpp's threads: with 5 ms they took a quarter of the node's time at 640x480.
constexpr double kOverduePeriod = 0.05;
constexpr double kRestorePeriod = 0.5;  // [s] between looks whether a killed node's field of view is to be given back
constexpr double kSlowRead = 0.005;     // [s] median above which reading pictures is said to be slow
constexpr double kPeriodsFrozen = 2.0;  // of max_rate: longer than it leaves pictures out
constexpr std::int64_t kFrozenRepeat = 1'000'000'000;  // [ns] between repetitions of a frozen picture
constexpr std::int64_t kSameTime = 1'000'000'000;  // [ns] by which a stamp may be behind the one before in one flight
constexpr std::size_t kPicturesWaiting = 2;        // for scaling, and for JPEG: more would only be older
constexpr std::size_t kSpareBuffers = 4;
constexpr std::uint32_t kStateQueue = 200;  // states of a second and more: none may be lost for pairing
constexpr std::uint32_t kImageQueue = 2;
// What counts as motion that a camera would show.
constexpr double kMovedDeg = 0.05;
constexpr double kMovedMetres = 0.2;

bool moved(const FlightState& from, const FlightState& to) {
  const auto turned = [](double a, double b) { return std::abs(std::remainder(b - a, 360.0)) > kMovedDeg; };
  if (turned(from.roll_deg, to.roll_deg) || turned(from.pitch_deg, to.pitch_deg) ||
      turned(from.heading_true_deg, to.heading_true_deg)) {
    return true;
  }
  return std::hypot(std::hypot(to.position_north - from.position_north, to.position_east - from.position_east),
                    to.position_down - from.position_down) > kMovedMetres;
}

}  // namespace

CaptureNode::CaptureNode() : frozen_check_(0) {}
CaptureNode::~CaptureNode() = default;

void CaptureNode::loadParameters(const ParamLoader& own) {
  options_ = loadCaptureOptions(own);
  options_.prefixFrames(common().frames.prefix);
  if (lockstep()) requireLockstep(own);
  scaler_ = std::make_unique<vision::PictureScaler>(options_.width, options_.height, options_.fit);
  limiter_ = core::RateLimiter(options_.max_rate);
  // Pictures that max_rate leaves out are not looked at.
  const double looked_at = options_.max_rate > 0.0 ? kPeriodsFrozen / options_.max_rate : 0.0;
  frozen_check_ = vision::FrozenCheck(core::toNanoseconds(std::max(options_.frozen_after, looked_at)));
}

void CaptureNode::advertise() {
  // Plain topics, no image_transport: its plugins would advertise `compressed` a second time, and encode in our thread.
  image_publisher_ = advertiseTopic<sensor_msgs::Image>("camera/image_raw", kImageQueue);
  jpeg_publisher_ = advertiseTopic<sensor_msgs::CompressedImage>("camera/image_raw/compressed", kImageQueue);
  info_publisher_ = advertiseTopic<sensor_msgs::CameraInfo>("camera/camera_info", kImageQueue);
  frame_state_publisher_ = advertiseTopic<FrameState>("camera/frame_state", kStateQueue);
  measured_frame_ = std::make_unique<tf2_ros::TransformBroadcaster>();
  pairing_ = std::make_unique<ImagePairing>(
      common().display_delay, options_.max_wait, [this](const FrameState& state) { publishFrameState(state); },
      lockstep()            ? ImagePairing::Stamps::kFrames
      : stampsBySimulator() ? ImagePairing::Stamps::kSimulator
                            : ImagePairing::Stamps::kHost);
  broadcastFrames();
  advertiseService<std_srvs::Trigger::Request, std_srvs::Trigger::Response>(
      name() + "/calibrate_display_delay",
      [this](const std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
        serveCalibration(&response);
      });
  addDiagnostics("capture", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnoseCapture(&status); });
  addDiagnostics("pairing", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnosePairing(&status); });
}

void CaptureNode::subscribe() {
  if (lockstep()) {
    subscribeInLockstep();
    return;
  }
  subscribeTopic<FlightState>("flight_state", kStateQueue,
                              [this](const FlightState::ConstPtr& state) { onState(state); });
  subscribeTopic<WarningState>("mission/warnings", kStateQueue, [this](const WarningState::ConstPtr& warnings) {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    crashed_ = warnings->crashed > 0.5F;
  });
  addTimer(kOverduePeriod, [this] { pairing_->flush(pairingNow()); });
  addTimer(kRestorePeriod, [this] { restoreFieldOfView(); });
}

core::SimLinkCallbacks CaptureNode::linkCallbacks() {
  core::SimLinkCallbacks callbacks;
  callbacks.on_state = [this](const core::LinkStatus& status) { onLinkState(status); };
  return callbacks;
}

void CaptureNode::start() {
  // A picture is converted in a fraction of its period; OpenCV's workers would spend more on waiting for each other.
  cv::setNumThreads(1);
  view_subscription_ = link().subscribe(
      view_stream_.group(),
      [this](const core::RrefView& datagram, const core::ReceiveInfo& info) { onView(datagram, info); });
  if (lockstep()) {
    capture_thread_ = std::thread([this] { captureInLockstep(); });
    return;
  }
  publisher_ = std::make_unique<LatestWorker<Grabbed>>(kPicturesWaiting, [this](Grabbed& grabbed) {
    publishPicture(&grabbed);
    if (!grabbed.frozen) giveBuffer(std::move(grabbed.pixels));
  });
  encoder_ = std::make_unique<LatestWorker<sensor_msgs::ImageConstPtr>>(
      kPicturesWaiting, [this](sensor_msgs::ImageConstPtr& image) { encodeJpeg(*image); });
  options_.sender.recorded = [this] { return !recording().empty(); };
  options_.sender.calibration = sender_calibration_;
  capture_thread_ = std::thread([this] { captureLoop(); });
}

void CaptureNode::stopInputs() { stop_ = true; }

void CaptureNode::joinThreads() {
  stop_ = true;
  if (capture_thread_.joinable()) capture_thread_.join();
  if (publisher_) publisher_->stop();
  if (encoder_) encoder_->stop();
}

// --- pictures --------------------------------------------------------------------------------------------------------

void CaptureNode::captureLoop() {
  prctl(PR_SET_NAME, "capture");
  const std::unique_ptr<vision::FrameSource> source = makeSource(options_, [this] { return picture_clock_.now(); });
  while (!stop_) {
    picture_clock_.follow();
    vision::Change change;
    const vision::WaitResult result = source->waitChange(kSourceWait, change);
    if (result == vision::WaitResult::kChange) takePicture(source.get(), change);
    noteSource(*source, result != vision::WaitResult::kChange);
    if (!calibrating_) repeatFrozen(pairingNow());
    if (standing_check_.due(hasSubscribers() && !calibrating_, clock().steady_ns())) source->lookAnew();
  }
}

void CaptureNode::noteSource(const vision::FrameSource& source, bool described) {
  const std::string problem = source.problem();
  if (problem != logged_problem_) {
    if (problem.empty()) {
      ROS_INFO_STREAM("capturing " << source.describe());
    } else {
      ROS_WARN_STREAM("no picture: " << problem);
    }
    logged_problem_ = problem;
  }
  const std::lock_guard<std::mutex> lock(capture_mutex_);
  if (!problem.empty()) {
    periods_.interrupt();
    frozen_check_.interrupt();
  } else if (!source_problem_.empty()) {
    frozen_check_.beginAnew(pairingNow() + kEyeReportsNs);
  }
  source_problem_ = problem;
  // Asking the window for its title costs a round trip; only where it may have changed.
  if (described || source_description_.empty()) source_description_ = source.describe();
}

void CaptureNode::takePicture(vision::FrameSource* source, const vision::Change& change) {
  if (calibrating_) {
    lookForStep(source, change);
    return;
  }
  const core::RateLimiter before = limiter_;
  const bool heard = hasSubscribers();
  const bool due = heard && limiter_.due(change.time_ns);
  {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    ++changes_;
    if (!heard) {
      periods_.interrupt();
      frozen_check_.interrupt();
    }
    if (!due) {
      ++skipped_;
      return;
    }
  }
  vision::Picture picture;
  const std::int64_t began_ns = clock().steady_ns();
  const vision::GrabResult result = source->grab(change, picture);
  const double took = core::toSeconds(clock().steady_ns() - began_ns);
  if (result != vision::GrabResult::kNew) {
    limiter_ = before;  // what was drawn was not a new picture: the next one is due still
    return;
  }
  Grabbed grabbed;
  if (picture.jpeg) {
    grabbed.jpeg = picture.jpeg;
    grabbed.size = picture.jpeg_size;
  } else {
    grabbed.pixels = takeBuffer();
    picture.bgr.copyTo(grabbed.pixels);
    grabbed.size = grabbed.pixels.size();
  }
  grabbed.frame = picture.frame;
  grabbed.display_ns = picture.display_time_ns;
  grabbed.grab_ns = picture.grab_time_ns;
  grabbed.display_known = picture.display_time_known;
  {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    frozen_check_.pictureChanged();
    frozen_ = false;
    ++grabbed_;
    reads_.push_back(took);
    periods_.add(grabbed.display_ns);
    if (grabbed.display_known) {
      const double age = core::toSeconds(grabbed.grab_ns - grabbed.display_ns);
      grab_age_sum_ += age;
      grab_age_max_ = std::max(grab_age_max_, age);
      ++grab_ages_;
    }
    dropped_ = skipped_ + static_cast<std::uint32_t>(publisher_->dropped());
    grabbed.dropped = dropped_;
  }
  standing_check_.pictureTaken();
  last_ = grabbed;
  publisher_->pushDroppingOldest(std::move(grabbed));
}

void CaptureNode::repeatFrozen(std::int64_t now_ns) {
  Grabbed grabbed;
  {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    frozen_ = frozen_check_.frozen(now_ns);
    if (!frozen_ || last_.size.empty() || now_ns - frozen_sent_ns_ < kFrozenRepeat) return;
    grabbed.dropped = dropped_;
  }
  frozen_sent_ns_ = now_ns;
  grabbed.pixels = last_.pixels.clone();  // its own buffer may be written to while this one waits
  grabbed.jpeg = last_.jpeg;
  grabbed.size = last_.size;
  grabbed.display_ns = grabbed.grab_ns = now_ns;
  grabbed.frozen = true;
  publisher_->pushDroppingOldest(std::move(grabbed));
}

bool CaptureNode::hasSubscribers() const {
  return image_publisher_.getNumSubscribers() > 0 || jpeg_publisher_.getNumSubscribers() > 0 ||
         info_publisher_.getNumSubscribers() > 0 || frame_state_publisher_.getNumSubscribers() > 0;
}

bool CaptureNode::decode(Grabbed* grabbed, bool whole) {
  if (!grabbed->jpeg) return true;
  try {
    grabbed->pixels = cv::imdecode(*grabbed->jpeg, whole ? cv::IMREAD_COLOR : cv::IMREAD_REDUCED_COLOR_8);
  } catch (const cv::Exception& error) {
    ROS_WARN_THROTTLE(10.0, "a picture could not be decoded: %s", error.what());
  }
  return !grabbed->pixels.empty();
}

void CaptureNode::publishPicture(Grabbed* grabbed) {
  const bool raw = image_publisher_.getNumSubscribers() > 0;
  const bool jpeg = jpeg_publisher_.getNumSubscribers() > 0;
  // The sender's own JPEG goes out as it is, where it has the size that is asked for.
  const bool verbatim = grabbed->jpeg && grabbed->size == scaler_->size();
  if (!decode(grabbed, raw || (jpeg && !verbatim))) return;
  FrameState state;
  const std::int64_t shown_ns = grabbed->display_known ? grabbed->display_ns : grabbed->grab_ns;
  const auto frame_key = grabbed->frame.has_value() ? std::optional<float>(grabbed->frame->sim_time) : std::nullopt;
  const core::FrameCamera camera = cameraOf(shown_ns, grabbed->frame);
  state.header.stamp = toRosTime(stampOfPicture(shown_ns));
  state.header.seq = image_count_;
  describeCamera(camera, &state);
  if (!grabbed->display_known) state.quality |= FrameState::QUALITY_DISPLAY_UNKNOWN;
  if (grabbed->frame.has_value()) {
    state.display_delay = grabbed->frame->delay;
    if (grabbed->frame->borderline) state.quality |= FrameState::QUALITY_BORDERLINE;
    if (grabbed->frame->delay_assumed) state.quality |= FrameState::QUALITY_DELAY_ASSUMED;
  }
  if (grabbed->frozen) {
    state.quality |= FrameState::QUALITY_FROZEN;
    ++frozen_count_;
  }
  state.display_time = grabbed->display_known ? state.header.stamp : toRosTime(published(grabbed->display_ns));
  state.grab_time = toRosTime(published(grabbed->grab_ns));
  state.dropped = grabbed->dropped;
  state.frozen = frozen_count_;
  state.image_count = ++image_count_;

  const core::Frustum& frustum = camera.frustum;
  const vision::FieldOfView shown{frustum.horizontal_deg, frustum.vertical_deg, frustum.shift_right, frustum.shift_up};
  const sensor_msgs::CameraInfo info = cameraInfo(state.header, grabbed->size, shown);
  state.field_of_view_deg = static_cast<float>(scaler_->intrinsics(grabbed->size, shown).horizontal_fov_deg);
  // A sender or a video may stretch the window, and X-Plane's vertical angle with it.
  const bool of_screen = options_.source == CaptureOptions::Source::kX11;
  const bool stretched = frustum.vertical_deg > 0.0 && !of_screen;
  const bool is_region = of_screen && !options_.x11.region.empty();
  if (!stretched && !core::canShowWhole(frustum, grabbed->size.width, grabbed->size.height, is_region)) {
    state.quality |= FrameState::QUALITY_FOV_ASSUMED;
    ROS_WARN_THROTTLE(
        60.0,
        "pictures of %d x %d px do not have the %s of X-Plane's window (%.0f x %.0f px), whose field of view "
        "camera_info goes by: capture the whole window, or state the part's own (own_field_of_view, "
        "field_of_view_deg)",
        grabbed->size.width, grabbed->size.height, is_region ? "size" : "shape", frustum.width, frustum.height);
  }
  const cv::Rect part = scaler_->shows(grabbed->size);
  state.picture_x = static_cast<std::uint32_t>(part.x);
  state.picture_y = static_cast<std::uint32_t>(part.y);
  state.picture_width = static_cast<std::uint32_t>(part.width);
  state.picture_height = static_cast<std::uint32_t>(part.height);

  const bool black = vision::isBlack(grabbed->pixels);
  if (black) state.quality |= FrameState::QUALITY_BLACK;
  {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    black_ = black;
  }
  if (jpeg && verbatim) publishJpeg(state.header, *grabbed->jpeg);
  if (raw || (jpeg && !verbatim)) {
    const sensor_msgs::ImagePtr image = takeMessage();
    image->header = state.header;
    cv::Mat pixels(options_.height, options_.width, CV_8UC3, image->data.data());
    scaler_->scale(grabbed->pixels, pixels);
    if (raw) image_publisher_.publish(image);
    if (jpeg && !verbatim) {
      if (encoder_) {
        encoder_->pushDroppingOldest(image);
      } else {
        encodeJpeg(*image);
      }
    }
  }
  info_publisher_.publish(info);
  pairing_->addPicture(state, shown_ns, pairingNow(), frame_key);
}

std::int64_t CaptureNode::published(std::int64_t time_ns) const {
  if (lockstep()) return time_ns;
  if (!stampsBySimulator()) return picture_clock_.toWall(time_ns);
  const auto sim_time = pairing_->simTime(time_ns);
  return sim_time.has_value() ? stampOf(*sim_time) : clock().system_ns();
}

std::int64_t CaptureNode::stampOfPicture(std::int64_t shown_ns) {
  std::int64_t stamp_ns = published(shown_ns);
  if (stampsBySimulator()) {
    // It stands in a pause, at the newest frame, which is up to a period before the picture last shown, and steps back
    // a little where the clock has learnt: all the same each picture's stamp is later than the one before.
    if (stamp_ns <= last_stamp_ns_ && last_stamp_ns_ - stamp_ns < kSameTime) stamp_ns = last_stamp_ns_ + 1;
    last_stamp_ns_ = stamp_ns;
  }
  return stamp_ns;
}

sensor_msgs::ImagePtr CaptureNode::takeMessage() {
  for (const sensor_msgs::ImagePtr& message : messages_) {
    if (message.unique()) return message;  // written, and encoded
  }
  auto message = boost::make_shared<sensor_msgs::Image>();
  message->width = static_cast<std::uint32_t>(options_.width);
  message->height = static_cast<std::uint32_t>(options_.height);
  message->encoding = sensor_msgs::image_encodings::BGR8;
  message->step = message->width * 3;
  message->data.resize(static_cast<std::size_t>(message->step) * message->height);
  if (messages_.size() < kSpareBuffers) messages_.push_back(message);
  return message;
}

void CaptureNode::encodeJpeg(const sensor_msgs::Image& image) {
  // OpenCV reads the picture only.
  const cv::Mat pixels(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC3,
                       const_cast<std::uint8_t*>(image.data.data()));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", pixels, jpeg, {cv::IMWRITE_JPEG_QUALITY, options_.jpeg_quality});
  publishJpeg(image.header, jpeg);
}

void CaptureNode::publishJpeg(const std_msgs::Header& header, const std::vector<std::uint8_t>& jpeg) {
  sensor_msgs::CompressedImage compressed;
  compressed.header = header;
  compressed.format = "bgr8; jpeg compressed bgr8";
  compressed.data = jpeg;
  jpeg_publisher_.publish(compressed);
}

cv::Mat CaptureNode::takeBuffer() {
  const std::lock_guard<std::mutex> lock(buffers_mutex_);
  if (buffers_.empty()) return {};
  cv::Mat buffer = std::move(buffers_.back());
  buffers_.pop_back();
  return buffer;
}

void CaptureNode::giveBuffer(cv::Mat buffer) {
  const std::lock_guard<std::mutex> lock(buffers_mutex_);
  if (buffers_.size() < kSpareBuffers) buffers_.push_back(std::move(buffer));
}

void CaptureNode::onState(const FlightState::ConstPtr& state) {
  const std::int64_t now_ns = pairingNow();
  pairing_->addState(state, now_ns, picture_clock_.fromWall(static_cast<std::int64_t>(state->header.stamp.toNSec())));
  const std::lock_guard<std::mutex> lock(capture_mutex_);
  if (!moved_from_ || moved(*moved_from_, *state)) {
    if (moved_from_) frozen_check_.stateMoved(now_ns);
    moved_from_ = state;
  }
}

// --- diagnostics -----------------------------------------------------------------------------------------------------

void CaptureNode::diagnoseCapture(diagnostic_updater::DiagnosticStatusWrapper* status) {
  const std::lock_guard<std::mutex> lock(capture_mutex_);
  double read = 0.0;
  if (!reads_.empty()) {
    std::sort(reads_.begin(), reads_.end());
    read = reads_[reads_.size() / 2];
  }
  if (!source_problem_.empty()) {
    status->summary(diagnostic_msgs::DiagnosticStatus::ERROR, "no picture: " + source_problem_);
  } else if (frozen_ && crashed_) {
    status->summary(diagnostic_msgs::DiagnosticStatus::WARN, "the picture stands still: the aircraft has crashed");
  } else if (frozen_) {
    status->summary(diagnostic_msgs::DiagnosticStatus::ERROR, "frozen: the aircraft moves, the picture does not");
  } else if (black_) {
    status->summary(diagnostic_msgs::DiagnosticStatus::WARN, "the picture is black");
  } else if (read > kSlowRead) {
    status->summaryf(diagnostic_msgs::DiagnosticStatus::WARN, "reading a picture takes %.1f ms", 1e3 * read);
  } else {
    status->summary(diagnostic_msgs::DiagnosticStatus::OK, hasSubscribers() ? "capturing" : "no subscriber");
  }
  status->add("Source", source_description_);
  status->add("Changes of the picture", changes_);
  status->add("Pictures taken", grabbed_);
  status->add("Pictures left out (above max_rate, or no subscriber)", skipped_);
  status->add("Pictures dropped (no time to scale)", publisher_ ? publisher_->dropped() : 0);
  status->add("JPEG dropped (no time to encode)", encoder_ ? encoder_->dropped() : 0);
  const vision::PeriodMeter::Summary periods = periods_.summary();
  status->addf("Period of pictures, mean (ms)", "%.1f", 1e3 * periods.mean);
  status->addf("Period of pictures, 99 of 100 (ms)", "%.1f", 1e3 * periods.p99);
  status->addf("Period of pictures, worst (ms)", "%.1f", 1e3 * periods.worst);
  status->add("Periods counted (-)", periods.count);
  status->add("Change to grab, mean (ms)", grab_ages_ > 0 ? 1e3 * grab_age_sum_ / grab_ages_ : 0.0);
  status->add("Change to grab, longest (ms)", 1e3 * grab_age_max_);
  status->addf("Reading a picture, median (ms)", "%.2f", 1e3 * read);
  status->addf("Reading a picture, longest (ms)", "%.2f", reads_.empty() ? 0.0 : 1e3 * reads_.back());
  reads_.clear();
  grab_age_sum_ = grab_age_max_ = 0.0;
  grab_ages_ = 0;
}

void CaptureNode::diagnosePairing(diagnostic_updater::DiagnosticStatusWrapper* status) {
  const ImagePairing::Report report = pairing_->report();
  const core::AssociationCounters& counters = report.counters;
  if (counters.images == 0) {
    status->summary(diagnostic_msgs::DiagnosticStatus::OK, "no picture paired yet");
  } else if (!report.clock_fitted) {
    status->summary(diagnostic_msgs::DiagnosticStatus::WARN, "the simulator's clock is not known here");
  } else if ((counters.without_state - reported_.without_state) * 10 > counters.images - reported_.images) {
    status->summary(diagnostic_msgs::DiagnosticStatus::WARN, "many pictures have no state: does rx_node run?");
  } else {
    status->summary(diagnostic_msgs::DiagnosticStatus::OK, "paired");
  }
  reported_ = counters;
  status->add("Pictures", counters.images);
  status->add("With the state of their frame", counters.by_frame);
  status->add("With the nearest state", counters.by_nearest);
  status->add("Interpolated", counters.interpolated);
  status->add("By stamps alone", counters.by_stamp);
  status->add("While paused", counters.paused);
  status->add("Without a state", counters.without_state);
  status->add("Half way between two frames", counters.ambiguous);
  {
    const std::lock_guard<std::mutex> lock(camera_mutex_);
    status->add("Camera's angles are read as", camera_known_ ? pose_report_ : "X-Plane is not heard");
    status->add("Camera's lever arm moves by (mm)", 1e3 * lever_scatter_);
  }
  status->add("Frames put in for lost datagrams", counters.frames_inferred);
  status->add("Display delay applied (ms)", 1e3 * report.display_delay);
  status->add("Display beyond that, mean (ms)", 1e3 * report.mean_offset);
  status->add("Clock uncertainty (ms)", 1e3 * report.clock_uncertainty);
  status->add("State spacing over frame spacing (-)", report.state_to_frame_ratio);
}

}  // namespace xplane_bridge
