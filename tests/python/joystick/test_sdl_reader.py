"""The joystick reader against SDL itself, with devices that only SDL sees, and against events put into its queue."""

from __future__ import annotations

import os

import pytest

from support.nodes.sdl_device import DOWN, LEFT, RIGHT, UP, SdlDevice
from xplane_bridge.cli import joy_reader
from xplane_bridge.joystick import sdl_reader
from xplane_bridge.joystick.sdl_reader import JoyReader, JoystickError, choose, shape, start_sdl


@pytest.fixture
def pygame(monkeypatch):
    for key in sdl_reader.SDL_ENVIRONMENT:
        monkeypatch.setenv(key, os.environ.get(key, ""))  # put back afterwards
    module = start_sdl()
    yield module
    module.quit()


@pytest.fixture
def device(pygame):
    assert pygame.joystick.get_init()
    return SdlDevice(axes=4, buttons=3, hats=1)


class Played:
    """A reader on a clock of the test's own."""

    def __init__(self, pygame, **options):
        self.pygame, self.now = pygame, 100.0
        self.reader = JoyReader(pygame, **options)

    @property
    def instance_id(self):
        """SDL's name for the device that is read."""
        return self.pygame.joystick.Joystick(0).get_instance_id()

    def step(self, dt=0.0):
        """What is published after dt seconds."""
        self.now += dt
        return self.reader.handle(self.pygame.event.get(), self.now)

    def settle(self):
        """What is published in all."""
        return (self.step() + self.step(1.0))[-1]


# -------------------------------------------------------------------------------------------- axes, hats and buttons


def test_right_and_down_are_negative_and_full_travel_is_one(pygame, device):
    played = Played(pygame)
    first = played.settle()
    assert first.axes == [0.0] * 6, "nothing is published of an axis that was not moved"
    assert first.buttons == [0, 0, 0]
    for index, value in enumerate((32767, -32768, 16384, -3277)):
        device.axis(index, value)
    axes = played.settle().axes
    assert axes[:2] == [-1.0, 1.0]
    # 16384 / 32767 and 3277 / 32767, as joy_node divides
    assert axes[2:4] == pytest.approx([-0.500015, 0.100009], abs=1e-6)


@pytest.mark.parametrize(
    ("directions", "axes"),
    [(UP, [0, 1]), (DOWN, [0, -1]), (LEFT, [1, 0]), (RIGHT, [-1, 0]), (UP | RIGHT, [-1, 1]), (DOWN | LEFT, [1, -1])],
)
def test_a_hat_is_two_axes_behind_the_others_left_and_up_positive(pygame, device, directions, axes):
    played = Played(pygame)
    played.settle()
    device.hat(0, directions)
    assert played.settle().axes[4:] == axes
    device.hat(0, 0)
    assert played.settle().axes[4:] == [0, 0]


def test_the_dead_zone_is_stretched_as_joy_nodes():
    assert shape(0.05, 0.1) == 0.0
    assert shape(-0.1, 0.1) == pytest.approx(0.0)
    assert shape(0.55, 0.1) == pytest.approx(-0.5)  # (0.55 - 0.1) / 0.9
    assert shape(-32768 / 32767, 0.1) == 1.0
    assert shape(1.0, 0.1) == -1.0


# -------------------------------------------------------------------------------------------------------------- when


def test_axes_are_put_together_and_buttons_are_not(pygame, device):
    played = Played(pygame, coalesce_interval=0.01, autorepeat_rate=0.0)
    played.settle()
    device.axis(0, 10000)
    assert played.step() == []
    device.axis(1, 10000)
    assert played.step(0.004) == []
    assert played.reader.patience(played.now) == pytest.approx(0.006)
    (state,) = played.step(0.0061)
    assert state.axes[0] == state.axes[1] == pytest.approx(-0.30518, abs=1e-4)
    device.button(2, 1)
    (pressed,) = played.step()
    assert pressed.buttons == [0, 0, 1]


def test_a_press_between_two_looks_is_not_missed(pygame, device):
    assert device
    played = Played(pygame)
    played.settle()
    for kind in (pygame.JOYBUTTONDOWN, pygame.JOYBUTTONUP):
        pygame.event.post(pygame.event.Event(kind, instance_id=played.instance_id, button=1))
    assert [state.buttons[1] for state in played.step()] == [1, 0]


