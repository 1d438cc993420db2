// What X-Plane sends: its messages taken apart.

#include "xplane_bridge/core/wire/packets.hpp"

#include <cstring>

#include "packet_fields.hpp"

namespace xplane_bridge::core {

using namespace packet_fields;

namespace {

constexpr std::size_t kMinBeaconSize = 22;  // fixed fields and the NUL of an empty name
constexpr std::uint8_t kBeaconMajor = 1;

/// Label and length of a message with records of equal size.
DecodeError checkRecords(ByteView datagram, const char* label, std::size_t record_size) {
  if (datagram.size() < kHeaderSize) {
    return DecodeError::kTooShort;
  }
  if (!hasLabel(datagram, label)) {
    return DecodeError::kWrongLabel;
  }
  const std::size_t body = datagram.size() - kHeaderSize;
  if (body == 0) {
    return DecodeError::kEmpty;
  }
  if (body < record_size) {
    return DecodeError::kTooShort;
  }
  return body % record_size == 0 ? DecodeError::kNone : DecodeError::kBadLength;
}

}  // namespace

const char* toString(DecodeError error) {
  switch (error) {
    case DecodeError::kNone:
      return "none";
    case DecodeError::kTooShort:
      return "too_short";
    case DecodeError::kTooLong:
      return "too_long";
    case DecodeError::kBadLength:
      return "bad_length";
    case DecodeError::kEmpty:
      return "empty";
    case DecodeError::kWrongLabel:
      return "wrong_label";
    case DecodeError::kUnknownLabel:
      return "unknown_label";
    case DecodeError::kNonFinite:
      return "non_finite";
    case DecodeError::kOutOfRange:
      return "out_of_range";
    case DecodeError::kUnterminatedText:
      return "unterminated_text";
    case DecodeError::kBadVersion:
      return "bad_version";
  }
  return "invalid_decode_error";
}

MessageKind classify(ByteView datagram) {
  if (datagram.size() < kHeaderSize) {
    return MessageKind::kUnknown;
  }
  struct Label {
    const char* text;
    MessageKind kind;
  };
  static constexpr Label kLabels[] = {
      {"DATA", MessageKind::kData},   {"RREF", MessageKind::kRref}, {"RPOS", MessageKind::kRpos},
      {"BECN", MessageKind::kBeacon}, {"DREF", MessageKind::kDref}, {"TERR", MessageKind::kTerr},
      {"POSI", MessageKind::kPosi},
  };
  for (const Label& label : kLabels) {
    if (hasLabel(datagram, label.text)) {
      return label.kind;
    }
  }
  return MessageKind::kUnknown;
}

std::optional<DataRowView> DataView::find(std::int32_t index) const {
  for (std::size_t i = 0; i < count_; ++i) {
    const DataRowView row = (*this)[i];
    if (row.index() == index) {
      return row;
    }
  }
  return std::nullopt;
}

DataAnomalies inspect(const DataView& data) {
  DataAnomalies anomalies;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const DataRowView row = data[i];
    anomalies.unknown_rows += row.hasKnownIndex() ? 0U : 1U;
    for (std::size_t slot = 0; slot < kDataSlots; ++slot) {
      anomalies.non_finite_values += isFinite(row.value(slot)) ? 0U : 1U;
    }
  }
  return anomalies;
}

DecodeResult<DataView> decodeData(ByteView datagram) {
  const DecodeError error = checkRecords(datagram, "DATA", kDataRowSize);
  if (error != DecodeError::kNone) {
    return error;
  }
  return DataView(datagram.data() + kHeaderSize, (datagram.size() - kHeaderSize) / kDataRowSize);
}

DecodeResult<RrefView> decodeRref(ByteView datagram) {
  const DecodeError error = checkRecords(datagram, "RREF", kRrefPairSize);
  if (error != DecodeError::kNone) {
    return error;
  }
  return RrefView(datagram.data() + kHeaderSize, (datagram.size() - kHeaderSize) / kRrefPairSize);
}

