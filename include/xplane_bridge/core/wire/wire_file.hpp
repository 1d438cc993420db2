#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"
#include "xplane_bridge/core/wire/wire_record.hpp"

namespace xplane_bridge::core {

/// Where a wire log goes and how much of it is kept.
struct WireFileOptions {
  std::string file;                          ///< its name without the node's: the node's goes before the ending .pcapng
  std::string node;                          ///< without a namespace
  std::string about;                         ///< what the node was started with; into the head of each file
  std::uint64_t file_bytes = 1'000'000'000;  ///< then the next part is begun
  int parts = 4;                             ///< kept; older ones are deleted
};

/// Records as pcapng, in files of limited size. One interface for each source, one for what is no datagram. The comment
/// of a packet says, in this order: n= number in the order of processing, w= wall time [ns], s= steady time [ns], k=1:
/// the packet's time is the kernel's, t= wall and steady times at which waiting ended since the packet before.
class WireFile {
 public:
  /// Begins the first part; one that is there already is kept, and the new one gets another name.
  /// @throws std::runtime_error with the file and the reason
  explicit WireFile(WireFileOptions options);
  ~WireFile();
  WireFile(const WireFile&) = delete;
  WireFile& operator=(const WireFile&) = delete;

  /// Adds whole records. False: the disk has refused them; nothing more is written then, and problem() says why.
  bool write(ByteView records);
  /// What is held back until the next packet comes. False as of write().
  bool finish();
  const std::string& problem() const { return problem_; }
  /// Of the part that is being written.
  const std::string& path() const { return path_; }

 private:
  struct Source {
    std::string name;
    std::uint16_t port = 0;
    std::uint32_t dropped = 0;
  };
  std::string pathOf(int part) const;
  void begin();
  void append(const WireRecord& record);
  void appendDatagram(const WireRecord& record);
  void appendNote(const WireRecord& record, ByteView payload);
  std::string comment(const WireRecord& record);
  bool flush();
  std::uint32_t localAddress(std::uint32_t peer);

  WireFileOptions options_;
  std::string stem_;
  std::string path_;
  std::deque<std::string> paths_;  // of the parts that are there
  int part_ = 0;
  int fd_ = -1;
  std::uint64_t written_ = 0;  // bytes of this part
  std::uint64_t number_ = 0;   // of the next packet
  std::vector<Source> sources_;
  std::string waited_;  // times since the packet before
  std::int64_t waited_wall_ns_ = 0;
  std::int64_t waited_steady_ns_ = 0;
  std::map<std::uint32_t, std::uint32_t> local_addresses_;
  std::vector<std::uint8_t> out_;
  std::string problem_;
};

}  // namespace xplane_bridge::core
