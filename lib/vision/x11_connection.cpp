#include "x11_connection.hpp"

#include <limits.h>
#include <unistd.h>
#include <xcb/composite.h>
#include <xcb/damage.h>
#include <xcb/shm.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <regex>
#include <stdexcept>
#include <tuple>

namespace xplane_bridge::vision {
namespace {

constexpr std::uint32_t kLongestText = 4096;  // [4 bytes] of a window property

bool present(xcb_connection_t* connection, xcb_extension_t* extension) {
  const xcb_query_extension_reply_t* reply = xcb_get_extension_data(connection, extension);
  return reply != nullptr && reply->present != 0;
}

std::string displayOrEnvironment(const std::string& display) {
  if (!display.empty()) return display;
  const char* environment = std::getenv("DISPLAY");
  return environment == nullptr ? std::string() : std::string(environment);
}

}  // namespace

X11Connection::X11Connection(const std::string& display) : display_name_(displayOrEnvironment(display)) {
  if (display_name_.empty()) {
    throw std::runtime_error("no X display: DISPLAY is not set and the parameter `display` is empty");
  }
  int screen_number = 0;
  connection_ = xcb_connect(display_name_.c_str(), &screen_number);
  if (!alive()) {
    xcb_disconnect(connection_);
    throw std::runtime_error("cannot connect to X display \"" + display_name_ + "\"");
  }
  xcb_screen_iterator_t screens = xcb_setup_roots_iterator(xcb_get_setup(connection_));
  for (int i = 0; i < screen_number && screens.rem > 1; ++i) xcb_screen_next(&screens);
  screen_ = screens.data;

  if (present(connection_, &xcb_composite_id)) {
    const XcbPointer<xcb_composite_query_version_reply_t> version(xcb_composite_query_version_reply(
        connection_, xcb_composite_query_version(connection_, XCB_COMPOSITE_MAJOR_VERSION, XCB_COMPOSITE_MINOR_VERSION),
        nullptr));
    // NameWindowPixmap came with 0.2.
    has_composite_ = version != nullptr && std::tie(version->major_version, version->minor_version) >=
                                               std::make_tuple(std::uint32_t{0}, std::uint32_t{2});
  }
  if (present(connection_, &xcb_damage_id)) {
    const XcbPointer<xcb_damage_query_version_reply_t> version(xcb_damage_query_version_reply(
        connection_, xcb_damage_query_version(connection_, XCB_DAMAGE_MAJOR_VERSION, XCB_DAMAGE_MINOR_VERSION),
        nullptr));
    has_damage_ = version != nullptr;
    damage_event_ =
        static_cast<std::uint8_t>(xcb_get_extension_data(connection_, &xcb_damage_id)->first_event + XCB_DAMAGE_NOTIFY);
  }
  if (present(connection_, &xcb_shm_id)) {
    const XcbPointer<xcb_shm_query_version_reply_t> version(
        xcb_shm_query_version_reply(connection_, xcb_shm_query_version(connection_), nullptr));
    has_shm_ = version != nullptr;
  }
  net_wm_name_ = atom("_NET_WM_NAME");
  net_wm_pid_ = atom("_NET_WM_PID");
}

X11Connection::~X11Connection() { xcb_disconnect(connection_); }

bool X11Connection::succeeded(xcb_void_cookie_t cookie) const {
  const XcbPointer<xcb_generic_error_t> error(xcb_request_check(connection_, cookie));
  return error == nullptr && alive();
}

void X11Connection::askTime(int times, const std::function<void(std::uint32_t)>& heard) const {
  const xcb_window_t window = xcb_generate_id(connection_);
  const std::uint32_t events = XCB_EVENT_MASK_PROPERTY_CHANGE;
  xcb_create_window(connection_, XCB_COPY_FROM_PARENT, window, root(), -1, -1, 1, 1, 0, XCB_WINDOW_CLASS_INPUT_ONLY,
                    XCB_COPY_FROM_PARENT, XCB_CW_EVENT_MASK, &events);
  for (int i = 0; i < times; ++i) {
    // The event says when the server did it: nothing is appended.
    if (!succeeded(xcb_change_property_checked(connection_, XCB_PROP_MODE_APPEND, window, XCB_ATOM_WM_NAME,
                                               XCB_ATOM_STRING, 8, 0, nullptr))) {
      break;
    }
    while (const XcbPointer<xcb_generic_event_t> event{xcb_poll_for_queued_event(connection_)}) {
      if ((event->response_type & 0x7fU) != XCB_PROPERTY_NOTIFY) continue;
      heard(reinterpret_cast<const xcb_property_notify_event_t&>(*event).time);
    }
  }
  xcb_destroy_window(connection_, window);
}

xcb_atom_t X11Connection::atom(const char* name) const {
  const XcbPointer<xcb_intern_atom_reply_t> reply(xcb_intern_atom_reply(
      connection_, xcb_intern_atom(connection_, 0, static_cast<std::uint16_t>(std::strlen(name)), name), nullptr));
  return reply == nullptr ? static_cast<xcb_atom_t>(XCB_ATOM_NONE) : reply->atom;
}

std::optional<PixelFormat> X11Connection::pixelFormat(xcb_visualid_t visual, int depth) const {
  const xcb_setup_t* setup = xcb_get_setup(connection_);
  PixelFormat format;
  format.depth = depth;
  format.msb_first = setup->image_byte_order == XCB_IMAGE_ORDER_MSB_FIRST;
  for (auto i = xcb_setup_pixmap_formats_iterator(setup); i.rem > 0; xcb_format_next(&i)) {
    if (i.data->depth != depth) continue;
    format.bits_per_pixel = i.data->bits_per_pixel;
    format.scanline_pad = i.data->scanline_pad;
  }
  for (auto d = xcb_screen_allowed_depths_iterator(screen_); d.rem > 0; xcb_depth_next(&d)) {
    for (auto v = xcb_depth_visuals_iterator(d.data); v.rem > 0; xcb_visualtype_next(&v)) {
      if (v.data->visual_id != visual) continue;
      format.red_mask = v.data->red_mask;
      format.green_mask = v.data->green_mask;
      format.blue_mask = v.data->blue_mask;
      return format;
    }
  }
  return std::nullopt;
}

std::string X11Connection::textProperty(xcb_window_t window, xcb_atom_t property) const {
  const XcbPointer<xcb_get_property_reply_t> reply(xcb_get_property_reply(
      connection_, xcb_get_property(connection_, 0, window, property, XCB_GET_PROPERTY_TYPE_ANY, 0, kLongestText),
      nullptr));
  if (reply == nullptr || reply->format != 8) return {};
  const auto length = static_cast<std::size_t>(xcb_get_property_value_length(reply.get()));
  return {static_cast<const char*>(xcb_get_property_value(reply.get())), length};
}

std::string X11Connection::title(xcb_window_t window) const {
  std::string text = net_wm_name_ == XCB_ATOM_NONE ? std::string() : textProperty(window, net_wm_name_);
  return text.empty() ? textProperty(window, XCB_ATOM_WM_NAME) : text;
}

bool X11Connection::viewable(xcb_window_t window) const {
  const XcbPointer<xcb_get_window_attributes_reply_t> attributes(
      xcb_get_window_attributes_reply(connection_, xcb_get_window_attributes(connection_, window), nullptr));
  return attributes != nullptr && attributes->map_state == XCB_MAP_STATE_VIEWABLE &&
         attributes->_class == XCB_WINDOW_CLASS_INPUT_OUTPUT;
}

std::vector<xcb_window_t> X11Connection::allWindows() const {
  std::vector<xcb_window_t> windows{screen_->root};
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const XcbPointer<xcb_query_tree_reply_t> tree(
        xcb_query_tree_reply(connection_, xcb_query_tree(connection_, windows[i]), nullptr));
    if (tree == nullptr) continue;
    const xcb_window_t* children = xcb_query_tree_children(tree.get());
    windows.insert(windows.end(), children, children + xcb_query_tree_children_length(tree.get()));
  }
  windows.erase(windows.begin());
  return windows;
}

