// Every field of FlightState, found by name in the serialised message, is interpolated as its .msg line says: angles of
// 0..360 or -180..180 the short way around, other real numbers linearly, whole numbers and flags from the nearer state.

#include "xplane_bridge/nodes/messages/flight_state_interpolation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "message_fields.hpp"

namespace xplane_bridge {
namespace {

class EveryField : public testing::Test {
 protected:
  // Angles: 10 degrees apart, across the end of their range. Others: numbers of their own, 8 apart.
  EveryField() {
    double number = 100.0;
    for (const MessageLeaf& leaf : layout_.leaves()) {
      if (leaf.type == "string") continue;
      const bool real = leaf.type == "float32" || leaf.type == "float64";
      if (kind(leaf) == Kind::kCompass) {
        add(leaf.field, 356.0, 6.0, 358.5);
      } else if (kind(leaf) == Kind::kSigned) {
        add(leaf.field, 176.0, -174.0, 178.5);
      } else if (leaf.field == "orientation" || leaf.field == "valid") {
        add(leaf.field, std::nan(""), std::nan(""), std::nan(""));  // set below
      } else if (leaf.type == "uint8" || leaf.type == "bool") {
        add(leaf.field, 1.0, 0.0, 1.0);
      } else {
        number += 20.0;
        add(leaf.field, number, number + 8.0, real || leaf.type == "time" ? number + 2.0 : number);
      }
    }
    // About the forward axis by 0 and 90 degrees; a quarter of the way is 22.5 degrees.
    const double half = M_PI / 16.0;
    from_["orientation"] = {0.0, 0.0, 0.0, 1.0};
    to_["orientation"] = {std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)};
    quarter_["orientation"] = {std::sin(half), 0.0, 0.0, std::cos(half)};
    from_["valid"] = {0b0111};
    to_["valid"] = {0b1110};
    quarter_["valid"] = {0b0110};
  }

  enum class Kind { kPlain, kCompass, kSigned };
  static Kind kind(const MessageLeaf& leaf) {
    if (leaf.comment.compare(0, 12, "[deg] 0..360") == 0) return Kind::kCompass;
    return leaf.comment.compare(0, 15, "[deg] -180..180") == 0 ? Kind::kSigned : Kind::kPlain;
  }

  void add(const std::string& field, double from, double to, double quarter) {
    from_[field].push_back(from);
    to_[field].push_back(to);
    quarter_[field].push_back(quarter);
  }

  void expect(const FlightState& state, const MessageValues& expected) const {
    const MessageValues actual = layout_.read(state);
    for (const auto& [name, values] : expected) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_NEAR(actual.at(name).at(i), values[i], std::abs(values[i]) * 1e-7) << name << "[" << i << "]";
      }
    }
  }

  MessageLayout layout_ = MessageLayout::of<FlightState>();
  MessageValues from_, to_, quarter_;
};

TEST_F(EveryField, IsAQuarterOfTheWayAsItsKindHasIt) {
  const auto from = layout_.make<FlightState>(from_), to = layout_.make<FlightState>(to_);
  expect(interpolate(from, to, 0.25), quarter_);
}

TEST_F(EveryField, IsTheStateItselfAtTheEnds) {
  const auto from = layout_.make<FlightState>(from_), to = layout_.make<FlightState>(to_);
  from_["valid"] = to_["valid"] = {0b0110};
  expect(interpolate(from, to, 0.0), from_);
  expect(interpolate(from, to, 1.0), to_);
}

TEST_F(EveryField, ThatIsNoRealNumberChangesHalfWay) {
  const auto from = layout_.make<FlightState>(from_), to = layout_.make<FlightState>(to_);
  EXPECT_EQ(interpolate(from, to, 0.49).frame_count, from.frame_count);
  EXPECT_EQ(interpolate(from, to, 0.51).frame_count, to.frame_count);
  EXPECT_EQ(interpolate(from, to, 0.49).on_ground, from.on_ground);
  EXPECT_EQ(interpolate(from, to, 0.51).on_ground, to.on_ground);
}

// The fields that old readers of the comments know as angles.
TEST_F(EveryField, ThatIsAnAngleSaysSo) {
  std::string compass, half_turns;
  for (const MessageLeaf& leaf : layout_.leaves()) {
    if (kind(leaf) == Kind::kCompass) compass += leaf.field + " ";
    if (kind(leaf) == Kind::kSigned) half_turns += leaf.field + " ";
  }
  EXPECT_EQ(compass, "heading_true_deg heading_magnetic_deg track_deg xplane_hpath_deg wind_from_deg ");
  EXPECT_EQ(half_turns, "longitude roll_deg declination_deg ");
}

}  // namespace
}  // namespace xplane_bridge
