#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace xplane_bridge::vision {

/// The bytes that `xplane_eye` sends, little-endian: a prefix of 16 bytes (XEY1, version u16, bytes of the header u16,
/// bytes of the body u32, CRC-32 of the header u32), header, body. src/xplane_bridge/eye/wire.py is the other end. A
/// header may be longer than known here, and kinds of messages that are not known here are passed over.

constexpr std::uint16_t kPictureStreamVersion = 1;
constexpr std::size_t kMostPictureBytes = 16U * 1024U * 1024U;

/// First message of a connection.
struct SentHello {
  std::uint8_t window = 0;
  std::string token;
  std::string xplane;       ///< which X-Plane, for people
  bool calibrates = false;  ///< it measures its delay on request; earlier releases end the connection at a request
};

/// A picture, and the frame it shows. Times are the sender's own, of a clock that runs evenly.
struct SentPicture {
  std::uint8_t window = 0;
  int width = 0;              ///< [px]
  int height = 0;             ///< [px]
  float key = 0.0F;           ///< [s] simulator time of the frame, the float32 as X-Plane sent it
  bool borderline = false;    ///< it may be the neighbouring frame's picture
  bool delay_assumed = true;  ///< `delay` was not measured, or is not true any more
  std::uint64_t index = 0;    ///< the sender's count of frames
  std::int64_t change_ns = 0;
  std::int64_t sent_ns = 0;
  double delay = 0.0;  ///< [s] from the frame's datagram to the picture
  std::vector<std::uint8_t> jpeg;
};

/// A sign of life.
struct SentStatus {
  std::uint8_t window = 0;
  std::string problem;  ///< why there are no pictures; empty: nothing is wrong
};

/// The answer to ReplyCode::kCalibrate.
struct SentCalibration {
  std::uint8_t window = 0;
  bool measured = false;
  std::uint64_t number = 0;  ///< of the request
  std::string text;          ///< for people: what was measured, or why nothing was
};

using SentMessage = std::variant<SentHello, SentPicture, SentStatus, SentCalibration>;

enum class StreamFault {
  kNone,
  kVersion,    ///< another version
  kMalformed,  ///< anything else
};

/// Cuts a stream into messages. Bytes from anywhere do no harm: a length is judged before anything is kept for it, and
/// after the first fault nothing is read any more.
class PictureStreamReader {
 public:
  /// Takes bytes as they come.
  void add(const std::uint8_t* bytes, std::size_t size);

  /// The next whole message; empty: there is none yet, or never will be (fault()).
  [[nodiscard]] std::optional<SentMessage> next();

  [[nodiscard]] StreamFault fault() const { return fault_; }
  /// What is wrong, for people; empty while nothing is.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  struct Lengths {
    std::size_t header = 0;
    std::size_t body = 0;
  };
  [[nodiscard]] std::optional<Lengths> readPrefix();
  [[nodiscard]] std::optional<SentMessage> read(const Lengths& lengths);
  [[nodiscard]] std::optional<SentMessage> readPicture(const std::uint8_t* header, const std::uint8_t* body,
                                                       const Lengths& lengths);
  void refuse(StreamFault fault, std::string problem);

  std::vector<std::uint8_t> bytes_;
  std::size_t used_ = 0;
  StreamFault fault_ = StreamFault::kNone;
  std::string problem_;
};

/// What the receiver says; it says nothing else.
enum class ReplyCode : std::uint16_t {
  kWelcome = 0,    ///< with kWelcomeRecorded or 0
  kTaken = 1,      ///< with the index of the picture
  kRefused = 2,    ///< with a Refusal
  kCalibrate = 3,  ///< with the number of the request; only to a sender that `calibrates`
};

/// Of a welcome: the pictures are being recorded, so the view is not to be changed.
constexpr std::uint64_t kWelcomeRecorded = 1;

enum class Refusal : std::uint64_t { kToken = 1, kVersion = 2, kBusy = 3, kMalformed = 4 };

[[nodiscard]] std::array<std::uint8_t, 16> encodeReply(ReplyCode code, std::uint64_t number);

/// Width and height [px] as the JPEG itself says; empty: it is none.
[[nodiscard]] std::optional<std::pair<int, int>> jpegSize(const std::uint8_t* bytes, std::size_t size);

/// Compares in a time that does not depend on where the difference is.
[[nodiscard]] bool sameSecret(const std::string& given, const std::string& expected);

}  // namespace xplane_bridge::vision
