#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/core/base/thread_turns.hpp"
#include "xplane_bridge/core/camera/camera_pose.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/simulator/view_ways.hpp"

namespace xplane_bridge {

/// Turns X-Plane's camera, and gives it back. What is changed is in the journal first, so that the guardian, the next
/// start and scripts/release_overrides can give it back as well: what is not there any more, they have given back.
/// Thread-safe; all functions but forget() wait.
class ViewRequests {
 public:
  /// `report(text, who, success)`: what was done, for events and the log; `who` is empty where nothing asked for it.
  using Report = std::function<void(const std::string& text, const std::string& who, bool success)>;

  ViewRequests(core::SimulatorPort* link, Report report);

  /// Tries the ways of a wish until X-Plane's camera is measured where it is wanted. Where none leads there, what was
  /// changed is given back.
  /// @param who asks for it
  RequestResult setView(const core::ViewWish& wish, const std::string& who);
  /// Brings back what the first setView() found, but what another node has changed too and still holds: the last one
  /// gives that back. Returns whether X-Plane shows it, or nothing was changed.
  bool giveBack(double timeout_s);
  /// X-Plane is another one, whose view is its own user's: nothing of the last one's comes back. Waits for the
  /// journal's disk only.
  void forget();

 private:
  /// Where X-Plane's camera is.
  struct Shown {
    int view_type = 0;
    core::CameraPose pose;
  };

  RequestResult setViewLocked(const core::ViewWish& wish);
  /// Writes down what is to be changed and was not before, as it is now or, where another node has changed it, was
  /// before that. @param field_of_view it is to be changed, too @return why it cannot be; empty: it was
  std::string remember(bool field_of_view);
  void takeOver(const std::vector<core::DatarefWrite>& writes);
  /// @return what is measured in the end, and whether that is what was wanted
  std::pair<bool, std::optional<Shown>> tryWay(const core::ViewWay& way, const Eigen::Quaterniond& wanted);
  RequestResult setFieldOfView(double field_of_view_deg);
  bool giveBackLocked(double timeout_s);

  core::SimulatorPort* link_;
  Report report_;
  core::TurnMutex mutex_;                // held while waiting for X-Plane
  std::map<std::string, float> before_;  // as the first setView() that changes it found it
  int view_before_ = 0;
  std::vector<std::string> answered_;  // of core::cameraDatarefs()
};

}  // namespace xplane_bridge
