#include "xplane_bridge/nodes/capture/capture_options.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "xplane_bridge/nodes/base/common_options.hpp"

namespace xplane_bridge {
namespace {

constexpr int kSmallestSide = 16;
constexpr int kLargestSide = 8192;
constexpr core::CameraView kNominalViews[] = {core::CameraView::kForward, core::CameraView::kRear,
                                              core::CameraView::kDown};

std::uint32_t windowId(const ParamLoader& window) {
  const std::string text = window.text("id", "");
  if (text.empty()) return 0;
  char* end = nullptr;
  errno = 0;
  const unsigned long value = std::strtoul(text.c_str(), &end, 0);
  if (errno != 0 || *end != '\0' || value == 0 || value > std::numeric_limits<std::uint32_t>::max()) {
    window.refuse("id", "a window id as xwininfo prints it, in quotes, e.g. \"0x3a00007\"");
  }
  return static_cast<std::uint32_t>(value);
}

/// Half a pixel is a mistake: it is refused, not cut off.
bool areWhole(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double number) { return number == std::floor(number); });
}

cv::Rect region(const ParamLoader& window) {
  const std::vector<double> numbers = window.numbers("region", {0.0, 65535.0});
  if (numbers.empty()) return {};
  const auto whole = [](double number) { return static_cast<int>(number); };
  if (numbers.size() != 4 || !areWhole(numbers) || whole(numbers[2]) < 1 || whole(numbers[3]) < 1) {
    window.refuse("region", "[x, y, width, height] in pixels of the screen, or []");
  }
  return {whole(numbers[0]), whole(numbers[1]), whole(numbers[2]), whole(numbers[3])};
}

vision::X11SourceOptions loadWindow(const ParamLoader& window) {
  vision::X11SourceOptions x11;
  x11.display = window.text("display", "");
  x11.class_name = window.text("class", "");
  x11.window_id = windowId(window);
  x11.region = region(window);
  x11.title = window.text("title", "");
  x11.index = window.integer("index", {-1, 99}, x11.index);
  const std::vector<double> point = window.numbers("point", {-65535.0, 65535.0});
  if (!point.empty() && (point.size() != 2 || !areWhole(point))) {
    window.refuse("point", "[x, y] in pixels of the screen, or []");
  }
  if (!point.empty()) x11.point = cv::Point(static_cast<int>(point[0]), static_cast<int>(point[1]));
  x11.title_is_regex = window.boolean("title_is_regex", false);
  x11.change_detection = vision::changeDetectionFromName(
      window.choice("change_detection", {"auto", "damage", "checksum", "none"}, "auto"));
  x11.use_composite = window.boolean("composite", true);
  x11.use_shared_memory = window.boolean("shared_memory", true);
  x11.poll_period = window.number("poll_period", {0.0005, 1.0}, x11.poll_period);
  x11.search_period = window.number("search_period", {0.01, 60.0}, x11.search_period);
  return x11;
}

Eigen::Quaterniond mount(const ParamLoader& angles) {
  const double roll = angles.number("roll_deg", {-180.0, 180.0}, 0.0);
  const double pitch = angles.number("pitch_deg", {-90.0, 90.0}, 0.0);
  const double heading = angles.number("heading_deg", {-180.0, 180.0}, 0.0);
  return core::opticalOrientation(0.0, 0.0, 0.0).inverse() * core::opticalOrientation(roll, pitch, heading);
}

/// Each is a transform of its own, so each has a name of its own.
void loadFrames(const ParamLoader& own, CaptureOptions* options) {
  std::map<std::string, std::string> keys;  // by frame
  const auto frame = [&](const std::string& key, const std::string& fallback) {
    std::string name = loadFrameName(own, key, fallback);
    const auto [same, is_new] = keys.emplace(name, key);
    // Of two equal names one may be a default, which cannot be refused.
    if (!is_new) own.refuse(own.has(key) ? key : same->second, "another name than that of the other frame_*");
    return name;
  };
  for (const core::CameraView view : kNominalViews) {
    const std::string name = core::toString(view);
    options->frame_ids[static_cast<std::size_t>(view)] = frame("frame_" + name, "camera_" + name + "_optical");
  }
  options->measured_frame = frame("frame_measured", "camera_optical");
}

