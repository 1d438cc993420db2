#include "xplane_bridge/vision/x11_window_source.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "x11_window_source_test.hpp"

TEST(X11SourceOptions, RefusesContradictions) {
  X11SourceOptions options;
  EXPECT_NO_THROW(X11WindowSource(options, steadyNow));  // X-Plane's own window
  options.title_is_regex = true;
  EXPECT_THROW(X11WindowSource(options, steadyNow), std::invalid_argument);
  options.title_is_regex = false;
  options.title = "a";
  options.class_name = "b";
  EXPECT_THROW(X11WindowSource(options, steadyNow), std::invalid_argument);
  options.class_name.clear();
  options.poll_period = 0.0;
  EXPECT_THROW(X11WindowSource(options, steadyNow), std::invalid_argument);
  options.poll_period = 0.002;
  options.title = "(";
  options.title_is_regex = true;
  EXPECT_THROW(X11WindowSource(options, steadyNow), std::invalid_argument);
  options.title_is_regex = false;
  options.index = 1;
  EXPECT_NO_THROW(X11WindowSource(options, steadyNow));
  options.title.clear();
  options.window_id = 7;
  EXPECT_THROW(X11WindowSource(options, steadyNow), std::invalid_argument);
  EXPECT_THROW((void)vision::changeDetectionFromName("xdamage"), std::invalid_argument);
}

TEST_F(X11WindowSourceTest, ReadsAWindowByTitleAndSeesEveryChangeOnce) {
  TestWindow other(server_.display(), "something else", 300, 300, 400, 100);
  TestWindow window(server_.display(), "X-System", 320, 240);
  window.fill(0xff0000);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
  EXPECT_EQ(picture_.bgr.size(), cv::Size(320, 240));
  EXPECT_EQ(pixelAt(picture_.bgr, 0, 0), kRed);
  EXPECT_FALSE(picture_.display_time_known);  // it was there before us
  EXPECT_EQ(source.window(), window.id());
  EXPECT_TRUE(source.usesDamage());
  EXPECT_TRUE(source.usesSharedMemory());
  for (int i = 1; i <= 5; ++i) {
    const std::int64_t before = steadyNow();
    window.fill(0x00ff00, 0, 0, 20 * i, 240);
    ASSERT_TRUE(nextPicture(source, picture_));
    EXPECT_EQ(pixelAt(picture_.bgr, 20 * i - 1, 100), kGreen);
    EXPECT_EQ(pixelAt(picture_.bgr, 20 * i, 100), kRed);
    EXPECT_TRUE(picture_.display_time_known);
    EXPECT_GE(picture_.grab_time_ns, picture_.display_time_ns);
    EXPECT_GE(picture_.display_time_ns, before - 1'000'000);  // the server's stamp has milliseconds
    EXPECT_TRUE(staysQuiet(source));
  }
}

TEST_F(X11WindowSourceTest, TheFirstDrawingHasItsTimeHoweverLateItIsSeen) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  X11WindowSource source(titled(server_), steadyNow);
  Change change;
  ASSERT_EQ(source.waitChange(kDeadline, change), WaitResult::kChange);  // it has found the window
  const std::int64_t before = steadyNow();
  window.fill(0x00ff00);
  const std::int64_t after = steadyNow();
  std::this_thread::sleep_for(milliseconds(80));  // all events so far are read late
  ASSERT_EQ(source.waitChange(kDeadline, change), WaitResult::kChange);
  ASSERT_EQ(source.grab(change, picture_), GrabResult::kNew);
  EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), kGreen);
  EXPECT_TRUE(picture_.display_time_known);
  EXPECT_GE(picture_.display_time_ns, before - 2'000'000);
  EXPECT_LE(picture_.display_time_ns, after + 2'000'000);
}

TEST_F(X11WindowSourceTest, OfSeveralDrawingsTheLastOneIsThePicturesTime) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  for (std::uint32_t i = 1; i <= 10; ++i) {  // seen at once: by these the server's clock is known
    window.fill(i);
    ASSERT_TRUE(nextPicture(source, picture_));
  }
  std::int64_t last_drawn = 0;
  for (const std::uint32_t colour : {0xff0000U, 0x00ff00U, 0x0000ffU}) {
    std::this_thread::sleep_for(milliseconds(100));
    last_drawn = steadyNow();
    window.fill(colour);
  }
  Change change;
  ASSERT_EQ(source.waitChange(kDeadline, change), WaitResult::kChange);
  ASSERT_EQ(source.grab(change, picture_), GrabResult::kNew);
  EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), kBlue);
  EXPECT_TRUE(picture_.display_time_known);
  EXPECT_GE(picture_.display_time_ns, last_drawn - 1'000'000);
  EXPECT_GE(picture_.grab_time_ns, picture_.display_time_ns);
  EXPECT_TRUE(staysQuiet(source));
}

