#include "xplane_bridge/core/wire/packets.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "golden_packets.hpp"
#include "packet_bytes.hpp"

namespace xplane_bridge::core {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr double kNanDouble = std::numeric_limits<double>::quiet_NaN();

// ------------------------------------------------------------------------------------------------ hand-worked bytes

TEST(Decode, DataRowByHand) {
  // Row 17 = 0x11: pitch 2.5 = 0x40200000, roll -14.75 = 0xC16C0000, heading 271 = 0x43878000, the rest -999.
  const Bytes packet = {'D',  'A',  'T',  'A',  '*',  0x11, 0x00, 0x00, 0x00, 0x00, 0x00, 0x20, 0x40, 0x00,
                        0x00, 0x6C, 0xC1, 0x00, 0x80, 0x87, 0x43, 0x00, 0xC0, 0x79, 0xC4, 0x00, 0xC0, 0x79,
                        0xC4, 0x00, 0xC0, 0x79, 0xC4, 0x00, 0xC0, 0x79, 0xC4, 0x00, 0xC0, 0x79, 0xC4};
  const DecodeResult<DataView> data = decodeData(packet);
  ASSERT_TRUE(data.ok());
  ASSERT_EQ(data->size(), 1U);
  const DataRowView row = (*data)[0];
  EXPECT_EQ(row.index(), 17);
  EXPECT_EQ(row.value(0), 2.5F);
  EXPECT_EQ(row.value(1), -14.75F);
  EXPECT_EQ(row.value(2), 271.0F);
  EXPECT_FALSE(row.isMarkedUnused(2));
  for (std::size_t slot = 3; slot < kDataSlots; ++slot) {
    EXPECT_TRUE(row.isMarkedUnused(slot)) << slot;
    EXPECT_EQ(row.value(slot), -999.0F) << slot;
  }
}

TEST(Decode, RrefPairByHand) {
  // index 7, value 110.5 = 0x42DD0000
  const Bytes packet = {'R', 'R', 'E', 'F', ',', 0x07, 0x00, 0x00, 0x00, 0x00, 0x00, 0xDD, 0x42};
  const DecodeResult<RrefView> rref = decodeRref(packet);
  ASSERT_TRUE(rref.ok());
  ASSERT_EQ(rref->size(), 1U);
  EXPECT_EQ((*rref)[0].index, 7);
  EXPECT_EQ((*rref)[0].value, 110.5F);
}

TEST(Encode, DrefByHand) {
  // -0.75 = 0xBF400000
  std::array<std::uint8_t, kDrefSize> buffer;
  buffer.fill(0xEE);
  const EncodeResult size = encodeDref(buffer, "a/b", -0.75F);
  ASSERT_TRUE(size.ok());
  ASSERT_EQ(*size, 509U);
  const std::array<std::uint8_t, 13> front = {'D', 'R', 'E', 'F', 0, 0x00, 0x00, 0x40, 0xBF, 'a', '/', 'b', 0};
  EXPECT_EQ(std::memcmp(buffer.data(), front.data(), front.size()), 0);
  for (std::size_t i = front.size(); i < buffer.size(); ++i) {
    ASSERT_EQ(buffer[i], 0) << i;
  }
}

TEST(Encode, ReseIsTheBareHeader) {
  std::array<std::uint8_t, 8> buffer;
  buffer.fill(0xEE);
  const EncodeResult size = encodeRese(buffer);
  ASSERT_TRUE(size.ok());
  EXPECT_EQ(*size, 5U);
  const std::array<std::uint8_t, 8> expected = {'R', 'E', 'S', 'E', 0, 0xEE, 0xEE, 0xEE};
  EXPECT_EQ(buffer, expected);
}

TEST(Encode, RposAsksWithDigits) {
  std::array<std::uint8_t, 16> buffer{};
  ASSERT_TRUE(encodeRpos(buffer, 99999).ok());
  EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 15), text("RPOS", 5) + text("99999", 10));
  ASSERT_TRUE(encodeRpos(buffer, 0).ok());
  EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 15), text("RPOS", 5) + text("0", 10));
}

