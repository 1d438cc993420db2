// Time from the bytes of a full DATA packet (139 rows) to SI values of every group, and from the bytes of an RREF
// datagram to a finished flight state. Prints one JSON object: the best of many batches, in microseconds.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <vector>

#include "xplane_bridge/core/state/state_assembler.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int32_t kPacketRows = 139;
constexpr int kBatches = 40;
constexpr int kBatchSize = 5000;

template <typename Work>
double microseconds(const Work& work) {
  using Clock = std::chrono::steady_clock;
  double best = 1e9;
  for (int batch = 0; batch < kBatches; ++batch) {
    const Clock::time_point start = Clock::now();
    for (int i = 0; i < kBatchSize; ++i) work();
    const std::chrono::duration<double, std::micro> elapsed = Clock::now() - start;
    best = std::min(best, elapsed.count() / kBatchSize);
  }
  return best;
}

std::vector<std::uint8_t> fullPacket() {
  std::vector<DataRow> rows(kPacketRows);
  for (std::int32_t i = 0; i < kPacketRows; ++i) {
    rows[static_cast<std::size_t>(i)].index = i;
    rows[static_cast<std::size_t>(i)].values.fill(0.25F * static_cast<float>(i + 1));
  }
  std::vector<std::uint8_t> bytes(kMaxDataSize);
  bytes.resize(*encodeData(ByteSpan(bytes), rows.data(), rows.size()));
  return bytes;
}

template <typename State>
struct Group {
  GroupDecoder<State> decoder{Transport::kData, kXPlane11};
  std::vector<float> unknown = std::vector<float>(decoder.requests().size(), kNaNf);
  State state;

  void decode(const RowStore& rows) { decoder.decode(unknown, &rows, 0, &state); }
};

double decodePacket() {
  const std::vector<std::uint8_t> packet = fullPacket();
  RowStore rows;
  Group<FlightInputs> flight;
  Group<EngineStates> engines;
  engines.unknown.assign(engines.unknown.size(), static_cast<float>(kMaxEngines));  // all of them are there
  Group<SurfaceStates> surfaces;
  Group<ControlStates> controls;
  Group<ElectricalState> electrical;
  Group<AutopilotState> autopilot;
  Group<WarningState> warnings;
  Group<FuelState> fuel;
  Group<SimStatus> sim;
  Group<NavigationState> navigation;
  Group<InstrumentState> instruments;
  Group<EnvironmentState> environment;
  return microseconds([&] {
    rows.update(*decodeData(packet), 1);
    flight.decode(rows);
    engines.decode(rows);
    surfaces.decode(rows);
    controls.decode(rows);
    electrical.decode(rows);
    autopilot.decode(rows);
    warnings.decode(rows);
    fuel.decode(rows);
    sim.decode(rows);
    navigation.decode(rows);
    instruments.decode(rows);
    environment.decode(rows);
  });
}

double assembleFlightState() {
  FlightStateAssembler::Options options;
  options.version = kXPlane11;
  FlightStateAssembler assembler(options);
  std::vector<std::uint8_t> datagram = {'R', 'R', 'E', 'F', ','};
  std::size_t time_at = 0;
  for (std::size_t i = 0; i < assembler.requests().size(); ++i) {
    if (i == 0) time_at = datagram.size() + 4;  // the table begins with simulator time
    datagram.resize(datagram.size() + kRrefPairSize);
    storeLittleEndian(static_cast<std::int32_t>(i), datagram.data() + datagram.size() - 8);
    storeLittleEndian(0.5F, datagram.data() + datagram.size() - 4);
  }
  double sim_time = 1000.0;
  std::int64_t now = 0;
  return microseconds([&] {
    sim_time += 0.01;
    now += 10'000'000;
    storeLittleEndian(static_cast<float>(sim_time), datagram.data() + time_at);
    assembler.onRref(*decodeRref(datagram), now);
  });
}

}  // namespace
}  // namespace xplane_bridge::core

int main() {
  std::printf("{\"decode_139_rows_us\": %.3f, \"rref_to_flight_state_us\": %.3f}\n",
              xplane_bridge::core::decodePacket(), xplane_bridge::core::assembleFlightState());
  return 0;
}
