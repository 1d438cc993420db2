#pragma once

/// Sizes that X-Plane's datarefs and this package's messages share.

namespace xplane_bridge::core {

inline constexpr int kMaxEngines = 8;  ///< engines of one aircraft; sim/flightmodel/engine/* hold as many

}  // namespace xplane_bridge::core
