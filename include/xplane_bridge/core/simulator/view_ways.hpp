#pragma once

/// How tx_node's set_view brings X-Plane's camera where a client wants it: without a plugin there is no camera message,
/// so each wish has several ways, the best one first.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/camera/camera_pose.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"

namespace xplane_bridge::core {

/// What a client wants to see; numbers as in SetView.srv.
struct ViewWish {
  enum Direction : int { kForward = 1, kRear = 2, kDown = 3, kCockpit = 4, kTurned = 5 };
  int direction = kForward;
  AnglesDeg turn{0.0, 0.0, 0.0};   ///< of kTurned
  double field_of_view_deg = 0.0;  ///< 0: as it is
};

/// What is wrong with a wish, as one sentence; nothing when it can be tried.
std::optional<std::string> check(const ViewWish& wish);

/// Where the camera must be turned to: optical vectors into base_link.
Eigen::Quaterniond orientationOf(const ViewWish& wish);

/// One way to a view.
struct ViewWay {
  std::string command;               ///< of X-Plane: the view, or a glance
  ViewType view_type;                ///< what X-Plane shows then
  std::vector<DatarefWrite> writes;  ///< to be sent after the command: visual offset, head
};

/// The ways of a wish, to be tried in this order. Down and rear without a cockpit come of the picture's visual offset,
/// which is made for several monitors [? offset-turns]; then of a glance [? glance-holds]; down also of a pilot's head
/// below the fuselage.
std::vector<ViewWay> waysTo(const ViewWish& wish);

/// All datarefs that a way may write, besides the field of view.
const std::vector<std::string>& viewDatarefs();
inline constexpr const char* kFieldOfViewDataref = "sim/graphics/view/field_of_view_deg";
/// The command that leads back to a view; empty where none is known.
std::string commandOf(int view_type);

}  // namespace xplane_bridge::core
