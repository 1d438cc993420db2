// Which file of the doctor's card a node reads, and which names it has in a log.
#include "xplane_bridge/nodes/base/conformance_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge {
namespace {

namespace fs = std::filesystem;

constexpr std::int32_t kVersion = 122015;
constexpr std::uint16_t kPort = 49000;
constexpr std::uint32_t kElsewhere = 0xCB007107U;  // 203.0.113.7: of the block for documentation, in use nowhere
constexpr auto kRow16 = static_cast<std::uint32_t>(core::Otherwise::kRow16);
constexpr auto kVehs = static_cast<std::uint32_t>(core::Otherwise::kVehs);

std::string nameOf(std::uint32_t address) {
  return core::Endpoint{address, kPort}.addressString() + "_49000_conformance.yaml";
}

/// Another of this computer's addresses than the loopback's.
std::optional<std::uint32_t> otherAddress() {
  for (const std::uint32_t address : core::ownAddresses()) {
    if (!core::isSameHost(address, core::kLoopbackAddress)) return address;
  }
  return std::nullopt;
}

class ConformanceFile : public testing::Test {
 protected:
  ConformanceFile() {
    fs::create_directories(folder_);
    setenv("ROS_HOME", home_.c_str(), 1);
  }
  ~ConformanceFile() override {
    unsetenv("ROS_HOME");
    fs::remove_all(home_);
  }

  void write(std::uint32_t address, const std::string& refuted) const {
    std::ofstream(folder_ / nameOf(address))
        << R"({"format": "xplane_bridge conformance", "version": 1, "xplane_version": 122015, "questions": {")"
        << refuted << R"(": {"verdict": "refuted"}}})";
  }

  static std::uint32_t read(std::uint32_t address, bool replays = false) {
    return readConformance("", {address, kPort}, kVersion, replays);
  }

  const fs::path home_ = fs::temp_directory_path() / ("conformance_file_" + std::to_string(getpid()));
  const fs::path folder_ = home_ / "xplane_bridge";
};

TEST_F(ConformanceFile, IsOneForAllAddressesOfThisComputer) {
  write(core::kLoopbackAddress, "row16");
  EXPECT_EQ(read(core::kLoopbackAddress), kRow16);
  EXPECT_EQ(read(core::kLoopbackAddress + 1), kRow16);
  EXPECT_EQ(read(kElsewhere), 0U) << "another computer's X-Plane";
  const auto other = otherAddress();
  if (!other) GTEST_SKIP() << "this computer has the loopback's address only";
  EXPECT_EQ(read(*other), kRow16);
  write(*other, "vehs");
  const fs::path named = folder_ / nameOf(*other);
  const fs::file_time_type here = fs::last_write_time(folder_ / nameOf(core::kLoopbackAddress));
  fs::last_write_time(named, here - std::chrono::hours(1));
  EXPECT_EQ(read(*other), kRow16) << "an earlier card, of a doctor that named it otherwise";
  fs::last_write_time(named, here + std::chrono::hours(1));
  EXPECT_EQ(read(*other), kVehs) << "a later card of that doctor";
  std::map<std::string, fs::path> files{{nameOf(core::kLoopbackAddress), folder_ / nameOf(core::kLoopbackAddress)},
                                        {nameOf(*other), named}};
  nameByEachAddress(&files);
  EXPECT_EQ(files.at(nameOf(*other)), named);
}

TEST_F(ConformanceFile, OfAnEarlierDoctorIsReadUnderTheAddressThatWasFlown) {
  const std::uint32_t flown = otherAddress().value_or(core::kLoopbackAddress);
  write(flown, "vehs");
  EXPECT_EQ(read(flown), kVehs);
}

TEST_F(ConformanceFile, OfAnotherComputerIsReadUnderItsAddress) {
  write(core::kLoopbackAddress, "row16");
  write(kElsewhere, "vehs");
  EXPECT_EQ(read(kElsewhere), kVehs);
}

TEST_F(ConformanceFile, IsFoundByAReplayWhicheverComputerItRunsOn) {
  std::map<std::string, fs::path> files;
  files[nameOf(core::kLoopbackAddress)] = "here";
  files[nameOf(kElsewhere)] = "elsewhere";
  files["mixing/twin.yaml"] = "mixing";
  std::map<std::string, fs::path> expected = files;
  for (const std::uint32_t address : core::ownAddresses()) expected[nameOf(address)] = "here";
  if (const auto other = otherAddress()) files[nameOf(*other)] = "earlier";
  nameByEachAddress(&files);
  EXPECT_EQ(files, expected);

  const std::uint32_t flown = otherAddress().value_or(kElsewhere);
  write(core::kLoopbackAddress, "row16");
  EXPECT_EQ(read(core::kLoopbackAddress, true), kRow16);
  EXPECT_EQ(read(flown, true), 0U) << "its X-Plane was another computer's, or the log would have its file";
  write(flown, "vehs");
  EXPECT_EQ(read(flown, true), kVehs);
}

}  // namespace
}  // namespace xplane_bridge
