#include "xplane_bridge/vision/picture_stream.hpp"

#include <cmath>
#include <cstring>

namespace xplane_bridge::vision {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic{'X', 'E', 'Y', '1'};
constexpr std::array<std::uint8_t, 4> kReplyMagic{'X', 'E', 'Y', 'A'};
constexpr std::size_t kPrefix = 16;
constexpr std::size_t kLeastHeader = 2;   // kind and window
constexpr std::size_t kMostHeader = 512;  // later releases may append to it
constexpr std::size_t kMostText = 1024;   // body of all messages but pictures
constexpr std::size_t kHelloHeader = 6;
constexpr std::size_t kHelloHeaderWithAbilities = 8;
constexpr std::size_t kCalibrationHeader = 12;
constexpr std::size_t kPictureHeader = 64;
constexpr std::uint8_t kHello = 1;
constexpr std::uint8_t kPicture = 2;
constexpr std::uint8_t kStatus = 3;
constexpr std::uint8_t kCalibration = 4;
constexpr std::uint8_t kJpeg = 0;
constexpr std::uint32_t kBorderline = 1;
constexpr std::uint32_t kDelayAssumed = 2;
constexpr std::uint16_t kCalibrates = 1;  // of a hello's abilities
constexpr int kSmallestSide = 16;
constexpr int kLargestSide = 65500;                // of a JPEG, as libjpeg takes it
constexpr std::int64_t kMostPixels = 8192 * 8192;  // 200 MB when decoded
constexpr double kLongestDelay = 1.0;              // [s]

template <typename T>
T get(const std::uint8_t* bytes) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value |= static_cast<T>(static_cast<T>(bytes[i]) << (8 * i));
  return value;
}

std::int64_t getSigned(const std::uint8_t* bytes) { return static_cast<std::int64_t>(get<std::uint64_t>(bytes)); }

float getFloat(const std::uint8_t* bytes) {
  const auto bits = get<std::uint32_t>(bytes);
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

double getDouble(const std::uint8_t* bytes) {
  const auto bits = get<std::uint64_t>(bytes);
  double value = 0.0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// The CRC-32 of zlib.
std::uint32_t crc32(const std::uint8_t* bytes, std::size_t size) {
  constexpr std::uint32_t kPolynomial = 0xEDB88320U;
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0U ? kPolynomial : 0U);
  }
  return ~crc;
}

}  // namespace

void PictureStreamReader::refuse(StreamFault fault, std::string problem) {
  fault_ = fault;
  problem_ = std::move(problem);
  bytes_.clear();
  bytes_.shrink_to_fit();
  used_ = 0;
}

void PictureStreamReader::add(const std::uint8_t* bytes, std::size_t size) {
  if (fault_ != StreamFault::kNone) return;
  if (used_ > 0) {
    bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(used_));
    used_ = 0;
  }
  bytes_.insert(bytes_.end(), bytes, bytes + size);
}

std::optional<PictureStreamReader::Lengths> PictureStreamReader::readPrefix() {
  if (bytes_.size() - used_ < kPrefix) return std::nullopt;
  const std::uint8_t* prefix = bytes_.data() + used_;
  if (std::memcmp(prefix, kMagic.data(), kMagic.size()) != 0) {
    refuse(StreamFault::kMalformed, "what connected is no xplane_eye");
    return std::nullopt;
  }
  const auto version = get<std::uint16_t>(prefix + 4);
  if (version != kPictureStreamVersion) {
    refuse(StreamFault::kVersion, "the sender speaks version " + std::to_string(version) + ", expected " +
                                      std::to_string(kPictureStreamVersion) +
                                      ": install the same release on both computers");
    return std::nullopt;
  }
  const Lengths lengths{get<std::uint16_t>(prefix + 6), get<std::uint32_t>(prefix + 8)};
  if (lengths.header < kLeastHeader || lengths.header > kMostHeader || lengths.body > kMostPictureBytes) {
    refuse(StreamFault::kMalformed, "the sender announces a header of " + std::to_string(lengths.header) +
                                        " bytes and a body of " + std::to_string(lengths.body) +
                                        "; at most 512 and 16777216 are taken");
    return std::nullopt;
  }
  return lengths;
}

std::optional<SentMessage> PictureStreamReader::next() {
  while (fault_ == StreamFault::kNone) {
    const std::optional<Lengths> lengths = readPrefix();
    if (!lengths.has_value() || bytes_.size() - used_ < kPrefix + lengths->header) return std::nullopt;
    const std::uint8_t* header = bytes_.data() + used_ + kPrefix;
    if (crc32(header, lengths->header) != get<std::uint32_t>(bytes_.data() + used_ + 12)) {
      refuse(StreamFault::kMalformed, "the checksum of a header is wrong");
      return std::nullopt;
    }
    if (header[0] != kPicture && lengths->body > kMostText) {
      refuse(StreamFault::kMalformed, "a message of kind " + std::to_string(header[0]) + " announces a body of " +
                                          std::to_string(lengths->body) + " bytes; at most 1024 are taken");
      return std::nullopt;
    }
    if (bytes_.size() - used_ < kPrefix + lengths->header + lengths->body) return std::nullopt;
    std::optional<SentMessage> message = read(*lengths);
    used_ += kPrefix + lengths->header + lengths->body;
    if (fault_ != StreamFault::kNone) used_ = 0;
    if (message.has_value()) return message;  // else of a kind that a later release has: passed over
  }
  return std::nullopt;
}

