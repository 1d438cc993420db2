#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/control/excitation.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// As InjectExcitation.srv.
struct ExcitationRequest {
  std::string kind;    ///< of ExcitationShape, or "stop"
  std::string target;  ///< roll, pitch, yaw, throttle or a surface; several axes of a multisine: "roll,pitch"
  double amplitude = 0.0;
  double duration = 0.0;       ///< [s]
  double frequency_min = 0.0;  ///< [Hz]
  double frequency_max = 0.0;  ///< [Hz]
  std::uint32_t seed = 0;
  double max_roll_deg = 0.0;   ///< 0: the aircraft's
  double max_pitch_deg = 0.0;  ///< 0: the aircraft's
  /// [-1..1] where an axis without a command is, which is taken for as long; none: such an axis is refused.
  std::optional<double> rest;
};

/// As ExcitationState.msg.
struct ExcitationLabel {
  double sim_time = std::nan("");  ///< [s] of the last sample
  bool active = false;
  std::uint32_t id = 0;
  std::string kind, target;
  double amplitude = 0.0;
  double duration = 0.0;       ///< [s]
  double frequency_min = 0.0;  ///< [Hz]
  double frequency_max = 0.0;  ///< [Hz]
  std::uint32_t seed = 0;
  double start_sim_time = std::nan("");  ///< [s]
  double end_sim_time = std::nan("");    ///< [s]
  std::string result;                    ///< running, done, aborted: <why>
};

/// The one test signal that runs, on an axis or several (added to what is commanded) or on a surface (which is driven
/// for as long), and its label. X-Plane's frames drive it. Not thread-safe: its owner's mutex guards it, but for
/// plan().
class ExcitationManager {
 public:
  /// `report(text, who, success)`: what happened, for events and the log.
  using Report = std::function<void(const std::string& text, const std::string& who, bool success)>;
  using Publish = std::function<void(const ExcitationLabel& label)>;

  /// `publish` is called at once and on every change.
  ExcitationManager(SurfaceControl* surfaces, double max_roll_deg, double max_pitch_deg, Publish publish,
                    Report report);

  /// What a request asks for, as far as it says by itself.
  struct Plan {
    std::string wrong;                       ///< with the request, in words; empty: nothing
    std::vector<core::ChannelSet> channels;  ///< of each axis; none for a surface
    std::optional<std::size_t> surface;
    std::vector<core::ExcitationSignal> signals;  ///< of each axis, or of the surface; none to stop the one that runs
  };
  /// Takes up to half a second. May be called without the owner's mutex.
  Plan plan(const ExcitationRequest& request) const;
  /// Begins or stops one; label() has its number.
  /// @param plan of the request
  /// @param blocked what it is refused with, as nothing may be sent to X-Plane now; nullopt: it may
  /// @param commanded the channels that are commanded now
  RequestResult inject(const ExcitationRequest& request, const Plan& plan, const std::string& who,
                       const core::FlightWatch& watch, const std::optional<RequestResult>& blocked,
                       const core::ChannelSet& commanded);

  /// Every frame. Returns whether an axis is excited, so that the controls have to be sent anew.
  bool onFrame(const core::FlightWatch& watch);
  /// Ends it, if one runs.
  void abort(const std::string& reason);
  /// What the arbiter is to add now.
  core::ChannelExcitation excitation() const;
  bool running() const { return runner_.phase() == core::ExcitationPhase::kRunning; }
  /// The channels it is added to; none for a surface, or while none runs.
  core::ChannelSet channels() const;
  /// The one that runs, or ran last; without id before the first.
  const ExcitationLabel& label() const { return label_; }
  /// Publishes the label once more.
  void publish() { publish_(label_); }

 private:
  void begin(const ExcitationRequest& request, const core::ExcitationSpec& spec, double sim_time);
  void end();

  SurfaceControl* surfaces_;
  double max_roll_deg_;
  double max_pitch_deg_;
  Publish publish_;
  Report report_;

  core::ExcitationRunner runner_;
  std::vector<core::ChannelSet> channels_;  // of each axis
  std::optional<double> rest_;
  std::optional<std::size_t> surface_;
  std::string who_;
  double last_sim_time_ = std::nan("");
  ExcitationLabel label_;
};

}  // namespace xplane_bridge
