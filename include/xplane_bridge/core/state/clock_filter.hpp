#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace xplane_bridge::core {

/// Receive times that a step of the wall clock does not reach.
///
/// The kernel stamps datagrams with the wall clock (SO_TIMESTAMPNS). This carries that stamp over to the steady clock
/// and adds the offset between the two, so that results are wall-clock times that run evenly. The offset follows a real
/// step of the wall clock once it has persisted for `kReadings` readings; a reading delayed by the scheduler does not
/// count. One thread reads; any may ask for the offset.
class ReceiveClock {
 public:
  static constexpr int kReadings = 32;
  static constexpr std::int64_t kStepThresholdNs = 1000000;

  /// Takes note of how the clocks stand to each other. @param now_wall_ns, now_steady_ns [ns] read in this order
  void read(std::int64_t now_wall_ns, std::int64_t now_steady_ns);
  /// [ns] from the steady clock to the evenly running wall clock; 0 before the first reading
  std::int64_t offsetNs() const { return offset_ns_; }
  /// The same as read(), and the result for a datagram.
  /// @param kernel_wall_ns the datagram's receive stamp
  /// @param now_wall_ns, now_steady_ns both clocks read after the datagram was taken, wall clock first
  /// @return receive time on the evenly running wall clock [ns]
  std::int64_t toHostTime(std::int64_t kernel_wall_ns, std::int64_t now_wall_ns, std::int64_t now_steady_ns);
  /// Steps of the wall clock followed so far.
  std::uint32_t steps() const { return steps_; }

 private:
  bool started_ = false;
  std::atomic<std::int64_t> offset_ns_{0};
  std::int64_t best_offset_ns_ = 0;  ///< largest of the current batch: delays between the two readings only shrink it
  int readings_ = 0;
  std::uint32_t steps_ = 0;
};

/// One received sample of the simulator's clock.
struct ClockSample {
  std::int64_t receive_ns = 0;  ///< host receive time [ns]
  float sim_time = 0.0F;        ///< simulator running time, raw float32 as received [s]
  float frame_period = 0.0F;    ///< simulator time of one frame [s]; <= 0 or NaN: unknown
  float acceleration = 1.0F;    ///< of time: so many times what X-Plane simulates of itself is in `frame_period` [-]
  bool paused = false;
  bool replay = false;
};

/// @param time_ratio_requested sim/time/sim_speed [-]; NaN: not received
/// @return ClockSample::acceleration
inline float timeAcceleration(float time_ratio_requested) {
  return time_ratio_requested > 1.0F ? time_ratio_requested : 1.0F;
}

/// What a sample did to the clock.
enum class ClockEvent : std::uint8_t {
  kNone = 0,
  kFirst,          ///< first sample ever
  kDuplicate,      ///< same frame again: to be dropped
  kOutOfOrder,     ///< older than the newest frame: to be dropped
  kPaused,         ///< simulator time stands since this sample
  kResumed,        ///< runs again; the fit starts anew
  kGap,            ///< nothing was heard for a while and the old fit does not hold; the fit starts anew
  kRateChanged,    ///< simulator time runs at another rate (frame rate too low, time acceleration); the fit starts anew
  kSlipped,        ///< simulator time stood still for a moment, as in a frame longer than X-Plane simulates
  kReset,          ///< simulator time jumped, or the caller reported a jump: new epoch
  kReplayStarted,  ///< new epoch
  kReplayEnded,    ///< new epoch
  kHostClockStep,  ///< receive time went backwards: new epoch
};
const char* toString(ClockEvent event);

struct ClockEstimate {
  bool usable = false;        ///< false: duplicate or out of order, to be dropped
  std::int64_t stamp_ns = 0;  ///< host time of the simulator frame; strictly increasing within an epoch [ns]
  double sim_time = 0.0;      ///< unwrapped simulator time, no float32 steps; starts at the raw value of each epoch [s]
  double uncertainty = 0.0;   ///< half width around stamp_ns, without the smallest delay, which cannot be measured [s]
  std::uint32_t epoch = 0;
  ClockEvent event = ClockEvent::kNone;
};

