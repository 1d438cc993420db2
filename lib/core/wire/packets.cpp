#include "xplane_bridge/core/wire/packets.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <initializer_list>

namespace xplane_bridge::core {
namespace {

constexpr double kMaxLatitudeDeg = 90.0;
constexpr double kMaxLongitudeDeg = 360.0;  // X-Plane sends -180..180; a sender using 0..360 is no reason to lose a fix
constexpr std::size_t kMinBeaconSize = 22;  // fixed fields and the NUL of an empty name
constexpr std::uint8_t kBeaconMajor = 1;
constexpr std::size_t kRposRateDigits = 5;
constexpr std::int32_t kMaxRposRate = 99999;
constexpr std::size_t kAirportSize = 8;
constexpr std::int32_t kMinStartType = 5;
constexpr std::int32_t kMaxStartType = 36;
constexpr std::size_t kIpv4TextSize = 16;
constexpr std::size_t kPortTextSize = 8;

bool hasLabel(ByteView datagram, const char* label) { return std::memcmp(datagram.data(), label, 4) == 0; }

bool isFinite(float value) {
  // By bits, so that -ffast-math in a user's flags cannot remove the check.
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return (bits & 0x7F800000U) != 0x7F800000U;
}

bool isFinite(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return (bits & 0x7FF0000000000000ULL) != 0x7FF0000000000000ULL;
}

template <typename T>
bool allFinite(std::initializer_list<T> values) {
  for (const T value : values) {
    if (!isFinite(value)) {
      return false;
    }
  }
  return true;
}

bool isPosition(double latitude_deg, double longitude_deg) {
  return std::abs(latitude_deg) <= kMaxLatitudeDeg && std::abs(longitude_deg) <= kMaxLongitudeDeg;
}

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

/// Label and length of a message with one size.
DecodeError checkFixed(ByteView datagram, const char* label, std::size_t size) {
  if (datagram.size() < kHeaderSize) {
    return DecodeError::kTooShort;
  }
  if (!hasLabel(datagram, label)) {
    return DecodeError::kWrongLabel;
  }
  if (datagram.size() < size) {
    return DecodeError::kTooShort;
  }
  return datagram.size() > size ? DecodeError::kTooLong : DecodeError::kNone;
}

/// Reads consecutive fields; the caller has checked the length.
class FieldReader {
 public:
  explicit FieldReader(const std::uint8_t* from) : at_(from) {}
  template <typename T>
  T next() {
    const T value = loadLittleEndian<T>(at_);
    at_ += sizeof(T);
    return value;
  }

 private:
  const std::uint8_t* at_;
};

/// Writes consecutive fields; the caller has checked the room.
class FieldWriter {
 public:
  FieldWriter(ByteSpan out, const char* label) : begin_(out.data()), at_(out.data()) {
    std::memcpy(at_, label, 4);
    at_[4] = 0;
    at_ += kHeaderSize;
  }

  template <typename T>
  void put(T value) {
    storeLittleEndian(value, at_);
    at_ += sizeof(T);
  }

  void putText(std::string_view text) {
    if (!text.empty()) {
      std::memcpy(at_, text.data(), text.size());
      at_ += text.size();
    }
  }

  /// Text in a field of fixed width, the rest NUL.
  void putText(std::string_view text, std::size_t width) {
    putText(text);
    putZeros(width - text.size());
  }

  void putZeros(std::size_t count) {
    std::memset(at_, 0, count);
    at_ += count;
  }

  std::size_t size() const { return static_cast<std::size_t>(at_ - begin_); }

