#include "xplane_bridge/vision/x11_window_source.hpp"

#include <poll.h>
#include <xcb/composite.h>
#include <xcb/damage.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "x11_connection.hpp"
#include "x11_grabber.hpp"
#include "x11_selection.hpp"
#include "xplane_bridge/vision/server_clock.hpp"

namespace xplane_bridge::vision {
namespace {

using SteadyClock = std::chrono::steady_clock;

// Changes seen in the checksum while no damage event came: so often, and XDamage is not to be relied on here.
constexpr int kSilentChangesToGiveUpDamage = 3;
// The quickest answer of so many shows how the server's clock stands to ours.
constexpr int kTimesAsked = 10;
// A look at the checksum that comes so much later than the quickest of the last ones does not date a change.
constexpr std::int64_t kLateLookNs = 4'000'000;
constexpr std::size_t kLooks = 31;
// Pause between two of those looks; long enough to cost nothing.
constexpr std::chrono::milliseconds kDamageWatch{250};

std::chrono::nanoseconds seconds(double value) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(value * 1e9));
}

bool contains(const std::vector<xcb_window_t>& windows, xcb_window_t window) {
  return std::find(windows.begin(), windows.end(), window) != windows.end();
}

}  // namespace

class X11WindowSource::Impl {
 public:
  Impl(const X11SourceOptions& options, Clock clock) : options_(options), clock_(std::move(clock)) {
    validate(options_);
    wanted_ = selection(options_);
    problem_ = wanted_ + " was not looked for yet";
  }

  ~Impl() { release(); }

  WaitResult waitChange(std::chrono::milliseconds timeout, Change& change) {
    const auto deadline = SteadyClock::now() + timeout;
    do {
      if (!ensureTarget()) {
        sleepUntil(std::min(deadline, next_search_));
        if (SteadyClock::now() >= deadline) return WaitResult::kLost;
        continue;
      }
      if (handleEvents(change)) return WaitResult::kChange;
      if (target_.window == XCB_NONE) continue;
      if (pollsNow()) {
        if (poll(change)) return WaitResult::kChange;
        continue;  // its replies may have brought events along, which would not end a sleep
      }
      sleepUntil(std::min(deadline, nextWake()));
    } while (SteadyClock::now() < deadline);
    if (target_.window == XCB_NONE) return WaitResult::kLost;
    return handleEvents(change) ? WaitResult::kChange : WaitResult::kTimeout;
  }

  GrabResult grab(const Change& change, Picture& picture) {
    if (target_.window == XCB_NONE || !grabber_) return GrabResult::kLost;
    const std::int64_t began_ns = clock_();
    std::uint8_t* data = grabber_->read();
    picture.grab_time_ns = clock_();
    if (data == nullptr) {
      // The window may have been resized under our feet; the next wait finds out.
      lose(connection_->alive() ? unreadable() : connectionLost());
      next_search_ = SteadyClock::now();
      return GrabResult::kLost;
    }
    const Change shown = lastChangeBeforeRead(change, data, picture.grab_time_ns);
    looked_ns_ = began_ns;
    if (grabber_->sameAsBefore()) return GrabResult::kSame;
    picture.display_time_ns = shown.time_ns;
    picture.display_time_known = shown.time_known;
    picture.bgr = toBgr(target_.format, data, grabber_->area().width, grabber_->area().height, converted_);
    return GrabResult::kNew;
  }

  void lookAnew() {
    if (!grabber_) return;
    first_picture_ = true;
    grabber_->forget();
  }

