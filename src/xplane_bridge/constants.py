"""Numbers and words of the messages, for programs that run without ROS.

Made from msg/ and srv/ by cmake/message_code (`python3 cmake/message_code python`); not to be edited.
"""

from __future__ import annotations

import enum
from typing import Dict, NamedTuple, Type


class PositionSource(enum.IntEnum):
    """Where the position of a FlightState comes from. Numbers of FlightState."""

    NONE = 0
    LOCAL = 1  #: float32 local coordinates on the sphere (2 to 8 mm), checked against RPOS
    LOCAL_UNCHECKED = 2  #: the same, the check against RPOS is not done yet or not possible
    RPOS = 3  #: RPOS doubles
    XPC = 4  #: X-Plane Connect GETP doubles
    FLOAT32 = 5  #: float32 latitude and longitude: steps of 0.4 to 1.35 m


class LinkState(enum.IntEnum):
    """State of the link to X-Plane. Numbers of LinkState."""

    SEARCHING = 0  #: no answer yet, or no X-Plane found
    CONNECTED = 1  #: flight data arrive and simulator time runs
    PAUSED = 2  #: data arrive, simulator time stands
    STALE = 3  #: no data for `stale_after`: scenery load or menu; everything is kept
    LOST = 4  #: no data and no beacon, or no data for `lost_after`


class FlightMode(enum.IntEnum):
    """Who flies. Numbers of ControlMode."""

    MANUAL = 1  #: control/manual flies
    AUTO = 2  #: control/auto flies, and control/surfaces


class CommandSource(enum.IntEnum):
    """Where the values sent come from. Numbers of AppliedCommand."""

    NONE = 0
    MANUAL = 1  #: control/manual
    AUTO = 2  #: control/auto
    FAILSAFE = 3  #: the failsafe of the aircraft's YAML


class FailureTrigger(enum.IntEnum):
    """When a failure comes true. Numbers of SetFailure."""

    NOW = 0
    AT_SIM_TIME = 1  #: [s] after this call, in simulator time
    AT_ALTITUDE_ABOVE = 2  #: [m] AGL
    AT_ALTITUDE_BELOW = 3  #: [m] AGL
    AT_SPEED_ABOVE = 4  #: [m/s] indicated airspeed
    AT_SPEED_BELOW = 5  #: [m/s]


class ResultCode(enum.IntEnum):
    """How a service call ended. Numbers of ServiceResult."""

    OK = 0  #: done, and seen in X-Plane by read-back where a dataref shows it
    ACCEPTED = 1  #: sent; the outcome follows on `events`
    REFUSED = 2  #: the request is wrong or not safe now; message says what was expected
    NOT_SUPPORTED = 3  #: this X-Plane version or aircraft cannot; message says why
    NO_LINK = 4  #: X-Plane is not connected
    TIMEOUT = 5  #: sent, but X-Plane did not show it within the deadline


class EventKind(enum.IntEnum):
    """What an event is about. Numbers of Event."""

    RESET = 1  #: the flight was reset or placed anew
    CRASH = 2
    AIRCRAFT = 3  #: another aircraft was loaded
    PAUSE = 4  #: paused or resumed
    LINK = 5  #: link state changed
    MODE = 6  #: manual or automatic
    FAILURE = 7  #: failure set, come true, cleared
    EXCITATION = 8
    OVERRIDE = 9  #: override taken, released, found left over
    SITUATION = 10  #: situation saved or loaded
    SETTING = 11  #: wind, loading, view or a dataref was set


class CameraView(enum.IntEnum):
    """Where the pilot's camera looks. Numbers of FrameState."""

    UNKNOWN = 0
    FORWARD = 1
    REAR = 2
    DOWN = 3