TEST_F(X11WindowSourceTest, ADrawingBetweenChangeAndGrabIsThePicturesTimeAndNoFurtherChange) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  for (std::uint32_t i = 1; i <= 10; ++i) {
    window.fill(i);
    ASSERT_TRUE(nextPicture(source, picture_));
  }
  window.fill(0xff0000);
  Change change;
  ASSERT_EQ(source.waitChange(kDeadline, change), WaitResult::kChange);
  std::this_thread::sleep_for(milliseconds(100));
  const std::int64_t drawn = steadyNow();
  window.fill(0x00ff00);
  ASSERT_EQ(source.grab(change, picture_), GrabResult::kNew);
  EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), kGreen);
  EXPECT_TRUE(picture_.display_time_known);
  EXPECT_GE(picture_.display_time_ns, drawn - 1'000'000);
  EXPECT_EQ(source.waitChange(kShort, change), WaitResult::kTimeout);
}

TEST_F(X11WindowSourceTest, OfARegionOnlyDrawingsInItCount) {
  TestWindow window(server_.display(), "X-System", 320, 240, 0, 0);
  TestWindow other(server_.display(), "terminal", 100, 100, 500, 400);
  X11SourceOptions options = titled(server_, "");
  options.region = cv::Rect(0, 0, 320, 240);
  X11WindowSource source(options, steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_TRUE(staysQuiet(source));
  Change change;
  for (std::uint32_t i = 1; i <= 3; ++i) {
    window.fill(i);
    ASSERT_EQ(source.waitChange(kDeadline, change), WaitResult::kChange);
    const std::int64_t seen = steadyNow();
    std::this_thread::sleep_for(milliseconds(30));
    other.fill(i);
    EXPECT_EQ(source.waitChange(kShort, change), WaitResult::kTimeout) << "not in the picture";
    other.fill(0x100 + i);  // reported beside the read
    ASSERT_EQ(source.grab(change, picture_), GrabResult::kNew);
    EXPECT_TRUE(picture_.display_time_known);
    EXPECT_LE(picture_.display_time_ns, seen + 2'000'000);
  }
}

// Whatever drawing falls before, into and after a read: the time goes with the pixels.
TEST_F(X11WindowSourceTest, EveryPictureHasTheTimeOfTheDrawingItShows) {
  constexpr std::uint32_t kDrawings = 120;
  constexpr std::uint32_t kUnderWay = 20;  // by then the server's clock is known
  TestWindow window(server_.display(), "X-System", 320, 240);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  std::vector<std::int64_t> began(kDrawings + 2);
  std::thread painter([&] {
    for (std::uint32_t i = 1; i <= kDrawings; ++i) {
      began[i] = steadyNow();
      window.fill(i);
      std::this_thread::sleep_for(milliseconds(10));
    }
  });
  std::vector<std::pair<std::uint32_t, std::int64_t>> seen;
  std::uint32_t shown = 0;
  while (shown < kDrawings && nextPicture(source, picture_)) {
    shown = pixelAt(picture_.bgr, 100, 100)[0];  // the blue byte
    if (picture_.display_time_known) seen.emplace_back(shown, picture_.display_time_ns);
    std::this_thread::sleep_for(milliseconds(shown * 7 % 45));
  }
  painter.join();
  ASSERT_EQ(shown, kDrawings);
  began[kDrawings + 1] = steadyNow();
  for (const auto& [drawing, time_ns] : seen) {
    if (drawing < kUnderWay) continue;
    EXPECT_GE(time_ns, began[drawing] - 1'000'000) << "drawing " << drawing;
    EXPECT_LT(time_ns, began[drawing + 1] + 1'000'000) << "drawing " << drawing;
  }
}

TEST_F(X11WindowSourceTest, LookingAnewShowsOnceMoreWhatStands) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  window.fill(0xff0000);
  X11WindowSource source(titled(server_), steadyNow);
  source.lookAnew();  // there is nothing yet
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_TRUE(staysQuiet(source));
  source.lookAnew();
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), kRed);
  EXPECT_FALSE(picture_.display_time_known);
  EXPECT_TRUE(staysQuiet(source));
}

