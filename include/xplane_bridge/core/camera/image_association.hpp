#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <optional>

#include "xplane_bridge/core/base/message_constants.hpp"

namespace xplane_bridge::core {

/// Which simulator frame does a picture show, and which received flight state belongs to that frame?
///
/// Everything is decided on the simulator's own time axis. The caller turns the moment a window changed (minus the
/// display delay) into simulator time with its ClockFilter; here that moment is matched to the nearest simulator frame
/// that was heard, and that frame to the flight state carrying the same `sim_time`. A state is a received one, never a
/// mixture, as long as states arrive for every frame; only when their rate is below the frame rate is the state of the
/// frame interpolated between its neighbours, and that is flagged. Nothing is ever interpolated across a pause, a
/// reset, an epoch, a new origin or a gap.
///
/// No clock, no thread, no ROS: one thread calls, or the caller locks.

/// One simulator frame heard on the capture host's own subscription.
struct SimFrame {
  double sim_time = 0.0;      ///< [s] unwrapped simulator time, the ClockFilter's axis
  float sim_time_raw = 0.0F;  ///< [s] the float32 as received: the pairing key
  double frame_period = 0.0;  ///< [s] length of the frame as X-Plane reports it, 0 = unknown
  bool paused = false;        ///< paused or in replay
  std::uint32_t epoch = 0;    ///< the ClockFilter's epoch
};

/// What the association needs of a FlightState; the message itself stays with the caller, under `id`.
struct StateKey {
  std::uint64_t id = 0;       ///< caller's handle, strictly increasing
  float sim_time_raw = 0.0F;  ///< [s] FlightState.sim_time; NaN = the state carries none
  std::int64_t stamp_ns = 0;  ///< [ns] FlightState.header.stamp (its publisher's clock)
  std::uint32_t epoch = 0;    ///< FlightState.epoch
  bool paused = false;
  std::uint32_t position_epoch = 0;  ///< FlightState.position_epoch
};

/// When the picture appeared.
struct ImageMoment {
  std::optional<double>
      sim_time;                   ///< [s] unwrapped simulator time of (change - display delay); empty: clock not fitted
  double uncertainty = 0.0;       ///< [s] 1-sigma of that mapping, as the ClockFilter states it
  std::uint32_t epoch = 0;        ///< the ClockFilter's epoch of that mapping
  std::int64_t host_time_ns = 0;  ///< [ns] (change - display delay) on the capture host's clock
  /// [s] raw simulator time at which the simulator stood at that moment, paused; empty: it flew, or nothing is known
  std::optional<float> paused_at;
  /// [s] raw simulator time of the frame shown, where the picture's source knows it: then no clock decides
  std::optional<float> frame_key;
};

/// How a state was found for a picture.
enum class PairingMethod : std::uint8_t {
  kNone,          ///< no state: none received near enough, or never across the discontinuity between
  kFrame,         ///< the state received for the very frame the picture shows
  kNearestFrame,  ///< that frame's state was not received; the nearest one was, at most `max_state_offset` away
  kInterpolated,  ///< states come slower than frames: interpolated between `id` and `id_after`
  kStamp,         ///< no simulator clock here: nearest by the two hosts' clocks (only as good as their agreement)
  kPaused,        ///< simulator paused: the newest state of the time at which it stood
};

/// Answer for one picture.
struct Association {
  PairingMethod method = PairingMethod::kNone;
  bool pending = false;        ///< a better answer may still arrive: ask again, until the deadline
  std::uint64_t id = 0;        ///< state (the earlier of the two when interpolated)
  std::uint64_t id_after = 0;  ///< later state when interpolated, else equal to `id`
  double fraction = 0.0;       ///< [0, 1) way from `id` to `id_after` in simulator time
  bool frame_known = false;    ///< the three following fields are meaningful
  double frame_sim_time =
      0.0;                    ///< [s] simulator time of the frame shown, in the raw float32's numbers (kept in double)
  double frame_offset = 0.0;  ///< [s] moment - frame: jitter of the display plus the error of the display delay
  double state_offset = 0.0;  ///< [s] simulator time of the state - simulator time of the frame; 0 when interpolated
  bool frame_inferred = false;  ///< the frame itself was not heard (datagram lost): its state's time, or put in evenly
  bool at_edge = false;         ///< the frame lies at a pause, reset, epoch or gap
  double frame_period = 0.0;    ///< [s] simulator time of one frame, 0 = unknown
  bool ambiguous = false;       ///< the moment lies nearer to the border between two frames than its uncertainty
};

/// Running totals since construction.
struct AssociationCounters {
  std::uint64_t images = 0;         ///< final answers given
  std::uint64_t by_frame = 0;       ///< kFrame
  std::uint64_t by_nearest = 0;     ///< kNearestFrame
  std::uint64_t interpolated = 0;   ///< kInterpolated
  std::uint64_t by_stamp = 0;       ///< kStamp
  std::uint64_t paused = 0;         ///< kPaused
  std::uint64_t without_state = 0;  ///< kNone
  std::uint64_t ambiguous = 0;
  std::uint64_t frames_inferred = 0;
};

struct ImageAssociatorOptions {
  double history = 5.0;            ///< [s] how far back frames and states are kept
  double max_gap = 0.5;            ///< [s] a longer silence between two frames or states is a discontinuity
  double max_interpolation = 0.3;  ///< [s] widest pair of states that is interpolated between
  double max_state_offset = 0.1;   ///< [s] farthest a nearest state may be from the frame
};

/// Matches pictures to simulator frames and flight states. Not thread safe.
class ImageAssociator {
 public:
  /// @throws std::invalid_argument when an option is not positive.
  explicit ImageAssociator(const ImageAssociatorOptions& options = {});

