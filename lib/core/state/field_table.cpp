#include "xplane_bridge/core/state/field_table.hpp"

#include <algorithm>
#include <iterator>

#include "xplane_bridge/core/state/field_lines.hpp"

namespace xplane_bridge::core {

const std::vector<FieldSpec>& fieldTable() {
  static const std::vector<FieldSpec> table(std::begin(kFieldLines), std::end(kFieldLines));
  return table;
}

std::vector<std::string> expandDatarefPath(std::string_view pattern, int count) {
  const std::size_t open = pattern.find('{');
  if (open != std::string_view::npos) {
    const std::size_t close = pattern.find('}', open);
    std::vector<std::string> expanded;
    std::size_t begin = open + 1;
    while (begin <= close) {
      const std::size_t end = std::min(pattern.find(',', begin), close);
      const std::string one = std::string(pattern.substr(0, open)) + std::string(pattern.substr(begin, end - begin)) +
                              std::string(pattern.substr(close + 1));
      for (std::string& path : expandDatarefPath(one, count)) expanded.push_back(std::move(path));
      begin = end + 1;
    }
    return expanded;
  }
  const std::size_t star = pattern.find("[*]");
  if (star == std::string_view::npos) return {std::string(pattern)};
  std::vector<std::string> expanded;
  expanded.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    expanded.push_back(std::string(pattern.substr(0, star)) + "[" + std::to_string(i) + "]");
  }
  return expanded;
}

const DatarefSource* datarefOf(const FieldSpec& field, SimulatorVersion version) {
  const auto fits = [version](const DatarefSource& source) {
    return source.path != nullptr && source.versions.has(version);
  };
  const auto found = std::find_if(field.datarefs.begin(), field.datarefs.end(), fits);
  return found == field.datarefs.end() ? nullptr : &*found;
}

bool isRowKnown(const FieldSpec& field, SimulatorVersion version) {
  constexpr int kZuluSlot = 5, kLocalSlot = 6;
  const RowSource& row = field.row;
  switch (row.row11) {
    case 1:
      return !version.is(Otherwise::kRow1Hours) || (row.slot11 != kZuluSlot && row.slot11 != kLocalSlot);
    case 16:
      return !version.is(Otherwise::kRow16);
    case 20:
      return !version.is(Otherwise::kRow20);
    case 28:
      return !version.is(Otherwise::kRow28Unit);
    case 115:
      return !version.is(Otherwise::kRow115Bits);
    case 116:
    case 117:
      return !version.is(Otherwise::kRow116Modes);
    default:
      return row.row11 >= 0;
  }
}

std::vector<DatarefRequest> datarefRequests(FieldGroup group, Transport transport, SimulatorVersion version,
                                            int engines) {
  std::vector<DatarefRequest> requests;
  for (const FieldSpec& field : fieldTable()) {
    if (field.group != group || field.store == nullptr) continue;
    if (transport == Transport::kData && isRowKnown(field, version)) continue;
    const DatarefSource* const source = datarefOf(field, version);
    if (source == nullptr) continue;
    const std::vector<std::string> paths = expandDatarefPath(source->path, field.count);
    const int wanted = field.per_engine ? std::min(engines, field.count) : field.count;
    for (int i = 0; i < std::min(wanted, static_cast<int>(paths.size())); ++i) {
      requests.push_back({paths[static_cast<std::size_t>(i)], &field, i});
    }
  }
  return requests;
}

std::vector<std::int32_t> dataRows(const std::vector<FieldGroup>& groups, SimulatorVersion version) {
  std::vector<std::int32_t> rows;
  for (const FieldSpec& field : fieldTable()) {
    if (field.store == nullptr || std::find(groups.begin(), groups.end(), field.group) == groups.end()) continue;
    if (!isRowKnown(field, version)) continue;
    if (!version.is12() && field.row.row11 >= 0) rows.push_back(field.row.row11);
    if (!version.is11() && field.row.row12 >= 0) rows.push_back(field.row.row12);
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

}  // namespace xplane_bridge::core