TEST_F(X11WindowSourceTest, SeesAWindowThatIsCovered) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  window.fill(0xff0000);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  TestWindow cover(server_.display(), "cover", 500, 500, 0, 0);
  cover.fill(0x0000ff);
  window.fill(0x00ff00);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), kGreen);
}

// As i3 and others do with a workspace: the window itself is neither unmapped nor resized.
TEST_F(X11WindowSourceTest, FollowsAWindowWhoseFrameIsHiddenAndShownAgain) {
  TestWindow frame(server_.display(), "frame", 400, 300);
  TestWindow window(server_.display(), "X-System", 320, 240);
  putInto(frame, window, server_);
  window.fill(0xff0000);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  for (const std::uint32_t colour : {0x00ff00U, 0x0000ffU}) {
    frame.unmap();
    EXPECT_TRUE(staysQuiet(source));
    frame.map();
    window.fill(colour);
    ASSERT_TRUE(nextPicture(source, picture_));
    EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), colour == 0x00ff00U ? kGreen : kBlue);
  }
  window.fill(0xff0000);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_TRUE(picture_.display_time_known) << "its drawings are followed as before";
}

TEST_F(X11WindowSourceTest, WindowsThatComeAndGoInFrontCostNoPicture) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  TestWindow cover(server_.display(), "cover", 200, 200, 0, 0);
  for (int i = 0; i < 5; ++i) {
    cover.move(i % 2 == 0 ? 600 : 50, 50);
    window.fill(static_cast<std::uint32_t>(i + 1));
    ASSERT_TRUE(nextPicture(source, picture_));
    EXPECT_TRUE(picture_.display_time_known) << "nothing was begun anew";
  }
}

TEST_F(X11WindowSourceTest, WithoutCompositeThePictureIsWhatTheScreenShows) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  window.fill(0xff0000);
  TestWindow cover(server_.display(), "cover", 500, 500, 0, 0);
  cover.fill(0x0000ff);
  X11SourceOptions options = titled(server_);
  options.use_composite = false;
  X11WindowSource source(options, steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_NE(pixelAt(picture_.bgr, 100, 100), kRed);
}

TEST_F(X11WindowSourceTest, FollowsMovesResizesBordersClosingAndComingBack) {
  auto window = std::make_unique<TestWindow>(server_.display(), "X-System", 320, 240, 10, 10, 7);
  window->fill(0xff0000);
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(picture_.bgr.size(), cv::Size(320, 240));
  EXPECT_EQ(pixelAt(picture_.bgr, 0, 0), kRed);  // not the border
  EXPECT_EQ(pixelAt(picture_.bgr, 319, 239), kRed);

  window->move(300, 200);
  window->fill(0x00ff00);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(pixelAt(picture_.bgr, 0, 0), kGreen);

  window->move(700, 500);  // mostly off the screen
  window->fill(0x0000ff);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(pixelAt(picture_.bgr, 319, 239), kBlue);

  window->resize(400, 300);
  window->fill(0xff0000);
  do {
    ASSERT_TRUE(nextPicture(source, picture_)) << source.describe();
  } while (picture_.bgr.size() != cv::Size(400, 300) || pixelAt(picture_.bgr, 399, 299) != kRed);

  window->unmap();
  EXPECT_TRUE(becomesLost(source));
  EXPECT_NE(source.problem().find("X-System"), std::string::npos);
  window->map();
  window->fill(0x00ff00);
  do {
    ASSERT_TRUE(nextPicture(source, picture_));
  } while (pixelAt(picture_.bgr, 0, 0) != kGreen);
  EXPECT_EQ(source.problem(), "");

  window->destroy();
  EXPECT_TRUE(becomesLost(source));
  EXPECT_FALSE(source.window().has_value());
  window = std::make_unique<TestWindow>(server_.display(), "X-System", 200, 100);
  window->fill(0x0000ff);
  do {
    ASSERT_TRUE(nextPicture(source, picture_));
  } while (pixelAt(picture_.bgr, 0, 0) != kBlue);
  EXPECT_EQ(picture_.bgr.size(), cv::Size(200, 100));
}

