#include "x11_selection.hpp"

#include <algorithm>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace xplane_bridge::vision {
namespace {

// Of windows named where the one looked for is missing.
constexpr std::size_t kMostTitles = 8;

// Each in quotation marks.
std::string quoted(const std::vector<std::string>& texts, const std::string& separator) {
  std::string out;
  for (const std::string& text : texts) {
    if (!out.empty()) out += separator;
    out += '"';
    out += text;
    out += '"';
  }
  return out;
}

}  // namespace

const std::vector<std::string>& xplaneWindowTitles() {
  static const std::vector<std::string> titles{"X-System", "X-Plane"};
  return titles;
}

ChangeDetection changeDetectionFromName(const std::string& name) {
  if (name == "auto") return ChangeDetection::kAuto;
  if (name == "damage") return ChangeDetection::kDamage;
  if (name == "checksum") return ChangeDetection::kChecksum;
  if (name == "none") return ChangeDetection::kNone;
  throw std::invalid_argument("change detection \"" + name + "\": expected auto, damage, checksum or none");
}

std::string hex(std::uint32_t value) {
  std::ostringstream text;
  text << "0x" << std::hex << value;
  return text.str();
}

std::string thereAre(std::vector<std::string> titles) {
  if (titles.empty()) return "; no visible window has a title";
  std::sort(titles.begin(), titles.end());
  titles.erase(std::unique(titles.begin(), titles.end()), titles.end());
  const std::size_t left_out = titles.size() > kMostTitles ? titles.size() - kMostTitles : 0;
  titles.resize(titles.size() - left_out);
  return "; visible windows are titled " + quoted(titles, ", ") +
         (left_out == 0 ? "" : " and " + std::to_string(left_out) + " more");
}

std::string selection(const X11SourceOptions& options) {
  if (options.index >= 0) {
    X11SourceOptions any = options;
    any.index = -1;
    return selection(any) + ", number " + std::to_string(options.index) + " from the left";
  }
  if (options.point.has_value()) {
    X11SourceOptions any = options;
    any.point.reset();
    return selection(any) + ", at the point " + std::to_string(options.point->x) + ", " +
           std::to_string(options.point->y) + " of the screen";
  }
  if (options.window_id != 0) return "window " + hex(options.window_id);
  if (!options.class_name.empty()) return "window of class \"" + options.class_name + "\"";
  if (!options.title.empty()) {
    return std::string("window whose title ") + (options.title_is_regex ? "matches" : "contains") + " \"" +
           options.title + "\"";
  }
  if (options.region.empty()) return "window titled exactly " + quoted(xplaneWindowTitles(), " or ");
  return "screen region " + std::to_string(options.region.width) + "x" + std::to_string(options.region.height) + "+" +
         std::to_string(options.region.x) + "+" + std::to_string(options.region.y);
}

void validate(const X11SourceOptions& options) {
  const int given = static_cast<int>(!options.title.empty()) + static_cast<int>(!options.class_name.empty()) +
                    static_cast<int>(options.window_id != 0) + static_cast<int>(!options.region.empty());
  if (given > 1) {
    throw std::invalid_argument(std::to_string(given) +
                                " of window title, class, id and screen region are given: expected at most one");
  }
  if (options.title_is_regex && options.title.empty()) {
    throw std::invalid_argument("the window title is to be a regular expression, but none is given");
  }
  if (options.index >= 0 && (options.window_id != 0 || !options.region.empty())) {
    throw std::invalid_argument("window index " + std::to_string(options.index) +
                                " is given with a window id or a region, which name one already");
  }
  if (options.point.has_value() && (options.index >= 0 || options.window_id != 0 || !options.region.empty())) {
    throw std::invalid_argument(
        "a window's point is given with an index, an id or a region, which name a window already");
  }
  if (options.region.x < 0 || options.region.y < 0) {
    throw std::invalid_argument(selection(options) + ": expected its corner on the screen (x, y >= 0)");
  }
  if (options.title_is_regex) {
    try {
      (void)std::regex(options.title);
    } catch (const std::regex_error& error) {
      throw std::invalid_argument("window title \"" + options.title +
                                  "\" is not an ECMAScript regular expression: " + error.what());
    }
  }
  if (!(options.poll_period > 0.0 && options.poll_period <= 1.0)) {
    throw std::invalid_argument("poll period " + std::to_string(options.poll_period) + " s: expected (0, 1]");
  }
  if (!(options.search_period > 0.0 && options.search_period <= 60.0)) {
    throw std::invalid_argument("search period " + std::to_string(options.search_period) + " s: expected (0, 60]");
  }
}

}  // namespace xplane_bridge::vision
