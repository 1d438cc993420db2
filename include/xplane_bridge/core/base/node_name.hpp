#pragma once

#include <string>

namespace xplane_bridge::core {

/// Whether `who`, the full name of a node, is the one that `name` names: "/a/b" is that one, "b" is /b and any /.../b.
bool isNamed(const std::string& who, const std::string& name);

/// What the files of a node have of its full name: in the `usual` namespace the last part ("rx_node"), in another one
/// all ("first.rx_node"), so that two bridges do not write into one file.
std::string nameInFiles(const std::string& who, const std::string& usual);

}  // namespace xplane_bridge::core