/// The section of parameters that belongs to a source.
const char* sectionOf(CaptureOptions::Source source) {
  switch (source) {
    case CaptureOptions::Source::kVideo:
      return "video";
    case CaptureOptions::Source::kSender:
      return "sender";
    default:
      return "window";
  }
}

}  // namespace

CaptureOptions loadCaptureOptions(const ParamLoader& own) {
  CaptureOptions options;
  const std::string source = own.choice("source", {"x11", "video", "sender"}, "x11");
  if (source == "video") options.source = CaptureOptions::Source::kVideo;
  if (source == "sender") options.source = CaptureOptions::Source::kSender;
  options.x11 = loadWindow(own.section("window"));
  const ParamLoader video = own.section("video");
  options.video.address = video.text("address", "");
  options.video.loop = video.boolean("loop", false);
  options.video.retry_period = video.number("retry_period", {0.01, 60.0}, options.video.retry_period);
  if (options.source == CaptureOptions::Source::kVideo && options.video.address.empty()) {
    video.refuse("address", "a device, a file or a URL when `source` is video");
  }
  const ParamLoader sender = own.section("sender");
  options.sender.listen = sender.text("listen", "");
  options.sender.peer = sender.text("peer", "");
  options.sender.token = sender.text("token", "");

  options.width = own.integer("width", {kSmallestSide, kLargestSide}, options.width);
  options.height = own.integer("height", {kSmallestSide, kLargestSide}, options.height);
  options.fit = vision::fitModeFromName(own.choice("fit", {"crop", "letterbox", "stretch"}, "crop"));
  options.max_rate = own.number("max_rate", {0.0, 1000.0}, options.max_rate);
  options.jpeg_quality = own.integer("jpeg_quality", {1, 100}, options.jpeg_quality);

  options.field_of_view_deg = own.number("field_of_view_deg", {1.0, 170.0}, options.field_of_view_deg);
  options.set_field_of_view = own.boolean("set_field_of_view", false);
  options.own_field_of_view = own.boolean("own_field_of_view", false);
  if (options.own_field_of_view && options.set_field_of_view) {
    own.refuse("own_field_of_view", "false where set_field_of_view is true: X-Plane takes that for its main view");
  }
  options.mount = mount(own.section("mount"));
  const std::string view = own.choice("assumed_view", {"forward", "rear", "down"}, "forward");
  for (const core::CameraView candidate : kNominalViews) {
    if (core::toString(candidate) == view) options.assumed_view = candidate;
  }
  loadFrames(own, &options);
  options.nominal_frames = own.boolean("nominal_frames", false);
  options.view_tolerance_deg = own.number("view_tolerance_deg", {0.0, 40.0}, options.view_tolerance_deg);
  const std::vector<double> offset = own.numbers("camera_offset", {-100.0, 100.0});
  if (!offset.empty()) {
    if (offset.size() != options.camera_offset.size()) own.refuse("camera_offset", "[forward, left, up] in metres");
    std::copy(offset.begin(), offset.end(), options.camera_offset.begin());
  }

  options.max_wait = own.number("max_wait", {0.0, 10.0}, options.max_wait);
  options.frozen_after = own.number("frozen_after", {0.05, 3600.0}, options.frozen_after);
  try {
    (void)makeSource(options, [] { return std::int64_t{0}; });
  } catch (const std::invalid_argument& error) {
    throw ParamError(own.fullKey(sectionOf(options.source)) + ": " + error.what());
  }
  return options;
}

void CaptureOptions::prefixFrames(const std::string& prefix) {
  for (std::string& frame : frame_ids) frame.insert(0, prefix);
  measured_frame.insert(0, prefix);
}

std::unique_ptr<vision::FrameSource> makeSource(const CaptureOptions& options, vision::Clock clock) {
  switch (options.source) {
    case CaptureOptions::Source::kVideo:
      return std::make_unique<vision::VideoSource>(options.video, std::move(clock));
    case CaptureOptions::Source::kSender:
      return std::make_unique<vision::SenderSource>(options.sender, std::move(clock));
    default:
      return std::make_unique<vision::X11WindowSource>(options.x11, std::move(clock));
  }
}

}  // namespace xplane_bridge