TEST(Encode, CommandEndsWithNul) {
  std::array<std::uint8_t, 16> buffer;
  buffer.fill(0xEE);
  const EncodeResult size = encodeCmnd(buffer, "x/y");
  ASSERT_TRUE(size.ok());
  EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 9), (Bytes{'C', 'M', 'N', 'D', 0, 'x', '/', 'y', 0}));
  EXPECT_EQ(*size, 9U);
}

// ------------------------------------------------------------------------------------------------ golden packets

class Golden : public testing::TestWithParam<GoldenPacket> {};

TEST_P(Golden, DecodesOrEncodesAsWritten) {
  const GoldenPacket& packet = GetParam();
  ASSERT_EQ(packet.bytes.size(), packet.document.at("bytes").get<std::size_t>());
  if (packet.document.at("direction") == "from_xplane") {
    checkDecoding(packet);
  } else {
    checkEncoding(packet);
  }
}

INSTANTIATE_TEST_SUITE_P(Packets, Golden, testing::ValuesIn(loadGoldenPackets()),
                         [](const testing::TestParamInfo<GoldenPacket>& golden) { return golden.param.testName(); });

TEST(GoldenFiles, AreAllThere) { EXPECT_EQ(loadGoldenPackets().size(), 31U); }

TEST(Decode, FifthByteDoesNotMatter) {
  for (int fifth = 0; fifth < 256; ++fifth) {
    Bytes packet = text("RREF", 4) + Bytes{static_cast<std::uint8_t>(fifth)} + word(1) + number(2.0F);
    EXPECT_TRUE(decodeRref(packet).ok()) << fifth;
    EXPECT_EQ(classify(packet), MessageKind::kRref) << fifth;
  }
}

// ------------------------------------------------------------------------------------------------ malformed: lengths

TEST(Classify, ShortAndUnknown) {
  EXPECT_EQ(classify(ByteView()), MessageKind::kUnknown);
  EXPECT_EQ(classify(tight(text("DATA", 4))), MessageKind::kUnknown);
  EXPECT_EQ(classify(text("DATA*", 5)), MessageKind::kData);
  EXPECT_EQ(classify(text("RADR5", 5)), MessageKind::kUnknown);
  EXPECT_EQ(classify(text("data*", 5)), MessageKind::kUnknown);
}

TEST(Decode, RefusesEveryWrongLengthOfData) {
  const Bytes full = text("DATA*", 5) + dataRow(3, {}) + dataRow(4, {});
  for (std::size_t size = 0; size < full.size(); ++size) {
    const Bytes packet = tight(Bytes(full.begin(), full.begin() + static_cast<std::ptrdiff_t>(size)));
    const DecodeError expected = size < 5         ? DecodeError::kTooShort
                                 : size == 5      ? DecodeError::kEmpty
                                 : size < 41      ? DecodeError::kTooShort
                                 : size == 5 + 36 ? DecodeError::kNone
                                                  : DecodeError::kBadLength;
    EXPECT_EQ(decodeData(packet).error(), expected) << size;
  }
  EXPECT_EQ(decodeData(full + Bytes{0}).error(), DecodeError::kBadLength);
}

TEST(Decode, RefusesEveryWrongLengthOfRref) {
  const Bytes full = text("RREF,", 5) + word(0) + number(1.0F) + word(1) + number(1.0F);
  for (std::size_t size = 0; size < full.size(); ++size) {
    const Bytes packet = tight(Bytes(full.begin(), full.begin() + static_cast<std::ptrdiff_t>(size)));
    const DecodeError expected = size < 5        ? DecodeError::kTooShort
                                 : size == 5     ? DecodeError::kEmpty
                                 : size < 13     ? DecodeError::kTooShort
                                 : size == 5 + 8 ? DecodeError::kNone
                                                 : DecodeError::kBadLength;
    EXPECT_EQ(decodeRref(packet).error(), expected) << size;
  }
}

/// The error of decoding with the one decoder that fits the message.
DecodeError decodeErrorOf(const std::string& message, const Bytes& packet) {
  if (message == "RPOS") {
    return decodeRpos(packet).error();
  }
  if (message == "DREF") {
    return decodeDref(packet).error();
  }
  if (message == "TERR") {
    return decodeTerr(packet).error();
  }
  return decodePosi(packet).error();
}

