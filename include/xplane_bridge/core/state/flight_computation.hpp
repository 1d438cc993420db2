#pragma once

#include <cstdint>

#include "xplane_bridge/core/state/flight_inputs.hpp"
#include "xplane_bridge/core/state/flight_state.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge::core {

/// A position with the source it came from.
struct PositionFix {
  GeoPoint place{kNaN, kNaN, kNaN};
  PositionSource source = PositionSource::kNone;
};

/// Axes against which X-Plane gives roll, pitch and heading. The datarefs asked for are the local level's; for row 17
/// it is not known [? row17-axes], and the default below is what the working programs assume.
enum class AttitudeReference : std::uint8_t { kLocalLevel, kSceneryOrigin };
inline constexpr AttitudeReference kDefaultRowAttitudeReference = AttitudeReference::kLocalLevel;

/// Below this ground speed the track is the true heading [m/s].
inline constexpr double kMinSpeedForTrack = 0.5;

/// @return earth radius that X-Plane gave, or kEarthRadius where it gave none that can be
double usableEarthRadius(const FlightInputs& inputs);

/// The simulator answers with nothing but zeros while no flight is loaded.
bool isNoFlight(const FlightInputs& inputs);

/// Position from scenery coordinates on the sphere.
/// @return source kNone when an input is missing or not finite; else kLocalUnchecked
PositionFix localPosition(const FlightInputs& inputs);

/// Position from float32 latitude, longitude and elevation. @return source kNone or kFloat32
PositionFix float32Position(const FlightInputs& inputs);

/// Computes every field that does not depend on the clock: groups, their validity, standard derived quantities.
/// stamp_ns, sim_time_unwrapped, stamp_uncertainty, epoch, frame_count and position_epoch are left to the caller.
/// @param position may have source kNone: velocity, wind and attitude then are not valid either, as they need the tilt
/// @param map frame of position_north, _east, _down
FlightState computeFlightState(const FlightInputs& inputs, const PositionFix& position, const TangentFrame& map,
                               AttitudeReference attitude_reference = AttitudeReference::kLocalLevel);

}  // namespace xplane_bridge::core
