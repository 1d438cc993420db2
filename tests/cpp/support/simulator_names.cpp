// Prints every dataref and command that the C++ sources use, by version: version, access, path, unit, one use a line,
// separated by tabs. Access is `read`, `write` or `command`; the unit is empty where the code assumes none.
// tests/python/xplane_names holds them to X-Plane's lists.

#include <algorithm>
#include <iostream>
#include <string>

#include "xplane_bridge/core/camera/view_stream.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/control/missing_channels.hpp"
#include "xplane_bridge/core/control/simulator_stick.hpp"
#include "xplane_bridge/core/failures/failure_names.hpp"
#include "xplane_bridge/core/failures/failures.hpp"
#include "xplane_bridge/core/link/data_output.hpp"
#include "xplane_bridge/core/simulator/autopilot_settings.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"
#include "xplane_bridge/core/simulator/flight_start.hpp"
#include "xplane_bridge/core/simulator/simulator_settings.hpp"
#include "xplane_bridge/core/simulator/traffic_motion.hpp"
#include "xplane_bridge/core/simulator/view_ways.hpp"
#include "xplane_bridge/core/simulator/world_settings.hpp"
#include "xplane_bridge/core/state/aircraft_identity.hpp"
#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"
#include "xplane_bridge/core/state/traffic.hpp"
#include "xplane_bridge/core/state/xplane_settings.hpp"
#include "xplane_bridge/core/surfaces/surface_watch.hpp"
#include "xplane_bridge/core/surfaces/surfaces.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace {

using namespace xplane_bridge::core;

class Uses {
 public:
  explicit Uses(SimulatorVersion version) : version_(version) {}

  void all() const {
    state();
    controls();
    surfaces();
    failures();
    settings();
    autopilot();
    camera();
    link();
  }

 private:
  void print(const char* access, const std::string& path, const std::string& unit) const {
    std::cout << version_.number << '\t' << access << '\t' << path << '\t' << unit << '\n';
  }
  void read(const std::string& path, const std::string& unit = "") const { print("read", path, unit); }
  void write(const std::string& path, const std::string& unit = "") const { print("write", path, unit); }

  template <typename Names>
  void readAll(const Names& names) const {
    for (const auto& name : names) read(name);
  }
  /// Written, and read back.
  void set(const std::vector<DatarefWrite>& writes) const {
    for (const DatarefWrite& each : writes) {
      write(each.dataref);
      read(each.dataref);
    }
  }

  void state() const {
    for (std::size_t group = 0; group < kFieldGroupCount; ++group) {
      for (const DatarefRequest& request :
           datarefRequests(static_cast<FieldGroup>(group), Transport::kRref, version_)) {
        const std::string wire_unit = datarefOf(*request.field, version_)->conversion.wire_unit;
        read(request.path, wire_unit.empty() || wire_unit == "negated" ? request.field->unit : wire_unit);
      }
    }
    readAll(flightWatchDatarefs());
    readAll(AircraftIdentityReader::datarefs());
    TrafficAssembler traffic({});
    traffic.configure(version_);
    readAll(traffic.requests());
    for (int number = 1; number <= kMaxOtherAircraft; ++number) {
      TrafficPose pose;
      pose.number = number;
      for (const DatarefWrite& each : trafficWrites(pose, TangentFrame())) write(each.dataref);
      set({{trafficOverride(number), 1.0F}});
    }
    readAll(XPlaneSettings::datarefs());
  }

  void controls() const {
    ChannelSet every;
    every.set();
    for (const bool reverse_thrust : {false, true}) {
      const EncoderOptions options{version_, reverse_thrust};
      for (std::size_t i = 0; i < kChannelCount; ++i) {
        write(writeDataref(static_cast<Channel>(i), options));
        read(readBackDataref(static_cast<Channel>(i), options));
      }
      for (const std::string& name : requiredOverrides(every, options)) set({{name, 1.0F}});
    }
    set({{kThrottleOverride, 0.0F}});
    readAll(trimDatarefs());
    const SimulatorStick stick({kMaxStickAxes, 0, kMaxStickButtons, 50});
    readAll(stick.settingRequests());
    readAll(stick.valueRequests());
    read("sim/joystick/joystick_axis_values[0]");  // asked for once its function is known
  }

  void surfaces() const {
    set({{kSurfaceOverride, 1.0F}});
    for (const SurfaceInfo& surface : surfaceTable()) {
      write(surface.dataref, "deg");
      read(surface.dataref, "deg");
    }
    readAll(surfaceWatchDatarefs(version_));
  }

