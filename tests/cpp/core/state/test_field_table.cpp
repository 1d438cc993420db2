#include "xplane_bridge/core/state/field_table.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "field_table_markdown.hpp"

namespace xplane_bridge::core {
namespace {

const std::vector<FieldGroup> kAllGroups = {FieldGroup::kFlight,   FieldGroup::kEngines,    FieldGroup::kSurfaces,
                                            FieldGroup::kControls, FieldGroup::kElectrical, FieldGroup::kAutopilot,
                                            FieldGroup::kWarnings, FieldGroup::kFuel,       FieldGroup::kSim};

std::string readFile(const std::string& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

const FieldSpec& find(FieldGroup group, const std::string& name) {
  for (const FieldSpec& field : fieldTable()) {
    if (field.group == group && field.field == name) return field;
  }
  ADD_FAILURE() << "no field " << name;
  return fieldTable().front();
}

std::set<std::string> paths(FieldGroup group, Transport transport, SimulatorVersion version) {
  std::set<std::string> result;
  for (const DatarefRequest& request : datarefRequests(group, transport, version)) result.insert(request.path);
  return result;
}

TEST(FieldTable, FlightGroupFitsOneDatagram) {
  for (const SimulatorVersion version : {kXPlane11, kXPlane12}) {
    const std::size_t count = datarefRequests(FieldGroup::kFlight, Transport::kRref, version).size();
    EXPECT_LE(count, 80U);
    EXPECT_GT(count, 50U);
  }
}

TEST(FieldTable, FlightGroupCarriesItsTime) {
  const auto flight = paths(FieldGroup::kFlight, Transport::kRref, kXPlane11);
  for (const char* path : {"sim/time/total_running_time_sec", "sim/operation/misc/frame_rate_period", "sim/time/paused",
                           "sim/time/is_in_replay"}) {
    EXPECT_EQ(flight.count(path), 1U) << path;
  }
}

// X-Plane answers one sender's request of an index once: a path twice in a group is a waste, never an error to
// overlook.
TEST(FieldTable, NoGroupAsksTwice) {
  for (const FieldGroup group : kAllGroups) {
    for (const SimulatorVersion version : {kXPlane11, kXPlane12}) {
      const auto requests = datarefRequests(group, Transport::kRref, version);
      EXPECT_EQ(requests.size(), paths(group, Transport::kRref, version).size()) << toString(group);
    }
  }
}

TEST(FieldTable, EveryFieldHasASourceOrADerivation) {
  for (const FieldSpec& field : fieldTable()) {
    SCOPED_TRACE(std::string(toString(field.group)) + "." + field.field);
    const bool sourced = field.datarefs.front().path != nullptr || field.row.row11 >= 0;
    EXPECT_EQ(sourced, field.store != nullptr);
    if (!sourced) {
      EXPECT_STRNE(field.remark, "");
    }
    EXPECT_GE(field.count, 1);
    EXPECT_LE(field.count, kMaxFieldElements);
    EXPECT_STRNE(field.unit, "");
    std::size_t most = 0;  // a version may have fewer elements: X-Plane 11 has 3 layers of wind, X-Plane 12 has 13
    for (const DatarefSource& source : field.datarefs) {
      if (source.path != nullptr) most = std::max(most, expandDatarefPath(source.path, field.count).size());
    }
    if (most != 0 && field.store != nullptr) {
      EXPECT_EQ(most, static_cast<std::size_t>(field.count));
    }
    if (field.row.row11 >= 0) {
      EXPECT_LT(field.row.row11, 139);
      EXPECT_GE(field.row.count, 1);
      EXPECT_LE(field.row.count, field.count);
      const int last = field.row.bitfield ? 0 : field.row.count - 1;
      EXPECT_LE(field.row.slot11 + last, 7);
      EXPECT_LE(field.row.slot12 + last, 7);
    }
  }
}

// Row 16: X-Plane 9 to 11 Q, P, R in rad/s; 12 P, Q, R in deg/s (docs/protocol.md 1.6).
TEST(FieldTable, Row16DiffersBetweenVersions) {
  const FieldSpec& p = find(FieldGroup::kFlight, "roll_rate");
  EXPECT_EQ(p.row.row11, 16);
  EXPECT_EQ(p.row.slot11, 1);
  EXPECT_DOUBLE_EQ(p.row.conversion11.factor, 1.0);
  EXPECT_EQ(p.row.slot12, 0);
  EXPECT_NEAR(p.row.conversion12.factor, 0.0174532925, 1e-9);
  const FieldSpec& q = find(FieldGroup::kFlight, "pitch_rate");
  EXPECT_EQ(q.row.slot11, 0);
  EXPECT_EQ(q.row.slot12, 1);
  EXPECT_EQ(find(FieldGroup::kFlight, "yaw_rate").row.slot11, 2);
}

TEST(FieldTable, SignsOfLoadsFollowTheSource) {
  const FieldSpec& axial = find(FieldGroup::kFlight, "load_factor_axial");
  EXPECT_DOUBLE_EQ(axial.row.conversion11.factor, 1.0);
  EXPECT_DOUBLE_EQ(axial.datarefs.front().conversion.factor, -1.0);
  EXPECT_DOUBLE_EQ(find(FieldGroup::kFlight, "declination_deg").row.conversion11.factor, -1.0);
}

TEST(FieldTable, VersionsHaveTheirOwnNames) {
  const auto v11 = paths(FieldGroup::kFlight, Transport::kRref, kXPlane11);
  const auto v12 = paths(FieldGroup::kFlight, Transport::kRref, kXPlane12);
  EXPECT_EQ(v11.count("sim/weather/wind_now_x_msc"), 1U);
  EXPECT_EQ(v12.count("sim/weather/aircraft/wind_now_x_msc"), 1U);
  EXPECT_EQ(v12.count("sim/weather/wind_now_x_msc"), 0U);
  EXPECT_EQ(v11.count("sim/flightmodel/position/equivalent_airspeed"), 0U);
  EXPECT_EQ(v12.count("sim/flightmodel/position/equivalent_airspeed"), 1U);
}

TEST(FieldTable, NamesChangeWithinAVersion) {
  const SimulatorVersion first12{120000};
  const auto v1200 = paths(FieldGroup::kFlight, Transport::kRref, first12);
  const auto v1208 = paths(FieldGroup::kFlight, Transport::kRref, SimulatorVersion{120800});
  const auto v11 = paths(FieldGroup::kFlight, Transport::kRref, kXPlane11);
  const std::string old_air = "sim/weather/barometer_current_inhg";
  const std::string new_air = "sim/weather/aircraft/barometer_current_pas";
  const std::string pressure_altitude = "sim/flightmodel2/position/pressure_altitude";
  EXPECT_EQ(v1200.count(old_air), 1U);
  EXPECT_EQ(v1200.count(new_air), 0U);
  EXPECT_EQ(v1208.count(old_air), 0U);
  EXPECT_EQ(v1208.count(new_air), 1U);
  EXPECT_EQ(v11.count(pressure_altitude), 0U);
  EXPECT_EQ(v1200.count(pressure_altitude), 0U);
  EXPECT_EQ(v1208.count(pressure_altitude), 1U);
  const std::string nacelle = "sim/flightmodel2/engines/nacelle_vertical_angle_deg[0]";
  EXPECT_EQ(paths(FieldGroup::kControls, Transport::kRref, SimulatorVersion{119999}).count(nacelle), 1U);
  EXPECT_EQ(paths(FieldGroup::kControls, Transport::kRref, first12).count(nacelle), 0U);
}

TEST(FieldTable, NoVersionHasTwoSourcesOfAField) {
  for (const FieldSpec& field : fieldTable()) {
    const auto& [one, other] = field.datarefs;
    if (other.path == nullptr) continue;
    EXPECT_TRUE(one.versions.end <= other.versions.first || other.versions.end <= one.versions.first) << field.field;
  }
}

TEST(FieldTable, UnknownVersionAsksOnlyWhatBothHave) {
  const auto unknown = paths(FieldGroup::kFlight, Transport::kRref, SimulatorVersion{});
  EXPECT_EQ(unknown.count("sim/weather/wind_now_x_msc"), 0U);
  EXPECT_EQ(unknown.count("sim/weather/aircraft/wind_now_x_msc"), 0U);
  EXPECT_EQ(unknown.count("sim/flightmodel/position/true_phi"), 1U);
}

TEST(FieldTable, RowsOfTheFlightGroup) {
  const std::vector<std::int32_t> rows = dataRows({FieldGroup::kFlight}, kXPlane11);
  EXPECT_EQ(rows, (std::vector<std::int32_t>{0, 1, 3, 4, 5, 6, 8, 16, 17, 18, 19, 20, 21, 25, 64}));
}

TEST(FieldTable, DataTransportAsksOnlyWhatNoRowCarries) {
  const auto supplement = paths(FieldGroup::kFlight, Transport::kData, kXPlane11);
  EXPECT_EQ(supplement.count("sim/time/paused"), 1U);
  EXPECT_EQ(supplement.count("sim/flightmodel/failures/onground_any"), 1U);
  EXPECT_EQ(supplement.count("sim/flightmodel/position/true_phi"), 0U);
  EXPECT_LE(supplement.size(), 15U);
}

TEST(FieldTable, EnginesLimitTheRequests) {
  const auto two = datarefRequests(FieldGroup::kEngines, Transport::kRref, kXPlane11, 2);
  EXPECT_EQ(two.size(), 6U + 31U * 2U);
  EXPECT_EQ(datarefRequests(FieldGroup::kEngines, Transport::kRref, kXPlane11).size(), 6U + 31U * 8U);
}

TEST(DatarefPath, Expands) {
  EXPECT_EQ(expandDatarefPath("a/b", 3), std::vector<std::string>{"a/b"});
  EXPECT_EQ(expandDatarefPath("a[*]", 3), (std::vector<std::string>{"a[0]", "a[1]", "a[2]"}));
  EXPECT_EQ(expandDatarefPath("w{1,2}{l,r}_d", 4), (std::vector<std::string>{"w1l_d", "w1r_d", "w2l_d", "w2r_d"}));
}

TEST(FieldTableDoc, CommittedPageIsUpToDate) {
  EXPECT_EQ(readFile(XPLANE_BRIDGE_TEST_DATA "/../../docs/fields.md"), fieldTableMarkdown())
      << "run field_table_doc > docs/fields.md";
}

}  // namespace
}  // namespace xplane_bridge::core
