#include "x11_grabber.hpp"

#include <sys/ipc.h>
#include <sys/shm.h>
#include <xcb/shm.h>

#include <algorithm>
#include <cstring>

namespace xplane_bridge::vision {
namespace {

constexpr std::uint32_t kAllPlanes = 0xffffffff;
constexpr int kChecksumRows = 12;
constexpr std::uint64_t kChecksumStart = 14695981039346656037ULL;  // FNV-1a over 8 bytes at a time

std::uint64_t addRow(std::uint64_t sum, const std::uint8_t* row, std::size_t bytes) {
  for (std::size_t at = 0; at + 8 <= bytes; at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, row + at, sizeof word);
    sum = (sum ^ word) * 1099511628211ULL;
  }
  return sum;
}

}  // namespace

X11Grabber::X11Grabber(const X11Connection& connection, xcb_drawable_t drawable, const PixelFormat& format,
                       cv::Rect area, bool use_shared_memory)
    : connection_(connection),
      drawable_(drawable),
      format_(format),
      area_(area),
      stride_(rowBytes(format, area.width)),
      picture_bytes_(stride_ * static_cast<std::size_t>(area.height)) {
  if (use_shared_memory && connection.hasShm()) attach(2 * picture_bytes_ + stride_);
}

X11Grabber::~X11Grabber() { detach(); }

void X11Grabber::attach(std::size_t bytes) {
  const int handle = shmget(IPC_PRIVATE, bytes, IPC_CREAT | 0600);
  if (handle < 0) return;
  void* memory = shmat(handle, nullptr, 0);
  if (memory != reinterpret_cast<void*>(-1)) {  // NOLINT(performance-no-int-to-ptr): as shmat() has it
    const std::uint32_t id = xcb_generate_id(connection_.get());
    if (connection_.succeeded(xcb_shm_attach_checked(connection_.get(), id, static_cast<std::uint32_t>(handle), 0))) {
      segment_ = {id, static_cast<std::uint8_t*>(memory)};
    } else {
      shmdt(memory);  // a server on another machine or in a container
    }
  }
  shmctl(handle, IPC_RMID, nullptr);  // goes with its last user, also after a crash
}

void X11Grabber::detach() {
  if (segment_.id == XCB_NONE) return;
  if (connection_.alive()) (void)connection_.succeeded(xcb_shm_detach_checked(connection_.get(), segment_.id));
  shmdt(segment_.memory);
  segment_ = {};
}

const std::uint8_t* X11Grabber::readRows(int y, int height, std::size_t offset, std::vector<std::uint8_t>& plain) {
  const auto x16 = static_cast<std::int16_t>(area_.x);
  const auto y16 = static_cast<std::int16_t>(area_.y + y);
  const auto width16 = static_cast<std::uint16_t>(area_.width);
  const auto height16 = static_cast<std::uint16_t>(height);
  const std::size_t bytes = stride_ * static_cast<std::size_t>(height);
  xcb_generic_error_t* failure = nullptr;
  if (segment_.id != XCB_NONE) {
    const xcb_shm_get_image_cookie_t asked =
        xcb_shm_get_image(connection_.get(), drawable_, x16, y16, width16, height16, kAllPlanes,
                          XCB_IMAGE_FORMAT_Z_PIXMAP, segment_.id, static_cast<std::uint32_t>(offset));
    read_sequence_ = asked.sequence;
    const XcbPointer<xcb_shm_get_image_reply_t> reply(xcb_shm_get_image_reply(connection_.get(), asked, &failure));
    const XcbPointer<xcb_generic_error_t> error(failure);
    if (reply == nullptr || reply->size < bytes) return nullptr;
    return segment_.memory + offset;
  }
  const xcb_get_image_cookie_t asked =
      xcb_get_image(connection_.get(), XCB_IMAGE_FORMAT_Z_PIXMAP, drawable_, x16, y16, width16, height16, kAllPlanes);
  read_sequence_ = asked.sequence;
  const XcbPointer<xcb_get_image_reply_t> reply(xcb_get_image_reply(connection_.get(), asked, &failure));
  const XcbPointer<xcb_generic_error_t> error(failure);
  if (reply == nullptr || static_cast<std::size_t>(xcb_get_image_data_length(reply.get())) < bytes) return nullptr;
  plain.resize(bytes);
  std::memcpy(plain.data(), xcb_get_image_data(reply.get()), bytes);
  return plain.data();
}

std::uint8_t* X11Grabber::read() {
  turn_ = 1 - turn_;
  const std::uint8_t* data = readRows(0, area_.height, turn_ * picture_bytes_, plain_[turn_]);
  same_ = data != nullptr && previous_ != nullptr && std::memcmp(data, previous_, picture_bytes_) == 0;
  if (data == nullptr) return nullptr;
  previous_ = segment_.id != XCB_NONE ? segment_.memory + turn_ * picture_bytes_ : plain_[turn_].data();
  return previous_;
}

int X11Grabber::checksumRows() const { return std::min(kChecksumRows, area_.height); }
int X11Grabber::checksumRow(int i) const { return (2 * i + 1) * area_.height / (2 * checksumRows()); }

std::optional<std::uint64_t> X11Grabber::checksum() {
  std::uint64_t sum = kChecksumStart;
  for (int i = 0; i < checksumRows(); ++i) {
    const std::uint8_t* data = readRows(checksumRow(i), 1, 2 * picture_bytes_, plain_row_);
    if (data == nullptr) return std::nullopt;
    sum = addRow(sum, data, stride_);
  }
  return sum;
}

std::uint64_t X11Grabber::checksum(const std::uint8_t* data) const {
  std::uint64_t sum = kChecksumStart;
  for (int i = 0; i < checksumRows(); ++i) {
    sum = addRow(sum, data + static_cast<std::size_t>(checksumRow(i)) * stride_, stride_);
  }
  return sum;
}

}  // namespace xplane_bridge::vision
