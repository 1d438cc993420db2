#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/surfaces/mixing_watch.hpp"
#include "xplane_bridge/core/surfaces/surface_driver.hpp"
#include "xplane_bridge/core/surfaces/surface_watch.hpp"
#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

namespace xplane_bridge {

struct SurfaceControlOptions {
  core::MixingRequirements mixing;
  std::string mixing_folder;   ///< of the mixing files (docs/control/mixing_file.md); empty: none are kept
  std::string shipped_mixing;  ///< of those to begin with; empty: none
  core::DriverOptions driver;
  double flap_rate = 0.15;       ///< [1/s] of full travel, while they are driven
  double speedbrake_rate = 1.0;  ///< [1/s] of full travel
};

enum class SurfaceControlState : std::uint8_t {
  kIdle,       ///< X-Plane drives the surfaces
  kTaking,     ///< they are sent, but X-Plane does not show the override yet
  kDriving,    ///< they are sent, and X-Plane shows the override
  kReleasing,  ///< given back, but X-Plane still shows the override
};
const char* toString(SurfaceControlState state);

/// What diagnostics show of driven surfaces.
struct SurfaceControlStatus {
  SurfaceControlState state = SurfaceControlState::kIdle;
  bool wanted = false;                     ///< something needs the surfaces driven
  std::string blocked_reason;              ///< why they cannot be driven now; empty: they can, or are
  std::string file_problem;                ///< with the mixing file; empty: none
  std::vector<std::string> not_following;  ///< surfaces that do not show what is sent to them
  std::string aircraft;                    ///< whose mixing this is
  bool mixing_known = false;
  std::vector<std::string> mixed_surfaces;  ///< those of the mixing
  std::vector<std::string> unknown_moved;   ///< terms that have moved and that the mixing does not know
  std::string identification;               ///< how good that of this flight is, or what it needs
  std::size_t samples = 0;                  ///< of this flight
  double worst_residual_deg = 0.0;
  double lag_frames = std::nan("");  ///< [frames] by which driven surfaces trail X-Plane's own
  std::uint64_t commands_accepted = 0, commands_refused = 0;
  std::uint64_t answers_dropped = 0;  ///< to commands, because nothing took them
  std::string last_refusal;
};

/// Every control surface, driven one by one while something needs that (a broken surface, a command to single surfaces,
/// an excitation of one), and left to X-Plane otherwise. Learns the mixing that takes (docs/control/surfaces.md).
///
/// X-Plane's frames drive it: what is sent goes out on arrival of each. It goes by the link's clock. Thread-safe;
/// nothing waits but for the journal's disk.
class SurfaceControl {
 public:
  /// `report(text, success)`: what happened, for events and the log.
  using Report = std::function<void(const std::string& text, bool success)>;

  /// `on_frame`: called from the link's thread after every frame, so that takeEcho() can be asked.
  SurfaceControl(core::SimulatorPort* link, OverrideManager* overrides, SurfaceControlOptions options, Report report,
                 std::function<void()> on_frame);

  // What drives it.

  /// The link's state or version changed. From the link's thread.
  void onLink(const core::LinkStatus& status);
  /// Another aircraft is loaded: whatever was driven ends, its mixing file is read; where there is none, the shipped
  /// one of `exactly`, a name that only this aircraft has.
  void onAircraft(const std::string& aircraft, const std::string& exactly = "");
  /// Whatever is driven ends, failures and commands too.
  void release(const std::string& why);
  /// At least ten times a second. `blocked`: the refusal, as nothing may be sent to X-Plane now; nullopt: it may.
  void tick(const std::optional<RequestResult>& blocked);
  /// Ends all driving; OverrideManager releases the overrides.
  void stop();
  /// What was seen until now was no flight: it says nothing about the mixing.
  void restart();

  // What is wanted.

