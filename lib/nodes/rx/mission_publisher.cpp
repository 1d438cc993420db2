#include "xplane_bridge/nodes/rx/mission_publisher.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "xplane_bridge/core/base/rate_limiter.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"

namespace xplane_bridge {
namespace {

constexpr std::uint32_t kQueueSize = 10;
// Asked for until the aircraft has said how many engines it has: two are enough for most.
constexpr int kFirstGuessOfEngines = 2;

template <class State, class Message>
class TypedMissionPublisher : public MissionPublisher {
 public:
  TypedMissionPublisher(int rate, core::Transport transport, std::string frame, bool publish_unheard,
                        std::optional<SimulatorStamps> stamps)
      : transport_(transport),
        rate_(rate),
        frame_(std::move(frame)),
        publish_unheard_(publish_unheard),
        stamps_(std::move(stamps)),
        limiter_(rate) {
    rebuild();
  }

  core::FieldGroup group() const override { return State::kGroup; }
  int rate() const override { return rate_; }

  void advertise(const Advertiser& topics) override {
    publisher_ = topics.advertise<Message>(std::string("mission/") + core::toString(group()), kQueueSize);
  }

  void configure(core::SimulatorVersion version) override {
    version_ = version;
    rebuild();
  }

  std::vector<std::string> requests() const override {
    std::vector<std::string> paths;
    for (const core::DatarefRequest& request : assembler_->requests()) {
      paths.push_back(request.path);
    }
    return paths;
  }

  const std::vector<std::int32_t>& rows() const override { return assembler_->rows(); }

  bool onRref(const core::RrefView& datagram, std::int64_t receive_ns, const core::ClockFilter& clock) override {
    if (!assembler_->add(datagram, receive_ns)) {
      return false;
    }
    if (transport_ == core::Transport::kRref) {
      publish(assembler_->assemble(nullptr, receive_ns, clock), clock);
    }
    return adoptEngines();
  }

  void onRows(const core::RowStore& rows, std::int64_t receive_ns, const core::ClockFilter& clock) override {
    if (limiter_.due(receive_ns)) {
      publish(assembler_->assemble(&rows, receive_ns, clock), clock);
    }
  }

  void reset() override { assembler_->reset(); }

 private:
  void rebuild() {
    typename core::MissionAssembler<State>::Options options;
    options.transport = transport_;
    options.version = version_;
    options.rate = rate_;
    options.engines = engines_;
    assembler_ = std::make_unique<core::MissionAssembler<State>>(options);
  }

  void publish(State state, const core::ClockFilter& clock) {
    noteEngines(state);
    if (stamps_) {
      state.stamp_ns = std::isfinite(state.sim_time)
                           ? stamps_->start_ns + core::toNanoseconds(clock.unwrap(state.sim_time))
                           : stamps_->clock.system_ns();
    }
    if (muted_) return;
    ++report_.published;
    report_.missing = allBits() & ~state.valid;
    report_.stamp_ns = state.stamp_ns;
    if (publish_unheard_ || publisher_.getNumSubscribers() > 0) {
      toMessage(state, frame_, &message_);
      publisher_.publish(message_);
    }
  }

  static std::uint32_t allBits() { return static_cast<std::uint32_t>(Message::VALID_ALL); }

  void noteEngines(const core::EngineStates& state) {
    if (state.count > 0) {
      engines_seen_ = std::min<int>(state.count, core::kMaxEngines);
    }
  }
  template <class Other>
  void noteEngines(const Other&) {}

  bool adoptEngines() {
    if (engines_seen_ == 0 || engines_seen_ == engines_) {
      return false;
    }
    engines_ = engines_seen_;
    rebuild();
    return true;
  }

  core::Transport transport_;
  core::SimulatorVersion version_;
  int rate_;
  int engines_ = kFirstGuessOfEngines;
  int engines_seen_ = 0;
  std::string frame_;
  bool publish_unheard_;
  std::optional<SimulatorStamps> stamps_;
  core::RateLimiter limiter_;
  std::unique_ptr<core::MissionAssembler<State>> assembler_;
  ros::Publisher publisher_;
  Message message_;
};

/// Calls f with a null pointer to each of a tuple's types.
template <class F, class... Types>
void forEachType(F f, std::tuple<Types...>*) {
  (f(static_cast<Types*>(nullptr)), ...);
}

}  // namespace

std::vector<std::unique_ptr<MissionPublisher>> makeMissionPublishers(
    const std::array<int, core::kFieldGroupCount>& rates, core::Transport transport, const FrameNames& frames,
    bool publish_unheard, const std::optional<SimulatorStamps>& stamps) {
  std::vector<std::unique_ptr<MissionPublisher>> publishers;
  const auto add = [&](auto* pair) {
    using State = typename std::remove_pointer_t<decltype(pair)>::first_type;
    using Message = typename std::remove_pointer_t<decltype(pair)>::second_type;
    const int rate = rates[static_cast<std::size_t>(State::kGroup)];
    if (rate > 0) {
      publishers.push_back(std::make_unique<TypedMissionPublisher<State, Message>>(
          rate, transport, frames.base_link_frd, publish_unheard, stamps));
    }
  };
  forEachType(add, static_cast<MissionMessages*>(nullptr));
  return publishers;
}

}  // namespace xplane_bridge
