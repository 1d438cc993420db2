#pragma once

#include <functional>
#include <memory>
#include <string>

#include "xplane_bridge/vision/frame_source.hpp"
#include "xplane_bridge/vision/sender_calibration.hpp"

namespace xplane_bridge::vision {

struct SenderSourceOptions {
  std::string listen;  ///< "ADDRESS:PORT" of this computer, numbers
  std::string peer;    ///< address of the only computer that is let in; empty: this one
  std::string token;   ///< that the sender must know; empty: none
  /// Whether the pictures are being recorded, asked when a sender connects; empty: they are not.
  std::function<bool()> recorded{};
  /// Requests that the sender measure its delay, taken up in waitChange(); empty: there are none.
  std::shared_ptr<SenderCalibration> calibration{};
};

/// Pictures that `xplane_eye` sends from X-Plane's computer, each with the frame it shows.
///
/// One sender at a time. What it sends is judged by its length before it is read, and nothing goes back but
/// acknowledgements and requests to measure the delay. There is no encryption. Display times are the sender's own,
/// moved to the host clock by the least delay of its messages seen lately.
class SenderSource : public FrameSource {
 public:
  /// Listens from the first wait on. @throws std::invalid_argument on addresses that are none
  SenderSource(const SenderSourceOptions& options, Clock clock);
  ~SenderSource() override;

  [[nodiscard]] WaitResult waitChange(std::chrono::milliseconds timeout, Change& change) override;
  [[nodiscard]] GrabResult grab(const Change& change, Picture& picture) override;
  [[nodiscard]] std::string describe() const override;
  [[nodiscard]] std::string problem() const override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace xplane_bridge::vision
