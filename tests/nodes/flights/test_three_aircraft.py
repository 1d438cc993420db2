"""One joystick flies all three aircraft (the paper's Fig. 11); a controller on control/auto hovers the quadrotor."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from support.deadlines import WAIT_S
from support.flights.position_loop import Motion, PositionLoop
from support.nodes.tx_fixtures import AUTO, PITCH, ROLL, THROTTLE, YAW, RepeatedJoy, WatchedDatarefs, tx_params
from xplane_bridge.harness import wait_until
from xplane_bridge.lockstep import Participant, advertise

JOYSTICK = Path(__file__).resolve().parents[3] / "config" / "joysticks" / "logitech_extreme_3d_pro.yaml"

BANK = "sim/flightmodel/position/phi"
ELEVATION = "sim/flightmodel/position/theta"
TURN = "sim/flightmodel/position/R"
NACELLES = "sim/cockpit2/controls/thrust_vector_ratio"


def lever(engine):
    return f"sim/cockpit2/engine/actuators/throttle_ratio[{engine}]"


def start_tx(world, aircraft, *emulator_options):
    from xplane_bridge.msg import ControlMode

    world.xplane = world.emulator("--no-beacon", "--start", "air", "--aircraft", aircraft, *emulator_options)
    world.mode = world.watch("control/mode", ControlMode)
    world.set_param("aircraft", aircraft)
    # A busy machine's source may be silent for a moment.
    world.start("tx_node", tx_params(aircraft, command_timeout=5.0))
    world.mode.wait_for()


@pytest.mark.parametrize(("aircraft", "engines"), [("fixed_wing", 2), ("multirotor", 4), ("tiltrotor", 2)])
def test_one_joystick_flies_it(world, aircraft, engines):
    start_tx(world, aircraft)
    world.start("joystick_mapper_node", yaml.safe_load(JOYSTICK.read_text(encoding="utf-8")))
    levers = [lever(engine) for engine in range(engines)]
    wire = WatchedDatarefs(world.xplane.port, BANK, ELEVATION, TURN, NACELLES, *levers)
    stick = RepeatedJoy(world, axes=6, buttons=12)
    try:
        stick.plug_in()
        stick.axes[0] = -0.6  # stick right
        wait_until(lambda: wire.value(BANK) > 8.0, WAIT_S, "right bank")
        stick.axes[0] = 0.6
        wait_until(lambda: wire.value(BANK) < 0.0, WAIT_S, "left bank")
        stick.axes[0] = 0.0
        before = wire.value(ELEVATION)
        stick.axes[1] = -0.6  # stick back
        wait_until(lambda: wire.value(ELEVATION) > before + 3.0, WAIT_S, "nose up")
        stick.axes[1] = 0.0
        stick.axes[2] = -0.8  # twisted right
        wait_until(lambda: wire.value(TURN) > 1.0, WAIT_S, "turn to the right")
        stick.axes[2] = 0.0
        stick.axes[3] = 0.5  # knob: three quarters
        for path in levers:
            wire.wait(path, 0.75, tolerance=0.02)
        if aircraft == "tiltrotor":
            before = wire.value(NACELLES)
            stick.buttons[5] = 1  # the hat moves the nacelles from now on
            stick.axes[5] = 1.0 if before < 0.5 else -1.0
            wait_until(lambda: abs(wire.value(NACELLES) - before) > 0.2, WAIT_S, "nacelles on their way")
    finally:
        stick.pull_out()
        wire.close()


def motion_of(state):
    """A FlightState as the position loop looks at it."""
    return Motion(
        latitude_deg=state.latitude,
        longitude_deg=state.longitude,
        altitude_m=state.altitude_msl,
        v_north_mps=state.velocity_ned.x,
        v_east_mps=state.velocity_ned.y,
        v_down_mps=state.velocity_ned.z,
        roll_rad=math.radians(state.roll_deg),
        pitch_rad=math.radians(state.pitch_deg),
        heading_rad=math.radians(state.heading_true_deg),
    )


def test_position_loop_on_control_auto_hovers_the_quadrotor_60_s_within_a_metre(world):
    """In lock-step: the simulator waits for the commands of this process, however late it is."""
    import rospy
    from xplane_bridge.msg import ControlCommand, ControlMode, ModeRequest
    from xplane_bridge.srv import LockstepStep

    options = ("--start", "air", "--aircraft", "multirotor", "--alt", "120", "--heading", "70")
    world.emulator("--no-beacon", "--stepped", "lockstep", *options, "--turbulence", "0.5", "--seed", "4")
    mode = world.watch("control/mode", ControlMode)
    lockstep = {"enabled": True, "hold": True, "participants": [rospy.get_name()], "watchdog": WAIT_S}
    world.set_param("lockstep", lockstep)
    world.set_param("aircraft", "multirotor")
    world.set_param("tx_node", tx_params("multirotor"))
    world.start("rx_node")
    world.start("tx_node")

    commands = advertise(f"{world.namespace}/control/auto", ControlCommand)
    requests = rospy.Publisher(f"{world.namespace}/control/mode_request", ModeRequest, queue_size=1)
    for publisher in (commands, requests):
        wait_until(lambda publisher=publisher: publisher.get_num_connections() > 0, WAIT_S, "tx_node's subscription")
    loop = None
    distances = []  # simulator time, metres

    def control(state):
        nonlocal loop
        if not state.control_throttle > 0.0:
            return None  # the throttle of the hover is not shown yet
        motion = motion_of(state)
        if loop is None:
            loop = PositionLoop(motion, state.control_throttle, motion.heading_rad)
            request = ModeRequest(mode=AUTO, sequence=1, requester="test")
            request.header.stamp = state.header.stamp
            requests.publish(request)
        distances.append((state.sim_time, loop.distance(motion)))
        sticks = loop.step(motion, state.frame_period)
        command = ControlCommand(fields=ROLL | PITCH | YAW | THROTTLE, sequence=len(distances))
        command.roll, command.pitch, command.yaw, command.throttle = sticks
        return command

    def fly(seconds):
        frames = round(60 * seconds)
        answer = world.call("lockstep/step", LockstepStep, frames=frames)
        assert (answer.success, answer.flown) == (True, frames), answer.result.message

    def engaged():  # no frame waits for the request, and none is carried out in a hold
        fly(0.1)
        return bool(mode.messages) and mode.last.mode == AUTO

    participant = Participant(control, commands, world.namespace)
    try:
        wait_until(lambda: participant.connected, WAIT_S, "flight states")
        wait_until(engaged, WAIT_S, "AUTO")
        settled = distances[-1][0] + 5.0
        fly(65.0)
    finally:
        participant.close()
    hovering = [(sim_time, distance) for sim_time, distance in distances if sim_time > settled]
    assert hovering[-1][0] - hovering[0][0] >= 59.9
    assert max(distance for _, distance in hovering) < 1.0
    assert not mode.last.failsafe
    assert mode.last.mode == AUTO
