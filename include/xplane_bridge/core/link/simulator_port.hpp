#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/link_monitor.hpp"
#include "xplane_bridge/core/link/subscription.hpp"
#include "xplane_bridge/core/wire/beacon_tracker.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"

namespace xplane_bridge::core {

struct LinkStatus {
  bool up() const { return answers(state); }

  LinkState state = LinkState::kSearching;
  std::string reason;                ///< one sentence
  std::uint32_t epoch = 0;           ///< raised each time the link came up anew; 0 before the first time
  std::int64_t since_steady_ns = 0;  ///< [ns] when `state` began
  Endpoint peer;                     ///< X-Plane; not valid() while unknown
  std::string computer_name;         ///< from the beacon; empty without
  SimulatorVersion version;          ///< unknown until X-Plane has answered; see also one_way
  bool one_way = false;              ///< DATA comes, but nothing answers: `version` is the beacon's or the option's
  std::optional<bool> paused;
  std::optional<float> sim_time_s;      ///< sim/time/total_running_time_sec as received
  double silence_s = 0.0;               ///< [s] since the last valid datagram; NaN before the first
  std::vector<BeaconSighting> beacons;  ///< all that are heard at the moment
  std::vector<std::string> problems;    ///< what a user should know and do something about, one sentence each
};

enum class SendStatus : std::uint8_t {
  kSent = 0,
  kNoPeer,       ///< X-Plane has not been found
  kNotEncoded,   ///< empty, over-long or NUL-bearing path, non-finite value, bad row
  kSocketError,  ///< the kernel refused it
};
const char* toString(SendStatus status);

/// All that may be asked of one X-Plane: subscribing, reading and writing datarefs, commands and other messages, the
/// state of the link, the journal of what was changed. SimLink is the real one; FakeSimulator (tests/cpp/support) lets
/// tests play X-Plane under a clock moved by hand.
///
/// Any thread may call any function. Those that wait say so; they must not be called from a handler or callback of the
/// link.
class SimulatorPort {
 public:
  virtual ~SimulatorPort() = default;

  /// Asks X-Plane for a group of datarefs, from now on and after every loss, until the handle ends. `mutex` is held
  /// while the handler runs, see Subscription. Throws std::invalid_argument for an empty or over-long path, a rate
  /// outside 1..kEveryFrameRateHz, or an empty group; SocketError when no socket can be had.
  [[nodiscard]] virtual Subscription subscribe(RrefGroup group, RrefHandler handler,
                                               std::shared_ptr<HandlerMutex> mutex) = 0;
  [[nodiscard]] Subscription subscribe(RrefGroup group, RrefHandler handler);

  /// All of these send at once, on the socket that reads datarefs too, so that X-Plane sees writes and reads in order.
  /// `send()` takes any message made with encode...().
  virtual SendStatus send(ByteView message) = 0;
  SendStatus write(std::string_view dataref, float value);
  SendStatus command(std::string_view path);
  SendStatus sendUndo(const UndoOperation& operation);

  /// Reads datarefs once: takes the first values that arrive after the call. Calls `done` from the link's thread, with
  /// one value per path, at the latest after `timeout_s`. Throws std::invalid_argument for what is no dataref.
  virtual void read(std::vector<std::string> paths, double timeout_s, DatarefReader::Done done) = 0;
  /// The same, waiting.
  std::vector<DatarefValue> read(std::vector<std::string> paths, double timeout_s);
  /// Waits until each has answered and `accept(values)` returns true, asked every frame; returns the last values. The
  /// link may call `accept` once more after a wait was given up, so it must own what it uses.
  virtual std::vector<DatarefValue> readUntil(std::vector<std::string> paths, double timeout_s,
                                              DatarefReader::Accept accept) = 0;
  /// Waits until a dataref reads `expected` within `tolerance`; returns whether it does, and the last value seen.
  std::pair<bool, DatarefValue> waitForDataref(const std::string& path, float expected, float tolerance,
                                               double timeout_s);
  /// Waits until `condition()` returns true, asked on the calling thread after everything the link has handled; returns
  /// whether it did.
  virtual bool waitUntil(const std::function<bool()>& condition, double timeout_s) = 0;
  /// Carries out the operations and reads datarefs among them back. Waits. Returns whether all read back as written.
  bool undo(const std::vector<UndoOperation>& operations, double timeout_s);
  /// The second half of undo(), for operations that have been sent.
  bool waitUntilUndone(const std::vector<UndoOperation>& operations, double timeout_s);

  /// Whether the simulator stands until its frame is answered (lock-step): who waits for a frame must not be waited for
  /// in it.
  virtual bool inLockstep() const { return false; }
  virtual LinkStatus status() const = 0;
  /// The journal of the X-Plane found; null before, or without one.
  virtual std::shared_ptr<Journal> journal() const = 0;
  /// The clock of ReceiveInfo, of LinkStatus and of all time-outs here.
  virtual const Clock& clock() const = 0;
};

}  // namespace xplane_bridge::core
