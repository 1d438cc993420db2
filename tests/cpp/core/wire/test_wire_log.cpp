#include "xplane_bridge/core/wire/wire_log.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "scripted_hub.hpp"
#include "xplane_bridge/core/wire/wire_log_hub.hpp"

namespace xplane_bridge::core {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A block of pcapng, read as its specification says.
struct Block {
  std::uint32_t type = 0;
  Bytes body;
  std::map<std::uint16_t, Bytes> options;  // the last of each
  std::vector<std::string> comments;

  std::string text(std::uint16_t code) const {
    const auto found = options.find(code);
    return found == options.end() ? "" : std::string(found->second.begin(), found->second.end());
  }
  std::uint32_t word(std::size_t at) const { return loadLittleEndian<std::uint32_t>(&body.at(at)); }
  Bytes packet() const { return {body.begin() + 20, body.begin() + 20 + static_cast<std::ptrdiff_t>(word(12))}; }
  std::int64_t stamp() const { return static_cast<std::int64_t>((std::uint64_t{word(4)} << 32U) | word(8)); }
};

Bytes contentOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<Block> blocksOf(const std::string& path) {
  const Bytes bytes = contentOf(path);
  std::vector<Block> out;
  for (std::size_t at = 0; at + 12 <= bytes.size();) {
    Block block;
    block.type = loadLittleEndian<std::uint32_t>(&bytes[at]);
    const auto size = loadLittleEndian<std::uint32_t>(&bytes[at + 4]);
    EXPECT_EQ(size % 4, 0U);
    EXPECT_EQ(loadLittleEndian<std::uint32_t>(&bytes[at + size - 4]), size);
    block.body.assign(bytes.begin() + static_cast<std::ptrdiff_t>(at + 8),
                      bytes.begin() + static_cast<std::ptrdiff_t>(at + size - 4));
    std::size_t option = 16;  // behind the head of a section
    if (block.type == 1) option = 8;
    if (block.type == 6) option = 20 + (block.word(12) + 3) / 4 * 4;
    while (option + 4 <= block.body.size()) {
      const auto code = loadLittleEndian<std::uint16_t>(&block.body[option]);
      const auto length = loadLittleEndian<std::uint16_t>(&block.body[option + 2]);
      if (code == 0) break;
      const auto begin = block.body.begin() + static_cast<std::ptrdiff_t>(option + 4);
      block.options[code] = Bytes(begin, begin + length);
      if (code == 1) block.comments.emplace_back(begin, begin + length);
      option += 4U + (length + 3U) / 4U * 4U;
    }
    out.push_back(block);
    at += size;
  }
  return out;
}

std::vector<Block> packetsOf(const std::string& path) {
  std::vector<Block> out;
  for (const Block& block : blocksOf(path)) {
    if (block.type == 6) out.push_back(block);
  }
  return out;
}

class WireLogTest : public testing::Test {
 protected:
  WireLogTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "wire-log-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    options_.file = (folder_ / "wire").string();
    options_.node = "rx_node";
    options_.about = "<about/>";
  }
  ~WireLogTest() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& part = "") const { return options_.file + ".rx_node" + part + ".pcapng"; }
  std::unique_ptr<WireLog> open(std::size_t buffer = WireLog::kBufferBytes) {
    return std::make_unique<WireLog>(
        options_, hostClock(), [this](LogLevel, const std::string& text) { said_.push_back(text); }, buffer);
  }
  static WireRecord opened(const std::string& name, std::uint16_t port) {
    WireRecord record;
    record.kind = WireKind::kOpened;
    record.peer.port = port;
    record.payload = {reinterpret_cast<const std::uint8_t*>(name.data()), name.size()};
    return record;
  }
  static WireRecord datagram(WireKind kind, const Bytes& payload, std::int64_t time_ns) {
    WireRecord record;
    record.kind = kind;
    record.wall_ns = time_ns;
    record.steady_ns = time_ns - 1000;
    record.peer = {kLoopbackAddress, 49000};
    record.payload = payload;
    return record;
  }

  std::filesystem::path folder_;
  WireFileOptions options_;
  std::vector<std::string> said_;
  const std::string name_ = "flight";
};

