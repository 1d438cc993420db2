#include "xplane_bridge/core/base/conformance.hpp"

#include <gtest/gtest.h>

#include "xplane_bridge/core/base/simulator_version.hpp"

namespace xplane_bridge::core {
namespace {

constexpr const char* kFile = R"({
  "format": "xplane_bridge conformance", "version": 1, "xplane_version": 122015, "host": "192.0.2.1", "port": 49000,
  "flown": "2026-01-02T03:04:05Z",
  "questions": {
    "row16": {"verdict": "refuted", "text": "row 16 is Q, P, R in rad/s", "facts": {"off": 0.1}},
    "vehs": {"verdict": "refuted", "text": "", "facts": {}},
    "hpath": {"verdict": "refuted", "text": "", "facts": {}},
    "row20": {"verdict": "confirmed", "text": "", "facts": {}},
    "fcon-acts": {"verdict": "not testable", "text": "", "facts": {}}
  }
})";

TEST(Conformance, GivesWhatIsRefutedAndTheSwitchesOfIt) {
  const Conformance found = conformanceFromText(kFile);
  EXPECT_EQ(found.xplane_version, 122015);
  EXPECT_EQ(found.refuted, (std::vector<std::string>{"hpath", "row16", "vehs"}));
  const SimulatorVersion version{found.xplane_version, found.otherwise()};
  EXPECT_TRUE(version.is(Otherwise::kRow16));
  EXPECT_TRUE(version.is(Otherwise::kVehs));
  EXPECT_FALSE(version.is(Otherwise::kRow20));
  EXPECT_FALSE(version.is(Otherwise::kFconActs));
  EXPECT_EQ(found.otherwise(), 0x102U) << "row16 and vehs, and no other";
}

TEST(Conformance, EachSwitchSaysWhatTheNodesDo) {
  EXPECT_EQ(consequenceOf("vehs"), "flights are placed by PREL, not by VEHS");
  EXPECT_EQ(consequenceOf("hpath"), "");
}

TEST(Conformance, RefusesWhatIsNoSuchFile) {
  for (const char* text : {"", "nothing: here", "{}", R"({"format": "xplane_bridge journal", "version": 1})",
                           R"({"format": "xplane_bridge conformance", "version": 2})",
                           R"({"format": "xplane_bridge conformance", "version": 1, "xplane_version": "12"})",
                           R"({"format": "xplane_bridge conformance", "version": 1, "xplane_version": 1e50})"}) {
    EXPECT_THROW(conformanceFromText(text), ConformanceError) << text;
  }
}

TEST(Conformance, ThatIsOtherwiseIsAnotherVersion) {
  EXPECT_NE((SimulatorVersion{122015, 1}), (SimulatorVersion{122015}));
  EXPECT_EQ((SimulatorVersion{122015, 1}), (SimulatorVersion{122015, 1}));
}

TEST(Conformance, BitsAreGivenBackAsTheirIds) {
  EXPECT_TRUE(refutedOf(0).empty());
  const std::vector<std::string> ids = {"row16", "beta-sign"};
  Conformance found;
  found.refuted = ids;
  EXPECT_EQ(refutedOf(found.otherwise()), ids);
}

}  // namespace
}  // namespace xplane_bridge::core