TEST(Decode, RefusesEveryWrongLengthOfFixedMessages) {
  int seen = 0;
  for (const GoldenPacket& golden : loadGoldenPackets()) {
    const std::string message = golden.document.at("message");
    const bool fixed = message == "RPOS" || message == "DREF" || message == "TERR" || message == "POSI";
    if (!fixed || golden.document.at("direction") != "from_xplane") {
      continue;
    }
    ++seen;
    EXPECT_EQ(decodeErrorOf(message, golden.bytes), DecodeError::kNone) << message;
    for (std::size_t size = 0; size < golden.bytes.size(); ++size) {
      const Bytes packet = tight(Bytes(golden.bytes.begin(), golden.bytes.begin() + static_cast<std::ptrdiff_t>(size)));
      EXPECT_EQ(decodeErrorOf(message, packet), DecodeError::kTooShort) << message << size;
    }
    EXPECT_EQ(decodeErrorOf(message, golden.bytes + Bytes{0}), DecodeError::kTooLong) << message;
    Bytes other = golden.bytes;
    other[0] = 'x';
    EXPECT_EQ(decodeErrorOf(message, other), DecodeError::kWrongLabel) << message;
  }
  EXPECT_EQ(seen, 4);
}

TEST(Decode, RefusesOtherLabels) {
  const Bytes data = text("DATA*", 5) + dataRow(3, {});
  const Bytes rref = text("RREF,", 5) + word(0) + number(1.0F);
  EXPECT_EQ(decodeData(rref).error(), DecodeError::kWrongLabel);
  EXPECT_EQ(decodeRref(data).error(), DecodeError::kWrongLabel);
  EXPECT_EQ(decodeBeacon(data).error(), DecodeError::kWrongLabel);
}

// ------------------------------------------------------------------------------------------------ malformed: contents

TEST(Decode, DataKeepsOddRowsAndNumbersThem) {
  const float denormal = std::numeric_limits<float>::denorm_min();
  const Bytes packet = text("DATA*", 5) + dataRow(-1, {}) + dataRow(3, {kNan, kInf, -kInf, denormal, -0.0F}) +
                       dataRow(200, {}) + dataRow(199, {1.0F}) + dataRow(std::numeric_limits<std::int32_t>::min(), {});
  const DecodeResult<DataView> data = decodeData(packet);
  ASSERT_TRUE(data.ok());
  ASSERT_EQ(data->size(), 5U);
  EXPECT_FALSE((*data)[0].hasKnownIndex());
  EXPECT_TRUE((*data)[1].hasKnownIndex());
  EXPECT_FALSE((*data)[2].hasKnownIndex());
  EXPECT_TRUE((*data)[3].hasKnownIndex());
  EXPECT_TRUE(std::isnan((*data)[1].value(0)));
  EXPECT_EQ((*data)[1].value(3), denormal);
  EXPECT_TRUE(std::signbit((*data)[1].value(4)));
  const DataAnomalies anomalies = inspect(*data);
  EXPECT_EQ(anomalies.unknown_rows, 3U);
  EXPECT_EQ(anomalies.non_finite_values, 3U);
}

TEST(Decode, Minus999IsAValueLikeAnyOther) {
  // A climb rate of -999 ft/min in row 4 slot 2: the view gives the value; only who knows the row may ask for the mark.
  const Bytes packet = text("DATA*", 5) + dataRow(4, {0.2F, -999.0F, -999.0F, 998.99994F, -998.99994F});
  const DecodeResult<DataView> data = decodeData(packet);
  ASSERT_TRUE(data.ok());
  EXPECT_EQ((*data)[0].value(2), -999.0F);
  EXPECT_TRUE((*data)[0].isMarkedUnused(1));
  EXPECT_FALSE((*data)[0].isMarkedUnused(4));
  EXPECT_EQ(inspect(*data).non_finite_values, 0U);
}

