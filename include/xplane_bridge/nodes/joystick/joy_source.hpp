#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace xplane_bridge {

/// Which of the nodes that publish `joy` is on the stick. Messages of two would take turns in the commands, each of
/// them sound: what one node shows counts until it has been silent for as long as ends a device.
class JoySource {
 public:
  /// @param timeout [s]
  /// @param only a node as in core::isNamed(), the others never count; empty: any
  explicit JoySource(double timeout, std::string only = "");

  /// Whether a message of the node `publisher`, heard at `now` [s], counts.
  bool accept(const std::string& publisher, double now);

  /// Messages that did not count.
  std::uint64_t refused() const { return refused_; }
  /// Both nodes in one sentence, once a message did not count; else empty.
  const std::string& problem() const { return problem_; }

 private:
  double timeout_;  // [s]
  std::string only_;
  std::string holder_;
  double heard_ = -std::numeric_limits<double>::infinity();  // [s]
  std::uint64_t refused_ = 0;
  std::string problem_;
};

}  // namespace xplane_bridge
