// The part of BaseNode that owns the link to X-Plane.

#include <unistd.h>

#include <algorithm>

#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/link_diagnostics.hpp"
#include "xplane_bridge/nodes/base/user_folder.hpp"

namespace xplane_bridge {
namespace {

constexpr double kShortestLinkStop_s = 0.3;

void logToRos(core::LogLevel level, const std::string& text) {
  switch (level) {
    case core::LogLevel::kDebug:
      ROS_DEBUG("%s", text.c_str());
      break;
    case core::LogLevel::kInfo:
      ROS_INFO("%s", text.c_str());
      break;
    case core::LogLevel::kWarn:
      ROS_WARN("%s", text.c_str());
      break;
    case core::LogLevel::kError:
      ROS_ERROR("%s", text.c_str());
      break;
  }
}

}  // namespace

void BaseNode::makeLink() {
  if (!usesLink()) {
    return;
  }
  core::SimLinkOptions options = linkOptions(common_);
  options.jitter_seed = static_cast<std::uint32_t>(getpid());
  configureLink(&options);
  link_ = std::make_unique<core::SimLink>(options, linkCallbacks(), clock_, logToRos,
                                          core::journalsIn(userFolder(), name()));
  addDiagnostics("link to X-Plane", [this, last = core::LinkCounters()](auto& status) mutable {
    const core::LinkCounters now = link_->counters();
    fillLinkDiagnostics(link_->status(), now, last, link_->unansweredDatarefs(), &status);
    last = now;
  });
}

void BaseNode::startLink() {
  if (link_) {
    link_->start();
  }
}

void BaseNode::stopLink(const Deadline& deadline) {
  if (!link_) {
    return;
  }
  if (!link_->stop(std::max(deadline.left(), kShortestLinkStop_s))) {
    const std::shared_ptr<core::Journal> journal = link_->journal();
    ROS_WARN("not everything could be undone in X-Plane; the rest is in %s and is undone at the next start",
             journal ? journal->path().c_str() : "no journal");
  }
}

}  // namespace xplane_bridge
