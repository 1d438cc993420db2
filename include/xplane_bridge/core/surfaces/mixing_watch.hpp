#pragma once

/// Learns a mixing while the aircraft flies normally, and holds a known one against what is flown.

#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/surfaces/surface_mixing.hpp"
#include "xplane_bridge/core/surfaces/surface_watch.hpp"

namespace xplane_bridge::core {

/// The mixing of the aircraft loaded: from a file, from this flight, or not known yet. Not thread-safe: one owner.
class MixingWatch {
 public:
  explicit MixingWatch(const MixingRequirements& requirements = {});

  /// Forgets everything: another aircraft (identity as in MixingModel) is loaded.
  void reset(const std::string& aircraft);
  /// A mixing of this aircraft from a file.
  void adopt(const MixingModel& model);

  /// Every frame in which X-Plane drives the surfaces itself and nothing is broken. Ten samples a second of simulator
  /// time are used, and none while the stick is faster than surfaces can follow.
  void add(const SurfaceSample& sample);
  /// The time line was broken (surfaces driven, a gap): the next frame is no neighbour of the last one.
  void interrupt();
  /// The mixing has to be seen to hold once more (X-Plane was restarted).
  void recheck();

  /// Solves for the mixing with what was flown; worth a call a second. True when a new mixing was adopted, which is
  /// worth keeping.
  bool solve();

  /// From here on test signals move each axis by itself, which shows more in less time than a pilot: less of it is
  /// needed. solve() is not to be called until it is concluded. What was seen before and contradicts is forgotten.
  void beginIdentification();
  /// What came of it.
  struct Found {
    MixingQuality quality;
    bool good() const { return quality.good; }
    bool adopted = false;  ///< a new mixing, which is worth keeping; else the one known stays
  };
  Found concludeIdentification();
  /// It ends without result.
  void cancelIdentification();
  /// [-] of stick that it takes to both sides of each axis.
  double excursionNeeded() const { return signalled(requirements_).excursion; }

  const std::string& aircraft() const { return aircraft_; }
  /// Null while none is known.
  const MixingModel* model() const { return model_ ? &*model_ : nullptr; }
  /// Of this flight's identification, which need not be good when the model came from a file.
  const MixingQuality& quality() const { return quality_; }
  std::size_t samples() const { return identifier_.samples(); }

  /// Why surfaces cannot be driven by the mixing now, in words that say what to do; empty: they can.
  std::string refusal() const;
  /// [deg] by which each surface of surfaceTable() stands off its law because of terms the law does not know (e.g. a
  /// trim that never moved while it was identified); all 0 when those have not moved.
  std::vector<double> bias() const;

 private:
  std::string contradiction() const;
  std::string notShown() const;
  bool unknownMoved() const;
  bool knowsMore(const MixingModel& found) const;
  bool replaces(const MixingModel& found) const;
  void adoptFound(const MixingModel& found);
  static MixingRequirements signalled(MixingRequirements requirements);

  MixingRequirements requirements_;
  MixingIdentifier identifier_;
  MixingQuality quality_;
  std::string aircraft_;
  std::optional<MixingModel> model_;
  std::size_t solved_samples_ = 0;  // of the identification the model came from; 0: a file
  MixingInputs speed_inputs_, used_inputs_;
  double last_time_ = std::nan("");   // [s] of the previous frame
  double speed_time_ = std::nan("");  // [s] from which the stick's speed is measured
  double fast_time_ = std::nan("");   // [s] when the stick was last too fast
  double used_time_ = std::nan("");   // [s] of the last sample used
  std::vector<double> off_;           // [deg] smoothed, shown less law, by surface; NaN: unknown
  int off_count_ = 0;                 // samples in off_
};

}  // namespace xplane_bridge::core