  /// Roll, pitch and yaw as this node commands them; NaN for those that X-Plane's own stick flies.
  void setStick(const std::array<double, 3>& stick);
  /// Broken surfaces, all of them; a surface not named any more goes back to the law.
  void setFailures(const std::vector<core::SurfaceFailure>& failures);
  /// X-Plane itself has something broken, so that its surfaces say nothing about the mixing.
  void setDisturbed(bool disturbed);
  /// control/surfaces; an empty list gives all back. Whether it may fly, and for how long without being repeated, is
  /// the ControlPath's to say. Returns why it is refused as a whole; nullopt: taken.
  std::optional<std::string> command(const std::vector<std::string>& names, const std::vector<float>& deflections_deg,
                                     std::uint32_t sequence);
  /// Counts a command that may not fly, for diagnostics.
  void refuseCommand(const std::string& why);
  /// What was commanded ends: those surfaces go where stick or mixing wants them, at the rate of the driver.
  void endCommands();
  /// Excitation of one surface by up to `amplitude_deg`: the surfaces are driven from now on. One at a time. Returns
  /// why not, in words; empty: they are.
  std::string beginOffset(std::size_t surface, double amplitude_deg);
  /// Adds degrees to that surface from the next frame on. Returns why it does not answer any more (it broke, the
  /// surfaces were given up), which ends the excitation; empty: it does.
  std::string setOffset(double offset_deg);
  /// The excitation is over.
  void clearOffset();

  // Identification by test signals.

  /// The surfaces are watched for it from now on. Returns why not, in words; empty: they are.
  std::string beginIdentification();
  /// Why it cannot go on, in words; empty: it can, or none runs.
  std::string identificationProblem() const;
  struct Identified {
    bool good = false;
    std::string text;  ///< what came of it, or what is missing
  };
  /// Ends it. A mixing that is good is the one to drive by from now on, and is kept in a file if `save`.
  Identified concludeIdentification(bool save);
  void cancelIdentification();
  /// [-] of stick that it takes to both sides of each axis.
  double excursionNeeded() const;
  /// [-1..1] roll, pitch, yaw as X-Plane shows them; NaN: unknown.
  struct Sticks {
    std::array<double, 3> stick{};  ///< the stick alone
    std::array<double, 3> total{};  ///< what the surfaces follow
  };
  Sticks sticks() const;

  // What is.

  /// Why surfaces cannot be driven now, in words that say what to do; empty: they can, or are.
  std::string blockReason() const;
  /// The same for one surface, which the mixing has to know: kNoLink where waiting helps; nullopt: it can.
  std::optional<RequestResult> refusalFor(std::size_t surface) const;
  /// Why this aircraft may not have the surface, in words that say what to do: its mixing is known, and has no law of
  /// it. Empty: it has, or no mixing is known.
  std::string unknownReason(std::size_t surface) const;
  /// The surface override is set, or being taken or given back.
  bool driving() const;
  /// Nothing needs the surfaces any more, but X-Plane has not shown yet that it drives them.
  bool givingBack() const;
  /// [frames] by which driven surfaces trail X-Plane's own, measured; NaN while nothing is driven.
  double lagFrames() const;
  /// X-Plane shows what was sent to this surface.
  bool follows(std::size_t surface) const;
  /// [deg] as X-Plane shows it; NaN: unknown.
  double readBack(std::size_t surface) const;
  /// The law of a surface; nullopt where none is known.
  std::optional<core::SurfaceLaw> lawOf(std::size_t surface) const;

  /// Surfaces commanded one by one or broken, as sent last.
  std::vector<core::SurfaceDeflection> individuallyDriven() const;
  /// A command that was sent, or shown by X-Plane, since the last call.
  struct Echo {
    std::uint32_t sequence = 0;
    bool read_back = false;
    double sim_time = std::nan("");  ///< [s] of the frame that shows it
    double frames = std::nan("");    ///< since it was sent
  };
  std::optional<Echo> takeEcho();
  /// Another client has released the surface override while control/surfaces commanded, since the last call.
  bool takeReleasedByAnother();
  /// Why all failures and commands were abandoned (another aircraft, X-Plane restarted, the override released by
  /// another client), once after it happened.
  std::optional<std::string> takeAbandoned();

  SurfaceControlStatus status() const;

 private:
  using State = SurfaceControlState;

