#pragma once

/// @file
/// The one table that knows where every field of every state message comes from: dataref or DATA row and slot, for
/// X-Plane 11 and 12, with units, factors and signs. Its lines are those of lib/core/state/sources.txt; nothing else
/// names a dataref of a state field or a row number. docs/fields.md is made from it
/// (tests/cpp/support/field_table_doc.cpp).

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/state/field_groups.hpp"
#include "xplane_bridge/core/state/field_store.hpp"

namespace xplane_bridge::core {

enum class Transport : std::uint8_t { kRref, kData };

/// wire value * factor + offset = SI value.
struct Conversion {
  const char* wire_unit = "";
  double factor = 1.0;
  double offset = 0.0;
};

/// A dataref, or several: `{a,b}` is expanded as by a shell, leftmost slowest; `[*]` is every element of the field.
struct DatarefSource {
  const char* path = nullptr;  ///< null: no dataref
  Conversion conversion{};
  VersionRange versions{};  ///< that have it, and are to be asked for it
};

/// Slots of a DATA row: elements follow each other.
struct RowSource {
  int row11 = -1;  ///< -1: no row carries it
  int slot11 = 0;
  int row12 = -1;
  int slot12 = 0;
  Conversion conversion11{};
  Conversion conversion12{};
  int count = 0;              ///< elements carried
  bool bitfield = false;      ///< one slot for all elements: element i is bit i of the number in it
  bool may_be_blank = false;  ///< -999 in this slot means unused (it is a value in all others)
};

/// No field has more elements.
inline constexpr int kMaxFieldElements = 16;

/// One line of the table.
struct FieldSpec {
  FieldGroup group = FieldGroup::kFlight;
  const char* field = "";                   ///< name in the message, or of the input that fields are computed from
  int count = 1;                            ///< elements
  const char* unit = "";                    ///< of the stored value
  std::uint32_t valid = 0;                  ///< bit of the message's `valid` it counts for; 0: none by itself
  FieldStore store = nullptr;               ///< null: computed (remark says how)
  std::array<DatarefSource, 2> datarefs{};  ///< of different versions, at most one of which fits
  RowSource row{};
  const char* remark = "";       ///< [? id] marks what only a live simulator can settle
  bool per_engine = false;       ///< elements at or beyond the engine count are not known; without it, a row's all are
  bool is_engine_count = false;  ///< is that count; comes before the fields it bounds
};

/// All lines, in the messages' order.
const std::vector<FieldSpec>& fieldTable();

/// Where this version has the field; null: in no dataref.
const DatarefSource* datarefOf(const FieldSpec& field, SimulatorVersion version);

/// Whether a row carries the field, and what that row holds is known of this X-Plane.
bool isRowKnown(const FieldSpec& field, SimulatorVersion version);

/// One dataref element to be asked for.
struct DatarefRequest {
  std::string path;
  const FieldSpec* field = nullptr;
  int element = 0;
};

/// What to ask for, in index order: position in the list is the index to give X-Plane.
/// @param transport with kData only what no known row carries
/// @param version while unknown, fields whose source differs between versions are left out
/// @param engines elements asked for of fields by engine; X-Plane answers all 8, few aircraft have them
std::vector<DatarefRequest> datarefRequests(FieldGroup group, Transport transport, SimulatorVersion version,
                                            int engines = 8);

/// DATA rows that carry fields of these groups, ascending, each once. All rows of every version when it is unknown.
std::vector<std::int32_t> dataRows(const std::vector<FieldGroup>& groups, SimulatorVersion version);

/// Expands `{a,b}` and `[*]`. @param count elements of the field
std::vector<std::string> expandDatarefPath(std::string_view pattern, int count);

}  // namespace xplane_bridge::core
