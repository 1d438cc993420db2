#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "xplane_bridge/core/state/clock_filter.hpp"
#include "xplane_bridge/core/state/flight_computation.hpp"
#include "xplane_bridge/core/state/position_check.hpp"
#include "xplane_bridge/core/state/state_decoder.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

namespace xplane_bridge::core {

/// Where the position shall come from.
enum class PositionMode : std::uint8_t {
  kAuto,     ///< scenery coordinates on the sphere, checked against RPOS; RPOS where the check fails
  kLocal,    ///< scenery coordinates, whatever the check says
  kRpos,     ///< RPOS, moved to the frame's time along the velocity
  kXpc,      ///< X-Plane Connect, moved likewise
  kFloat32,  ///< float32 latitude and longitude
};

/// Datagrams of the flight group in, one FlightState a simulator frame out: decodes, computes, stamps, finds resets.
///
/// Transport::kRref: feed onRref() with the replies to requests(). Transport::kData: feed onData(), and onRref() with
/// the replies to requests(), which then holds only what no row carries. In both: onRpos(), onXpc() as they come.
///
/// Allocates only in the constructor, setVersion() and reset(). One thread calls, or the caller locks.
class FlightStateAssembler {
 public:
  struct Options {
    Transport transport = Transport::kRref;
    SimulatorVersion version;
    int rate = defaultRate(FieldGroup::kFlight);  ///< [1/s] of the requests
    PositionMode position = PositionMode::kAuto;
    AttitudeReference row_attitude_reference = kDefaultRowAttitudeReference;
    double max_supplement_age = 1.0;          ///< kData: values from RREF older than this are unknown [s]
    double max_external_position_age = 0.25;  ///< RPOS and X-Plane Connect positions older than this are not used [s]
    double jump_distance = 100.0;             ///< off the predicted position by more: a reset [m]
    ClockFilter::Options clock;
  };

  struct Counters {
    std::uint64_t states = 0;
    std::uint64_t duplicates = 0;
    std::uint64_t out_of_order = 0;
    std::uint64_t without_time = 0;   ///< datagrams without simulator time (kData: row 1 missing)
    std::uint64_t jumps = 0;          ///< resets found by position
    std::uint64_t origin_shifts = 0;  ///< scenery origin moved; not a reset
  };

  explicit FlightStateAssembler(const Options& options);

  /// Datarefs to ask for, at every frame; the position is the index.
  const std::vector<DatarefRequest>& requests() const { return decoder_.requests(); }
  /// DATA rows needed.
  const std::vector<std::int32_t>& rows() const { return decoder_.rows(); }
  /// RPOS is wanted: for the check, or as the source.
  bool wantsRpos() const;

  /// The version became known or changed: requests() and rows() change with it.
  void setVersion(SimulatorVersion version);
  SimulatorVersion version() const { return options_.version; }

  /// @return the state of a completed frame, valid until the next call; null when none was completed or it is to be
  /// dropped
  const FlightState* onRref(const RrefView& datagram, std::int64_t receive_ns);
  /// One DATA datagram is one sample; rows of older datagrams do not enter it. Other than with kData: null.
  const FlightState* onData(const DataView& datagram, std::int64_t receive_ns);
  void onRpos(const Rpos& position, std::int64_t receive_ns);
  void onXpc(const XpcPosition& position, std::int64_t receive_ns);

  /// Sets the origin of `map` and raises position_epoch. Before the first call the first valid position becomes the
  /// origin.
  void setMapOrigin(const GeoPoint& origin);
  /// Empty before the first valid position.
  const std::optional<TangentFrame>& map() const { return map_; }
  std::uint32_t positionEpoch() const { return position_epoch_; }

  /// The caller knows of a jump (aircraft loaded, link came up anew): the next state starts a new epoch.
  void raiseEpoch();
  /// The subscription starts anew (link lost, X-Plane restarted): forgets what was learnt about silent datarefs too.
  void reset();

