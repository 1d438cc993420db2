// Every field of requests to actuation/, of their results and of its labels: each has a number or text of its own, and
// is found under its name on the other side. Two fields swapped, one forgotten and one added turn this red.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "expected_fields.hpp"
#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"

namespace xplane_bridge {
namespace {

const std::set<std::string> kNone;
const std::set<std::string> kHeader = headerAnd({});

// --- failures ---

TEST(EveryField, OfSetFailureIsOneOfTheRequest) {
  for (unsigned pass = 0; pass < 2; ++pass) {
    FilledMessage<SetFailure::Request> sent(pass);
    const core::FailureRequest got = toCore(sent.message());
    EXPECT_EQ(got.name, sent.text("name"));
    EXPECT_EQ(got.kind, sent.text("kind"));
    const bool has_value = sent.number("has_value") != 0.0;
    EXPECT_EQ(got.value, has_value ? std::optional<double>(sent.number("value")) : std::nullopt);
    EXPECT_EQ(got.trigger, sent.number("trigger"));
    EXPECT_EQ(got.trigger_value, sent.number("trigger_value"));
    sent.number("value");
    EXPECT_EQ(sent.unasked(), kNone);
  }
}

TEST(EveryField, OfFailureStateIsThatOfItsLabel) {
  FailureSnapshot snapshot;
  snapshot.sim_time = 31.0;
  const auto label = [&snapshot](const std::string& number, double value, bool by_bridge, bool active, bool confirmed) {
    core::FailureLabel out;
    out.name = "name" + number;
    out.kind = "kind" + number;
    out.value = value;
    out.by_bridge = by_bridge;
    out.active = active;
    out.confirmed = confirmed;
    out.since_sim_time = value + 10.0;
    snapshot.labels.push_back(out);
  };
  label("1", 41.0, true, true, false);
  label("2", 42.0, false, true, true);
  label("3", 43.0, true, false, true);
  snapshot.surrogate_mixing = true;
  snapshot.surrogate_lag_frames = 32.0;
  FailureState message;
  message.header.stamp.sec = 33;
  message.names = {"of the one before"};
  toMessage(snapshot, &message);
  MessageContent expected;
  expected.values = {{"header.stamp", {33.0}},       {"sim_time", {31.0}},
                     {"values", {41.0, 42.0, 43.0}}, {"active", {1.0, 1.0, 0.0}},
                     {"confirmed", {0.0, 1.0, 1.0}}, {"since_sim_time", {51.0, 52.0, 53.0}},
                     {"surrogate_mixing", {1.0}},    {"surrogate_lag_frames", {32.0}}};
  expected.texts = {{"names", {"name1", "name2", "name3"}},
                    {"kinds", {"kind1", "kind2", "kind3"}},
                    {"set_by", {"bridge", "simulator", "bridge"}}};
  expectMessage(message, expected, {"header.seq", "header.frame_id"});
}

// --- test signals and identification ---

TEST(EveryField, OfInjectExcitationIsOneOfTheRequest) {
  FilledMessage<InjectExcitation::Request> sent;
  const ExcitationRequest got = toCore(sent.message());
  EXPECT_EQ(got.kind, sent.text("kind"));
  EXPECT_EQ(got.target, sent.text("target"));
  EXPECT_EQ(got.amplitude, sent.number("amplitude"));
  EXPECT_EQ(got.duration, sent.number("duration"));
  EXPECT_EQ(got.frequency_min, sent.number("frequency_min"));
  EXPECT_EQ(got.frequency_max, sent.number("frequency_max"));
  EXPECT_EQ(got.seed, sent.number("seed"));
  EXPECT_EQ(got.max_roll_deg, sent.number("max_roll_deg"));
  EXPECT_EQ(got.max_pitch_deg, sent.number("max_pitch_deg"));
  EXPECT_FALSE(got.rest) << "only an identification takes an axis without a command";
  EXPECT_EQ(sent.unasked(), kNone);
}

TEST(EveryField, OfExcitationStateIsThatOfTheLabel) {
  for (const bool active : {false, true}) {
    ExcitationLabel label;
    label.sim_time = 31.0;
    label.active = active;
    label.id = 32;
    label.kind = "kind";
    label.target = "target";
    label.amplitude = 33.0;
    label.duration = 34.0;
    label.frequency_min = 35.0;
    label.frequency_max = 36.0;
    label.seed = 37;
    label.start_sim_time = 38.0;
    label.end_sim_time = 39.0;
    label.result = "result";
    ExcitationState message;
    toMessage(label, &message);
    MessageContent expected;
    expected.values = {{"sim_time", {31.0}},
                       {"active", {active ? 1.0 : 0.0}},
                       {"id", {32.0}},
                       {"amplitude", {33.0}},
                       {"duration", {34.0}},
                       {"frequency_min", {35.0}},
                       {"frequency_max", {36.0}},
                       {"seed", {37.0}},
                       {"start_sim_time", {38.0}},
                       {"end_sim_time", {39.0}}};
    expected.texts = {{"kind", {"kind"}}, {"target", {"target"}}, {"result", {"result"}}};
    expectMessage(message, expected, kHeader);
  }
}

TEST(EveryField, OfIdentifySurfacesIsOneOfTheRequest) {
  for (unsigned pass = 0; pass < 2; ++pass) {
    FilledMessage<IdentifySurfaces::Request> sent(pass);
    const IdentificationRequest got = toCore(sent.message());
    EXPECT_EQ(got.save, sent.number("do_not_save") == 0.0);
    EXPECT_EQ(got.max_roll_deg, sent.number("max_roll_deg"));
    EXPECT_EQ(got.max_pitch_deg, sent.number("max_pitch_deg"));
    EXPECT_EQ(got.max_rate_deg_s, sent.number("max_rate_deg_s"));
    EXPECT_EQ(got.max_airspeed_change, sent.number("max_airspeed_change"));
    EXPECT_EQ(got.min_height, sent.number("min_height"));
    EXPECT_EQ(sent.unasked(), kNone);
  }
}

TEST(EveryField, OfAServiceResultIsOneOfTheResult) {
  const ServiceResult message = toMessage(RequestResult{core::ResultCode::kTimeout, "text"});
  expectMessage(message, {{{"code", {ServiceResult::TIMEOUT}}}, {{"message", {"text"}}}});
}

// --- disturbances ---

TEST(EveryField, OfSetDisturbanceIsOneOfTheSpecification) {
  for (unsigned pass = 0; pass < 2; ++pass) {
    FilledMessage<SetDisturbance::Request> sent(pass);
    const core::DisturbanceSpec got = toCore(sent.message());
    EXPECT_EQ(got.horizontal_only, sent.number("horizontal_only") != 0.0);
    EXPECT_EQ(got.duration, sent.number("duration"));
    EXPECT_EQ(got.from_deg, sent.number("from_deg"));
    EXPECT_EQ(got.speed, sent.number("speed"));
    EXPECT_EQ(got.vertical_speed, sent.number("vertical_speed"));
    EXPECT_EQ(got.length, sent.number("length"));
    EXPECT_EQ(got.gradient, sent.number("gradient"));
    EXPECT_EQ(got.roughness, sent.number("roughness"));
    EXPECT_EQ(got.seed, sent.number("seed"));
    EXPECT_EQ(got.latitude_deg, sent.number("latitude"));
    EXPECT_EQ(got.longitude_deg, sent.number("longitude"));
    EXPECT_EQ(got.radius, sent.number("radius"));
    EXPECT_EQ(got.height, sent.number("height"));
    EXPECT_EQ(sent.unasked(), std::set<std::string>{"kind"}) << "a word, which goes beside it";
  }
}

TEST(EveryField, OfDisturbanceStateIsThatOfTheLabelAndItsSpecification) {
  for (unsigned pass = 0; pass < kPasses; ++pass) {
    const bool active = flag(0, pass), horizontal_only = flag(1, pass);
    DisturbanceLabel label;
    label.sim_time = 31.0;
    label.active = active;
    label.id = 32;
    label.steady = {33.0, 34.0, 35.0};
    label.model = {36.0, 37.0, 38.0};
    label.commanded = {39.0, 40.0, 41.0};
    label.wind_speed = 42.0;
    label.wind_from_deg = 43.0;
    label.start_sim_time = 44.0;
    label.end_sim_time = 45.0;
    label.result = "result";
    MessageContent expected;
    expected.values = {{"sim_time", {31.0}},
                       {"active", {active ? 1.0 : 0.0}},
                       {"id", {32.0}},
                       {"steady_ned", {33.0, 34.0, 35.0}},
                       {"model_ned", {36.0, 37.0, 38.0}},
                       {"commanded_ned", {39.0, 40.0, 41.0}},
                       {"wind_speed", {42.0}},
                       {"wind_from_deg", {43.0}},
                       {"start_sim_time", {44.0}},
                       {"end_sim_time", {45.0}}};
    expected.texts = {{"result", {"result"}}};
    DisturbanceState message;
    toMessage(label, &message);
    expectMessage(message, expected,
                  headerAnd({"kind", "horizontal_only", "duration", "from_deg", "speed", "vertical_speed", "length",
                             "gradient", "roughness", "seed", "latitude", "longitude", "radius", "height"}));

    label.spec.emplace();
    label.spec->kind = core::DisturbanceKind::kMicroburst;
    label.spec->horizontal_only = horizontal_only;
    std::array<double*, 11> numbers{&label.spec->duration,       &label.spec->from_deg,     &label.spec->speed,
                                    &label.spec->vertical_speed, &label.spec->length,       &label.spec->gradient,
                                    &label.spec->roughness,      &label.spec->latitude_deg, &label.spec->longitude_deg,
                                    &label.spec->radius,         &label.spec->height};
    for (std::size_t i = 0; i < numbers.size(); ++i) *numbers[i] = 51.0 + static_cast<double>(i);
    label.spec->seed = 71;
    toMessage(label, &message);
    double number = 51.0;
    for (const char* field : {"duration", "from_deg", "speed", "vertical_speed", "length", "gradient", "roughness",
                              "latitude", "longitude", "radius", "height"}) {
      expected.values[field] = {number++};
    }
    expected.values["horizontal_only"] = {horizontal_only ? 1.0 : 0.0};
    expected.values["seed"] = {71.0};
    expected.texts["kind"] = {"microburst"};
    expectMessage(message, expected, kHeader);
  }
}

}  // namespace
}  // namespace xplane_bridge
