#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "xplane_bridge/core/base/bytes.hpp"
#include "xplane_bridge/core/base/result.hpp"

/// X-Plane's UDP messages (and four of NASA's X-Plane Connect plugin): bytes to values and values to bytes.
///
/// Frame of every message: four ASCII letters, one byte, body; little-endian, no padding, one message a datagram.
/// The fifth byte differs between X-Plane's versions and is never looked at.
///
/// Decoding returns a value or a DecodeError; encoding writes into the caller's buffer and returns the number of bytes
/// or an EncodeError. Neither throws, allocates, or touches a byte outside the given range. Views (DataView, RrefView)
/// and string_views point into the datagram and live as long as it does.
///
/// Values are as on the wire, in X-Plane's units; names of fields that are not SI say so.
namespace xplane_bridge::core {

// ------------------------------------------------------------------------------------------------ sizes and limits

constexpr std::size_t kHeaderSize = 5;           ///< four letters and the version-dependent fifth byte
constexpr std::size_t kMaxDatagramSize = 65507;  ///< largest UDP payload over IPv4

constexpr std::size_t kDataSlots = 8;                     ///< float32 values in a DATA row
constexpr std::size_t kDataRowSize = 4 + 4 * kDataSlots;  ///< int32 index + 8 float32
constexpr std::int32_t kDataRowLimit = 200;  ///< rows are 0..199: size of sim/network/dataout/data_to_internet
constexpr std::size_t kMaxDataRows = 200;    ///< rows that encodeData() accepts at once
constexpr std::size_t kMaxDataSize = kHeaderSize + kMaxDataRows * kDataRowSize;
constexpr float kUnusedSlot = -999.0F;  ///< DATA out: slot not used. DATA in: leave alone, or give back.
constexpr std::uint32_t kUnusedSlotBits = 0xC479C000U;  ///< kUnusedSlot as IEEE 754 bits

constexpr std::size_t kRrefPairSize = 8;    ///< int32 index + float32 value
constexpr std::size_t kRrefPathSize = 400;  ///< path field of a request, with its NUL
constexpr std::size_t kRrefRequestSize = kHeaderSize + 8 + kRrefPathSize;
constexpr std::size_t kRposSize = 69;
constexpr std::size_t kRposRequestSize = 15;
constexpr std::size_t kDrefPathSize = 500;  ///< path field, with its NUL
constexpr std::size_t kDrefSize = kHeaderSize + 4 + kDrefPathSize;
constexpr std::size_t kMaxCommandPath = 500;  ///< characters, without the NUL
constexpr std::size_t kMaxCmndSize = kHeaderSize + kMaxCommandPath + 1;
constexpr std::size_t kMaxDselSize = kHeaderSize + 4 * kMaxDataRows;
constexpr std::size_t kIse4Size = 37;
constexpr std::size_t kPrelSize = 69;
constexpr std::size_t kAcfnSize = 165;
constexpr std::size_t kSimoSize = 161;
constexpr std::size_t kVehicleSize = 45;
constexpr std::size_t kReseSize = kHeaderSize;
constexpr std::size_t kFilePathSize = 150;  ///< path field of ACFN and SIMO, with its NUL
constexpr std::size_t kGettSize = 30;
constexpr std::size_t kTerrSize = 62;
constexpr std::size_t kGetpSize = 6;
constexpr std::size_t kPosiSize = 46;
constexpr std::size_t kMaxBeaconName = 500;  ///< characters, without the NUL

constexpr std::uint16_t kDefaultPort = 49000;      ///< where X-Plane listens unless its settings say otherwise
constexpr std::uint16_t kDefaultDataPort = 49003;  ///< where DATA is usually received
constexpr std::uint16_t kXPlaneSendPort = 49001;   ///< X-Plane's own sending socket: never bind it
constexpr std::uint16_t kBeaconPort = 49707;
constexpr const char* kBeaconGroup = "239.255.1.1";
constexpr std::uint16_t kXpcPort = 49009;  ///< the X-Plane Connect plugin

// ------------------------------------------------------------------------------------------------ reasons

/// Why a datagram was not decoded.
enum class DecodeError : std::uint8_t {
  kNone = 0,
  kTooShort,          ///< shorter than its kind's smallest form
  kTooLong,           ///< longer than its kind's only form
  kBadLength,         ///< not header + a whole number of records
  kEmpty,             ///< header without a record
  kWrongLabel,        ///< another message than the one asked for
  kUnknownLabel,      ///< a label the bridge does not know
  kNonFinite,         ///< NaN or infinity where a number is required
  kOutOfRange,        ///< a number that cannot be (latitude 91 degrees, port 0, ...)
  kUnterminatedText,  ///< a text field without NUL, or longer than the protocol allows
  kBadVersion,        ///< beacon of another major version
};
constexpr std::size_t kDecodeErrorCount = 11;

/// Why a message was not encoded. Nothing has been written.
enum class EncodeError : std::uint8_t {
  kNone = 0,
  kBufferTooSmall,  ///< the caller's buffer does not hold the message
  kEmpty,           ///< no text or no record where one is required
  kTextTooLong,     ///< text does not fit its field with the NUL
  kTextHasNul,      ///< text contains a NUL character
  kNonFinite,       ///< NaN or infinity
  kOutOfRange,      ///< a number outside what the message can mean
  kTooMany,         ///< more records than a message may carry
};
constexpr std::size_t kEncodeErrorCount = 8;

/// Stable snake_case names, for counters and messages.
const char* toString(DecodeError error);
const char* toString(EncodeError error);

template <typename T>
using DecodeResult = Result<T, DecodeError>;
/// Number of bytes written to the front of the buffer.
using EncodeResult = Result<std::size_t, EncodeError>;

// ------------------------------------------------------------------------------------------------ received messages

/// What a datagram says it is, by its first four bytes.
enum class MessageKind : std::uint8_t { kUnknown, kData, kRref, kRpos, kBeacon, kDref, kTerr, kPosi };

/// kUnknown also for datagrams shorter than a header.
MessageKind classify(ByteView datagram);

/// One row of a DATA message, inside the datagram.
class DataRowView {
 public:
  DataRowView() = default;
  explicit DataRowView(const std::uint8_t* row) : row_(row) {}

