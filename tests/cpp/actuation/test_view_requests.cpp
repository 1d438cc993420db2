#include "xplane_bridge/actuation/view_requests.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/core/camera/view_stream.hpp"

namespace xplane_bridge {
namespace {

using core::ResultCode;
using core::ViewWish;

const std::string kView = "sim/graphics/view/";
const std::string kVertical = kView + "field_of_view_vertical_deg";
const std::string kHorizontal = kView + "field_of_view_horizontal_deg";
const std::string kField = kView + "field_of_view_deg";

/// A level aircraft heading north, whose X-Plane shows the camera that its view and its visual offset make.
class ViewRequestsTest : public testing::Test {
 protected:
  ViewRequestsTest()
      : views_(&sim_, [this](const std::string& text, const std::string& who, bool) {
          reports_.push_back(text + " by " + who);
        }) {
    sim_.setAll(core::cameraDatarefs(), 0.0F);
    sim_.setAll(core::viewDatarefs(), 0.0F);
    sim_.set(kField, 60.0F);
    sim_.set(kView + "view_type", 1000.0F);
    sim_.on_message = [this](const core::FakeSimulator::Message& message) {
      if (message.label != "CMND") return;
      if (message.path == "sim/view/forward_with_nothing") look(1024, 0.0F);
      if (message.path == "sim/view/forward_with_2d_panel") look(1000, 0.0F);
      if (message.path == "sim/view/straight_down" && glances_) look(1025, -90.0F);
      if (message.path == "sim/view/3d_cockpit_cmnd_look") look(1026, 0.0F);
    };
    sim_.on_frame = [this] {
      if (sim_.value(kView + "view_type") == 1026.0F) {
        sim_.set(kView + "view_pitch", sim_.value(kView + "pilots_head_the"));
      }
      showMatrix();
    };
  }

  void look(int view_type, float pitch) {
    sim_.set(kView + "view_type", static_cast<float>(view_type));
    sim_.set(kView + "view_pitch", pitch);
    sim_.set(kView + "pilots_head_the", 0.0F);
  }

  /// Right, up, back of the drawn camera as rows, column by column; the aircraft looks along -Z.
  void showMatrix() {
    const bool turns = offset_turns_;
    const core::AnglesDeg view{0.0, sim_.value(kView + "view_pitch"), 0.0};
    const core::AnglesDeg offset{0.0, turns ? sim_.value(kVertical) : 0.0, turns ? sim_.value(kHorizontal) : 0.0};
    const Eigen::Matrix3d camera = core::rotation(view) * core::rotation(offset);  // of forward, right, down, in NED
    const auto opengl = [](const Eigen::Vector3d& ned) { return Eigen::Vector3d(ned.y(), -ned.z(), -ned.x()); };
    Eigen::Matrix3d rows;
    rows.row(0) = opengl(camera.col(1));
    rows.row(1) = opengl(-camera.col(2));
    rows.row(2) = opengl(-camera.col(0));
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        sim_.set(kView + "world_matrix[" + std::to_string(4 * column + row) + "]",
                 static_cast<float>(rows(row, column)));
      }
    }
    sim_.set(kView + "world_matrix[15]", 1.0F);
  }

  RequestResult ask(int direction, double field_of_view_deg = 0.0) {
    ViewWish wish;
    wish.direction = direction;
    wish.field_of_view_deg = field_of_view_deg;
    return views_.setView(wish, "test");
  }

  std::vector<core::JournalEntry> journalled() { return sim_.journal()->entries(); }

  core::FakeSimulator sim_;
  bool offset_turns_ = true;
  bool glances_ = true;
  std::vector<std::string> reports_;
  ViewRequests views_;
};

TEST_F(ViewRequestsTest, DownIsTheVisualOffsetWithoutACockpit) {
  const RequestResult result = ask(ViewWish::kDown);
  EXPECT_EQ(result.code, ResultCode::kOk) << result.text;
  EXPECT_NE(result.text.find("pitch -90.0"), std::string::npos) << result.text;
  EXPECT_EQ(sim_.value(kView + "view_type"), 1024.0F);
  EXPECT_EQ(sim_.value(kVertical), -90.0F);
  ASSERT_EQ(journalled().size(), 1U);
  EXPECT_EQ(journalled()[0].id, "view:camera");
  EXPECT_EQ(reports_.back(), "set_view: " + result.text + " by test");
}

