#include "xplane_bridge/vision/picture_stream.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <string>
#include <vector>

namespace vision = xplane_bridge::vision;
using vision::PictureStreamReader;
using vision::StreamFault;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A message of tests/data/eye, made by neither end.
Bytes golden(const std::string& name) {
  std::ifstream file(std::string(XPLANE_BRIDGE_TEST_DATA) + "/eye/" + name + ".hex");
  Bytes bytes;
  char high = 0, low = 0;
  while (file >> high >> low)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(std::string{high, low}, nullptr, 16)));
  EXPECT_FALSE(bytes.empty()) << name;
  return bytes;
}

/// The start of a JPEG as encoders write it: SOI, APP0 of 16 bytes, SOF0.
Bytes jpegOf(int width, int height) {
  Bytes bytes{0xFF, 0xD8, 0xFF, 0xE0, 0x00, 0x10};
  bytes.resize(bytes.size() + 14, 0x00);
  bytes.insert(bytes.end(), {0xFF, 0xC0, 0x00, 0x11, 0x08});
  for (const int side : {height, width}) {
    bytes.push_back(static_cast<std::uint8_t>(side >> 8));
    bytes.push_back(static_cast<std::uint8_t>(side));
  }
  bytes.push_back(0x03);
  return bytes;
}

Bytes jpegOf640x480() { return jpegOf(640, 480); }

/// The golden picture with another body: only the prefix says how long that is.
Bytes pictureWith(const Bytes& body) {
  Bytes bytes = golden("picture");
  bytes.resize(16 + 64);
  for (std::size_t i = 0; i < 4; ++i) bytes[8 + i] = static_cast<std::uint8_t>(body.size() >> (8 * i));
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

/// The golden picture with another size, in its header and in its JPEG.
Bytes pictureOf(int width, int height) {
  Bytes bytes = pictureWith(jpegOf(width, height));
  const auto put = [&bytes](std::size_t at, std::uint32_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  };
  put(16 + 4, static_cast<std::uint32_t>(width), 2);
  put(16 + 6, static_cast<std::uint32_t>(height), 2);
  std::uint32_t crc = 0xFFFFFFFFU;  // CRC-32 of the header, bit by bit
  for (std::size_t i = 16; i < 16 + 64; ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc >> 1U) ^ (((crc ^ (std::uint32_t{bytes[i]} >> bit)) & 1U) != 0U ? 0xEDB88320U : 0U);
    }
  }
  put(12, ~crc, 4);
  return bytes;
}

PictureStreamReader fed(const Bytes& bytes) {
  PictureStreamReader reader;
  reader.add(bytes.data(), bytes.size());
  return reader;
}

}  // namespace

