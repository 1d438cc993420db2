#include "xplane_bridge/nodes/base/param_loader.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "xplane_bridge/nodes/base/common_options.hpp"

namespace xplane_bridge {
namespace {

using XmlRpc::XmlRpcValue;

XmlRpcValue sampleTree() {
  XmlRpcValue tree;
  tree["rate"] = 50;
  tree["gain"] = 2.5;
  tree["name"] = std::string("twin");
  tree["on"] = true;
  tree["bad"] = std::nan("");
  tree["limits"]["lower"] = -1;
  tree["limits"]["upper"] = 1.5;
  tree["list"][0] = 1;
  tree["list"][1] = 2.5;
  tree["items"][0]["name"] = std::string("first");
  tree["items"][1]["name"] = std::string("second");
  return tree;
}

std::string messageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const ParamError& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(ParamLoader, ReadsEachTypeAndTakesAnIntegerForANumber) {
  const ParamLoader loader("/xplane/rx_node", sampleTree());
  EXPECT_EQ(loader.integer("rate", {1, 100}), 50);
  EXPECT_DOUBLE_EQ(loader.number("rate", {}), 50.0);
  EXPECT_DOUBLE_EQ(loader.number("gain", {0.0, 3.0}), 2.5);
  EXPECT_EQ(loader.text("name"), "twin");
  EXPECT_EQ(loader.choice("name", {"twin", "quad"}), "twin");
  EXPECT_TRUE(loader.boolean("on"));
  EXPECT_EQ(loader.numbers("list", {}), (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(loader.sections("items").at(1).text("name"), "second");
  const auto limits = loader.section("limits").namedNumbers({});
  ASSERT_EQ(limits.size(), 2U);
  EXPECT_EQ(limits[0].first, "lower");
  EXPECT_DOUBLE_EQ(limits[0].second, -1.0);
}

TEST(ParamLoader, MissingKeysTakeTheDefaultOrAreRequired) {
  const ParamLoader loader("/n", XmlRpcValue());
  EXPECT_EQ(loader.integer("rate", {1, 100}, 20), 20);
  EXPECT_TRUE(loader.numbers("list", {}).empty());
  EXPECT_FALSE(loader.section("limits").has("upper"));
  const std::string message = messageOf([&] { loader.number("gain", {}); });
  EXPECT_TRUE(contains(message, "/n/gain") && contains(message, "required")) << message;
}

TEST(ParamLoader, ErrorsNameKeyValueAndWhatIsAllowed) {
  const ParamLoader loader("/n", sampleTree());
  std::string message = messageOf([&] { loader.integer("rate", {60, 100}); });
  EXPECT_TRUE(contains(message, "/n/rate is 50") && contains(message, "an integer from 60 to 100")) << message;
  message = messageOf([&] { loader.number("gain", {3.0}); });
  EXPECT_TRUE(contains(message, "is 2.5") && contains(message, "a number of at least 3")) << message;
  message = messageOf([&] { loader.choice("name", {"quad", "tilt"}); });
  EXPECT_TRUE(contains(message, "\"twin\"") && contains(message, "one of: quad, tilt")) << message;
  message = messageOf([&] { loader.number("name", {}); });
  EXPECT_TRUE(contains(message, "quotes")) << message;
  message = messageOf([&] { loader.section("limits").number("upper", {0.0, 1.0}); });
  EXPECT_TRUE(contains(message, "/n/limits/upper")) << message;
  message = messageOf([&] { loader.numbers("list", {0.0, 2.0}); });
  EXPECT_TRUE(contains(message, "/n/list[1]")) << message;
}

TEST(ParamLoader, WrongTypesAndNonFiniteNumbersAreRefused) {
  const ParamLoader loader("/n", sampleTree());
  EXPECT_THROW(loader.integer("gain", {}), ParamError);
  EXPECT_THROW(loader.number("bad", {}), ParamError);
  EXPECT_THROW(loader.number("on", {}), ParamError);
  EXPECT_THROW(loader.boolean("rate"), ParamError);
  EXPECT_THROW(loader.text("rate"), ParamError);
  EXPECT_THROW(loader.sections("limits"), ParamError);
  EXPECT_THROW(loader.section("rate"), ParamError);
  EXPECT_THROW(loader.numbers("name", {}), ParamError);
  EXPECT_THROW(ParamLoader("/n", XmlRpcValue(3)), ParamError);
}

TEST(ParamLoader, UnknownKeysAreRefusedWithTheNearestKnownOne) {
  XmlRpcValue tree;
  tree["max_publsh_rate"] = 50;
  tree["zzz"] = 1;
  tree["limits"]["uper"] = 1;
  const ParamLoader loader("/n", tree);
  loader.number("max_publish_rate", {}, 0.0);
  loader.section("limits").number("upper", {}, 0.0);
  const std::string message = messageOf([&] { loader.refuseUnknown(); });
  EXPECT_TRUE(contains(message, "/n/max_publsh_rate (did you mean max_publish_rate?)")) << message;
  EXPECT_TRUE(contains(message, "/n/zzz (known here: limits, max_publish_rate)")) << message;
  EXPECT_TRUE(contains(message, "/n/limits/uper (did you mean upper?)")) << message;

  loader.allow("max_publsh_rate");
  EXPECT_FALSE(contains(messageOf([&] { loader.refuseUnknown(); }), "/n/max_publsh_rate"));
}

TEST(ParamLoader, NearestWordIsEmptyWhenNothingIsNear) {
  EXPECT_EQ(nearestWord("hots", {"port", "host"}), "host");
  EXPECT_EQ(nearestWord("dataport", {"port", "data_port"}), "data_port");
  EXPECT_EQ(nearestWord("joystick", {"port", "host"}), "");
}

TEST(CommonOptions, DefaultsAreTheDocumentedOnes) {
  const CommonOptions options = loadCommonOptions(ParamLoader("/xplane", XmlRpcValue()));
  EXPECT_EQ(options.host, "");
  EXPECT_EQ(options.port, 49000);
  EXPECT_EQ(options.data_port, 49003);
  EXPECT_EQ(options.transport, core::Transport::kRref);
  EXPECT_EQ(options.frames.base_link_frd, "base_link_frd");
}

TEST(CommonOptions, PrefixStandsBeforeAllFrames) {
  XmlRpcValue tree;
  tree["frame_prefix"] = "first/";
  tree["map_frame"] = "world";
  const FrameNames frames = loadCommonOptions(ParamLoader("/first", tree)).frames;
  EXPECT_EQ(frames.map, "first/world");
  EXPECT_EQ(frames.map_ned, "first/map_ned");
  EXPECT_EQ(frames.base_link, "first/base_link");
  EXPECT_EQ(frames.base_link_frd, "first/base_link_frd");
}

TEST(CommonOptions, RefusesWhatCannotWork) {
  const auto load = [](const char* key, const XmlRpcValue& value) {
    XmlRpcValue tree;
    tree[key] = value;
    return messageOf([&] { loadCommonOptions(ParamLoader("/xplane", tree)); });
  };
  EXPECT_TRUE(contains(load("data_port", 49001), "X-Plane binds 49001"));
  EXPECT_TRUE(contains(load("port", 0), "from 1 to 65535"));
  EXPECT_TRUE(contains(load("transport", "udp"), "one of: rref, data"));
  EXPECT_TRUE(contains(load("map_frame", "/map"), "leading slash"));
  EXPECT_TRUE(contains(load("frame_prefix", "/first"), "without a leading slash"));
  EXPECT_TRUE(contains(load("display_delay", -0.021), "from -0.02 to 1"));
  EXPECT_EQ(load("display_delay", -0.02), "");  // what a calibration may find
  EXPECT_TRUE(contains(load("hots", "192.168.1.2"), "did you mean host?"));
  EXPECT_EQ(load("another_nodes_parameter", 3), "");
}

TEST(CommonOptions, RefusesParticipantsThatAreNamedTwiceOrAnswerAnyhow) {
  const auto load = [](const std::vector<std::string>& names) {
    XmlRpcValue tree;
    int i = 0;
    for (const std::string& name : names) tree["lockstep"]["participants"][i++] = name;
    return messageOf([&] { loadCommonOptions(ParamLoader("/xplane", tree)); });
  };
  EXPECT_EQ(load({"controller", "/a/player", "/b/player", "capture_node"}), "");
  EXPECT_TRUE(contains(load({"controller", "player", "controller"}), "\"controller\" is named already"));
  EXPECT_TRUE(contains(load({"/xplane/controller", "controller"}), "\"controller\" is named already"));
  EXPECT_TRUE(contains(load({"controller", "/xplane/controller"}), "\"/xplane/controller\" is named already"));
  EXPECT_TRUE(contains(load({"rx_node"}), "answers every frame without being named"));
  EXPECT_TRUE(contains(load({"/xplane/rx_node"}), "answers every frame without being named"));
}

TEST(ParamLoader, ReportsWhatWasGivenThatIsNoDefault) {
  const ParamLoader loader("/xplane/node", sampleTree());
  loader.integer("rate", {}, 50);  // given, but what it would be anyway
  loader.number("gain", {}, 1.0);
  loader.text("absent", "x");
  loader.text("name");
  loader.boolean("on", false);
  loader.numbers("list", {});
  const ParamLoader limits = loader.section("limits");
  limits.number("lower", {}, 0.0);
  limits.number("upper", {}, 1.5);
  for (const ParamLoader& item : loader.sections("items")) item.text("name", "first");
  EXPECT_EQ(loader.given(), (std::vector<std::string>{"gain: 2.5", "name: \"twin\"", "on: true", "list: [1, 2.5]",
                                                      "limits/lower: -1", "items[1]/name: \"second\""}));
  EXPECT_TRUE(ParamLoader("/", XmlRpcValue()).given().empty());
}

TEST(ParamLoader, SaysNoSecret) {
  XmlRpcValue tree;
  tree["sender"]["token"] = std::string("window seat");
  const ParamLoader sender = ParamLoader("/xplane/capture_node", tree).section("sender");
  sender.text("token", "");
  EXPECT_EQ(sender.given(), (std::vector<std::string>{"token: ..."}));
  tree["sender"]["token"] = 1234;
  const std::string message =
      messageOf([&] { ParamLoader("/xplane/capture_node", tree).section("sender").text("token", ""); });
  EXPECT_TRUE(contains(message, "sender/token is ..., but must be a text")) << message;
}

TEST(ParamLoader, KeepsWhatItReadWhenOthersAreSetLater) {
  XmlRpcValue tree;
  tree["host"] = std::string("192.168.1.2");
  tree["lockstep"]["hold"] = true;
  tree["others"] = 1;
  const ParamLoader loader("/xplane", tree);
  loader.text("host", "");
  loader.text("transport", "rref");
  loader.section("lockstep").boolean("hold", false);
  XmlRpcValue later;
  later["host"] = std::string("192.168.1.3");
  later["transport"] = std::string("data");
  later["others"] = 2;
  later["tx_node"]["rate"] = 50;
  const XmlRpcValue now = loader.asRead(later);
  EXPECT_EQ(static_cast<const std::string&>(now["host"]), "192.168.1.2");
  EXPECT_FALSE(now.hasMember("transport")) << "it was the default";
  EXPECT_TRUE(static_cast<const bool&>(now["lockstep"]["hold"]));
  EXPECT_EQ(static_cast<const int&>(now["others"]), 2);
  EXPECT_EQ(static_cast<const int&>(now["tx_node"]["rate"]), 50);
  EXPECT_EQ(static_cast<const std::string&>(loader.asRead(XmlRpcValue())["host"]), "192.168.1.2");
}

}  // namespace
}  // namespace xplane_bridge
