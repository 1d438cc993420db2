#include "xplane_bridge/nodes/rx/geoid.hpp"

#include <memory>
#include <stdexcept>
#include <utility>

#ifdef XPLANE_BRIDGE_GEOGRAPHICLIB
#include <GeographicLib/Geoid.hpp>
#endif

namespace xplane_bridge {

Geoid::Geoid(double undulation) : at_([undulation](double, double) { return undulation; }) {}

Geoid::Geoid(std::function<double(double, double)> at) : at_(std::move(at)) {}

#ifdef XPLANE_BRIDGE_GEOGRAPHICLIB

Geoid Geoid::named(const std::string& name, const std::string& folder) {
  try {
    // Cubic; not for several threads: a row or two of the file are in memory at a time.
    const auto model = std::make_shared<GeographicLib::Geoid>(name, folder);
    return Geoid([model](double latitude, double longitude) { return (*model)(latitude, longitude); });
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string(error.what()) + "; expected " + name + ".pgm in " +
                             (folder.empty() ? GeographicLib::Geoid::DefaultGeoidPath() : folder) +
                             ": geographiclib-get-geoids " + name + " downloads it (package geographiclib-tools)");
  }
}

#else

Geoid Geoid::named(const std::string& name, const std::string&) {
  throw std::runtime_error("this build has no GeographicLib, which knows " + name +
                           ": install libgeographiclib-dev (Ubuntu 20.04: libgeographic-dev) and build again, or set "
                           "geoid_undulation, or none");
}

#endif

}  // namespace xplane_bridge
