#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/lockstep_clock.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"

namespace xplane_bridge::core {

/// The dataref by which a simulator in lock-step ends its frames; written with a frame's number, it flies on. Its
/// elements are that number, whole seconds and microseconds of simulated time, and the number of the frame that the
/// simulator's window shows.
constexpr const char* kFenceDataref = "xplane_bridge/lockstep";
/// Its element is the port of the socket that gets every fence of a node. The others that ask for it get a fence in the
/// frames in which they get something else, at the end of that datagram; its value says how many sockets do.
constexpr const char* kFenceGroupDataref = "xplane_bridge/lockstep_group";

/// One frame of a simulator in lock-step. Number 0 stands: it comes again and again until it is answered.
struct LockstepFrame {
  std::uint32_t number = 0;
  std::int64_t sim_ns = 0;    ///< [ns] simulated time
  std::uint32_t picture = 0;  ///< number of the frame whose picture the window shows, drawn by now; 0: there is none
};

/// What a node does in each frame; called from the thread that receives, in this order. All must be set.
struct LockstepHooks {
  /// All of the frame is here and the clock shows its time; nothing of it has been handled. Not called for frame 0.
  std::function<void(const LockstepFrame&)> begin;
  /// All of the frame was handled; whether all else that belongs to it is here, too. Asked again after each wake().
  std::function<bool(const LockstepFrame&)> ready;
  /// What the frame leads to is to be done and sent.
  std::function<void(const LockstepFrame&)> close;
  /// All of that has been sent, calls of other threads before close() too. The next frame may be asked for.
  std::function<void(const LockstepFrame&)> end;
};

/// Datagrams of a simulator in lock-step, frame by frame: all that belongs to a frame is handed out at once, by source
/// and in its order, when the fences of all sources have come, whatever the order and delays of the network.
///
/// Stands over another hub. Fences are asked for on every source on which something is asked for, and not handed out.
/// While the clock is held, and once it is released, datagrams are handed out as they come, held ones with their fence.
class LockstepHub : public DatagramHub {
 public:
  /// [ms] Longest wait while the clock goes at the host's pace: held or released.
  static constexpr int kLongestWaitMs = 5;

  LockstepHub(std::unique_ptr<DatagramHub> inner, LockstepClock clock, Clock host, LockstepHooks hooks);
  ~LockstepHub() override;

  std::shared_ptr<DatagramSource> open(const std::string& name, const UdpSocketOptions& options) override;
  void wake() override { inner_->wake(); }
  void ignore(const DatagramSource& source) override;
  void wait(int timeout_ms) override;
  bool hasInput(const DatagramSource& source) const override;
  bool busy() const override;
  int fd() const override { return fd_; }

 private:
  class Source;
  struct Retired {
    std::shared_ptr<Source> source;
    int frames;
  };
  enum class Stage : std::uint8_t { kCollecting, kHandling, kAnswering, kClosing };

  void gatherBehindAnother(const std::vector<std::shared_ptr<Source>>& all);
  void askForFence(Source* source);
  void askAgain();
  void collect(int timeout_ms);
  std::shared_ptr<Source> missing();
  void collectFrame(int timeout_ms);
  void listenTo(const std::shared_ptr<Source>& source);
  void handOutFrame();
  void takeAll();
  void take(Source* source);
  bool frameIsComplete() const;
  void goToNewestFrame();
  void forgetRetired();
  void handOut(bool whole_frame);
  bool anythingHandedOut() const;
  void waitHeld(int timeout_ms);
  void waitReleased(int timeout_ms);
  bool advance(int timeout_ms);
  void goOn(int timeout_ms);
  std::vector<std::shared_ptr<Source>> sources() const;

  const std::unique_ptr<DatagramHub> inner_;
  LockstepClock clock_;
  const Clock host_;
  const LockstepHooks hooks_;

  mutable std::mutex mutex_;  // guards the list, and what of a source is asked for
  std::vector<std::weak_ptr<Source>> sources_;
  std::uint16_t group_ = 0;    // port of the source that gets every fence
  std::int64_t asked_ns_ = 0;  // [ns] of the host's steady clock

  // Of the thread that receives.
  std::vector<std::shared_ptr<Source>> open_;  // in wait() only: what is closed meanwhile is closed at once
  Stage stage_ = Stage::kCollecting;
  int passes_ = 0;
  LockstepFrame frame_;
  std::uint32_t released_frame_ = 0;  // newest one let go after release()
  std::vector<Retired> retired_;      // ignored, perhaps while a frame is under way that counts them
  const Source* awaited_ = nullptr;   // whose fence was missing last; compared only
  std::vector<std::uint8_t> buffer_;
  int fd_ = -1;
  std::weak_ptr<Source> listened_to_;  // by fd_; none: any
};

}  // namespace xplane_bridge::core
