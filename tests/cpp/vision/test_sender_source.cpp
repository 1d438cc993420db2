#include "xplane_bridge/vision/sender_source.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "xplane_bridge/vision/picture_stream.hpp"

namespace vision = xplane_bridge::vision;
using vision::ReplyCode;
using vision::WaitResult;

namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::chrono::milliseconds kWait{2000};

Bytes golden(const std::string& name) {
  std::ifstream file(std::string(XPLANE_BRIDGE_TEST_DATA) + "/eye/" + name + ".hex");
  Bytes bytes;
  char high = 0, low = 0;
  while (file >> high >> low)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(std::string{high, low}, nullptr, 16)));
  return bytes;
}

Bytes picture() {
  Bytes bytes = golden("picture");
  bytes.resize(16 + 64);
  Bytes jpeg;
  cv::imencode(".jpg", cv::Mat(480, 640, CV_8UC3, cv::Scalar(10, 20, 30)), jpeg);
  for (std::size_t i = 0; i < 4; ++i) bytes[8 + i] = static_cast<std::uint8_t>(jpeg.size() >> (8 * i));
  bytes.insert(bytes.end(), jpeg.begin(), jpeg.end());
  return bytes;
}

int freePort() {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), length), 0);
  EXPECT_EQ(::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length), 0);
  ::close(fd);
  return ntohs(address.sin_port);
}

/// A source, and senders that connect from chosen addresses of this computer. Time is the test's own.
class SenderSourceTest : public ::testing::Test {
 protected:
  void start(const std::string& peer = "", const std::string& token = "secret") {
    port_ = freePort();
    vision::SenderSourceOptions options{"127.0.0.1:" + std::to_string(port_), peer, token};
    options.recorded = [this] { return recorded_; };
    options.calibration = calibration_;
    source_ = std::make_unique<vision::SenderSource>(options, [this] { return now_ns_; });
    wait(std::chrono::milliseconds(1));  // listens
  }
  ~SenderSourceTest() override {
    for (const int fd : sockets_) ::close(fd);
  }

  int connectFrom(const char* address) {
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    sockets_.push_back(fd);
    sockaddr_in from{};
    from.sin_family = AF_INET;
    EXPECT_EQ(inet_pton(AF_INET, address, &from.sin_addr), 1);
    EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&from), sizeof from), 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port_));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
    return fd;
  }
  static void send(int fd, const Bytes& bytes) {
    EXPECT_EQ(::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  WaitResult wait(std::chrono::milliseconds timeout = kWait) { return source_->waitChange(timeout, change_); }

  /// Lets the source work until it has answered, or closed; returns what was sent back.
  Bytes answer(int fd) {
    Bytes bytes(64);
    for (int tries = 0; tries < 200; ++tries) {
      wait(std::chrono::milliseconds(10));
      pollfd file{fd, POLLIN, 0};
      if (::poll(&file, 1, 0) == 1) {
        const ssize_t size = ::recv(fd, bytes.data(), bytes.size(), 0);
        bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
        return bytes;
      }
    }
    ADD_FAILURE() << "neither an answer nor an end";
    return {};
  }
  static Bytes reply(ReplyCode code, std::uint64_t number) {
    const auto bytes = vision::encodeReply(code, number);
    return {bytes.begin(), bytes.end()};
  }
  static Bytes refusal(vision::Refusal reason) {
    return reply(ReplyCode::kRefused, static_cast<std::uint64_t>(reason));
  }

  std::int64_t now_ns_ = 1'700'000'000'000'000'000;
  int port_ = 0;
  std::unique_ptr<vision::SenderSource> source_;
  vision::Change change_;
  std::vector<int> sockets_;
  bool recorded_ = false;
  std::shared_ptr<vision::SenderCalibration> calibration_ = std::make_shared<vision::SenderCalibration>();
};

}  // namespace

TEST_F(SenderSourceTest, ASenderHearsWhetherItsPicturesAreRecorded) {
  start();
  recorded_ = true;
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, vision::kWelcomeRecorded));
}

