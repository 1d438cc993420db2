// X-Plane's place on the wire, at any frame rate, with a stop watch: answers the RREF subscriptions of any client
// with the values of a file, and times the flight states that come back on topics. A frame's simulator time shows which
// datagram a state was made of.
//
//   bench_xplane key=value ...
//     port=N              UDP port to answer on
//     values=FILE         lines "dataref value"; datarefs that are not in it stay unanswered, as in X-Plane
//     rate=HZ             frames per second
//     seconds=S           how long states are timed, after every topic has begun to flow
//     topics=A,B          flight_state topics that clients publish
//     extra=N             datagrams of a single value sent to each client with every frame, besides the frame's own
//     outages=N           how often it falls silent for a second afterwards, forgetting its subscriptions
//     link_state=TOPIC    for outages
//
// Prints one JSON object.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <ros/ros.h>

#include "bench_settings.hpp"
#include "xplane_bridge/FlightState.h"
#include "xplane_bridge/LinkState.h"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge {
namespace {

constexpr std::size_t kPairsPerDatagram = 183;   // as X-Plane
constexpr double kFirstSimTime = 100.0;          // [s] float32 has steps of 8 us there
constexpr int kSlowRateHz = 60;                  // subscriptions below this are not of the flight group
constexpr std::int64_t kOutage = 1'000'000'000;  // [ns]
constexpr double kPatience = 60.0;               // [s] for topics to begin

using bench::now_ns;
using bench::percentile;
using bench::sleepUntil;

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> out;
  std::size_t begin = 0;
  while (begin < list.size()) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    out.push_back(list.substr(begin, end - begin));
    begin = end + 1;
  }
  return out;
}

struct Client {
  sockaddr_in address{};
  struct Item {
    std::int32_t rate = 0;
    float value = 0.0F;
  };
  std::map<std::int32_t, Item> items;
  std::int32_t sim_time_index = -1;
  std::int32_t period_index = -1;
};

/// One measured topic.
struct Topic {
  std::vector<double> latencies_us;
  std::uint64_t received = 0;
};

class Meter {
 public:
  explicit Meter(const bench::Settings& settings)
      : settings_(settings), period_(1.0 / number("rate")), topic_names_(split(text("topics"))) {
    loadValues(text("values"));
    topics_.resize(topic_names_.size());
  }

  std::string run() {
    ros::NodeHandle handle;
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    std::vector<ros::Subscriber> subscribers;
    for (std::size_t i = 0; i < topic_names_.size(); ++i) {
      subscribers.push_back(handle.subscribe<FlightState>(
          topic_names_[i], 10000, [this, i](const FlightStateConstPtr& state) { onState(i, *state); }, nullptr, hints));
    }
    if (!text("link_state").empty()) {
      subscribers.push_back(handle.subscribe<LinkState>(
          text("link_state"), 10, [this](const LinkStateConstPtr& link) { onLink(*link); }, nullptr, hints));
    }
    ros::AsyncSpinner spinner(1);
    spinner.start();
    open();
    measure();
    std::string outages = measureOutages();
    spinner.stop();
    return report() + outages + "}";
  }

 private:
  std::string text(const std::string& key) const { return settings_.text(key); }
  double number(const std::string& key) const { return settings_.number(key); }

  void loadValues(const std::string& file) {
    std::ifstream in(file);
    std::string path;
    float value = 0.0F;
    while (in >> path >> value) values_[path] = value;
    if (values_.empty()) throw std::runtime_error("no values in " + file);
  }

