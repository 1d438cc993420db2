// Holds heading, altitude and airspeed of the light twin: one FlightState in, one ControlCommand out.
//
// Parameters (~): heading [deg true], altitude [m MSL], speed [m/s calibrated], roll_gain [1/deg], engage [ask for
// AUTO]. What is not given is held as it is when AUTO begins.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <ros/ros.h>
#include <xplane_bridge/ControlCommand.h>
#include <xplane_bridge/ControlMode.h>
#include <xplane_bridge/FlightState.h>
#include <xplane_bridge/LinkState.h>
#include <xplane_bridge/SetMode.h>

namespace {

using xplane_bridge::ControlCommand;
using xplane_bridge::ControlMode;
using xplane_bridge::FlightState;
using xplane_bridge::LinkState;

constexpr double kDegrees = 180.0 / M_PI;

// What to hold; what is empty is taken from the first state.
struct Targets {
  std::optional<double> heading;   // [deg] true
  std::optional<double> altitude;  // [m] MSL
  std::optional<double> speed;     // [m/s] calibrated
};

// The control law. It knows nothing of ROS but the fields of FlightState and ControlCommand.
class Hold {
 public:
  Hold(const Targets& wanted, double roll_gain) : wanted_(wanted), roll_gain_(roll_gain) {}

  // The next state is the first one.
  void restart() { begin_ = true; }

  ControlCommand fly(const FlightState& state) {
    if (begin_) {
      begin_ = false;
      heading_ = wanted_.heading.value_or(state.heading_true_deg);
      altitude_ = wanted_.altitude.value_or(state.altitude_msl);
      speed_ = wanted_.speed.value_or(state.calibrated_airspeed);
      elevator_ = state.control_pitch;
      throttle_ = state.control_throttle;
      time_ = state.sim_time_unwrapped;
    }
    const double dt = std::clamp(state.sim_time_unwrapped - time_, 0.0, 0.1);
    time_ = state.sim_time_unwrapped;

    const double bank = std::clamp(2.0 * std::remainder(heading_ - state.heading_true_deg, 360.0), -25.0, 25.0);
    const double roll = roll_gain_ * (bank - state.roll_deg) - 0.012 * kDegrees * state.angular_velocity.x;

    const double climb = std::clamp(0.2 * (altitude_ - state.altitude_msl), -5.0, 5.0);
    const double nose = std::clamp(3.0 + 1.2 * (climb - state.vertical_speed), -10.0, 15.0) - state.pitch_deg;
    elevator_ = std::clamp(elevator_ + 0.015 * nose * dt, -0.6, 0.6);
    const double pitch = elevator_ + 0.03 * nose - 0.015 * kDegrees * state.angular_velocity.y;

    const double slow = speed_ - state.calibrated_airspeed;
    throttle_ = std::clamp(throttle_ + 0.006 * slow * dt, 0.0, 1.0);

    ControlCommand command;
    command.header.stamp = state.header.stamp;
    command.sequence = state.frame_count;
    command.fields = ControlCommand::ROLL | ControlCommand::PITCH | ControlCommand::YAW | ControlCommand::THROTTLE;
    command.roll = static_cast<float>(std::clamp(roll, -1.0, 1.0));
    command.pitch = static_cast<float>(std::clamp(pitch, -1.0, 1.0));
    command.throttle = static_cast<float>(std::clamp(throttle_ + 0.03 * slow, 0.0, 1.0));
    return command;
  }

 private:
  Targets wanted_;
  double roll_gain_;  // [1/deg]
  bool begin_ = true;
  double heading_ = 0.0, altitude_ = 0.0, speed_ = 0.0;
  double elevator_ = 0.0, throttle_ = 0.0, time_ = 0.0;
};

// The ROS side: topics, parameters, and when not to fly.
class Node {
 public:
  Node() : hold_(targets(), ros::NodeHandle("~").param("roll_gain", 0.035)) {
    ros::NodeHandle nh;
    const auto quick = ros::TransportHints().tcpNoDelay();
    publisher_ = nh.advertise<ControlCommand>("control/auto", 1);
    subscribers_[0] = nh.subscribe("control/mode", 1, &Node::onMode, this);
    subscribers_[1] = nh.subscribe("link_state", 1, &Node::onLink, this);
    subscribers_[2] = nh.subscribe("flight_state", 1, &Node::onState, this, quick);
    if (ros::NodeHandle("~").param("engage", false)) {
      ros::service::waitForService("tx_node/set_mode");
      xplane_bridge::SetMode call;
      call.request.mode = ControlMode::AUTO;
      if (!ros::service::call("tx_node/set_mode", call) || !call.response.success) {
        ROS_ERROR("mode AUTO was refused: %s", call.response.result.message.c_str());
      }
    }
  }

 private:
  static Targets targets() {
    const ros::NodeHandle own("~");
    const auto given = [&own](const std::string& name) {
      double value = 0.0;
      return own.getParam(name, value) ? std::optional<double>(value) : std::nullopt;
    };
    return {given("heading"), given("altitude"), given("speed")};
  }

  void onMode(const ControlMode& mode) { mode_ = mode.mode; }

  // Gains are for one aircraft; another one is left alone.
  void onLink(const LinkState& link) {
    fits_ = link.aircraft_icao == "DA62" || link.aircraft_icao == "BE58";
    if (!fits_ && !link.aircraft_icao.empty()) {
      ROS_ERROR("the gains are for DA62 and BE58, not for %s", link.aircraft_icao.c_str());
    }
  }

  void onState(const FlightState& state) {
    constexpr auto kNeeded = FlightState::VALID_ATTITUDE | FlightState::VALID_RATES | FlightState::VALID_POSITION |
                             FlightState::VALID_VELOCITY | FlightState::VALID_AIRSPEEDS;
    if (state.paused || (state.valid & kNeeded) != kNeeded || !fits_) return;
    if (mode_ != ControlMode::AUTO) hold_.restart();  // the pilot flies: nothing may run away meanwhile
    publisher_.publish(hold_.fly(state));
  }

  Hold hold_;
  std::uint8_t mode_ = ControlMode::MANUAL;
  bool fits_ = false;
  ros::Publisher publisher_;
  ros::Subscriber subscribers_[3];
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "hold");
  Node node;
  ros::spin();
}
