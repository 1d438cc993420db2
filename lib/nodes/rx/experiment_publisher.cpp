#include "xplane_bridge/nodes/rx/experiment_publisher.hpp"

#include <limits>
#include <utility>

#include "xplane_bridge/core/base/conformance.hpp"
#include "xplane_bridge/core/base/sha256.hpp"
#include "xplane_bridge/nodes/base/build_info.hpp"
#include "xplane_bridge/nodes/base/parameter_text.hpp"

namespace xplane_bridge {
namespace {

using XmlRpc::XmlRpcValue;

// What launch files and programs say of the flight: experiment/aircraft_file is the text of that file.
constexpr const char* kSection = "experiment";
constexpr const char* kAircraftFile = "aircraft_file";

std::string aircraftFileOf(XmlRpcValue parameters) {
  if (parameters.getType() != XmlRpcValue::TypeStruct || !parameters.hasMember(kSection)) return "";
  XmlRpcValue& section = parameters[kSection];
  if (section.getType() != XmlRpcValue::TypeStruct || !section.hasMember(kAircraftFile)) return "";
  XmlRpcValue& file = section[kAircraftFile];
  return file.getType() == XmlRpcValue::TypeString ? static_cast<std::string&>(file) : "";
}

}  // namespace

void ExperimentPublisher::advertise(ros::NodeHandle* handle) {
  publisher_ = handle->advertise<Experiment>("experiment", 1, true);
  message_.package_version = packageVersion();
  message_.commit = packageCommit();
  message_.settings = core::XPlaneSettings::datarefs();
  message_.setting_values.assign(message_.settings.size(), std::numeric_limits<float>::quiet_NaN());
  message_.lockstep = lockstep_;
}

XmlRpcValue ExperimentPublisher::readParameters(const ros::NodeHandle& handle) const {
  XmlRpcValue parameters;
  if (!handle.getParam(handle.getNamespace(), parameters)) return {};
  parameters = withoutSecrets(shared_.asRead(parameters));
  return lockstep_ ? withoutMachine(parameters) : parameters;
}

void ExperimentPublisher::setParameters(const XmlRpcValue& parameters) {
  std::string text = parameterText(parameters);
  if (text == message_.parameters) return;
  message_.parameters = std::move(text);
  message_.parameters_sha256 = core::sha256(message_.parameters);
  const std::string file = aircraftFileOf(parameters);
  message_.aircraft_file_sha256 = file.empty() ? "" : core::sha256(file);
  changed_ = true;
}

void ExperimentPublisher::publish(core::SimulatorVersion version, const core::AircraftIdentity& aircraft,
                                  const core::XPlaneSettings& settings, const ros::Time& stamp) {
  const auto put = [this](auto value, auto* field) {
    if (*field == value) return;
    *field = std::move(value);
    changed_ = true;
  };
  put(version.number, &message_.xplane_version);
  put(core::refutedOf(version.otherwise), &message_.refuted);
  put(aircraft.icao, &message_.aircraft_icao);
  put(aircraft.description, &message_.aircraft_description);
  if (!settings.values().empty() && !core::sameValues(settings.values(), message_.setting_values)) {
    message_.setting_values = settings.values();
    changed_ = true;
  }
  if (!std::exchange(changed_, false)) return;
  message_.header.stamp = stamp;
  publisher_.publish(message_);
}

}  // namespace xplane_bridge