TEST_F(X11WindowSourceTest, AWindowThatVanishesBetweenChangeAndGrabIsLostAndNoMore) {
  auto window = std::make_unique<TestWindow>(server_.display(), "X-System", 320, 240);
  X11SourceOptions options = titled(server_);
  options.use_composite = false;
  X11WindowSource source(options, steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  window->fill(0xff0000);
  Change change;
  ASSERT_EQ(source.waitChange(kDeadline, change), WaitResult::kChange);
  window->destroy();
  EXPECT_EQ(source.grab(change, picture_), GrabResult::kLost);
  EXPECT_TRUE(becomesLost(source));
}

TEST_F(X11WindowSourceTest, WorksThroughTheSocketWithoutSharedMemory) {
  TestWindow window(server_.display(), "X-System", 321, 241);
  window.fill(0xff0000);
  X11SourceOptions options = titled(server_);
  options.use_shared_memory = false;
  X11WindowSource source(options, steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_FALSE(source.usesSharedMemory());
  window.fill(0x00ff00, 0, 240, 321, 1);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(pixelAt(picture_.bgr, 320, 239), kRed);
  EXPECT_EQ(pixelAt(picture_.bgr, 320, 240), kGreen);
}

class X11WindowByChecksumTest : public X11WindowSourceTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(nextPicture(source_, picture_));
    EXPECT_TRUE(staysQuiet(source_));  // also takes the checksum that changes are measured against
  }
  X11SourceOptions options() const {
    X11SourceOptions out = titled(server_);
    out.change_detection = ChangeDetection::kChecksum;
    return out;
  }

  TestWindow window_{server_.display(), "X-System", 320, 240};
  X11WindowSource source_{options(), steadyNow};
};

TEST_F(X11WindowByChecksumTest, SeesChangesWhereNoEventsAreAskedFor) {
  EXPECT_FALSE(source_.usesDamage());
  window_.fill(0x00ff00);
  ASSERT_TRUE(nextPicture(source_, picture_));
  EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), kGreen);
}

TEST_F(X11WindowByChecksumTest, ALookThatCameInTimeDatesTheChangeAndALateOneDoesNot) {
  std::uint32_t colour = 0;
  for (const int late_ms : {15, 30, 45}) {
    window_.fill(++colour);
    std::this_thread::sleep_for(milliseconds(late_ms));  // nothing looks meanwhile
    ASSERT_TRUE(nextPicture(source_, picture_));
    EXPECT_FALSE(picture_.display_time_known) << late_ms;
    EXPECT_TRUE(staysQuiet(source_));
  }
  // Drawn beside looks that go on; where the computer is busy, they too may come late.
  const auto deadline = std::chrono::steady_clock::now() + kDeadline;
  do {
    std::thread painter([&] {
      std::this_thread::sleep_for(milliseconds(10));
      window_.fill(++colour);
    });
    const bool seen = nextPicture(source_, picture_);
    painter.join();
    ASSERT_TRUE(seen);
  } while (!picture_.display_time_known && std::chrono::steady_clock::now() < deadline);
  EXPECT_TRUE(picture_.display_time_known);
}

TEST_F(X11WindowByChecksumTest, ADrawingBetweenLookAndReadMakesTheTimeUnknown) {
  window_.fill(0x00ff00);
  Change change;
  ASSERT_EQ(source_.waitChange(kDeadline, change), WaitResult::kChange);
  change.time_known = true;  // as far as the look goes
  window_.fill(0x0000ff);
  ASSERT_EQ(source_.grab(change, picture_), GrabResult::kNew);
  EXPECT_EQ(pixelAt(picture_.bgr, 100, 100), kBlue);
  EXPECT_FALSE(picture_.display_time_known);
  EXPECT_EQ(source_.waitChange(kShort, change), WaitResult::kTimeout);
}

TEST_F(X11WindowSourceTest, WithoutDetectionTheDisplayTimeIsUnknown) {
  TestWindow window(server_.display(), "X-System", 320, 240);
  X11SourceOptions options = titled(server_);
  options.change_detection = ChangeDetection::kNone;
  X11WindowSource source(options, steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_));
  window.fill(0x00ff00);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_FALSE(picture_.display_time_known);
}

TEST(X11WindowSource, WorksWithoutTheDamageAndCompositeExtensions) {
  const Xvfb server(24, {"-extension", "DAMAGE", "-extension", "Composite", "-extension", "MIT-SHM"});
  TestWindow window(server.display(), "X-System", 320, 240);
  window.fill(0xff0000);
  X11WindowSource source(titled(server), steadyNow);
  Picture picture;
  ASSERT_TRUE(nextPicture(source, picture));
  EXPECT_FALSE(source.usesDamage());
  EXPECT_FALSE(source.usesSharedMemory());
  EXPECT_TRUE(staysQuiet(source));
  window.fill(0x00ff00);
  ASSERT_TRUE(nextPicture(source, picture));
  EXPECT_EQ(pixelAt(picture.bgr, 100, 100), kGreen);
}