  std::int32_t index() const { return loadLittleEndian<std::int32_t>(row_); }
  /// Slot 0..7 as sent: may be -999, NaN, infinite or denormal.
  float value(std::size_t slot) const { return loadLittleEndian<float>(row_ + 4 + 4 * slot); }
  std::uint32_t bits(std::size_t slot) const { return loadLittleEndian<std::uint32_t>(row_ + 4 + 4 * slot); }
  /// Slot holds the bytes of -999.0, X-Plane's mark of an unused slot. -999 is also a value that can occur (a vertical
  /// speed in ft/min), so ask only for slots that the row is known to leave blank.
  bool isMarkedUnused(std::size_t slot) const { return bits(slot) == kUnusedSlotBits; }
  /// Index lies within X-Plane's table, 0..199.
  bool hasKnownIndex() const { return index() >= 0 && index() < kDataRowLimit; }

 private:
  const std::uint8_t* row_ = nullptr;
};

/// A DATA message: rows in the order sent. Which rows there are is the sender's choice and may change at any time;
/// rows with an unknown index may be among them and are to be skipped.
class DataView {
 public:
  DataView() = default;
  /// `rows` points at `count` rows; made by decodeData().
  DataView(const std::uint8_t* rows, std::size_t count) : rows_(rows), count_(count) {}

  std::size_t size() const { return count_; }
  /// i < size().
  DataRowView operator[](std::size_t i) const { return DataRowView(rows_ + i * kDataRowSize); }
  /// The first row with this index.
  std::optional<DataRowView> find(std::int32_t index) const;

 private:
  const std::uint8_t* rows_ = nullptr;
  std::size_t count_ = 0;
};

/// What is odd inside a DATA message that is sound as a whole.
struct DataAnomalies {
  std::size_t unknown_rows = 0;       ///< rows whose index is outside 0..199
  std::size_t non_finite_values = 0;  ///< NaN or infinite slots
};
DataAnomalies inspect(const DataView& data);

struct RrefPair {
  std::int32_t index = 0;  ///< the asker's own number, as given in the request
  float value = 0.0F;      ///< always float32, also for int and double datarefs; may be NaN
};

/// An RREF response: (index, value) pairs in no guaranteed order.
class RrefView {
 public:
  RrefView() = default;
  /// `pairs` points at `count` pairs; made by decodeRref().
  RrefView(const std::uint8_t* pairs, std::size_t count) : pairs_(pairs), count_(count) {}

  std::size_t size() const { return count_; }
  /// i < size().
  RrefPair operator[](std::size_t i) const {
    const std::uint8_t* pair = pairs_ + i * kRrefPairSize;
    return {loadLittleEndian<std::int32_t>(pair), loadLittleEndian<float>(pair + 4)};
  }

