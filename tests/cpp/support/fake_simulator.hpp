#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "xplane_bridge/core/link/simulator_port.hpp"

namespace xplane_bridge::core {

/// A SimulatorPort with X-Plane behind it, played by the test in one thread under a clock that only frame() moves.
///
/// X-Plane knows the datarefs that were set(), no others: it answers to no other, and drops writes to them. frame()
/// renders: time passes, then every subscription that is due at its rate gets the values as they are now, and reads are
/// served. A waiting read renders frames of kFrame itself until it has what it wants, or until its time is over by the
/// fake clock, so that a waiting call under test returns at once.
///
/// Messages are taken as bytes, by a decoder of the fake's own. The journal is a real one, in a folder of its own.
class FakeSimulator : public SimulatorPort {
 public:
  static constexpr double kFrame = 0.02;  // [s]

  /// What was sent, in order. DREF: path and value; CMND: path; else the bytes after the label's five.
  struct Message {
    std::string label;  // "DREF"
    std::string path;
    float value = 0.0F;
    std::vector<std::uint8_t> body;
    double time = 0.0;  // [s] of the fake clock
    friend bool operator==(const Message& a, const Message& b) {
      return a.label == b.label && a.path == b.path && a.value == b.value;
    }
  };

  /// X-Plane is found and answers, unless the test sets another state.
  explicit FakeSimulator(SimulatorVersion version = kXPlane11) {
    std::string pattern = (std::filesystem::temp_directory_path() / "fake-simulator-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    useJournal(folder_ + "/journal.json");
    status_.peer = {kLoopbackAddress, 49000};
    setVersion(version);
    set("sim/time/paused", 0.0F);
    set(kSimTime, 100.0F);
    set(kFramePeriod, static_cast<float>(kFrame));
    setState(LinkState::kConnected);
  }
  ~FakeSimulator() override {
    *alive_ = false;
    std::filesystem::remove_all(folder_);
  }
  FakeSimulator(const FakeSimulator&) = delete;
  FakeSimulator& operator=(const FakeSimulator&) = delete;

  // ------------------------------------------------------------------------------------------ the test plays X-Plane

  /// X-Plane, its user or another client changes a dataref, or has one more from now on.
  void set(const std::string& path, float value) { datarefs_[path] = value; }
  void setAll(const std::vector<std::string>& paths, float value) {
    for (const std::string& path : paths) {
      set(path, value);
    }
  }
  /// As X-Plane has it. Throws std::out_of_range for one that it does not know.
  float value(const std::string& path) const { return datarefs_.at(path); }
  /// Writes through the port do not change it any more, or do again.
  void setReadOnly(const std::string& path, bool read_only = true) {
    read_only ? static_cast<void>(read_only_.insert(path)) : static_cast<void>(read_only_.erase(path));
  }
  /// The next messages get lost on the way.
  void loseMessages(int count) { to_lose_ = count; }
  /// Called for each message before X-Plane takes it: what is in the journal by then?
  std::function<void(const Message&)> on_message;

  /// Called for each frame, once its time has come and before its values are sent: what X-Plane moves by itself, and
  /// what else happens while a call under test waits.
  std::function<void()> on_frame;

  /// One frame. While X-Plane does not answer (SEARCHING, STALE, LOST), time passes and nothing is delivered.
  void frame(double dt = kFrame) {
    now_ns_ += static_cast<std::int64_t>(std::llround(dt * 1e9));
    clock_.waiters->wake(now_ns_);
    if (answers()) {
      if (status_.state == LinkState::kConnected) {
        datarefs_[kSimTime] += static_cast<float>(dt);
      }
      datarefs_[kFramePeriod] = static_cast<float>(dt);
      status_.sim_time_s = datarefs_[kSimTime];
    }
    if (on_frame) {
      on_frame();
    }
    if (answers()) {
      deliver();
    }
    serveReads();
  }
  void run(double seconds, double dt = kFrame) {
    const auto frames = static_cast<int>(std::lround(seconds / dt));
    for (int i = 0; i < frames; ++i) {
      frame(dt);
    }
  }

  /// The link's state from now on. Coming from SEARCHING or LOST, X-Plane counts as new: the epoch is raised.
  void setState(LinkState state) {
    const bool was_away = status_.state == LinkState::kSearching || status_.state == LinkState::kLost;
    const bool is_there = core::answers(state);
    if (was_away && is_there) {
      ++status_.epoch;
    }
    status_.state = state;
    status_.since_steady_ns = now_ns_;
    status_.paused = state == LinkState::kPaused;
    datarefs_["sim/time/paused"] = state == LinkState::kPaused ? 1.0F : 0.0F;
  }
  /// Another run of X-Plane, noticed by its time: connected, a new epoch. Datarefs are the test's to set.
  void restart() {
    datarefs_[kSimTime] = 1.0F;
    ++status_.epoch;
    setState(LinkState::kConnected);
  }
  /// X-Plane has not been found: nothing can be sent, there is no journal.
  void forgetPeer() {
    status_.peer = {};
    setState(LinkState::kSearching);
  }
  void setVersion(SimulatorVersion version) {
    status_.version = version;
    set("sim/version/xplane_internal_version", static_cast<float>(version.number));
  }
  /// From now on every use of the journal throws JournalError, as with a full disk; or works again.
  void breakJournal(bool broken = true) {
    const std::string file = folder_ + "/no-folder";
    std::ofstream(file) << "a file where the journal's folder should be";
    useJournal(broken ? file + "/journal.json" : folder_ + "/journal.json");
  }
  /// The same journal as another process has it: of a run that has crashed since, or of one that is `alive`.
  Journal journalOfAnother(bool alive = false) const {
    JournalOwner other = self_;
    other.pid = alive ? kAlivePid : kAlivePid + 1;
    return {folder_ + "/journal.json", other, isAlivePid};
  }
  std::string folder() const { return folder_; }

  // ----------------------------------------------------------------------------------------------- what was sent

  const std::vector<Message>& messages() const { return messages_; }
  /// Of DREF messages: path and value.
  std::vector<std::pair<std::string, float>> writes() const {
    std::vector<std::pair<std::string, float>> out;
    for (const Message& message : messages_) {
      if (message.label == "DREF") {
        out.emplace_back(message.path, message.value);
      }
    }
    return out;
  }
  std::vector<std::string> commands() const {
    std::vector<std::string> out;
    for (const Message& message : messages_) {
      if (message.label == "CMND") {
        out.push_back(message.path);
      }
    }
    return out;
  }
  void clearMessages() { messages_.clear(); }
  /// Datarefs that are subscribed at the moment, sorted.
  std::multiset<std::string> subscribed() const {
    std::multiset<std::string> out;
    for (const auto& each : groups_) {
      out.insert(each->group.datarefs.begin(), each->group.datarefs.end());
    }
    return out;
  }
  double time() const { return static_cast<double>(now_ns_) * 1e-9; }

  // ------------------------------------------------------------------------------------------------ SimulatorPort

  using SimulatorPort::read;
  using SimulatorPort::subscribe;

  Subscription subscribe(RrefGroup group, RrefHandler handler, std::shared_ptr<HandlerMutex> mutex) override {
    auto delivery = std::make_shared<RrefDelivery>(std::move(handler), std::move(mutex));
    const auto change = [this, alive = alive_, delivery](std::uint32_t list, std::optional<RrefGroup> now) {
      if (*alive) {
        this->change(delivery, list, std::move(now));
      }
    };
    return {delivery, change, std::move(group)};
  }

  SendStatus send(ByteView bytes) override {
    if (!status_.peer.valid()) {
      return SendStatus::kNoPeer;
    }
    Message message;
    message.label.assign(bytes.data(), bytes.data() + 4);
    message.body.assign(bytes.data() + 5, bytes.data() + bytes.size());
    message.time = time();
    const auto* text = reinterpret_cast<const char*>(message.body.data());
    if (message.label == "DREF") {
      std::memcpy(&message.value, message.body.data(), sizeof message.value);
      message.path.assign(text + 4, strnlen(text + 4, message.body.size() - 4));
    } else if (message.label == "CMND") {
      message.path.assign(text, strnlen(text, message.body.size()));
    }
    if (on_message) {
      on_message(message);
    }
    messages_.push_back(message);
    if (to_lose_ > 0) {
      --to_lose_;
    } else if (answers() && message.label == "DREF" && read_only_.count(message.path) == 0) {
      if (const auto known = datarefs_.find(message.path); known != datarefs_.end()) {
        known->second = message.value;
      }
    }
    return SendStatus::kSent;
  }

  void read(std::vector<std::string> paths, double timeout_s, DatarefReader::Done done) override {
    for (const std::string& path : paths) {
      if (path.empty()) {
        throw std::invalid_argument("an empty path is no dataref");
      }
    }
    reads_.push_back({std::move(paths), now_ns_ + static_cast<std::int64_t>(timeout_s * 1e9), std::move(done)});
  }

  std::vector<DatarefValue> readUntil(std::vector<std::string> paths, double timeout_s,
                                      DatarefReader::Accept accept) override {
    mustNotBeHandling();
    const std::int64_t deadline_ns = now_ns_ + static_cast<std::int64_t>(timeout_s * 1e9);
    std::vector<DatarefValue> values(paths.size());
    do {
      frame();
      const bool all = answers() && look(paths, &values);
      if (all && (!accept || accept(values))) {
        break;
      }
    } while (now_ns_ < deadline_ns);
    return values;
  }

  bool waitUntil(const std::function<bool()>& condition, double timeout_s) override {
    mustNotBeHandling();
    const std::int64_t deadline_ns = now_ns_ + static_cast<std::int64_t>(timeout_s * 1e9);
    while (!condition()) {
      if (now_ns_ >= deadline_ns) {
        return false;
      }
      frame();
    }
    return true;
  }

  LinkStatus status() const override { return status_; }
  std::shared_ptr<Journal> journal() const override { return status_.peer.valid() ? journal_ : nullptr; }
  const Clock& clock() const override { return clock_; }

 private:
  static constexpr const char* kSimTime = "sim/time/total_running_time_sec";
  static constexpr const char* kFramePeriod = "sim/operation/misc/frame_rate_period";

  static constexpr std::int64_t kAlivePid = 1;  // never the test's own

  struct Group {
    std::shared_ptr<RrefDelivery> delivery;
    std::uint32_t list = 0;
    RrefGroup group;
    std::int64_t due_ns = 0;
  };
  struct Read {
    std::vector<std::string> paths;
    std::int64_t deadline_ns = 0;
    DatarefReader::Done done;
  };

  void mustNotBeHandling() const {
    if (delivering_) {
      throw std::logic_error("a handler of the link must not wait");
    }
  }

  bool answers() const { return status_.up(); }

  static bool isAlivePid(const JournalOwner& owner) { return owner.pid == kAlivePid; }
  void useJournal(const std::string& path) { journal_ = std::make_shared<Journal>(path, self_, isAlivePid); }

  void change(const std::shared_ptr<RrefDelivery>& delivery, std::uint32_t list, std::optional<RrefGroup> now) {
    if (now) {
      RrefSubscription checked(*now);  // what it refuses, the real link refuses
    }
    groups_.erase(
        std::remove_if(groups_.begin(), groups_.end(), [&](const auto& each) { return each->delivery == delivery; }),
        groups_.end());
    if (now) {
      groups_.push_back(std::make_shared<Group>(Group{delivery, list, std::move(*now), now_ns_}));
    }
  }

  void deliver() {
    delivering_ = true;
    const auto groups = groups_;  // handlers may change them
    for (const auto& each : groups) {
      if (now_ns_ < each->due_ns) {
        continue;
      }
      each->due_ns = now_ns_ + 1'000'000'000 / each->group.rate_hz;
      std::vector<std::uint8_t> pairs;
      for (std::size_t i = 0; i < each->group.datarefs.size(); ++i) {
        const auto known = datarefs_.find(each->group.datarefs[i]);
        if (known == datarefs_.end()) {
          continue;
        }
        std::array<std::uint8_t, 8> pair{};
        const auto index = static_cast<std::int32_t>(i);
        std::memcpy(pair.data(), &index, 4);
        std::memcpy(pair.data() + 4, &known->second, 4);
        pairs.insert(pairs.end(), pair.begin(), pair.end());
      }
      if (pairs.empty()) {
        continue;
      }
      ReceiveInfo info;
      info.stamp_ns = clock_.system_ns();
      info.kernel_stamp = true;
      info.steady_ns = now_ns_;
      info.link_epoch = status_.epoch;
      info.from = status_.peer;
      each->delivery->deliver(each->list, RrefView(pairs.data(), pairs.size() / 8), info);
    }
    delivering_ = false;
  }

  bool look(const std::vector<std::string>& paths, std::vector<DatarefValue>* values) const {
    bool all = true;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const auto known = datarefs_.find(paths[i]);
      all = all && known != datarefs_.end();
      if (known != datarefs_.end()) {
        (*values)[i] = known->second;
      }
    }
    return all;
  }

  void serveReads() {
    std::vector<Read> waiting = std::exchange(reads_, {});
    delivering_ = true;
    for (Read& read : waiting) {
      std::vector<DatarefValue> values(read.paths.size());
      if ((answers() && look(read.paths, &values)) || now_ns_ >= read.deadline_ns) {
        read.done(values);
      } else {
        reads_.push_back(std::move(read));
      }
    }
    delivering_ = false;
  }

  std::string folder_;
  const JournalOwner self_ = thisProcess("/fake");
  std::shared_ptr<Journal> journal_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::atomic<std::int64_t> now_ns_{5'000'000'000'000};
  const Clock clock_{[this] { return now_ns_.load(); }, [this] { return now_ns_ + 1'000'000'000'000'000; },
                     std::make_shared<ClockWaiters>()};
  LinkStatus status_;
  std::map<std::string, float> datarefs_;
  std::set<std::string> read_only_;
  int to_lose_ = 0;
  std::vector<Message> messages_;
  std::vector<std::shared_ptr<Group>> groups_;
  std::vector<Read> reads_;
  bool delivering_ = false;
};

}  // namespace xplane_bridge::core