TEST_F(SenderSourceTest, ARequestIsPassedOnAndItsAnswerComesBack) {
  start();
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello_that_calibrates"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, 0));
  std::uint64_t number = 0;
  while (number < 7) number = calibration_->ask();  // the golden answer's
  EXPECT_EQ(answer(fd), reply(ReplyCode::kCalibrate, 7));
  EXPECT_FALSE(calibration_->answer(7).has_value());
  send(fd, golden("calibration"));
  for (int tries = 0; tries < 200 && !calibration_->answer(7).has_value(); ++tries) wait(std::chrono::milliseconds(10));
  const auto found = calibration_->answer(7);
  ASSERT_TRUE(found.has_value());
  EXPECT_TRUE(found->measured);
  EXPECT_EQ(found->text, "42.5 ms, from 10 steps");
  EXPECT_FALSE(calibration_->answer(6).has_value());
}

TEST_F(SenderSourceTest, ARequestWithoutASenderIsRefusedInWords) {
  start();
  const std::uint64_t number = calibration_->ask();
  wait(std::chrono::milliseconds(1));
  const auto found = calibration_->answer(number);
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->measured);
  EXPECT_NE(found->text.find("no xplane_eye on 127.0.0.1 has connected"), std::string::npos) << found->text;
}

TEST_F(SenderSourceTest, ASenderOfAnEarlierReleaseIsNotAsked) {
  start();
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, 0));
  const std::uint64_t number = calibration_->ask();
  wait(std::chrono::milliseconds(1));
  const auto found = calibration_->answer(number);
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->measured);
  EXPECT_NE(found->text.find("of an earlier release"), std::string::npos) << found->text;
  send(fd, picture());
  EXPECT_EQ(answer(fd), reply(ReplyCode::kTaken, 7)) << "the connection lives, and nothing else was said";
}

TEST_F(SenderSourceTest, ASenderThatEndsAnswersWhatItWasAsked) {
  start();
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello_that_calibrates"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, 0));
  const std::uint64_t number = calibration_->ask();
  EXPECT_EQ(answer(fd), reply(ReplyCode::kCalibrate, number));
  ::shutdown(fd, SHUT_RDWR);
  for (int tries = 0; tries < 200 && !calibration_->answer(number).has_value(); ++tries)
    wait(std::chrono::milliseconds(10));
  const auto found = calibration_->answer(number);
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->measured);
  EXPECT_NE(found->text.find("gone meanwhile"), std::string::npos) << found->text;
}

TEST_F(SenderSourceTest, APictureComesWithItsFrameAndIsAcknowledged) {
  start();
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, 0));
  EXPECT_EQ(source_->problem(), "");
  send(fd, picture());
  ASSERT_EQ(wait(), WaitResult::kChange);
  EXPECT_EQ(answer(fd), reply(ReplyCode::kTaken, 7));
  vision::Picture picture;
  ASSERT_EQ(source_->grab(change_, picture), vision::GrabResult::kNew);
  EXPECT_EQ(picture.jpeg_size, cv::Size(640, 480));
  EXPECT_EQ(cv::imdecode(*picture.jpeg, cv::IMREAD_COLOR).size(), cv::Size(640, 480));
  ASSERT_TRUE(picture.frame.has_value());
  EXPECT_EQ(picture.frame->sim_time, 123.5F);
  EXPECT_EQ(picture.frame->delay, 0.05);
  EXPECT_TRUE(picture.frame->borderline);
  EXPECT_FALSE(picture.frame->delay_assumed);
  // Sent 10 ms after the change; the way here takes no time by the least delay seen (a millisecond's resolution).
  EXPECT_TRUE(picture.display_time_known);
  EXPECT_NEAR(static_cast<double>(now_ns_ - picture.display_time_ns), 10e6, 1e6);
}