TEST(Decode, DataRowsAreFoundByIndexInAnyOrder) {
  const Bytes packet = text("DATA*", 5) + dataRow(20, {1.0F}) + dataRow(3, {2.0F}) + dataRow(20, {3.0F});
  const DecodeResult<DataView> data = decodeData(packet);
  ASSERT_TRUE(data->find(3).has_value());
  EXPECT_EQ(data->find(3)->value(0), 2.0F);
  EXPECT_EQ(data->find(20)->value(0), 1.0F);
  EXPECT_FALSE(data->find(4).has_value());
}

TEST(Decode, RrefKeepsNan) {
  const Bytes packet = text("RREF,", 5) + word(0xFFFFFFFFU) + number(kNan);
  const DecodeResult<RrefView> rref = decodeRref(packet);
  ASSERT_TRUE(rref.ok());
  EXPECT_EQ((*rref)[0].index, -1);
  EXPECT_TRUE(std::isnan((*rref)[0].value));
}

TEST(Decode, RposRefusesImpossibleNumbers) {
  EXPECT_TRUE(decodeRpos(rpos(180.0, -90.0, 0.0F)).ok());
  EXPECT_EQ(decodeRpos(rpos(127.0, 90.001, 0.0F)).error(), DecodeError::kOutOfRange);
  EXPECT_EQ(decodeRpos(rpos(-361.0, 37.0, 0.0F)).error(), DecodeError::kOutOfRange);
  EXPECT_EQ(decodeRpos(rpos(kNanDouble, 37.0, 0.0F)).error(), DecodeError::kNonFinite);
  EXPECT_EQ(decodeRpos(rpos(127.0, 37.0, kInf)).error(), DecodeError::kNonFinite);
}

TEST(Decode, FailedTerrainProbeIsSaid) {
  Bytes packet = text("TERR", 5) + Bytes{0} + number(-998.0) + number(-998.0) + number(-998.0) + Bytes(32, 0);
  ASSERT_EQ(packet.size(), 62U);
  EXPECT_EQ(decodeTerr(packet).error(), DecodeError::kOutOfRange);
}

Bytes beacon(std::uint8_t major, std::uint8_t minor, std::uint16_t port, const Bytes& name) {
  return text("BECN", 5) + Bytes{major, minor} + word(1) + word(115501) + word(1) +
         Bytes{static_cast<std::uint8_t>(port & 0xFFU), static_cast<std::uint8_t>(port >> 8)} + name;
}

TEST(Decode, BeaconForms) {
  const Bytes shortest = beacon(1, 1, 49000, {0});
  ASSERT_EQ(shortest.size(), 22U);
  ASSERT_TRUE(decodeBeacon(shortest).ok());
  EXPECT_EQ(decodeBeacon(shortest)->computer_name, "");
  EXPECT_FALSE(decodeBeacon(shortest)->raknet_port.has_value());
  for (std::size_t size = 0; size < shortest.size(); ++size) {
    EXPECT_EQ(
        decodeBeacon(tight(Bytes(shortest.begin(), shortest.begin() + static_cast<std::ptrdiff_t>(size)))).error(),
        DecodeError::kTooShort);
  }
  EXPECT_EQ(decodeBeacon(beacon(2, 1, 49000, {0})).error(), DecodeError::kBadVersion);
  EXPECT_EQ(decodeBeacon(beacon(1, 1, 0, {0})).error(), DecodeError::kOutOfRange);
  EXPECT_EQ(decodeBeacon(tight(beacon(1, 2, 49000, {'a', 'b'}))).error(), DecodeError::kUnterminatedText);
  EXPECT_TRUE(decodeBeacon(beacon(1, 2, 49000, Bytes(500, 'a') + Bytes{0})).ok());
  EXPECT_EQ(decodeBeacon(beacon(1, 2, 49000, Bytes(501, 'a') + Bytes{0})).error(), DecodeError::kUnterminatedText);
  // One byte behind the NUL is no port.
  EXPECT_FALSE(decodeBeacon(tight(beacon(1, 2, 49000, {'a', 0, 0x72})))->raknet_port.has_value());
  EXPECT_EQ(decodeBeacon(beacon(1, 3, 49000, {'a', 0, 0x72, 0xBF, 0x01}))->raknet_port, 49010);
  // Plane Maker, and numbers no enumerator has, are passed on.
  Bytes plane_maker = shortest;
  plane_maker[7] = 2;
  plane_maker[15] = 77;
  EXPECT_EQ(decodeBeacon(plane_maker)->host, Beacon::Host::kPlaneMaker);
  EXPECT_EQ(static_cast<std::uint32_t>(decodeBeacon(plane_maker)->role), 77U);
}