class ControlField(enum.IntFlag):
    """Bits of ControlCommand.fields."""

    ROLL = 1
    PITCH = 2
    YAW = 4
    THROTTLE = 8  #: one lever for all engines
    ENGINE_THROTTLES = 16  #: one lever each
    MOTORS = 32  #: motors directly, past the levers (multirotor controllers)
    TRIM_ROLL = 64
    TRIM_PITCH = 128
    TRIM_YAW = 256
    FLAPS = 512
    SPEEDBRAKE = 1024
    GEAR = 2048
    PARKING_BRAKE = 4096
    TOE_BRAKES = 8192  #: left_brake and right_brake
    THRUST_VECTOR = 16384


class ImageQuality(enum.IntFlag):
    """Bits of FrameState.quality; 0 is perfect."""

    STATE_MISSING = 1  #: no state could be paired: `state` is empty (valid = 0)
    INTERPOLATED = 2  #: states come more slowly than frames: `state` is interpolated between two
    OFF_FRAME = 4  #: the nearest state is not of the very frame
    DISPLAY_UNKNOWN = 8  #: display_time is not known: grab_time stands in for it
    CLOCK_UNSURE = 16  #: uncertainty of the clock above half a frame
    FROZEN = 32  #: the same pixels while the state moves
    BLACK = 64  #: an (almost) black picture
    PAUSED = 128  #: the simulator stood still
    REPLAY = 256
    VIEW_UNKNOWN = 512  #: the view could not be read back: frame_id is the configured one
    FOV_ASSUMED = 1024  #: the field of view was not read back (the parameter's was used), or changed just here
    EXTERNAL_VIEW = 2048  #: the camera is outside the aircraft
    EPOCH_EDGE = 4096  #: the frame lies at a reset, pause, new origin or gap
    DELAY_ASSUMED = 8192  #: the display delay is the default, not measured on this set-up
    BORDERLINE = 16384  #: half way between two frames, or seen late: the pairing may be one frame off
    POSE_UNSURE = 32768  #: how X-Plane's camera angles are to be read is open, or the camera moved in the cockpit


class FlightStateValid(enum.IntFlag):
    """Bits of FlightState.valid."""

    SIM = 1  #: paused, replay, frame_period
    POSITION = 2  #: latitude, longitude, altitude_msl, position_*
    AGL = 4  #: altitude_agl
    BARO = 8  #: altitude_indicated, altitude_pressure
    ATTITUDE = 16  #: roll_deg, pitch_deg, heading_true_deg, orientation
    MAGNETIC = 32  #: heading_magnetic_deg, declination_deg
    RATES = 64  #: angular_velocity, euler_rates
    ANGULAR_ACCEL = 128  #: angular_acceleration
    VELOCITY = 256  #: velocity_ned, velocity_body, ground_speed, track_deg, flight_path_angle_deg, vertical_speed
    AIR_VELOCITY = 512  #: air_velocity_body, alpha_deg, beta_deg
    AIRSPEEDS = 1024  #: indicated_, calibrated_, equivalent_, true_airspeed, mach, dynamic_pressure
    ATMOSPHERE = 2048  #: air_density
    LOAD = 4096  #: load_factor_*, specific_force
    RAW_AIRFLOW = 8192  #: xplane_alpha_deg, xplane_beta_deg, xplane_hpath_deg, xplane_vpath_deg
    WIND = 16384  #: wind_ned, wind_speed, wind_from_deg
    MOMENTS = 32768  #: aero_moment
    CONTROLS = 65536  #: control_*
    CONTACT = 131072  #: on_ground


