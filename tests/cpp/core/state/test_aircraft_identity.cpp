#include "xplane_bridge/core/state/aircraft_identity.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <set>

namespace xplane_bridge::core {
namespace {

/// Feeds the reader as X-Plane would: one value a character, zeros after the end.
class Feeder {
 public:
  void set(const std::string& dataref, const std::string& text) { texts_[dataref] = text; }
  void lose(const std::set<std::string>& datarefs) { lost_ = datarefs; }

  bool feed(AircraftIdentityReader* reader) {
    std::vector<std::uint8_t> pairs;
    std::int32_t index = 0;
    for (const std::string& name : AircraftIdentityReader::datarefs()) {
      const std::size_t bracket = name.find('[');
      const std::string& text = texts_[name.substr(0, bracket)];
      const std::size_t position = std::stoul(name.substr(bracket + 1));
      if (lost_.count(name) != 0) {
        ++index;
        continue;
      }
      const float value = position < text.size() ? static_cast<float>(text[position]) : 0.0F;
      std::uint8_t pair[8];
      std::memcpy(pair, &index, 4);
      std::memcpy(pair + 4, &value, 4);
      pairs.insert(pairs.end(), pair, pair + 8);
      ++index;
    }
    now_ns_ += 1'000'000'000;
    return reader->add(RrefView(pairs.data(), pairs.size() / 8), now_ns_);
  }

 private:
  std::map<std::string, std::string> texts_;
  std::set<std::string> lost_;
  std::int64_t now_ns_ = 0;
};

TEST(AircraftIdentity, AsksForOneElementACharacter) {
  const std::vector<std::string>& datarefs = AircraftIdentityReader::datarefs();
  EXPECT_EQ(datarefs.front(), "sim/aircraft/view/acf_ICAO[0]");
  EXPECT_EQ(datarefs.back(), "sim/aircraft/view/acf_descrip[63]");
}

TEST(AircraftIdentity, ReadsBothStringsAndSaysWhenTheyChange) {
  AircraftIdentityReader reader;
  Feeder feeder;
  EXPECT_FALSE(reader.known());
  feeder.set("sim/aircraft/view/acf_ICAO", "DA62");
  feeder.set("sim/aircraft/view/acf_descrip", "Light twin  ");
  EXPECT_TRUE(feeder.feed(&reader));
  EXPECT_EQ(reader.identity().icao, "DA62");
  EXPECT_EQ(reader.identity().description, "Light twin");
  EXPECT_TRUE(reader.known());
  EXPECT_FALSE(feeder.feed(&reader));
  feeder.set("sim/aircraft/view/acf_ICAO", "BE58");
  EXPECT_TRUE(feeder.feed(&reader));
  EXPECT_EQ(reader.identity().icao, "BE58");
  EXPECT_EQ(reader.answers(), 3u);
}

TEST(AircraftIdentity, IsListedByEitherNameWhateverBlanksAreAtTheEnds) {
  AircraftIdentityReader reader;
  Feeder feeder;
  feeder.set("sim/aircraft/view/acf_descrip", " My Glider ");
  ASSERT_TRUE(feeder.feed(&reader));
  EXPECT_EQ(reader.identity().description, " My Glider") << "as aircraft_config writes it";
  EXPECT_TRUE(isListed(reader.identity(), {"BE58", " My Glider"}));
  EXPECT_TRUE(isListed(reader.identity(), {"My Glider"}));
  EXPECT_FALSE(isListed(reader.identity(), {"MyGlider", "My  Glider", "", " "})) << "nor by the ICAO code it has not";
  EXPECT_TRUE(isListed({"BE58", "Baron"}, {"BE58"}));
  EXPECT_TRUE(isListed({"BE58", "Baron"}, {" Baron"}));
  EXPECT_FALSE(isListed({"BE58", "Baron"}, {"BE5"}));
}

TEST(AircraftIdentity, WaitsForACharacterWhoseRequestWasLost) {
  for (const char* lost : {"sim/aircraft/view/acf_ICAO[2]", "sim/aircraft/view/acf_descrip[0]"}) {
    AircraftIdentityReader reader;
    Feeder feeder;
    feeder.set("sim/aircraft/view/acf_ICAO", "C172");
    feeder.set("sim/aircraft/view/acf_descrip", "Skyhawk");
    feeder.lose({lost});
    for (int second = 0; second < 6; ++second) EXPECT_FALSE(feeder.feed(&reader)) << lost;
    EXPECT_EQ(reader.answers(), 0U);
    feeder.lose({});
    EXPECT_TRUE(feeder.feed(&reader));
    EXPECT_EQ(reader.identity().icao, "C172");
    EXPECT_EQ(reader.identity().description, "Skyhawk");
  }
}

TEST(AircraftIdentity, ATextThatXPlaneDoesNotHaveIsEmpty) {
  AircraftIdentityReader reader;
  Feeder feeder;
  feeder.set("sim/aircraft/view/acf_descrip", "Skyhawk");
  std::set<std::string> lost{"sim/aircraft/view/acf_descrip[60]"};  // behind its end
  for (int i = 0; i < 8; ++i) lost.insert("sim/aircraft/view/acf_ICAO[" + std::to_string(i) + "]");
  feeder.lose(lost);
  bool known = false;
  for (int second = 0; second < 6; ++second) known = feeder.feed(&reader) || known;
  EXPECT_TRUE(known);
  EXPECT_EQ(reader.identity().icao, "");
  EXPECT_EQ(reader.identity().description, "Skyhawk");
}

TEST(AircraftIdentity, TakesAnAnswerReadAtOnceLikeOneOfTheStream) {
  AircraftIdentityReader reader;
  std::vector<DatarefValue> values(AircraftIdentityReader::datarefs().size(), 0.0F);
  values[0] = static_cast<float>('Q');
  values[8] = static_cast<float>('x');
  EXPECT_TRUE(reader.add(values));
  EXPECT_EQ(reader.identity().icao, "Q");
  EXPECT_EQ(reader.identity().description, "x");
  EXPECT_FALSE(reader.add(values)) << "the same again";
  values[0] = static_cast<float>('R');
  values[3].reset();
  EXPECT_FALSE(reader.add(values)) << "one character is missing";
  EXPECT_EQ(reader.answers(), 2u);
}

TEST(AircraftIdentity, CharactersOutsideAsciiAreMarked) {
  AircraftIdentityReader reader;
  Feeder feeder;
  feeder.set("sim/aircraft/view/acf_descrip", "a\x01z");
  EXPECT_TRUE(feeder.feed(&reader));
  EXPECT_EQ(reader.identity().description, "a?z");
}

}  // namespace
}  // namespace xplane_bridge::core
