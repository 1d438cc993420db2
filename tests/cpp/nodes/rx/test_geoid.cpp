#include "xplane_bridge/nodes/rx/geoid.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>

namespace xplane_bridge {
namespace {

std::string messageOf(const std::string& name, const std::string& folder) {
  try {
    Geoid::named(name, folder);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(Geoid, ConstantIsTheSameEverywhere) {
  EXPECT_EQ(Geoid().undulation(37.0, 127.0), 0.0);
  EXPECT_EQ(Geoid(23.5).undulation(-80.0, -179.0), 23.5);
}

#ifdef XPLANE_BRIDGE_GEOGRAPHICLIB

/// A model whose undulation is a tenth of the latitude [m/deg], north +, at points 10 deg apart.
class GeoidFile : public testing::Test {
 protected:
  GeoidFile() {
    std::ofstream out(path_, std::ios::binary);
    out << "P5\n# Geoid file in PGM format for the GeographicLib::Geoid class\n# Description synthetic\n"
        << "# DateTime 2020-01-01 00:00:00\n# MaxBilinearError 0\n# RMSBilinearError 0\n# MaxCubicError 0\n"
        << "# RMSCubicError 0\n# Offset -100\n# Scale 0.01\n# Origin 90N 0E\n# AREA_OR_POINT Point\n"
        << "# Vertical_Datum WGS84\n36 19\n65535\n";
    for (int latitude = 90; latitude >= -90; latitude -= 10) {
      const int value = (latitude / 10 + 100) * 100;
      for (int column = 0; column < 36; ++column) {
        out.put(static_cast<char>(value >> 8)).put(static_cast<char>(value & 0xff));
      }
    }
  }
  ~GeoidFile() override { std::remove(path_.c_str()); }

  const std::string folder_ = testing::TempDir();
  const std::string path_ = folder_ + "/xplane_bridge_test.pgm";
};

TEST_F(GeoidFile, UndulationIsThatOfTheModel) {
  const Geoid geoid = Geoid::named("xplane_bridge_test", folder_);
  EXPECT_NEAR(geoid.undulation(37.46, 126.44), 3.746, 1e-3);
  EXPECT_NEAR(geoid.undulation(-45.0, -10.0), -4.5, 1e-3);
  EXPECT_NEAR(geoid.undulation(0.0, 179.99), 0.0, 1e-3);
}

TEST_F(GeoidFile, MissingFileIsNamedWithWhatToDo) {
  const std::string message = messageOf("egm96-5", folder_ + "/nowhere");
  EXPECT_NE(message.find("expected egm96-5.pgm in " + folder_ + "/nowhere"), std::string::npos) << message;
  EXPECT_NE(message.find("geographiclib-get-geoids egm96-5"), std::string::npos) << message;
}

TEST_F(GeoidFile, FileThatIsNoneIsRefused) {
  std::ofstream(path_) << "P5\nnothing\n";
  EXPECT_NE(messageOf("xplane_bridge_test", folder_), "");
}

#else

TEST(Geoid, ModelWithoutTheLibraryIsRefused) {
  EXPECT_NE(messageOf("egm96-5", "").find("this build has no GeographicLib"), std::string::npos);
}

#endif

}  // namespace
}  // namespace xplane_bridge
