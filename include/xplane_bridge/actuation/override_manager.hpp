#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"

namespace xplane_bridge {

/// When what X-Plane does not show released is tried again: a few times at once, then every few seconds.
struct Retries {
  static constexpr int kPrompt = 5;
  static constexpr double kPeriod = 5.0;  ///< [s]

  int attempts = 0;
  double not_before = -1e9;  ///< [s] steady; of the next one

  bool due(double now) const { return now >= not_before; }
  void attempted(double now) {
    if (++attempts >= kPrompt) not_before = now + kPeriod;
  }
};

/// Which part of tx_node has set an override: it stays set until each that holds it has given it back.
enum class OverrideHolder : std::uint8_t {
  kControls,  ///< the stick and motors, by OverrideManager::setRequired()
  kSurfaces,
  kTraffic,
  kFailures,
  kRequest,  ///< set_dataref
};

/// The overrides this node has set in X-Plane, and nothing else's: each is in the journal before it is set, and taken
/// out after it is released and read back. Thread-safe. Functions that wait for X-Plane say so; those that write to the
/// journal throw core::JournalError, but for releasedByOthers() and refresh(), which report it.
class OverrideManager {
 public:
  /// `report(text, success)`: what happened, for events and the log.
  using Report = std::function<void(const std::string& text, bool success)>;

  OverrideManager(core::SimulatorPort* link, Report report);

  /// Sets what of `wanted` is not set yet, and gives back what was set by an earlier call and is not in `wanted` any
  /// more (its journal entry stays until confirmReleases() has read it back), this also where the journal fails. Writes
  /// to the disk when something is new; without a journal (X-Plane has not been found), and after releaseAll(), nothing
  /// is set.
  /// A DATA row (core::rowName()) is only kept in the journal; released, it gets -999, which X-Plane does not confirm.
  void setRequired(const std::vector<std::string>& wanted);
  /// Sets one, until the holder's release() or the end of the node, whatever setRequired() and other holders do. Not
  /// only overrides: whatever is 0 (or core::releaseOf()) where no client sets it. Without `refreshed`, refresh()
  /// leaves it alone, so that it can be taken back in the simulator. Returns whether it was set: as in setRequired().
  bool acquire(OverrideHolder holder, const std::string& dataref, float value = 1.0F, bool refreshed = true);
  /// The same of several overrides, with one write to the disk. Where one cannot be noted the others are set before it
  /// throws; active() has those that are.
  void acquire(OverrideHolder holder, const std::vector<std::string>& datarefs);
  /// What is to be written right before `dataref`, which is set, is released: by this node, and, as far as
  /// recordPreparations() has brought it into the journal, by its guardian, its next start and
  /// scripts/release_overrides. It is not read back.
  void prepareRelease(const std::string& dataref, std::vector<core::UndoOperation> writes);
  /// Brings what has changed of that into the journal, once a second. Writes to the disk, without holding anything up.
  void recordPreparations();
  /// Another flight begins, with levers of its own: nothing that was prepared in the last one is written any more.
  void forgetPreparations();
  /// Another process has given everything back: nothing is set any more. Released once more, and confirmed.
  void giveBackAll();
  /// Gives one back that acquire() has set for this holder; one that it does not hold, or another one holds, stays as
  /// it is.
  void release(OverrideHolder holder, const std::string& dataref);
  /// Sends all that are set once more: a datagram may have been lost, X-Plane may have been restarted. Not those that
  /// X-Plane shows released.
  void refresh();
  /// What another client has released (the panic tool, a user's script) since the last call, after X-Plane had shown it
  /// set. Its journal entry goes, and it is not set again by itself. Returns those of setRequired(); what acquire() has
  /// set is reported and let go as well, but for what only OverrideHolder::kSurfaces holds, which watches it itself.
  std::vector<std::string> releasedByOthers();
  /// X-Plane does not show who holds a DATA row: once a second, rows whose journal entries another process has taken
  /// out count as released by it, in the next releasedByOthers(). Reads the disk, without holding anything up.
  void watchRows();
  /// X-Plane may have released everything by itself (restarted, another aircraft): that is not another client.
  void forgetShown();
  /// True while a release has not been read back.
  bool releasesPending() const;
  /// The same of one.
  bool releasePending(const std::string& dataref) const;
  /// Reads pending releases back, sending them again; one that X-Plane does not show is tried apart from those that are
  /// new, a few times at once, then every few seconds. Waits up to `timeout_s`.
  void confirmReleases(double timeout_s);
  /// Releases everything; nothing is set after that. Waits up to `timeout_s`. Returns whether X-Plane has shown all of
  /// it; what it has not stays in the journal.
  bool releaseAll(double timeout_s);
  /// Releases what earlier runs have left: by a crash, or because X-Plane had gone before them. What this run has set
  /// meanwhile stays set. Waits up to `timeout_s`. Returns whether nothing is left.
  bool releaseLeftovers(double timeout_s);

  /// Which parts of tx_node hold it; empty: it is not set.
  std::set<OverrideHolder> holders(const std::string& dataref) const;
  /// Set now, by name; those that refresh() repeats.
  std::vector<std::string> active() const;

 private:
  struct Acquired {
    float value = 1.0F;
    bool refreshed = true;
    std::set<OverrideHolder> holders;
  };

  /// What X-Plane shows of one that is set.
  struct Shown {
    bool set = false;        // it has been shown as set
    int released = 0;        // answers since then that show it released
    bool in_journal = true;  // its entry is known to be there
  };

  /// What set() has set, and what it met otherwise.
  struct Outcome {
    std::vector<core::DatarefWrite> set;
    std::exception_ptr failed;
  };

  struct Release {
    std::uint64_t number = 0;  // of all releases
    Retries retries;           // to see it shown
  };

  struct Preparation {
    std::vector<core::UndoOperation> writes;
    std::vector<core::UndoOperation> recorded;  // as the journal has them
  };

  // All with mutex_ held.
  bool isSet(const std::string& dataref) const;
  /// All that is set; nothing is required or acquired any more.
  std::set<std::string> takeAll();
  std::vector<core::UndoOperation> releaseOf(const std::string& dataref) const;
  Outcome set(const std::vector<core::DatarefWrite>& wanted);
  bool set(const std::string& dataref, float value);
  void resend(const std::string& dataref, float value);
  void hold(OverrideHolder holder, const std::string& dataref, float value, bool refreshed);
  void giveBack(const std::string& dataref);
  void updateWatch();
  void onShown(const core::RrefView& view);

  void startRelease(const std::string& dataref);

  void reportReleases(const std::string& released, const std::string& left);

  core::SimulatorPort* link_;
  Report report_;
  const std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();
  std::set<std::string> required_;
  std::map<std::string, Acquired> acquired_;
  std::map<std::string, Release> releasing_;
  std::uint64_t releases_ = 0;
  std::map<std::string, Preparation> prepared_;
  double recorded_at_ = -1e9;         // [s] steady
  double rows_looked_at_ = -1e9;      // [s] steady
  std::vector<std::string> watched_;  // datarefs of the subscription
  std::map<std::string, Shown> shown_;
  bool ended_ = false;               // by releaseAll()
  std::string unreleased_;           // as reported last; of the one thread that waits
  core::Subscription subscription_;  // last: it ends first
};

/// Journal purpose of tx_node's entries.
extern const char* const kOverridePurpose;

}  // namespace xplane_bridge
