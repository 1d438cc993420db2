#pragma once

#include <string>

namespace xplane_bridge {

/// The folder of the files the bridge keeps for a user (journals, learnt mixings): `xplane_bridge` below ROS_HOME where
/// that is set, else below ~/.ros. It need not exist. @throws std::runtime_error when neither ROS_HOME nor HOME is set
std::string userFolder();

}  // namespace xplane_bridge
