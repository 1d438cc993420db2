#include "xplane_bridge/core/simulator/view_ways.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace xplane_bridge::core {
namespace {

ViewWish wishFor(int direction) {
  ViewWish wish;
  wish.direction = direction;
  return wish;
}

float valueOf(const ViewWay& way, const std::string& leaf) {
  for (const DatarefWrite& write : way.writes) {
    if (write.dataref == "sim/graphics/view/" + leaf) return write.value;
  }
  return std::nanf("");
}

Eigen::Vector3d lineOfSight(const ViewWish& wish) { return orientationOf(wish) * Eigen::Vector3d::UnitZ(); }

}  // namespace

TEST(ViewWays, DownIsTheGroundBeforeTheCockpitsFloor) {
  const std::vector<ViewWay> ways = waysTo(wishFor(ViewWish::kDown));
  ASSERT_EQ(ways.size(), 3U);
  EXPECT_EQ(ways[0].command, "sim/view/forward_with_nothing");
  EXPECT_EQ(ways[0].view_type, ViewType::kNothing);
  EXPECT_EQ(valueOf(ways[0], "field_of_view_vertical_deg"), -90.0F);
  EXPECT_EQ(valueOf(ways[0], "field_of_view_horizontal_deg"), 0.0F);
  EXPECT_EQ(ways[1].command, "sim/view/straight_down");
  EXPECT_EQ(valueOf(ways[1], "field_of_view_vertical_deg"), 0.0F) << "a glance needs no offset";
  EXPECT_EQ(ways[2].view_type, ViewType::kCockpit3d);
  EXPECT_EQ(valueOf(ways[2], "pilots_head_the"), -90.0F);
  EXPECT_LT(valueOf(ways[2], "pilots_head_y"), -1.0F) << "below the belly";
}

TEST(ViewWays, EachWishHasItsDirection) {
  EXPECT_LT((lineOfSight(wishFor(ViewWish::kForward)) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-9);
  EXPECT_LT((lineOfSight(wishFor(ViewWish::kCockpit)) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-9);
  EXPECT_LT((lineOfSight(wishFor(ViewWish::kRear)) - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-9);
  EXPECT_LT((lineOfSight(wishFor(ViewWish::kDown)) - Eigen::Vector3d(0, 0, -1)).norm(), 1e-9);
  ViewWish turned = wishFor(ViewWish::kTurned);
  turned.turn = {0.0, 30.0, 90.0};  // to the right, and up
  EXPECT_LT((lineOfSight(turned) - Eigen::Vector3d(0, -std::sqrt(0.75), 0.5)).norm(), 1e-9);
  const ViewWay way = waysTo(turned).front();
  EXPECT_EQ(valueOf(way, "field_of_view_vertical_deg"), 30.0F);
  EXPECT_EQ(valueOf(way, "field_of_view_horizontal_deg"), 90.0F);
  EXPECT_EQ(waysTo(wishFor(ViewWish::kCockpit)).front().view_type, ViewType::kCockpit3d);
}

TEST(ViewWays, EveryWriteCanBeGivenBack) {
  for (int direction = ViewWish::kForward; direction <= ViewWish::kTurned; ++direction) {
    for (const ViewWay& way : waysTo(wishFor(direction))) {
      for (const DatarefWrite& write : way.writes) {
        EXPECT_EQ(std::count(viewDatarefs().begin(), viewDatarefs().end(), write.dataref), 1) << write.dataref;
      }
    }
  }
  EXPECT_EQ(commandOf(1026), "sim/view/3d_cockpit_cmnd_look");
  EXPECT_EQ(commandOf(7), "");
}

TEST(ViewWays, WrongWishesAreRefusedInWords) {
  EXPECT_FALSE(check(wishFor(ViewWish::kTurned)));
  EXPECT_NE(check(wishFor(0))->find("expected 1 (FORWARD)"), std::string::npos);
  EXPECT_NE(check(wishFor(6))->find("view is 6"), std::string::npos);
  ViewWish wish = wishFor(ViewWish::kTurned);
  wish.turn.pitch = 100.0;
  EXPECT_NE(check(wish)->find("pitch_deg"), std::string::npos);
  wish.turn.pitch = std::nan("");
  EXPECT_NE(check(wish)->find("finite"), std::string::npos);
  wish = wishFor(ViewWish::kForward);
  wish.field_of_view_deg = 0.5;
  EXPECT_NE(check(wish)->find("field_of_view_deg"), std::string::npos);
  wish.field_of_view_deg = std::nan("");
  EXPECT_TRUE(check(wish));
}

}  // namespace xplane_bridge::core
