#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "xplane_bridge/core/base/limits.hpp"
#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/state/flight_computation.hpp"
#include "xplane_bridge/core/state/mission_state.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// The newest DATA rows by index: rows may be added, removed and reordered at any time.
class RowStore {
 public:
  static constexpr std::size_t kRows = static_cast<std::size_t>(kDataRowLimit);

  void update(const DataView& data, std::int64_t receive_ns);
  /// Receive time of the row [ns]; kNever when it never came.
  std::int64_t receiveTime(std::int32_t row) const { return times_[static_cast<std::size_t>(row)]; }
  bool has(std::int32_t row) const { return receiveTime(row) != kNever; }
  /// The 8 raw wire values of a row in 0..199.
  const float* values(std::int32_t row) const { return &values_[static_cast<std::size_t>(row) * kDataSlots]; }
  void clear();
  /// Rows are all that comes: datarefs that go with them, as the number of engines, are not waited for.
  void setOneWay(bool one_way) { one_way_ = one_way; }
  bool isOneWay() const { return one_way_; }

  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();

  RowStore() { clear(); }

 private:
  std::array<float, kRows * kDataSlots> values_{};
  std::array<std::int64_t, kRows> times_{};
  bool one_way_ = false;
};

/// Wire values of one group into its struct, in SI units, by a plan made once from the field table.
class StateDecoder {
 public:
  StateDecoder(FieldGroup group, Transport transport, SimulatorVersion version, int engines = kMaxEngines);

  FieldGroup group() const { return group_; }
  /// Datarefs to be asked for; the position is the index. With Transport::kData only what no row carries.
  const std::vector<DatarefRequest>& requests() const { return requests_; }
  /// DATA rows the group needs, ascending; empty with Transport::kRref.
  const std::vector<std::int32_t>& rows() const { return rows_; }

  /// Fills the group's struct; what is not known stays as it is (give a fresh struct).
  /// @param dataref_values requests().size() values, NaN where unknown
  /// @param rows null with Transport::kRref
  /// @param oldest_ns rows received before this are stale and count as unknown
  /// @param target the group's struct
  /// @return bits of the message's `valid` all of whose fields are known
  std::uint32_t decode(const std::vector<float>& dataref_values, const RowStore* rows, std::int64_t oldest_ns,
                       void* target) const;

 private:
  /// How one field is filled: its elements follow each other in a row or among the requests.
  struct Plan {
    const FieldSpec* field = nullptr;
    std::int32_t row = -1;  ///< -1: from datarefs
    std::size_t first = 0;  ///< slot, or index
    bool special = false;   ///< bit field or blanks: not plain numbers side by side
    int count = 0;          ///< 0: nothing carries it
    Conversion conversion;
    // Of the field, side by side with the rest: a decoder walks its plans for every frame.
    FieldStore store = nullptr;
    std::uint32_t valid = 0;
    bool per_engine = false;
    bool is_engine_count = false;
  };

  /// @return how many of the elements are known
  int convert(const Plan& plan, const float* wire, int count, double* values) const;

  FieldGroup group_;
  std::vector<DatarefRequest> requests_;
  std::vector<std::int32_t> rows_;
  std::vector<Plan> plans_;
  std::uint32_t all_bits_ = 0;
};

/// Typed front of StateDecoder.
template <typename State>
class GroupDecoder : public StateDecoder {
 public:
  GroupDecoder(Transport transport, SimulatorVersion version, int engines = kMaxEngines)
      : StateDecoder(State::kGroup, transport, version, engines) {}
};

/// EngineStates' temperatures as degrees Celsius: by its gauge_in_celsius, NaN where that is not known.
void computeCelsius(EngineStates& engines);
/// SurfaceStates' equivalent deflections from the surfaces by side.
void computeEquivalentDeflections(SurfaceStates& surfaces);

}  // namespace xplane_bridge::core
