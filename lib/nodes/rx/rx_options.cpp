#include "xplane_bridge/nodes/rx/rx_options.hpp"

#include <cmath>
#include <set>
#include <stdexcept>

#include <ros/names.h>

#include "xplane_bridge/core/link/sim_link.hpp"
#include "xplane_bridge/core/wire/dataref_path.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge {
namespace {

constexpr double kHighestPublishRate = 10000.0;

core::PositionMode positionMode(const ParamLoader& own) {
  const std::string name = own.choice("position_source", {"auto", "local", "rpos", "xpc", "float32"}, "auto");
  if (name == "local") return core::PositionMode::kLocal;
  if (name == "rpos") return core::PositionMode::kRpos;
  if (name == "xpc") return core::PositionMode::kXpc;
  if (name == "float32") return core::PositionMode::kFloat32;
  return core::PositionMode::kAuto;
}

std::optional<core::GeoPoint> loadOrigin(const ParamLoader& own) {
  if (!own.has("origin")) {
    return std::nullopt;
  }
  const ParamLoader origin = own.section("origin");
  return core::GeoPoint{origin.number("latitude", {-90.0, 90.0}), origin.number("longitude", {-180.0, 180.0}),
                        origin.number("altitude_msl", RxOptions::kOriginAltitude)};
}

Geoid loadGeoid(const ParamLoader& own) {
  const double undulation = own.number("geoid_undulation", {-200.0, 200.0}, 0.0);
  const std::string name = own.text("geoid", "none"), folder = own.text("geoid_folder", "");
  if (name.empty()) own.refuse("geoid", "none, or a model of GeographicLib such as egm96-5");
  if (name == "none") return Geoid(undulation);
  if (undulation != 0.0) own.refuse("geoid_undulation", "0 with geoid " + name + ", which knows it");
  try {
    return Geoid::named(name, folder);
  } catch (const std::runtime_error& error) {
    throw ParamError("parameter " + own.fullKey("geoid") + " is " + name + ": " + error.what());
  }
}

std::vector<DatarefEntry> loadDatarefs(const ParamLoader& own) {
  std::vector<DatarefEntry> entries;
  std::set<std::string> topics;
  for (const ParamLoader& item : own.sections("datarefs")) {
    DatarefEntry entry;
    try {
      entry.elements = core::datarefElements(item.text("name"));
    } catch (const std::invalid_argument& error) {
      item.refuse("name", std::string("one of X-Plane's datarefs as a text: ") + error.what());
    }
    entry.rate = item.integer("rate", {1, core::kEveryFrameRateHz}, entry.rate);
    entry.topic = item.text("topic", "");
    if (!entry.topic.empty()) {
      std::string why;
      if (!ros::names::validate(entry.topic, why) || entry.topic.front() == '/' || entry.topic.front() == '~') {
        item.refuse("topic", "a text: a relative topic name of letters, digits and underscores");
      }
      if (entry.elements.size() != 1) {
        item.refuse("topic", "absent for a range of elements: a scalar topic carries one");
      }
      if (!topics.insert(entry.topic).second) {
        item.refuse("topic", "a text that no other entry of the list uses");
      }
    }
    entries.push_back(entry);
  }
  return entries;
}

// As X-Plane itself counts: 90000 is 9.00.
constexpr int kLowestVersion = 90'000;
constexpr int kHighestVersion = 999'999;

}  // namespace

RxOptions loadRxOptions(const ParamLoader& own) {
  RxOptions options;
  options.max_publish_rate = own.number("max_publish_rate", {0.0, kHighestPublishRate}, options.max_publish_rate);
  const ParamLoader rates = own.section("rates");
  for (std::size_t i = 0; i < core::kFieldGroupCount; ++i) {
    const auto group = static_cast<core::FieldGroup>(i);
    const int lowest = group == core::FieldGroup::kFlight ? 1 : 0;
    options.rates[i] =
        rates.integer(core::toString(group), {lowest, core::kEveryFrameRateHz}, core::defaultRate(group));
  }
  options.wind_rate = rates.number("wind", {0.1, kHighestPublishRate}, options.wind_rate);
  options.traffic_rate = rates.integer("traffic", {0, core::kEveryFrameRateHz}, options.traffic_rate);
  options.position_source = positionMode(own);
  options.xpc_port = own.integer("xpc_port", {1, 65535}, options.xpc_port);
  options.origin = loadOrigin(own);
  options.geoid = loadGeoid(own);
  options.publish_tf = own.boolean("publish_tf", options.publish_tf);
  options.datarefs = loadDatarefs(own);

  options.configure_xplane = own.boolean("configure_xplane", options.configure_xplane);
  options.data_output_rate = own.integer("data_output_rate", {1, 99}, options.data_output_rate);
  options.data_address = own.text("data_address", options.data_address);
  options.xplane_version = own.integer("xplane_version", {0, kHighestVersion}, options.xplane_version);
  if (options.xplane_version > 0 && options.xplane_version < kLowestVersion) {
    own.refuse("xplane_version", "0 (unknown), or X-Plane's internal version such as 115501 (11.55) or 122015 (12.2)");
  }
  for (const double row : own.numbers("extra_rows", {0.0, core::kDataRowLimit - 1.0})) {
    if (row != std::floor(row)) {
      own.refuse("extra_rows", "a list of row numbers");
    }
    options.extra_rows.push_back(static_cast<std::int32_t>(row));
  }
  return options;
}

}  // namespace xplane_bridge