TEST(Decode, DrefNeedsATerminatedPath) {
  EXPECT_EQ(decodeDref(text("DREF+", 5) + number(1.0F) + Bytes(500, 'a')).error(), DecodeError::kUnterminatedText);
  EXPECT_EQ(decodeDref(text("DREF+", 5) + number(1.0F) + Bytes(500, 0)).error(), DecodeError::kEmpty);
  EXPECT_TRUE(decodeDref(text("DREF+", 5) + number(kNan) + Bytes(499, 'a') + Bytes{0}).ok());
}

// ------------------------------------------------------------------------------------------------ refused to encode

template <typename Encode>
void expectRefused(EncodeError error, const Encode& encode) {
  std::array<std::uint8_t, 8192> buffer;
  buffer.fill(0xEE);
  const EncodeResult result = encode(ByteSpan(buffer));
  EXPECT_EQ(result.error(), error);
  for (const std::uint8_t byte : buffer) {
    ASSERT_EQ(byte, 0xEE) << "a refused message must leave the buffer alone";
  }
}

TEST(Encode, RefusesBadText) {
  const std::string path_399(399, 'p');
  const std::string path_400(400, 'p');
  const std::string path_500(500, 'p');
  const std::string path_501(501, 'p');
  const std::string path_150(150, 'p');
  const std::string with_nul("a\0b", 3);
  std::array<std::uint8_t, 1024> buffer{};
  EXPECT_TRUE(encodeRref(buffer, path_399, 1, 0).ok());
  EXPECT_TRUE(encodeCmnd(buffer, path_500).ok());
  expectRefused(EncodeError::kTextTooLong, [&](ByteSpan out) { return encodeRref(out, path_400, 1, 0); });
  expectRefused(EncodeError::kTextTooLong, [&](ByteSpan out) { return encodeDref(out, path_500, 0.0F); });
  expectRefused(EncodeError::kTextTooLong, [&](ByteSpan out) { return encodeCmnd(out, path_501); });
  expectRefused(EncodeError::kTextTooLong, [&](ByteSpan out) { return encodeAcfn(out, 0, path_150, 0); });
  expectRefused(EncodeError::kTextTooLong,
                [&](ByteSpan out) { return encodeSimo(out, SituationAction::kLoadSituation, path_150); });
  expectRefused(EncodeError::kTextTooLong, [](ByteSpan out) {
    Placement placement;
    placement.airport = "NINECHARS";
    return encodePrel(out, placement);
  });
  expectRefused(EncodeError::kTextHasNul, [&](ByteSpan out) { return encodeRref(out, with_nul, 1, 0); });
  expectRefused(EncodeError::kTextHasNul, [&](ByteSpan out) { return encodeDref(out, with_nul, 1.0F); });
  expectRefused(EncodeError::kEmpty, [](ByteSpan out) { return encodeRref(out, "", 1, 0); });
  expectRefused(EncodeError::kEmpty, [](ByteSpan out) { return encodeCmnd(out, ""); });
}

