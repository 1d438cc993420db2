#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/vision/frame_source.hpp"

namespace xplane_bridge::vision {

/// How a change of the window is noticed; X-Plane's changes with each frame [? window-changes].
enum class ChangeDetection {
  kAuto,      ///< XDamage events; a checksum as soon as the window changes without any event
  kDamage,    ///< XDamage events only
  kChecksum,  ///< sparse checksum, polled
  kNone,      ///< not at all: pictures are read at the polling period and their display time is unknown
};

/// @throws std::invalid_argument unless `name` is auto, damage, checksum or none.
[[nodiscard]] ChangeDetection changeDetectionFromName(const std::string& name);

/// What X-Plane calls its window: "X-System" up to early 12 on every system, "X-Plane" since (smiley22/XPPlugins #14).
const std::vector<std::string>& xplaneWindowTitles();

/// Which part of which screen. At most one of title, class_name, window_id and region is given; none: X-Plane's own
/// window, which has exactly one of xplaneWindowTitles(). Of several windows that fit, the one whose process is X-Plane
/// is preferred, then one with exactly the title, then the largest, or, of such that are alike in both, number `index`
/// or the one at `point`.
struct X11SourceOptions {
  std::string display;          ///< X display, e.g. ":0"; empty = $DISPLAY
  std::string title;            ///< part of the window's title
  bool title_is_regex = false;  ///< `title` is an ECMAScript regular expression, searched for
  std::string class_name;       ///< WM_CLASS, either of its two strings, exact
  std::uint32_t window_id = 0;  ///< as xwininfo prints it
  cv::Rect region;              ///< [px] part of the screen, top left corner first
  int index = -1;               ///< of windows alike, counted from 0, the leftmost, then the topmost; -1: the largest
  std::optional<cv::Point> point;  ///< [px] of windows alike, those that cover this point of the screen; not with index

  ChangeDetection change_detection = ChangeDetection::kAuto;
  bool use_composite = true;      ///< read the window also when covered or off the screen
  bool use_shared_memory = true;  ///< MIT-SHM where the server can; false: through the socket
  double poll_period = 0.002;     ///< [s] of the checksum, (0, 1]
  double search_period = 0.25;    ///< [s] between two looks for a window that is not there, (0, 60]
};

/// Pictures of a window (or a part of the screen) of an X server, over a connection of its own.
///
/// The window is followed: moved, resized, covered, hidden with the window manager's frame about it and shown again,
/// closed and opened again, and so is the X server itself. Every request is checked, so a window that vanishes between
/// two requests is a kLost and nothing worse. The pointer is never in the picture.
class X11WindowSource : public FrameSource {
 public:
  /// @throws std::invalid_argument when the options contradict each other. A display that cannot be reached does not
  ///         throw: it is looked for again.
  X11WindowSource(const X11SourceOptions& options, Clock clock);
  ~X11WindowSource() override;

  [[nodiscard]] WaitResult waitChange(std::chrono::milliseconds timeout, Change& change) override;
  [[nodiscard]] GrabResult grab(const Change& change, Picture& picture) override;
  void lookAnew() override;
  [[nodiscard]] std::string describe() const override;
  [[nodiscard]] std::string problem() const override;

  /// Window that is captured now (the root window for a region); empty while there is none.
  [[nodiscard]] std::optional<std::uint32_t> window() const;

  /// Whether changes come from XDamage at present.
  [[nodiscard]] bool usesDamage() const;

  /// Whether pictures come through shared memory at present.
  [[nodiscard]] bool usesSharedMemory() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace xplane_bridge::vision
