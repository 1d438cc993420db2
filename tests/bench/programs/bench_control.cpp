// Times a stick's way into X-Plane: publishes sensor_msgs/Joy whose roll axis changes sides with every message, and
// waits for the datagram in which the new side arrives. It stands between the bridge and X-Plane (UDP): what the bridge
// sends is passed on, and so are the answers, so that the nodes meet a simulator that obeys. Beside it, the floor: two
// bare hops (bench_bare_hops) that end in a sendto to this program.
//
// joystick_mapper_node and tx_node have timers of the same 50 Hz, and what a message meets depends on how long ago they
// fired: on an exact grid a whole run would measure one such phase. So the messages drift evenly through a period of
// the timers and back, and besides all latencies each eighth of the period has its own median.
//
//   bench_control key=value ...
//     listen=N    UDP port for tx_node      xplane=N   UDP port of the simulator
//     joy=TOPIC   of joystick_mapper_node   bare_joy=TOPIC, bare_port=N   of the bare hops
//     axis=I      index of the roll axis    seconds=S
//
// Prints one JSON object; phase_p50_us lists the eighths, -1 where nothing arrived.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <ros/ros.h>
#include <sensor_msgs/Joy.h>

#include "bench_settings.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kRollPath = "sim/joystick/yoke_roll_ratio";
constexpr std::int64_t kPeriod = 20'000'000;        // [ns] of the timers of joystick_mapper_node and tx_node
constexpr std::int64_t kPatience = 60'000'000'000;  // [ns] for what comes late on a busy computer
constexpr int kPhases = 8;
constexpr int kNotMeasured = -1;
/// A turn's share of a sweep to and fro: a tenth of the golden section, whose multiples lie evenly and never repeat.
constexpr double kDrift = 0.061803398874989485;
constexpr std::size_t kAxes = 8;
constexpr std::size_t kButtons = 12;
constexpr float kDeflection = 0.5F;