TEST_F(WireLogTest, IsPcapngWithOneInterfaceForEachSource) {
  const Bytes answer{'R', 'R', 'E', 'F', ','};
  {
    const auto log = open();
    log->add(opened(name_, 51000));
    WireRecord came = datagram(WireKind::kReceived, answer, 1'700'000'000'000'000'123);
    came.kernel_ns = 1'700'000'000'000'000'001;
    came.count = 3;
    log->add(came);
    log->add(datagram(WireKind::kSent, {1, 2, 3, 4}, 1'700'000'000'000'000'456));
  }
  const std::vector<Block> blocks = blocksOf(path());
  ASSERT_EQ(blocks.size(), 5U);
  EXPECT_EQ(blocks[0].type, 0x0A0D0D0AU);
  EXPECT_EQ(blocks[0].word(0), 0x1A2B3C4DU);
  EXPECT_EQ(blocks[0].text(1), "<about/>");
  EXPECT_EQ(blocks[1].word(0) & 0xFFFFU, 147U);
  EXPECT_EQ(blocks[2].word(0) & 0xFFFFU, 101U);
  EXPECT_EQ(blocks[2].text(2), "rx_node/flight");
  EXPECT_EQ(blocks[2].text(3), "port 51000");
  EXPECT_EQ(blocks[2].options.at(9), Bytes{9});
  const Block& came = blocks[3];
  EXPECT_EQ(came.word(0), 1U);
  EXPECT_EQ(came.stamp(), 1'700'000'000'000'000'001);
  EXPECT_EQ(came.text(1), "n=0 w=1700000000000000123 s=1699999999999999123 k=1");
  EXPECT_EQ(came.options.at(2), (Bytes{1, 0, 0, 0}));
  EXPECT_EQ(came.options.at(4), (Bytes{3, 0, 0, 0, 0, 0, 0, 0}));
  // Headers worked out by hand: IPv4 of 33 bytes, UDP of 13, from 127.0.0.1:49000 to 127.0.0.1:51000.
  const Bytes headers{0x45, 0, 0,   33, 0, 0, 0,    0,    64,   17,   0x7C, 0xCA, 127, 0,
                      0,    1, 127, 0,  0, 1, 0xBF, 0x68, 0xC7, 0x38, 0,    13,   0,   0};
  const Bytes packet = came.packet();
  ASSERT_EQ(packet.size(), headers.size() + answer.size());
  EXPECT_EQ(Bytes(packet.begin(), packet.begin() + 28), headers);
  EXPECT_EQ(Bytes(packet.begin() + 28, packet.end()), answer);
  EXPECT_EQ(blocks[4].options.at(2), (Bytes{2, 0, 0, 0}));
  EXPECT_EQ(blocks[4].stamp(), 1'700'000'000'000'000'456);
}