class EngineStatesValid(enum.IntFlag):
    """Bits of EngineStates.valid."""

    THROTTLE_COMMAND = 1
    THROTTLE_ACTUAL = 2
    PROPELLER_COMMAND = 4
    MIXTURE = 8
    ENGINE_SPEED = 16
    PROPELLER_SPEED = 32
    PROPELLER_PITCH = 64
    N1 = 128
    N2 = 256
    MANIFOLD_PRESSURE = 512
    ENGINE_PRESSURE_RATIO = 1024
    TORQUE = 2048
    THRUST = 4096
    POWER = 8192
    FUEL_FLOW = 16384
    ITT = 32768
    EGT = 65536
    CHT = 131072
    OIL_PRESSURE = 262144
    OIL_TEMPERATURE = 524288
    FUEL_PRESSURE = 1048576
    RUNNING = 2097152
    PROPELLER_MODE = 4194304
    MAGNETOS = 8388608
    IGNITER_ON = 16777216
    STARTER_RUNNING = 33554432
    FUEL_PUMP_ON = 67108864
    CARBURETTOR_HEAT = 134217728
    COWL_FLAP = 268435456
    INLET_HEAT_ON = 536870912
    PROPELLER_HEAT_ON = 1073741824


class SurfaceStatesValid(enum.IntFlag):
    """Bits of SurfaceStates.valid."""

    AILERON1 = 1
    AILERON2 = 2
    SPOILER1 = 4
    SPOILER2 = 8
    FLAP1 = 16  #: with DATA rows no row carries flaps by side: they come through a small RREF request
    FLAP2 = 32
    SPEEDBRAKE1 = 64
    SPEEDBRAKE2 = 128
    YAW_BRAKE = 256
    ELEVATOR = 512
    RUDDER = 1024
    WING_ELEVATOR1 = 2048
    WING_ELEVATOR2 = 4096


class ControlStatesValid(enum.IntFlag):
    """Bits of ControlStates.valid."""

    STICK = 1  #: stick_*
    AUGMENTATION = 2  #: augmentation_*
    TOTAL = 4  #: total_*
    TRIM = 8  #: trim_*
    FLAPS = 16  #: flap_*, slat_ratio
    SPEEDBRAKE = 32  #: speedbrake_*
    GEAR = 64  #: gear_*, nose_wheel_deg
    BRAKES = 128  #: *_brake*
    THRUST_VECTOR = 256  #: thrust_vector_*, nacelle_angle_deg
    OVERRIDES = 512  #: override_*


class ElectricalStateValid(enum.IntFlag):
    """Bits of ElectricalState.valid."""

    BUSES = 1  #: bus_*
    BATTERIES = 2  #: battery_*
    GENERATORS = 4  #: generator_*
    INVERTERS = 8  #: inverter_on
    APU = 16  #: apu_*
    HYDRAULICS = 32  #: hydraulic_*
    SWITCHES = 64  #: avionics_on, *_light_on, pitot_heat_on, cross_tie
    ICE = 128  #: pitot_heat_copilot_on .. deicing_fluid
    CABIN = 256  #: cabin_*, bleed_air_mode
    OXYGEN = 512  #: oxygen_*


class AutopilotStateValid(enum.IntFlag):
    """Bits of AutopilotState.valid."""

    MODES = 1  #: flight_director_mode .. back_course_status
    TARGETS = 2  #: target_*; of target_airspeed and target_mach the dial's one
    DIRECTOR = 4  #: director_*
    STATUS = 8  #: heading_status .. roll_status


class WarningStateValid(enum.IntFlag):
    """Bits of WarningState.valid."""

    MASTER = 1  #: master_*
    SYSTEMS = 2  #: autopilot_disconnect .. yaw_damper
    ENGINES = 4  #: the arrays by engine
    FLIGHT = 8  #: stall, gear, overspeed, crashed


class FuelStateValid(enum.IntFlag):
    """Bits of FuelState.valid."""

    FUEL = 1  #: fuel_tank, fuel_total
    WEIGHTS = 2  #: *_mass
    CG = 4  #: cg_offset
    SELECTORS = 8  #: fuel_selector .. tank_pump_on


class SimStatusValid(enum.IntFlag):
    """Bits of SimStatus.valid."""

    RATE = 1  #: frame_period, frame_rate
    TIME = 2  #: time_ratio .. local_time; time_ratio may be NaN by itself
    VIEW = 4  #: view_*, field_of_view_deg
    WINDOW = 8  #: window_*