TEST_F(ViewRequestsTest, IsOnDiskBeforeXPlaneIsChanged) {
  bool written_down = false;
  const auto taken = sim_.on_message;
  sim_.on_message = [this, &written_down, taken](const core::FakeSimulator::Message& message) {
    if (message.label == "DREF" && message.path == kVertical) written_down = !journalled().empty();
    taken(message);
  };
  ask(ViewWish::kDown);
  EXPECT_TRUE(written_down);
}

TEST_F(ViewRequestsTest, AnotherWayWhereTheOffsetTurnsNothing) {
  offset_turns_ = false;
  EXPECT_EQ(ask(ViewWish::kDown).code, ResultCode::kOk);
  EXPECT_EQ(sim_.value(kView + "view_type"), 1025.0F);
  EXPECT_EQ(sim_.value(kVertical), 0.0F) << "not under the glance";
  glances_ = false;
  EXPECT_EQ(ask(ViewWish::kDown).code, ResultCode::kOk);
  EXPECT_EQ(sim_.value(kView + "view_type"), 1026.0F);
  EXPECT_EQ(sim_.value(kView + "pilots_head_the"), -90.0F);
}

TEST_F(ViewRequestsTest, NoWayIsSaidAndGivenBack) {
  offset_turns_ = false;
  sim_.set(kHorizontal, 5.0F);
  const RequestResult result = ask(ViewWish::kRear);  // this X-Plane knows no glance to the rear
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_NE(result.text.find("heading 0.0"), std::string::npos) << result.text;
  EXPECT_EQ(sim_.value(kHorizontal), 5.0F);
  EXPECT_EQ(sim_.value(kView + "view_type"), 1000.0F);
  EXPECT_TRUE(journalled().empty());
}

TEST_F(ViewRequestsTest, GivesBackWhatTheFirstWishFound) {
  sim_.set(kVertical, 2.0F);
  ASSERT_EQ(ask(ViewWish::kDown, 90.0).code, ResultCode::kOk);
  EXPECT_EQ(sim_.value(kField), 90.0F);
  ASSERT_EQ(ask(ViewWish::kRear).code, ResultCode::kOk);
  EXPECT_EQ(sim_.value(kHorizontal), 180.0F);
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_EQ(sim_.value(kVertical), 2.0F);
  EXPECT_EQ(sim_.value(kHorizontal), 0.0F);
  EXPECT_EQ(sim_.value(kField), 60.0F);
  EXPECT_EQ(sim_.value(kView + "view_type"), 1000.0F);
  EXPECT_TRUE(journalled().empty());
}

TEST_F(ViewRequestsTest, WhatAnotherHasGivenBackIsNotGivenBackAgain) {
  ASSERT_EQ(ask(ViewWish::kDown, 90.0).code, ResultCode::kOk);
  sim_.journal()->removeUndone(journalled());  // by the guardian in a hang, or scripts/release_overrides
  sim_.set(kField, 75.0F);                     // the user's own, since
  look(1017, 0.0F);
  sim_.clearMessages();
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(sim_.value(kField), 75.0F);
}

TEST_F(ViewRequestsTest, WhatIsThereAfterAnotherHasGivenBackCounts) {
  ASSERT_EQ(ask(ViewWish::kDown, 90.0).code, ResultCode::kOk);
  sim_.journal()->removeUndone(journalled());
  sim_.set(kField, 75.0F);
  ASSERT_EQ(ask(ViewWish::kDown, 90.0).code, ResultCode::kOk);
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_EQ(sim_.value(kField), 75.0F);
}

