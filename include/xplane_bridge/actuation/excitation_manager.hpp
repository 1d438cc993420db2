#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "xplane_bridge/ExcitationState.h"
#include "xplane_bridge/InjectExcitation.h"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/control/excitation.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge {

/// The one test signal that runs, on an axis (added to what is commanded) or on a surface (which is driven for as
/// long), and its label (excitation/state). X-Plane's frames drive it. Not thread-safe: TxNode's mutex guards it, but
/// for plan().
class ExcitationManager {
 public:
  /// `report(text, who, success)`: what happened, for events and the log.
  using Report = std::function<void(const std::string& text, const std::string& who, bool success)>;

  /// Stamps excitation/state and publishes it.
  using Publish = std::function<void(ExcitationState* message)>;

  ExcitationManager(SurfaceControl* surfaces, double max_roll_deg, double max_pitch_deg, Publish publish,
                    Report report);

  /// What a request asks for, as far as it tells by itself.
  struct Plan {
    std::string wrong;  ///< with the request, in words; empty: nothing
    core::ChannelSet channels;
    std::optional<std::size_t> surface;
    std::optional<core::ExcitationSignal> signal;  ///< none to stop the one that runs
  };
  /// Takes up to half a second. May be called without TxNode's mutex.
  Plan plan(const InjectExcitation::Request& request) const;
  /// tx_node/inject_excitation.
  /// @param plan of the request
  /// @param refusal why nothing may be sent to X-Plane now; empty: it may
  /// @param commanded the channels somebody commands now
  void inject(const InjectExcitation::Request& request, const Plan& plan, const std::string& who,
              const core::FlightWatch& watch, const std::string& refusal, const core::ChannelSet& commanded,
              InjectExcitation::Response* response);

  /// Every frame. Returns whether an axis is excited, so that the controls have to be sent anew.
  bool onFrame(const core::FlightWatch& watch);
  /// Ends it, if one runs.
  void abort(const std::string& reason);
  /// What the arbiter is to add now.
  core::ChannelExcitation excitation() const;
  bool running() const { return runner_.phase() == core::ExcitationPhase::kRunning; }
  /// The channels it is added to; none for a surface, or while none runs.
  core::ChannelSet channels() const { return running() ? channels_ : core::ChannelSet{}; }
  void publish();

 private:
  void end();

  SurfaceControl* surfaces_;
  double max_roll_deg_;
  double max_pitch_deg_;
  Publish publish_;
  Report report_;

  core::ExcitationRunner runner_;
  core::ChannelSet channels_;
  std::optional<std::size_t> surface_;
  std::string who_;
  double last_sim_time_ = std::nan("");
  ExcitationState state_;
};

}  // namespace xplane_bridge