def test_a_motionless_stick_is_repeated(pygame, device):
    played = Played(pygame, autorepeat_rate=50.0)
    device.axis(0, 32767)
    played.settle()
    assert played.step(0.019) == []
    assert played.reader.patience(played.now) == pytest.approx(0.001)
    assert [state.axes[0] for state in played.step(0.0011)] == [-1.0]
    silent = Played(pygame, autorepeat_rate=0.0)
    silent.settle()
    assert silent.step(100.0) == []


# --------------------------------------------------------------------------------------------- plugged in, pulled out


def test_a_joystick_is_looked_for_read_lost_and_read_again(pygame):
    played = Played(pygame)
    assert "no joystick is there" in played.reader.notice
    assert played.step(1.0) == []
    device = SdlDevice(axes=2, buttons=2, hats=0)
    played.settle()
    assert played.reader.notice == "reading 'Virtual Flight Stick': 2 axes, 0 hats as 0 more, 2 buttons"
    device.axis(0, 32767)
    device.button(0, 1)
    assert played.settle().axes == [-1.0, 0.0]
    device.pull_out()
    assert played.step() == [], "SDL lets everything go before it says that the device is gone; the user did not"
    assert played.step(5.0) == []
    assert played.reader.name == ""
    assert played.reader.notice.startswith("'Virtual Flight Stick' was pulled out; no joystick is there")
    again = SdlDevice(axes=2, buttons=2, hats=0)
    assert played.settle().axes == [0.0, 0.0], "what was held before counts no more"
    again.button(1, 1)
    assert played.settle().buttons == [0, 1]


def test_a_loose_plug_is_heard_as_a_silence(pygame):
    played = Played(pygame)
    device = SdlDevice(axes=2, buttons=1, hats=0)
    played.settle()
    device.pull_out()
    SdlDevice(axes=2, buttons=1, hats=0)
    assert played.step() == []
    assert played.reader.name, "it is back at once"
    assert played.step(0.9) == []
    assert 0.0 < played.reader.patience(played.now) <= 0.1
    assert played.step(0.2)[-1].axes == [0.0, 0.0]


def test_another_device_does_not_disturb(pygame):
    first = SdlDevice(axes=2, buttons=1, hats=0)
    played = Played(pygame, wanted="0")
    played.settle()
    second = SdlDevice(axes=2, buttons=1, hats=0)
    second.axis(0, 32767)
    second.button(0, 1)
    assert played.settle().axes == [0.0, 0.0]
    assert played.settle().buttons == [0]
    second.pull_out()
    played.settle()
    first.axis(1, -32768)
    assert played.settle().axes == [0.0, 1.0]


class FakeDevice:
    """A joystick with a name of its own."""

    def __init__(self, name, instance):
        self.get_name = lambda: name
        self.get_instance_id = lambda: instance
        self.get_numaxes = lambda: 2
        self.get_numhats = lambda: 0
        self.get_numbuttons = lambda: 1
        self.quit = lambda: None


@pytest.fixture
def fakes(pygame, monkeypatch):
    """Devices that pygame finds; what happens to them is posted by the test."""
    there = []
    monkeypatch.setattr(pygame.joystick, "get_count", lambda: len(there))
    monkeypatch.setattr(pygame.joystick, "Joystick", lambda index: there[index])
    return there


def test_no_other_joystick_is_taken_instead(pygame, fakes):
    fakes[:] = [FakeDevice("Stick", 7), FakeDevice("Gamepad", 8)]
    played = Played(pygame)
    played.settle()
    assert played.reader.name == "Stick"
    del fakes[0]
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEREMOVED, instance_id=7))
    assert played.step() == []
    assert played.reader.name == ""
    pygame.event.post(pygame.event.Event(pygame.JOYAXISMOTION, instance_id=8, axis=0, value=1.0))
    assert played.step(1.0) == []
    fakes.append(FakeDevice("Stick", 9))
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEADDED, device_index=1))
    played.settle()
    pygame.event.post(pygame.event.Event(pygame.JOYAXISMOTION, instance_id=9, axis=0, value=1.0))
    assert played.settle().axes == [-1.0, 0.0]


@pytest.mark.parametrize(("wanted", "ours", "other"), [("", 7, 8), ("0", 7, 8), ("1", 8, 7)])
def test_another_one_of_the_same_name_is_not_taken_either(pygame, fakes, wanted, ours, other):
    by_id = {instance: FakeDevice("Stick", instance) for instance in (7, 8, 9)}
    fakes[:] = [by_id[7], by_id[8]]
    played = Played(pygame, wanted=wanted)
    played.settle()
    fakes.remove(by_id[ours])
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEREMOVED, instance_id=ours))
    pygame.event.post(pygame.event.Event(pygame.JOYAXISMOTION, instance_id=other, axis=0, value=0.9))
    assert played.step() == []
    assert played.step(5.0) == []
    assert played.reader.name == ""
    fakes.append(by_id[9])  # plugged in again: SDL gives it another id
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEADDED, device_index=1))
    played.settle()
    pygame.event.post(pygame.event.Event(pygame.JOYAXISMOTION, instance_id=other, axis=0, value=0.9))
    pygame.event.post(pygame.event.Event(pygame.JOYAXISMOTION, instance_id=9, axis=1, value=1.0))
    assert played.settle().axes == [0.0, -1.0]


