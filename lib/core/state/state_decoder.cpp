#include "xplane_bridge/core/state/state_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>

namespace xplane_bridge::core {
namespace {

/// A bit for each of 8 engines; larger numbers are no bit fields, and must not reach the cast.
constexpr float kLargestBitfield = 255.0F;

bool isMarkedUnused(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits == kUnusedSlotBits;
}

double bit(float bits, int element) {
  return (static_cast<std::uint32_t>(std::clamp(bits, 0.0F, kLargestBitfield)) >> element) & 1U;
}

struct ResolvedRow {
  std::int32_t row = -1;
  int slot = 0;
  Conversion conversion;
};

ResolvedRow resolve(const FieldSpec& field, SimulatorVersion version) {
  if (!isRowKnown(field, version)) return {};
  const RowSource& source = field.row;
  const bool differs = source.row12 != source.row11 || source.slot12 != source.slot11 ||
                       source.conversion12.factor != source.conversion11.factor ||
                       source.conversion12.offset != source.conversion11.offset;
  if (differs && !version.known()) return {};
  if (version.is12()) return {source.row12, source.slot12, source.conversion12};
  return {source.row11, source.slot11, source.conversion11};
}

}  // namespace

void RowStore::update(const DataView& data, std::int64_t receive_ns) {
  for (std::size_t i = 0; i < data.size(); ++i) {
    const DataRowView row = data[i];
    if (!row.hasKnownIndex()) continue;
    const auto index = static_cast<std::size_t>(row.index());
    times_[index] = receive_ns;
    float* values = &values_[index * kDataSlots];
    for (std::size_t slot = 0; slot < kDataSlots; ++slot) values[slot] = row.value(slot);
  }
}

void RowStore::clear() { times_.fill(kNever); }

StateDecoder::StateDecoder(FieldGroup group, Transport transport, SimulatorVersion version, int engines)
    : group_(group), requests_(datarefRequests(group, transport, version, engines)) {
  std::size_t next_request = 0;
  for (const FieldSpec& field : fieldTable()) {
    if (field.group != group) continue;
    all_bits_ |= field.valid;
    if (field.store == nullptr) continue;
    Plan plan;
    plan.field = &field;
    plan.store = field.store;
    plan.valid = field.valid;
    plan.per_engine = field.per_engine;
    plan.is_engine_count = field.is_engine_count;
    const ResolvedRow row = transport == Transport::kData ? resolve(field, version) : ResolvedRow{};
    if (row.row >= 0) {
      plan.row = row.row;
      plan.first = static_cast<std::size_t>(row.slot);
      plan.special = field.row.bitfield || field.row.may_be_blank;
      plan.count = field.row.count;
      plan.conversion = row.conversion;
    } else {
      const DatarefSource* const source = datarefOf(field, version);
      if (source != nullptr) plan.conversion = source->conversion;
      // What this version does not have makes nothing else of the message invalid.
      if (source == nullptr && version.known()) plan.valid = 0;
      // Requests are in the table's order, so those of this field are next.
      plan.first = next_request;
      while (next_request < requests_.size() && requests_[next_request].field == &field) ++next_request;
      plan.count = static_cast<int>(next_request - plan.first);
    }
    plans_.push_back(plan);
  }
  if (transport == Transport::kData) rows_ = dataRows({group}, version);
}

int StateDecoder::convert(const Plan& plan, const float* wire, int count, double* values) const {
  const double factor = plan.conversion.factor, offset = plan.conversion.offset;
  int known = 0;
  if (!plan.special) {
    for (int element = 0; element < count; ++element) {
      const double value = static_cast<double>(wire[element]) * factor + offset;
      const bool finite = std::abs(value) <= std::numeric_limits<double>::max();  // also false for NaN
      values[element] = finite ? value : kNaN;
      known += finite ? 1 : 0;
    }
    return known;
  }
  const RowSource& row = plan.field->row;
  for (int element = 0; element < count; ++element, wire += row.bitfield ? 0 : 1) {
    values[element] = kNaN;
    if (!std::isfinite(*wire) || (row.may_be_blank && isMarkedUnused(*wire))) continue;
    values[element] = row.bitfield ? bit(*wire, element) : static_cast<double>(*wire) * factor + offset;
    ++known;
  }
  return known;
}

std::uint32_t StateDecoder::decode(const std::vector<float>& dataref_values, const RowStore* rows,
                                   std::int64_t oldest_ns, void* target) const {
  std::uint32_t known_bits = all_bits_;
  int engines = kMaxEngines;
  int engines_in_rows = kMaxEngines;  // one way a row shows them without their count, which is a dataref
  for (const Plan& plan : plans_) {
    const bool from_row = plan.row >= 0;
    const bool arrived =
        !from_row || (rows != nullptr && rows->has(plan.row) && rows->receiveTime(plan.row) >= oldest_ns);
    const int bound = !plan.per_engine ? plan.count : from_row ? engines_in_rows : engines;
    const int wanted = std::min(plan.count, bound);
    std::array<double, kMaxFieldElements> values;
    int known = 0;
    if (arrived && wanted > 0) {
      const float* wire = (from_row ? rows->values(plan.row) : dataref_values.data()) + plan.first;
      known = convert(plan, wire, wanted, values.data());
      plan.store(target, values.data(), wanted);
    }
    if (plan.is_engine_count) {
      const double count = known > 0 ? std::clamp(values[0], 0.0, static_cast<double>(kMaxEngines)) : 0.0;
      engines = static_cast<int>(count);
      const bool uncounted = known == 0 && rows != nullptr && rows->isOneWay();
      engines_in_rows = uncounted ? kMaxEngines : engines;
    }
    // Of an array by engine every engine must be known; other arrays may be longer than what the aircraft has.
    const bool complete = known > 0 && (!plan.per_engine || known == bound);
    if (!complete) known_bits &= ~plan.valid;
  }
  return known_bits;
}

void computeCelsius(EngineStates& s) {
  struct Gauge {
    std::array<float, kMaxEngines>* shown;
    std::uint32_t valid;
  };
  const Gauge gauges[] = {{&s.itt, EngineStates::kValidItt},
                          {&s.egt, EngineStates::kValidEgt},
                          {&s.cht, EngineStates::kValidCht},
                          {&s.oil_temperature, EngineStates::kValidOilTemperature}};
  for (std::size_t i = 0; i < std::size(gauges); ++i) {
    const float in_celsius = s.gauge_in_celsius[i];
    if (!std::isfinite(in_celsius)) {
      gauges[i].shown->fill(kNaNf);
      s.valid &= ~gauges[i].valid;
    } else if (in_celsius < 0.5F) {
      for (float& shown : *gauges[i].shown) shown = (shown - 32.0F) / 1.8F;
    }
  }
}

void computeEquivalentDeflections(SurfaceStates& s) {
  // A tail or wing without the surface always shows 0 on both sides; it must not dilute the mean. At neutral all show
  // 0, and so does the mean then.
  const auto mean = [](double sum, int count) { return count > 0 ? static_cast<float>(sum / count) : 0.0F; };
  if ((s.valid & SurfaceStates::kValidAileron1) != 0) {
    double sum = 0.0;
    int wings = 0;
    const bool second = (s.valid & SurfaceStates::kValidAileron2) != 0;
    for (std::size_t left = 0; left < s.aileron1.size(); left += 2) {
      for (const auto* surface : {&s.aileron1, &s.aileron2}) {
        if (surface == &s.aileron2 && !second) continue;
        const float l = (*surface)[left], r = (*surface)[left + 1];
        if (!std::isfinite(l) || !std::isfinite(r) || (l == 0.0F && r == 0.0F)) continue;
        sum += (static_cast<double>(l) - static_cast<double>(r)) / 2.0;
        ++wings;
      }
    }
    s.delta_aileron = mean(sum, wings);
  }
  if ((s.valid & SurfaceStates::kValidElevator) != 0) {
    double sum = 0.0;
    int pairs = 0;
    const auto add = [&sum, &pairs](const auto& surfaces) {
      for (std::size_t left = 0; left < surfaces.size(); left += 2) {
        const float l = surfaces[left], r = surfaces[left + 1];
        if (!std::isfinite(l) || !std::isfinite(r) || (l == 0.0F && r == 0.0F)) continue;
        sum += (static_cast<double>(l) + static_cast<double>(r)) / 2.0;
        ++pairs;
      }
    };
    add(s.elevator);
    if ((s.valid & SurfaceStates::kValidWingElevator1) != 0) add(s.wing_elevator1);
    if ((s.valid & SurfaceStates::kValidWingElevator2) != 0) add(s.wing_elevator2);
    s.delta_elevator = mean(sum, pairs);
  }
  if ((s.valid & SurfaceStates::kValidRudder) != 0) {
    double sum = 0.0;
    int count = 0;
    for (const float d : s.rudder) {  // each by itself: most aircraft have one fin, and show 0 for the other
      if (!std::isfinite(d) || d == 0.0F) continue;
      sum += static_cast<double>(d);
      ++count;
    }
    s.delta_rudder = -mean(sum, count);
  }
}

}  // namespace xplane_bridge::core
