#include "xplane_bridge/core/wire/wire_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "xplane_bridge/core/wire/pcapng.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::uint32_t kNotes = 0;  // interface of what is no datagram
constexpr std::size_t kLongestComment = 20'000;
constexpr const char* kEnding = ".pcapng";
const std::string kPart = "_part";

/// Whether there is a part of a log of this name, be it that the first ones have been removed.
bool isTaken(const std::string& stem) {
  const std::filesystem::path path(stem);
  const std::string name = path.filename().string();
  std::error_code error;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  for (std::filesystem::directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
    const std::string file = each->path().filename().string();
    if (file.compare(0, name.size(), name) != 0) continue;
    const std::string rest = file.substr(name.size());
    if (rest == kEnding || rest.compare(0, kPart.size(), kPart) == 0) return true;
  }
  return false;
}

std::string times(const WireRecord& record) {
  return std::to_string(record.wall_ns) + "," + std::to_string(record.steady_ns);
}

}  // namespace

WireFile::WireFile(WireFileOptions options) : options_(std::move(options)) {
  std::string base = options_.file;
  const std::string ending = kEnding;
  if (base.size() > ending.size() && base.compare(base.size() - ending.size(), ending.size(), ending) == 0) {
    base.resize(base.size() - ending.size());
  }
  base += "." + options_.node;
  stem_ = base;
  for (int run = 2; isTaken(stem_); ++run) stem_ = base + "_run" + std::to_string(run);
  begin();
  if (!flush()) throw std::runtime_error(problem_);
}

WireFile::~WireFile() {
  if (fd_ >= 0) close(fd_);
}

std::string WireFile::pathOf(int part) const {
  return stem_ + (part > 1 ? kPart + std::to_string(part) : "") + kEnding;
}

void WireFile::begin() {
  if (fd_ >= 0) close(fd_);
  path_ = pathOf(++part_);
  fd_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    problem_ = "the wire log cannot be written to " + path_ + ": " + std::strerror(errno) +
               "; set wire_log to a file in a folder that is there and can be written";
    return;
  }
  written_ = 0;
  paths_.push_back(path_);
  for (; paths_.size() > static_cast<std::size_t>(options_.parts); paths_.pop_front()) {
    std::remove(paths_.front().c_str());
  }
  pcapng::appendSection("xplane_bridge wire log, part " + std::to_string(part_), options_.about, &out_);
  pcapng::appendInterface(pcapng::kLinkUser0, options_.node + "/notes", "what is no datagram: a name, zero, bytes",
                          &out_);
  for (const Source& source : sources_) {
    pcapng::appendInterface(pcapng::kLinkRawIp, options_.node + "/" + source.name,
                            "port " + std::to_string(source.port), &out_);
  }
}

bool WireFile::write(ByteView records) {
  WireRecord record;
  for (std::size_t offset = 0; problem_.empty() && readRecord(records, &offset, &record);) append(record);
  return flush();
}

bool WireFile::finish() {
  if (!waited_.empty()) {
    WireRecord end;
    end.wall_ns = waited_wall_ns_;
    end.steady_ns = waited_steady_ns_;
    const std::array<std::uint8_t, 7> name{'w', 'a', 'i', 't', 'e', 'd', 0};
    appendNote(end, name);
  }
  return flush();
}

void WireFile::append(const WireRecord& record) {
  switch (record.kind) {
    case WireKind::kOpened:
      sources_.push_back({std::string(record.payload.begin(), record.payload.end()), record.peer.port, 0});
      pcapng::appendInterface(pcapng::kLinkRawIp, options_.node + "/" + sources_.back().name,
                              "port " + std::to_string(record.peer.port), &out_);
      return;
    case WireKind::kReceived:
    case WireKind::kSent:
      appendDatagram(record);
      break;
    case WireKind::kWaited:
      waited_ += (waited_.empty() ? "" : ";") + times(record);
      waited_wall_ns_ = record.wall_ns;
      waited_steady_ns_ = record.steady_ns;
      if (waited_.size() > kLongestComment) finish();
      return;
    case WireKind::kInput:
      appendNote(record, record.payload);
      break;
    case WireKind::kRefused:
    case WireKind::kLost: {
      const std::string text = record.kind == WireKind::kLost ? "lost" : "refused";
      std::vector<std::uint8_t> payload(text.begin(), text.end());
      payload.push_back(0);
      const std::string count = std::to_string(record.count) + " " + std::to_string(record.source);
      payload.insert(payload.end(), count.begin(), count.end());
      appendNote(record, payload);
      if (record.kind == WireKind::kLost) number_ += record.count;
      break;
    }
    case WireKind::kNamed:
    case WireKind::kValues:
      return;
  }
  // A part ends with a packet, so that nothing is held back over its end.
  if (written_ + out_.size() >= options_.file_bytes && flush()) begin();
}

std::string WireFile::comment(const WireRecord& record) {
  std::string text = "n=" + std::to_string(number_++) + " w=" + std::to_string(record.wall_ns) +
                     " s=" + std::to_string(record.steady_ns);
  if (record.kernel_ns != 0) text += " k=1";
  if (!waited_.empty()) text += " t=" + waited_;
  waited_.clear();
  return text;
}

void WireFile::appendDatagram(const WireRecord& record) {
  if (record.source >= sources_.size()) return;
  Source& source = sources_[record.source];
  pcapng::Packet packet;
  packet.interface = record.source + 1U;
  packet.stamp_ns = record.kernel_ns != 0 ? record.kernel_ns : record.wall_ns;
  packet.outbound = record.kind == WireKind::kSent;
  packet.comment = comment(record);
  const Endpoint own{localAddress(record.peer.address), source.port};
  const auto headers = packet.outbound ? pcapng::udpHeaders(own, record.peer, record.payload.size())
                                       : pcapng::udpHeaders(record.peer, own, record.payload.size());
  packet.head = headers;
  packet.payload = record.payload;
  if (!packet.outbound) {
    packet.dropped = record.count - source.dropped;
    source.dropped = record.count;
  } else if (record.count != 0) {
    packet.comment += " e=" + std::to_string(record.count);
  }
  pcapng::appendPacket(packet, &out_);
}

void WireFile::appendNote(const WireRecord& record, ByteView payload) {
  pcapng::Packet packet;
  packet.interface = kNotes;
  packet.stamp_ns = record.wall_ns;
  packet.comment = comment(record);
  packet.payload = payload;
  pcapng::appendPacket(packet, &out_);
}

std::uint32_t WireFile::localAddress(std::uint32_t peer) {
  const auto known = local_addresses_.find(peer);
  if (known != local_addresses_.end()) return known->second;
  std::uint32_t address = 0;
  try {
    address = localAddressTowards({peer, 1});
  } catch (const SocketError&) {
    // Without a route, none.
  }
  return local_addresses_[peer] = address;
}

bool WireFile::flush() {
  std::size_t done = 0;
  while (problem_.empty() && done < out_.size()) {
    const ssize_t size = ::write(fd_, out_.data() + done, out_.size() - done);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) {
      problem_ = "the wire log ends, " + path_ + " cannot be written: " + std::strerror(errno);
      break;
    }
    done += static_cast<std::size_t>(size);
  }
  written_ += done;
  out_.clear();
  return problem_.empty();
}

}  // namespace xplane_bridge::core
