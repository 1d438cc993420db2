#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {

/// DATA datagrams a second.
inline constexpr const char* kDataRateDataref = "sim/network/dataout/network_data_rate";
/// Not 0: X-Plane sends this row.
std::string dataRowDataref(std::int32_t row);

/// DATA transport: what the bridge wants from X-Plane's Data Output.
struct DataOutputOptions {
  bool enabled = false;
  std::uint16_t port = kDefaultDataPort;  ///< ours; 0: any free one (needs `configure`); never 49001
  bool configure = true;                  ///< set rows, rate and target in X-Plane; false: the user has done it
  bool restore_leftovers = false;         ///< undo what a crashed run left in Data Output, also without `enabled`
  std::vector<std::int32_t> rows;         ///< rows wanted
  std::int32_t rate_hz = 99;              ///< network_data_rate while we run
  std::string address;                    ///< where X-Plane shall send to; empty: our address towards X-Plane
};

/// Makes X-Plane's Data Output send to us what we want, keeps it so, and puts it back. No I/O of its own except the
/// journal's. Times are the steady clock's [ns].
///
/// X-Plane has one target for DATA and does not show which it is. So: rows, rate and target are set when the link comes
/// up, written to the journal first; when DATA stays away while X-Plane answers and is not paused, the target is set
/// once more, and if that does not last, another client owns Data Output and is left in peace,
/// also by release(). Where X-Plane does not say what it had before, nothing is changed and it is asked again.
class DataOutput {
 public:
  struct Services {
    std::function<void(ByteView)> send;
    std::function<void(std::vector<std::string> paths, double timeout_s, DatarefReader::Accept accept,
                       DatarefReader::Done done)>
        read;
    LogFunction log;
  };

  DataOutput(DataOutputOptions options, double read_timeout_s, Services services);

  /// Of the X-Plane that the link has chosen.
  void setJournal(std::shared_ptr<Journal> journal) { journal_ = std::move(journal); }
  /// The link came up anew: `target` is where X-Plane shall send to.
  void linkUp(const Endpoint& target, std::int64_t now_ns);
  /// Valid DATA has arrived.
  void heard(const DataView& data, std::int64_t now_ns);
  /// Call regularly. `flowing`: X-Plane answers and is not paused, so DATA should arrive.
  void update(bool flowing, std::int64_t now_ns);
  void setRows(std::vector<std::int32_t> rows);

  /// Puts everything back, reads it back, and takes it out of the journal; calls `done` with whether that worked.
  void release(double timeout_s, std::function<void(bool)> done);

  /// What a user should know; empty when all is well.
  const std::string& problem() const { return problem_; }

 private:
  enum class Phase : std::uint8_t { kIdle, kReading, kUnanswered, kActive, kForeign, kFailed, kReleasing };

  void readPrevious();
  void startWaiting(std::int64_t now_ns);
  void configure(const std::vector<DatarefValue>& values);
  void sendSettings(const std::vector<std::int32_t>& rows);
  void handleQuiet();
  void repairRows(std::int64_t now_ns);
  void restoreLeftovers();
  void fail(const std::string& problem);
  bool forget(const std::string& id);
  /// The entry that an earlier run, or an earlier link of this one, has left.
  std::optional<JournalEntry> previousEntry() const;
  void undoEntry(const JournalEntry& entry, double timeout_s, const std::function<void(bool)>& done, int attempt = 0);

  DataOutputOptions options_;
  double read_timeout_s_;
  Services services_;
  std::int64_t quiet_ns_;
  std::shared_ptr<Journal> journal_;
  Endpoint target_;
  Phase phase_ = Phase::kIdle;
  bool interrupted_ = false;       // nothing flowed for a while since it was asked
  std::int64_t ask_again_ns_ = 0;  // in kUnanswered
  std::uint32_t generation_ = 0;   // answers to reads of an earlier link are ignored
  std::vector<std::int32_t> asked_rows_;
  int tries_ = 0;
  bool taken_back_ = false;
  bool ever_heard_ = false;  // since linkUp()
  std::int64_t quiet_since_ns_ = 0;
  std::array<std::int64_t, kDataRowLimit> row_heard_ns_{};
  int row_repairs_ = 0;
  bool row_problem_ = false;
  bool quiet_problem_ = false;
  std::string problem_;
};

}  // namespace xplane_bridge::core
