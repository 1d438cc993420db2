#include "xplane_bridge/vision/sender_source.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <utility>

#include "xplane_bridge/vision/picture_stream.hpp"
#include "xplane_bridge/vision/server_clock.hpp"

namespace xplane_bridge::vision {
namespace {

constexpr std::int64_t kIdleTimeout = 2'000'000'000;  // [ns] a sender that is silent for longer is gone
constexpr std::int64_t kMillisecond = 1'000'000;
constexpr int kReadsInOneWait = 64;
constexpr int kBacklog = 4;
constexpr const char* kThisComputer = "127.0.0.1";

class Socket {
 public:
  explicit Socket(int fd = -1) : fd_(fd) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool open() const { return fd_ >= 0; }

 private:
  int fd_;
};

sockaddr_in addressFrom(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  unsigned long port = 0;
  if (colon != std::string::npos && colon + 1 < text.size() && text.size() - colon <= 6 &&
      text.find_first_not_of("0123456789", colon + 1) == std::string::npos) {
    port = std::stoul(text.substr(colon + 1));
  }
  if (port < 1 || port > 65535 || inet_pton(AF_INET, text.substr(0, colon).c_str(), &address.sin_addr) != 1) {
    throw std::invalid_argument("listen \"" + text +
                                "\": expected ADDRESS:PORT of this computer, e.g. 192.168.1.10:49790");
  }
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

in_addr peerFrom(const std::string& text) {
  in_addr peer{};
  if (inet_pton(AF_INET, text.c_str(), &peer) != 1) {
    throw std::invalid_argument("peer \"" + text + "\": expected the IPv4 address of X-Plane's computer");
  }
  return peer;
}

std::string textOf(const in_addr& address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

void reply(const Socket& to, ReplyCode code, std::uint64_t number) {
  // 16 bytes always fit; where they do not, the sender is gone and is noticed by its silence.
  const auto bytes = encodeReply(code, number);
  (void)::send(to.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

}  // namespace

class SenderSource::Impl {
 public:
  Impl(const SenderSourceOptions& options, Clock clock)
      : options_(options),
        clock_(std::move(clock)),
        address_(addressFrom(options.listen)),
        peer_(peerFrom(options.peer.empty() ? kThisComputer : options.peer)) {}

  WaitResult waitChange(std::chrono::milliseconds timeout, Change& change) {
    passRequestOn();
    if (!listener_.open() && !listen()) {
      (void)::poll(nullptr, 0, static_cast<int>(timeout.count()));
      return WaitResult::kLost;
    }
    if (takeMessages()) return changed(change);
    int wait_ms = static_cast<int>(timeout.count());
    for (int reads = 0; reads < kReadsInOneWait; ++reads) {
      std::array<pollfd, 2> files{pollfd{listener_.fd(), POLLIN, 0}, pollfd{client_.fd(), POLLIN, 0}};
      if (::poll(files.data(), client_.open() ? 2 : 1, wait_ms) <= 0) break;
      wait_ms = 0;
      if (client_.open() && files[1].revents != 0) readClient();
      if (files[0].revents != 0) acceptClient();
      if (takeMessages()) return changed(change);
    }
    if (client_.open() && clock_() - heard_ns_ > kIdleTimeout) endClient("it was silent for 2 s");
    return greeted_ ? WaitResult::kTimeout : WaitResult::kLost;
  }

  GrabResult grab(const Change& change, Picture& picture) {
    if (!taken_.has_value()) return GrabResult::kSame;
    picture.jpeg_size = cv::Size(taken_->width, taken_->height);
    picture.jpeg = std::make_shared<const std::vector<std::uint8_t>>(std::move(taken_->jpeg));
    picture.frame = ShownFrame{taken_->key, taken_->delay, taken_->borderline, taken_->delay_assumed};
    picture.display_time_ns = change.time_ns;
    picture.display_time_known = change.time_known;
    picture.grab_time_ns = arrival_ns_;
    taken_.reset();
    return GrabResult::kNew;
  }

  [[nodiscard]] std::string describe() const {
    std::string text = "pictures sent to " + options_.listen;
    if (greeted_) text += " from " + textOf(peer_) + ", X-Plane at " + xplane_;
    return text;
  }

  [[nodiscard]] std::string problem() const {
    if (!listen_problem_.empty()) return listen_problem_;
    if (greeted_) return status_.empty() ? "" : "the sender says: " + status_;
    std::string text = "no xplane_eye on " + textOf(peer_) + " has connected to " + options_.listen;
    return last_end_.empty() ? text : text + " (" + last_end_ + ")";
  }

 private:
  bool listen() {
    Socket fresh(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int on = 1;
    (void)::setsockopt(fresh.fd(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (::bind(fresh.fd(), reinterpret_cast<const sockaddr*>(&address_), sizeof address_) != 0 ||
        ::listen(fresh.fd(), kBacklog) != 0) {
      listen_problem_ = options_.listen + " cannot be listened on: " + std::strerror(errno) +
                        "; sender/listen is an address of this computer and a free port";
      return false;
    }
    listen_problem_.clear();
    listener_ = std::move(fresh);
    return true;
  }

  void acceptClient() {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    Socket fresh(::accept4(listener_.fd(), reinterpret_cast<sockaddr*>(&from), &length, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!fresh.open()) return;
    if (from.sin_addr.s_addr != peer_.s_addr) {
      last_end_ = "refused " + textOf(from.sin_addr) + ": sender/peer is " + textOf(peer_);
      return;
    }
    if (client_.open()) {
      reply(fresh, ReplyCode::kRefused, static_cast<std::uint64_t>(Refusal::kBusy));
      return;
    }
    const int on = 1;
    (void)::setsockopt(fresh.fd(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    client_ = std::move(fresh);
    reader_ = PictureStreamReader();
    sender_clock_.reset();
    heard_ns_ = clock_();
  }

  void readClient() {
    std::array<std::uint8_t, 65536> bytes{};
    const ssize_t size = ::recv(client_.fd(), bytes.data(), bytes.size(), 0);
    if (size > 0) {
      arrival_ns_ = heard_ns_ = clock_();
      reader_.add(bytes.data(), static_cast<std::size_t>(size));
    } else if (size == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) {
      endClient("it closed the connection");
    }
  }

  void passRequestOn() {
    const std::uint64_t number = options_.calibration ? options_.calibration->take() : 0;
    if (number == 0) return;
    if (!greeted_) {
      options_.calibration->settle(number, {false, problem()});
    } else if (!calibrates_) {
      options_.calibration->settle(
          number, {false,
                   "the xplane_eye that sends the pictures is of an earlier release, which measures at its start only: "
                   "start it anew, or install this release on X-Plane's computer"});
    } else {
      reply(client_, ReplyCode::kCalibrate, number);
      asked_ = number;
    }
  }

  void endClient(const std::string& why) {
    if (asked_ != 0) options_.calibration->settle(asked_, {false, "xplane_eye is gone meanwhile: " + why});
    asked_ = 0;
    client_ = Socket();
    greeted_ = false;
    status_.clear();
    last_end_ = "the last one ended: " + why;
  }

  void refuseClient(Refusal reason, const std::string& why) {
    reply(client_, ReplyCode::kRefused, static_cast<std::uint64_t>(reason));
    endClient(why);
  }

  // Handles what has come. Returns true when a picture was taken over.
  bool takeMessages() {
    while (client_.open()) {
      std::optional<SentMessage> message = reader_.next();
      if (!message.has_value()) {
        if (reader_.fault() == StreamFault::kNone) return false;
        refuseClient(reader_.fault() == StreamFault::kVersion ? Refusal::kVersion : Refusal::kMalformed,
                     reader_.problem());
        return false;
      }
      if (auto* hello = std::get_if<SentHello>(&*message)) {
        greet(*hello);
      } else if (!greeted_) {
        refuseClient(Refusal::kMalformed, "it did not introduce itself");
      } else if (auto* status = std::get_if<SentStatus>(&*message)) {
        status_ = status->problem;
      } else if (auto* found = std::get_if<SentCalibration>(&*message)) {
        if (found->number == asked_ && asked_ != 0) {
          asked_ = 0;
          options_.calibration->settle(found->number, {found->measured, found->text});
        }
      } else if (auto* picture = std::get_if<SentPicture>(&*message)) {
        status_.clear();
        reply(client_, ReplyCode::kTaken, picture->index);
        taken_ = std::move(*picture);
        return true;
      }
    }
    return false;
  }

  void greet(const SentHello& hello) {
    if (!sameSecret(hello.token, options_.token)) {
      refuseClient(Refusal::kToken, "it does not know sender/token");
      return;
    }
    greeted_ = true;
    calibrates_ = hello.calibrates;
    xplane_ = hello.xplane;
    last_end_.clear();
    reply(client_, ReplyCode::kWelcome, options_.recorded && options_.recorded() ? kWelcomeRecorded : 0);
  }

  WaitResult changed(Change& change) {
    // The sender's clock has another beginning; the least delay of its messages gives the difference.
    const std::int64_t sent_ms = taken_->sent_ns / kMillisecond;
    const std::int64_t sent_ns = sender_clock_.toHost(static_cast<std::uint32_t>(sent_ms), arrival_ns_);
    change.time_ns = sent_ns - (taken_->sent_ns - taken_->change_ns);
    change.time_known = true;
    return WaitResult::kChange;
  }

  SenderSourceOptions options_;
  Clock clock_;
  sockaddr_in address_;
  in_addr peer_;
  Socket listener_;
  Socket client_;
  PictureStreamReader reader_;
  ServerClock sender_clock_;
  bool greeted_ = false;
  bool calibrates_ = false;
  std::uint64_t asked_ = 0;  // number of the request that the sender has not answered; 0: none
  std::string xplane_;
  std::string status_;
  std::string last_end_;
  std::string listen_problem_;
  std::int64_t heard_ns_ = 0;
  std::int64_t arrival_ns_ = 0;
  std::optional<SentPicture> taken_;
};

SenderSource::SenderSource(const SenderSourceOptions& options, Clock clock)
    : impl_(std::make_unique<Impl>(options, std::move(clock))) {}
SenderSource::~SenderSource() = default;
WaitResult SenderSource::waitChange(std::chrono::milliseconds timeout, Change& change) {
  return impl_->waitChange(timeout, change);
}
GrabResult SenderSource::grab(const Change& change, Picture& picture) { return impl_->grab(change, picture); }
std::string SenderSource::describe() const { return impl_->describe(); }
std::string SenderSource::problem() const { return impl_->problem(); }

}  // namespace xplane_bridge::vision
