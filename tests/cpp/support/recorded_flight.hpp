#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "datagram.hpp"
#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

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