TEST_F(WireLogTest, AHeadOfAnyLengthIsWholeInSeveralComments) {
  const std::string two_bytes = "\u00e4";
  options_.about = "<";
  while (options_.about.size() < 150'000) options_.about += two_bytes;
  { WireFile file(options_); }
  const std::vector<std::string> comments = blocksOf(path()).at(0).comments;
  ASSERT_EQ(comments.size(), 3U);
  EXPECT_EQ(comments[0] + comments[1] + comments[2], options_.about);
  for (const std::string& each : comments) {
    EXPECT_EQ(each.substr(each.size() - 2), two_bytes);  // whole characters
  }
}

TEST_F(WireLogTest, LeavesOutWhatHasNoRoomAndSaysHowMuch) {
  constexpr std::uint64_t kCount = 2000;
  std::uint64_t lost = 0;
  {
    const auto log = open(1024);
    log->add(opened(name_, 51000));
    // Far faster than what is written five times a second.
    for (std::uint64_t i = 0; i < kCount; ++i) log->add(datagram(WireKind::kReceived, Bytes(300, 7), 1));
    lost = log->lost();
  }
  ASSERT_GT(lost, 0U);
  std::uint64_t datagrams = 0;
  std::uint64_t logged = 0;
  for (const Block& packet : packetsOf(path())) {
    const Bytes bytes = packet.packet();
    if (packet.word(0) == 1) {
      ++datagrams;
    } else {
      logged += std::stoul(std::string(bytes.begin() + 5, bytes.end()));
    }
  }
  EXPECT_EQ(logged, lost);
  EXPECT_EQ(datagrams + lost, kCount);
}

TEST_F(WireLogTest, AGapIsARecordOfItsOwn) {
  WireFile file(options_);
  Bytes records;
  appendRecord(opened(name_, 51000), &records);
  appendRecord(datagram(WireKind::kReceived, {1}, 5), &records);
  WireRecord gap = datagram(WireKind::kLost, {}, 6);
  gap.count = 17;
  appendRecord(gap, &records);
  appendRecord(datagram(WireKind::kReceived, {2}, 7), &records);
  ASSERT_TRUE(file.write(records));
  const std::vector<Block> packets = packetsOf(path());
  ASSERT_EQ(packets.size(), 3U);
  EXPECT_EQ(packets[1].packet(), (Bytes{'l', 'o', 's', 't', 0, '1', '7', ' ', '0'}));
  EXPECT_EQ(packets[2].text(1).substr(0, 5), "n=19 ");
}

TEST_F(WireLogTest, WaitsAreLoggedByTheNextPacket) {
  WireFile file(options_);
  Bytes records;
  appendRecord(opened(name_, 51000), &records);
  appendRecord(datagram(WireKind::kWaited, {}, 2000), &records);
  appendRecord(datagram(WireKind::kWaited, {}, 3000), &records);
  appendRecord(datagram(WireKind::kReceived, {1}, 3500), &records);
  appendRecord(datagram(WireKind::kWaited, {}, 4000), &records);
  ASSERT_TRUE(file.write(records));
  ASSERT_TRUE(file.finish());
  const std::vector<Block> packets = packetsOf(path());
  ASSERT_EQ(packets.size(), 2U);
  EXPECT_EQ(packets[0].text(1), "n=0 w=3500 s=2500 t=2000,1000;3000,2000");
  EXPECT_EQ(packets[1].packet(), (Bytes{'w', 'a', 'i', 't', 'e', 'd', 0}));
  EXPECT_EQ(packets[1].text(1), "n=1 w=4000 s=3000 t=4000,3000");
}

TEST_F(WireLogTest, BeginsAPartWhenOneIsFullAndKeepsTheNewest) {
  options_.file_bytes = 2000;
  options_.parts = 2;
  {
    WireFile file(options_);
    Bytes records;
    appendRecord(opened(name_, 51000), &records);
    for (int i = 0; i < 20; ++i) appendRecord(datagram(WireKind::kReceived, Bytes(150, 1), i), &records);
    ASSERT_TRUE(file.write(records));
  }
  EXPECT_TRUE(contentOf(path()).empty());
  const std::vector<Block> blocks = blocksOf(path("_part3"));
  ASSERT_GT(blocks.size(), 3U);
  EXPECT_EQ(blocks[2].text(2), "rx_node/flight");  // as in the first part
  EXPECT_EQ(packetsOf(path("_part2")).back().text(1).substr(0, 2), "n=");
  EXPECT_FALSE(contentOf(path("_part2")).empty());
}

TEST_F(WireLogTest, TheNextRunHasANameOfItsOwnAlsoWhereTheFirstPartsAreGone) {
  options_.file_bytes = 2000;
  options_.parts = 2;
  Bytes records;
  appendRecord(opened(name_, 51000), &records);
  for (int i = 0; i < 20; ++i) appendRecord(datagram(WireKind::kReceived, Bytes(150, 1), i), &records);
  ASSERT_TRUE(WireFile(options_).write(records));
  ASSERT_TRUE(contentOf(path()).empty());
  const Bytes before = contentOf(path("_part3"));
  WireFile next(options_);
  EXPECT_EQ(next.path(), path("_run2"));
  EXPECT_TRUE(next.write(records)) << next.problem();
  EXPECT_EQ(contentOf(path("_part3")), before);
  EXPECT_EQ(WireFile(options_).path(), path("_run3"));
}

TEST_F(WireLogTest, OverwritesNothing) {
  { WireFile file(options_); }
  const Bytes before = contentOf(path());
  { WireFile file(options_); }
  EXPECT_EQ(contentOf(path()), before);
  EXPECT_FALSE(contentOf(path("_run2")).empty());
}

TEST_F(WireLogTest, SaysWhichFolderIsMissing) {
  options_.file = testing::TempDir() + "no/such/folder/wire";
  try {
    WireFile file(options_);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("no/such/folder/wire.rx_node.pcapng: No such file"), std::string::npos);
  }
}

