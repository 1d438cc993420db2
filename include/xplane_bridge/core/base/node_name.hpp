#pragma once

#include <string>

namespace xplane_bridge::core {

/// Whether `who`, the full name of a node, is the one that `name` names: "/a/b" is that one, "b" is /b and any /.../b.
bool isNamed(const std::string& who, const std::string& name);

}  // namespace xplane_bridge::core
