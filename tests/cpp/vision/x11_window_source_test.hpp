#pragma once

// What the tests of X11WindowSource share: a screen, and waiting for what its windows show.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <string>

#include "xplane_bridge/vision/x11_window_source.hpp"
#include "xvfb.hpp"

namespace vision = xplane_bridge::vision;
using std::chrono::milliseconds;
using vision::Change;
using vision::ChangeDetection;
using vision::GrabResult;
using vision::Picture;
using vision::WaitResult;
using vision::X11SourceOptions;
using vision::X11WindowSource;
using xplane_bridge::test::TestWindow;
using xplane_bridge::test::Xvfb;

inline std::int64_t steadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

inline constexpr milliseconds kDeadline{10000};
inline constexpr milliseconds kShort{50};

inline cv::Vec3b pixelAt(const cv::Mat& picture, int x, int y) {
  const std::uint8_t* pixel = picture.ptr<std::uint8_t>(y) + static_cast<std::ptrdiff_t>(x) * picture.channels();
  return {pixel[0], pixel[1], pixel[2]};
}

/// Takes pictures until one is new; false at the deadline.
inline bool nextPicture(X11WindowSource& source, Picture& picture) {
  const auto deadline = std::chrono::steady_clock::now() + kDeadline;
  while (std::chrono::steady_clock::now() < deadline) {
    Change change;
    if (source.waitChange(kShort, change) != WaitResult::kChange) continue;
    if (source.grab(change, picture) == GrabResult::kNew) return true;
  }
  return false;
}

/// Waits until the source reports that there is nothing to capture.
inline bool becomesLost(X11WindowSource& source) {
  const auto deadline = std::chrono::steady_clock::now() + kDeadline;
  while (std::chrono::steady_clock::now() < deadline) {
    Change change;
    Picture picture;
    const WaitResult result = source.waitChange(kShort, change);
    if (result == WaitResult::kLost) return true;
    if (result == WaitResult::kChange && source.grab(change, picture) == GrabResult::kLost) return true;
  }
  return false;
}

/// Waits until what the source says of its problem contains a text.
inline bool saysSo(X11WindowSource& source, const std::string& text) {
  const auto deadline = std::chrono::steady_clock::now() + kDeadline;
  while (std::chrono::steady_clock::now() < deadline) {
    Change change;
    (void)source.waitChange(kShort, change);
    if (source.problem().find(text) != std::string::npos) return true;
  }
  return false;
}

/// True when no new picture comes within a while.
inline bool staysQuiet(X11WindowSource& source) {
  Change change;
  Picture picture;
  const auto until = std::chrono::steady_clock::now() + milliseconds(100);
  while (std::chrono::steady_clock::now() < until) {
    if (source.waitChange(milliseconds(20), change) != WaitResult::kChange) continue;
    if (source.grab(change, picture) == GrabResult::kNew) return false;
  }
  return true;
}

/// Makes a window the child of another one, as window managers do.
inline void putInto(const TestWindow& frame, const TestWindow& window, const Xvfb& server) {
  xcb_connection_t* connection = xcb_connect(server.display().c_str(), nullptr);
  std::free(xcb_request_check(connection, xcb_reparent_window_checked(connection, window.id(), frame.id(), 5, 5)));
  xcb_disconnect(connection);
}

inline X11SourceOptions titled(const Xvfb& server, const std::string& title = "X-System") {
  X11SourceOptions options;
  options.display = server.display();
  options.title = title;
  options.search_period = 0.02;
  return options;
}

inline const cv::Vec3b kRed(0, 0, 255);
inline const cv::Vec3b kGreen(0, 255, 0);
inline const cv::Vec3b kBlue(255, 0, 0);

class X11WindowSourceTest : public ::testing::Test {
 protected:
  Xvfb server_;
  Picture picture_;
};
