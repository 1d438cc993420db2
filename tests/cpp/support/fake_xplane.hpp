#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

/// An X-Plane for tests, on loopback, driven by the test: every pump() is one rendered frame. It has bytes and sockets
/// of its own: nothing of the library under test is used.
class FakeXPlane {
 public:
  using Address = std::pair<std::uint32_t, std::uint16_t>;  // host byte order

  explicit FakeXPlane(std::uint16_t port = 0) {
    fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    sockaddr_in own = toSockaddr({INADDR_LOOPBACK, port});
    if (bind(fd_, reinterpret_cast<sockaddr*>(&own), sizeof(own)) != 0) {
      throw std::runtime_error(std::string("fake X-Plane cannot bind: ") + std::strerror(errno));
    }
    socklen_t size = sizeof(own);
    getsockname(fd_, reinterpret_cast<sockaddr*>(&own), &size);
    port_ = ntohs(own.sin_port);
    datarefs["sim/version/xplane_internal_version"] = 115501.0F;
    datarefs["sim/time/paused"] = 0.0F;
    datarefs["sim/time/total_running_time_sec"] = 100.0F;
    datarefs["sim/operation/misc/frame_rate_period"] = 0.015F;
    datarefs["sim/network/dataout/network_data_rate"] = 20.0F;
    for (int row = 0; row < 200; ++row) {
      datarefs[rowPath(row)] = 0.0F;
    }
  }
  ~FakeXPlane() {
    stopThread();
    close(fd_);
  }
  FakeXPlane(const FakeXPlane&) = delete;
  FakeXPlane& operator=(const FakeXPlane&) = delete;

  std::uint16_t port() const { return port_; }
  static std::string rowPath(int row) { return "sim/network/dataout/data_to_internet[" + std::to_string(row) + "]"; }

  /// One frame: takes all requests, then sends what is due. Time goes on by `dt` unless paused.
  void pump(float dt = 0.016F) {
    takeRequests();
    if (datarefs["sim/time/paused"] == 0.0F) {
      datarefs["sim/time/total_running_time_sec"] += dt;
    }
    sendRref();
    sendData();
    for (const Address& client : rpos_clients) {
      send(client, rposBytes());
    }
  }

