#pragma once

/// Drives every surface from an identified mixing, some of them broken (docs/protocol.md 5.3, steps 2 and 3).

#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/surfaces/surface_mixing.hpp"

namespace xplane_bridge::core {

// Of the faults (SurfaceFault; values of SetFailure): "up" is trailing edge up, rudder trailing edge left. Centred is
// where it is with controls centred; floating trails with the airflow, a surrogate (DriverOptions::floating_gain); gone
// cannot be expressed by a deflection.

struct SurfaceFailure {
  std::size_t surface = 0;  ///< number in surfaceTable()
  SurfaceFault fault = SurfaceFault::kStuck;
  std::optional<double> value;  ///< stuck [deg], none: where it is; reduced [0..1]; slow [deg/s]
};

/// First thing wrong with a failure's value, in words.
std::optional<std::string> validate(const SurfaceFailure& failure);

struct DriverOptions {
  double rate_deg_s = 60.0;  ///< [deg/s] of every surface; > 0
  /// A floating surface trails by this share of the flow angle (alpha for wings and tailplane, beta for rudders), with
  /// its trailing edge going with the flow: a typical hinge-moment ratio, not taken from the aircraft.
  double floating_gain = 0.3;
  double floating_time = 0.2;  ///< [s] first-order lag of a floating surface
};

/// Flow angles, for floating surfaces.
struct FlowAngles {
  double alpha_deg = 0.0;  ///< nose up +
  double beta_deg = 0.0;   ///< wind from the right +
};

/// Holds what is sent to each surface. Time steps are given, so it does nothing by itself.
class SurfaceDriver {
 public:
  /// Throws std::invalid_argument for options out of range.
  explicit SurfaceDriver(MixingModel model, DriverOptions options = {});
  SurfaceDriver(const SurfaceDriver&) = delete;
  SurfaceDriver& operator=(const SurfaceDriver&) = delete;

  /// Takes over from the deflections shown now (one per surfaceTable() entry, NaN: unknown), so that nothing jumps.
  /// Surfaces known to the model and those that are not at 0 are driven from now on. `bias_deg`, by surface, is added
  /// to the laws (MixingWatch::bias()); empty: none. Throws std::invalid_argument when a surface of the model has no
  /// known deflection.
  void engage(const std::vector<double>& shown_deg, const std::vector<double>& bias_deg = {});
  bool engaged() const { return !driven_.empty(); }

  /// The broken surfaces, all of them; at most one failure for each surface. A surface that stops being broken goes
  /// back to the law. Surfaces not driven before start from 0 deg.
  void setFailures(const std::vector<SurfaceFailure>& failures);
  /// Surfaces flown one by one (SurfaceCommand.msg), all of them. A failure of the same surface is stronger.
  void setCommands(const std::vector<SurfaceDeflection>& commands);
  /// Added to one surface's deflection (excitation of a surface) within its travel; 0 ends it.
  void setOffset(std::size_t surface, double offset_deg);

  /// Advances by `dt` [s] and gives what to send, every driven surface by rising number.
  const std::vector<SurfaceDeflection>& step(const MixingInputs& inputs, const FlowAngles& flow, double dt);

  /// [deg] by which the surface that is farthest off was not where it is wanted, after the last step.
  double offTarget() const { return off_target_deg_; }

  const MixingModel& model() const { return model_; }

 private:
  struct Driven {
    std::size_t surface = 0;
    const SurfaceLaw* law = nullptr;  // none: held where it was
    double held_deg = 0.0;            // engaged value of a surface without a law
    double bias_deg = 0.0;            // added to the law
    double now_deg = 0.0;             // without the offset
    double offset_deg = 0.0;
    std::optional<SurfaceFailure> failure;
    double stuck_deg = 0.0;
    std::optional<double> command_deg;
  };

  Driven& driven(std::size_t surface);
  double target(const Driven& d, const MixingVector& terms) const;
  double floating(const Driven& d, const FlowAngles& flow, double dt) const;

  MixingModel model_;
  DriverOptions options_;
  std::vector<Driven> driven_;
  std::vector<SurfaceDeflection> out_;
  double off_target_deg_ = 0.0;
};

}  // namespace xplane_bridge::core