class NavigationStateValid(enum.IntFlag):
    """Bits of NavigationState.valid."""

    COM = 1  #: com_*
    TRANSPONDER = 2  #: transponder_*
    NAV = 4  #: nav_*, obs_deg, glideslope_*
    DME = 8  #: dme_*
    ADF = 16  #: adf_*
    MARKERS = 32  #: *_marker_lit
    GPS = 64  #: gps_*
    HSI = 128  #: hsi_*


class InstrumentStateValid(enum.IntFlag):
    """Bits of InstrumentState.valid."""

    AIR_DATA = 1  #: airspeed .. altimeter_setting
    VACUUM = 2  #: *_vacuum_deg, suction
    ELECTRIC = 4  #: *_electric_deg
    AHARS = 8  #: *_ahars_deg
    TURN = 16  #: turn_*, slip_deg, compass_heading_deg
    RADIO_ALTITUDE = 32  #: radio_altitude
    TEMPERATURE = 64  #: outside_temperature
    CLOCK = 128  #: clock_*, elapsed_*


class EnvironmentStateValid(enum.IntFlag):
    """Bits of EnvironmentState.valid."""

    AIR = 1  #: temperature .. sea_level_temperature
    WIND = 2  #: wind_layer_*
    CLOUDS = 4  #: cloud_*
    WEATHER = 8  #: visibility, rain, precipitation
    TIME = 16  #: zulu_time, local_time, date_days
    TERRAIN = 32  #: height_above_ground, altitude_msl, terrain_height


def words(numbers: Type[enum.IntEnum]) -> Dict[int, str]:
    """Each number of an enumeration and its name in small letters."""
    return {each.value: each.name.lower() for each in numbers}


class CommandField(NamedTuple):
    """A scalar field of ControlCommand: its bit and its range."""

    bit: ControlField
    low: float
    high: float


#: Every scalar field of ControlCommand.
COMMAND_FIELDS: Dict[str, CommandField] = {
    "roll": CommandField(ControlField.ROLL, -1.0, 1.0),
    "pitch": CommandField(ControlField.PITCH, -1.0, 1.0),
    "yaw": CommandField(ControlField.YAW, -1.0, 1.0),
    "throttle": CommandField(ControlField.THROTTLE, -1.0, 1.0),
    "trim_roll": CommandField(ControlField.TRIM_ROLL, -1.0, 1.0),
    "trim_pitch": CommandField(ControlField.TRIM_PITCH, -1.0, 1.0),
    "trim_yaw": CommandField(ControlField.TRIM_YAW, -1.0, 1.0),
    "flaps": CommandField(ControlField.FLAPS, 0.0, 1.0),
    "speedbrake": CommandField(ControlField.SPEEDBRAKE, -0.5, 1.0),
    "gear": CommandField(ControlField.GEAR, 0.0, 1.0),
    "parking_brake": CommandField(ControlField.PARKING_BRAKE, 0.0, 1.0),
    "left_brake": CommandField(ControlField.TOE_BRAKES, 0.0, 1.0),
    "right_brake": CommandField(ControlField.TOE_BRAKES, 0.0, 1.0),
    "thrust_vector": CommandField(ControlField.THRUST_VECTOR, 0.0, 1.0),
}
#: What a surface can do, SetFailure.kind.
SURFACE_FAILURE_KINDS = (
    "stuck",
    "hard_over_up",
    "hard_over_down",
    "centred",
    "floating",
    "reduced",
    "slow",
    "gone",
)
#: Every SetFailure.kind; "failed" is for whatever is no surface.
FAILURE_KINDS = (*SURFACE_FAILURE_KINDS, "failed")
#: Every InjectExcitation.kind that starts a signal.
EXCITATION_KINDS = (
    "doublet",
    "3-2-1-1",
    "multisine",
    "chirp",
)
#: Every SetDisturbance.kind that starts one.
DISTURBANCE_KINDS = (
    "gust",
    "turbulence",
    "shear",
    "microburst",
)
