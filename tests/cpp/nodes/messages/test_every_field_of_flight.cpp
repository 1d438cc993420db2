// Every field of requests about flight, weather and traffic, and of what the link and traffic publish: each has a
// number or text of its own, and is found under its name on the other side, as in test_every_field_of_actuation.cpp.
// What is wrong with a list names that list.

#include <gtest/gtest.h>

#include <cmath>

#include "expected_fields.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"
#include "xplane_bridge/nodes/messages/flight_conversions.hpp"
#include "xplane_bridge/nodes/messages/reset_request.hpp"
#include "xplane_bridge/nodes/messages/traffic_conversions.hpp"

namespace xplane_bridge {
namespace {

const std::set<std::string> kNone;

/// It begins so.
void expectBegins(const std::optional<std::string>& text, const std::string& with) {
  ASSERT_TRUE(text) << "expected \"" << with << " ...\"";
  EXPECT_EQ(text->substr(0, with.size()), with);
}

// --- the link ---

TEST(EveryField, OfLinkStateIsThatOfTheLink) {
  core::LinkStatus link;
  link.state = core::LinkState::kStale;
  link.reason = "reason";
  link.epoch = 31;
  link.since_steady_ns = 32;  // no field
  link.peer = {core::kLoopbackAddress, 33};
  link.computer_name = "computer";
  link.version.number = 34;
  link.silence_s = 35.0;
  MessageContent expected;
  expected.values = {{"state", {LinkState::STALE}},
                     {"link_epoch", {31.0}},
                     {"port", {33.0}},
                     {"xplane_version", {34.0}},
                     {"silence", {35.0}}};
  expected.texts = {{"state_name", {core::toString(core::LinkState::kStale)}},
                    {"reason", {"reason"}},
                    {"host", {"127.0.0.1"}},
                    {"transport", {"transport"}},
                    {"host_name", {"computer"}}};
  LinkState message;
  toMessage(link, "transport", &message);
  expectMessage(message, expected, headerAnd({"aircraft_icao", "aircraft_description"}));
  link.peer = {};
  toMessage(link, "transport", &message);
  EXPECT_EQ(message.host, "") << "unknown";
}

// --- where a flight begins ---

TEST(EveryField, OfResetFlightIsOneOfAPlaceOrOfASpotOfAnAirport) {
  FilledMessage<ResetFlight::Request> sent;
  const core::FlightStart place = toCore(sent.message());
  EXPECT_EQ(place.latitude_deg, sent.number("latitude"));
  EXPECT_EQ(place.longitude_deg, sent.number("longitude"));
  EXPECT_EQ(place.altitude_msl, sent.number("altitude_msl"));
  EXPECT_EQ(place.roll_deg, sent.number("roll_deg"));
  EXPECT_EQ(place.pitch_deg, sent.number("pitch_deg"));
  EXPECT_EQ(place.heading_true_deg, sent.number("heading_true_deg"));
  EXPECT_EQ(place.true_airspeed, sent.number("true_airspeed"));
  EXPECT_EQ(place.flight_path_angle_deg, sent.number("flight_path_angle_deg"));
  const core::AirportStart spot = airportStart(sent.message());
  EXPECT_EQ(static_cast<double>(spot.spot), sent.number("start"));
  EXPECT_EQ(spot.airport, sent.text("airport"));
  EXPECT_EQ(spot.name, sent.text("spot"));
  EXPECT_EQ(spot.index, sent.number("spot_index"));
  EXPECT_EQ(spot.end, sent.number("runway_end"));
  EXPECT_EQ(spot.final_distance, sent.number("final_distance"));
  EXPECT_EQ(spot.true_airspeed, sent.number("true_airspeed"));
  EXPECT_EQ(spot.roll_deg, sent.number("roll_deg"));
  EXPECT_EQ(spot.pitch_deg, sent.number("pitch_deg"));
  EXPECT_FALSE(spot.at) << "X-Plane's file of airports says it";
  EXPECT_EQ(sent.unasked(), kNone);
}

TEST(EveryField, OfResetFlightThatDoesNotGoWithTheStartIsNamed) {
  using Request = ResetFlight::Request;
  const MessageLayout layout = MessageLayout::of<Request>();
  const auto with = [&layout](std::uint8_t start, const std::string& field) {
    MessageValues values;
    for (const std::string& name : layout.fields()) {
      values[name] = {name == "start" ? static_cast<double>(start) : name == field ? 1.0 : 0.0};
    }
    return wrongWith(layout.make<Request>(values, {{"airport", {"LOWI"}}}));
  };
  for (const char* field : {"latitude", "longitude", "altitude_msl", "heading_true_deg", "flight_path_angle_deg",
                            "true_airspeed", "roll_deg", "pitch_deg", "final_distance", "runway_end"}) {
    SCOPED_TRACE(field);
    expectBegins(with(Request::RAMP, field), std::string(field) + " does not go with start 1: ");
  }
  for (const char* field : {"latitude", "longitude", "altitude_msl", "heading_true_deg", "flight_path_angle_deg"}) {
    SCOPED_TRACE(field);
    expectBegins(with(Request::FINAL, field), std::string(field) + " does not go with start 3: ");
  }
  EXPECT_EQ(with(Request::RAMP, ""), std::nullopt);
  EXPECT_EQ(with(Request::RUNWAY, "runway_end"), std::nullopt);
  expectBegins(with(Request::PLACE, ""), "airport does not go with start 0 (PLACE)");
  for (const char* field : {"spot_index", "runway_end", "final_distance"}) {
    SCOPED_TRACE(field);
    MessageValues values;
    for (const std::string& name : layout.fields()) values[name] = {name == field ? 1.0 : 0.0};
    expectBegins(wrongWith(layout.make<Request>(values)), std::string(field) + " does not go with start 0 (PLACE)");
  }
  Request named;
  named.latitude = 47.0;
  EXPECT_EQ(wrongWith(named), std::nullopt);
  named.spot = "33L";
  expectBegins(wrongWith(named), "spot does not go with start 0 (PLACE)");
}

TEST(EveryField, OfBitsWithoutAMeaningIsRefused) {
  SetTime::Request time;
  time.fields = SetTime::Request::ZULU_TIME;
  EXPECT_EQ(wrongWith(time), std::nullopt);
  time.fields |= 64U;
  EXPECT_EQ(wrongWith(time).value_or(""), "fields is 0x42: bits 0x40 have no meaning");
  SetWeather::Request weather;
  weather.fields = SetWeather::Request::ALL_FIELDS + 1U;
  EXPECT_EQ(wrongWith(weather).value_or(""), "fields is 0x40: bits 0x40 have no meaning");
  SetAutopilot::Request autopilot;
  autopilot.fields = 0x80000000U | SetAutopilot::Request::ALL_FIELDS;
  EXPECT_EQ(wrongWith(autopilot).value_or(""), "fields is 0x800007ff: bits 0x80000000 have no meaning");
}

// --- wind, loading, autopilot, time, weather ---

TEST(EveryField, OfSetWindIsOneOfTheWind) {
  FilledMessage<SetWind::Request> sent;
  const core::UniformWind got = toCore(sent.message());
  EXPECT_EQ(got.speed, sent.number("speed"));
  EXPECT_EQ(got.from_deg, sent.number("from_deg"));
  EXPECT_EQ(got.turbulence, sent.number("turbulence"));
  EXPECT_EQ(sent.unasked(), kNone);
}

TEST(EveryField, OfSetLoadingIsOneOfTheLoading) {
  FilledMessage<SetLoading::Request> sent;
  const core::Loading got = toCore(sent.message());
  EXPECT_EQ(got.fuel_tank, sent.numbers("fuel_tank"));
  EXPECT_EQ(got.payload_mass, sent.number("payload_mass"));
  EXPECT_EQ(got.cg_offset, sent.number("cg_offset"));
  EXPECT_EQ(sent.unasked(), kNone);

  SetLoading::Request request = sent.message();
  request.payload_mass = std::nanf("");
  EXPECT_EQ(toCore(request).payload_mass, std::nullopt);
  EXPECT_EQ(toCore(request).cg_offset, sent.number("cg_offset"));
  request.payload_mass = request.cg_offset = 0.0F;
  EXPECT_EQ(toCore(request).payload_mass, std::nullopt) << "both left out";
  EXPECT_EQ(toCore(request).cg_offset, std::nullopt);
}

TEST(EveryField, OfSetAutopilotIsOneOfTheSetting) {
  using Request = SetAutopilot::Request;
  for (unsigned pass = 0; pass < kPasses; ++pass) {
    FilledMessage<Request> sent(pass, {{"fields", {Request::ALL_FIELDS}}});
    const core::AutopilotSetting got = toCore(sent.message());
    EXPECT_EQ(static_cast<double>(got.master.value()), sent.number("master"));
    EXPECT_EQ(static_cast<double>(got.lateral.value()), sent.number("lateral"));
    EXPECT_EQ(static_cast<double>(got.vertical.value()), sent.number("vertical"));
    EXPECT_EQ(got.altitude_armed, sent.number("altitude_armed") != 0.0);
    EXPECT_EQ(got.autothrottle, sent.number("autothrottle") != 0.0);
    EXPECT_EQ(got.yaw_damper, sent.number("yaw_damper") != 0.0);
    EXPECT_EQ(got.heading_magnetic_deg, sent.number("heading_magnetic_deg"));
    EXPECT_EQ(got.altitude, sent.number("altitude"));
    EXPECT_EQ(got.vertical_speed, sent.number("vertical_speed"));
    EXPECT_EQ(got.airspeed, sent.number("airspeed"));
    EXPECT_EQ(got.mach, sent.number("mach"));
    EXPECT_EQ(got.restore_on_exit, sent.number("restore_on_exit") != 0.0);
    sent.number("fields");
    EXPECT_EQ(sent.unasked(), kNone);
  }
  std::uint32_t bits = 0;
  for (const std::uint32_t bit : {Request::MASTER, Request::LATERAL, Request::VERTICAL, Request::ALTITUDE_ARMED,
                                  Request::AUTOTHROTTLE, Request::YAW_DAMPER, Request::HEADING, Request::ALTITUDE,
                                  Request::VERTICAL_SPEED, Request::AIRSPEED, Request::MACH}) {
    SCOPED_TRACE(bit);
    const core::AutopilotSetting got =
        toCore(FilledMessage<Request>(0, {{"fields", {static_cast<double>(bit)}}}).message());
    EXPECT_EQ(got.master.has_value(), bit == Request::MASTER);
    EXPECT_EQ(got.lateral.has_value(), bit == Request::LATERAL);
    EXPECT_EQ(got.vertical.has_value(), bit == Request::VERTICAL);
    EXPECT_EQ(got.altitude_armed.has_value(), bit == Request::ALTITUDE_ARMED);
    EXPECT_EQ(got.autothrottle.has_value(), bit == Request::AUTOTHROTTLE);
    EXPECT_EQ(got.yaw_damper.has_value(), bit == Request::YAW_DAMPER);
    EXPECT_EQ(got.heading_magnetic_deg.has_value(), bit == Request::HEADING);
    EXPECT_EQ(got.altitude.has_value(), bit == Request::ALTITUDE);
    EXPECT_EQ(got.vertical_speed.has_value(), bit == Request::VERTICAL_SPEED);
    EXPECT_EQ(got.airspeed.has_value(), bit == Request::AIRSPEED);
    EXPECT_EQ(got.mach.has_value(), bit == Request::MACH);
    bits |= bit;
  }
  EXPECT_EQ(bits, Request::ALL_FIELDS);
}

TEST(EveryField, OfSetTimeIsOneOfTheSetting) {
  using Request = SetTime::Request;
  for (unsigned pass = 0; pass < 2; ++pass) {
    FilledMessage<Request> sent(pass, {{"fields", {Request::ALL_FIELDS}}});
    const core::TimeSetting got = toCore(sent.message());
    EXPECT_EQ(got.date_days, sent.number("date_days"));
    EXPECT_EQ(got.zulu_time, sent.number("zulu_time"));
    EXPECT_EQ(got.time_ratio, sent.number("time_ratio"));
    EXPECT_EQ(got.restore_on_exit, sent.number("restore_on_exit") != 0.0);
    sent.number("fields");
    EXPECT_EQ(sent.unasked(), kNone);
  }
  for (const std::uint32_t bit : {Request::DATE, Request::ZULU_TIME, Request::TIME_RATIO}) {
    SCOPED_TRACE(bit);
    const core::TimeSetting got = toCore(FilledMessage<Request>(0, {{"fields", {static_cast<double>(bit)}}}).message());
    EXPECT_EQ(got.date_days.has_value(), bit == Request::DATE);
    EXPECT_EQ(got.zulu_time.has_value(), bit == Request::ZULU_TIME);
    EXPECT_EQ(got.time_ratio.has_value(), bit == Request::TIME_RATIO);
  }
}

TEST(EveryField, OfSetWeatherIsOneOfTheWeather) {
  using Request = SetWeather::Request;
  for (unsigned pass = 0; pass < 2; ++pass) {
    FilledMessage<Request> sent(pass, {{"fields", {Request::ALL_FIELDS}}});
    const core::Weather got = toCore(sent.message());
    ASSERT_EQ(got.wind.value().size(), 2U);
    ASSERT_EQ(got.clouds.value().size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const core::WindLayer& wind = (*got.wind)[i];
      EXPECT_EQ(wind.altitude, sent.numbers("wind_layer_altitude")[i]);
      EXPECT_EQ(wind.from_deg, sent.numbers("wind_layer_from_deg")[i]);
      EXPECT_EQ(wind.speed, sent.numbers("wind_layer_speed")[i]);
      EXPECT_EQ(wind.shear, sent.numbers("wind_layer_shear")[i]);
      EXPECT_EQ(wind.turbulence, sent.numbers("wind_layer_turbulence")[i]);
      const core::CloudLayer& cloud = (*got.clouds)[i];
      EXPECT_EQ(cloud.base, sent.numbers("cloud_base")[i]);
      EXPECT_EQ(cloud.top, sent.numbers("cloud_top")[i]);
      EXPECT_EQ(cloud.cover, sent.numbers("cloud_cover")[i]);
      EXPECT_EQ(cloud.type, sent.numbers("cloud_type")[i]);
    }
    EXPECT_EQ(got.visibility, sent.number("visibility"));
    EXPECT_EQ(got.precipitation, sent.number("precipitation"));
    EXPECT_EQ(got.sea_level_temperature, sent.number("sea_level_temperature"));
    EXPECT_EQ(got.sea_level_pressure, sent.number("sea_level_pressure"));
    EXPECT_EQ(got.restore_on_exit, sent.number("restore_on_exit") != 0.0);
    sent.number("fields");
    EXPECT_EQ(sent.unasked(), kNone);
  }
  for (const std::uint32_t bit : {Request::WIND, Request::CLOUDS, Request::VISIBILITY, Request::PRECIPITATION,
                                  Request::TEMPERATURE, Request::PRESSURE}) {
    SCOPED_TRACE(bit);
    const core::Weather got = toCore(FilledMessage<Request>(0, {{"fields", {static_cast<double>(bit)}}}).message());
    EXPECT_EQ(got.wind.has_value(), bit == Request::WIND);
    EXPECT_EQ(got.clouds.has_value(), bit == Request::CLOUDS);
    EXPECT_EQ(got.visibility.has_value(), bit == Request::VISIBILITY);
    EXPECT_EQ(got.precipitation.has_value(), bit == Request::PRECIPITATION);
    EXPECT_EQ(got.sea_level_temperature.has_value(), bit == Request::TEMPERATURE);
    EXPECT_EQ(got.sea_level_pressure.has_value(), bit == Request::PRESSURE);
  }
}

TEST(EveryField, OfSetWeatherThatIsAListOfAnotherLengthIsNamed) {
  const FilledMessage<SetWeather::Request> sent;
  for (const char* list : {"wind_layer_from_deg", "wind_layer_speed", "wind_layer_shear", "wind_layer_turbulence",
                           "cloud_top", "cloud_cover", "cloud_type"}) {
    SCOPED_TRACE(list);
    expectBegins(wrongWith(sent.withLonger(list)), std::string(list) + " has 3 values: expected 2, one a layer");
  }
  SetWeather::Request calm = sent.message();
  calm.fields = SetWeather::Request::WIND;
  calm.wind_layer_shear.clear();
  EXPECT_EQ(toCore(calm).wind.value()[0].shear, 0.0);
  EXPECT_EQ(toCore(calm).wind.value()[0].turbulence, static_cast<double>(calm.wind_layer_turbulence[0]));
  calm = sent.message();
  calm.fields = SetWeather::Request::WIND;
  calm.wind_layer_turbulence.clear();
  EXPECT_EQ(toCore(calm).wind.value()[0].turbulence, 0.0);
  EXPECT_EQ(toCore(calm).wind.value()[0].shear, static_cast<double>(calm.wind_layer_shear[0]));
}

// --- traffic ---

TEST(EveryField, OfTrafficStateIsThatOfTheAircraft) {
  core::TrafficState state;
  state.sim_time = 31.0F;
  for (const double offset : {0.0, 100.0}) {
    core::OtherAircraft other;
    other.number = 1 + static_cast<int>(offset) / 50;
    other.place = {32.0 + offset, 33.0 + offset, 34.0 + offset};
    other.roll_deg = 35.0 + offset;
    other.pitch_deg = 36.0 + offset;
    other.heading_deg = 37.0 + offset;
    other.velocity_ned = {38.0 + offset, 39.0 + offset, 40.0 + offset};
    other.tcas_distance = 41.0F + static_cast<float>(offset);
    other.tcas_bearing_deg = 42.0F + static_cast<float>(offset);
    other.tcas_altitude_difference = 43.0F + static_cast<float>(offset);
    other.mode_s_id = 44 + static_cast<int>(offset);
    other.transponder_code = 45 + static_cast<int>(offset);
    state.aircraft.push_back(other);
  }
  MessageContent expected;
  expected.values = {{"sim_time", {31.0}}, {"number", {1.0, 3.0}}};
  double number = 32.0;
  for (const char* field : {"latitude", "longitude", "altitude_msl", "roll_deg", "pitch_deg", "heading_true_deg",
                            "velocity_north", "velocity_east", "velocity_down", "tcas_distance", "tcas_bearing_deg",
                            "tcas_altitude_difference", "mode_s_id", "transponder_code"}) {
    expected.values[field] = {number, number + 100.0};
    ++number;
  }
  TrafficState message;
  message.number.resize(7);  // of the sample before
  toMessage(state, &message);
  expectMessage(message, expected, headerAnd({"epoch"}));
}

TEST(EveryField, OfTrafficCommandIsThatOfThePose) {
  FilledMessage<TrafficCommand> sent;
  const auto result = toCore(sent.message());
  ASSERT_TRUE(std::holds_alternative<std::vector<core::TrafficPose>>(result)) << std::get<std::string>(result);
  const auto& poses = std::get<std::vector<core::TrafficPose>>(result);
  ASSERT_EQ(poses.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const core::TrafficPose& pose = poses[i];
    const auto degrees = [](double radians) { return radians * 180.0 / M_PI; };
    EXPECT_EQ(pose.number, sent.numbers("number")[i]);
    EXPECT_EQ(pose.place.latitude_deg, sent.numbers("latitude")[i]);
    EXPECT_EQ(pose.place.longitude_deg, sent.numbers("longitude")[i]);
    EXPECT_EQ(pose.place.height, sent.numbers("altitude_msl")[i]);
    EXPECT_NEAR(degrees(pose.attitude.roll), sent.numbers("roll_deg")[i], 1e-9);
    EXPECT_NEAR(degrees(pose.attitude.pitch), sent.numbers("pitch_deg")[i], 1e-9);
    EXPECT_NEAR(degrees(pose.attitude.heading), sent.numbers("heading_true_deg")[i], 1e-9);
    EXPECT_EQ(pose.velocity_ned.x(), sent.numbers("velocity_north")[i]);
    EXPECT_EQ(pose.velocity_ned.y(), sent.numbers("velocity_east")[i]);
    EXPECT_EQ(pose.velocity_ned.z(), sent.numbers("velocity_down")[i]);
  }
  EXPECT_EQ(sent.unasked(), std::set<std::string>{"sequence"}) << "the sender's own";
  for (const std::string& list : sent.layout().fields()) {
    if (list == "number" || !sent.layout().leaf(list).is_list) continue;
    SCOPED_TRACE(list);
    const auto wrong = toCore(sent.withLonger(list));
    ASSERT_TRUE(std::holds_alternative<std::string>(wrong));
    EXPECT_EQ(std::get<std::string>(wrong), list + " has 3 elements: expected 2, as `number`");
  }
}

}  // namespace
}  // namespace xplane_bridge
