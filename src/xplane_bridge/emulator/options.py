"""The emulator's options, and its command line."""

from __future__ import annotations

import argparse
import ipaddress
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import FrozenSet, List, Optional, Sequence, Tuple

from xplane_bridge import protocol, xplane_names
from xplane_bridge.emulator.aircraft import model_names
from xplane_bridge.emulator.datarefs.traffic import MOST as MOST_OTHERS
from xplane_bridge.emulator.flight.earth import wrap_degrees, wrap_half_turn
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.option_values import (
    OptionError,
    address,
    aerodrome,
    check_stepping,
    endpoint,
    otherwise_ids,
    require,
    rows,
    wind_from,
)
from xplane_bridge.emulator.windows import WindowView, window_view
from xplane_bridge.emulator.wire.faults import FaultPlan, FaultSyntaxError, parse_faults
from xplane_bridge.emulator.wire.server import RREF_REQUESTS_PER_FRAME

KINEMATIC = "kinematic"
#: Where a flight starts if neither the command line nor the pilot's scenario says so: by option, its value and the
#: field of `InitialState`.
_START = {
    "start": ("air", "on_ground"),
    "lat": (37.4602, "latitude_deg"),
    "lon": (126.4407, "longitude_deg"),
    "alt": (1000.0, "altitude_m"),
    "heading": (0.0, "heading_deg"),
    "speed": (None, "airspeed_mps"),
}
#: What `--otherwise` makes of values a datagram and of requests a frame.
_SMALL_SPLIT, _FEW_REQUESTS = 20, 20


@dataclass
class Options:
    """How to run an emulator. The defaults are those of the command line."""

    aircraft: str = "fixed_wing"
    version: str = "11"  #: one of `xplane_names.VERSIONS`, whose newest 11 and 12 become
    initial: InitialState = field(default_factory=lambda: InitialState(engines_running=True))
    bind: str = "0.0.0.0"
    port: int = protocol.DEFAULT_PORT
    fps: float = 60.0
    rate: int = 20
    seed: int = 0
    sim_time_start: float = 0.0
    load_time: float = 0.0
    pilot: Optional[Path] = None
    start_given: FrozenSet[str] = frozenset()  #: fields of `initial` that the pilot's scenario leaves as they are
    truth: Optional[Path] = None
    duration: Optional[float] = None
    #: None: real time; "lines": frames on request; "fast": as fast as it goes; "lockstep": as clients answer
    stepped: Optional[str] = None
    pace: float = 0.0  #: of lock-step: simulated time over real time at most; 0: as fast as it goes
    xplane_connect_port: Optional[int] = None
    beacon: bool = True
    beacon_group: str = protocol.BEACON_GROUP
    beacon_port: int = protocol.BEACON_PORT
    rref_split: int = protocol.RREF_MAX_PAIRS
    request_limit: int = RREF_REQUESTS_PER_FRAME
    unknown_datarefs: str = "omit"
    bracket_names: bool = True  #: whether names with brackets are taken as a whole
    surface_failures: str = "act"
    overridden_totals: str = "move"
    send_while_paused: bool = True
    otherwise: FrozenSet[str] = frozenset()  #: of `otherwise.IDS`: where X-Plane is not as the bridge assumes
    wind: Tuple[float, float] = (0.0, 0.0)  #: from [deg], speed [m/s]
    turbulence: float = 0.0
    pipeline_delay: float = 0.0
    frame_jitter: float = 0.0  #: by which frames come later, at most and at random [s]
    window: bool = False  #: whether the cockpit view is drawn
    window_size: Tuple[int, int] = (640, 480)
    aerodrome: Optional[Tuple[float, float, float]] = None  #: latitude, longitude, heading [deg]; None: where it starts
    more_windows: Tuple[WindowView, ...] = ()  #: beside the first, of the same size
    hud: bool = False
    strip: bool = True
    swap_log: Optional[Path] = None
    picture_every: int = 1  #: of lock-step: frames from one picture to the next
    joystick: str = "attached"
    auto_coordination: bool = False
    loading_time: float = 0.0  #: of a flight, an aircraft, a situation that a client asks for [s]
    answer_from: Optional[str] = None  #: address of this machine that answers come from
    data_target: Optional[Tuple[str, int]] = None  #: where DATA goes from the start
    data_rows: Tuple[int, ...] = ()  #: rows selected for the network from the start
    deaf: bool = False  #: whether nothing that arrives is read
    second_beacon: Optional[str] = None  #: second address of this machine that beacons come from
    fault: FaultPlan = field(default_factory=FaultPlan)
    traffic: int = 0  #: other aircraft that fly
    realtime: bool = True  #: whether to ask for real-time priority
    verbose: bool = False

    def __post_init__(self) -> None:
        self.version = xplane_names.NEWEST.get(self.version, self.version)
        if "unknown-omitted" in self.otherwise:
            self.unknown_datarefs = "zero"
        if "samples-whole" in self.otherwise:
            self.rref_split = min(self.rref_split, _SMALL_SPLIT)
        if "requests-a-frame" in self.otherwise:
            self.request_limit = min(self.request_limit, _FEW_REQUESTS)
        if "paused-output" in self.otherwise:
            self.send_while_paused = False
        if "fcon-acts" in self.otherwise:
            self.surface_failures = "ignored"
        if "totals-move" in self.otherwise:
            self.overridden_totals = "frozen"