std::optional<SentMessage> PictureStreamReader::read(const Lengths& lengths) {
  const std::uint8_t* header = bytes_.data() + used_ + kPrefix;
  const std::uint8_t* body = header + lengths.header;
  const auto text = [body](std::size_t from, std::size_t size) {
    return std::string(reinterpret_cast<const char*>(body) + from, size);
  };
  switch (header[0]) {
    case kHello: {
      const std::size_t token = lengths.header >= kHelloHeader ? get<std::uint16_t>(header + 2) : 0;
      const std::size_t name = lengths.header >= kHelloHeader ? get<std::uint16_t>(header + 4) : 0;
      if (lengths.header < kHelloHeader || token + name != lengths.body) {
        refuse(StreamFault::kMalformed, "the sender's first message is not as long as it says");
        return std::nullopt;
      }
      const bool able = lengths.header >= kHelloHeaderWithAbilities;
      const bool calibrates = able && (get<std::uint16_t>(header + 6) & kCalibrates) != 0;
      return SentHello{header[1], text(0, token), text(token, name), calibrates};
    }
    case kPicture:
      return readPicture(header, body, lengths);
    case kStatus:
      return SentStatus{header[1], text(0, lengths.body)};
    case kCalibration:
      if (lengths.header < kCalibrationHeader) {
        refuse(StreamFault::kMalformed, "the sender's answer has a header of " + std::to_string(lengths.header) +
                                            " bytes; expected at least 12");
        return std::nullopt;
      }
      return SentCalibration{header[1], get<std::uint16_t>(header + 2) != 0, get<std::uint64_t>(header + 4),
                             text(0, lengths.body)};
    default:
      return std::nullopt;
  }
}

std::optional<SentMessage> PictureStreamReader::readPicture(const std::uint8_t* header, const std::uint8_t* body,
                                                            const Lengths& lengths) {
  if (lengths.header < kPictureHeader || header[2] != kJpeg) {
    refuse(StreamFault::kMalformed, "a picture has a header of " + std::to_string(lengths.header) +
                                        " bytes or is no JPEG; expected at least 64 bytes and JPEG");
    return std::nullopt;
  }
  SentPicture picture;
  picture.window = header[1];
  picture.width = get<std::uint16_t>(header + 4);
  picture.height = get<std::uint16_t>(header + 6);
  picture.key = getFloat(header + 8);
  const auto flags = get<std::uint32_t>(header + 12);
  picture.borderline = (flags & kBorderline) != 0;
  picture.delay_assumed = (flags & kDelayAssumed) != 0;
  picture.index = get<std::uint64_t>(header + 16);
  picture.change_ns = getSigned(header + 24);
  picture.sent_ns = getSigned(header + 40);
  picture.delay = getDouble(header + 48);
  const std::string size = std::to_string(picture.width) + "x" + std::to_string(picture.height);
  const auto sideFits = [](int side) { return side >= kSmallestSide && side <= kLargestSide; };
  if (!sideFits(picture.width) || !sideFits(picture.height) ||
      std::int64_t{picture.width} * picture.height > kMostPixels) {
    refuse(StreamFault::kMalformed, "a picture of " + size + "; expected sides of 16 to 65500 px and at most " +
                                        std::to_string(kMostPixels) + " pixels");
    return std::nullopt;
  }
  if (!std::isfinite(picture.key) || !(std::abs(picture.delay) <= kLongestDelay) ||
      jpegSize(body, lengths.body) != std::make_pair(picture.width, picture.height)) {
    refuse(StreamFault::kMalformed,
           "a picture said to be " + size + " is another JPEG or none, or its numbers make no sense");
    return std::nullopt;
  }
  picture.jpeg.assign(body, body + lengths.body);
  return picture;
}

std::array<std::uint8_t, 16> encodeReply(ReplyCode code, std::uint64_t number) {
  std::array<std::uint8_t, 16> reply{};
  std::copy(kReplyMagic.begin(), kReplyMagic.end(), reply.begin());
  const auto put = [&reply](std::size_t at, std::uint64_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) reply.at(at + i) = static_cast<std::uint8_t>(value >> (8 * i));
  };
  put(4, kPictureStreamVersion, 2);
  put(6, static_cast<std::uint64_t>(code), 2);
  put(8, number, 8);
  return reply;
}

std::optional<std::pair<int, int>> jpegSize(const std::uint8_t* bytes, std::size_t size) {
  constexpr std::uint8_t kMarker = 0xFF;
  if (size < 4 || bytes[0] != kMarker || bytes[1] != 0xD8) return std::nullopt;
  std::size_t at = 2;
  while (at + 4 <= size && bytes[at] == kMarker) {
    const std::uint8_t kind = bytes[at + 1];
    if (kind == kMarker) {  // filling
      ++at;
      continue;
    }
    const std::size_t length = (static_cast<std::size_t>(bytes[at + 2]) << 8U) | bytes[at + 3];
    // Start of frame, but for the tables between them (DHT, JPG, DAC).
    const bool frame = kind >= 0xC0 && kind <= 0xCF && kind != 0xC4 && kind != 0xC8 && kind != 0xCC;
    if (frame) {
      if (length < 7 || at + 9 > size) return std::nullopt;
      const int height = (bytes[at + 5] << 8) | bytes[at + 6];
      const int width = (bytes[at + 7] << 8) | bytes[at + 8];
      return std::make_pair(width, height);
    }
    if (kind == 0xDA || kind == 0xD9 || length < 2) return std::nullopt;
    at += 2 + length;
  }
  return std::nullopt;
}

bool sameSecret(const std::string& given, const std::string& expected) {
  unsigned difference = given.size() == expected.size() ? 0U : 1U;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const char other = given.empty() ? '\0' : given[i % given.size()];
    difference |= static_cast<unsigned>(static_cast<unsigned char>(expected[i]) ^ static_cast<unsigned char>(other));
  }
  return difference == 0U;
}

}  // namespace xplane_bridge::vision
