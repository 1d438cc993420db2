#include "xplane_bridge/core/wire/pcapng.hpp"

#include <algorithm>
#include <array>

namespace xplane_bridge::core::pcapng {
namespace {

constexpr std::uint32_t kSectionBlock = 0x0A0D0D0A;
constexpr std::uint32_t kInterfaceBlock = 1;
constexpr std::uint32_t kPacketBlock = 6;
constexpr std::uint32_t kByteOrderMagic = 0x1A2B3C4D;
constexpr std::uint16_t kComment = 1;
constexpr std::uint16_t kUserApplication = 4;
constexpr std::uint16_t kInterfaceName = 2;
constexpr std::uint16_t kInterfaceDescription = 3;
constexpr std::uint16_t kTimeResolution = 9;
constexpr std::uint16_t kPacketFlags = 2;
constexpr std::uint16_t kDropCount = 4;
constexpr std::uint8_t kNanoseconds = 9;  // powers of ten
constexpr std::uint32_t kInbound = 1;
constexpr std::uint32_t kOutbound = 2;
constexpr std::size_t kLongestOption = 0xFFFC;

/// Of UTF-8.
bool continuesCharacter(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U; }

/// One block, from its construction to its destruction.
class Block {
 public:
  Block(std::uint32_t type, std::vector<std::uint8_t>* out) : out_(out), start_(out->size()) {
    put(type);
    put(std::uint32_t{0});
  }
  ~Block() {
    const auto size = static_cast<std::uint32_t>(out_->size() - start_ + sizeof(std::uint32_t));
    put(size);
    storeLittleEndian(size, out_->data() + start_ + sizeof(std::uint32_t));
  }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  template <typename T>
  void put(T value) {
    std::array<std::uint8_t, sizeof(T)> bytes;
    storeLittleEndian(value, bytes.data());
    out_->insert(out_->end(), bytes.begin(), bytes.end());
  }
  void put(ByteView bytes) { out_->insert(out_->end(), bytes.begin(), bytes.end()); }
  void pad() {
    while ((out_->size() - start_) % sizeof(std::uint32_t) != 0) out_->push_back(0);
  }
  void option(std::uint16_t code, ByteView value) {
    const ByteView kept = value.first(kLongestOption);
    put(code);
    put(static_cast<std::uint16_t>(kept.size()));
    put(kept);
    pad();
  }
  void option(std::uint16_t code, const std::string& text) {
    if (!text.empty()) option(code, ByteView(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  /// A text of any length: as many comments as it needs, whole characters in each.
  void comments(const std::string& text) {
    for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end) {
      end = std::min(text.size(), begin + kLongestOption);
      while (end < text.size() && end > begin + 1 && continuesCharacter(text[end])) --end;
      option(kComment, text.substr(begin, end - begin));
    }
  }
  void endOptions() { put(std::uint32_t{0}); }

 private:
  std::vector<std::uint8_t>* out_;
  std::size_t start_;
};

template <typename T>
void storeBigEndian(T value, std::uint8_t* to) {
  for (std::size_t i = 0; i < sizeof(T); ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * (sizeof(T) - 1 - i)));
}

}  // namespace

void appendSection(const std::string& application, const std::string& comment, std::vector<std::uint8_t>* out) {
  Block block(kSectionBlock, out);
  block.put(kByteOrderMagic);
  block.put(std::uint16_t{1});  // version 1.0
  block.put(std::uint16_t{0});
  block.put(std::int64_t{-1});  // length: not said
  block.option(kUserApplication, application);
  block.comments(comment);
  block.endOptions();
}

void appendInterface(std::uint16_t link_type, const std::string& name, const std::string& description,
                     std::vector<std::uint8_t>* out) {
  Block block(kInterfaceBlock, out);
  block.put(link_type);
  block.put(std::uint16_t{0});
  block.put(std::uint32_t{0});  // packets are not cut
  block.option(kInterfaceName, name);
  block.option(kInterfaceDescription, description);
  block.option(kTimeResolution, ByteView(&kNanoseconds, 1));
  block.endOptions();
}

void appendPacket(const Packet& packet, std::vector<std::uint8_t>* out) {
  const auto stamp = static_cast<std::uint64_t>(packet.stamp_ns);
  const auto size = static_cast<std::uint32_t>(packet.head.size() + packet.payload.size());
  Block block(kPacketBlock, out);
  block.put(packet.interface);
  block.put(static_cast<std::uint32_t>(stamp >> 32U));
  block.put(static_cast<std::uint32_t>(stamp));
  block.put(size);
  block.put(size);
  block.put(packet.head);
  block.put(packet.payload);
  block.pad();
  std::array<std::uint8_t, sizeof(std::uint64_t)> number{};
  storeLittleEndian(packet.outbound ? kOutbound : kInbound, number.data());
  block.option(kPacketFlags, ByteView(number).first(sizeof(std::uint32_t)));
  if (packet.dropped > 0) {
    storeLittleEndian(packet.dropped, number.data());
    block.option(kDropCount, ByteView(number));
  }
  block.option(kComment, packet.comment);
  block.endOptions();
}

std::array<std::uint8_t, kUdpHeadersSize> udpHeaders(const Endpoint& from, const Endpoint& to, std::size_t size) {
  constexpr std::size_t kIpSize = 20;
  constexpr std::uint8_t kVersionAndLength = 0x45;
  constexpr std::uint8_t kTimeToLive = 64;
  constexpr std::uint8_t kUdp = 17;
  std::array<std::uint8_t, kUdpHeadersSize> out{};
  out[0] = kVersionAndLength;
  storeBigEndian(static_cast<std::uint16_t>(kUdpHeadersSize + size), &out[2]);
  out[8] = kTimeToLive;
  out[9] = kUdp;
  storeBigEndian(from.address, &out[12]);
  storeBigEndian(to.address, &out[16]);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < kIpSize; i += 2) sum += static_cast<std::uint32_t>(out[i] << 8U) + out[i + 1];
  while (sum > 0xFFFFU) sum = (sum & 0xFFFFU) + (sum >> 16U);
  storeBigEndian(static_cast<std::uint16_t>(~sum), &out[10]);
  storeBigEndian(from.port, &out[20]);
  storeBigEndian(to.port, &out[22]);
  storeBigEndian(static_cast<std::uint16_t>(kUdpHeadersSize - kIpSize + size), &out[24]);
  return out;
}

}  // namespace xplane_bridge::core::pcapng
