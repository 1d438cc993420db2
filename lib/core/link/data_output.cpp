#include "xplane_bridge/core/link/data_output.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge::core {
namespace {

constexpr const char* kEntryId = "data_output";
constexpr const char* kPurpose = "data_output";

/// Without DATA, or without one row, until something is done [s], and in periods of Data Output.
constexpr double kQuiet = 1.0;
constexpr double kQuietPeriods = 3.0;
constexpr int kMaxTries = 3;
/// Between two times that X-Plane is asked what its Data Output was.
constexpr std::int64_t kAskAgainNs = 5 * kNanosecondsPerSecond;
constexpr float kRateTolerance = 0.5F;  // the dataref is an int

std::string listOf(const std::vector<std::int32_t>& rows) {
  return join(rows, ", ", [](std::int32_t row) { return std::to_string(row); });
}

template <typename T>
const T* findOperation(const JournalEntry& entry) {
  for (const UndoOperation& operation : entry.undo) {
    if (const T* found = std::get_if<T>(&operation)) {
      return found;
    }
  }
  return nullptr;
}

}  // namespace

std::string dataRowDataref(std::int32_t row) {
  return "sim/network/dataout/data_to_internet[" + std::to_string(row) + "]";
}

DataOutput::DataOutput(DataOutputOptions options, double read_timeout_s, Services services)
    : options_(std::move(options)),
      read_timeout_s_(read_timeout_s),
      services_(std::move(services)),
      quiet_ns_(toNanoseconds(std::max(kQuiet, kQuietPeriods / static_cast<double>(options_.rate_hz)))) {}

void DataOutput::linkUp(const Endpoint& target, std::int64_t now_ns) {
  target_ = target;
  ++generation_;
  ever_heard_ = false;
  taken_back_ = false;
  tries_ = 0;
  startWaiting(now_ns);
  ask_again_ns_ = now_ns;
  row_repairs_ = 0;
  row_problem_ = false;
  quiet_problem_ = false;
  problem_.clear();
  if (options_.enabled && options_.configure) {
    readPrevious();
    return;
  }
  phase_ = options_.enabled ? Phase::kActive : Phase::kIdle;
  if (options_.restore_leftovers && journal_ != nullptr) {
    restoreLeftovers();
  }
}

void DataOutput::startWaiting(std::int64_t now_ns) {
  quiet_since_ns_ = now_ns;
  row_heard_ns_.fill(now_ns);
}

void DataOutput::fail(const std::string& problem) {
  phase_ = Phase::kFailed;
  problem_ = problem;
  services_.log(LogLevel::kError, problem);
}

std::optional<JournalEntry> DataOutput::previousEntry() const {
  for (const std::vector<JournalEntry>& entries : {journal_->own(), journal_->orphans(kPurpose)}) {
    for (const JournalEntry& entry : entries) {
      if (entry.id == kEntryId) {
        return entry;
      }
    }
  }
  return std::nullopt;
}

void DataOutput::readPrevious() {
  phase_ = Phase::kReading;
  interrupted_ = false;
  asked_rows_ = options_.rows;
  std::vector<std::string> paths = {kDataRateDataref};
  for (const std::int32_t row : asked_rows_) {
    paths.push_back(dataRowDataref(row));
  }
  services_.read(std::move(paths), read_timeout_s_, {},
                 [this, generation = generation_](const std::vector<DatarefValue>& values) {
                   if (generation == generation_ && phase_ == Phase::kReading) {
                     configure(values);
                   }
                 });
}