TEST(X11WindowSource, ReadsScreensOfSixteenTwentyFourAndThirtyBits) {
  struct Screen {
    int depth;
    std::uint32_t red, green, blue;  // pixel values
  };
  for (const Screen& screen : {Screen{16, 0xf800, 0x07e0, 0x001f}, Screen{24, 0xff0000, 0x00ff00, 0x0000ff},
                               Screen{30, 0x3ff00000, 0x000ffc00, 0x000003ff}}) {
    const Xvfb server(screen.depth);
    TestWindow window(server.display(), "X-System", 321, 240);
    X11WindowSource source(titled(server), steadyNow);
    Picture picture;
    const std::pair<std::uint32_t, cv::Vec3b> fills[] = {
        {screen.red, kRed}, {screen.green, kGreen}, {screen.blue, kBlue}};
    for (const auto& [pixel, colour] : fills) {
      window.fill(pixel);
      do {
        ASSERT_TRUE(nextPicture(source, picture)) << screen.depth << ": " << source.problem();
      } while (pixelAt(picture.bgr, 320, 239) == cv::Vec3b(0, 0, 0));  // as it was before it was filled
      const cv::Vec3b got = pixelAt(picture.bgr, 320, 239);
      // Five or six bits end at 248 or 252.
      EXPECT_LE(cv::norm(got, colour, cv::NORM_INF), 7) << screen.depth << ": " << got;
    }
  }
}

TEST_F(X11WindowSourceTest, ReadsAWindowOfThirtyTwoBitsOnAScreenOfTwentyFour) {
  TestWindow window(server_.display(), "X-System", 321, 240, 10, 20, 0, 32);
  window.fill(0x80ff0000);  // half transparent to a compositing manager: the colours are read as they are
  X11WindowSource source(titled(server_), steadyNow);
  ASSERT_TRUE(nextPicture(source, picture_)) << source.problem();
  EXPECT_NE(source.describe().find("depth 32"), std::string::npos) << source.describe();
  EXPECT_EQ(pixelAt(picture_.bgr, 320, 239), kRed);
  window.fill(0x0000ff00);
  ASSERT_TRUE(nextPicture(source, picture_));
  EXPECT_EQ(pixelAt(picture_.bgr, 0, 0), kGreen);
}

TEST(X11WindowSource, RefusesAPaletteScreenInWords) {
  const Xvfb server(8);
  TestWindow window(server.display(), "X-System", 320, 240);
  X11WindowSource source(titled(server), steadyNow);
  Change change;
  EXPECT_EQ(source.waitChange(kShort, change), WaitResult::kLost);
  EXPECT_NE(source.problem().find("depth 8"), std::string::npos) << source.problem();
}

TEST(X11WindowSource, SurvivesTheServerAndFindsItAgain) {
  // Servers that choose their number count from 0 on, and do not take this one while it is away.
  const std::string display = ":" + std::to_string(1000 + getpid() % 50000);
  auto server = std::make_unique<Xvfb>(24, std::vector<std::string>{}, display);
  X11SourceOptions options;
  options.display = display;
  options.title = "X-System";
  options.search_period = 0.02;
  X11WindowSource source(options, steadyNow);
  Picture picture;
  {
    TestWindow window(display, "X-System", 320, 240);
    ASSERT_TRUE(nextPicture(source, picture));
  }
  server.reset();
  EXPECT_TRUE(becomesLost(source));
  EXPECT_NE(source.problem(), "");
  server = std::make_unique<Xvfb>(24, std::vector<std::string>{}, display);
  TestWindow window(display, "X-System", 100, 80);
  window.fill(0xff0000);
  ASSERT_TRUE(nextPicture(source, picture));
  EXPECT_EQ(picture.bgr.size(), cv::Size(100, 80));
}

TEST(X11WindowSource, SaysWhatIsMissing) {
  X11SourceOptions options;
  options.display = ":9999";
  options.title = "X-System";
  X11WindowSource source(options, steadyNow);
  Change change;
  EXPECT_EQ(source.waitChange(milliseconds(1), change), WaitResult::kLost);
  EXPECT_NE(source.problem().find(":9999"), std::string::npos);

  const Xvfb server;
  X11WindowSource nowhere(titled(server), steadyNow);
  EXPECT_EQ(nowhere.waitChange(milliseconds(1), change), WaitResult::kLost);
  EXPECT_NE(nowhere.problem().find("no visible window whose title contains \"X-System\""), std::string::npos)
      << nowhere.problem();
}
