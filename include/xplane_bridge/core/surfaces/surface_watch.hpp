#pragma once

/// What tx_node watches of the control surfaces every frame: deflections, what moves them, and whether a client has
/// taken them from X-Plane (docs/protocol.md 5.3, step 1).

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/surfaces/surface_mixing.hpp"

namespace xplane_bridge::core {

/// One frame.
struct SurfaceSample {
  double sim_time = std::nan("");                            ///< [s] raw simulator time
  double frame_period = std::nan("");                        ///< [s]
  double override_shown = std::nan("");                      ///< kSurfaceOverride
  double alpha_deg = std::nan(""), beta_deg = std::nan("");  ///< as FlightWatch
  std::array<double, 3> stick{};                             ///< [-1..1] roll, pitch, yaw: the stick alone
  double flap_handle = std::nan("");                         ///< [0..1]
  double speedbrake_handle = std::nan("");                   ///< [-0.5..1]
  MixingInputs inputs;                                       ///< NaN where X-Plane does not answer
  std::vector<double> deflections_deg;                       ///< by surfaceTable(); NaN where X-Plane does not answer
};

/// What to subscribe, every frame; the position is the index.
std::vector<std::string> surfaceWatchDatarefs(SimulatorVersion version);

/// A sample from values in that order; false when there are not as many.
bool surfaceSampleFrom(const std::vector<float>& values, SurfaceSample* sample);

/// What moves the surfaces, as the law wants it, while tx_node drives them.
///
/// Own commands act at once, what only X-Plane knows (its stick, autopilot, stability augmentation, trims) one to two
/// frames later. X-Plane no longer moves flaps and speed brakes under the override, so they are run to where their
/// handles point. [? totals-move] Whether total_*_ratio still moves under the override: where it stands still
/// although the stick moves, the stick's own movement is added instead.
class DrivenInputs {
 public:
  /// `flap_rate`, `speedbrake_rate`: [1/s] of travel, > 0.
  explicit DrivenInputs(double flap_rate = 0.15, double speedbrake_rate = 1.0)
      : flap_rate_(flap_rate), speedbrake_rate_(speedbrake_rate) {}

  /// Each frame in which X-Plane moves the surfaces: whether flaps and speed brakes are under way.
  void watch(const SurfaceSample& sample);
  /// From the sample of taking over on. Flaps and speed brakes that were under way run on; those that stood off their
  /// handles stay until the handle is moved.
  void begin(const SurfaceSample& sample);
  /// One frame of `dt` [s]. `own`: roll, pitch, yaw as this node commands them now; NaN where it does not.
  MixingInputs step(const SurfaceSample& sample, const std::array<double, 3>& own, double dt);

 private:
  struct Handle {
    double at_begin = 0.0;
    bool moved = false;  // or what it moves was under way
  };
  static double run(Handle* handle, double shown, double now, double rate, double dt);

  double flap_rate_, speedbrake_rate_;
  std::array<double, 3> total_begin_{}, stick_begin_{};
  std::array<int, 3> standing_{};       // frames in a row in which the total did not follow the stick
  double watched_time_ = std::nan("");  // [s]
  Handle flap_, speedbrake_;
  double flap1_ = 0.0, flap2_ = 0.0, brake_ = 0.0;
};

}  // namespace xplane_bridge::core