DecodeResult<Rpos> decodeRpos(ByteView datagram) {
  const DecodeError error = checkFixed(datagram, "RPOS", kRposSize);
  if (error != DecodeError::kNone) {
    return error;
  }
  FieldReader reader(datagram.data() + kHeaderSize);
  Rpos rpos;
  rpos.longitude_deg = reader.next<double>();
  rpos.latitude_deg = reader.next<double>();
  rpos.elevation_m = reader.next<double>();
  rpos.height_agl_m = reader.next<float>();
  rpos.pitch_deg = reader.next<float>();
  rpos.true_heading_deg = reader.next<float>();
  rpos.roll_deg = reader.next<float>();
  rpos.velocity_east_mps = reader.next<float>();
  rpos.velocity_up_mps = reader.next<float>();
  rpos.velocity_south_mps = reader.next<float>();
  rpos.roll_rate_radps = reader.next<float>();
  rpos.pitch_rate_radps = reader.next<float>();
  rpos.yaw_rate_radps = reader.next<float>();
  if (!allFinite({rpos.longitude_deg, rpos.latitude_deg, rpos.elevation_m}) ||
      !allFinite({rpos.height_agl_m, rpos.pitch_deg, rpos.true_heading_deg, rpos.roll_deg, rpos.velocity_east_mps,
                  rpos.velocity_up_mps, rpos.velocity_south_mps, rpos.roll_rate_radps, rpos.pitch_rate_radps,
                  rpos.yaw_rate_radps})) {
    return DecodeError::kNonFinite;
  }
  if (!isPosition(rpos.latitude_deg, rpos.longitude_deg)) {
    return DecodeError::kOutOfRange;
  }
  return rpos;
}

DecodeResult<Beacon> decodeBeacon(ByteView datagram) {
  if (datagram.size() < kHeaderSize) {
    return DecodeError::kTooShort;
  }
  if (!hasLabel(datagram, "BECN")) {
    return DecodeError::kWrongLabel;
  }
  if (datagram.size() < kMinBeaconSize) {
    return DecodeError::kTooShort;
  }
  FieldReader reader(datagram.data() + kHeaderSize);
  Beacon beacon;
  beacon.major_version = reader.next<std::uint8_t>();
  beacon.minor_version = reader.next<std::uint8_t>();
  beacon.host = static_cast<Beacon::Host>(reader.next<std::int32_t>());
  beacon.version = reader.next<std::int32_t>();
  beacon.role = static_cast<Beacon::Role>(reader.next<std::uint32_t>());
  beacon.port = reader.next<std::uint16_t>();
  if (beacon.major_version != kBeaconMajor) {
    return DecodeError::kBadVersion;
  }
  if (beacon.port == 0) {
    return DecodeError::kOutOfRange;
  }
  const std::uint8_t* name = datagram.data() + kMinBeaconSize - 1;
  const auto room = static_cast<std::size_t>(datagram.end() - name);
  const void* nul = std::memchr(name, 0, room);
  if (nul == nullptr) {
    return DecodeError::kUnterminatedText;
  }
  const auto length = static_cast<std::size_t>(static_cast<const std::uint8_t*>(nul) - name);
  if (length > kMaxBeaconName) {
    return DecodeError::kUnterminatedText;
  }
  beacon.computer_name = {reinterpret_cast<const char*>(name), length};
  if (beacon.minor_version >= 2 && room - length - 1 >= sizeof(std::uint16_t)) {
    beacon.raknet_port = loadLittleEndian<std::uint16_t>(name + length + 1);
  }
  return beacon;
}

DecodeResult<DrefValue> decodeDref(ByteView datagram) {
  const DecodeError error = checkFixed(datagram, "DREF", kDrefSize);
  if (error != DecodeError::kNone) {
    return error;
  }
  const std::uint8_t* path = datagram.data() + kHeaderSize + sizeof(float);
  const void* nul = std::memchr(path, 0, kDrefPathSize);
  if (nul == nullptr) {
    return DecodeError::kUnterminatedText;
  }
  if (nul == path) {
    return DecodeError::kEmpty;
  }
  DrefValue dref;
  dref.value = loadLittleEndian<float>(datagram.data() + kHeaderSize);
  dref.path = {reinterpret_cast<const char*>(path),
               static_cast<std::size_t>(static_cast<const std::uint8_t*>(nul) - path)};
  return dref;
}

}  // namespace xplane_bridge::core
