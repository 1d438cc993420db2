#pragma once

#include <functional>
#include <string>

namespace xplane_bridge {

/// How high mean sea level lies above the WGS 84 ellipsoid, by which X-Plane's heights become those of NavSatFix.
class Geoid {
 public:
  /// The same everywhere [m].
  explicit Geoid(double undulation = 0.0);

  /// One of GeographicLib's models, e.g. egm96-5, from a folder of its files; an empty folder: where that library
  /// looks.
  /// @throws std::runtime_error in words: this build has no GeographicLib, or there is no such file
  static Geoid named(const std::string& name, const std::string& folder);

  /// At a place [deg]: to be added to a height above mean sea level [m].
  double undulation(double latitude_deg, double longitude_deg) const { return at_(latitude_deg, longitude_deg); }

 private:
  explicit Geoid(std::function<double(double, double)> at);

  std::function<double(double, double)> at_;
};

}  // namespace xplane_bridge