  [[nodiscard]] std::string describe() const {
    if (target_.window == XCB_NONE) return wanted_ + " (" + problem_ + ")";
    std::ostringstream text;
    text << wanted_ << ": " << hex(target_.window);
    if (options_.region.empty()) text << " \"" << connection_->title(target_.window) << "\"";
    if (alike_ > 1 && options_.index < 0 && !options_.point.has_value()) {
      text << ", one of " << alike_ << " that are alike (the window's index or point chooses one)";
    }
    text << " on display " << connection_->displayName() << ", " << grabber_->area().width << "x"
         << grabber_->area().height << ", depth " << target_.format.depth
         << (grabber_->sharesMemory() ? ", shared memory" : ", through the socket")
         << (target_.pixmap != XCB_NONE ? ", readable when covered" : "");
    switch (detection()) {
      case ChangeDetection::kDamage:
        text << ", changes by XDamage";
        break;
      case ChangeDetection::kChecksum:
        text << ", changes by checksum";
        break;
      default:
        text << ", changes not detected";
        break;
    }
    return text.str();
  }

  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] std::optional<std::uint32_t> window() const {
    return target_.window == XCB_NONE ? std::nullopt : std::optional<std::uint32_t>(target_.window);
  }
  [[nodiscard]] bool usesDamage() const {
    return target_.window != XCB_NONE && detection() == ChangeDetection::kDamage;
  }
  [[nodiscard]] bool usesSharedMemory() const { return grabber_ && grabber_->sharesMemory(); }

 private:
  struct Target {
    xcb_window_t window = XCB_NONE;  // XCB_NONE: nothing to capture now
    bool redirected = false;         // drawn off the screen, by XComposite
    xcb_pixmap_t pixmap = XCB_NONE;  // its contents there, renewed by every resize and whenever it is shown again
    xcb_damage_damage_t damage = XCB_NONE;
    PixelFormat format;
    std::uint16_t width = 0;
    std::uint16_t height = 0;
  };

  // What is in use at present; kAuto is resolved here.
  [[nodiscard]] ChangeDetection detection() const {
    if (options_.change_detection != ChangeDetection::kAuto) return options_.change_detection;
    return target_.damage != XCB_NONE && !damage_silent_ ? ChangeDetection::kDamage : ChangeDetection::kChecksum;
  }

  void sleepUntil(SteadyClock::time_point when) const {
    const auto left = when - SteadyClock::now();
    if (left <= SteadyClock::duration::zero()) return;
    pollfd descriptor{connection_ ? xcb_get_file_descriptor(connection_->get()) : -1, POLLIN, 0};
    const auto whole = std::chrono::duration_cast<std::chrono::nanoseconds>(left).count();
    const timespec limit{whole / 1'000'000'000, whole % 1'000'000'000};
    ppoll(&descriptor, 1, &limit, nullptr);
  }

  // Nothing to poll when only events count.
  [[nodiscard]] SteadyClock::time_point nextWake() const {
    return options_.change_detection == ChangeDetection::kDamage ? SteadyClock::time_point::max() : next_poll_;
  }
  [[nodiscard]] bool pollsNow() const { return SteadyClock::now() >= nextWake(); }

  [[nodiscard]] std::string unreadable() const {
    return wanted_ + ": its pixels cannot be read" +
           (target_.pixmap == XCB_NONE ? " (without XComposite it must lie wholly on the screen)" : "");
  }
  [[nodiscard]] std::string connectionLost() const {
    return "the connection to X display \"" + connection_->displayName() + "\" broke";
  }

  void release() {
    grabber_.reset();
    if (connection_ && connection_->alive()) {
      xcb_connection_t* c = connection_->get();
      if (target_.damage != XCB_NONE) (void)connection_->succeeded(xcb_damage_destroy_checked(c, target_.damage));
      if (target_.pixmap != XCB_NONE) (void)connection_->succeeded(xcb_free_pixmap_checked(c, target_.pixmap));
      if (target_.redirected) {
        (void)connection_->succeeded(
            xcb_composite_unredirect_window_checked(c, target_.window, XCB_COMPOSITE_REDIRECT_AUTOMATIC));
      }
    }
    target_ = Target();
    drawn_.reset();
    gone_ = renewed_ = false;
  }

  void lose(const std::string& why) {
    release();
    problem_ = why;
  }

  // Connects and finds the window when needed; false: nothing to capture, `problem_` says why.
  bool ensureTarget() {
    if (target_.window != XCB_NONE && connection_->alive()) return true;
    if (SteadyClock::now() < next_search_) return false;
    next_search_ =
        SteadyClock::now() + std::chrono::duration_cast<SteadyClock::duration>(seconds(options_.search_period));
    if (connection_ && !connection_->alive()) {
      lose(connectionLost());
      connection_.reset();
    }
    if (!connection_) {
      try {
        connection_ = std::make_unique<X11Connection>(options_.display);
        server_clock_.reset();
        chosen_ = XCB_NONE;
        beside_.clear();
        // So that also the first drawings have their time, however late they are seen.
        connection_->askTime(kTimesAsked, [this](std::uint32_t ms) { (void)server_clock_.toHost(ms, clock_()); });
      } catch (const std::runtime_error& error) {
        problem_ = error.what();
        return false;
      }
    }
    X11Connection::Found found;
    found.window = connection_->root();
    if (options_.region.empty()) found = connection_->findWindow(options_);
    // Of a window that is still there, its size and its number from the left may have changed meanwhile.
    if (contains(found.alike, chosen_)) found.window = chosen_;
    if (found.window.has_value() && wasBeside(*found.window)) {
      problem_ = wanted_ + " is hidden or closed (" + hex(chosen_) + "); " + hex(*found.window) +
                 " was there beside it and is not taken in its place: show it again, or start anew";
      return false;
    }
    if (!found.window.has_value()) {
      problem_ = "no visible " + wanted_ + " on display " + connection_->displayName();
      if (!found.alike.empty()) {
        problem_ += "; there are " + std::to_string(found.alike.size()) +
                    (options_.point.has_value() ? ", none of them there" : ", counted from 0");
      } else if (options_.window_id == 0) {
        problem_ += thereAre(std::move(found.titles));
      }
      return false;
    }
    chosen_ = *found.window;
    alike_ = found.alike.size();
    beside_ = std::move(found.beside);
    return open(chosen_);
  }

  // Where one of several windows alike goes, numbers and sizes choose another, which shows another view.
  [[nodiscard]] bool wasBeside(xcb_window_t window) const { return window != chosen_ && contains(beside_, window); }

  bool open(xcb_window_t window) {
    const std::uint32_t events = XCB_EVENT_MASK_STRUCTURE_NOTIFY | XCB_EVENT_MASK_VISIBILITY_CHANGE;
    if (!connection_->succeeded(
            xcb_change_window_attributes_checked(connection_->get(), window, XCB_CW_EVENT_MASK, &events))) {
      problem_ = wanted_ + " vanished while it was opened";
      return false;
    }
    target_.window = window;
    if (options_.region.empty() && options_.use_composite && connection_->hasComposite()) {
      target_.redirected = connection_->succeeded(
          xcb_composite_redirect_window_checked(connection_->get(), window, XCB_COMPOSITE_REDIRECT_AUTOMATIC));
    }
    if (!attach()) return false;
    watchDamage();
    return true;
  }

  // Makes the pixels of the window, at its present size, readable.
  bool attach() {
    xcb_connection_t* c = connection_->get();
    grabber_.reset();
    if (target_.pixmap != XCB_NONE) (void)connection_->succeeded(xcb_free_pixmap_checked(c, target_.pixmap));
    target_.pixmap = XCB_NONE;
    const XcbPointer<xcb_get_window_attributes_reply_t> attributes(
        xcb_get_window_attributes_reply(c, xcb_get_window_attributes(c, target_.window), nullptr));
    const XcbPointer<xcb_get_geometry_reply_t> geometry(
        xcb_get_geometry_reply(c, xcb_get_geometry(c, target_.window), nullptr));
    if (attributes == nullptr || geometry == nullptr) {
      lose(wanted_ + " vanished while it was opened");
      return false;
    }
    const auto format = connection_->pixelFormat(attributes->visual, geometry->depth);
    const std::string refusal = format.has_value() ? unsupportedReason(*format) : "the window's visual is not listed";
    if (!refusal.empty()) {
      lose(wanted_ + ": " + refusal);
      return false;
    }
    target_.format = *format;
    target_.width = geometry->width;
    target_.height = geometry->height;
    const cv::Rect whole(0, 0, geometry->width, geometry->height);
    cv::Rect area = whole;
    xcb_drawable_t drawable = target_.window;
    if (!options_.region.empty()) {
      area = options_.region & whole;
      if (area != options_.region) {
        lose(wanted_ + " does not lie on the screen of " + std::to_string(whole.width) + "x" +
             std::to_string(whole.height));
        return false;
      }
    } else if (target_.redirected) {
      const xcb_pixmap_t pixmap = xcb_generate_id(c);
      if (connection_->succeeded(xcb_composite_name_window_pixmap_checked(c, target_.window, pixmap))) {
        drawable = target_.pixmap = pixmap;
        area += cv::Point(geometry->border_width, geometry->border_width);  // the pixmap includes the border
      }
    }
    grabber_ = std::make_unique<X11Grabber>(*connection_, drawable, *format, area, options_.use_shared_memory);
    problem_.clear();
    last_checksum_.reset();
    next_poll_ = SteadyClock::now();
    first_picture_ = true;
    renewed_ = false;
    drawn_.reset();
    return true;
  }

  void watchDamage() {
    const bool wanted =
        options_.change_detection == ChangeDetection::kAuto || options_.change_detection == ChangeDetection::kDamage;
    if (!wanted || !connection_->hasDamage()) return;
    const xcb_damage_damage_t damage = xcb_generate_id(connection_->get());
    if (connection_->succeeded(xcb_damage_create_checked(connection_->get(), damage, target_.window,
                                                         XCB_DAMAGE_REPORT_LEVEL_RAW_RECTANGLES))) {
      target_.damage = damage;
    }
  }

  // Takes what the server has sent; true: the window was drawn to.
  bool handleEvents(Change& change) {
    if (first_picture_) {  // what the window shows already, drawn at an unknown time
      first_picture_ = false;
      change = {clock_(), false};
      return true;
    }
    while (connection_) {
      const XcbPointer<xcb_generic_event_t> event(xcb_poll_for_event(connection_->get()));
      if (event == nullptr) break;
      if (const auto drawn = take(*event, clock_())) drawn_ = drawn;
    }
    if (!connection_->alive()) {
      lose(connectionLost());
      next_search_ = SteadyClock::now();
      return false;
    }
    if (gone_) {
      lose(wanted_ + " was closed or hidden");
      next_search_ = SteadyClock::now();
      return false;
    }
    if (renewed_) return attach() && handleEvents(change);
    if (!drawn_.has_value()) return false;
    change = *drawn_;
    drawn_.reset();
    return true;
  }

  // Whether what was drawn to is in the picture: for a region, the whole screen's drawings are reported.
  [[nodiscard]] bool isCaptured(const xcb_rectangle_t& drawn) const {
    if (options_.region.empty()) return true;
    return !(cv::Rect(drawn.x, drawn.y, drawn.width, drawn.height) & options_.region).empty();
  }

  // Remembers what an event says of the window; a drawing is returned.
  std::optional<Change> take(const xcb_generic_event_t& event, std::int64_t arrival_ns) {
    const auto type = static_cast<std::uint8_t>(event.response_type & 0x7fU);
    if (type == connection_->damageEvent() && connection_->hasDamage()) {
      const auto& notify = reinterpret_cast<const xcb_damage_notify_event_t&>(event);
      if (notify.damage != target_.damage || !isCaptured(notify.area)) return std::nullopt;
      silent_changes_ = 0;
      damage_silent_ = false;
      return Change{server_clock_.toHost(notify.timestamp, arrival_ns), true};
    }
    if (type == XCB_DESTROY_NOTIFY || type == XCB_UNMAP_NOTIFY) {
      const auto& notify = reinterpret_cast<const xcb_unmap_notify_event_t&>(event);
      gone_ = gone_ || notify.window == target_.window;
    } else if (type == XCB_CONFIGURE_NOTIFY) {
      const auto& notify = reinterpret_cast<const xcb_configure_notify_event_t&>(event);
      renewed_ = renewed_ || (notify.window == target_.window &&
                              (notify.width != target_.width || notify.height != target_.height));
    } else if (type == XCB_VISIBILITY_NOTIFY) {
      // All that says that a window manager's frame about it is shown again. What is drawn off the screen is never
      // covered, so that nothing else leads here.
      const auto& notify = reinterpret_cast<const xcb_visibility_notify_event_t&>(event);
      renewed_ = renewed_ || (notify.window == target_.window && target_.pixmap != XCB_NONE);
    }
    return std::nullopt;
  }

  // The drawing that the pixels just read show. Events and replies come in the server's order, and each event says
  // which request of ours it followed: those of drawings before the read are here by now, later ones wait for their
  // turn.
  Change lastChangeBeforeRead(const Change& change, const std::uint8_t* data, std::int64_t read_ns) {
    Change shown = change;
    while (true) {
      const XcbPointer<xcb_generic_event_t> event(xcb_poll_for_queued_event(connection_->get()));
      if (event == nullptr) break;
      const auto drawn = take(*event, read_ns);
      if (!drawn.has_value()) continue;
      if (static_cast<std::int32_t>(event->full_sequence - grabber_->readSequence()) < 0) {
        if (change.time_known) shown = *drawn;
      } else {
        drawn_ = drawn;
      }
    }
    if (detection() == ChangeDetection::kChecksum && last_checksum_.has_value()) {
      const std::uint64_t sum = grabber_->checksum(data);
      if (sum != *last_checksum_) shown = {read_ns, false};  // drawn between the look and the read
      last_checksum_ = sum;
    }
    return shown;
  }

  // Looks at the window itself where events are not to be had (or not to be relied on); true: it changed.
  bool poll(Change& change) {
    const auto now = SteadyClock::now();
    const ChangeDetection mode = detection();
    const auto period = std::chrono::duration_cast<SteadyClock::duration>(
        mode == ChangeDetection::kDamage ? std::chrono::nanoseconds(kDamageWatch) : seconds(options_.poll_period));
    next_poll_ = std::max(next_poll_ + period, now);
    if (mode == ChangeDetection::kNone) {
      change = {clock_(), false};
      return true;
    }
    const std::int64_t looked_ns = clock_();
    const bool in_time = isInTime(looked_ns);
    const auto sum = grabber_->checksum();
    if (!sum.has_value()) {
      lose(connection_->alive() ? unreadable() : connectionLost());
      return false;
    }
    const bool changed = last_checksum_.has_value() && *last_checksum_ != *sum;
    last_checksum_ = sum;
    if (mode == ChangeDetection::kDamage) {
      // An event that is under way shows up in the next round and takes this back.
      if (changed && ++silent_changes_ >= kSilentChangesToGiveUpDamage) {
        damage_silent_ = true;
        last_checksum_.reset();
        next_poll_ = now;
      }
      return false;
    }
    if (!changed) return false;
    change = {looked_ns, in_time};
    return true;
  }

  // Whether a change that this look sees first is of its time: nothing kept it from being seen much earlier.
  bool isInTime(std::int64_t looked_ns) {
    const std::int64_t unseen_ns = looked_ns - looked_ns_;
    looked_ns_ = looked_ns;
    unseen_ns_.push_back(unseen_ns);
    if (unseen_ns_.size() > kLooks) unseen_ns_.pop_front();
    return unseen_ns - *std::min_element(unseen_ns_.begin(), unseen_ns_.end()) <= kLateLookNs;
  }

  X11SourceOptions options_;
  Clock clock_;
  std::string wanted_;                // the window or region, in words
  std::string problem_;               // empty while there is a picture
  xcb_window_t chosen_ = XCB_NONE;    // the last that was captured
  std::size_t alike_ = 0;             // windows that fitted as well, this one included
  std::vector<xcb_window_t> beside_;  // all that were there then, hidden ones too
  std::unique_ptr<X11Connection> connection_;
  Target target_;
  std::unique_ptr<X11Grabber> grabber_;
  ServerClock server_clock_;
  cv::Mat converted_;
  SteadyClock::time_point next_search_{};
  SteadyClock::time_point next_poll_{};
  std::optional<std::uint64_t> last_checksum_;
  std::int64_t looked_ns_ = 0;          // when the last look or read began
  std::deque<std::int64_t> unseen_ns_;  // [ns] between looks
  int silent_changes_ = 0;
  bool damage_silent_ = false;
  bool first_picture_ = false;
  std::optional<Change> drawn_;  // not reported yet
  bool gone_ = false;
  bool renewed_ = false;  // its pixmap is another one
};

X11WindowSource::X11WindowSource(const X11SourceOptions& options, Clock clock)
    : impl_(std::make_unique<Impl>(options, std::move(clock))) {}
X11WindowSource::~X11WindowSource() = default;
WaitResult X11WindowSource::waitChange(std::chrono::milliseconds timeout, Change& change) {
  return impl_->waitChange(timeout, change);
}
GrabResult X11WindowSource::grab(const Change& change, Picture& picture) { return impl_->grab(change, picture); }
void X11WindowSource::lookAnew() { impl_->lookAnew(); }
std::string X11WindowSource::describe() const { return impl_->describe(); }
std::string X11WindowSource::problem() const { return impl_->problem(); }
std::optional<std::uint32_t> X11WindowSource::window() const { return impl_->window(); }
bool X11WindowSource::usesDamage() const { return impl_->usesDamage(); }
bool X11WindowSource::usesSharedMemory() const { return impl_->usesSharedMemory(); }

}  // namespace xplane_bridge::vision