def test_one_that_was_plugged_in_beside_it_in_flight_is_another(pygame, fakes):
    fakes[:] = [FakeDevice("Stick", 7)]
    played = Played(pygame)
    fakes.append(FakeDevice("Stick", 8))
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEADDED, device_index=1))
    played.settle()
    del fakes[0]
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEREMOVED, instance_id=7))
    assert played.step(5.0) == []
    assert played.reader.name == ""


@pytest.mark.parametrize(
    ("timeout", "rest"), [(None, 1.0), (0.05, 1.0), (0.5, 1.0), (2.0, 2.5), (10, 10.5), ("2", 1.0), (True, 1.0)]
)
def test_it_rests_for_longer_than_the_mapper_takes_to_notice(timeout, rest):
    assert joy_reader.rest_s(timeout) == rest


def test_the_rest_is_asked_for_when_a_joystick_is_lost(pygame, fakes):
    rests = [1.0]
    fakes[:] = [FakeDevice("Stick", 7)]
    played = Played(pygame, rest_s=lambda: rests[-1])
    played.settle()
    rests.append(3.0)
    fakes[:] = [FakeDevice("Stick", 8)]
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEREMOVED, instance_id=7))
    pygame.event.post(pygame.event.Event(pygame.JOYDEVICEADDED, device_index=0))
    assert played.step() == []
    assert played.step(2.9) == []
    assert played.step(0.2)[-1].axes == [0.0, 0.0]


def test_an_event_beyond_what_the_device_said_it_has_does_no_harm(pygame, fakes):
    fakes[:] = [FakeDevice("Stick", 7)]
    played = Played(pygame)
    pygame.event.post(pygame.event.Event(pygame.JOYAXISMOTION, instance_id=7, axis=5, value=1.0))
    pygame.event.post(pygame.event.Event(pygame.JOYBUTTONDOWN, instance_id=7, button=4))
    pygame.event.post(pygame.event.Event(pygame.JOYHATMOTION, instance_id=7, hat=0, value=(1, 1)))
    state = played.settle()
    assert state.axes == [0.0, 0.0]
    assert state.buttons == [0]


# ------------------------------------------------------------------------------------------------------------ choice


@pytest.mark.parametrize(
    ("names", "wanted", "index", "part"),
    [
        ([], "", None, "no joystick is there"),
        (["A", "B"], "", 0, ""),
        (["A", "B"], "1", 1, ""),
        (["A", "B"], "2", None, "no joystick 2; plugged in: 0 'A', 1 'B'"),
        (["Logitech Extreme 3D", "Xbox Pad"], "extreme", 0, ""),
        (["Logitech Extreme 3D", "Xbox Pad"], "thrust", None, "no joystick called 'thrust'"),
        (["Pad", "Pad"], "pad", None, "2 joysticks are called 'pad': choose one by its index"),
    ],
)
def test_choice_by_name_or_index(names, wanted, index, part):
    chosen, problem = choose(names, wanted)
    assert chosen == index
    assert part in problem
    assert bool(problem) == (index is None)


@pytest.mark.parametrize(
    "option", [{"deadzone": 1.0}, {"autorepeat_rate": -1.0}, {"coalesce_interval": float("nan")}], ids=str
)
def test_impossible_numbers_are_refused(pygame, option):
    with pytest.raises(JoystickError, match="expected 0 to"):
        JoyReader(pygame, **option)


def test_without_pygame_it_says_what_to_do(monkeypatch, capsys):
    def missing(_name):
        raise ModuleNotFoundError("No module named 'pygame'")

    monkeypatch.setattr(sdl_reader.importlib, "import_module", missing)
    assert joy_reader.main(["--list"]) == 1
    assert "pip install pygame" in capsys.readouterr().err


def test_the_list_names_what_is_plugged_in(device, capsys):
    assert device
    assert joy_reader.main(["--list"]) == 0
    assert capsys.readouterr().out == "0  Virtual Flight Stick\n"