TEST(PictureStream, ReadsTheGoldenMessages) {
  auto reader = fed(golden("hello"));
  const auto hello = reader.next();
  ASSERT_TRUE(hello.has_value());
  EXPECT_EQ(std::get<vision::SentHello>(*hello).window, 2);
  EXPECT_EQ(std::get<vision::SentHello>(*hello).token, "secret");
  EXPECT_EQ(std::get<vision::SentHello>(*hello).xplane, "127.0.0.1:49000");
  EXPECT_FALSE(std::get<vision::SentHello>(*hello).calibrates) << "an earlier release, which does not say";
  reader = fed(golden("hello_that_calibrates"));
  const auto able = reader.next();
  ASSERT_TRUE(able.has_value()) << reader.problem();
  EXPECT_EQ(std::get<vision::SentHello>(*able).xplane, "127.0.0.1:49000");
  EXPECT_TRUE(std::get<vision::SentHello>(*able).calibrates);
  reader = fed(golden("calibration"));
  const auto answer = reader.next();
  ASSERT_TRUE(answer.has_value()) << reader.problem();
  EXPECT_TRUE(std::get<vision::SentCalibration>(*answer).measured);
  EXPECT_EQ(std::get<vision::SentCalibration>(*answer).number, 7U);
  EXPECT_EQ(std::get<vision::SentCalibration>(*answer).text, "42.5 ms, from 10 steps");
  reader = fed(golden("status"));
  EXPECT_EQ(std::get<vision::SentStatus>(*reader.next()).problem, "no window");
  reader = fed(pictureWith(jpegOf640x480()));
  const auto message = reader.next();
  ASSERT_TRUE(message.has_value()) << reader.problem();
  const auto& picture = std::get<vision::SentPicture>(*message);
  EXPECT_EQ(picture.window, 2);
  EXPECT_EQ(picture.width, 640);
  EXPECT_EQ(picture.height, 480);
  EXPECT_EQ(picture.key, 123.5F);
  EXPECT_TRUE(picture.borderline);
  EXPECT_FALSE(picture.delay_assumed);
  EXPECT_EQ(picture.index, 7U);
  EXPECT_EQ(picture.change_ns, 2'000'000'000);
  EXPECT_EQ(picture.sent_ns, 2'010'000'000);
  EXPECT_EQ(picture.delay, 0.05);
  EXPECT_EQ(picture.jpeg, jpegOf640x480());
}

TEST(PictureStream, MessagesMayComeInPiecesOfAnySizeAndSeveralAtOnce) {
  Bytes stream;
  for (const Bytes& part : {golden("hello"), golden("status"), pictureWith(jpegOf640x480()), golden("status")}) {
    stream.insert(stream.end(), part.begin(), part.end());
  }
  for (std::size_t step : {std::size_t{1}, std::size_t{7}, std::size_t{100}, stream.size()}) {
    PictureStreamReader reader;
    std::vector<std::size_t> kinds;
    for (std::size_t at = 0; at < stream.size(); at += step) {
      reader.add(stream.data() + at, std::min(step, stream.size() - at));
      while (const auto message = reader.next()) kinds.push_back(message->index());
    }
    EXPECT_EQ(kinds, (std::vector<std::size_t>{0, 2, 1, 2})) << "pieces of " << step;
  }
}

TEST(PictureStream, AHeaderOfFourGibibytesIsRefusedAtOnce) {
  Bytes bytes = golden("picture");
  for (std::size_t i = 0; i < 4; ++i) bytes[8 + i] = 0xFF;
  bytes.resize(16);  // nothing more is needed to know
  auto reader = fed(bytes);
  EXPECT_FALSE(reader.next().has_value());
  EXPECT_EQ(reader.fault(), StreamFault::kMalformed);
  EXPECT_NE(reader.problem().find("4294967295"), std::string::npos);
}

TEST(PictureStream, OnlyPicturesMayBeLarge) {
  Bytes bytes = golden("status");
  bytes[9] = 0x10;  // 4105 bytes
  auto reader = fed(bytes);
  EXPECT_FALSE(reader.next().has_value());
  EXPECT_EQ(reader.fault(), StreamFault::kMalformed);
}

TEST(PictureStream, EveryWrongByteOfAHeaderIsFound) {
  const Bytes right = pictureWith(jpegOf640x480());
  for (std::size_t at = 16; at < 16 + 64; ++at) {
    Bytes wrong = right;
    wrong[at] ^= 0x40U;
    auto reader = fed(wrong);
    EXPECT_FALSE(reader.next().has_value()) << "byte " << at;
    EXPECT_EQ(reader.fault(), StreamFault::kMalformed) << "byte " << at;
  }
}

TEST(PictureStream, AnotherVersionIsSaidAsSuch) {
  Bytes bytes = golden("hello");
  bytes[4] = 2;
  auto reader = fed(bytes);
  EXPECT_FALSE(reader.next().has_value());
  EXPECT_EQ(reader.fault(), StreamFault::kVersion);
  EXPECT_NE(reader.problem().find("version 2, expected 1"), std::string::npos);
}

TEST(PictureStream, AJpegOfAnotherSizeIsRefused) {
  Bytes larger = jpegOf640x480();
  larger[larger.size() - 3] = 0xFF;  // 65408 wide
  for (const Bytes& body : {larger, Bytes{'J', 'P', 'E', 'G'}, Bytes{}}) {
    auto reader = fed(pictureWith(body));
    EXPECT_FALSE(reader.next().has_value());
    EXPECT_EQ(reader.fault(), StreamFault::kMalformed);
  }
}

TEST(PictureStream, SizesAreTakenUpToWhatCanBeDecoded) {
  // Three 4K monitors side by side are 11520x2160.
  for (const auto& [width, height] :
       {std::make_pair(16, 16), std::make_pair(11520, 2160), std::make_pair(8192, 8192), std::make_pair(65500, 1024)}) {
    auto reader = fed(pictureOf(width, height));
    const auto message = reader.next();
    ASSERT_TRUE(message.has_value()) << reader.problem();
    EXPECT_EQ(std::get<vision::SentPicture>(*message).width, width);
    EXPECT_EQ(std::get<vision::SentPicture>(*message).height, height);
  }
  for (const auto& [width, height] :
       {std::make_pair(15, 480), std::make_pair(8193, 8192), std::make_pair(65501, 480)}) {
    auto reader = fed(pictureOf(width, height));
    EXPECT_FALSE(reader.next().has_value());
    EXPECT_EQ(reader.problem(), "a picture of " + std::to_string(width) + "x" + std::to_string(height) +
                                    "; expected sides of 16 to 65500 px and at most 67108864 pixels");
  }
}

TEST(PictureStream, NothingIsReadAfterAFault) {
  auto reader = fed({'H', 'T', 'T', 'P', '/', '1', '.', '1', ' ', '4', '0', '0', ' ', 'B', 'a', 'd'});
  EXPECT_FALSE(reader.next().has_value());
  const Bytes hello = golden("hello");
  reader.add(hello.data(), hello.size());
  EXPECT_FALSE(reader.next().has_value());
  EXPECT_EQ(reader.fault(), StreamFault::kMalformed);
}

TEST(PictureStream, AnyBytesDoNoHarm) {
  std::mt19937 random(3);
  const Bytes right = pictureWith(jpegOf640x480());
  for (int run = 0; run < 20000; ++run) {
    Bytes bytes = right;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < changes; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    bytes.resize(random() % (bytes.size() + 1));
    auto reader = fed(bytes);
    while (reader.next().has_value()) {
    }
    EXPECT_LE(vision::jpegSize(bytes.data(), bytes.size()).value_or(std::make_pair(0, 0)).first, 65535);
  }
}

TEST(PictureStream, RepliesHaveTheBytesThatTheSenderReads) {
  const std::array<std::uint8_t, 16> taken{'X', 'E', 'Y', 'A', 1, 0, 1, 0, 42, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_EQ(vision::encodeReply(vision::ReplyCode::kTaken, 42), taken);
}

TEST(PictureStream, OnlyTheSameSecretIsTheSame) {
  EXPECT_TRUE(vision::sameSecret("", ""));
  EXPECT_TRUE(vision::sameSecret("secret", "secret"));
  EXPECT_FALSE(vision::sameSecret("", "secret"));
  EXPECT_FALSE(vision::sameSecret("secre", "secret"));
  EXPECT_FALSE(vision::sameSecret("secrets", "secret"));
  EXPECT_FALSE(vision::sameSecret("secret", ""));
  EXPECT_FALSE(vision::sameSecret("ss", "s"));
}