int openSocket(std::uint16_t port) {
  const int made = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  here.sin_port = htons(port);
  if (bind(made, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0) {
    throw std::runtime_error("port " + std::to_string(port) + " cannot be bound: " + std::strerror(errno));
  }
  return made;
}

/// [0, 1] of a period that a turn's messages come behind its place on the 50 Hz grid. It goes up and down, so that the
/// time between messages differs from the period by less than an eighth of it.
double phaseOf(std::uint64_t turn) {
  const double sweep = kDrift * static_cast<double>(turn);
  return 1.0 - std::abs(2.0 * (sweep - std::floor(sweep)) - 1.0);
}

/// Arrivals of a changed side, for one chain.
struct Chain {
  std::atomic<int> expected{0};  // sign of the roll that is waited for
  std::atomic<int> phase{kNotMeasured};
  std::atomic<std::int64_t> sent_ns{0};
  std::array<std::vector<double>, kPhases> latencies_us;
  std::array<std::atomic<bool>, kPhases> measured{};
  std::atomic<std::uint64_t> arrived{0};

  bool complete() const {
    return std::all_of(measured.begin(), measured.end(), [](const std::atomic<bool>& each) { return each.load(); });
  }

  void arrive(float roll) {
    const int side = roll > 0.0F ? 1 : -1;
    if (roll == 0.0F || side != expected.load()) return;
    expected = 0;
    ++arrived;
    const int at = phase.load();
    if (at == kNotMeasured) return;
    latencies_us[static_cast<std::size_t>(at)].push_back(static_cast<double>(bench::now_ns() - sent_ns.load()) * 1e-3);
    measured[static_cast<std::size_t>(at)] = true;
  }
};

class Relay {
 public:
  Relay(std::uint16_t listen, std::uint16_t xplane, std::uint16_t bare, Chain* ours, Chain* floor)
      : ours_(ours), floor_(floor), front_(openSocket(listen)), bare_(openSocket(bare)) {
    xplane_.sin_family = AF_INET;
    xplane_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    xplane_.sin_port = htons(xplane);
    thread_ = std::thread([this] { run(); });
  }
  ~Relay() {
    ends_ = true;
    thread_.join();
  }

 private:
  void run() {
    std::vector<std::uint8_t> buffer(core::kMaxDatagramSize);
    while (!ends_) {
      std::vector<pollfd> waiting = {{front_, POLLIN, 0}, {bare_, POLLIN, 0}};
      std::vector<sockaddr_in> clients(2);
      for (const auto& [key, back] : backs_) {
        waiting.push_back({back.socket, POLLIN, 0});
        clients.push_back(back.client);
      }
      poll(waiting.data(), waiting.size(), 50);
      if (waiting[0].revents != 0) fromBridge(&buffer);
      if (waiting[1].revents != 0) fromBare(&buffer);
      for (std::size_t i = 2; i < waiting.size(); ++i) {
        if (waiting[i].revents == 0) continue;
        const ssize_t size = recv(waiting[i].fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
        if (size < 0) continue;
        sendto(front_, buffer.data(), static_cast<std::size_t>(size), 0, reinterpret_cast<const sockaddr*>(&clients[i]),
               sizeof clients[i]);
      }
    }
  }

  void fromBridge(std::vector<std::uint8_t>* buffer) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size =
        recvfrom(front_, buffer->data(), buffer->size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &length);
    if (size < 0) return;
    const auto bytes = static_cast<std::size_t>(size);
    if (bytes == core::kDrefSize && std::memcmp(buffer->data(), "DREF", 4) == 0 &&
        std::strcmp(reinterpret_cast<const char*>(buffer->data()) + 9, kRollPath) == 0) {
      float roll = 0.0F;
      std::memcpy(&roll, buffer->data() + 5, 4);
      ours_->arrive(roll);
    }
    Back& back = backs_[from.sin_port];
    if (back.socket < 0) {
      back.socket = openSocket(0);
      back.client = from;
    }
    sendto(back.socket, buffer->data(), bytes, 0, reinterpret_cast<const sockaddr*>(&xplane_), sizeof xplane_);
  }

  void fromBare(std::vector<std::uint8_t>* buffer) {
    float roll = 0.0F;
    if (recv(bare_, buffer->data(), buffer->size(), MSG_DONTWAIT) != sizeof roll) return;
    std::memcpy(&roll, buffer->data(), sizeof roll);
    floor_->arrive(roll);
  }

  struct Back {
    int socket = -1;
    sockaddr_in client{};
  };
  Chain* ours_;
  Chain* floor_;
  int front_;
  int bare_;
  sockaddr_in xplane_{};
  std::map<std::uint16_t, Back> backs_;  // by the client's port
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

std::string report(const char* name, const Chain& chain, std::uint64_t sent) {
  std::vector<double> all;
  std::string phases;
  for (const std::vector<double>& of_phase : chain.latencies_us) {
    all.insert(all.end(), of_phase.begin(), of_phase.end());
    char number[40];
    std::snprintf(number, sizeof number, "%s%.2f", phases.empty() ? "" : ", ", bench::percentile(of_phase, 0.5));
    phases += number;
  }
  char line[200];
  std::snprintf(line, sizeof line, "\"%s\": {\"sent\": %llu, \"arrived\": %llu, \"p50_us\": %.2f, \"p99_us\": %.2f, ",
                name, static_cast<unsigned long long>(sent), static_cast<unsigned long long>(all.size()),
                bench::percentile(all, 0.5), bench::percentile(all, 0.99));
  return line + ("\"phase_p50_us\": [" + phases + "]}");
}

void run(const bench::Settings& settings) {
  Chain ours;
  Chain floor;
  ros::NodeHandle handle;
  ros::Publisher joy = handle.advertise<sensor_msgs::Joy>(settings.text("joy"), 1);
  ros::Publisher bare_joy = handle.advertise<sensor_msgs::Joy>(settings.text("bare_joy"), 1);
  sensor_msgs::Joy message;
  message.axes.assign(kAxes, 0.0F);
  message.buttons.assign(kButtons, 0);
  const auto axis = static_cast<std::size_t>(settings.number("axis"));
  std::uint64_t sent = 0;
  {
    Relay relay(settings.port("listen"), settings.port("xplane"), settings.port("bare_port"), &ours, &floor);
    const auto publish = [&](const ros::Publisher& publisher, Chain* chain, std::uint64_t turn, int phase) {
      // A stick to the left is positive on ROS's axes and negative in X-Plane: the sides are learnt below.
      message.axes[axis] = turn % 2 == 0 ? kDeflection : -kDeflection;
      const ros::WallTime stamp = ros::WallTime::now();
      message.header.stamp = ros::Time(stamp.sec, stamp.nsec);
      const bool inverted = publisher == joy;
      chain->phase = phase;
      chain->expected = (message.axes[axis] > 0.0F) != inverted ? 1 : -1;
      chain->sent_ns = bench::now_ns();
      publisher.publish(message);
    };
    std::int64_t next = bench::now_ns() / kPeriod * kPeriod;
    std::int64_t end = next + kPatience;
    bool measuring = false;
    // On a busy computer a short run may have phases in which nothing came yet.
    const auto goes_on = [&](std::int64_t now) {
      return now < end || (measuring && now < end + kPatience && !(ours.complete() && floor.complete()));
    };
    for (std::uint64_t turn = 0; goes_on(bench::now_ns()); ++turn) {
      next += kPeriod;
      const double behind = phaseOf(turn);
      const int phase = measuring ? std::min(static_cast<int>(behind * kPhases), kPhases - 1) : kNotMeasured;
      const std::int64_t at = next + static_cast<std::int64_t>(behind * kPeriod);
      bench::sleepUntil(at);
      publish(joy, &ours, turn, phase);
      bench::sleepUntil(at + kPeriod / 2);
      publish(bare_joy, &floor, turn, phase);
      sent += measuring ? 1 : 0;
      if (!measuring && ours.arrived > 50 && floor.arrived > 50) {
        measuring = true;
        end = bench::now_ns() + static_cast<std::int64_t>(settings.number("seconds") * 1e9);
      }
    }
    if (!measuring) throw std::runtime_error("the commands did not arrive");
    bench::sleepUntil(bench::now_ns() + 100'000'000);
  }
  std::printf("{%s, %s}\n", report("bridge", ours, sent).c_str(), report("bare", floor, sent).c_str());
}

}  // namespace
}  // namespace xplane_bridge

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_control", ros::init_options::AnonymousName);
  try {
    xplane_bridge::run(xplane_bridge::bench::Settings(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_control: %s\n", error.what());
    return 1;
  }
  return 0;
}