TEST_F(ViewRequestsTest, TheFieldOfViewOfBeforeAnotherNodesChangeIsTheUsersOwn) {
  sim_.journalOfAnother(true).record("field_of_view", "field_of_view", {core::UndoDref{kField, 72.0F}});
  sim_.set(kField, 40.0F);  // capture_node's set_field_of_view
  ASSERT_EQ(ask(ViewWish::kDown, 90.0).code, ResultCode::kOk);
  sim_.journalOfAnother(true).remove({"field_of_view"});
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_EQ(sim_.value(kField), 72.0F);
  EXPECT_TRUE(journalled().empty());
}

TEST_F(ViewRequestsTest, AFieldOfViewThatAnotherNodeStillHoldsIsLeftToIt) {
  sim_.journalOfAnother(true).record("field_of_view", "field_of_view", {core::UndoDref{kField, 72.0F}});
  sim_.set(kField, 40.0F);
  sim_.set(kVertical, 2.0F);
  ASSERT_EQ(ask(ViewWish::kDown, 90.0).code, ResultCode::kOk);
  sim_.clearMessages();
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_EQ(sim_.value(kField), 90.0F);
  EXPECT_EQ(sim_.value(kVertical), 2.0F) << "what it does not hold is given back";
  ASSERT_EQ(journalled().size(), 1U);
  EXPECT_EQ(journalled()[0].id, "field_of_view");
}

TEST_F(ViewRequestsTest, TheFieldOfViewIsReadWhenItIsFirstChanged) {
  sim_.set(kField, 80.0F);  // a step of a calibration
  ASSERT_EQ(ask(ViewWish::kDown).code, ResultCode::kOk);
  sim_.set(kField, 72.0F);
  ASSERT_EQ(ask(ViewWish::kDown, 60.0).code, ResultCode::kOk);
  ASSERT_EQ(ask(ViewWish::kDown, 50.0).code, ResultCode::kOk);
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_EQ(sim_.value(kField), 72.0F);
}

TEST_F(ViewRequestsTest, AFieldOfViewThatDoesNotAnswerLeavesTheViewBeforeIt) {
  ASSERT_EQ(ask(ViewWish::kDown).code, ResultCode::kOk);
  sim_.set(kField, std::nanf(""));
  const RequestResult result = ask(ViewWish::kRear, 60.0);
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not report " + kField + ", which could not be given back");
  EXPECT_EQ(sim_.value(kVertical), -90.0F);
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_EQ(sim_.value(kVertical), 0.0F);
}

TEST_F(ViewRequestsTest, AnotherXPlaneKeepsItsView) {
  ASSERT_EQ(ask(ViewWish::kDown, 90.0).code, ResultCode::kOk);
  views_.forget();
  EXPECT_TRUE(journalled().empty());
  sim_.clearMessages();
  EXPECT_TRUE(views_.giveBack(1.0));
  EXPECT_TRUE(sim_.messages().empty());
  views_.forget();  // nothing is there
}

TEST_F(ViewRequestsTest, WhatDoesNotAnswerInTimeIsNotChanged) {
  sim_.set(kView + "pilots_head_psi", std::nanf(""));
  const RequestResult result = ask(ViewWish::kDown);
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not report " + kView + "pilots_head_psi, which could not be given back");
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(journalled().empty());
  sim_.set(kView + "pilots_head_psi", 0.0F);
  EXPECT_EQ(ask(ViewWish::kDown).code, ResultCode::kOk);
}

TEST_F(ViewRequestsTest, SilentCameraIsNoSuccess) {
  sim_.on_frame = {};
  sim_.set(kView + "view_heading", std::nanf(""));
  sim_.set(kView + "world_matrix[0]", std::nanf(""));
  const RequestResult result = ask(ViewWish::kForward);
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_NE(result.text.find("view_*"), std::string::npos) << result.text;
  EXPECT_TRUE(journalled().empty());
}

TEST_F(ViewRequestsTest, RefusesWhatIsNoWish) {
  EXPECT_EQ(ask(9).code, ResultCode::kRefused);
  EXPECT_EQ(ask(ViewWish::kForward, 200.0).code, ResultCode::kRefused);
}

}  // namespace
}  // namespace xplane_bridge