  /// Renders by itself from now on, for calls of the code under test that wait. Hands off the state until stopThread().
  void startThread() {
    running_ = true;
    thread_ = std::thread([this] {
      while (running_) {
        pump();
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  }
  void stopThread() {
    running_ = false;
    if (thread_.joinable()) {
      thread_.join();
    }
    takeRequests();  // what was still under way
  }

  /// Reads requests without answering: busy loading scenery.
  void takeRequests() {
    std::array<std::uint8_t, 8192> buffer;
    sockaddr_in from{};
    socklen_t size = sizeof(from);
    requests_in_pump = 0;
    for (;;) {
      const ssize_t length = recvfrom(fd_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (length < 0 && errno == ECONNREFUSED) {
        continue;
      }
      if (length < 5) {
        return;
      }
      take(std::string(buffer.begin(), buffer.begin() + 4), buffer.data(), static_cast<std::size_t>(length),
           {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)});
    }
  }

  /// Everything a restart of X-Plane forgets.
  void restart() {
    std::array<std::uint8_t, 8192> buffer;
    while (recv(fd_, buffer.data(), buffer.size(), 0) >= 0) {
    }
    subscriptions.clear();
    rpos_clients.clear();
    datarefs["sim/time/total_running_time_sec"] = 1.0F;
  }

  void sendBeacon(std::uint16_t to, const std::string& name = "fake", std::uint32_t role = 1) {
    std::vector<std::uint8_t> beacon = {'B', 'E', 'C', 'N', 0, 1, 2};
    append(&beacon, std::int32_t{1});
    append(&beacon, std::int32_t{115501});
    append(&beacon, role);
    append(&beacon, port_);
    beacon.insert(beacon.end(), name.begin(), name.end());
    beacon.push_back(0);
    append(&beacon, std::uint16_t{49010});
    send({INADDR_LOOPBACK, to}, beacon);
  }

  void send(const Address& to, const std::vector<std::uint8_t>& bytes) {
    const sockaddr_in address = toSockaddr(to);
    sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  }

  std::vector<std::uint8_t> rposBytes() const {
    std::vector<std::uint8_t> bytes = {'R', 'P', 'O', 'S', '4'};
    for (const double value : {127.5, 36.25, 1000.0}) {
      append(&bytes, value);
    }
    for (int i = 0; i < 10; ++i) {
      append(&bytes, 0.5F);
    }
    return bytes;
  }

  template <typename T>
  static void append(std::vector<std::uint8_t>* bytes, T value) {
    std::array<std::uint8_t, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof(T));  // tests run on little-endian hosts
    bytes->insert(bytes->end(), raw.begin(), raw.end());
  }

  // The state, for tests to set and to look at.
  std::map<std::string, float> datarefs;
  std::map<Address, std::map<std::int32_t, std::string>> subscriptions;  // by client and index
  std::set<Address> rpos_clients;
  std::vector<std::string> commands;
  std::vector<std::string> labels;  // of every message received
  Address data_target{0, 0};
  bool data_target_on = false;
  std::size_t requests_in_pump = 0;
  std::size_t request_limit = 148;  // RREF requests taken in a frame, more are lost
  std::size_t lost_requests = 0;
  std::size_t pairs_per_datagram = 180;
  bool ignores_target = false;           // ISE4 is lost
  std::map<std::string, int> lost_ends;  // by label: so many requests that end a subscription are still to be lost

 private:
  static sockaddr_in toSockaddr(const Address& address) {
    sockaddr_in result{};
    result.sin_family = AF_INET;
    result.sin_addr.s_addr = htonl(address.first);
    result.sin_port = htons(address.second);
    return result;
  }

  template <typename T>
  static T at(const std::uint8_t* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }

  bool losesEnd(const std::string& label) { return lost_ends[label]-- > 0; }

  void take(const std::string& label, const std::uint8_t* bytes, std::size_t size, const Address& from) {
    labels.push_back(label);
    const auto* text = reinterpret_cast<const char*>(bytes);
    if (label == "RREF" && size == 413) {
      if (++requests_in_pump > request_limit) {
        ++lost_requests;
        return;
      }
      const auto index = at<std::int32_t>(bytes + 9);
      if (at<std::int32_t>(bytes + 5) == 0) {
        if (!losesEnd(label)) subscriptions[from].erase(index);
      } else {
        subscriptions[from][index] = text + 13;
      }
    } else if (label == "DREF" && size == 509) {
      datarefs[text + 9] = at<float>(bytes + 5);
    } else if (label == "CMND") {
      commands.emplace_back(text + 5);
    } else if (label == "RPOS") {
      if (std::string(text + 5) == "0") {
        if (!losesEnd(label)) rpos_clients.erase(from);
      } else {
        rpos_clients.insert(from);
      }
    } else if (label == "DSEL" || label == "USEL") {
      for (std::size_t i = 5; i + 4 <= size; i += 4) {
        datarefs[rowPath(at<std::int32_t>(bytes + i))] = label == "DSEL" ? 1.0F : 0.0F;
      }
    } else if (label == "ISE4" && size == 37 && at<std::int32_t>(bytes + 5) == 64 && !ignores_target) {
      in_addr address{};
      inet_pton(AF_INET, text + 9, &address);
      data_target = {ntohl(address.s_addr), static_cast<std::uint16_t>(std::stoi(text + 25))};
      data_target_on = at<std::int32_t>(bytes + 33) != 0;
    }
  }

  void sendRref() {
    for (const auto& [client, indices] : subscriptions) {
      std::vector<std::uint8_t> bytes;
      std::size_t pairs = 0;
      const auto flush = [&, to = client] {
        if (pairs > 0) {
          send(to, bytes);
        }
        bytes = {'R', 'R', 'E', 'F', ','};
        pairs = 0;
      };
      flush();
      for (const auto& [index, path] : indices) {
        const auto dataref = datarefs.find(path);
        if (dataref == datarefs.end()) {
          continue;
        }
        append(&bytes, index);
        append(&bytes, dataref->second);
        if (++pairs == pairs_per_datagram) {
          flush();
        }
      }
      flush();
    }
  }

  void sendData() {
    if (!data_target_on || datarefs["sim/time/paused"] != 0.0F) {
      return;
    }
    std::vector<std::uint8_t> bytes = {'D', 'A', 'T', 'A', '*'};
    for (std::int32_t row = 0; row < 139; ++row) {
      if (datarefs[rowPath(row)] == 0.0F) {
        continue;
      }
      append(&bytes, row);
      for (int slot = 0; slot < 8; ++slot) {
        append(&bytes, static_cast<float>(100 * row + slot));
      }
    }
    if (bytes.size() > 5) {
      send(data_target, bytes);
    }
  }

  int fd_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> running_{false};
  std::thread thread_;
};