#: roslaunch adds arguments like `__name:=emulator` and `__log:=...`; remappings look the same.
_ROS_ARGUMENT = re.compile(r"[A-Za-z_~/][\w~/]*:=.*")


def drop_ros_arguments(arguments: Sequence[str]) -> List[str]:
    """The arguments without those that roslaunch adds."""
    return [argument for argument in arguments if not _ROS_ARGUMENT.fullmatch(argument)]


def parse(arguments: Sequence[str]) -> Options:
    """Reads a command line; exits with a message on a wrong one, as argparse does."""
    parser = _parser()
    given = parser.parse_args(drop_ros_arguments(arguments))
    start_given = frozenset(field for name, (_, field) in _START.items() if getattr(given, name) is not None)
    for name, (usual, _) in _START.items():
        if getattr(given, name) is None:
            setattr(given, name, usual)
    try:
        return _options(given, start_given)
    except OptionError as error:
        parser.error(str(error))


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="xplane_emulator",
        description="Speaks X-Plane's UDP protocol and flies aircraft of its own. Prints `READY {json}` with its port.",
        epilog="docs/experiments/emulator.md describes what is modelled, the faults, and the stepping protocol.",
    )
    flight = p.add_argument_group("flight")
    flight.add_argument("--aircraft", default="fixed_wing", metavar="NAME", help=f"{', '.join(model_names())}")
    flight.add_argument("--model", choices=("jsbsim", KINEMATIC), default="jsbsim", help="kinematic: needs no JSBSim")
    flight.add_argument(
        "--version",
        choices=(*xplane_names.NEWEST, *xplane_names.VERSIONS),
        default="11",
        help="X-Plane version: names and commands are those of its list (default 11, that is "
        f"{xplane_names.NEWEST['11']}; 12 is {xplane_names.NEWEST['12']})",
    )
    flight.add_argument("--start", choices=("ground", "air"), help="(default air)")
    flight.add_argument("--lat", type=float, metavar="DEG", help="latitude (default 37.4602)")
    flight.add_argument("--lon", type=float, metavar="DEG", help="longitude (default 126.4407)")
    flight.add_argument("--alt", type=float, metavar="M", help="altitude MSL in the air (default 1000)")
    flight.add_argument("--heading", type=float, metavar="DEG", help="true heading (default 0)")
    flight.add_argument("--speed", type=float, metavar="M/S", help="true airspeed in the air (default: the aircraft's)")
    flight.add_argument("--terrain", type=float, default=0.0, metavar="M", help="height of the ground MSL (default 0)")
    flight.add_argument("--engines-off", action="store_true", help="start with the engines stopped")
    flight.add_argument(
        "--pilot", type=Path, metavar="FILE", help="scenario that flies until a client does, and where it starts"
    )
    flight.add_argument(
        "--joystick",
        choices=("attached", "none"),
        default="attached",
        help="attached: centres a stick without an override; none: the yoke datarefs take writes without an "
        "override (default attached)",
    )
    flight.add_argument(
        "--auto-coordination",
        action="store_true",
        help="the rudder follows the sideslip while no override, pilot or client has it",
    )
    flight.add_argument(
        "--traffic",
        type=int,
        default=0,
        metavar="N",
        help="other aircraft that fly, up to 19 (default 0: one is parked)",
    )
    flight.add_argument("--wind", default="0/0", metavar="FROM/SPEED", help="degrees true / m/s, e.g. 270/8")
    flight.add_argument(
        "--turbulence", type=float, default=0.0, metavar="M/S", help="standard deviation of the vertical gust"
    )
    flight.add_argument("--seed", type=int, default=0, help="of everything random (default 0)")

    loop = p.add_argument_group("loop")
    loop.add_argument("--fps", type=float, default=60.0, help="rendered frames a second (default 60)")
    loop.add_argument(
        "--sim-time-start", type=float, default=0.0, metavar="S", help="total_running_time_sec at the start"
    )
    loop.add_argument(
        "--load-time", type=float, default=0.0, metavar="S", help="zeros for so long, then the flight is loaded"
    )
    loop.add_argument(
        "--loading-time",
        type=float,
        default=0.0,
        metavar="S",
        help="a flight, aircraft or situation that a client asks for takes so long to load; until then nothing is "
        "read or sent, and requests wait (default 0)",
    )
    loop.add_argument("--duration", type=float, metavar="S", help="end after so long")
    loop.add_argument(
        "--stepped",
        nargs="?",
        const="lines",
        choices=("lines", "fast", "lockstep"),
        help="not in real time: frames on request by lines on stdin, or as fast as it goes (needs --duration), or each "
        "when clients have answered the one before",
    )
    loop.add_argument(
        "--pace",
        type=float,
        default=0.0,
        metavar="X",
        help="of --stepped lockstep: simulated time goes by at most so many times faster than real time (default 0: as "
        "fast as it goes)",
    )
    loop.add_argument(
        "--priority",
        choices=("realtime", "normal"),
        default="realtime",
        help="real-time priority where the system grants it, so that frames are punctual on a busy machine (default)",
    )
    loop.add_argument("--pipeline-delay", default="0", metavar="TIME", help="picture later than its packets, 0..200ms")
    loop.add_argument("--frame-jitter", default="0", metavar="TIME", help="frames longer by up to this, at random")
    loop.add_argument("--truth", type=Path, metavar="FILE", help="CSV of every frame, in doubles")

    window = p.add_argument_group("cockpit view")
    window.add_argument(
        "--window",
        nargs="?",
        const="640x480",
        metavar="WxH",
        help="draw it in a window named X-System (default 640x480)",
    )
    window.add_argument(
        "--aerodrome",
        type=aerodrome,
        metavar="LAT,LON,HEADING",
        help="middle of the runway that is drawn, and its true heading (default: where and as the flight starts)",
    )
    window.add_argument(
        "--window2",
        action="append",
        type=window_view,
        metavar="VIEW",
        help="a further one of the same frames: down, rear, left, right, HEADING/PITCH[/ROLL]; @DEGREES; repeatable",
    )
    window.add_argument("--hud", action="store_true", help="with a head-up display")
    window.add_argument("--no-strip", dest="strip", action="store_false", help="without the machine-readable strip")
    window.add_argument("--swap-log", type=Path, metavar="FILE", help="CSV of when each picture was shown")
    window.add_argument(
        "--picture-every",
        type=int,
        default=1,
        metavar="N",
        help="of --stepped lockstep: draw the first frame and every Nth one after it (default 1)",
    )

    wire = p.add_argument_group("wire")
    wire.add_argument("--bind", default="0.0.0.0", metavar="IP", help="address to listen on (default all)")
    wire.add_argument(
        "--port", type=int, default=protocol.DEFAULT_PORT, help="UDP port (default 49000; 0: any free one)"
    )
    wire.add_argument("--rate", type=int, default=20, metavar="HZ", help="network_data_rate at the start (default 20)")
    wire.add_argument(
        "--xpc-port",
        type=int,
        metavar="PORT",
        help="answer there as the X-Plane Connect plugin (the real one: 49009; 0: a free one; default: none)",
    )
    wire.add_argument("--no-beacon", dest="beacon", action="store_false", help="do not announce on multicast")
    wire.add_argument(
        "--second-beacon",
        type=address,
        metavar="IP",
        help="announce from this address of the machine as well, as a computer with two networks does",
    )
    wire.add_argument(
        "--answer-from", type=address, metavar="IP", help="RREF and RPOS come from this address of the machine"
    )
    wire.add_argument(
        "--beacon-target",
        default=f"{protocol.BEACON_GROUP}:{protocol.BEACON_PORT}",
        metavar="IP:PORT",
        help=argparse.SUPPRESS,
    )
    wire.add_argument(
        "--data-target",
        metavar="IP:PORT",
        help="DATA goes there from the start, as set on X-Plane's own screen (default: nowhere until ISE4 says)",
    )
    wire.add_argument(
        "--data-rows",
        default="",
        metavar="LIST",
        help="rows selected for the network from the start, e.g. 1,3,16-21 (default none)",
    )
    wire.add_argument(
        "--deaf",
        action="store_true",
        help="nothing that arrives is read: a firewall, or version 12 that does not accept incoming connections",
    )
    wire.add_argument(
        "--rref-split", type=int, default=protocol.RREF_MAX_PAIRS, metavar="N", help="values a datagram (default 183)"
    )
    wire.add_argument(
        "--request-limit",
        type=int,
        default=RREF_REQUESTS_PER_FRAME,
        metavar="N",
        help=f"RREF requests taken a frame, more are lost (default {RREF_REQUESTS_PER_FRAME})",
    )
    wire.add_argument("--unknown-datarefs", choices=("omit", "zero"), default="omit", help="(default omit)")
    wire.add_argument(
        "--bracket-names",
        choices=("whole", "cut"),
        default="whole",
        help="sim/weather/wind_speed_kt[0] is a name of its own, or an element of wind_speed_kt (default whole)",
    )
    wire.add_argument(
        "--otherwise",
        type=otherwise_ids,
        default=frozenset(),
        metavar="ID,...",
        help="where X-Plane is not as the bridge assumes: questions of docs/setups/doctor.md, or 'all'",
    )
    wire.add_argument(
        "--surface-failures",
        choices=("act", "ignored"),
        default="act",
        help="rel_fcon_* of version 12: ignored where an aircraft moves its surfaces itself (default act)",
    )
    wire.add_argument(
        "--overridden-totals",
        choices=("move", "frozen"),
        default="move",
        help="total_*_ratio under override_control_surfaces (default move)",
    )
    wire.add_argument("--paused-output", choices=("on", "off"), default="on", help="send while paused (default on)")
    wire.add_argument(
        "--fault",
        default="",
        metavar="LIST",
        help="e.g. drop=0.1,delay=20ms,dup,reorder,truncate,freeze=2s@10,restart=3s@20",
    )
    wire.add_argument("-v", "--verbose", action="store_true", help="log what is ignored and why")
    return p


