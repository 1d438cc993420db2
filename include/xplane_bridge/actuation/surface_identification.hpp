#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "xplane_bridge/actuation/excitation_manager.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// As IdentifySurfaces.srv; 0: the default.
struct IdentificationRequest {
  bool save = true;
  double max_roll_deg = 0.0;
  double max_pitch_deg = 0.0;
  double max_rate_deg_s = 0.0;
  double max_airspeed_change = 0.0;  ///< [m/s]
  double min_height = 0.0;           ///< [m] above ground, in flight
};

/// What the rest of tx_node is at, as far as it decides about an identification.
struct IdentificationConditions {
  std::optional<RequestResult> blocked;  ///< the refusal, as nothing may be sent to X-Plane now; nullopt: it may
  bool failsafe = false;                 ///< the source that flies is silent
  std::string broken;                    ///< of the controls, and what repairs it, in words; empty: nothing
  core::ChannelSet commanded;            ///< channels that are commanded now
};

/// Learns how the aircraft moves its surfaces by test signals: two periods of a sine on roll, pitch and yaw, one after
/// the other, repeated with more where a controller works against them. An axis without a command is taken for as
/// long, from where its stick is. On X-Plane's frames and its time; not thread-safe: its owner's mutex guards it.
class SurfaceIdentification {
 public:
  /// `report(number, text, who, success)`: the outcome that was promised as event `number`.
  using Report =
      std::function<void(std::uint32_t number, const std::string& text, const std::string& who, bool success)>;

  /// @param max_roll_deg,max_pitch_deg of the aircraft, for test signals
  SurfaceIdentification(SurfaceControl* surfaces, ExcitationManager* excitation, double max_roll_deg,
                        double max_pitch_deg, Report report);

  /// Why it cannot begin, in words that say what to do; kAccepted: it has, and its outcome comes as event
  /// `reserve()`.
  RequestResult begin(const IdentificationRequest& request, const std::string& who, const core::FlightWatch& watch,
                      const IdentificationConditions& now, const std::function<std::uint32_t()>& reserve);
  /// Every frame, after the ExcitationManager.
  void onFrame(const core::FlightWatch& watch, const IdentificationConditions& now);
  /// Ends it, if one runs.
  void abort(const std::string& why);
  bool running() const { return phase_ != Phase::kIdle; }
  /// Of the outcome of the one that runs, or ran last; 0 before the first.
  std::uint32_t number() const { return number_; }

 private:
  enum class Phase : std::uint8_t {
    kIdle,
    kSteadying,  ///< the flight is watched before anything moves, and between two signals
    kSignal,     ///< one runs
    kChecking,   ///< the mixing found has to be seen to hold
  };

  std::string unsteady(const core::FlightWatch& watch) const;
  std::string beyondLimits(const core::FlightWatch& watch) const;
  std::string offTheMiddle(std::size_t axis) const;
  std::string whyNot(const core::FlightWatch& watch, const IdentificationConditions& now) const;
  void signal(const core::FlightWatch& watch, const IdentificationConditions& now);
  void observe();
  void afterSignal(const core::FlightWatch& watch);
  void conclude(const core::FlightWatch& watch);
  void enter(Phase phase, const core::FlightWatch& watch);
  void finish(const std::string& text, bool success);

  SurfaceControl* surfaces_;
  ExcitationManager* excitation_;
  double max_roll_deg_;
  double max_pitch_deg_;
  Report report_;

  Phase phase_ = Phase::kIdle;
  double phase_since_ = std::nan("");  // [s] simulator time
  std::uint32_t number_ = 0;
  std::string who_;
  IdentificationRequest limits_;  // with its defaults
  bool parked_ = false;
  double airspeed_ = 0.0;          // [m/s] at the beginning
  double elevation_ = 0.0;         // [m] the same
  std::size_t axis_ = 0;           // of roll, pitch, yaw
  int repeats_ = 0;                // of this axis
  double gain_ = 1.0;              // of the signal, against a controller
  double wanted_ = 0.0;            // [-] amplitude that the surfaces are to see
  double low_ = 0.0, high_ = 0.0;  // [-] of the total, during the signal
  std::uint32_t signal_id_ = 0;
  std::string text_;  // of the outcome
};

}  // namespace xplane_bridge
