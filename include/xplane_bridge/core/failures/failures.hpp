#pragma once

/// Failures: what can break, what is sent to each X-Plane version, when it comes true, and the labels of it.
///
/// X-Plane's own failures are datarefs sim/operation/failures/rel_* (6 failed now, 0 works). Surface failures that
/// X-Plane cannot express are flown by SurfaceDriver.

#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/surfaces/surface_driver.hpp"

namespace xplane_bridge::core {

constexpr int kFailedNow = 6;
constexpr int kWorking = 0;

/// As SetFailure.srv.
struct FailureRequest {
  std::string name;  ///< surface, engine_<n>, bus_<n>, ..., or a rel_* dataref
  std::string kind;  ///< "failed", or what a surface does
  std::optional<double> value;
  int trigger = 0;  ///< FailureTrigger
  double trigger_value = 0.0;
};

/// How a failure is brought about.
struct FailurePlan {
  std::string name;  ///< as asked for; a rel_* without its folder
  std::string kind;
  std::optional<double> value;
  std::vector<std::string> datarefs;      ///< each written with kFailedNow; read back; repaired with kWorking
  std::optional<SurfaceFailure> surface;  ///< flown by SurfaceDriver: where datarefs is empty, or X-Plane does not obey
};

enum class FailureError : std::uint8_t { kNone, kInvalid, kNotSupported };

struct FailurePlanResult {
  FailureError error = FailureError::kNone;
  std::string text;  ///< why not, in words
  FailurePlan plan;
};

/// How that version of X-Plane is made to show the failure; nothing is looked up in the running simulator.
FailurePlanResult planFailure(const FailureRequest& request, SimulatorVersion version);

/// What triggers look at; NaN: unknown, the trigger waits.
struct FlightConditions {
  double sim_time = std::numeric_limits<double>::quiet_NaN();            ///< [s]
  double height_agl = std::numeric_limits<double>::quiet_NaN();          ///< [m]
  double indicated_airspeed = std::numeric_limits<double>::quiet_NaN();  ///< [m/s]
};

/// One line of FailureState.msg.
struct FailureLabel {
  std::string name, kind;
  double value = std::numeric_limits<double>::quiet_NaN();
  bool by_bridge = true;
  bool active = false;     ///< false: armed
  bool confirmed = false;  ///< seen in X-Plane
  double since_sim_time = std::numeric_limits<double>::quiet_NaN();
};

/// All failures that are armed or active, by name. One that is set in the simulator's menu stands beside one of the
/// bridge's that is armed for the same dataref, and is the bridge's once that comes true. The caller carries plans out
/// and reports what X-Plane shows.
class FailureRegistry {
 public:
  /// The other failure of the bridge's that one of the plan's datarefs belongs to already; nullopt: none.
  std::optional<std::string> sameAs(const FailurePlan& plan) const;

  /// Arms a failure, replacing one of the same name. Its trigger is looked at by due(), also kNow.
  void add(const FailureRequest& request, const FailurePlan& plan, const FlightConditions& now);

  /// Failures whose trigger has come, to be carried out now; they are active from here on.
  std::vector<FailurePlan> due(const FlightConditions& now);

  /// X-Plane does (not) show the failure.
  void confirm(const std::string& name, bool shown);
  /// The label's value, e.g. the angle at which a surface was when it got stuck.
  void setValue(const std::string& name, double value);

  /// A failure dataref's value as read. Failures set in the simulator's menu appear and go by this.
  /// Returns true when the labels changed.
  bool observe(const std::string& dataref, double value, double sim_time);

  /// Takes failures out. `names` empty: all of the bridge's. Returns the plans to undo (active ones) and all names
  /// taken out. With `include_simulator` those of the simulator's menu too.
  struct Cleared {
    std::vector<FailurePlan> undo;
    std::vector<std::string> names;
  };
  Cleared clear(const std::vector<std::string>& names, bool include_simulator);

  bool knows(const std::string& name) const { return entries_.count(name) != 0 || isOfMenu(name); }
  /// It is set in the simulator's menu.
  bool isOfMenu(const std::string& name) const { return of_menu_.count(name) != 0; }
  /// SurfaceDriver flies it, or will when it comes true.
  bool isDriven(const std::string& name) const;
  /// Datarefs that show an active failure; none for one that SurfaceDriver flies, or an unknown name.
  std::vector<std::string> datarefsOf(const std::string& name) const;
  std::vector<FailureLabel> labels() const;
  /// Active failures that SurfaceDriver flies; planned with datarefs ones only after useDriver().
  std::vector<SurfaceFailure> drivenSurfaces() const;
  /// X-Plane did not obey the datarefs, which the failure gives up: SurfaceDriver takes this one, from `sim_time` [s]
  /// on. `stuck_deg`: where a surface got stuck meanwhile.
  void useDriver(const std::string& name, double sim_time, std::optional<double> stuck_deg = std::nullopt);

 private:
  struct Entry {
    FailurePlan plan;
    FailureTrigger trigger = FailureTrigger::kNow;
    double trigger_value = 0.0;
    bool active = false, confirmed = false;
    double since = std::numeric_limits<double>::quiet_NaN();
    std::set<std::string> shown;  // of the datarefs, those X-Plane shows failed

    bool driven() const { return plan.datarefs.empty(); }
  };
  std::map<std::string, Entry> entries_;   // of the bridge
  std::map<std::string, double> of_menu_;  // [s] simulator time since when
};

/// Full dataref of a rel_* name: "rel_pitot" or the full path.
std::string failureDataref(const std::string& name);
/// The name without the folder of the rel_* datarefs, as failures are labelled.
std::string failureName(const std::string& name);

}  // namespace xplane_bridge::core
