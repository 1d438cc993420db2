#include "xplane_bridge/core/base/conformance.hpp"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/base/whole_number.hpp"

namespace xplane_bridge::core {
namespace {

constexpr int kCardVersion = 1;

struct Switch {
  const char* id;
  Otherwise bit;
  const char* consequence;
};
constexpr Switch kSwitches[] = {
    {"row1-hours", Otherwise::kRow1Hours, "zulu and local time are taken from datarefs, not from row 1"},
    {"row16", Otherwise::kRow16, "rates are taken from datarefs, not from row 16"},
    {"row17-axes", Otherwise::kRow17Axes,
     "row 17's angles are turned from the scenery origin's axes to the local level"},
    {"row20", Otherwise::kRow20, "position and height are taken from datarefs, not from row 20"},
    {"row28-unit", Otherwise::kRow28Unit, "propeller commands are taken from datarefs, not from row 28"},
    {"row115-bits", Otherwise::kRow115Bits, "annunciators by engine are taken from datarefs, not from row 115"},
    {"row116-modes", Otherwise::kRow116Modes, "autopilot modes are taken from datarefs, not from rows 116 and 117"},
    {"beta-sign", Otherwise::kBetaSign, "X-Plane's beta is taken + with wind from the right"},
    {"vehs", Otherwise::kVehs, "flights are placed by PREL, not by VEHS"},
    {"fcon-acts", Otherwise::kFconActs, "broken surfaces are driven, not left to rel_fcon_*"},
};

const Switch* switchOf(const std::string& id) {
  const auto found =
      std::find_if(std::begin(kSwitches), std::end(kSwitches), [&id](const Switch& each) { return each.id == id; });
  return found == std::end(kSwitches) ? nullptr : found;
}

}  // namespace

std::uint32_t Conformance::otherwise() const {
  std::uint32_t bits = 0;
  for (const std::string& id : refuted) {
    if (const Switch* const found = switchOf(id)) bits |= static_cast<std::uint32_t>(found->bit);
  }
  return bits;
}

Conformance conformanceFromText(const std::string& text) {
  using Json = nlohmann::json;
  try {
    const Json root = Json::parse(text);
    if (root.at("format") != "xplane_bridge conformance") throw ConformanceError("it is no conformance file");
    if (root.at("version") != kCardVersion) throw ConformanceError("its version is not 1; fly the card anew");
    Conformance out;
    out.xplane_version = wholeNumber<std::int32_t>(root.at("xplane_version"));
    for (const auto& [id, question] : root.at("questions").items()) {
      if (question.at("verdict") == "refuted") out.refuted.push_back(id);
    }
    return out;
  } catch (const Json::exception& error) {
    throw ConformanceError(error.what());
  } catch (const std::out_of_range& error) {
    throw ConformanceError(error.what());
  }
}

std::vector<std::string> refutedOf(std::uint32_t otherwise) {
  std::vector<std::string> ids;
  for (const Switch& each : kSwitches) {
    if ((otherwise & static_cast<std::uint32_t>(each.bit)) != 0U) ids.emplace_back(each.id);
  }
  return ids;
}

std::string consequenceOf(const std::string& id) {
  const Switch* const found = switchOf(id);
  return found == nullptr ? "" : found->consequence;
}

}  // namespace xplane_bridge::core