TEST_F(SenderSourceTest, AnotherAddressIsRefused) {
  start();
  const int fd = connectFrom("127.0.0.2");
  EXPECT_EQ(answer(fd), Bytes{});  // closed without a word
  EXPECT_NE(source_->problem().find("refused 127.0.0.2: sender/peer is 127.0.0.1"), std::string::npos);
}

TEST_F(SenderSourceTest, TheNamedPeerIsLetIn) {
  start("127.0.0.2");
  const int fd = connectFrom("127.0.0.2");
  send(fd, golden("hello"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, 0));
}

TEST_F(SenderSourceTest, AWrongTokenIsRefused) {
  start("", "another");
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello"));
  EXPECT_EQ(answer(fd), refusal(vision::Refusal::kToken));
  EXPECT_NE(source_->problem().find("token"), std::string::npos);
}

TEST_F(SenderSourceTest, ALengthOfFourGibibytesClosesTheConnection) {
  start();
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, 0));
  Bytes bytes = golden("picture");
  for (std::size_t i = 0; i < 4; ++i) bytes[8 + i] = 0xFF;
  send(fd, bytes);
  EXPECT_EQ(answer(fd), refusal(vision::Refusal::kMalformed));
  EXPECT_EQ(answer(fd), Bytes{});
}

TEST_F(SenderSourceTest, APictureBeforeTheIntroductionIsRefused) {
  start();
  const int fd = connectFrom("127.0.0.1");
  send(fd, picture());
  EXPECT_EQ(answer(fd), refusal(vision::Refusal::kMalformed));
}

TEST_F(SenderSourceTest, OneSenderAtATimeAndTheNextWhenItIsSilent) {
  start();
  const int first = connectFrom("127.0.0.1");
  send(first, golden("hello"));
  EXPECT_EQ(answer(first), reply(ReplyCode::kWelcome, 0));
  const int second = connectFrom("127.0.0.1");
  EXPECT_EQ(answer(second), refusal(vision::Refusal::kBusy));
  now_ns_ += 2'100'000'000;
  wait(std::chrono::milliseconds(1));
  EXPECT_NE(source_->problem().find("silent for 2 s"), std::string::npos);
  const int third = connectFrom("127.0.0.1");
  send(third, golden("hello"));
  EXPECT_EQ(answer(third), reply(ReplyCode::kWelcome, 0));
}

TEST_F(SenderSourceTest, TheSendersProblemIsSaid) {
  start();
  const int fd = connectFrom("127.0.0.1");
  send(fd, golden("hello"));
  EXPECT_EQ(answer(fd), reply(ReplyCode::kWelcome, 0));
  send(fd, golden("status"));
  while (source_->problem().empty()) wait(std::chrono::milliseconds(10));
  EXPECT_EQ(source_->problem(), "the sender says: no window");
  send(fd, picture());
  ASSERT_EQ(wait(), WaitResult::kChange);
  EXPECT_EQ(source_->problem(), "");
}

TEST_F(SenderSourceTest, ATakenPortIsSaid) {
  start();
  vision::SenderSource other({"127.0.0.1:" + std::to_string(port_), "", ""}, [this] { return now_ns_; });
  vision::Change change;
  EXPECT_EQ(other.waitChange(std::chrono::milliseconds(1), change), WaitResult::kLost);
  EXPECT_NE(other.problem().find("cannot be listened on"), std::string::npos);
}

TEST(SenderSource, WrongAddressesAreRefusedInWords) {
  const auto make = [](const char* listen, const char* peer) {
    vision::SenderSource source({listen, peer, ""}, [] { return std::int64_t{0}; });
  };
  for (const char* listen : {"", "49790", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "here:49790"}) {
    EXPECT_THROW(make(listen, ""), std::invalid_argument) << listen;
  }
  EXPECT_THROW(make("127.0.0.1:49790", "my-windows-pc"), std::invalid_argument);
  EXPECT_NO_THROW(make("0.0.0.0:49790", "192.168.1.20"));
}
