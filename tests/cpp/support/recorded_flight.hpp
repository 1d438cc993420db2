#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// Bytes of a datagram and how the tests make them, from the layout in the protocol reference.
struct Datagram {
  std::vector<std::uint8_t> bytes;

  static Datagram fromHex(const std::string& hex) {
    Datagram d;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
      d.bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
    }
    return d;
  }
  static Datagram labelled(const char* label) {
    Datagram d;
    for (int i = 0; i < 5; ++i) d.bytes.push_back(static_cast<std::uint8_t>(label[i]));
    return d;
  }
  template <typename T>
  Datagram& put(T value) {
    std::uint8_t raw[sizeof(T)];
    storeLittleEndian(value, raw);
    bytes.insert(bytes.end(), raw, raw + sizeof(T));
    return *this;
  }
  Datagram& row(std::int32_t index, const std::vector<float>& slots) {
    put(index);
    for (std::size_t i = 0; i < 8; ++i) put(i < slots.size() ? slots[i] : kUnusedSlot);
    return *this;
  }
  Datagram& pair(std::int32_t index, float value) { return put(index).put(value); }

  RrefView rref() const { return *decodeRref(bytes); }
  DataView data() const { return *decodeData(bytes); }
};

/// tests/data/states/xp11.json or xp12.json: a stretch of flight as the emulator sent it, with the truth (generate.py).
class RecordedFlight {
 public:
  explicit RecordedFlight(int version) {
    const std::string path = std::string(XPLANE_BRIDGE_TEST_DATA) + "/states/xp" + std::to_string(version) + ".json";
    std::ifstream file(path);
    if (!file) {
      ADD_FAILURE() << "cannot read " << path;
      return;
    }
    json_ = nlohmann::json::parse(file);
    for (std::size_t i = 0; i < json_["paths"].size(); ++i) index_[json_["paths"][i].get<std::string>()] = i;
  }

  std::size_t size() const { return json_["frames"].size(); }
  SimulatorVersion version() const { return {json_["version"].get<std::int32_t>()}; }
  double truth(std::size_t frame, const std::string& name) const { return json_["frames"][frame]["truth"][name]; }
  bool answers(const std::string& path) const { return !json_["frames"][0]["rref"][index_.at(path)].is_null(); }
  float value(std::size_t frame, const std::string& path) const {
    return json_["frames"][frame]["rref"][index_.at(path)].get<float>();
  }

  /// The reply to these requests: pairs of what answers.
  Datagram rref(std::size_t frame, const std::vector<DatarefRequest>& requests) const {
    Datagram d = Datagram::labelled("RREF,");
    for (std::size_t i = 0; i < requests.size(); ++i) {
      if (answers(requests[i].path)) d.pair(static_cast<std::int32_t>(i), value(frame, requests[i].path));
    }
    return d;
  }
  /// All 139 rows.
  Datagram data(std::size_t frame) const {
    return Datagram::fromHex(json_["frames"][frame]["data"].get<std::string>());
  }
  /// Only these rows, in this order.
  Datagram data(std::size_t frame, const std::vector<std::int32_t>& rows) const {
    const Datagram all = data(frame);
    Datagram d = Datagram::labelled("DATA*");
    for (const std::int32_t row : rows) {
      const auto first = all.bytes.begin() + 5 + 36 * row;
      d.bytes.insert(d.bytes.end(), first, first + 36);
    }
    return d;
  }
  Rpos rpos(std::size_t frame) const {
    return *decodeRpos(Datagram::fromHex(json_["frames"][frame]["rpos"].get<std::string>()).bytes);
  }

 private:
  nlohmann::json json_;
  std::map<std::string, std::size_t> index_;
};

}  // namespace xplane_bridge::core
