// Which of the windows on a screen X11WindowSource takes.

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "x11_window_source_test.hpp"

TEST_F(X11WindowSourceTest, FindsByClassIdExpressionAndRegion) {
  TestWindow window(server_.display(), "X-Plane 11.55 X-System", 320, 240, 30, 40);
  window.fill(0xff0000);
  X11SourceOptions by_class = titled(server_, "");
  by_class.class_name = "XpClass";
  X11SourceOptions by_id = titled(server_, "");
  by_id.window_id = window.id();
  X11SourceOptions by_expression = titled(server_, "^X-Plane 1[12].*X-System$");
  by_expression.title_is_regex = true;
  X11SourceOptions by_region = titled(server_, "");
  by_region.region = cv::Rect(30, 40, 64, 48);
  for (const auto& options : {by_class, by_id, by_expression, by_region}) {
    X11WindowSource source(options, steadyNow);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
    EXPECT_EQ(pixelAt(picture_.bgr, 5, 5), kRed) << source.describe();
  }
  EXPECT_EQ(picture_.bgr.size(), cv::Size(64, 48));
  by_region.region = cv::Rect(700, 500, 640, 480);
  X11WindowSource beyond(by_region, steadyNow);
  EXPECT_TRUE(becomesLost(beyond));
  EXPECT_NE(beyond.problem().find("800x600"), std::string::npos) << beyond.problem();
}

TEST_F(X11WindowSourceTest, PrefersTheExactTitleThenTheLargest) {
  TestWindow editor(server_.display(), "notes on X-System - editor", 600, 500);
  TestWindow small(server_.display(), "X-System", 100, 80);
  TestWindow large(server_.display(), "X-System", 320, 240);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(source.window(), large.id());
}