TEST(Encode, RefusesBadNumbers) {
  expectRefused(EncodeError::kNonFinite, [](ByteSpan out) { return encodeDref(out, "a/b", kNan); });
  expectRefused(EncodeError::kNonFinite, [](ByteSpan out) { return encodeDref(out, "a/b", -kInf); });
  expectRefused(EncodeError::kOutOfRange, [](ByteSpan out) { return encodeRref(out, "a/b", -1, 0); });
  expectRefused(EncodeError::kOutOfRange, [](ByteSpan out) { return encodeRpos(out, -1); });
  expectRefused(EncodeError::kOutOfRange, [](ByteSpan out) { return encodeRpos(out, 100000); });
  expectRefused(EncodeError::kNonFinite, [](ByteSpan out) {
    const DataRow row{25, {0.5F, kNan}};
    return encodeData(out, &row, 1);
  });
  for (const std::int32_t index : {-1, 200}) {
    expectRefused(EncodeError::kOutOfRange, [&](ByteSpan out) {
      const DataRow row{index, {}};
      return encodeData(out, &row, 1);
    });
    expectRefused(EncodeError::kOutOfRange, [&](ByteSpan out) { return encodeDsel(out, &index, 1); });
    expectRefused(EncodeError::kOutOfRange, [&](ByteSpan out) { return encodeUsel(out, &index, 1); });
  }
  expectRefused(EncodeError::kEmpty, [](ByteSpan out) { return encodeData(out, nullptr, 0); });
  expectRefused(EncodeError::kEmpty, [](ByteSpan out) { return encodeDsel(out, nullptr, 0); });
  const std::vector<DataRow> rows(kMaxDataRows + 1);
  expectRefused(EncodeError::kTooMany, [&](ByteSpan out) { return encodeData(out, rows.data(), rows.size()); });
  VehiclePose pose;
  pose.latitude_deg = 90.5;
  expectRefused(EncodeError::kOutOfRange, [&](ByteSpan out) { return encodeVehs(out, pose); });
  pose.latitude_deg = kNanDouble;
  expectRefused(EncodeError::kNonFinite, [&](ByteSpan out) { return encodeVehx(out, pose); });
  Placement placement;
  placement.start = static_cast<StartType>(37);
  expectRefused(EncodeError::kOutOfRange, [&](ByteSpan out) { return encodePrel(out, placement); });
  expectRefused(EncodeError::kNonFinite, [](ByteSpan out) { return encodeGett(out, 0, kNanDouble, 0.0, 0.0); });
  expectRefused(EncodeError::kOutOfRange, [](ByteSpan out) { return encodeGett(out, 0, 95.0, 0.0, 0.0); });
}

TEST(Encode, RefusesBadTargets) {
  std::array<std::uint8_t, 64> buffer{};
  EXPECT_TRUE(encodeIse4(buffer, kIse4DataOutput, "255.255.255.255", 65535, false).ok());
  for (const char* address :
       {"localhost", "1.2.3", "1.2.3.4.5", "1.2.3.256", "1.2.3.", "1..2.3", ".1.2.3", "1.2.3.4 "}) {
    expectRefused(EncodeError::kOutOfRange,
                  [&](ByteSpan out) { return encodeIse4(out, kIse4DataOutput, address, 49003, true); });
  }
  expectRefused(EncodeError::kOutOfRange,
                [](ByteSpan out) { return encodeIse4(out, kIse4DataOutput, "1.2.3.4", 0, true); });
  expectRefused(EncodeError::kTextTooLong,
                [](ByteSpan out) { return encodeIse4(out, kIse4DataOutput, "1111.1111.1111.1", 49003, true); });
}

TEST(Encode, RefusesEveryBufferThatIsTooSmall) {
  for (const GoldenPacket& golden : loadGoldenPackets()) {
    if (golden.document.at("direction") != "to_xplane") {
      continue;
    }
    for (std::size_t room = 0; room < golden.bytes.size(); ++room) {
      Bytes buffer(room);
      ASSERT_EQ(encodeGolden(golden, buffer).error(), EncodeError::kBufferTooSmall) << golden.name << room;
    }
    Bytes buffer(golden.bytes.size());
    EXPECT_TRUE(encodeGolden(golden, buffer).ok()) << golden.name;
  }
}

TEST(Names, AreDistinctAndComplete) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < kDecodeErrorCount; ++i) {
    names.emplace_back(toString(static_cast<DecodeError>(i)));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(names[i].find("invalid"), std::string::npos);
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_NE(names[i], names[j]);
    }
  }
  EXPECT_STREQ(toString(static_cast<DecodeError>(kDecodeErrorCount)), "invalid_decode_error");
  for (std::size_t i = 0; i < kEncodeErrorCount; ++i) {
    EXPECT_EQ(std::string(toString(static_cast<EncodeError>(i))).find("invalid"), std::string::npos);
  }
  EXPECT_STREQ(toString(static_cast<EncodeError>(kEncodeErrorCount)), "invalid_encode_error");
}

}  // namespace
}  // namespace xplane_bridge::core