bool X11Connection::fits(xcb_window_t window, const X11SourceOptions& options, const std::string& title) const {
  if (!options.class_name.empty()) {
    const std::string both = textProperty(window, XCB_ATOM_WM_CLASS);  // two strings, each ended by a zero
    const std::string instance = both.substr(0, both.find('\0'));
    const std::string name = instance.size() < both.size() ? both.c_str() + instance.size() + 1 : "";
    return instance == options.class_name || name == options.class_name;
  }
  if (title.empty()) return false;
  if (options.title.empty()) {
    const std::vector<std::string>& titles = xplaneWindowTitles();
    return std::find(titles.begin(), titles.end(), title) != titles.end();
  }
  if (options.title_is_regex) return std::regex_search(title, std::regex(options.title));
  return title.find(options.title) != std::string::npos;
}

bool X11Connection::isXPlanes(xcb_window_t window) const {
  if (net_wm_pid_ == XCB_ATOM_NONE) return false;
  std::array<char, HOST_NAME_MAX + 1> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) return false;
  // A process number says nothing about a program of another computer.
  if (textProperty(window, XCB_ATOM_WM_CLIENT_MACHINE) != host.data()) return false;
  const XcbPointer<xcb_get_property_reply_t> reply(xcb_get_property_reply(
      connection_, xcb_get_property(connection_, 0, window, net_wm_pid_, XCB_ATOM_CARDINAL, 0, 1), nullptr));
  if (reply == nullptr || reply->format != 32 || xcb_get_property_value_length(reply.get()) != sizeof(std::uint32_t)) {
    return false;
  }
  std::uint32_t process = 0;
  std::memcpy(&process, xcb_get_property_value(reply.get()), sizeof process);
  std::string name;
  std::getline(std::ifstream("/proc/" + std::to_string(process) + "/comm"), name);
  return name.rfind("X-Plane", 0) == 0;
}