  /// The next state is the first one: time and counting begin anew, what was learnt of datarefs and position stays.
  void restart();

  const ClockFilter& clock() const { return clock_; }
  const PositionCheck& positionCheck() const { return position_check_; }
  const RrefFrameAssembler& frames() const { return *frames_; }
  const FlightInputs& inputs() const { return inputs_; }
  /// The last sample held nothing but zeros: no flight is loaded.
  bool noFlight() const { return no_flight_; }
  const Counters& counters() const { return counters_; }

 private:
  struct ExternalPosition {
    GeoPoint place;
    std::int64_t receive_ns = 0;
    bool known = false;
  };

  std::unique_ptr<RrefFrameAssembler> makeFrames() const;
  const std::vector<float>& unknown(std::size_t size);
  const FlightState* assemble(std::int64_t receive_ns, AttitudeReference attitude_reference);
  PositionFix choosePosition(std::int64_t receive_ns);
  PositionFix fromExternalPosition(const ExternalPosition& position, PositionSource source,
                                   std::int64_t receive_ns) const;
  bool jumped(const FlightState& state) const;
  void noteOriginShift();

  Options options_;
  StateDecoder decoder_;
  std::unique_ptr<RrefFrameAssembler> frames_;
  std::vector<float> unknown_;
  RowStore row_store_;
  ClockFilter clock_;
  PositionCheck position_check_;
  std::optional<TangentFrame> map_;
  std::uint32_t position_epoch_ = 0;
  ExternalPosition rpos_;
  ExternalPosition xpc_;
  FlightInputs inputs_;
  FlightState state_;
  bool has_previous_ = false;  ///< state_ holds a position of the current epoch
  bool no_flight_ = false;
  double last_origin_latitude_ = kNaN;
  double last_origin_longitude_ = kNaN;
  std::uint32_t frame_count_ = 0;
  Counters counters_;
};

/// Samples of one mission group. With kRref: add() the datagrams of the group's socket and assemble() when it says so.
/// With kData: assemble() at the group's rate from the rows, add() what no row carries.
template <typename State>
class MissionAssembler {
 public:
  struct Options {
    Transport transport = Transport::kRref;
    SimulatorVersion version;
    int rate = defaultRate(State::kGroup);  ///< [1/s]
    int engines = kMaxEngines;              ///< of which values are asked for
    double max_age = 1.5;                   ///< older values are unknown [s], at least two periods
  };

  explicit MissionAssembler(const Options& options);

  const std::vector<DatarefRequest>& requests() const { return decoder_.requests(); }
  const std::vector<std::int32_t>& rows() const { return decoder_.rows(); }
  const RrefFrameAssembler& frames() const { return frames_; }

  /// @return true when the datagram completed a sample
  bool add(const RrefView& datagram, std::int64_t receive_ns) { return frames_.add(datagram, receive_ns); }

  /// @param rows null with kRref
  /// @param now_ns host time, against which ages are judged; also the stamp where the simulator's time is not known
  State assemble(const RowStore* rows, std::int64_t now_ns, const ClockFilter& clock) const;

  void reset() { frames_.reset(); }

 private:
  Options options_;
  GroupDecoder<State> decoder_;
  RrefFrameAssembler frames_;
  std::vector<float> unknown_;  ///< as many NaN as there are requests
};

extern template class MissionAssembler<EngineStates>;
extern template class MissionAssembler<SurfaceStates>;
extern template class MissionAssembler<ControlStates>;
extern template class MissionAssembler<ElectricalState>;
extern template class MissionAssembler<AutopilotState>;
extern template class MissionAssembler<WarningState>;
extern template class MissionAssembler<FuelState>;
extern template class MissionAssembler<SimStatus>;
extern template class MissionAssembler<NavigationState>;
extern template class MissionAssembler<InstrumentState>;
extern template class MissionAssembler<EnvironmentState>;

}  // namespace xplane_bridge::core