/// A node that has an input and something due.
class Turn : public WireTurn {
 public:
  std::int64_t nextDue() override { return 0; }
  bool hasInput() override { return !inputs.empty(); }
  bool takeInput(Bytes* input) override {
    if (inputs.empty()) return false;
    *input = inputs.back();
    inputs.pop_back();
    return true;
  }
  void act(ByteView input) override { acted.emplace_back(input.begin(), input.end()); }
  void runDue() override { ++turns; }
  void woken() override {}
  void end() override {}

  std::vector<Bytes> inputs;
  std::vector<Bytes> acted;
  int turns = 0;
};

TEST_F(WireLogTest, TheHubLogsInTheOrderOfProcessingAndMovesTheClock) {
  auto wire = std::make_shared<ScriptedHub::Wire>();
  wire->now_ns = 1000;
  wire->arrivals.push_back({5000, "b", {'b'}, {kLoopbackAddress, 49000}, 4000});
  wire->arrivals.push_back({5000, "a", {'a'}, {kLoopbackAddress, 49000}, 3000});
  const WireClock clock(wire->clock());
  wire->now_ns = 5000;
  Turn turn;
  turn.inputs.push_back({'x', 0, 'y'});
  {
    WireLogHub hub(std::make_unique<ScriptedHub>(wire), open(), clock, wire->clock(), &turn);
    const auto a = hub.open("a", {});
    const auto b = hub.open("b", {});
    hub.wait(1);
    EXPECT_EQ(clock.steady(), 5000);
    EXPECT_EQ(turn.acted, (std::vector<Bytes>{{'x', 0, 'y'}}));
    EXPECT_EQ(turn.turns, 1);
    std::array<std::uint8_t, 16> buffer;
    Received received;
    wire->now_ns = 6000;
    ASSERT_EQ(a->receive(buffer, &received), ReceiveStatus::kReceived);
    EXPECT_EQ(clock.steady(), 6000);
    ASSERT_TRUE(a->sendTo(Bytes{'s'}, {kLoopbackAddress, 49000}));
    ASSERT_EQ(b->receive(buffer, &received), ReceiveStatus::kReceived);
  }
  std::string order;
  for (const Block& packet : packetsOf(path())) order += static_cast<char>(packet.packet().back());
  EXPECT_EQ(order, "yasb");
  EXPECT_NE(packetsOf(path())[0].text(1).find(" t="), std::string::npos);
}

TEST_F(WireLogTest, TheHubListensForOneSourceWhereTheNodeIsLoggedInNoOrder) {
  auto wire = std::make_shared<ScriptedHub::Wire>();
  const WireClock clock(wire->clock());
  WireLogHub hub(std::make_unique<ScriptedHub>(wire), open(), clock, wire->clock(), nullptr);
  const auto source = hub.open("a", {});
  EXPECT_EQ(hub.fdFor(source.get()), ScriptedHub::kFd);
  EXPECT_EQ(wire->listened_to, "a");
  EXPECT_EQ(hub.fdFor(nullptr), ScriptedHub::kFd);
  EXPECT_EQ(wire->listened_to, "any");
}

TEST_F(WireLogTest, TheHubHasNoDescriptorWhereTheNodesOwnInputsHaveTheirTurnInIt) {
  auto wire = std::make_shared<ScriptedHub::Wire>();
  Turn turn;
  WireLogHub hub(std::make_unique<ScriptedHub>(wire), open(), WireClock(wire->clock()), wire->clock(), &turn);
  EXPECT_EQ(hub.fdFor(nullptr), -1);
}

}  // namespace
}  // namespace xplane_bridge::core
