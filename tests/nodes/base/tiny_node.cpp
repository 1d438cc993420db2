// The smallest node that uses everything BaseNode offers; it has nothing to do with X-Plane's state, which shows that
// the base class is reusable. Driven by test_base_node.py.

#include <time.h>

#include <fstream>
#include <future>
#include <string>
#include <thread>

#include <std_msgs/Float64.h>
#include <std_msgs/String.h>

#include "xplane_bridge/GetDataref.h"
#include "xplane_bridge/nodes/base/base_node.hpp"

namespace xplane_bridge {
namespace {

class TinyNode : public BaseNode {
 protected:
  bool usesLink() const override { return false; }

  void loadParameters(const ParamLoader& own) override {
    gain_ = own.number("gain", {0.0, 10.0}, 1.0);
    mode_ = own.choice("mode", {"calm", "fail_at_start", "hang_in_undo", "rest_in_undo", "fail_later", "await_nudge"},
                       "calm");
    trace_.open(own.text("trace_file"));
    const ParamLoader limits = own.section("limits");
    limit_ = limits.number("upper", {}, 100.0);
  }

  void advertise() override {
    pong_ = advertiseTopic<std_msgs::Float64>("pong", 1);
    last_word_ = advertiseTopic<std_msgs::String>("last_word", 1, true);
    addDiagnostics("tiny", [this](diagnostic_updater::DiagnosticStatusWrapper& status) {
      status.summary(diagnostic_msgs::DiagnosticStatus::OK, "alive");
      status.add("Gain (-)", gain_);
    });
    advertiseService<GetDataref::Request, GetDataref::Response>(
        "endless_echo", [this](const GetDataref::Request& request, GetDataref::Response& response) {
          trace("echoing");
          response.success = joined_.get_future().wait_for(kPatience) == std::future_status::ready;
          response.result.message = request.name;
          trace("echoed");
        });
  }

  void subscribe() override {
    subscribeTopic<std_msgs::String>(
        "nudge", 1, [this](const std_msgs::StringConstPtr&) { nudged_.set_value(); }, Served::kWhereRead);
    subscribeTopic<std_msgs::Float64>("ping", 1, [this](const std_msgs::Float64ConstPtr& ping) {
      if (mode_ == "await_nudge") {
        trace("waits");
        if (nudged_.get_future().wait_for(kPatience) != std::future_status::ready) return;
      }
      std_msgs::Float64 pong;
      pong.data = std::min(gain_ * ping->data, limit_);
      pong_.publish(pong);
      if (mode_ == "fail_later") {
        requestStop("the test wanted it", ExitCode::kRuntimeError);
      }
    });
  }

  void start() override {
    if (mode_ == "fail_at_start") {
      throw std::runtime_error("port 49003 is in use");
    }
    say("running");
    trace("start");
  }

  void stopInputs() override { trace("stop_inputs"); }

  void undo(const Deadline&) override {
    trace(ros::ok() ? "undo" : "undo_after_ros");
    if (mode_ == "hang_in_undo") {
      std::this_thread::sleep_for(std::chrono::hours(1));
    }
    if (mode_ == "rest_in_undo") {
      const double before = processorTime();
      std::this_thread::sleep_for(std::chrono::duration<double>(kRest));
      trace(processorTime() - before < 0.2 * kRest ? "rested" : "worked");
    }
  }

  void publishFinalState() override {
    say("undone");
    trace("final_state");
  }

  void joinThreads() override {
    trace(ros::ok() ? "join_before_ros" : "join");
    joined_.set_value();
  }

 private:
  void say(const std::string& word) {
    std_msgs::String message;
    message.data = word;
    last_word_.publish(message);
  }
  /// [s] of all threads.
  static double processorTime() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }
  void trace(const std::string& step) { trace_ << step << std::endl; }

  static constexpr double kRest = 0.5;  // [s]
  static constexpr std::chrono::seconds kPatience{60};
  double gain_ = 1.0;
  double limit_ = 0.0;
  std::string mode_;
  std::ofstream trace_;
  std::promise<void> nudged_;
  std::promise<void> joined_;
  ros::Publisher pong_;
  ros::Publisher last_word_;
};

}  // namespace
}  // namespace xplane_bridge

int main(int argc, char** argv) { return xplane_bridge::runNode<xplane_bridge::TinyNode>(argc, argv, "tiny_node"); }