 private:
  const std::uint8_t* pairs_ = nullptr;
  std::size_t count_ = 0;
};

/// RPOS: position with doubles. Angles and velocity are relative to the local level or to the origin's [? rpos-axes].
struct Rpos {
  double longitude_deg = 0.0;
  double latitude_deg = 0.0;
  double elevation_m = 0.0;   ///< above mean sea level
  float height_agl_m = 0.0F;  ///< above terrain
  float pitch_deg = 0.0F;     ///< nose up positive
  float true_heading_deg = 0.0F;
  float roll_deg = 0.0F;  ///< right wing down positive
  float velocity_east_mps = 0.0F;
  float velocity_up_mps = 0.0F;
  float velocity_south_mps = 0.0F;
  float roll_rate_radps = 0.0F;   ///< P, right wing down positive
  float pitch_rate_radps = 0.0F;  ///< Q, nose up positive
  float yaw_rate_radps = 0.0F;    ///< R, nose right positive
};

/// BECN: the once-a-second multicast announcement of a running program of X-Plane's family.
struct Beacon {
  enum class Host : std::int32_t { kXPlane = 1, kPlaneMaker = 2 };
  enum class Role : std::uint32_t { kMaster = 1, kExternalVisual = 2, kInstructor = 3 };

  std::uint8_t major_version = 0;  ///< of the beacon, always 1
  std::uint8_t minor_version = 0;
  Host host = Host::kXPlane;                 ///< may hold a number that is no enumerator
  std::int32_t version = 0;                  ///< X-Plane's internal version, e.g. 115501
  Role role = Role::kMaster;                 ///< may hold a number that is no enumerator
  std::uint16_t port = 0;                    ///< where X-Plane listens
  std::string_view computer_name;            ///< points into the datagram
  std::optional<std::uint16_t> raknet_port;  ///< multiplayer; minor version >= 2
};

/// DREF as X-Plane's "Dataref Read/Write" output sends it: one dataref.
struct DrefValue {
  float value = 0.0F;     ///< may be NaN
  std::string_view path;  ///< points into the datagram
};

/// TERR, the answer of X-Plane Connect to GETT: the terrain under a point.
struct XpcTerrain {
  std::uint8_t aircraft = 0;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double terrain_elevation_m = 0.0;     ///< of the ground, not of the aircraft; above mean sea level
  std::array<float, 3> normal{};        ///< X-Plane's local axes: x east, y up, z south
  std::array<float, 3> velocity_mps{};  ///< of the ground, the same axes
  std::int32_t is_wet = 0;
  std::int32_t probe_result = 0;
};

/// POSI with doubles (46 bytes), the answer of X-Plane Connect to GETP.
struct XpcPosition {
  std::uint8_t gear_handle = 0;  ///< the plugin puts the gear handle where the aircraft number should be
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double elevation_m = 0.0;  ///< above mean sea level
  float pitch_deg = 0.0F;
  float roll_deg = 0.0F;
  float true_heading_deg = 0.0F;
  float gear = 0.0F;
};

/// 5 + 36 n bytes, n >= 1. Contents are not judged: see inspect().
DecodeResult<DataView> decodeData(ByteView datagram);
/// 5 + 8 n bytes, n >= 1.
DecodeResult<RrefView> decodeRref(ByteView datagram);
/// 69 bytes; every number finite, |latitude| <= 90, |longitude| <= 360.
DecodeResult<Rpos> decodeRpos(ByteView datagram);
/// 22 bytes or more: the name ends at its NUL, bytes behind it (other than the RakNet port) are ignored.
DecodeResult<Beacon> decodeBeacon(ByteView datagram);
/// 509 bytes.
DecodeResult<DrefValue> decodeDref(ByteView datagram);
/// 62 bytes; finite position and normal. A failed probe answers -998 everywhere: kOutOfRange.
DecodeResult<XpcTerrain> decodeTerr(ByteView datagram);
/// 46 bytes; finite, |latitude| <= 90, |longitude| <= 360.
DecodeResult<XpcPosition> decodePosi(ByteView datagram);

// ------------------------------------------------------------------------------------------------ sent messages

/// One row to be sent; slots that are to be left alone hold kUnusedSlot.
struct DataRow {
  std::int32_t index = 0;
  std::array<float, kDataSlots> values{kUnusedSlot, kUnusedSlot, kUnusedSlot, kUnusedSlot,
                                       kUnusedSlot, kUnusedSlot, kUnusedSlot, kUnusedSlot};
};

/// A pose for VEHX and VEHS.
struct VehiclePose {
  std::int32_t aircraft = 0;  ///< 0 is the user's
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double elevation_m = 0.0;  ///< above mean sea level
  float true_heading_deg = 0.0F;
  float pitch_deg = 0.0F;
  float roll_deg = 0.0F;
};

/// Where PREL puts an aircraft (those of X-Plane's 32 starts that make sense from a bridge; others by number).
enum class StartType : std::int32_t {
  kRepeatLast = 5,
  kLatLonElevation = 6,
  kGeneralArea = 7,
  kNearestAirport = 8,
  kSnapLoad = 9,
  kRamp = 10,
  kRunway = 11,
  kVfrApproach = 12,
  kIfrApproach = 13,
};

struct Placement {
  StartType start = StartType::kLatLonElevation;  ///< 5..36
  std::int32_t aircraft = 0;
  std::string_view airport;  ///< at most 8 characters; may be empty
  std::int32_t runway = 0;
  std::int32_t runway_direction = 0;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double elevation_m = 0.0;  ///< above mean sea level
  double true_heading_deg = 0.0;
  double speed_mps = 0.0;
};

enum class SituationAction : std::int32_t { kSaveSituation = 0, kLoadSituation = 1, kSaveMovie = 2, kLoadMovie = 3 };

/// Index of the Data Output target in ISE4.
constexpr std::int32_t kIse4DataOutput = 64;
/// X-Plane Connect: "use the aircraft's own position". Not X-Plane's -999.
constexpr double kXpcOwnPosition = -998.0;

/// Subscribes to a dataref at `rate_hz`, 0 to stop. X-Plane caps the rate at its frame rate.
/// `path` may end in "[i]" for an array element. Values come back under `index`.
EncodeResult encodeRref(ByteSpan out, std::string_view path, std::int32_t rate_hz, std::int32_t index);
/// Subscribes to RPOS at `rate_hz` (0..99999), 0 to stop.
EncodeResult encodeRpos(ByteSpan out, std::int32_t rate_hz);
/// Writes one dataref (element).
EncodeResult encodeDref(ByteSpan out, std::string_view path, float value);
/// Presses a command once.
EncodeResult encodeCmnd(ByteSpan out, std::string_view path);
/// Writes rows; 1..kMaxDataRows.
EncodeResult encodeData(ByteSpan out, const DataRow* rows, std::size_t count);
/// Adds rows to X-Plane's Data Output, or removes them. Rows are numbered as in DATA, from 0.
EncodeResult encodeDsel(ByteSpan out, const std::int32_t* rows, std::size_t count);
EncodeResult encodeUsel(ByteSpan out, const std::int32_t* rows, std::size_t count);
/// Sets a network target of X-Plane: kIse4DataOutput. `ipv4` is dotted decimal.
EncodeResult encodeIse4(ByteSpan out, std::int32_t target, std::string_view ipv4, std::uint16_t port, bool enabled);
/// Places an aircraft.
EncodeResult encodePrel(ByteSpan out, const Placement& placement);
/// Loads an aircraft file, path relative to X-Plane's folder.
EncodeResult encodeAcfn(ByteSpan out, std::int32_t aircraft, std::string_view path, std::int32_t livery);
/// Saves or loads a situation or movie file.
EncodeResult encodeSimo(ByteSpan out, SituationAction action, std::string_view path);
/// Drives an aircraft's pose. VEHX stops the flight model of that aircraft until it is reloaded: never for a reset.
EncodeResult encodeVehx(ByteSpan out, const VehiclePose& pose);
/// Places an aircraft once and lets it fly on (X-Plane 12 only).
EncodeResult encodeVehs(ByteSpan out, const VehiclePose& pose);
/// Repairs every failed system.
EncodeResult encodeRese(ByteSpan out);
/// X-Plane Connect: asks for the terrain under a point; kXpcOwnPosition for any of the three asks for the aircraft's
/// place.
EncodeResult encodeGett(ByteSpan out, std::uint8_t aircraft, double latitude_deg, double longitude_deg,
                        double elevation_m);
/// X-Plane Connect: asks for an aircraft's position.
EncodeResult encodeGetp(ByteSpan out, std::uint8_t aircraft);

}  // namespace xplane_bridge::core
