#include "xplane_bridge/core/state_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace xplane_bridge::core {
namespace {

/// A bit for each of 8 engines; larger numbers are no bit fields, and must not reach the cast.
constexpr float kLargestBitfield = 255.0F;

bool isMarkedUnused(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits == kUnusedSlotBits;
}

struct ResolvedRow {
  std::int32_t row = -1;
  int slot = 0;
  Conversion conversion;
};

ResolvedRow resolve(const RowSource& source, XPlaneVersion version) {
  const bool differs = source.row12 != source.row11 || source.slot12 != source.slot11 ||
                       source.conversion12.factor != source.conversion11.factor ||
                       source.conversion12.offset != source.conversion11.offset;
  if (differs && version == XPlaneVersion::kUnknown) return {};
  if (version == XPlaneVersion::k12) return {source.row12, source.slot12, source.conversion12};
  return {source.row11, source.slot11, source.conversion11};
}

}  // namespace

void RowStore::update(const DataView& data, std::int64_t receive_ns) {
  for (std::size_t i = 0; i < data.size(); ++i) {
    const DataRowView row = data[i];
    if (!row.hasKnownIndex()) continue;
    const auto index = static_cast<std::size_t>(row.index());
    times_[index] = receive_ns;
    for (std::size_t slot = 0; slot < kDataSlots; ++slot) values_[index * kDataSlots + slot] = row.value(slot);
  }
}

void RowStore::clear() { times_.fill(kNever); }

StateDecoder::StateDecoder(FieldGroup group, Transport transport, XPlaneVersion version, int engines)
    : group_(group), requests_(datarefRequests(group, transport, version, engines)) {
  std::size_t next_request = 0;
  for (const FieldSpec& field : fieldTable()) {
    if (field.group != group) continue;
    all_bits_ |= field.valid;
    if (field.store == nullptr) continue;
    FieldPlan plan{&field, steps_.size(), 0};
    const ResolvedRow row = transport == Transport::kData ? resolve(field.row, version) : ResolvedRow{};
    if (row.row >= 0) {
      for (int i = 0; i < field.row.count; ++i) {
        const int slot = field.row.bitfield ? row.slot : row.slot + i * field.row.stride;
        steps_.push_back({i, true, field.row.bitfield, field.row.may_be_blank,
                          row.row * static_cast<std::int32_t>(kDataSlots) + slot, row.conversion.factor,
                          row.conversion.offset});
      }
    }
    const bool newer = field.dataref.path12 != nullptr && version == XPlaneVersion::k12;
    const Conversion& conversion = newer ? field.dataref.conversion12 : field.dataref.conversion;
    // Requests are in the table's order, so those of this field are next.
    while (next_request < requests_.size() && requests_[next_request].field == &field) {
      steps_.push_back({requests_[next_request].element, false, false, false, static_cast<std::int32_t>(next_request),
                        conversion.factor, conversion.offset});
      ++next_request;
    }
    plan.count = steps_.size() - plan.first;
    plans_.push_back(plan);
  }
  if (transport == Transport::kData) rows_ = dataRows({group}, version);
}

double StateDecoder::read(const Step& step, const std::vector<float>& dataref_values, const RowStore* rows,
                          std::int64_t oldest_ns) const {
  if (!step.from_row) {
    return static_cast<double>(dataref_values[static_cast<std::size_t>(step.source)]) * step.factor + step.offset;
  }
  const std::int32_t row = step.source / static_cast<std::int32_t>(kDataSlots);
  if (rows == nullptr || !rows->has(row) || rows->receiveTime(row) < oldest_ns) return kNaN;
  const float value = rows->value(row, static_cast<std::size_t>(step.source) % kDataSlots);
  if (!std::isfinite(value) || (step.may_be_blank && isMarkedUnused(value))) return kNaN;
  if (step.bitfield)
    return (static_cast<std::uint32_t>(std::clamp(value, 0.0F, kLargestBitfield)) >> step.element) & 1U;
  return static_cast<double>(value) * step.factor + step.offset;
}

std::uint32_t StateDecoder::decode(const std::vector<float>& dataref_values, const RowStore* rows,
                                   std::int64_t oldest_ns, void* target) const {
  std::uint32_t known_bits = all_bits_;
  int engines = kMaxEngines;
  for (const FieldPlan& plan : plans_) {
    const FieldSpec& field = *plan.field;
    std::size_t known = 0;
    std::size_t wanted = 0;
    for (std::size_t i = plan.first; i < plan.first + plan.count; ++i) {
      const Step& step = steps_[i];
      if (field.per_engine && step.element >= engines) continue;
      ++wanted;
      const double value = read(step, dataref_values, rows, oldest_ns);
      if (!std::isfinite(value)) continue;
      ++known;
      field.store(target, step.element, value);
      if (field.is_engine_count) engines = static_cast<int>(std::clamp(std::lround(value), 0L, long{kMaxEngines}));
    }
    if (field.is_engine_count && known == 0) engines = 0;
    // Of an array by engine every engine must be known; other arrays may be longer than what the aircraft has.
    const bool complete = field.per_engine ? (known > 0 && known == wanted) : known > 0;
    if (!complete) known_bits &= ~field.valid;
  }
  return known_bits;
}

void computeEquivalentDeflections(SurfaceStates& s) {
  // A wing without the surface always shows 0 on both sides; it must not dilute the mean. At neutral all show 0, and so
  // does the mean then.
  const auto mean = [](double sum, int count) { return count > 0 ? static_cast<float>(sum / count) : 0.0F; };
  if ((s.valid & SurfaceStates::kValidAileron1) != 0) {
    double sum = 0.0;
    int wings = 0;
    const bool second = (s.valid & SurfaceStates::kValidAileron2) != 0;
    for (std::size_t left = 0; left < s.aileron1.size(); left += 2) {
      for (const SurfaceStates::PerWing* surface : {&s.aileron1, &s.aileron2}) {
        if (surface == &s.aileron2 && !second) continue;
        const float l = (*surface)[left], r = (*surface)[left + 1];
        if (!std::isfinite(l) || !std::isfinite(r) || (l == 0.0F && r == 0.0F)) continue;
        sum += (static_cast<double>(l) - static_cast<double>(r)) / 2.0;
        ++wings;
      }
    }
    s.delta_aileron = mean(sum, wings);
  }
  const auto meanOfMoving = [&mean](const std::array<float, 4>& surfaces) {
    double sum = 0.0;
    int count = 0;
    for (const float d : surfaces) {
      if (!std::isfinite(d) || d == 0.0F) continue;
      sum += static_cast<double>(d);
      ++count;
    }
    return mean(sum, count);
  };
  if ((s.valid & SurfaceStates::kValidElevator) != 0) s.delta_elevator = meanOfMoving(s.elevator);
  if ((s.valid & SurfaceStates::kValidRudder) != 0) s.delta_rudder = -meanOfMoving(s.rudder);
}

}  // namespace xplane_bridge::core
