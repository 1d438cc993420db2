#include "xplane_bridge/nodes/recorder/lockstep_recorder.hpp"

#include <array>
#include <cstdio>
#include <ctime>
#include <memory>
#include <stdexcept>

#include <ros/ros.h>
#include <rosbag/bag.h>
#include <std_msgs/Header.h>
#include <topic_tools/shape_shifter.h>

#include "xplane_bridge/FlightState.h"
#include "xplane_bridge/nodes/base/common_options.hpp"
#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/network/immediate_queue.hpp"

namespace xplane_bridge {
namespace {

constexpr std::uint32_t kUnlimited = 0;
constexpr const char* kUnfinished = ".active";

/// What follows `name=` in an argument; whether the argument is that option.
bool takesValue(const std::string& argument, const std::string& name, std::string* value) {
  if (argument.compare(0, name.size() + 1, name + "=") != 0) return false;
  *value = argument.substr(name.size() + 1);
  return true;
}

/// As `rosbag record` writes it into names of files.
std::string dateNow() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "_%Y-%m-%d-%H-%M-%S", &local);
  return text.data();
}

std::uint32_t kilobytes(const std::string& text) {
  constexpr std::uint32_t kLargest = 1024 * 1024;
  constexpr std::uint32_t kBytes = 1024;
  std::size_t used = 0;
  unsigned long value = 0;
  try {
    value = std::stoul(text, &used);
  } catch (const std::exception&) {
  }
  if (text.empty() || text[0] == '-' || used != text.size() || value == 0 || value > kLargest) {
    throw std::invalid_argument("--chunksize=" + text + ": expected 1 to 1048576 [KB]");
  }
  return static_cast<std::uint32_t>(value) * kBytes;
}

rosbag::CompressionType rosbagsName(LockstepRecording::Compression compression) {
  switch (compression) {
    case LockstepRecording::Compression::kLz4:
      return rosbag::compression::LZ4;
    case LockstepRecording::Compression::kBz2:
      return rosbag::compression::BZ2;
    default:
      return rosbag::compression::Uncompressed;
  }
}

}  // namespace

LockstepRecording LockstepRecording::parse(const std::vector<std::string>& arguments) {
  LockstepRecording out;
  for (const std::string& argument : arguments) {
    std::string value;
    if (takesValue(argument, "--output-name", &out.bag) || takesValue(argument, "--bridge", &out.bridge)) {
      continue;
    }
    if (takesValue(argument, "--output-prefix", &value)) {
      out.bag = value + dateNow() + ".bag";
    } else if (takesValue(argument, "--chunksize", &value)) {
      out.chunk_size = kilobytes(value);
    } else if (argument == "--lz4") {
      out.compression = Compression::kLz4;
    } else if (argument == "--bz2") {
      out.compression = Compression::kBz2;
    } else if (!argument.empty() && argument[0] == '/') {
      out.topics.push_back(argument);
    } else {
      throw std::invalid_argument("'" + argument +
                                  "': expected a topic with its whole name (/xplane/flight_state), or " +
                                  "--output-name=FILE, --output-prefix=START, --bridge=NAMESPACE, --lz4, --bz2, "
                                  "--chunksize=KB");
    }
  }
  if (out.bag.empty()) throw std::invalid_argument("no file: give --output-name=FILE");
  if (out.topics.empty()) throw std::invalid_argument("no topic: give at least one, for instance /xplane/flight_state");
  return out;
}

namespace {

/// Opens the file and subscribes; what rosbag throws leaves the constructor and finish() only.
class LockstepRecorder {
 public:
  LockstepRecorder(const LockstepRecording& recording, const ros::NodeHandle& handle) : file_(recording.bag) {
    bag_->setCompression(rosbagsName(recording.compression));
    bag_->setChunkThreshold(recording.chunk_size);
    bag_->open(file_ + kUnfinished, rosbag::bagmode::Write);
    ros::NodeHandle bridge(handle, recording.bridge);
    bridge.setCallbackQueue(&queue_);
    done_ = bridge.advertise<std_msgs::Header>(kLockstepDoneTopic, kLockstepQueue, true);
    const ros::TransportHints at_once = ros::TransportHints().tcpNoDelay();
    for (const std::string& topic : recording.topics) {
      ros::SubscribeOptions options;
      options.topic = topic;
      options.queue_size = kUnlimited;
      options.md5sum = ros::message_traits::md5sum<topic_tools::ShapeShifter>();
      options.datatype = ros::message_traits::datatype<topic_tools::ShapeShifter>();
      options.helper = boost::make_shared<ros::SubscriptionCallbackHelperT<const Event&>>(
          [this, topic](const Event& event) { write(topic, event); });
      options.transport_hints = at_once;
      subscribers_.push_back(bridge.subscribe(options));
    }
    subscribers_.push_back(bridge.subscribe<FlightState>(
        "flight_state", kUnlimited, [this](const FlightStateConstPtr& state) { answer(*state); }, nullptr, at_once));
    queue_.open();
  }

  /// Ends the subscriptions and completes the file. @throws rosbag::BagException it cannot be written, or a message
  /// could not, for which ROS has been shut down
  void finish() {
    for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
    try {
      if (!failure_.empty()) throw rosbag::BagIOException(failure_);
      bag_->close();
    } catch (const std::exception& error) {
      (void)bag_.release();  // its destructor tries again to complete the file, and what that throws ends the process
      throw rosbag::BagIOException("cannot write " + file_ + kUnfinished + ": " + error.what() + "; is the disk full?");
    }
    if (std::rename((file_ + kUnfinished).c_str(), file_.c_str()) != 0) {
      throw rosbag::BagIOException("cannot rename " + file_ + kUnfinished);
    }
  }

 private:
  using Event = ros::MessageEvent<const topic_tools::ShapeShifter>;

  /// On roscpp's network thread, which no exception may leave.
  void write(const std::string& topic, const Event& event) {
    if (!failure_.empty()) return;
    try {
      bag_->write(topic, event.getReceiptTime(), *event.getMessage(), event.getConnectionHeaderPtr());
    } catch (const std::exception& error) {
      failure_ = error.what();
      ros::requestShutdown();
    }
  }

  void answer(const FlightState& state) const {
    if (!failure_.empty()) return;
    std_msgs::Header done;
    done.stamp = state.header.stamp;
    done_.publish(done);
  }

  const std::string file_;
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
  std::string failure_;  // of the first message that could not be written
  ros::Publisher done_;
  ImmediateQueue queue_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace

int runLockstepRecorder(int argc, char** argv) {
  try {
    initWithOwnTime(&argc, argv, "record");
    const LockstepRecording recording = LockstepRecording::parse({argv + 1, argv + argc});
    ros::NodeHandle handle;
    ImmediateQueue at_once;
    at_once.open();
    const ros::Subscriber clock = movesRosTime() ? followClock(&at_once) : ros::Subscriber();
    if (!ros::Time::isValid()) ROS_WARN("no time on /clock yet: nothing can be recorded before rx_node gives it");
    ros::Time::waitForValid();
    if (!ros::ok()) return 0;
    LockstepRecorder recorder(recording, handle);
    ROS_INFO("recording %zu topics to %s", recording.topics.size(), recording.bag.c_str());
    ros::spin();
    recorder.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lockstep_recorder: %s\n", error.what());
    return 1;
  }
}

}  // namespace xplane_bridge
