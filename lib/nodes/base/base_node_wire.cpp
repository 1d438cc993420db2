// The part of BaseNode that logs its wire, and plays a log back.

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <system_error>
#include <utility>

#include "xplane_bridge/core/base/node_name.hpp"
#include "xplane_bridge/core/wire/capture_hub.hpp"
#include "xplane_bridge/core/wire/replay_hub.hpp"
#include "xplane_bridge/core/wire/udp_hub.hpp"
#include "xplane_bridge/core/wire/wire_log_hub.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/conformance_file.hpp"
#include "xplane_bridge/nodes/base/log_to_ros.hpp"
#include "xplane_bridge/nodes/base/parameter_text.hpp"
#include "xplane_bridge/nodes/base/user_folder.hpp"

namespace xplane_bridge {
namespace {

constexpr std::chrono::milliseconds kAsk{50};
// By these private parameters scripts/wire_replay and the node wait for each other.
constexpr const char* kReplayWaits = "wire_replay_waits";          // the node has advertised everything
constexpr const char* kReplayStart = "wire_replay_start";          // its recorder is connected
constexpr const char* kReplayPublished = "wire_replay_published";  // the node's report: all is published
constexpr const char* kReplayReceived = "wire_replay_received";    // and the recorder has all of it
constexpr double kLongestDelivery = 120.0;                         // [s]
constexpr std::uint64_t kBytesOfMegabyte = 1'000'000;
constexpr const char* kUsualNamespace = "/xplane";  // of launch/*.launch
const std::string kUserFile = "file ";              // scripts/wire_replay puts it where the node reads it

}  // namespace

void BaseNode::openWire(const ParamLoader& own) {
  if (!usesLink()) return;
  const std::string replay = own.text("wire_replay", "");
  for (const char* key : {kReplayWaits, kReplayStart, kReplayPublished, kReplayReceived}) own.allow(key);
  const bool ordered = wireIsOrdered() && !lockstep();
  if (!replay.empty() && !ordered) {
    own.refuse("wire_replay", "empty: this node, and any in lock-step, can log its wire but not play it back");
  }
  if (ordered && (!replay.empty() || !common_.wire_log.empty())) {
    wire_ = std::make_unique<NodeWire>(core::WireClock(host_clock_), host_clock_, !replay.empty(),
                                       [this](const std::string& why) {
                                         if (wire_->replays()) requestStop("end of the replay: " + why);
                                       });
    clock_ = wire_->wireClock().clock();
    receive_clock_ = clock_;
  }
  if (!replay.empty()) {
    topics_.keepAll();
    const core::WireClock time = wire_->wireClock();
    if (core::isCapture(replay)) {
      hub_of_link_ = std::make_unique<core::CaptureHub>(replay, time, wire_.get(), replayed_);
    } else {
      hub_of_link_ = std::make_unique<core::ReplayHub>(replay, time, wire_.get(), replayed_, logToRos);
    }
  }
  if (common_.wire_log.empty()) return;
  core::WireFileOptions file;
  file.file = common_.wire_log;
  file.node = core::nameInFiles(name(), kUsualNamespace);
  file.file_bytes = static_cast<std::uint64_t>(common_.wire_log_size) * kBytesOfMegabyte;
  file.parts = common_.wire_log_parts;
  XmlRpc::XmlRpcValue about;
  about["node"] = name();
  about["program"] = std::string(program_invocation_short_name);
  about["namespace"] = handle_.getNamespace();
  about["ordered"] = XmlRpc::XmlRpcValue(ordered);
  if (const XmlRpc::XmlRpcValue known = shared_->known(); known.valid()) about["shared"] = known;
  if (own.tree().valid()) about["own"] = own.tree();
  file.about = withoutSecrets(about).toXml();
  auto log = std::make_shared<core::WireLog>(file, host_clock_, logToRos);
  std::unique_ptr<core::DatagramHub> below = std::move(hub_of_link_);
  const bool replays = below != nullptr;
  if (!replays) below = std::make_unique<core::UdpHub>();
  hub_of_link_ = std::make_unique<core::WireLogHub>(std::move(below), std::move(log),
                                                    wire_ ? wire_->wireClock() : core::WireClock(host_clock_),
                                                    replays ? clock_ : host_clock_, replays ? nullptr : wire_.get());
}

void BaseNode::startWire() {
  if (!wire_) return;
  if (!wire_->replays()) {
    logUserFiles();
  } else {
    ROS_INFO("waiting for scripts/wire_replay to record");
    private_handle_.setParam(kReplayWaits, true);
    bool go = false;
    while (!go && !stopping()) {
      private_handle_.getParam(kReplayStart, go);
      if (!go) std::this_thread::sleep_for(kAsk);
    }
  }
  wire_->serve(timers_.get(), [this] { waking_->wake(); });
}

/// What earlier flights have left for this one, such as the mixing of its surfaces: the first inputs of a log.
void BaseNode::logUserFiles() {
  namespace fs = std::filesystem;
  const fs::path folder = userFolder();
  std::error_code none;
  std::map<std::string, fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, none)) {
    if (entry.is_regular_file(none) && entry.path().extension() == ".yaml") {
      files[entry.path().lexically_relative(folder).string()] = entry.path();
    }
  }
  nameByEachAddress(&files);
  for (const auto& [name, file] : files) {
    std::ifstream in(file, std::ios::binary);
    const NodeWire::Bytes bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    wire_->post(kUserFile + name, bytes, [] {});
  }
}

bool BaseNode::replays() const { return wire_ && wire_->replays(); }

void BaseNode::waitForReplayDelivery() {
  const std::string report = "replayed " + std::to_string(replayed_->datagrams) + " datagrams; " +
                             std::to_string(replayed_->sent) + " were sent, " +
                             std::to_string(replayed_->sent_otherwise) + " otherwise than recorded";
  ROS_INFO("%s", report.c_str());
  private_handle_.setParam(kReplayPublished, report);
  const Deadline deadline(host_clock_, kLongestDelivery);
  for (bool received = false; !received && !deadline.over() && ros::master::check();) {
    private_handle_.getParam(kReplayReceived, received);
    if (!received) std::this_thread::sleep_for(kAsk);
  }
}

}  // namespace xplane_bridge
