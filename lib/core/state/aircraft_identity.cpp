#include "xplane_bridge/core/state/aircraft_identity.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

namespace xplane_bridge::core {
namespace {

// Both are longer in X-Plane (40 and 260); every character costs a request of 413 bytes.
constexpr std::size_t kIcaoLength = 8;
constexpr std::size_t kDescriptionLength = 64;

/// Whether a character is missing that stands before the end of a text that X-Plane has.
bool isBroken(const std::vector<float>& values, std::size_t first, std::size_t length) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = std::find_if(begin, begin + static_cast<std::ptrdiff_t>(length),
                                [](float value) { return std::isfinite(value) && value < 1.0F; });
  const auto missing = [](float value) { return !std::isfinite(value); };
  return std::any_of(begin, end, missing) && !std::all_of(begin, end, missing);
}

std::string textFrom(const std::vector<float>& values, std::size_t first, std::size_t length) {
  std::string text;
  for (std::size_t i = first; i < first + length; ++i) {
    const float value = values[i];
    constexpr float kLastByte = 255.0F;
    if (!(value >= 1.0F && value <= kLastByte)) {  // its end, or never answered
      break;
    }
    const int code = static_cast<int>(value);
    constexpr int kFirstPrintable = 32;
    constexpr int kLastPrintable = 126;
    text += code >= kFirstPrintable && code <= kLastPrintable ? static_cast<char>(code) : '?';
  }
  const std::size_t end = text.find_last_not_of(' ');
  return end == std::string::npos ? "" : text.substr(0, end + 1);
}

std::string_view withoutBlanks(std::string_view text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') + 1 - first);
}

}  // namespace

std::string described(const AircraftIdentity& aircraft) { return aircraft.icao + " (" + aircraft.description + ")"; }

bool isListed(const AircraftIdentity& aircraft, const std::vector<std::string>& identities) {
  const std::string_view icao = withoutBlanks(aircraft.icao), description = withoutBlanks(aircraft.description);
  return std::any_of(identities.begin(), identities.end(), [&](const std::string& identity) {
    const std::string_view text = withoutBlanks(identity);
    return !text.empty() && (text == icao || text == description);
  });
}

AircraftIdentityReader::AircraftIdentityReader()
    : frames_(datarefs().size(), 0, RrefFrameAssembler::Options::atRate(kRateHz)) {}

const std::vector<std::string>& AircraftIdentityReader::datarefs() {
  static const std::vector<std::string> kDatarefs = [] {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < kIcaoLength; ++i) {
      names.push_back("sim/aircraft/view/acf_ICAO[" + std::to_string(i) + "]");
    }
    for (std::size_t i = 0; i < kDescriptionLength; ++i) {
      names.push_back("sim/aircraft/view/acf_descrip[" + std::to_string(i) + "]");
    }
    return names;
  }();
  return kDatarefs;
}

bool AircraftIdentityReader::add(const RrefView& datagram, std::int64_t receive_ns) {
  if (!frames_.add(datagram, receive_ns)) {
    return false;
  }
  return take(frames_.values());
}

bool AircraftIdentityReader::add(const std::vector<DatarefValue>& values) {
  if (values.size() != datarefs().size()) return false;
  std::vector<float> characters;
  characters.reserve(values.size());
  for (const DatarefValue& value : values) {
    if (!value) return false;
    characters.push_back(*value);
  }
  return take(characters);
}

bool AircraftIdentityReader::take(const std::vector<float>& characters) {
  // Its request may have been lost, and comes again: "C1" is another aircraft than "C172".
  if (isBroken(characters, 0, kIcaoLength) || isBroken(characters, kIcaoLength, kDescriptionLength)) {
    return false;
  }
  AircraftIdentity identity{textFrom(characters, 0, kIcaoLength),
                            textFrom(characters, kIcaoLength, kDescriptionLength)};
  ++answers_;
  if (identity == identity_) {
    return false;
  }
  identity_ = std::move(identity);
  return true;
}

}  // namespace xplane_bridge::core
