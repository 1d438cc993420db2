#include "xplane_bridge/nodes/joystick/joy_source.hpp"

#include <utility>

#include "xplane_bridge/core/base/node_name.hpp"

namespace xplane_bridge {

JoySource::JoySource(double timeout, std::string only) : timeout_(timeout), only_(std::move(only)), holder_(only_) {}

bool JoySource::accept(const std::string& publisher, double now) {
  const bool may = only_.empty() || core::isNamed(publisher, only_);
  if (may && (publisher == holder_ || now >= heard_ + timeout_)) {
    holder_ = publisher;
    heard_ = now;
    return true;
  }
  ++refused_;
  problem_ = "two nodes publish joy: " + holder_ + " is on the stick, the messages of " + publisher +
             " are dropped; end one of them, with: rosnode kill NAME";
  return false;
}

}  // namespace xplane_bridge
