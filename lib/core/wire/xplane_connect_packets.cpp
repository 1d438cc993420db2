// Messages of NASA's X-Plane Connect plugin, both ways.

#include "packet_fields.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

using namespace packet_fields;

DecodeResult<XpcTerrain> decodeTerr(ByteView datagram) {
  const DecodeError error = checkFixed(datagram, "TERR", kTerrSize);
  if (error != DecodeError::kNone) {
    return error;
  }
  FieldReader reader(datagram.data() + kHeaderSize);
  XpcTerrain terrain;
  terrain.aircraft = reader.next<std::uint8_t>();
  terrain.latitude_deg = reader.next<double>();
  terrain.longitude_deg = reader.next<double>();
  terrain.terrain_elevation_m = reader.next<double>();
  for (float& component : terrain.normal) {
    component = reader.next<float>();
  }
  for (float& component : terrain.velocity_mps) {
    component = reader.next<float>();
  }
  terrain.is_wet = reader.next<std::int32_t>();
  terrain.probe_result = reader.next<std::int32_t>();
  if (!allFinite({terrain.latitude_deg, terrain.longitude_deg, terrain.terrain_elevation_m}) ||
      !allFinite({terrain.normal[0], terrain.normal[1], terrain.normal[2], terrain.velocity_mps[0],
                  terrain.velocity_mps[1], terrain.velocity_mps[2]})) {
    return DecodeError::kNonFinite;
  }
  if (!isPosition(terrain.latitude_deg, terrain.longitude_deg)) {
    return DecodeError::kOutOfRange;
  }
  return terrain;
}

DecodeResult<XpcPosition> decodePosi(ByteView datagram) {
  const DecodeError error = checkFixed(datagram, "POSI", kPosiSize);
  if (error != DecodeError::kNone) {
    return error;
  }
  FieldReader reader(datagram.data() + kHeaderSize);
  XpcPosition position;
  position.gear_handle = reader.next<std::uint8_t>();
  position.latitude_deg = reader.next<double>();
  position.longitude_deg = reader.next<double>();
  position.elevation_m = reader.next<double>();
  position.pitch_deg = reader.next<float>();
  position.roll_deg = reader.next<float>();
  position.true_heading_deg = reader.next<float>();
  position.gear = reader.next<float>();
  if (!allFinite({position.latitude_deg, position.longitude_deg, position.elevation_m}) ||
      !allFinite({position.pitch_deg, position.roll_deg, position.true_heading_deg, position.gear})) {
    return DecodeError::kNonFinite;
  }
  if (!isPosition(position.latitude_deg, position.longitude_deg)) {
    return DecodeError::kOutOfRange;
  }
  return position;
}

EncodeResult encodeGett(ByteSpan out, std::uint8_t aircraft, double latitude_deg, double longitude_deg,
                        double elevation_m) {
  if (!allFinite({latitude_deg, longitude_deg, elevation_m})) {
    return EncodeError::kNonFinite;
  }
  const bool own_position =
      latitude_deg == kXpcOwnPosition || longitude_deg == kXpcOwnPosition || elevation_m == kXpcOwnPosition;
  if (!own_position && !isPosition(latitude_deg, longitude_deg)) {
    return EncodeError::kOutOfRange;
  }
  if (out.size() < kGettSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "GETT");
  writer.put(aircraft);
  writer.put(latitude_deg);
  writer.put(longitude_deg);
  writer.put(elevation_m);
  return writer.size();
}

EncodeResult encodeGetp(ByteSpan out, std::uint8_t aircraft) {
  if (out.size() < kGetpSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "GETP");
  writer.put(aircraft);
  return writer.size();
}

}  // namespace xplane_bridge::core
