#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

/// What the doctor's card has found out of an X-Plane (docs/setups/doctor.md): one JSON document, which every YAML
/// reader takes.
namespace xplane_bridge::core {

/// The text is no such document. what() says what is wrong with it.
class ConformanceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Conformance {
  std::int32_t xplane_version = 0;   ///< as SimulatorVersion::number
  std::vector<std::string> refuted;  ///< ids of assumptions

  /// Bits of Otherwise for what the nodes can do otherwise.
  std::uint32_t otherwise() const;
};

/// @throws ConformanceError
Conformance conformanceFromText(const std::string& text);

/// Ids of the assumptions that stand for bits of Otherwise.
std::vector<std::string> refutedOf(std::uint32_t otherwise);

/// What the nodes do about a refuted assumption, in words; empty: nothing.
std::string consequenceOf(const std::string& id);

}  // namespace xplane_bridge::core