void DataOutput::configure(const std::vector<DatarefValue>& values) {
  const bool complete =
      std::all_of(values.begin(), values.end(), [](const DatarefValue& value) { return value.has_value(); });
  if (!values[0].has_value() || (interrupted_ && !complete)) {
    // Nothing is changed that could not be put back.
    phase_ = Phase::kUnanswered;
    const std::string problem =
        std::string("Data Output is not configured: X-Plane does not answer ") + kDataRateDataref +
        ", so the rate could not be restored; set Data Output in X-Plane by hand and configure_xplane: false, or use "
        "transport: rref";
    if (!interrupted_ && std::exchange(problem_, problem) != problem) {
      services_.log(LogLevel::kError, problem);
    }
    return;
  }
  float rate_before = *values[0];
  std::vector<std::int32_t> rows_before_off;
  std::vector<std::int32_t> rows_unknown;
  for (std::size_t i = 0; i < asked_rows_.size(); ++i) {
    const DatarefValue& selected = values[i + 1];
    if (!selected.has_value()) {
      rows_unknown.push_back(asked_rows_[i]);
    } else if (*selected == 0.0F) {
      rows_before_off.push_back(asked_rows_[i]);
    }
  }
  if (!rows_unknown.empty()) {
    services_.log(LogLevel::kWarn, "X-Plane does not report whether Data Output rows " + listOf(rows_unknown) +
                                       " were selected: they are selected now and will stay so");
  }
  try {
    // What an earlier run or link of ours has changed is still to be undone, to what it was before that.
    if (const std::optional<JournalEntry> previous = previousEntry()) {
      if (const auto* usel = findOperation<UndoUsel>(*previous)) {
        for (const std::int32_t row : usel->rows) {
          if (std::find(rows_before_off.begin(), rows_before_off.end(), row) == rows_before_off.end()) {
            rows_before_off.push_back(row);
          }
        }
      }
      if (const auto* rate = findOperation<UndoDref>(*previous)) {
        rate_before = rate->value;
      }
    }
    std::vector<UndoOperation> undo;
    if (!rows_before_off.empty()) {
      std::sort(rows_before_off.begin(), rows_before_off.end());
      undo.emplace_back(UndoUsel{rows_before_off});
    }
    undo.emplace_back(UndoDref{kDataRateDataref, rate_before});
    undo.emplace_back(UndoIse4{kIse4DataOutput, target_.addressString(), target_.port});
    journal_->record(kEntryId, kPurpose, undo);
  } catch (const JournalError& error) {
    fail(std::string("Data Output is not configured, because what it was before cannot be written down: ") +
         error.what());
    return;
  }
  phase_ = Phase::kActive;
  problem_.clear();
  row_problem_ = false;
  tries_ = 1;
  services_.log(LogLevel::kInfo, "Data Output of X-Plane set to rows " + listOf(asked_rows_) + " at " +
                                     std::to_string(options_.rate_hz) + " Hz to " + target_.toString());
  sendSettings(asked_rows_);
}

void DataOutput::sendSettings(const std::vector<std::int32_t>& rows) {
  std::array<std::uint8_t, kMaxDselSize> buffer;
  if (const EncodeResult size = encodeDsel(buffer, rows.data(), rows.size())) {
    services_.send({buffer.data(), *size});
  }
  if (const EncodeResult size = encodeDref(buffer, kDataRateDataref, static_cast<float>(options_.rate_hz))) {
    services_.send({buffer.data(), *size});
  }
  if (const EncodeResult size = encodeIse4(buffer, kIse4DataOutput, target_.addressString(), target_.port, true)) {
    services_.send({buffer.data(), *size});
  }
}

void DataOutput::heard(const DataView& data, std::int64_t now_ns) {
  ever_heard_ = true;
  quiet_since_ns_ = now_ns;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (data[i].hasKnownIndex()) {
      row_heard_ns_[static_cast<std::size_t>(data[i].index())] = now_ns;
    }
  }
  if (quiet_problem_) {
    quiet_problem_ = false;
    phase_ = Phase::kActive;
    problem_.clear();
    services_.log(LogLevel::kInfo, "DATA arrives again");
  }
}

void DataOutput::update(bool flowing, std::int64_t now_ns) {
  interrupted_ = interrupted_ || !flowing;
  if (phase_ == Phase::kUnanswered && flowing && now_ns >= ask_again_ns_) {
    ask_again_ns_ = now_ns + kAskAgainNs;
    startWaiting(now_ns);
    readPrevious();
  }
  if (phase_ != Phase::kActive) {
    return;
  }
  if (!flowing) {
    startWaiting(now_ns);
    return;
  }
  if (now_ns - quiet_since_ns_ > quiet_ns_) {
    startWaiting(now_ns);
    handleQuiet();
  } else if (ever_heard_) {
    repairRows(now_ns);
  }
}

void DataOutput::handleQuiet() {
  const std::string where = " at " + target_.toString() + " although X-Plane answers";
  if (!options_.configure) {
    problem_ = "no DATA arrives" + where + ": in X-Plane's Data Output select the rows for network via UDP and this " +
               "address and port, or use configure_xplane: true";
    if (!std::exchange(quiet_problem_, true)) {
      services_.log(LogLevel::kWarn, problem_);
    }
  } else if (!ever_heard_ && tries_ < kMaxTries) {
    ++tries_;
    sendSettings(options_.rows);
  } else if (ever_heard_ && !taken_back_) {
    taken_back_ = true;
    services_.log(LogLevel::kWarn, "DATA has stopped" + where + ": taking Data Output back once");
    sendSettings(options_.rows);
  } else {
    phase_ = Phase::kForeign;
    quiet_problem_ = true;
    problem_ = ever_heard_ ? "another client owns Data Output: X-Plane sends DATA to one address only, and not to " +
                                 target_.toString() + " any more; end the other client, or use transport: rref"
                           : "no DATA arrives" + where +
                                 ": a firewall in between, an address X-Plane cannot reach (see data_address), or "
                                 "another client that owns Data Output";
    services_.log(LogLevel::kError, problem_);
  }
}

