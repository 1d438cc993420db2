#pragma once

#include <string>
#include <vector>

namespace xplane_bridge::core {

/// Most elements one range may name.
constexpr int kMaxDatarefRange = 1024;

/// The single datarefs a user's name stands for: "a/b" and "a/b[3]" for themselves, "a/b[2:5]" for elements 2, 3 and 4.
/// @throws std::invalid_argument, with the name and what is wrong: no '/', blanks, not ASCII, too long for X-Plane, a
/// malformed index, an empty or too long range
std::vector<std::string> datarefElements(const std::string& name);

}  // namespace xplane_bridge::core
