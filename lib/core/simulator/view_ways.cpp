#include "xplane_bridge/core/simulator/view_ways.hpp"

#include <cmath>
#include <map>

namespace xplane_bridge::core {
namespace {

constexpr double kNarrowestDeg = 1.0, kWidestDeg = 170.0;
constexpr double kSteepestDeg = 90.0;
constexpr float kBelowBelly = -3.0F;  // [m] of the head, up + from the reference point

const std::string kView = "sim/graphics/view/";

AnglesDeg turnOf(const ViewWish& wish) {
  switch (wish.direction) {
    case ViewWish::kRear:
      return {0.0, 0.0, 180.0};
    case ViewWish::kDown:
      return {0.0, -90.0, 0.0};
    case ViewWish::kTurned:
      return wish.turn;
    default:
      return {0.0, 0.0, 0.0};
  }
}

std::vector<DatarefWrite> offsetWrites(const AnglesDeg& turn) {
  return {{kView + "field_of_view_roll_deg", static_cast<float>(turn.roll)},
          {kView + "field_of_view_vertical_deg", static_cast<float>(turn.pitch)},
          {kView + "field_of_view_horizontal_deg", static_cast<float>(turn.heading)}};
}

/// In the 3-D cockpit, looking that way.
ViewWay headWay(const AnglesDeg& head, std::optional<float> up) {
  ViewWay way{commandOf(static_cast<int>(ViewType::kCockpit3d)), ViewType::kCockpit3d, offsetWrites({0.0, 0.0, 0.0})};
  way.writes.push_back({kView + "pilots_head_phi", static_cast<float>(head.roll)});
  way.writes.push_back({kView + "pilots_head_the", static_cast<float>(head.pitch)});
  way.writes.push_back({kView + "pilots_head_psi", static_cast<float>(head.heading)});
  if (up) way.writes.push_back({kView + "pilots_head_y", *up});
  return way;
}

ViewWay glanceWay(const char* command, ViewType shown) { return {command, shown, offsetWrites({0.0, 0.0, 0.0})}; }

}  // namespace

std::optional<std::string> check(const ViewWish& wish) {
  if (wish.direction < ViewWish::kForward || wish.direction > ViewWish::kTurned) {
    return "view is " + std::to_string(wish.direction) +
           ": expected 1 (FORWARD), 2 (REAR), 3 (DOWN), 4 (COCKPIT) or 5 (TURNED)";
  }
  const AnglesDeg& turn = wish.turn;
  if (!std::isfinite(turn.roll) || !std::isfinite(turn.pitch) || !std::isfinite(turn.heading)) {
    return "heading_deg, pitch_deg and roll_deg: expected finite numbers";
  }
  if (std::abs(turn.pitch) > kSteepestDeg) {
    return "pitch_deg is " + std::to_string(turn.pitch) + ": expected -90..90 (look behind by heading_deg)";
  }
  const double field = wish.field_of_view_deg;
  if (!(field == 0.0 || (field >= kNarrowestDeg && field <= kWidestDeg))) {
    return "field_of_view_deg is " + std::to_string(field) + ": expected 1..170, or 0 to leave it as it is";
  }
  return std::nullopt;
}

Eigen::Quaterniond orientationOf(const ViewWish& wish) { return orientationInBase(turnOf(wish)); }

std::vector<ViewWay> waysTo(const ViewWish& wish) {
  if (wish.direction == ViewWish::kCockpit) return {headWay({0.0, 0.0, 0.0}, std::nullopt)};
  const AnglesDeg turn = turnOf(wish);
  std::vector<ViewWay> ways{{commandOf(static_cast<int>(ViewType::kNothing)), ViewType::kNothing, offsetWrites(turn)}};
  if (wish.direction == ViewWish::kRear) ways.push_back(glanceWay("sim/view/back", ViewType::kBack));
  if (wish.direction == ViewWish::kDown) {
    ways.push_back(glanceWay("sim/view/straight_down", ViewType::kStraightDown));
    ways.push_back(headWay(turn, kBelowBelly));
  }
  return ways;
}

const std::vector<std::string>& viewDatarefs() {
  static const std::vector<std::string> datarefs{kView + "field_of_view_roll_deg",
                                                 kView + "field_of_view_vertical_deg",
                                                 kView + "field_of_view_horizontal_deg",
                                                 kView + "pilots_head_phi",
                                                 kView + "pilots_head_the",
                                                 kView + "pilots_head_psi",
                                                 kView + "pilots_head_y"};
  return datarefs;
}

std::string commandOf(int view_type) {
  static const std::map<int, const char*> commands{{1000, "forward_with_2d_panel"},
                                                   {1014, "tower"},
                                                   {1015, "runway"},
                                                   {1017, "chase"},
                                                   {1018, "circle"},
                                                   {1020, "still_spot"},
                                                   {1021, "linear_spot"},
                                                   {1023, "forward_with_hud"},
                                                   {1024, "forward_with_nothing"},
                                                   {1026, "3d_cockpit_cmnd_look"},
                                                   {1028, "free_camera"},
                                                   {1031, "ridealong"}};
  const auto found = commands.find(view_type);
  return found == commands.end() ? "" : std::string("sim/view/") + found->second;
}

}  // namespace xplane_bridge::core