  void failures() const {
    for (const std::string& name : simulatorFailures(version_)) set({{name, 6.0F}});
    std::vector<FailureRequest> requests;
    for (const SurfaceInfo& surface : surfaceTable()) {
      for (const char* kind : {"stuck", "hard_over_up", "hard_over_down", "centred", "gone"}) {
        requests.push_back({surface.name, kind, std::nullopt});
      }
    }
    for (const char* system : {"engine", "bus", "generator", "battery", "pitot", "static", "gyro"}) {
      for (int number = 1; number < 10; ++number) {
        requests.push_back({std::string(system) + "_" + std::to_string(number), "failed", std::nullopt});
      }
    }
    for (const FailureRequest& request : requests) {
      for (const std::string& name : planFailure(request, version_).plan.datarefs) set({{name, 6.0F}});
    }
  }

  void settings() const {
    set(windWrites({10.0, 270.0, 0.5}, version_));
    readAll(shownWindDatarefs(version_));
    Weather weather;
    weather.wind.emplace(1);
    weather.clouds.emplace();
    weather.visibility = weather.precipitation = weather.sea_level_temperature = weather.sea_level_pressure = 1.0;
    TimeSetting time;
    time.zulu_time = 1.0;
    time.date_days = time.time_ratio = 1;
    for (const auto& settings : {weatherWrites(weather, version_), timeWrites(time)}) {
      for (const SettingWrite& each : settings) set({each.write});
    }
    if (const auto command = cloudCommand(weather, version_)) print("command", *command, "");
    Loading loading;
    loading.fuel_tank.assign(9, 10.0);
    loading.payload_mass = 100.0;
    loading.cg_offset = 0.1;
    set(loadingWrites(loading));
    for (const std::string& station : stationDatarefs(version_)) set({{station, 1.0F}});
    const std::vector<std::string> flight = shownFlightDatarefs(version_);
    readAll(flight);
    if (const auto shown = shownFlightFrom(std::vector<DatarefValue>(flight.size(), 1.0F))) {
      set(motionWrites(FlightStart{}, *shown));
    }
    readAll(aircraftPathDatarefs(kFilePathSize, version_));
    for (const bool pause : {false, true}) print("command", pauseCommand(pause, version_), "");
    read(kPausedDataref);
  }

  void autopilot() const {
    AutopilotSetting setting;
    setting.heading_magnetic_deg = setting.altitude = setting.vertical_speed = setting.mach = 1.0;
    for (const bool on : {false, true}) {
      setting.altitude_armed = setting.autothrottle = setting.yaw_damper = on;
      for (int mode = 0; mode <= 4; ++mode) {
        setting.master = static_cast<AutopilotMaster>(std::min(mode, 2));
        setting.lateral = static_cast<LateralMode>(mode);
        setting.vertical = static_cast<VerticalMode>(mode);
        for (const float shown : {0.0F, 2.0F}) {
          for (const AutopilotStep& step : autopilotSteps(setting, shown)) {
            print("command", step.command, "");
            readAll(step.shown);
          }
        }
        for (const SettingWrite& each : autopilotRestored(setting, version_)) set({each.write});
      }
    }
    read(kAutopilotMaster);
  }

  void camera() const {
    readAll(ViewStream().group().datarefs);
    if (version_.number >= kFirstWithFrustumShiftUp) read(kFrustumShiftUpDataref);
    for (int direction = ViewWish::kForward; direction <= ViewWish::kTurned; ++direction) {
      ViewWish wish;
      wish.direction = direction;
      for (const ViewWay& way : waysTo(wish)) {
        print("command", way.command, "");
        set(way.writes);
      }
    }
    for (int view_type = 1000; view_type < 1040; ++view_type) {  // X-Plane's numbers of views
      if (!commandOf(view_type).empty()) print("command", commandOf(view_type), "");
    }
    set({{kFieldOfViewDataref, 60.0F}});
  }

  void link() const {
    set({{kDataRateDataref, 20.0F}});
    std::vector<FieldGroup> groups;
    for (std::size_t group = 0; group < kFieldGroupCount; ++group) groups.push_back(static_cast<FieldGroup>(group));
    for (const std::int32_t row : dataRows(groups, version_)) set({{dataRowDataref(row), 1.0F}});
  }

  SimulatorVersion version_;
};

}  // namespace

/// simulator_names VERSION...: internal versions, e.g. 115500
int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) Uses(SimulatorVersion{std::stoi(argv[i])}).all();
  return 0;
}