/// Maps simulator time to host time and back.
///
/// Datagrams are only ever late, never early: the line host = offset + slope * sim that lies below all samples of a
/// short window and closest to them is the one with the smallest delay. Samples are thinned to the least delayed one of
/// each bucket, so an update costs the same at any rate. Simulator time arrives as float32 (steps of 3.9 ms after nine
/// hours); it is rebuilt from the frame periods and kept within two steps of the raw value.
///
/// A stutter of X-Plane is a slip: the frame lasts longer than the simulator flies in it, so that simulator time stays
/// behind by what was left out. The line moves by that much from this frame on; before it, times map as before.
///
/// Has no clock of its own and allocates nothing. One thread calls, or the caller locks.
class ClockFilter {
 public:
  struct Options {
    double window = 4.0;        ///< length of the fit [s]
    double min_span = 0.25;     ///< shortest span of samples that makes a fit; before, a stamp is the receive time [s]
    double gap = 0.5;           ///< silence after which a fit that no longer holds is given up [s]
    double rate_change = 0.02;  ///< every recent sample this much later than the fit: the rate has changed [s]
    double rate_change_after = 0.25;  ///< ... for this long [s]
    double slip = 0.004;  ///< samples evenly later than the fit by more than this: simulator time has stood still [s]
    double slip_after = 0.1;          ///< ... for this long [s]
    double slip_evenness = 0.002;     ///< ... within this [s]
    double longest_frame = 0.0495;    ///< frames of this much simulator time, without acceleration, may have lasted
                                      ///< longer: X-Plane simulates at most about 1/19.9 s; one that is late has
                                      ///< slipped at once [s]
    double backward_tolerance = 1.0;  ///< older samples within this are late datagrams, not a reset [s]
    double forward_jump = 2.0;        ///< simulator time ahead of `max_time_ratio` times host time by this: a reset [s]
    double max_time_ratio = 20.0;     ///< fastest time acceleration taken for real
    bool exact = false;  ///< receive times are the frames' own: nothing is fitted, stamps are receive times
    double unfitted_uncertainty = 0.02;  ///< said while there is no fit: one frame at a low rate [s]

    /// For samples that come at this rate [1/s], or at the frame rate where that is lower: at low rates the times above
    /// hold no, or too few, samples to judge by. Halves of a period, so that jitter does not change how many samples it
    /// takes. A slip takes one more than a change of rate: few samples of a rate that has changed may pass as evenly
    /// late, as they widen the fit by which that is judged.
    static Options atRate(int rate_hz) {
      constexpr double kSilentPeriods = 3.0, kLatePeriods = 2.5, kEvenPeriods = 3.5, kFitPeriods = 8.0;
      Options options;
      options.gap = std::max(options.gap, kSilentPeriods / rate_hz);
      options.rate_change_after = std::max(options.rate_change_after, kLatePeriods / rate_hz);
      options.slip_after = std::max(options.slip_after, kEvenPeriods / rate_hz);
      options.window = std::max(options.window, kFitPeriods / rate_hz);
      return options;
    }
  };

  ClockFilter() = default;
  explicit ClockFilter(const Options& options) : options_(options) {}

  ClockEstimate update(const ClockSample& sample);
  /// The caller saw a jump (aircraft placed elsewhere, other aircraft): the next sample starts a new epoch.
  void raiseEpoch() { raise_epoch_ = true; }
  /// Forgets the fit and the simulator time, as after a lost link; the next sample starts a new epoch.
  void reset();

