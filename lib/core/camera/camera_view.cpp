#include "xplane_bridge/core/camera/camera_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr std::array<std::string_view, 9> kFields{"sim_time",         "frame_period",   "time_ratio_requested",
                                                  "paused",           "replay",         "view_external",
                                                  "view_heading_deg", "view_pitch_deg", "field_of_view_deg"};
// Before anything else of this node: without it nothing can be paired.
constexpr int kPriority = 10;

struct Head {
  double heading_deg;
  double pitch_deg;
};

Head headOf(CameraView view) {
  switch (view) {
    case CameraView::kForward:
      return {0.0, 0.0};
    case CameraView::kRear:
      return {180.0, 0.0};
    case CameraView::kDown:
      return {0.0, -90.0};
    case CameraView::kUnknown:
      break;
  }
  throw std::invalid_argument("an unknown view has no optical frame");
}

// Rotation from the head's forward-left-up axes to those of the aircraft.
Eigen::Quaterniond headOrientation(const Head& head) {
  return Eigen::AngleAxisd(-head.heading_deg * kDegree, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(-head.pitch_deg * kDegree, Eigen::Vector3d::UnitY());
}

std::vector<DatarefRequest> requestsOf() {
  std::vector<DatarefRequest> wanted;
  for (DatarefRequest& request : datarefRequests(FieldGroup::kSim, Transport::kRref, SimulatorVersion{})) {
    if (std::find(kFields.begin(), kFields.end(), request.field->field) != kFields.end()) {
      wanted.push_back(std::move(request));
    }
  }
  return wanted;
}

}  // namespace

CameraView classifyView(double heading_deg, double pitch_deg, double tolerance_deg) {
  if (!std::isfinite(heading_deg) || !std::isfinite(pitch_deg)) return CameraView::kUnknown;
  const Eigen::Quaterniond head = headOrientation({heading_deg, pitch_deg});
  for (const CameraView view : {CameraView::kForward, CameraView::kRear, CameraView::kDown}) {
    if (head.angularDistance(headOrientation(headOf(view))) <= tolerance_deg * kDegree) return view;
  }
  return CameraView::kUnknown;
}

Eigen::Quaterniond opticalOrientation(CameraView view) {
  Eigen::Matrix3d optical;  // columns: right, down, forward in forward-left-up
  optical << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return (headOrientation(headOf(view)) * Eigen::Quaterniond(optical)).normalized();
}

ViewStream::ViewStream() : requests_(requestsOf()), assembler_(requests_.size()) {}

RrefGroup ViewStream::group() const {
  RrefGroup group;
  group.name = "view";
  group.rate_hz = kEveryFrameRateHz;
  group.priority = kPriority;
  for (const DatarefRequest& request : requests_) group.datarefs.push_back(request.path);
  return group;
}

const std::string& ViewStream::fieldOfViewDataref() const {
  const auto found = std::find_if(requests_.begin(), requests_.end(), [](const DatarefRequest& request) {
    return request.field->field == std::string_view("field_of_view_deg");
  });
  return found->path;
}

bool ViewStream::add(const RrefView& datagram, std::int64_t receive_ns) {
  if (!assembler_.add(datagram, receive_ns)) return false;
  status_ = SimStatus();
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    const float value = assembler_.values()[i];
    if (std::isnan(value)) continue;
    const FieldSpec& field = *requests_[i].field;
    const Conversion& unit = field.datarefs.front().conversion;  // all of them have one name in every version
    const double si = static_cast<double>(value) * unit.factor + unit.offset;
    field.store(&status_, &si, 1);  // all of them are single numbers
  }
  return true;
}

float ViewStream::simulatedFramePeriod() const {
  if (!(status_.frame_period > 0.0F)) return 0.0F;
  return status_.time_ratio_requested > 0.0F ? status_.frame_period * status_.time_ratio_requested
                                             : status_.frame_period;
}

void ViewStream::reset() {
  assembler_.reset();
  status_ = SimStatus();
}

}  // namespace xplane_bridge::core