def _options(given: argparse.Namespace, start_given: FrozenSet[str]) -> Options:
    finite = ("lat", "lon", "alt", "heading", "terrain", "turbulence", "fps")
    for name in (*finite, "sim_time_start", "load_time", "loading_time"):
        require(
            math.isfinite(getattr(given, name)), f"--{name.replace('_', '-')}", getattr(given, name), "a finite number"
        )
    require(-90.0 <= given.lat <= 90.0, "--lat", given.lat, "-90..90")
    require(-180.0 <= given.lon <= 360.0, "--lon", given.lon, "-180..180")
    require(1.0 <= given.fps <= 500.0, "--fps", given.fps, "1..500")
    require(0 <= given.port <= 65535, "--port", given.port, "0..65535")
    require(0 <= given.traffic <= MOST_OTHERS, "--traffic", given.traffic, f"0..{MOST_OTHERS}")
    require(1 <= given.rref_split <= protocol.RREF_MAX_PAIRS, "--rref-split", given.rref_split, "1..183")
    require(given.request_limit >= 1, "--request-limit", given.request_limit, "1 or more")
    require(0 <= given.rate <= 99, "--rate", given.rate, "0..99")
    require(0.0 <= given.turbulence <= 20.0, "--turbulence", given.turbulence, "0..20")
    require(given.load_time >= 0.0, "--load-time", given.load_time, "0 or more")
    require(given.loading_time >= 0.0, "--loading-time", given.loading_time, "0 or more")
    duration = given.duration
    require(duration is None or 0.0 < duration < math.inf, "--duration", duration, "more than 0, and finite")
    require(given.speed is None or 0.0 <= given.speed <= 300.0, "--speed", given.speed, "0..300")
    require(given.seed >= 0, "--seed", given.seed, "0 or more")
    require(given.pilot is None or given.pilot.is_file(), "--pilot", given.pilot, "an existing file")
    try:
        ipaddress.IPv4Address(given.bind)
    except ValueError:
        raise OptionError(
            f"--bind {given.bind}: expected an IPv4 address of this machine, or 0.0.0.0 for all"
        ) from None
    if given.model == KINEMATIC:
        aircraft = KINEMATIC
    else:
        aircraft = given.aircraft
        known = (*model_names(), KINEMATIC)
        require(aircraft in known, "--aircraft", aircraft, "one of " + ", ".join(known))
    try:
        fault = parse_faults(given.fault)
        delay = parse_faults(f"delay={given.pipeline_delay}").delay_s
        jitter = parse_faults(f"delay={given.frame_jitter}").delay_s
    except FaultSyntaxError as error:
        raise OptionError(str(error)) from None
    size = re.fullmatch(r"(\d{3,4})x(\d{3,4})", given.window or "640x480")
    xpc_port = given.xpc_port
    require(xpc_port is None or 0 <= xpc_port <= 65535, "--xpc-port", xpc_port, "0 to 65535")
    if size is None:
        raise OptionError(f"--window {given.window}: expected WIDTHxHEIGHT, e.g. 640x480")
    require(not given.window2 or given.window is not None, "--window2", given.window2, "--window with it")
    require(not given.hud or given.window is not None, "--hud", "given", "--window with it")
    require(given.swap_log is None or given.window is not None, "--swap-log", given.swap_log, "--window with it")
    check_stepping(given, delay, jitter)
    group, _, beacon_port = given.beacon_target.partition(":")
    initial = InitialState(
        latitude_deg=given.lat,
        longitude_deg=wrap_half_turn(given.lon),
        heading_deg=wrap_degrees(given.heading),
        on_ground=given.start == "ground",
        altitude_m=given.alt,
        airspeed_mps=given.speed,
        terrain_elevation_m=given.terrain,
        engines_running=not given.engines_off,
    )
    return Options(
        aircraft=aircraft,
        version=given.version,
        bracket_names=given.bracket_names == "whole",
        initial=initial,
        bind=given.bind,
        port=given.port,
        fps=given.fps,
        rate=given.rate,
        seed=given.seed,
        sim_time_start=given.sim_time_start,
        load_time=given.load_time,
        pilot=given.pilot,
        start_given=start_given,
        truth=given.truth,
        duration=given.duration,
        stepped=given.stepped,
        pace=given.pace,
        xplane_connect_port=given.xpc_port,
        beacon=given.beacon,
        beacon_group=group,
        beacon_port=int(beacon_port),
        rref_split=given.rref_split,
        request_limit=given.request_limit,
        unknown_datarefs=given.unknown_datarefs,
        surface_failures=given.surface_failures,
        overridden_totals=given.overridden_totals,
        send_while_paused=given.paused_output == "on",
        otherwise=given.otherwise,
        wind=wind_from(given.wind),
        turbulence=given.turbulence,
        traffic=given.traffic,
        pipeline_delay=delay,
        frame_jitter=jitter,
        window=given.window is not None,
        window_size=(int(size.group(1)), int(size.group(2))),
        aerodrome=given.aerodrome,
        more_windows=tuple(given.window2 or ()),
        hud=given.hud,
        strip=given.strip,
        swap_log=given.swap_log,
        picture_every=given.picture_every,
        joystick=given.joystick,
        auto_coordination=given.auto_coordination,
        loading_time=given.loading_time,
        answer_from=given.answer_from,
        data_target=endpoint("--data-target", given.data_target),
        data_rows=rows(given.data_rows),
        deaf=given.deaf,
        second_beacon=given.second_beacon,
        fault=fault,
        realtime=given.priority == "realtime",
        verbose=given.verbose,
    )
