// The mixing file: one JSON document, which every YAML reader takes. Kept apart because only this needs the library.
#include <nlohmann/json.hpp>

#include "xplane_bridge/core/surfaces/surface_mixing.hpp"

#include <algorithm>
#include <cmath>

namespace xplane_bridge::core {
namespace {

constexpr int kFormatVersion = 1;
using Json = nlohmann::json;

Json termsToJson(const MixingVector& values, const std::array<bool, kMixingTerms>& chosen) {
  Json out = Json::object();
  for (std::size_t j = 0; j < kMixingTerms; ++j) {
    if (chosen[j]) out[toString(static_cast<MixingTerm>(j))] = values[static_cast<Eigen::Index>(j)];
  }
  return out;
}

std::size_t termNumber(const std::string& name) {
  for (std::size_t j = 0; j < kMixingTerms; ++j) {
    if (name == toString(static_cast<MixingTerm>(j))) return j;
  }
  throw MixingFileError("mixing file: \"" + name + "\" is no term");
}

double finite(const Json& value, const std::string& where) {
  const double number = value.get<double>();
  if (!std::isfinite(number)) throw MixingFileError("mixing file: " + where + " is not finite");
  return number;
}

SurfaceLaw lawFromJson(const std::string& name, const Json& json) {
  const auto surface = surfaceNumber(name);
  if (!surface) throw MixingFileError("mixing file: \"" + name + "\" is no surface");
  SurfaceLaw law;
  law.surface = *surface;
  law.residual_deg = finite(json.at("residual_deg"), name + ".residual_deg");
  law.low_deg = finite(json.at("low_deg"), name + ".low_deg");
  law.high_deg = finite(json.at("high_deg"), name + ".high_deg");
  if (!(law.high_deg > law.low_deg)) throw MixingFileError("mixing file: " + name + ".high_deg is not above low_deg");
  const std::string slopes = name + ".slopes_deg.";
  for (const auto& [term, slope] : json.at("slopes_deg").items()) {
    std::string path = slopes;
    law.slopes[static_cast<Eigen::Index>(termNumber(term))] = finite(slope, path.append(term));
  }
  return law;
}

}  // namespace

std::string toText(const MixingModel& model) {
  std::array<bool, kMixingTerms> unknown{};
  for (std::size_t j = 0; j < kMixingTerms; ++j) unknown[j] = !model.known[j];
  Json surfaces = Json::object();
  for (const SurfaceLaw& law : model.laws) {
    surfaces[surfaceTable()[law.surface].name] = {{"slopes_deg", termsToJson(law.slopes, model.known)},
                                                  {"residual_deg", law.residual_deg},
                                                  {"low_deg", law.low_deg},
                                                  {"high_deg", law.high_deg}};
  }
  const Json root = {{"format", "xplane_bridge mixing"},
                     {"version", kFormatVersion},
                     {"aircraft", model.aircraft},
                     {"samples", model.samples},
                     {"level", termsToJson(model.level, unknown)},
                     {"surfaces", surfaces}};
  return root.dump(2) + "\n";
}

MixingModel mixingFromText(const std::string& text) {
  try {
    const Json root = Json::parse(text);
    if (root.at("format") != "xplane_bridge mixing") throw MixingFileError("mixing file: not a mixing file");
    if (root.at("version") != kFormatVersion)
      throw MixingFileError("mixing file: version is not 1; remove it and fly anew");
    MixingModel model;
    model.aircraft = root.at("aircraft").get<std::string>();
    model.samples = root.at("samples").get<std::size_t>();
    model.known.fill(true);
    for (const auto& [term, level] : root.at("level").items()) {
      const std::size_t j = termNumber(term);
      model.known[j] = false;
      model.level[static_cast<Eigen::Index>(j)] = finite(level, "level." + term);
    }
    for (const auto& [name, law] : root.at("surfaces").items()) model.laws.push_back(lawFromJson(name, law));
    std::sort(model.laws.begin(), model.laws.end(),
              [](const SurfaceLaw& a, const SurfaceLaw& b) { return a.surface < b.surface; });
    return model;
  } catch (const Json::exception& error) {
    throw MixingFileError(std::string("mixing file: ") + error.what());
  }
}

}  // namespace xplane_bridge::core
