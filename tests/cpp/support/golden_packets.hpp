#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/packets.hpp"

/// The golden packets of tests/data/packets, and how their decoded values map to the codec's types.
namespace xplane_bridge::core {

struct GoldenPacket {
  std::string name;
  std::vector<std::uint8_t> bytes;
  nlohmann::json document;

  std::string testName() const {
    std::string result = name;
    std::replace_if(
        result.begin(), result.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
    return result;
  }
  friend std::ostream& operator<<(std::ostream& out, const GoldenPacket& packet) { return out << packet.name; }
};

inline std::vector<GoldenPacket> loadGoldenPackets() {
  std::vector<GoldenPacket> packets;
  for (const auto& file : std::filesystem::directory_iterator(XPLANE_BRIDGE_TEST_DATA "/packets")) {
    if (file.path().extension() != ".hex") {
      continue;
    }
    GoldenPacket packet;
    packet.name = file.path().stem().string();
    std::string hex;
    std::ifstream(file.path()) >> hex;
    if (hex.empty() || hex.size() % 2 != 0) {
      throw std::runtime_error(file.path().string() + ": expected one line with an even number of hex digits");
    }
    for (std::size_t i = 0; i < hex.size(); i += 2) {
      packet.bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
    }
    std::filesystem::path json = file.path();
    json.replace_extension(".json");
    packet.document = nlohmann::json::parse(std::ifstream(json));
    packets.push_back(packet);
  }
  std::sort(packets.begin(), packets.end(),
            [](const GoldenPacket& a, const GoldenPacket& b) { return a.name < b.name; });
  return packets;
}

/// The nearest float32 of a number in a document.
inline float wireFloat(const nlohmann::json& value) { return static_cast<float>(value.get<double>()); }

inline void checkRpos(const nlohmann::json& fields, const Rpos& rpos) {
  EXPECT_EQ(rpos.longitude_deg, fields.at("longitude_deg").get<double>());
  EXPECT_EQ(rpos.latitude_deg, fields.at("latitude_deg").get<double>());
  EXPECT_EQ(rpos.elevation_m, fields.at("elevation_m").get<double>());
  EXPECT_EQ(rpos.height_agl_m, wireFloat(fields.at("height_agl_m")));
  EXPECT_EQ(rpos.pitch_deg, wireFloat(fields.at("pitch_deg")));
  EXPECT_EQ(rpos.true_heading_deg, wireFloat(fields.at("true_heading_deg")));
  EXPECT_EQ(rpos.roll_deg, wireFloat(fields.at("roll_deg")));
  EXPECT_EQ(rpos.velocity_east_mps, wireFloat(fields.at("velocity_east_mps")));
  EXPECT_EQ(rpos.velocity_up_mps, wireFloat(fields.at("velocity_up_mps")));
  EXPECT_EQ(rpos.velocity_south_mps, wireFloat(fields.at("velocity_south_mps")));
  EXPECT_EQ(rpos.roll_rate_radps, wireFloat(fields.at("roll_rate_radps")));
  EXPECT_EQ(rpos.pitch_rate_radps, wireFloat(fields.at("pitch_rate_radps")));
  EXPECT_EQ(rpos.yaw_rate_radps, wireFloat(fields.at("yaw_rate_radps")));
}

inline void checkBeacon(const nlohmann::json& fields, const Beacon& beacon) {
  EXPECT_EQ(beacon.major_version, fields.at("major_version").get<int>());
  EXPECT_EQ(beacon.minor_version, fields.at("minor_version").get<int>());
  EXPECT_EQ(static_cast<std::int32_t>(beacon.host), fields.at("host").get<std::int32_t>());
  EXPECT_EQ(beacon.version, fields.at("version").get<std::int32_t>());
  EXPECT_EQ(static_cast<std::uint32_t>(beacon.role), fields.at("role").get<std::uint32_t>());
  EXPECT_EQ(beacon.port, fields.at("port").get<int>());
  EXPECT_EQ(beacon.computer_name, fields.at("computer_name").get<std::string>());
  ASSERT_EQ(beacon.raknet_port.has_value(), !fields.at("raknet_port").is_null());
  if (beacon.raknet_port.has_value()) {
    EXPECT_EQ(*beacon.raknet_port, fields.at("raknet_port").get<int>());
  }
}

inline void checkTerrain(const nlohmann::json& fields, const XpcTerrain& terrain) {
  EXPECT_EQ(terrain.aircraft, fields.at("aircraft").get<int>());
  EXPECT_EQ(terrain.latitude_deg, fields.at("latitude_deg").get<double>());
  EXPECT_EQ(terrain.longitude_deg, fields.at("longitude_deg").get<double>());
  EXPECT_EQ(terrain.terrain_elevation_m, fields.at("terrain_elevation_m").get<double>());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(terrain.normal.at(axis), wireFloat(fields.at("normal").at(axis)));
    EXPECT_EQ(terrain.velocity_mps.at(axis), wireFloat(fields.at("velocity_mps").at(axis)));
  }
  EXPECT_EQ(terrain.is_wet, fields.at("is_wet").get<std::int32_t>());
  EXPECT_EQ(terrain.probe_result, fields.at("probe_result").get<std::int32_t>());
}

inline void checkXpcPosition(const nlohmann::json& fields, const XpcPosition& position) {
  EXPECT_EQ(position.gear_handle, fields.at("gear_handle").get<int>());
  EXPECT_EQ(position.latitude_deg, fields.at("latitude_deg").get<double>());
  EXPECT_EQ(position.longitude_deg, fields.at("longitude_deg").get<double>());
  EXPECT_EQ(position.elevation_m, fields.at("elevation_m").get<double>());
  EXPECT_EQ(position.pitch_deg, wireFloat(fields.at("pitch_deg")));
  EXPECT_EQ(position.roll_deg, wireFloat(fields.at("roll_deg")));
  EXPECT_EQ(position.true_heading_deg, wireFloat(fields.at("true_heading_deg")));
  EXPECT_EQ(position.gear, wireFloat(fields.at("gear")));
}

/// Decodes a packet from X-Plane and compares every value.
inline void checkDecoding(const GoldenPacket& packet) {
  const nlohmann::json& fields = packet.document.at("fields");
  const std::string message = packet.document.at("message");
  if (message == "DATA") {
    const auto data = decodeData(packet.bytes);
    ASSERT_TRUE(data.ok()) << toString(data.error());
    ASSERT_EQ(data->size(), fields.at("rows").size());
    for (std::size_t i = 0; i < data->size(); ++i) {
      EXPECT_EQ((*data)[i].index(), fields.at("rows").at(i).at("index").get<std::int32_t>());
      for (std::size_t slot = 0; slot < kDataSlots; ++slot) {
        EXPECT_EQ((*data)[i].value(slot), wireFloat(fields.at("rows").at(i).at("values").at(slot))) << i << ":" << slot;
      }
    }
  } else if (message == "RREF") {
    const auto rref = decodeRref(packet.bytes);
    ASSERT_TRUE(rref.ok()) << toString(rref.error());
    ASSERT_EQ(rref->size(), fields.at("pairs").size());
    for (std::size_t i = 0; i < rref->size(); ++i) {
      EXPECT_EQ((*rref)[i].index, fields.at("pairs").at(i).at("index").get<std::int32_t>());
      EXPECT_EQ((*rref)[i].value, wireFloat(fields.at("pairs").at(i).at("value")));
    }
  } else if (message == "RPOS") {
    const auto rpos = decodeRpos(packet.bytes);
    ASSERT_TRUE(rpos.ok()) << toString(rpos.error());
    checkRpos(fields, *rpos);
  } else if (message == "BECN") {
    const auto beacon = decodeBeacon(packet.bytes);
    ASSERT_TRUE(beacon.ok()) << toString(beacon.error());
    checkBeacon(fields, *beacon);
  } else if (message == "DREF") {
    const auto dref = decodeDref(packet.bytes);
    ASSERT_TRUE(dref.ok()) << toString(dref.error());
    EXPECT_EQ(dref->path, fields.at("path").get<std::string>());
    EXPECT_EQ(dref->value, wireFloat(fields.at("value")));
  } else if (message == "TERR") {
    const auto terrain = decodeTerr(packet.bytes);
    ASSERT_TRUE(terrain.ok()) << toString(terrain.error());
    checkTerrain(fields, *terrain);
  } else if (message == "POSI") {
    const auto position = decodePosi(packet.bytes);
    ASSERT_TRUE(position.ok()) << toString(position.error());
    checkXpcPosition(fields, *position);
  } else {
    FAIL() << "no decoder is compared with " << message;
  }
}

inline VehiclePose poseOf(const nlohmann::json& fields) {
  VehiclePose pose;
  pose.aircraft = fields.at("aircraft");
  pose.latitude_deg = fields.at("latitude_deg");
  pose.longitude_deg = fields.at("longitude_deg");
  pose.elevation_m = fields.at("elevation_m");
  pose.true_heading_deg = wireFloat(fields.at("true_heading_deg"));
  pose.pitch_deg = wireFloat(fields.at("pitch_deg"));
  pose.roll_deg = wireFloat(fields.at("roll_deg"));
  return pose;
}

inline EncodeResult encodePrelOf(const nlohmann::json& fields, ByteSpan out) {
  const std::string airport = fields.at("airport");
  Placement placement;
  placement.start = static_cast<StartType>(fields.at("start").get<std::int32_t>());
  placement.aircraft = fields.at("aircraft");
  placement.airport = airport;
  placement.runway = fields.at("runway");
  placement.runway_direction = fields.at("runway_direction");
  placement.latitude_deg = fields.at("latitude_deg");
  placement.longitude_deg = fields.at("longitude_deg");
  placement.elevation_m = fields.at("elevation_m");
  placement.true_heading_deg = fields.at("true_heading_deg");
  placement.speed_mps = fields.at("speed_mps");
  return encodePrel(out, placement);
}

inline EncodeResult encodeDataOf(const nlohmann::json& fields, ByteSpan out) {
  std::vector<DataRow> rows;
  for (const nlohmann::json& given : fields.at("rows")) {
    DataRow row;
    row.index = given.at("index");
    for (std::size_t slot = 0; slot < kDataSlots; ++slot) {
      row.values.at(slot) = wireFloat(given.at("values").at(slot));
    }
    rows.push_back(row);
  }
  return encodeData(out, rows.data(), rows.size());
}

/// Encodes the fields of a packet to X-Plane.
inline EncodeResult encodeGolden(const GoldenPacket& packet, ByteSpan out) {
  const nlohmann::json& fields = packet.document.at("fields");
  const std::string message = packet.document.at("message");
  const auto path = [&fields] { return fields.at("path").get<std::string>(); };
  if (message == "DATA") {
    return encodeDataOf(fields, out);
  }
  if (message == "RREF") {
    return encodeRref(out, path(), fields.at("rate_hz"), fields.at("index"));
  }
  if (message == "RPOS") {
    return encodeRpos(out, fields.at("rate_hz"));
  }
  if (message == "DREF") {
    return encodeDref(out, path(), wireFloat(fields.at("value")));
  }
  if (message == "CMND") {
    return encodeCmnd(out, path());
  }
  if (message == "DSEL" || message == "USEL") {
    const auto rows = fields.at("rows").get<std::vector<std::int32_t>>();
    return message == "DSEL" ? encodeDsel(out, rows.data(), rows.size()) : encodeUsel(out, rows.data(), rows.size());
  }
  if (message == "ISE4") {
    return encodeIse4(out, fields.at("target"), fields.at("address").get<std::string>(), fields.at("port"),
                      fields.at("enabled"));
  }
  if (message == "PREL") {
    return encodePrelOf(fields, out);
  }
  if (message == "ACFN") {
    return encodeAcfn(out, fields.at("aircraft"), path(), fields.at("livery"));
  }
  if (message == "SIMO") {
    return encodeSimo(out, static_cast<SituationAction>(fields.at("action").get<std::int32_t>()), path());
  }
  if (message == "VEHX") {
    return encodeVehx(out, poseOf(fields));
  }
  if (message == "VEHS") {
    return encodeVehs(out, poseOf(fields));
  }
  if (message == "RESE") {
    return encodeRese(out);
  }
  if (message == "GETT") {
    return encodeGett(out, fields.at("aircraft"), fields.at("latitude_deg"), fields.at("longitude_deg"),
                      fields.at("elevation_m"));
  }
  if (message == "GETP") {
    return encodeGetp(out, fields.at("aircraft"));
  }
  throw std::runtime_error("no encoder is compared with " + message);
}

/// Encodes a packet to X-Plane and compares every byte.
inline void checkEncoding(const GoldenPacket& packet) {
  std::vector<std::uint8_t> buffer(packet.bytes.size() + 16, 0xEE);
  const EncodeResult size = encodeGolden(packet, buffer);
  ASSERT_TRUE(size.ok()) << toString(size.error());
  ASSERT_EQ(*size, packet.bytes.size());
  for (std::size_t i = packet.bytes.size(); i < buffer.size(); ++i) {
    EXPECT_EQ(buffer[i], 0xEE) << "written behind the message";
  }
  buffer.resize(*size);
  EXPECT_EQ(buffer, packet.bytes);
}

}  // namespace xplane_bridge::core
