#pragma once

#include <xcb/xcb.h>

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "xplane_bridge/vision/pixel_format.hpp"
#include "xplane_bridge/vision/x11_window_source.hpp"

namespace xplane_bridge::vision {

struct FreeDeleter {
  void operator()(void* memory) const { std::free(memory); }
};

/// What XCB allocates with malloc.
template <class T>
using XcbPointer = std::unique_ptr<T, FreeDeleter>;

/// A connection to an X server with the extensions a capture needs. All requests are checked; the connection never
/// ends the process, and after an error of the connection itself alive() is false.
class X11Connection {
 public:
  /// Connects. @throws std::runtime_error with a sentence for people.
  explicit X11Connection(const std::string& display);
  ~X11Connection();
  X11Connection(const X11Connection&) = delete;
  X11Connection& operator=(const X11Connection&) = delete;

  [[nodiscard]] xcb_connection_t* get() const { return connection_; }
  [[nodiscard]] xcb_window_t root() const { return screen_->root; }
  [[nodiscard]] const std::string& displayName() const { return display_name_; }
  [[nodiscard]] bool alive() const { return xcb_connection_has_error(connection_) == 0; }
  [[nodiscard]] bool hasComposite() const { return has_composite_; }
  [[nodiscard]] bool hasDamage() const { return has_damage_; }
  [[nodiscard]] bool hasShm() const { return has_shm_; }
  [[nodiscard]] std::uint8_t damageEvent() const { return damage_event_; }

  /// True when the request succeeded; its error, if any, is swallowed.
  [[nodiscard]] bool succeeded(xcb_void_cookie_t cookie) const;

  /// Asks for the server's time so many times, and hands over each as it comes [ms]. Events of windows that come
  /// meanwhile are lost, so it is asked before any are wanted.
  void askTime(int times, const std::function<void(std::uint32_t)>& heard) const;

  /// Pixel format of a window's visual; empty when the server does not list it.
  [[nodiscard]] std::optional<PixelFormat> pixelFormat(xcb_visualid_t visual, int depth) const;

  struct Found {
    std::optional<xcb_window_t> window;
    std::vector<xcb_window_t> alike;   ///< those that fit as well, this one included
    std::vector<xcb_window_t> beside;  ///< also those that are hidden or fit less well, but none that fits better
    std::vector<std::string> titles;   ///< of all viewable windows that have one
  };
  /// Viewable window that fits best, see X11SourceOptions.
  [[nodiscard]] Found findWindow(const X11SourceOptions& options) const;

  /// Title of a window, as UTF-8 where the window gives it so.
  [[nodiscard]] std::string title(xcb_window_t window) const;

 private:
  [[nodiscard]] std::vector<xcb_window_t> allWindows() const;
  [[nodiscard]] std::string textProperty(xcb_window_t window, xcb_atom_t property) const;
  [[nodiscard]] xcb_atom_t atom(const char* name) const;
  [[nodiscard]] bool viewable(xcb_window_t window) const;
  [[nodiscard]] bool fits(xcb_window_t window, const X11SourceOptions& options, const std::string& title) const;
  /// Its process runs on this computer and is called X-Plane or X-Plane-x86_64.
  [[nodiscard]] bool isXPlanes(xcb_window_t window) const;
  [[nodiscard]] std::uint32_t area(xcb_window_t window) const;
  /// [px] of its upper left corner on the screen: x, y
  [[nodiscard]] std::pair<int, int> corner(xcb_window_t window) const;
  /// Whether a point [px] of the screen lies in it.
  [[nodiscard]] bool covers(xcb_window_t window, cv::Point point) const;

  xcb_connection_t* connection_;
  xcb_screen_t* screen_ = nullptr;
  std::string display_name_;
  bool has_composite_ = false;
  bool has_damage_ = false;
  bool has_shm_ = false;
  std::uint8_t damage_event_ = 0;
  xcb_atom_t net_wm_name_ = XCB_ATOM_NONE;
  xcb_atom_t net_wm_pid_ = XCB_ATOM_NONE;
};

}  // namespace xplane_bridge::vision
