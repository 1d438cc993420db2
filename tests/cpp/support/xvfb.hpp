#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xcb/xcb.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace xplane_bridge::test {

/// An X server of the test's own, on a display number the server chooses; gone with the object.
class Xvfb {
 public:
  /// @param depth [bit] of the root window
  explicit Xvfb(int depth = 24, const std::vector<std::string>& more = {}, const std::string& number = "") {
    int channel[2];
    if (pipe(channel) != 0) throw std::runtime_error("pipe failed");
    pid_ = fork();
    if (pid_ == 0) {
      const std::string screen = "800x600x" + std::to_string(depth);
      const std::string descriptor = std::to_string(channel[1]);
      std::vector<std::string> words{"Xvfb", "-displayfd", descriptor, "-screen", "0", screen, "-nolisten", "tcp"};
      if (!number.empty()) words.insert(words.begin() + 1, number);
      words.insert(words.end(), more.begin(), more.end());
      std::vector<char*> arguments;
      for (std::string& word : words) arguments.push_back(word.data());
      arguments.push_back(nullptr);
      const int null = open("/dev/null", O_WRONLY);
      dup2(null, STDERR_FILENO);
      execvp("Xvfb", arguments.data());
      _exit(127);
    }
    close(channel[1]);
    std::string answer;
    pollfd waiting{channel[0], POLLIN, 0};
    while (answer.find('\n') == std::string::npos && ::poll(&waiting, 1, 30000) == 1) {
      char byte = 0;
      if (read(channel[0], &byte, 1) != 1) break;
      answer += byte;
    }
    close(channel[0]);
    if (answer.empty()) {
      stop();
      throw std::runtime_error("Xvfb did not start; install it: apt-get install xvfb");
    }
    display_ = ":" + answer.substr(0, answer.find('\n'));
  }
  Xvfb(const Xvfb&) = delete;
  Xvfb& operator=(const Xvfb&) = delete;
  ~Xvfb() { stop(); }

  void stop() {
    if (pid_ <= 0) return;
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

  [[nodiscard]] const std::string& display() const { return display_; }

 private:
  pid_t pid_ = 0;
  std::string display_;
};

/// A window that draws what the test says.
class TestWindow {
 public:
  /// @param depth [bit] of its visual; 0: the screen's
  TestWindow(const std::string& display, const std::string& title, int width, int height, int x = 10, int y = 20,
             int border = 0, int depth = 0)
      : width_(width), height_(height) {
    connection_ = xcb_connect(display.c_str(), nullptr);
    if (xcb_connection_has_error(connection_) != 0) throw std::runtime_error("no connection to " + display);
    screen_ = xcb_setup_roots_iterator(xcb_get_setup(connection_)).data;
    window_ = xcb_generate_id(connection_);
    const xcb_visualid_t visual = depth == 0 ? screen_->root_visual : visualOf(depth);
    const xcb_colormap_t colours = xcb_generate_id(connection_);
    xcb_create_colormap(connection_, XCB_COLORMAP_ALLOC_NONE, colours, screen_->root, visual);
    // A window of another depth than its parent's needs a border pixel and a colour map of its own.
    const std::uint32_t values[] = {screen_->black_pixel, screen_->black_pixel, 1, colours};
    xcb_create_window(connection_,
                      depth == 0 ? static_cast<std::uint8_t>(XCB_COPY_FROM_PARENT) : static_cast<std::uint8_t>(depth),
                      window_, screen_->root, static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                      static_cast<std::uint16_t>(width), static_cast<std::uint16_t>(height),
                      static_cast<std::uint16_t>(border), XCB_WINDOW_CLASS_INPUT_OUTPUT, visual,
                      XCB_CW_BACK_PIXEL | XCB_CW_BORDER_PIXEL | XCB_CW_OVERRIDE_REDIRECT | XCB_CW_COLORMAP, values);
    xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, XCB_ATOM_WM_NAME, XCB_ATOM_STRING, 8,
                        static_cast<std::uint32_t>(title.size()), title.data());
    const std::string klass = std::string("xp_instance") + '\0' + "XpClass" + '\0';
    xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, XCB_ATOM_WM_CLASS, XCB_ATOM_STRING, 8,
                        static_cast<std::uint32_t>(klass.size()), klass.data());
    graphics_ = xcb_generate_id(connection_);
    xcb_create_gc(connection_, graphics_, window_, 0, nullptr);
    xcb_map_window(connection_, window_);
    sync();
  }
  TestWindow(const TestWindow&) = delete;
  TestWindow& operator=(const TestWindow&) = delete;
  ~TestWindow() { xcb_disconnect(connection_); }

  /// Fills a rectangle with a pixel value of the window's own visual.
  void fill(std::uint32_t pixel, int x, int y, int width, int height) {
    xcb_change_gc(connection_, graphics_, XCB_GC_FOREGROUND, &pixel);
    const xcb_rectangle_t rectangle{static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                                    static_cast<std::uint16_t>(width), static_cast<std::uint16_t>(height)};
    xcb_poly_fill_rectangle(connection_, window_, graphics_, 1, &rectangle);
    sync();
  }
  void fill(std::uint32_t pixel) { fill(pixel, 0, 0, width_, height_); }

  void move(int x, int y) { configure(XCB_CONFIG_WINDOW_X | XCB_CONFIG_WINDOW_Y, x, y); }
  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    configure(XCB_CONFIG_WINDOW_WIDTH | XCB_CONFIG_WINDOW_HEIGHT, width, height);
  }
  void unmap() {
    xcb_unmap_window(connection_, window_);
    sync();
  }
  void map() {
    xcb_map_window(connection_, window_);
    sync();
  }
  void destroy() {
    xcb_destroy_window(connection_, window_);
    sync();
  }
  [[nodiscard]] std::uint32_t id() const { return window_; }

  /// Says which process it belongs to, as toolkits do (_NET_WM_PID).
  void ownedBy(std::uint32_t process, const std::string& host) {
    const char name[] = "_NET_WM_PID";
    xcb_intern_atom_reply_t* reply =
        xcb_intern_atom_reply(connection_, xcb_intern_atom(connection_, 0, sizeof name - 1, name), nullptr);
    if (reply == nullptr) throw std::runtime_error("no atom _NET_WM_PID");
    xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, reply->atom, XCB_ATOM_CARDINAL, 32, 1, &process);
    std::free(reply);
    xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, XCB_ATOM_WM_CLIENT_MACHINE, XCB_ATOM_STRING, 8,
                        static_cast<std::uint32_t>(host.size()), host.data());
    sync();
  }

  /// Returns after the server has done everything asked so far.
  void sync() { std::free(xcb_get_input_focus_reply(connection_, xcb_get_input_focus(connection_), nullptr)); }

 private:
  xcb_visualid_t visualOf(int depth) const {
    for (auto d = xcb_screen_allowed_depths_iterator(screen_); d.rem > 0; xcb_depth_next(&d)) {
      if (d.data->depth == depth && d.data->visuals_len > 0) return xcb_depth_visuals(d.data)->visual_id;
    }
    throw std::runtime_error("the X server has no visual of depth " + std::to_string(depth));
  }

  void configure(std::uint16_t mask, int first, int second) {
    const std::uint32_t values[] = {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(second)};
    xcb_configure_window(connection_, window_, mask, values);
    sync();
  }

  int width_;
  int height_;
  xcb_connection_t* connection_;
  xcb_screen_t* screen_ = nullptr;
  xcb_window_t window_ = 0;
  xcb_gcontext_t graphics_ = 0;
};

}  // namespace xplane_bridge::test