  static constexpr double kFollowsDeg = 0.1;  // [deg] between sent and shown; X-Plane keeps float32

  static std::string nameOf(std::size_t surface);
  double now() const;

  // Of the link's thread, without mutex_.
  void subscribe();
  void onDatagram(const core::RrefView& view, const core::ReceiveInfo& info);

  // All with mutex_ held.
  void onSample();
  bool wanted() const;
  void take();
  void drive(double dt);
  void giveBack();
  void checkLeft();
  void abandon(const std::string& why);
  void cancelOffset(const std::string& why);
  void clearCommands();
  void countRefused(const std::string& why);
  bool settled() const;
  void enter(State state);
  void measureLag();
  void watchCommand();
  void addEcho(const Echo& echo);
  void loadModel(const std::string& exactly);
  std::string keepModel();
  void saveModel();
  std::string heldElsewhere() const;
  std::string blockReasonLocked() const;
  std::string blockReasonForLocked(std::size_t surface) const;
  std::string unknownReasonLocked(std::size_t surface) const;
  bool followsLocked(std::size_t surface) const;
  bool isBroken(std::size_t surface) const;

  core::SimulatorPort* link_;
  OverrideManager* overrides_;
  SurfaceControlOptions options_;
  Report report_;
  std::function<void()> on_frame_;

  mutable std::mutex mutex_;
  core::SimulatorVersion version_;
  std::unique_ptr<core::RrefFrameAssembler> frames_;  // of the link's thread
  core::SurfaceSample sample_;
  double last_time_ = std::nan("");    // [s] simulator time of the previous frame
  double solved_time_ = std::nan("");  // [s] the same, of the last solution
  bool flowing_ = false, paused_ = false;
  bool disturbed_ = false;
  bool stopped_ = false;
  std::optional<RequestResult> blocked_ = noLink();

  core::MixingWatch watch_;
  std::string file_problem_;
  bool keeps_ = true;  // in a file, what normal flight shows of this aircraft
  bool identifying_ = false;
  std::string identification_lost_;  // why, where its end was not asked for

  State state_ = State::kIdle;
  double state_since_ = 0.0;  // [s] steady
  double not_before_ = 0.0;   // [s] steady: after a failed attempt
  std::unique_ptr<core::SurfaceDriver> driver_;
  core::DrivenInputs inputs_;
  std::array<double, 3> stick_;
  std::vector<core::SurfaceDeflection> sent_;
  std::vector<core::SurfaceDeflection> left_;  // as sent last before they were given back, until that is checked
  double left_time_ = 0.0;                     // [s] simulator time
  std::vector<double> not_following_;          // [s] simulator time for which each surface has not shown what was sent

  std::vector<core::SurfaceFailure> failures_;
  std::optional<std::string> abandoned_;
  std::vector<core::SurfaceDeflection> commands_;
  std::uint32_t command_sequence_ = 0;
  bool command_sent_ = true;
  bool released_by_another_ = false;
  double settling_ = 0.0;  // [s] of frames for which surfaces have been on their way back to the law
  struct SentCommand {
    std::uint32_t sequence = 0;
    double sim_time = std::nan("");  // [s] of the frame in which it was sent
    std::vector<core::SurfaceDeflection> surfaces;
  };
  std::deque<SentCommand> commands_awaiting_read_back_;  // oldest first
  std::deque<Echo> echoes_;                              // until takeEcho(), oldest first
  std::uint64_t echoes_dropped_ = 0;
  std::uint64_t commands_accepted_ = 0, commands_refused_ = 0;
  std::string last_refusal_;
  std::optional<core::SurfaceDeflection> offset_;
  std::string offset_lost_;  // why, where an excitation's end was not asked for

  struct Sent {
    double sim_time;  // [s] of the frame it was worked out from
    std::size_t surface;
    double deflection_deg;
  };
  std::deque<Sent> awaiting_read_back_;  // movements not shown yet, oldest first
  double lag_frames_ = std::nan("");

  core::Subscription subscription_;  // last: it ends first
};

}  // namespace xplane_bridge
