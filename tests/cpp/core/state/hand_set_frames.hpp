#pragma once

/// Frames of RREF values that a test sets one by one.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "recorded_flight.hpp"
#include "xplane_bridge/core/state/state_assembler.hpp"

namespace xplane_bridge::core {

using Eigen::Vector3d;

// A wall clock time at which tests begin, and a sixtieth of a second [ns].
constexpr std::int64_t kStart = 1700000000'000000000;
constexpr std::int64_t kFrame = 16'666'667;

/// RREF datagrams whose values the test sets by field name.
class Hand {
 public:
  explicit Hand(const FlightStateAssembler::Options& options = withVersion()) : assembler(options) {
    const RecordedFlight flight(11);
    for (const DatarefRequest& request : assembler.requests()) {
      values_.push_back(flight.answers(request.path) ? flight.value(0, request.path) : 0.0F);
    }
  }
  static FlightStateAssembler::Options withVersion() {
    FlightStateAssembler::Options options;
    options.version = kXPlane11;
    return options;
  }
  float& operator[](const std::string& path) {
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (assembler.requests()[i].path == path) return values_[i];
    }
    ADD_FAILURE() << path;
    return values_[0];
  }
  void zero() { std::fill(values_.begin(), values_.end(), 0.0F); }
  /// Sends a frame, a sixtieth of a second after the one before; what was asked for first alone, where it is cut.
  const FlightState* send(double sim_step = 1.0 / 60.0, std::size_t datarefs = SIZE_MAX) {
    now += kFrame;
    sim_time_ += sim_step;
    (*this)["sim/time/total_running_time_sec"] = static_cast<float>(sim_time_);
    Datagram d = Datagram::labelled("RREF,");
    const std::size_t count = std::min(datarefs, values_.size());
    for (std::size_t i = 0; i < count; ++i) d.pair(static_cast<std::int32_t>(i), values_[i]);
    return assembler.onRref(d.rref(), now);
  }
  /// The same place and velocity as seen from another scenery origin.
  void moveOrigin(double latitude, double longitude) {
    const TangentFrame old_frame = frame();
    const GeoPoint place = old_frame.geoPoint(enuFromOpengl(local("local_")));
    const Vector3d level =
        old_frame.levelFromFrame(place.latitude_deg, place.longitude_deg) * enuFromOpengl(local("local_v"));
    (*this)["sim/flightmodel/position/lat_ref"] = static_cast<float>(latitude);
    (*this)["sim/flightmodel/position/lon_ref"] = static_cast<float>(longitude);
    setLocal("local_", openglFromEnu(frame().position(place)));
    setLocal("local_v", openglFromEnu(frame().frameFromLevel(place.latitude_deg, place.longitude_deg) * level));
  }
  TangentFrame frame() {
    return TangentFrame(
        {(*this)["sim/flightmodel/position/lat_ref"], (*this)["sim/flightmodel/position/lon_ref"], 0.0});
  }
  Vector3d local(const std::string& name) {
    const std::string path = "sim/flightmodel/position/" + name;
    return {(*this)[path + "x"], (*this)[path + "y"], (*this)[path + "z"]};
  }
  void setLocal(const std::string& name, const Vector3d& v) {
    const std::string path = "sim/flightmodel/position/" + name;
    (*this)[path + "x"] = static_cast<float>(v.x());
    (*this)[path + "y"] = static_cast<float>(v.y());
    (*this)[path + "z"] = static_cast<float>(v.z());
  }
  /// Puts the aircraft somewhere, coarse position included.
  void place(const GeoPoint& there) {
    setLocal("local_", openglFromEnu(frame().position(there)));
    (*this)["sim/flightmodel/position/latitude"] = static_cast<float>(there.latitude_deg);
    (*this)["sim/flightmodel/position/longitude"] = static_cast<float>(there.longitude_deg);
    (*this)["sim/flightmodel/position/elevation"] = static_cast<float>(there.height);
  }

  FlightStateAssembler assembler;
  std::int64_t now = kStart;

 private:
  std::vector<float> values_;
  double sim_time_ = 1000.0;
};

}  // namespace xplane_bridge::core