  void open() {
    socket_ = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    here.sin_port = htons(static_cast<std::uint16_t>(number("port")));
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0) {
      throw std::runtime_error("port " + text("port") + " cannot be bound: " + std::strerror(errno));
    }
  }

  void serve() {
    std::uint8_t buffer[2048];
    for (;;) {
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t got =
          recvfrom(socket_, buffer, sizeof buffer, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &size);
      if (got < 0) return;
      if (got != static_cast<ssize_t>(core::kRrefRequestSize) || std::memcmp(buffer, "RREF", 4) != 0) continue;
      std::int32_t rate = 0;
      std::int32_t index = 0;
      std::memcpy(&rate, buffer + 5, 4);
      std::memcpy(&index, buffer + 9, 4);
      const std::string path(reinterpret_cast<const char*>(buffer) + 13);
      Client& client = clients_[{from.sin_addr.s_addr, from.sin_port}];
      client.address = from;
      if (rate <= 0) {
        client.items.erase(index);
        continue;
      }
      const auto value = values_.find(path);
      if (value == values_.end()) continue;
      client.items[index] = {rate, value->second};
      if (rate >= kSlowRateHz && path == "sim/time/total_running_time_sec") client.sim_time_index = index;
      if (path == "sim/operation/misc/frame_rate_period") client.period_index = index;
    }
  }

  /// Simulator time of a frame, its own for each client.
  float simTime(std::uint64_t frame, std::size_t client) const {
    return static_cast<float>(kFirstSimTime +
                              (static_cast<double>(frame) + 0.25 * static_cast<double>(client)) * period_);
  }

  void sendFrame(std::uint64_t frame, std::size_t number_of_client, Client* client) {
    const float sim_time = simTime(frame, number_of_client);
    pairs_.clear();
    for (auto& [index, item] : client->items) {
      if (index == client->sim_time_index) item.value = sim_time;
      if (index == client->period_index) item.value = static_cast<float>(period_);
      const double frames = std::max(1.0, std::round(1.0 / (period_ * item.rate)));
      if (item.rate < kSlowRateHz && frame % static_cast<std::uint64_t>(frames) != 0) continue;
      pairs_.emplace_back(index, item.value);
    }
    for (std::size_t begin = 0; begin < pairs_.size(); begin += kPairsPerDatagram) {
      addDatagram(begin, std::min(begin + kPairsPerDatagram, pairs_.size()));
    }
    const int extra = client->items.count(client->sim_time_index) != 0 ? static_cast<int>(number("extra")) : 0;
    for (int i = 0; i < extra; ++i) {
      // Any value that does not begin a frame.
      const std::size_t which = pairs_[0].first == client->sim_time_index ? 1 % pairs_.size() : 0;
      addDatagram(which, which + 1);
    }
    if (client->items.count(client->sim_time_index) != 0) {
      const std::lock_guard<std::mutex> lock(mutex_);
      sent_.push_back({sim_time, now_ns()});
      if (sent_.size() > 4096) sent_.pop_front();
    }
    sendDatagrams(client);
  }

  void addDatagram(std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> bytes = {'R', 'R', 'E', 'F', ','};
    bytes.resize(core::kHeaderSize + (end - begin) * core::kRrefPairSize);
    std::uint8_t* out = bytes.data() + core::kHeaderSize;
    for (std::size_t i = begin; i < end; ++i, out += core::kRrefPairSize) {
      std::memcpy(out, &pairs_[i].first, 4);
      std::memcpy(out + 4, &pairs_[i].second, 4);
    }
    pending_.push_back(std::move(bytes));
  }

  // All in one call, so that offering many packets is not limited by the calls.
  void sendDatagrams(Client* client) {
    std::vector<iovec> parts(pending_.size());
    std::vector<mmsghdr> messages(pending_.size());
    for (std::size_t i = 0; i < pending_.size(); ++i) {
      parts[i] = {pending_[i].data(), pending_[i].size()};
      messages[i].msg_hdr.msg_name = &client->address;
      messages[i].msg_hdr.msg_namelen = sizeof client->address;
      messages[i].msg_hdr.msg_iov = &parts[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
    std::size_t sent = 0;
    while (sent < messages.size()) {
      const int count = sendmmsg(socket_, messages.data() + sent, static_cast<unsigned int>(messages.size() - sent), 0);
      if (count < 0) break;  // no client listens there any more
      sent += static_cast<std::size_t>(count);
    }
    datagrams_ += sent;
    pending_.clear();
  }

  void frames(const std::function<bool()>& done) {
    const auto period_ns = static_cast<std::int64_t>(period_ * 1e9);
    // Each client has a part of the period for itself.
    std::int64_t next = (now_ns() / period_ns + 1) * period_ns;
    while (!done()) {
      serve();
      std::vector<Client*> flying;
      for (auto& [key, client] : clients_) {
        if (client.items.count(client.sim_time_index) != 0) {
          flying.push_back(&client);
        } else if (!client.items.empty()) {
          sendFrame(frame_, 0, &client);
        }
      }
      sleepUntil(next);
      for (std::size_t turn = 0; turn < flying.size(); ++turn) {
        // They change places with every frame: the one that comes after a busy one finds the machine awake.
        const std::size_t which = (turn + frame_) % flying.size();
        sleepUntil(next + static_cast<std::int64_t>(turn) * period_ns / static_cast<std::int64_t>(flying.size()));
        sendFrame(frame_, which, flying[which]);
      }
      ++frame_;
      next += period_ns;
      if (now_ns() > next) next = (now_ns() / period_ns + 1) * period_ns;
    }
  }

  bool allFlow() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::all_of(topics_.begin(), topics_.end(), [](const Topic& topic) { return topic.received >= 20; });
  }

  void measure() {
    const std::int64_t patience = now_ns() + static_cast<std::int64_t>(kPatience * 1e9);
    frames([&] { return allFlow() || now_ns() > patience; });
    if (!allFlow()) throw std::runtime_error("not every topic began to flow");
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      for (Topic& topic : topics_) topic = {};
      measuring_ = true;
      first_frame_ = frame_;
      datagrams_ = 0;
    }
    std::printf("MEASURING\n");
    std::fflush(stdout);
    const std::int64_t began = now_ns();
    const std::int64_t end = began + static_cast<std::int64_t>(number("seconds") * 1e9);
    frames([&] { return now_ns() >= end; });
    elapsed_ = static_cast<double>(now_ns() - began) * 1e-9;
    frames_measured_ = frame_ - first_frame_;
    datagrams_measured_ = datagrams_;
    std::printf("MEASURED\n");
    std::fflush(stdout);
    // The last states are still on their way.
    const std::int64_t drained = now_ns() + 300'000'000;
    sleepUntil(drained);
    const std::lock_guard<std::mutex> lock(mutex_);
    measuring_ = false;
  }

  std::string measureOutages() {
    std::string noticed;
    std::string back;
    for (int i = 0; i < static_cast<int>(number("outages")); ++i) {
      const std::uint64_t flows = frame_;
      frames([&] { return frame_ > flows + static_cast<std::uint64_t>(1.0 / period_); });
      close(socket_);
      clients_.clear();
      const std::int64_t silent_since = now_ns();
      silence_noticed_ns_ = 0;
      waiting_for_silence_ = true;
      sleepUntil(silent_since + kOutage);
      waiting_for_silence_ = false;
      open();
      const std::int64_t returned = now_ns();
      state_back_ns_ = 0;
      waiting_for_state_ = true;
      frame_ += static_cast<std::uint64_t>(1.0 / period_);
      frames([&] { return state_back_ns_ != 0 || now_ns() > returned + 10 * kOutage; });
      waiting_for_state_ = false;
      const std::int64_t seen = silence_noticed_ns_ != 0 ? silence_noticed_ns_ - silent_since : 1'000'000'000'000;
      const std::int64_t flowing = state_back_ns_ != 0 ? state_back_ns_ - returned : 1'000'000'000'000;
      noticed += (noticed.empty() ? "" : ", ") + std::to_string(static_cast<double>(seen) * 1e-9);
      back += (back.empty() ? "" : ", ") + std::to_string(static_cast<double>(flowing) * 1e-9);
    }
    return ", \"silence_noticed_s\": [" + noticed + "], \"link_back_s\": [" + back + "]";
  }

  void onState(std::size_t topic, const FlightState& state) {
    const std::int64_t now = now_ns();
    if (topic == 0 && waiting_for_state_ && state_back_ns_ == 0) state_back_ns_ = now;
    const std::lock_guard<std::mutex> lock(mutex_);
    ++topics_[topic].received;
    if (!measuring_) return;
    for (auto it = sent_.rbegin(); it != sent_.rend(); ++it) {
      if (it->first != state.sim_time) continue;
      topics_[topic].latencies_us.push_back(static_cast<double>(now - it->second) * 1e-3);
      return;
    }
  }

  void onLink(const LinkState& link) {
    if (waiting_for_silence_ && silence_noticed_ns_ == 0 && link.state != LinkState::CONNECTED) {
      silence_noticed_ns_ = now_ns();
    }
  }

  std::string report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    char line[400];
    std::snprintf(line, sizeof line, "{\"frames\": %llu, \"datagrams\": %llu, \"elapsed_s\": %.6f",
                  static_cast<unsigned long long>(frames_measured_),
                  static_cast<unsigned long long>(datagrams_measured_), elapsed_);
    std::string out = line;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      const std::vector<double>& latencies = topics_[i].latencies_us;
      std::snprintf(line, sizeof line, ", \"%s\": {\"received\": %zu, \"p50_us\": %.2f, \"p99_us\": %.2f}",
                    topic_names_[i].c_str(), latencies.size(), percentile(latencies, 0.5), percentile(latencies, 0.99));
      out += line;
    }
    return out;
  }

  bench::Settings settings_;
  double period_;  // [s]
  std::vector<std::string> topic_names_;
  std::map<std::string, float> values_;
  std::map<std::pair<std::uint32_t, std::uint16_t>, Client> clients_;
  int socket_ = -1;
  std::uint64_t frame_ = 0;
  std::uint64_t first_frame_ = 0;
  std::uint64_t frames_measured_ = 0;
  std::uint64_t datagrams_ = 0;
  std::uint64_t datagrams_measured_ = 0;
  double elapsed_ = 0.0;
  std::vector<std::pair<std::int32_t, float>> pairs_;
  std::vector<std::vector<std::uint8_t>> pending_;  // datagrams of a frame

  std::mutex mutex_;
  std::deque<std::pair<float, std::int64_t>> sent_;  // simulator time, steady time of sending
  std::vector<Topic> topics_;                        // as in topic_names_
  bool measuring_ = false;
  std::atomic<bool> waiting_for_silence_{false}, waiting_for_state_{false};
  std::atomic<std::int64_t> silence_noticed_ns_{0}, state_back_ns_{0};
};

}  // namespace
}  // namespace xplane_bridge

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_xplane", ros::init_options::AnonymousName);
  try {
    xplane_bridge::Meter meter(xplane_bridge::bench::Settings(argc, argv));
    std::printf("%s\n", meter.run().c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_xplane: %s\n", error.what());
    return 1;
  }
  return 0;
}
