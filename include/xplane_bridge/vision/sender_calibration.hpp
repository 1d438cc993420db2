#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

namespace xplane_bridge::vision {

/// What became of a request to measure the delay.
struct CalibrationAnswer {
  bool measured = false;
  std::string text;  ///< for people: what was measured, or why nothing was
};

/// Requests to `xplane_eye` that it measure its delay, one at a time, between who asks and the source that has the
/// connection. All functions may be called from any thread; none waits.
class SenderCalibration {
 public:
  /// @return the request's number; an earlier one without an answer is forgotten
  std::uint64_t ask();
  /// The answer to a request, once it has come.
  [[nodiscard]] std::optional<CalibrationAnswer> answer(std::uint64_t number) const;

  /// The source's part: the request that is to be passed on, once; 0: there is none.
  std::uint64_t take();
  /// The source's part: the answer to a request; one to another than the last is left out.
  void settle(std::uint64_t number, CalibrationAnswer answer);

 private:
  mutable std::mutex mutex_;
  std::uint64_t number_ = 0;
  bool waiting_ = false;
  std::optional<CalibrationAnswer> answer_;
};

}  // namespace xplane_bridge::vision
