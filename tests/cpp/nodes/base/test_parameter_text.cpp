#include "xplane_bridge/nodes/base/parameter_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace xplane_bridge {
namespace {

using XmlRpc::XmlRpcValue;

XmlRpcValue sampleTree() {
  XmlRpcValue tree;
  tree["rate"] = 50;
  tree["gain"] = 0.1;
  tree["whole"] = 2.0;
  tree["large"] = 1e9;
  tree["none"] = std::nan("");
  tree["on"] = true;
  tree["name"] = std::string("a \"twin\"\n\x01");
  tree["list"][0] = 1;
  tree["list"][1] = std::string("b");
  return tree;
}

TEST(ParameterText, IsJsonWithSortedKeysAndNumbersThatReadBack) {
  EXPECT_EQ(parameterText(sampleTree()),
            "{\"gain\": 0.1, \"large\": 1e+09, \"list\": [1, \"b\"], \"name\": \"a \\\"twin\\\"\\n\\u0001\", "
            "\"none\": null, \"on\": true, \"rate\": 50, \"whole\": 2.0}");
  EXPECT_EQ(parameterText(XmlRpcValue(1.0 / 3.0)), "0.3333333333333333");
  EXPECT_EQ(parameterText(XmlRpcValue()), "null");
}

TEST(WithoutMachine, DropsAddressesAndFoldersOfWhatExists) {
  XmlRpcValue tree;
  tree["host"] = std::string("192.168.1.2");
  tree["port"] = 49000;
  tree["lockstep"]["participants"][0] = std::string("/ns/node");
  tree["tx_node"]["mixing"]["shipped"] = std::string("/usr/bin/");
  tree["tx_node"]["port"] = 3;  // another one's
  EXPECT_EQ(parameterText(withoutMachine(tree)),
            "{\"lockstep\": {\"participants\": [\"/ns/node\"]}, \"tx_node\": {\"mixing\": {\"shipped\": \"bin\"}, "
            "\"port\": 3}}");
  EXPECT_EQ(parameterText(withoutMachine(XmlRpcValue())), "null");
}

TEST(WithoutSecrets, HidesThoseThatAreSetWhereverTheyAre) {
  XmlRpcValue tree;
  tree["capture_node"]["sender"]["token"] = std::string("window seat");
  tree["capture_node"]["sender"]["listen"] = std::string(":49790");
  tree["left"]["capture_node"]["sender"]["token"] = std::string();
  tree["list"][0]["token"] = 5;
  EXPECT_EQ(parameterText(withoutSecrets(tree)),
            "{\"capture_node\": {\"sender\": {\"listen\": \":49790\", \"token\": \"...\"}}, \"left\": "
            "{\"capture_node\": {\"sender\": {\"token\": \"\"}}}, \"list\": [{\"token\": \"...\"}]}");
  EXPECT_EQ(parameterText(tree["list"][0]["token"]), "5");
  EXPECT_EQ(parameterText(withoutSecrets(XmlRpcValue())), "null");
}

}  // namespace
}  // namespace xplane_bridge