TEST_F(X11WindowSourceTest, OfAClassAnUntitledWindowIsNotPreferred) {
  TestWindow large(server_.display(), "flight", 320, 240);
  TestWindow menu(server_.display(), "", 100, 80);
  X11SourceOptions options = titled(server_, "");
  options.class_name = "XpClass";
  X11WindowSource source(options, steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
  EXPECT_EQ(source.window(), large.id());
}

TEST_F(X11WindowSourceTest, OfWindowsAlikeTheIndexChoosesFromTheLeft) {
  TestWindow right(server_.display(), "X-System", 320, 240, 400, 0);
  TestWindow left(server_.display(), "X-System", 100, 80, 10, 20);
  TestWindow below(server_.display(), "X-System", 200, 160, 10, 300);
  X11WindowSource largest(titled(server_, ""), steadyNow);
  ASSERT_TRUE(nextPicture(largest, picture_));
  EXPECT_EQ(largest.window(), right.id());
  EXPECT_NE(largest.describe().find(", one of 3 that are alike"), std::string::npos) << largest.describe();
  int index = 0;
  for (const TestWindow* window : {&left, &below, &right}) {
    X11SourceOptions options = titled(server_, "");
    options.index = index++;
    X11WindowSource source(options, steadyNow);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
    EXPECT_EQ(source.window(), window->id()) << "index " << options.index;
    EXPECT_EQ(source.describe().find("alike"), std::string::npos);
  }
  X11SourceOptions options = titled(server_, "");
  options.index = 3;
  X11WindowSource none(options, steadyNow);
  EXPECT_TRUE(becomesLost(none));
  EXPECT_NE(none.problem().find("number 3 from the left"), std::string::npos) << none.problem();
  EXPECT_NE(none.problem().find("there are 3, counted from 0"), std::string::npos) << none.problem();
}

TEST_F(X11WindowSourceTest, OfWindowsAlikeNoneTakesThePlaceOfAnother) {
  TestWindow other(server_.display(), "notes", 100, 80);  // a server that its last client leaves begins anew
  for (const int index : {0, -1}) {
    auto left = std::make_unique<TestWindow>(server_.display(), "X-System", 320, 240, 10, 20);
    TestWindow right(server_.display(), "X-System", 100, 80, 400, 0);
    left->fill(0xff0000);
    X11SourceOptions options = titled(server_, "");
    options.index = index;
    X11WindowSource source(options, steadyNow);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
    ASSERT_EQ(source.window(), left->id());
    left->unmap();
    EXPECT_TRUE(becomesLost(source));
    EXPECT_TRUE(saysSo(source, "is hidden or closed")) << source.problem();
    EXPECT_EQ(source.window(), std::nullopt);
    left->map();
    left->fill(0xff0000);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
    EXPECT_EQ(source.window(), left->id());
    left.reset();
    EXPECT_TRUE(becomesLost(source));
    EXPECT_TRUE(saysSo(source, "was there beside it and is not taken in its place")) << source.problem();
    TestWindow again(server_.display(), "X-System", 320, 240, 10, 20);  // opened anew
    again.fill(0xff0000);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
    EXPECT_EQ(source.window(), again.id());
  }
}

TEST_F(X11WindowSourceTest, OfWindowsAlikeTheCapturedOneStaysWhateverItsSizeBecomes) {
  TestWindow notes(server_.display(), "notes", 100, 80);  // a server that its last client leaves begins anew
  for (const int index : {0, -1}) {
    TestWindow captured(server_.display(), "X-System", 320, 240, 10, 20);
    TestWindow other(server_.display(), "X-System", 200, 160, 400, 0);
    captured.fill(0xff0000);
    X11SourceOptions options = titled(server_, "");
    options.index = index;
    options.use_composite = false;
    X11WindowSource source(options, steadyNow);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
    ASSERT_EQ(source.window(), captured.id());
    Change change;
    captured.fill(0x00ff00);
    while (source.waitChange(kShort, change) != WaitResult::kChange) {
    }
    captured.resize(100, 80);  // when its pixels are about to be read
    captured.move(600, 300);
    EXPECT_EQ(source.grab(change, picture_), GrabResult::kLost);
    captured.fill(0x0000ff);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.problem();
    EXPECT_EQ(source.window(), captured.id());
    EXPECT_EQ(picture_.bgr.size(), cv::Size(100, 80));
  }
}

TEST_F(X11WindowSourceTest, OfWindowsAlikeThePointChoosesTheOneThatCoversIt) {
  TestWindow right(server_.display(), "X-System", 320, 240, 400, 0);
  TestWindow left(server_.display(), "X-System", 100, 80, 10, 20);
  X11SourceOptions options = titled(server_, "");
  for (const auto& [point, window] :
       {std::make_pair(cv::Point(10, 20), &left), std::make_pair(cv::Point(109, 99), &left),
        std::make_pair(cv::Point(719, 239), &right)}) {
    options.point = point;
    X11WindowSource source(options, steadyNow);
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
    EXPECT_EQ(source.window(), window->id()) << point;
    EXPECT_EQ(source.describe().find("alike"), std::string::npos);
  }
  options.point = cv::Point(110, 99);
  X11WindowSource none(options, steadyNow);
  EXPECT_TRUE(becomesLost(none));
  EXPECT_NE(none.problem().find("at the point 110, 99 of the screen"), std::string::npos) << none.problem();
  EXPECT_NE(none.problem().find("there are 2, none of them there"), std::string::npos) << none.problem();
  options.index = 1;
  EXPECT_THROW(X11WindowSource(options, steadyNow), std::invalid_argument);
}

TEST_F(X11WindowSourceTest, FindsXPlanesOwnWindowByExactlyItsTitle) {
  TestWindow browser(server_.display(), "X-Plane 12 manual - browser", 600, 500);
  X11WindowSource source(titled(server_, ""), steadyNow);
  EXPECT_TRUE(becomesLost(source));
  EXPECT_NE(source.problem().find("\"X-System\" or \"X-Plane\""), std::string::npos) << source.problem();
  EXPECT_NE(source.problem().find("\"X-Plane 12 manual - browser\""), std::string::npos) << source.problem();
  for (const char* title : {"X-System", "X-Plane"}) {
    TestWindow window(server_.display(), title, 320, 240);
    X11WindowSource finds(titled(server_, ""), steadyNow);
    ASSERT_TRUE(nextPicture(finds, picture_)) << finds.describe();
    EXPECT_EQ(finds.window(), window.id());
  }
}

TEST_F(X11WindowSourceTest, PrefersTheWindowWhoseProcessIsXPlane) {
  TestWindow folder(server_.display(), "X-Plane", 600, 500);  // a file manager, say
  TestWindow elsewhere(server_.display(), "X-Plane", 500, 400);
  TestWindow window(server_.display(), "X-Plane", 320, 240);
  char host[256] = {};
  ASSERT_EQ(gethostname(host, sizeof host - 1), 0);
  char before[16] = {};
  ASSERT_EQ(prctl(PR_GET_NAME, before), 0);
  ASSERT_EQ(prctl(PR_SET_NAME, "X-Plane-x86_64"), 0);  // of the process too, as this is its main thread
  folder.ownedBy(1, host);
  elsewhere.ownedBy(static_cast<std::uint32_t>(getpid()), "another-computer");
  window.ownedBy(static_cast<std::uint32_t>(getpid()), host);
  X11WindowSource source(titled(server_, ""), steadyNow);
  const bool found = nextPicture(source, picture_);
  prctl(PR_SET_NAME, before);
  ASSERT_TRUE(found);
  EXPECT_EQ(source.window(), window.id());
  window.unmap();
  EXPECT_TRUE(becomesLost(source));
  EXPECT_TRUE(saysSo(source, "was there beside it and is not taken in its place")) << source.problem();
}

TEST_F(X11WindowSourceTest, OneThatWasHiddenBesideTheCapturedOneDoesNotTakeItsPlace) {
  TestWindow captured(server_.display(), "X-System", 320, 240, 10, 20);
  TestWindow other(server_.display(), "X-System", 200, 160, 400, 0);
  other.unmap();
  X11WindowSource source(titled(server_, ""), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
  ASSERT_EQ(source.window(), captured.id());
  captured.unmap();
  other.map();
  EXPECT_TRUE(becomesLost(source));
  EXPECT_TRUE(saysSo(source, "was there beside it and is not taken in its place")) << source.problem();
}

TEST_F(X11WindowSourceTest, OneThatWasHiddenAndFitsBetterTakesTheCapturedOnesPlace) {
  TestWindow editor(server_.display(), "notes on X-System - editor", 320, 240);
  TestWindow window(server_.display(), "X-System", 200, 160);
  window.unmap();
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
  ASSERT_EQ(source.window(), editor.id());
  editor.unmap();
  window.map();
  ASSERT_TRUE(nextPicture(source, picture_)) << source.problem();
  EXPECT_EQ(source.window(), window.id());
}
