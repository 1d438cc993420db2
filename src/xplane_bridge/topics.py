"""The bridge's topics, relative to its namespace, and their types: for programs that run without a bridge."""

from __future__ import annotations

#: Namespace under which the launch files put everything.
NAMESPACE = "/xplane"


def absolute(namespace: str) -> str:
    """A namespace as users write it (`lab`, `/lab/`), as ROS's names begin with it (`/lab`)."""
    return "/" + namespace.strip("/")


#: Relative name to ROS 1 type.
TOPICS = {
    "flight_state": "xplane_bridge/FlightState",
    "mission/engines": "xplane_bridge/EngineStates",
    "mission/surfaces": "xplane_bridge/SurfaceStates",
    "mission/controls": "xplane_bridge/ControlStates",
    "mission/electrical": "xplane_bridge/ElectricalState",
    "mission/autopilot": "xplane_bridge/AutopilotState",
    "mission/warnings": "xplane_bridge/WarningState",
    "mission/fuel": "xplane_bridge/FuelState",
    "mission/sim": "xplane_bridge/SimStatus",
    "mission/navigation": "xplane_bridge/NavigationState",
    "mission/instruments": "xplane_bridge/InstrumentState",
    "mission/environment": "xplane_bridge/EnvironmentState",
    "odom": "nav_msgs/Odometry",
    "imu/data": "sensor_msgs/Imu",
    "global_position/global": "sensor_msgs/NavSatFix",
    "wind": "geometry_msgs/TwistWithCovarianceStamped",
    "traffic/state": "xplane_bridge/TrafficState",
    "datarefs": "xplane_bridge/DatarefValues",
    "data_rows": "xplane_bridge/DataRows",
    "link_state": "xplane_bridge/LinkState",
    "experiment": "xplane_bridge/Experiment",
    "origin": "sensor_msgs/NavSatFix",
    "joy": "sensor_msgs/Joy",
    "control/manual": "xplane_bridge/ControlCommand",
    "control/auto": "xplane_bridge/ControlCommand",
    "control/surfaces": "xplane_bridge/SurfaceCommand",
    "control/mode_request": "xplane_bridge/ModeRequest",
    "control/mode": "xplane_bridge/ControlMode",
    "control/applied": "xplane_bridge/AppliedCommand",
    "traffic/command": "xplane_bridge/TrafficCommand",
    "failures/state": "xplane_bridge/FailureState",
    "excitation/state": "xplane_bridge/ExcitationState",
    "disturbance/state": "xplane_bridge/DisturbanceState",
    "events": "xplane_bridge/EventList",
    "scenario/label": "std_msgs/String",
    "camera/image_raw": "sensor_msgs/Image",
    "camera/image_raw/compressed": "sensor_msgs/CompressedImage",
    "camera/camera_info": "sensor_msgs/CameraInfo",
    "camera/frame_state": "xplane_bridge/FrameState",
}