std::uint32_t X11Connection::area(xcb_window_t window) const {
  const XcbPointer<xcb_get_geometry_reply_t> geometry(
      xcb_get_geometry_reply(connection_, xcb_get_geometry(connection_, window), nullptr));
  return geometry == nullptr ? 0 : std::uint32_t{geometry->width} * geometry->height;
}

std::pair<int, int> X11Connection::corner(xcb_window_t window) const {
  const XcbPointer<xcb_translate_coordinates_reply_t> corner(xcb_translate_coordinates_reply(
      connection_, xcb_translate_coordinates(connection_, window, screen_->root, 0, 0), nullptr));
  return corner == nullptr ? std::make_pair(0, 0) : std::make_pair(int{corner->dst_x}, int{corner->dst_y});
}

bool X11Connection::covers(xcb_window_t window, cv::Point point) const {
  const XcbPointer<xcb_get_geometry_reply_t> geometry(
      xcb_get_geometry_reply(connection_, xcb_get_geometry(connection_, window), nullptr));
  const auto [x, y] = corner(window);
  return geometry != nullptr && cv::Rect(x, y, geometry->width, geometry->height).contains(point);
}

X11Connection::Found X11Connection::findWindow(const X11SourceOptions& options) const {
  Found found;
  if (options.window_id != 0) {
    if (viewable(options.window_id)) found.window = options.window_id;
    return found;
  }
  using Rank = std::pair<bool, bool>;  // X-Plane's, exact title
  Rank best_rank{false, false};
  std::vector<xcb_window_t> best;
  std::vector<std::pair<Rank, xcb_window_t>> ranked;
  for (const xcb_window_t window : allWindows()) {
    const std::string text = title(window);
    const bool wanted = fits(window, options, text);
    // Of a class without a title no window has the exact one, least of all a menu that has none itself.
    const Rank rank{wanted && isXPlanes(window), !options.title.empty() && text == options.title};
    if (wanted) ranked.emplace_back(rank, window);
    if ((!wanted && text.empty()) || !viewable(window)) continue;
    if (!text.empty()) found.titles.push_back(text);
    if (!wanted || area(window) == 0 || rank < best_rank) continue;
    if (rank > best_rank) best.clear();
    best_rank = rank;
    best.push_back(window);
  }
  found.alike = best;
  for (const auto& [rank, window] : ranked) {
    if (rank <= best_rank) found.beside.push_back(window);
  }
  if (options.point.has_value()) {
    const auto elsewhere = [&](xcb_window_t window) { return !covers(window, *options.point); };
    best.erase(std::remove_if(best.begin(), best.end(), elsewhere), best.end());
  }
  if (options.index < 0) {
    const auto smaller = [this](xcb_window_t a, xcb_window_t b) { return area(a) < area(b); };
    const auto largest = std::max_element(best.begin(), best.end(), smaller);
    if (largest != best.end()) found.window = *largest;
  } else if (static_cast<std::size_t>(options.index) < best.size()) {
    std::stable_sort(best.begin(), best.end(),
                     [this](xcb_window_t a, xcb_window_t b) { return corner(a) < corner(b); });
    found.window = best[static_cast<std::size_t>(options.index)];
  }
  return found;
}

}  // namespace xplane_bridge::vision
