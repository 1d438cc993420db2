// What is sent to X-Plane: its messages put together.

#include <cstdio>
#include <cstring>

#include "packet_fields.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

using namespace packet_fields;

namespace {

constexpr std::size_t kRposRateDigits = 5;
constexpr std::int32_t kMaxRposRate = 99999;
constexpr std::size_t kAirportSize = 8;
constexpr std::int32_t kMinStartType = 5;
constexpr std::int32_t kMaxStartType = 36;
constexpr std::size_t kIpv4TextSize = 16;
constexpr std::size_t kPortTextSize = 8;

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

}  // namespace xplane_bridge::core
