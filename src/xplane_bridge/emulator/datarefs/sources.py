"""What datarefs and commands may know of the simulator and ask of it: it offers more than they need."""

from __future__ import annotations

from typing import Callable, FrozenSet, Mapping, Protocol, Tuple

from xplane_bridge.emulator.datarefs.aircraft_systems import Electrics, Instruments
from xplane_bridge.emulator.datarefs.camera import Cameras
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.traffic import Traffic
from xplane_bridge.emulator.datarefs.world_settings import WorldSettings
from xplane_bridge.emulator.flight.flight_model import Controls, FlightModel, InitialState
from xplane_bridge.emulator.flight.frame import Clocks, Frame


class LoadedAircraft(Protocol):
    """Which aircraft is loaded."""

    model: FlightModel  #: another object after another aircraft was loaded


class FlownAircraft(LoadedAircraft, Protocol):
    """What it does and shows at present. Objects may be replaced: ask anew each time."""

    frame: Frame
    instruments: Instruments


class Sources(LoadedAircraft, Protocol):
    """Where the tables take values from that are not in the frame. Objects may be replaced: ask anew each frame."""

    internal_version: int  #: as `sim/version/xplane_internal_version` has it
    initial_data_rate: int  #: DATA datagrams a second
    window_size: Tuple[int, int]  #: width and height [px]
    otherwise: FrozenSet[str]  #: of `otherwise.IDS`: in what X-Plane is not as the bridge assumes
    totals_move: bool  #: whether `total_*_ratio` follow the stick under `override_control_surfaces`
    store: DatarefStore
    clocks: Clocks  #: the same object for ever
    controls: Controls
    electrics: Electrics
    instruments: Instruments
    copilot_instruments: Instruments
    initial: InitialState  #: where flights start
    home: InitialState  #: a flight over the middle of the one airport's runway, along it
    settings: WorldSettings
    cameras: Cameras
    traffic: Traffic

    def failed(self, leaf: str) -> bool:
        """Whether a failure dataref (`rel_...`) stands at "failed now"."""

    def failures_changed(self) -> None:
        """To be called when a failure dataref was written."""

    def hydraulic_pressure_psi(self, system: int) -> float:
        """Pressure of system 1 or 2."""

    def watch_surface(self, name: str) -> None:
        """Makes writes to a dataref that shows surfaces count while the surfaces are overridden."""


class Actions(LoadedAircraft, Protocol):
    """What commands do to the simulator."""

    version: str  #: one of `xplane_names.VERSIONS`
    otherwise: FrozenSet[str]  #: of `otherwise.IDS`
    store: DatarefStore
    clocks: Clocks

    @property
    def autopilot_commands(self) -> Mapping[str, Callable[[], None]]:
        """What X-Plane's own autopilot does by its commands."""

    def pause(self, paused: bool) -> None:
        """Stops or continues simulated time."""

    def repair_all(self) -> None:
        """Repairs everything."""

    def restart_flight(self) -> None:
        """Begins the most recent flight again."""

    def move_throttles(self, step: float) -> None:
        """Moves all levers by `step`, within 0..1."""

    def start_engine(self, engine: int) -> None:
        """Starts one engine, at once, with its key turned."""

    def start_engines(self) -> None:
        """Starts all engines."""

    def turn_key(self, engine: int, on: bool) -> None:
        """Turns an engine's ignition key to both magnetos, or off."""
