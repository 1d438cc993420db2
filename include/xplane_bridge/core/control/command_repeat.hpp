#pragma once

#include <limits>

/// When the last command of a stick is repeated for a receiver that wants one in each period. Not between the messages
/// of a stick that sends its own: a repeat just before one counts for the receiver's highest rate and holds that up.
namespace xplane_bridge::core {

class CommandRepeat {
 public:
  /// @param period [s]
  explicit CommandRepeat(double period) : period_(period) {}

  /// The stick sent a message. @param time [s]
  void heard(double time) { heard_ = time; }
  /// A command went out. @param time [s]
  void sent(double time) { sent_ = time; }
  /// To be asked once a period. @param time [s]
  bool due(double time) const { return time - heard_ > 1.5 * period_ && time - sent_ > 0.5 * period_; }

 private:
  double period_;
  double heard_ = -std::numeric_limits<double>::infinity();
  double sent_ = -std::numeric_limits<double>::infinity();
};

}  // namespace xplane_bridge::core