  /// Unwrapped simulator time at a host time; empty while there is no fit or the simulator is paused.
  std::optional<double> simTime(std::int64_t host_ns) const;
  /// Host time of an unwrapped simulator time [ns]; empty as above.
  std::optional<std::int64_t> hostTime(double sim_time) const;
  /// Unwrapped time of a raw value that came by another way than update(), of the current epoch [s].
  double unwrap(float raw_sim_time) const {
    return static_cast<double>(raw_sim_time) + (sim_time_ - static_cast<double>(last_.sim_time));
  }
  bool fitted() const { return fitted_; }
  bool paused() const { return paused_; }
  /// Half width of the mapping [s], see ClockEstimate.
  double uncertainty() const;
  /// Simulator time over host time, slips included; NaN while there is no fit.
  double timeRatio() const;
  /// Whether a frame may have lasted longer on the host than it says: it is as long as X-Plane simulates at most.
  /// @param simulated simulator time of the frame [s]
  bool mayHaveLastedLonger(float simulated, float acceleration) const;
  /// Slips seen so far; simTime() of moments near the newest slip may have changed.
  std::uint32_t slips() const { return slip_count_; }
  std::uint32_t epoch() const { return epoch_; }
  /// Frames that X-Plane made between two samples, by simulator time against the frame period.
  std::uint64_t missedFrames() const { return missed_frames_; }

 private:
  /// Relative to the references, so that doubles keep nanoseconds.
  struct Point {
    double sim = 0.0;   ///< [s]
    double host = 0.0;  ///< [s]
  };
  /// Simulator time stood still between the frames `before` and `first`.
  struct Slip {
    double before = 0.0;       ///< simulator time of the last frame on the old line, relative [s]
    double host_border = 0.0;  ///< host time from which on the new line holds, relative [s]
    double length = 0.0;       ///< [s] of host time
  };
  /// Late samples in a row.
  struct LateRun {
    bool active = false;
    Point first;
    double before = 0.0;  ///< simulator time of the sample before `first`, relative [s]
    double least = 0.0;   ///< delay [s]
    double most = 0.0;
  };
  static constexpr std::size_t kBuckets = 32;
  static constexpr std::size_t kSlips = 64;
  static constexpr std::size_t kMinBuckets = 3;

  bool isForwardJump(const ClockSample& sample, double host_step) const;
  void startEpoch(const ClockSample& sample);
  void countMissed(const ClockSample& sample);
  void restartFit(const ClockSample& sample);
  void advanceSimTime(const ClockSample& sample);
  /// Gives up what of the fit no longer holds. @return kGap, kRateChanged or kNone.
  ClockEvent judgeDelay(const ClockSample& sample, double host_step);
  /// Whether simulator time has stood still before this sample or a few earlier ones; moves the line if so.
  bool judgeSlip(const ClockSample& sample, const Point& point);
  void slip(const Point& first, double before, double length);
  void dropBucketsBefore(double host);
  void addToFit(const Point& point);
  void fit();
  Point relative(const ClockSample& sample) const;
  double delay(const Point& point) const { return point.host - (offset_ + slope_ * point.sim); }
  const Point& bucket(std::size_t i) const { return buckets_[(first_ + i) % kBuckets]; }
  const Slip& newestSlip(std::size_t i) const { return slips_[(slip_count_ - 1 - i) % kSlips]; }
  std::int64_t stampOf(const ClockSample& sample);

  Options options_;

  bool started_ = false;
  bool raise_epoch_ = false;
  bool paused_ = false;
  bool replay_ = false;
  std::uint32_t epoch_ = 0;
  std::uint64_t missed_frames_ = 0;
  ClockSample last_;
  bool has_stamp_ = false;
  std::uint32_t stamp_epoch_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  int backward_samples_ = 0;
  double sim_time_ = 0.0;
  double sim_time_before_ = 0.0;  ///< of the sample before [s]
  double sim_time_step_ = 0.0;    ///< float32 step that sim_time_ shows, 0 when rebuilt from frame periods [s]

  std::int64_t host_reference_ns_ = 0;
  double sim_reference_ = 0.0;
  std::array<Point, kBuckets> buckets_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  double bucket_start_ = 0.0;
  bool fitted_ = false;
  double offset_ = 0.0;
  double slope_ = 1.0;
  double fit_spread_ = 0.0;  ///< twice the rms delay of the buckets [s]

  std::array<Slip, kSlips> slips_{};  ///< of this fit, a ring
  std::size_t slips_kept_ = 0;
  std::uint32_t slip_count_ = 0;
  LateRun late_run_;

  double late_since_ = 0.0;  ///< host time since which every sample has been late, relative [s]
  bool late_ = false;
};

}  // namespace xplane_bridge::core
