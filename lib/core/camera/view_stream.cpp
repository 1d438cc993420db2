#include "xplane_bridge/core/camera/view_stream.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace xplane_bridge::core {
namespace {

constexpr std::array<std::string_view, 8> kFields{"sim_time",     "frame_period", "time_ratio_requested",
                                                  "paused",       "replay",       "field_of_view_deg",
                                                  "window_width", "window_height"};
// Before anything else of this node: without it nothing can be paired.
constexpr int kPriority = 10;
constexpr std::size_t kElements = 16;  // of a matrix

/// Settings of the field of view, then the projection.
const std::vector<std::string>& frustumDatarefs() {
  static const std::vector<std::string> datarefs = [] {
    std::vector<std::string> out{"sim/graphics/view/vertical_field_of_view_deg",
                                 "sim/graphics/settings/non_proportional_vertical_FOV",
                                 "sim/graphics/view/field_of_view_horizontal_ratio"};
    for (std::size_t i = 0; i < kElements; ++i) {
      out.push_back("sim/graphics/view/projection_matrix_3d[" + std::to_string(i) + "]");
    }
    return out;
  }();
  return datarefs;
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

/// X-Plane's matrices are column-major.
Eigen::Matrix4d matrixOf(const float* values) {
  return Eigen::Map<const Eigen::Matrix<float, 4, 4, Eigen::ColMajor>>(values).cast<double>();
}

}  // namespace

const std::vector<std::string>& cameraDatarefs() {
  static const std::vector<std::string> datarefs = [] {
    const std::string view = "sim/graphics/view/", position = "sim/flightmodel/position/";
    std::vector<std::string> out{view + "view_type", view + "view_is_external"};
    for (const char* leaf :
         {"view_roll", "view_pitch", "view_heading", "view_x", "view_y", "view_z", "field_of_view_roll_deg",
          "field_of_view_vertical_deg", "field_of_view_horizontal_deg", "pilots_head_phi", "pilots_head_the",
          "pilots_head_psi", "pilots_head_x", "pilots_head_y", "pilots_head_z"}) {
      out.push_back(view + leaf);
    }
    for (const char* leaf :
         {"phi", "theta", "psi", "local_x", "local_y", "local_z", "true_phi", "true_theta", "true_psi"}) {
      out.push_back(position + leaf);
    }
    for (const char* name : {"sim/aircraft/view/acf_peX", "sim/aircraft/view/acf_peY", "sim/aircraft/view/acf_peZ"}) {
      out.emplace_back(name);
    }
    for (std::size_t i = 0; i < kElements; ++i) out.push_back(view + "world_matrix[" + std::to_string(i) + "]");
    return out;
  }();
  return datarefs;
}

CameraSample cameraSample(const float* values) {
  const float* next = values;
  const auto number = [&next] { return static_cast<double>(*next++); };
  const auto angles = [&number] {
    AnglesDeg out;
    out.roll = number();
    out.pitch = number();
    out.heading = number();
    return out;
  };
  const auto vector = [&number] {
    Eigen::Vector3d out;
    for (int i = 0; i < 3; ++i) out[i] = number();
    return out;
  };
  CameraSample sample;
  sample.view_type = number();
  sample.external = number() > 0.5;
  sample.view = angles();
  sample.view_position = vector();
  sample.visual_offset = angles();
  sample.head = angles();
  sample.head_position = vector();
  sample.aircraft = angles();
  sample.aircraft_position = vector();
  sample.aircraft_true = angles();
  sample.eye_position = vector();
  sample.world = matrixOf(next);
  return sample;
}

ViewStream::ViewStream()
    : requests_(requestsOf()), assembler_(requests_.size() + cameraDatarefs().size() + frustumDatarefs().size()) {}

RrefGroup ViewStream::group() const {
  RrefGroup group;
  group.name = "view";
  group.rate_hz = kEveryFrameRateHz;
  group.priority = kPriority;
  for (const DatarefRequest& request : requests_) group.datarefs.push_back(request.path);
  for (const auto* more : {&cameraDatarefs(), &frustumDatarefs()}) {
    group.datarefs.insert(group.datarefs.end(), more->begin(), more->end());
  }
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
  const std::vector<float>& values = assembler_.values();
  status_ = SimStatus();
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (std::isnan(values[i])) continue;
    const FieldSpec& field = *requests_[i].field;
    const Conversion& unit = field.datarefs.front().conversion;  // all of them have one name in every version
    const double si = static_cast<double>(values[i]) * unit.factor + unit.offset;
    field.store(&status_, &si, 1);  // all of them are single numbers
  }
  camera_ = cameraSample(values.data() + requests_.size());
  camera_.sim_time = status_.sim_time;
  camera_.paused = status_.paused || status_.replay;
  const float* frustum = values.data() + requests_.size() + cameraDatarefs().size();
  frustum_.horizontal_deg = status_.field_of_view_deg;
  frustum_.vertical_deg = frustum[0];
  frustum_.non_proportional = frustum[1];
  frustum_.shift_right = frustum[2];
  frustum_.projection = matrixOf(frustum + 3);
  frustum_.width = status_.window_width;
  frustum_.height = status_.window_height;
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
  camera_ = CameraSample();
  frustum_ = FrustumSample();
}

}  // namespace xplane_bridge::core
