// A window like a simulator's: every pixel changes with every picture, and each picture says its number and when it was
// drawn. Through shared memory, one request a picture. Periods vary by 15 % (seeded), so that no reader runs in step
// with it.
//
//   bench_window title=TEXT width=PX height=PX fps=RATE
//
// Prints READY when the window is there. DISPLAY says where.

#include <sys/ipc.h>
#include <sys/shm.h>
#include <xcb/shm.h>
#include <xcb/xcb.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <stdexcept>

#include "bench_picture.hpp"
#include "bench_settings.hpp"

namespace {

using namespace xplane_bridge::bench;

constexpr std::size_t kChannels = 4;
constexpr double kJitter = 0.15;

class Window {
 public:
  explicit Window(const Settings& settings)
      : width_(static_cast<std::uint16_t>(settings.number("width"))),
        height_(static_cast<std::uint16_t>(settings.number("height"))) {
    connection_ = xcb_connect(nullptr, nullptr);
    if (xcb_connection_has_error(connection_) != 0) throw std::runtime_error("no X display");
    const xcb_screen_t* screen = xcb_setup_roots_iterator(xcb_get_setup(connection_)).data;
    if (screen->root_depth != 24) throw std::runtime_error("expected a screen of depth 24");
    window_ = xcb_generate_id(connection_);
    const std::uint32_t values[] = {screen->black_pixel, 1};
    xcb_create_window(connection_, XCB_COPY_FROM_PARENT, window_, screen->root, 0, 0, width_, height_, 0,
                      XCB_WINDOW_CLASS_INPUT_OUTPUT, screen->root_visual, XCB_CW_BACK_PIXEL | XCB_CW_OVERRIDE_REDIRECT,
                      values);
    const std::string title = settings.text("title");
    xcb_change_property(connection_, XCB_PROP_MODE_REPLACE, window_, XCB_ATOM_WM_NAME, XCB_ATOM_STRING, 8,
                        static_cast<std::uint32_t>(title.size()), title.data());
    graphics_ = xcb_generate_id(connection_);
    xcb_create_gc(connection_, graphics_, window_, 0, nullptr);
    xcb_map_window(connection_, window_);
    attach();
    sync();
  }

  void draw(std::uint32_t frame) {
    const Drawn drawn{frame, wallTime()};
    // A pattern that moves down by a row each time.
    for (std::size_t y = 0; y < height_; ++y) {
      std::memcpy(pixels_ + y * stride(), pattern_.data() + (y + frame % height_) * stride(), stride());
    }
    drawStrip(drawn, pixels_, stride(), kChannels);
    xcb_shm_put_image(connection_, window_, graphics_, width_, height_, 0, 0, width_, height_, 0, 0, 24,
                      XCB_IMAGE_FORMAT_Z_PIXMAP, 0, segment_, 0);
    sync();
  }

 private:
  std::size_t stride() const { return width_ * kChannels; }

  void attach() {
    const int handle = shmget(IPC_PRIVATE, stride() * height_, IPC_CREAT | 0600);
    if (handle < 0) throw std::runtime_error("no shared memory");
    pixels_ = static_cast<std::uint8_t*>(shmat(handle, nullptr, 0));
    segment_ = xcb_generate_id(connection_);
    xcb_shm_attach(connection_, segment_, static_cast<std::uint32_t>(handle), 0);
    sync();
    shmctl(handle, IPC_RMID, nullptr);
    pattern_.resize(2 * stride() * height_);
    for (std::size_t at = 0; at < pattern_.size(); ++at) {
      pattern_[at] = static_cast<std::uint8_t>((at / stride()) * 3 + (at % stride()) * 7);
    }
  }

  void sync() { std::free(xcb_get_input_focus_reply(connection_, xcb_get_input_focus(connection_), nullptr)); }

  std::uint16_t width_;
  std::uint16_t height_;
  xcb_connection_t* connection_ = nullptr;
  xcb_window_t window_ = 0;
  xcb_gcontext_t graphics_ = 0;
  xcb_shm_seg_t segment_ = 0;
  std::uint8_t* pixels_ = nullptr;
  std::vector<std::uint8_t> pattern_;
};

}  // namespace

int main(int argc, char** argv) {
  try {
    const Settings settings(argc, argv);
    Window window(settings);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> jitter(1.0 - kJitter, 1.0 + kJitter);
    const double period_ns = 1e9 / settings.number("fps");
    std::int64_t due = now_ns();
    for (std::uint32_t frame = 1;; ++frame) {
      window.draw(frame);
      if (frame == 1) {
        std::printf("READY\n");
        std::fflush(stdout);
      }
      due = std::max(due + static_cast<std::int64_t>(period_ns * jitter(random)), now_ns());
      sleepUntil(due);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_window: %s\n", error.what());
    return 1;
  }
}