  /// Takes a heard frame, in the order of arrival. Late ones (sim_time not increasing within an epoch) are put in
  /// place or, when known, ignored; non-finite ones are ignored.
  void addFrame(const SimFrame& frame);

  /// Takes a received state, in the order of arrival. A raw simulator time that runs backwards (X-Plane restarted)
  /// discards what was there before.
  void addState(const StateKey& state);

  /// Finds frame and state for a picture.
  /// @param final false: `pending` may come back set; true: the deadline is over, answer with what is there. Counters
  ///              and the running display offset move only on answers that are not pending.
  [[nodiscard]] Association associate(const ImageMoment& moment, bool final);

  /// Handle of the oldest state still kept (states below it will never be named again); empty when none is kept.
  [[nodiscard]] std::optional<std::uint64_t> oldestStateId() const;

  /// [s] median spacing of the received states over that of the heard frames; 1 = a state for every frame, 0 = unknown.
  [[nodiscard]] double stateToFrameRatio() const;

  [[nodiscard]] const AssociationCounters& counters() const { return counters_; }

  /// Forgets frames, states and the running offset (a new simulator); counters stay.
  void clear();

 private:
  struct Frame {
    SimFrame frame;
    std::uint32_t segment;  // changes at every discontinuity
  };
  struct State {
    StateKey key;
    std::uint32_t segment;
    std::int64_t age_axis_ns;  // the stamps' time without the steps of a clock that is set
  };
  struct FrameChoice {
    double raw;     // [s] in the raw float32's numbers
    double offset;  // [s] moment - frame
    double period;  // [s]
    bool inferred;
    bool ambiguous;
    bool settled;
    bool at_edge;
  };

  [[nodiscard]] std::optional<FrameChoice> chooseFrame(const ImageMoment& moment) const;
  [[nodiscard]] FrameChoice keyedFrame(float key) const;
  [[nodiscard]] double framePeriod() const;
  [[nodiscard]] double statePeriod() const;
  [[nodiscard]] double runningOffset() const;
  void pairWithFrame(const FrameChoice& frame, bool paused, bool final, Association& answer) const;
  void pairPaused(float paused_at, bool final, Association& answer) const;
  void pairByStamp(const ImageMoment& moment, bool final, Association& answer) const;
  void settle(const Association& answer);

  ImageAssociatorOptions options_;
  std::deque<Frame> frames_;
  std::deque<State> states_;
  std::deque<double> offsets_;
  std::uint32_t frame_segment_ = 0;
  std::uint32_t state_segment_ = 0;
  AssociationCounters counters_;
};

/// The quality bits that follow from the pairing alone (STATE_MISSING, INTERPOLATED, OFF_FRAME, CLOCK_UNSURE, PAUSED,
/// EPOCH_EDGE, BORDERLINE); the capture's own bits are added by the caller.
[[nodiscard]] std::uint32_t pairingQuality(const ImageMoment& moment, const Association& answer);

/// Interpolates an angle the short way round.
/// @param from, to [deg], any branch
/// @param fraction 0 = from, 1 = to
/// @return [deg] in [lower, lower + 360)
[[nodiscard]] double interpolateAngleDeg(double from, double to, double fraction, double lower);

/// Spherical interpolation the short way round, normalised.
[[nodiscard]] Eigen::Quaterniond interpolateAttitude(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to,
                                                     double fraction);

}  // namespace xplane_bridge::core