 private:
  std::uint8_t* begin_;
  std::uint8_t* at_;
};

/// Text that must fit `max_size` characters, NUL not counted.
EncodeError checkText(std::string_view text, std::size_t max_size) {
  if (text.empty()) {
    return EncodeError::kEmpty;
  }
  if (text.size() > max_size) {
    return EncodeError::kTextTooLong;
  }
  return text.find('\0') == std::string_view::npos ? EncodeError::kNone : EncodeError::kTextHasNul;
}

bool isDottedDecimal(std::string_view text) {
  int octets = 0;
  std::size_t i = 0;
  while (i < text.size()) {
    int value = 0;
    std::size_t digits = 0;
    for (; i < text.size() && text[i] >= '0' && text[i] <= '9' && digits < 4; ++i, ++digits) {
      value = 10 * value + (text[i] - '0');
    }
    if (digits == 0 || digits > 3 || value > 255) {
      return false;
    }
    ++octets;
    if (i < text.size() && (text[i] != '.' || ++i == text.size())) {
      return false;
    }
  }
  return octets == 4;
}

EncodeResult encodeRowSelection(ByteSpan out, const char* label, const std::int32_t* rows, std::size_t count) {
  if (count == 0) {
    return EncodeError::kEmpty;
  }
  if (count > kMaxDataRows) {
    return EncodeError::kTooMany;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (rows[i] < 0 || rows[i] >= kDataRowLimit) {
      return EncodeError::kOutOfRange;
    }
  }
  if (out.size() < kHeaderSize + 4 * count) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, label);
  for (std::size_t i = 0; i < count; ++i) {
    writer.put(rows[i]);
  }
  return writer.size();
}

EncodeResult encodeVehicle(ByteSpan out, const char* label, const VehiclePose& pose) {
  if (!allFinite({pose.latitude_deg, pose.longitude_deg, pose.elevation_m}) ||
      !allFinite({pose.true_heading_deg, pose.pitch_deg, pose.roll_deg})) {
    return EncodeError::kNonFinite;
  }
  if (!isPosition(pose.latitude_deg, pose.longitude_deg) || pose.aircraft < 0) {
    return EncodeError::kOutOfRange;
  }
  if (out.size() < kVehicleSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, label);
  writer.put(pose.aircraft);
  writer.put(pose.latitude_deg);
  writer.put(pose.longitude_deg);
  writer.put(pose.elevation_m);
  writer.put(pose.true_heading_deg);
  writer.put(pose.pitch_deg);
  writer.put(pose.roll_deg);
  return writer.size();
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

const char* toString(EncodeError error) {
  switch (error) {
    case EncodeError::kNone:
      return "none";
    case EncodeError::kBufferTooSmall:
      return "buffer_too_small";
    case EncodeError::kEmpty:
      return "empty";
    case EncodeError::kTextTooLong:
      return "text_too_long";
    case EncodeError::kTextHasNul:
      return "text_has_nul";
    case EncodeError::kNonFinite:
      return "non_finite";
    case EncodeError::kOutOfRange:
      return "out_of_range";
    case EncodeError::kTooMany:
      return "too_many";
  }
  return "invalid_encode_error";
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

EncodeResult encodeRref(ByteSpan out, std::string_view path, std::int32_t rate_hz, std::int32_t index) {
  const EncodeError error = checkText(path, kRrefPathSize - 1);
  if (error != EncodeError::kNone) {
    return error;
  }
  if (rate_hz < 0) {
    return EncodeError::kOutOfRange;
  }
  if (out.size() < kRrefRequestSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "RREF");
  writer.put(rate_hz);
  writer.put(index);
  writer.putText(path, kRrefPathSize);
  return writer.size();
}

EncodeResult encodeRpos(ByteSpan out, std::int32_t rate_hz) {
  if (rate_hz < 0 || rate_hz > kMaxRposRate) {
    return EncodeError::kOutOfRange;
  }
  if (out.size() < kRposRequestSize) {
    return EncodeError::kBufferTooSmall;
  }
  std::array<char, kRposRateDigits + 1> digits{};
  const int length = std::snprintf(digits.data(), digits.size(), "%d", rate_hz);
  FieldWriter writer(out, "RPOS");
  writer.putText({digits.data(), static_cast<std::size_t>(length)}, kRposRequestSize - kHeaderSize);
  return writer.size();
}

EncodeResult encodeDref(ByteSpan out, std::string_view path, float value) {
  const EncodeError error = checkText(path, kDrefPathSize - 1);
  if (error != EncodeError::kNone) {
    return error;
  }
  if (!isFinite(value)) {
    return EncodeError::kNonFinite;
  }
  if (out.size() < kDrefSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "DREF");
  writer.put(value);
  // Laminar's text asks for spaces behind the NUL; working programs send zeros to versions 10 to 12.
  writer.putText(path, kDrefPathSize);
  return writer.size();
}

EncodeResult encodeCmnd(ByteSpan out, std::string_view path) {
  const EncodeError error = checkText(path, kMaxCommandPath);
  if (error != EncodeError::kNone) {
    return error;
  }
  if (out.size() < kHeaderSize + path.size() + 1) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "CMND");
  writer.putText(path, path.size() + 1);
  return writer.size();
}

EncodeResult encodeData(ByteSpan out, const DataRow* rows, std::size_t count) {
  if (count == 0) {
    return EncodeError::kEmpty;
  }
  if (count > kMaxDataRows) {
    return EncodeError::kTooMany;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (rows[i].index < 0 || rows[i].index >= kDataRowLimit) {
      return EncodeError::kOutOfRange;
    }
    for (const float value : rows[i].values) {
      if (!isFinite(value)) {
        return EncodeError::kNonFinite;
      }
    }
  }
  if (out.size() < kHeaderSize + count * kDataRowSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "DATA");
  for (std::size_t i = 0; i < count; ++i) {
    writer.put(rows[i].index);
    for (const float value : rows[i].values) {
      writer.put(value);
    }
  }
  return writer.size();
}

EncodeResult encodeDsel(ByteSpan out, const std::int32_t* rows, std::size_t count) {
  return encodeRowSelection(out, "DSEL", rows, count);
}

EncodeResult encodeUsel(ByteSpan out, const std::int32_t* rows, std::size_t count) {
  return encodeRowSelection(out, "USEL", rows, count);
}

EncodeResult encodeIse4(ByteSpan out, std::int32_t target, std::string_view ipv4, std::uint16_t port, bool enabled) {
  const EncodeError error = checkText(ipv4, kIpv4TextSize - 1);
  if (error != EncodeError::kNone) {
    return error;
  }
  if (!isDottedDecimal(ipv4) || target < 0 || port == 0) {
    return EncodeError::kOutOfRange;
  }
  if (out.size() < kIse4Size) {
    return EncodeError::kBufferTooSmall;
  }
  std::array<char, kPortTextSize> digits{};
  const int length = std::snprintf(digits.data(), digits.size(), "%u", static_cast<unsigned>(port));
  FieldWriter writer(out, "ISE4");
  writer.put(target);
  writer.putText(ipv4, kIpv4TextSize);
  writer.putText({digits.data(), static_cast<std::size_t>(length)}, kPortTextSize);
  writer.put(std::int32_t{enabled ? 1 : 0});
  return writer.size();
}

EncodeResult encodePrel(ByteSpan out, const Placement& placement) {
  if (!placement.airport.empty()) {
    const EncodeError error = checkText(placement.airport, kAirportSize);
    if (error != EncodeError::kNone) {
      return error;
    }
  }
  if (!allFinite({placement.latitude_deg, placement.longitude_deg, placement.elevation_m, placement.true_heading_deg,
                  placement.speed_mps})) {
    return EncodeError::kNonFinite;
  }
  const auto start = static_cast<std::int32_t>(placement.start);
  if (start < kMinStartType || start > kMaxStartType || placement.aircraft < 0 ||
      !isPosition(placement.latitude_deg, placement.longitude_deg)) {
    return EncodeError::kOutOfRange;
  }
  if (out.size() < kPrelSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "PREL");
  writer.put(start);
  writer.put(placement.aircraft);
  writer.putText(placement.airport, kAirportSize);
  writer.put(placement.runway);
  writer.put(placement.runway_direction);
  writer.put(placement.latitude_deg);
  writer.put(placement.longitude_deg);
  writer.put(placement.elevation_m);
  writer.put(placement.true_heading_deg);
  writer.put(placement.speed_mps);
  return writer.size();
}

EncodeResult encodeAcfn(ByteSpan out, std::int32_t aircraft, std::string_view path, std::int32_t livery) {
  const EncodeError error = checkText(path, kFilePathSize - 1);
  if (error != EncodeError::kNone) {
    return error;
  }
  if (aircraft < 0 || livery < 0) {
    return EncodeError::kOutOfRange;
  }
  if (out.size() < kAcfnSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "ACFN");
  writer.put(aircraft);
  writer.putText(path, kFilePathSize);
  writer.putZeros(2);
  writer.put(livery);
  return writer.size();
}

EncodeResult encodeSimo(ByteSpan out, SituationAction action, std::string_view path) {
  const EncodeError error = checkText(path, kFilePathSize - 1);
  if (error != EncodeError::kNone) {
    return error;
  }
  if (out.size() < kSimoSize) {
    return EncodeError::kBufferTooSmall;
  }
  FieldWriter writer(out, "SIMO");
  writer.put(static_cast<std::int32_t>(action));
  writer.putText(path, kFilePathSize);
  writer.putZeros(2);
  return writer.size();
}

EncodeResult encodeVehx(ByteSpan out, const VehiclePose& pose) { return encodeVehicle(out, "VEHX", pose); }

EncodeResult encodeVehs(ByteSpan out, const VehiclePose& pose) { return encodeVehicle(out, "VEHS", pose); }

EncodeResult encodeRese(ByteSpan out) {
  if (out.size() < kReseSize) {
    return EncodeError::kBufferTooSmall;
  }
  return FieldWriter(out, "RESE").size();
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