void DataOutput::repairRows(std::int64_t now_ns) {
  std::vector<std::int32_t> missing;
  for (const std::int32_t row : options_.rows) {
    if (now_ns - row_heard_ns_[static_cast<std::size_t>(row)] > quiet_ns_) {
      missing.push_back(row);
    }
  }
  if (missing.empty()) {
    if (row_problem_) {
      row_problem_ = false;
      problem_.clear();
    }
    return;
  }
  if (options_.configure && row_repairs_ < kMaxTries) {
    ++row_repairs_;
    services_.log(LogLevel::kWarn, "rows " + listOf(missing) + " are missing from DATA: selecting them again");
    sendSettings(missing);
    for (const std::int32_t row : missing) {
      row_heard_ns_[static_cast<std::size_t>(row)] = now_ns;
    }
  } else if (!row_problem_) {
    row_problem_ = true;
    problem_ = "rows " + listOf(missing) + " do not arrive in DATA: this X-Plane does not have them, or " +
               (options_.configure ? "another client switches them off" : "they are not selected in Data Output");
    services_.log(LogLevel::kWarn, problem_);
  }
}

void DataOutput::setRows(std::vector<std::int32_t> rows) {
  options_.rows = std::move(rows);
  row_repairs_ = 0;
  if (options_.enabled && options_.configure && phase_ != Phase::kIdle && phase_ != Phase::kReleasing) {
    ++generation_;
    readPrevious();
  }
}

void DataOutput::restoreLeftovers() {
  try {
    for (const JournalEntry& entry : journal_->orphans(kPurpose)) {
      services_.log(LogLevel::kWarn, "restoring Data Output of X-Plane after a run of " + entry.owner.node +
                                         " that ended without doing so");
      undoEntry(entry, read_timeout_s_, [this, id = entry.id](bool undone) {
        if (undone) {
          forget(id);
        } else {
          services_.log(LogLevel::kError, "Data Output could not be restored; " + journal_->path() + " keeps it");
        }
      });
    }
  } catch (const JournalError& error) {
    services_.log(LogLevel::kError, error.what());
  }
}

bool DataOutput::forget(const std::string& id) {
  try {
    journal_->remove({id});
    return true;
  } catch (const JournalError& error) {
    services_.log(LogLevel::kError, error.what());
    return false;
  }
}

void DataOutput::undoEntry(const JournalEntry& entry, double timeout_s, const std::function<void(bool)>& done,
                           int attempt) {
  constexpr int kAttempts = 2;  // a datagram may be lost
  std::vector<std::string> paths;
  std::vector<float> expected;
  std::array<std::uint8_t, kMaxUndoSize> buffer;
  for (const UndoOperation& operation : entry.undo) {
    if (const EncodeResult size = encodeUndo(buffer, operation)) {
      services_.send({buffer.data(), *size});
    }
    if (const auto* dref = std::get_if<UndoDref>(&operation)) {
      paths.push_back(dref->path);
      expected.push_back(dref->value);
    } else if (const auto* usel = std::get_if<UndoUsel>(&operation)) {
      for (const std::int32_t row : usel->rows) {
        paths.push_back(dataRowDataref(row));
        expected.push_back(0.0F);
      }
    }
  }
  const DatarefReader::Accept fits = [expected](const std::vector<DatarefValue>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!values[i].has_value() || !(std::abs(*values[i] - expected[i]) <= kRateTolerance)) {
        return false;
      }
    }
    return true;
  };
  const double share = timeout_s / (kAttempts - attempt);
  services_.read(std::move(paths), share, fits,
                 [this, entry, timeout_s, share, done, attempt, fits](const std::vector<DatarefValue>& values) {
                   if (fits(values) || attempt + 1 == kAttempts) {
                     done(fits(values));
                   } else {
                     undoEntry(entry, timeout_s - share, done, attempt + 1);
                   }
                 });
}

void DataOutput::release(double timeout_s, std::function<void(bool)> done) {
  ++generation_;
  const bool of_another = phase_ == Phase::kForeign && ever_heard_;
  phase_ = Phase::kReleasing;
  if (!options_.enabled || !options_.configure || journal_ == nullptr) {
    done(true);
    return;
  }
  try {
    const std::optional<JournalEntry> entry = previousEntry();
    if (!entry.has_value()) {
      done(true);
      return;
    }
    if (of_another) {
      services_.log(LogLevel::kInfo, "Data Output of X-Plane is left as it is, with the client that owns it now");
      done(forget(entry->id));
      return;
    }
    undoEntry(*entry, timeout_s,
              [this, id = entry->id, done = std::move(done)](bool undone) { done(undone && forget(id)); });
  } catch (const JournalError& error) {
    services_.log(LogLevel::kError, error.what());
    done(false);
  }
}

}  // namespace xplane_bridge::core
