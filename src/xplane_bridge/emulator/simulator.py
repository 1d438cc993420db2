"""One running X-Plane: the aircraft, its datarefs, and what clients' requests do to them."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import Callable, Dict, FrozenSet, List, Mapping, Optional, Set, Tuple

import numpy as np

from xplane_bridge import protocol, xplane_names
from xplane_bridge.emulator import rpos
from xplane_bridge.emulator.beam import Beam
from xplane_bridge.emulator.datarefs import commands, data_rows, tables
from xplane_bridge.emulator.datarefs.aircraft_systems import COPILOT, INHG_PA, Electrics, Instruments, Weather
from xplane_bridge.emulator.datarefs.autopilot import Autopilot
from xplane_bridge.emulator.datarefs.camera import Cameras
from xplane_bridge.emulator.datarefs.control_inputs import ControlInputs, InputOptions, Pilot
from xplane_bridge.emulator.datarefs.failure_datarefs import FailureDatarefs
from xplane_bridge.emulator.datarefs.placement import Placements
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.tables.controls import old_names, surface_dataref
from xplane_bridge.emulator.datarefs.tables.engines import set_first
from xplane_bridge.emulator.datarefs.traffic import Traffic
from xplane_bridge.emulator.datarefs.world_settings import PRESSURE_INHG, WorldSettings, clip
from xplane_bridge.emulator.flight.failure_effects import TRIM_FAILURES, FailureEffects
from xplane_bridge.emulator.flight.flight_model import Controls, FlightModel, FlightModelError, InitialState
from xplane_bridge.emulator.flight.frame import Clocks, Frame
from xplane_bridge.emulator.flight.limits import is_sane
from xplane_bridge.emulator.servos import Servos
from xplane_bridge.emulator.starts import Starts

_LOG = logging.getLogger(__name__)

#: Version as datarefs and beacon give it, by the list of names that it has.
INTERNAL_VERSIONS = {"11.40": 114012, "11.55": 115501, "12.00": 120012, "12.08": 120815, "12.10": 122015}
#: Below this frame rate X-Plane slows simulated time instead of taking larger steps [1/s].
MIN_FRAME_RATE = 19.9

#: Fastest simulated time; `sim_speed` beyond it counts as this.
MAX_SIM_SPEED = 16.0
_BAR_PER_PSI = 0.0689476

_SETTING = "sim/cockpit2/gauges/actuators/barometer_setting_in_hg_pilot"
_COPILOT_SETTING = "sim/cockpit2/gauges/actuators/barometer_setting_in_hg_copilot"
_IDENTITY = "sim/aircraft/view/"
_ELECTRICAL = "sim/cockpit2/electrical/"

ModelFactory = Callable[[str], FlightModel]


class Simulator:
    """See the module's text.

    Args:
        make_model: Builds the flight model of an aircraft by name; raises FlightModelError for an unknown one.
        aircraft: Which aircraft to load first.
        version: One of `xplane_names.VERSIONS`: X-Plane's list of names for it holds.
        initial: Where flights start.
        sim_time_start: Running time at the start [s].
        data_rate: `network_data_rate` at the start [1/s].
        bracket_names: Whether names with brackets are taken as a whole (see `DatarefStore`).
        surface_failures: Whether `rel_fcon_*` act ([? fcon-acts]: not on every aircraft).
        totals_move: Whether `total_*_ratio` follow the stick under `override_control_surfaces` ([? totals-move]).
        load_time: Time before the first flight is loaded; until then its values are zeros [s].
        pilot: Flies until a client does.
        inputs: What moves the stick where neither a client nor the pilot does.
        window_size: Width and height of the window that the view is drawn in [px].
        otherwise: Of `otherwise.IDS`: in what X-Plane is not as the bridge assumes.
        traffic: How many other aircraft fly.
        weather: Blows from the first flight's start on.
        aerodrome: Latitude, longitude and heading [deg] of the one airport's runway; None: where flights start.
    """

    def __init__(
        self,
        make_model: ModelFactory,
        aircraft: str,
        version: str = xplane_names.NEWEST["11"],
        initial: Optional[InitialState] = None,
        sim_time_start: float = 0.0,
        data_rate: int = 20,
        bracket_names: bool = True,
        surface_failures: bool = True,
        totals_move: bool = True,
        load_time: float = 0.0,
        pilot: Optional[Pilot] = None,
        inputs: Optional[InputOptions] = None,
        window_size: Tuple[int, int] = (1024, 768),
        otherwise: FrozenSet[str] = frozenset(),
        traffic: int = 0,
        weather: Optional[Weather] = None,
        aerodrome: Optional[Tuple[float, float, float]] = None,
    ) -> None:
        self.version = version
        self.otherwise = otherwise
        self.is_12 = version.startswith("12")
        self.totals_move = totals_move
        self.internal_version = INTERNAL_VERSIONS[version]
        self.initial = InitialState() if initial is None else initial
        here = self.initial.latitude_deg, self.initial.longitude_deg, self.initial.heading_deg
        latitude, longitude, heading = aerodrome or here
        self.home = replace(self.initial, latitude_deg=latitude, longitude_deg=longitude, heading_deg=heading)
        self.initial_data_rate = data_rate
        self.window_size = window_size
        self._make_model = make_model
        self.aircraft = aircraft
        self.model = make_model(aircraft)
        self.store = DatarefStore(version, bracket_names and not (not self.is_12 and "wind-names" in otherwise))
        self.clocks = Clocks(running=sim_time_start)
        self.frame = Frame(self.model.info, self.clocks, from_wheels="parked-height" not in otherwise)
        self.controls = Controls()
        self.electrics = Electrics()
        self.instruments, self.copilot_instruments = Instruments(), Instruments(COPILOT)
        self.flying = False
        self.loads = 0  #: how often a flight or a situation was loaded
        self.frozen = False  #: by VEHX: the flight model stands still until an aircraft or a flight is loaded
        self._starts = Starts(self.initial, self.home, self.start_flight, self._terrain_m)
        self._load_time = load_time
        self._situations: Dict[str, Tuple[str, bytes, Dict[str, np.ndarray]]] = {}
        self._failed: Set[str] = set()
        self._failures_dirty = True
        self._surface_slots = np.zeros(0, dtype=int)
        self._surface_names: List[str] = []
        self.inputs = ControlInputs(self.store, pilot, inputs or InputOptions())
        self.cameras = Cameras(self)
        self._autopilot = Autopilot(self.store, self)
        self.table = tables.build(self)
        self._servos = Servos(self.store)
        self.rows = data_rows.DataRows(self.store, self.is_12, otherwise)
        #: What unknown datarefs are sent from where they are sent as 0.
        self.unknown_slot = int(self.store.add("_emulator/unknown").slots[0])
        self._placements = Placements(self.store)
        self._failures = FailureDatarefs(self.store)
        self._effects = FailureEffects(surface_failures)
        self.inputs.connect(self)
        self.settings = WorldSettings(self.store, self.clocks, lambda: self.model, otherwise)
        self.settings.set_weather(weather or Weather())
        self._bind_aircraft()
        self.traffic = Traffic(self.store, otherwise)
        self.traffic.start(traffic, self.initial, self.home)
        if load_time <= 0.0:
            self.start_flight(self.initial)
        self.table.publish(self.frame, self.flying)

    # --- one frame ----------------------------------------------------------------------------------------------------

    def step(self, period: float) -> None:
        """Advances by one rendered frame of `period` [s] of wall time; its requests were handled before."""
        clocks = self.clocks
        clocks.frame += 1
        clocks.wall_period = period
        clocks.simulated_period = min(period, 1.0 / MIN_FRAME_RATE)
        clocks.time_ratio = clip(self.store.get("sim/time/sim_speed"), 0.0, MAX_SIM_SPEED)
        dt = 0.0 if clocks.paused else clocks.simulated_period * clocks.time_ratio
        clocks.advance(dt, self.flying)
        if self.flying:
            self._fly(dt)
        elif clocks.elapsed >= self._load_time:
            self._starts.first()
        self.table.publish(self.frame, self.flying)
        if self.flying:
            self._publish_surfaces()

    def _fly(self, dt: float) -> None:
        if self._failures_dirty:
            self._failed = self._failures.active()
            self._failures_dirty = False
        try:
            if dt == 0.0 and "paused-motion" in self.otherwise:
                self._placements.clear()
            self._placements.apply(self.model, self.frame)
            if dt > 0.0:
                self.inputs.read(self.controls, self.model, self.frame)
                beam = Beam.heard(self.store) if self._autopilot.follows_radio() else None
                altitude_ft = self.instruments.altitude_ft
                self._autopilot.update(self.failed("rel_otto"), beam)
                self._servos.move(dt, self.frame, self.model.info, altitude_ft, self.controls, beam)
                self._effects.apply(self.controls, self._failed, self.model, dt)
                if not TRIM_FAILURES.isdisjoint(self._failed):
                    self.inputs.show_trims(self.controls)
                if not self.frozen and not self.store.get("sim/operation/override/override_planepath"):
                    self.model.step(dt, self.controls)
            if not is_sane(self.model.state):
                raise FlightModelError("its motion is none that there is")
        except (FlightModelError, ArithmeticError, ValueError) as error:
            # an aircraft that broke apart: X-Plane too starts the flight again
            _LOG.warning("the flight model gave up (%s): the flight starts again", error)
            self._starts.first()
        self.frame.update(self.model.state, self._altimeter_inhg() * INHG_PA)
        self.frame.distance += self.frame.ground_speed * dt
        self.traffic.step(dt, self.frame)
        self.electrics.update(dt, self.store, self.frame, self.failed)
        self._update_instruments()

    def _update_instruments(self) -> None:
        self.instruments.update(self.frame, self._altimeter_inhg(), self.failed)
        self.copilot_instruments.update(self.frame, self._altimeter_inhg(_COPILOT_SETTING), self.failed)

    def _altimeter_inhg(self, setting: str = _SETTING) -> float:
        return clip(self.store.get(setting), *PRESSURE_INHG)

    def _publish_surfaces(self) -> None:
        deflections = self.model.state.surfaces_deg
        self.store.values[self._surface_slots] = [deflections.get(name, 0.0) for name in self._surface_names]

    # --- what the tables and commands use -----------------------------------------------------------------------------

    def failed(self, leaf: str) -> bool:
        """Whether a failure dataref (`rel_...`) stands at "failed now"."""
        return leaf in self._failed

    @property
    def autopilot_commands(self) -> Mapping[str, Callable[[], None]]:
        """What X-Plane's own autopilot does by its commands."""
        return self._autopilot.commands()

    def failures_changed(self) -> None:
        """To be called when a failure dataref was written."""
        self._failures_dirty = True

    def repair_all(self) -> None:
        """Repairs everything (RESE)."""
        self._failures.repair_all()
        self._failures_dirty = True

    def hydraulic_pressure_psi(self, system: int) -> float:
        """Pressure of system 1 or 2, driven by engine 1 or 2; bar where that is the switch."""
        engines = self.frame.m.engines
        running = system <= len(engines) and engines[system - 1].running
        pump = "rel_hydpmp" if system == 1 else "rel_hydpmp2"
        pressure = 3000.0 if running and not self.failed(pump) else 0.0
        return pressure * _BAR_PER_PSI if "hydraulic-unit" in self.otherwise else pressure

    def pause(self, paused: bool) -> None:
        """Stops or continues simulated time."""
        self.clocks.paused = paused

    def watch_surface(self, name: str) -> None:
        """See `ControlInputs.watch_surface`."""
        self.inputs.watch_surface(name)

    def move_throttles(self, step: float) -> None:
        """Moves all levers by `step`, within 0..1."""
        slots = self.store.dataref("sim/cockpit2/engine/actuators/throttle_ratio").slots
        slots = slots[: self.model.info.engine_count]
        self.store.values[slots] = np.clip(self.store.values[slots] + step, 0.0, 1.0)

    def start_engine(self, engine: int) -> None:
        """Starts one engine, at once, with its key turned."""
        self.turn_key(engine, True)
        self.model.set_engine_running(engine, True)

    def start_engines(self) -> None:
        """Starts all engines."""
        for engine in range(self.model.info.engine_count):
            self.start_engine(engine)

    def turn_key(self, engine: int, on: bool) -> None:
        """Turns an engine's ignition key to both magnetos, or off."""
        self.inputs.turn_key(engine, on)

    # --- flights, aircraft, situations --------------------------------------------------------------------------------

    def start_flight(self, initial: InitialState, trimmed: bool = True) -> None:
        """Begins a flight: levers and trims as the flight needs them, the origin where the aircraft is.

        Args:
            initial: How it begins.
            trimmed: Whether it is a steady one; else its speed is that of `initial`, all else as of a usual one.

        Raises:
            FlightModelError: There is no such flight; the present one goes on.
        """
        present = self.model.save() if self.flying and is_sane(self.model.state) else None
        try:
            controls = self.model.reset(initial if trimmed else replace(initial, airspeed_mps=None))
            if not trimmed:
                Placements.set_speed(self.model, initial)
        except (ArithmeticError, ValueError):  # a FlightModelError too
            if present is not None:
                self.model.restore(present)
            raise
        self._begin(controls, initial.engines_running)

    def restart_flight(self) -> None:
        """Begins the most recent flight again."""
        self._starts.again()

    def _terrain_m(self) -> float:
        return self.model.state.terrain_elevation_m if self.flying else self.home.terrain_elevation_m

    def _begin(self, controls: Controls, powered: bool) -> None:
        """A flight begins where the model has been put."""
        self.controls = controls
        self.loads += 1
        self.inputs.start(self.controls, self.model)
        self.frozen, self.flying = False, True
        self._autopilot.switch_off()
        self._servos.rest()
        self.clocks.flight = 0.0
        self.instruments, self.copilot_instruments = Instruments(), Instruments(COPILOT)
        self.electrics = Electrics()
        set_first(self.store, _ELECTRICAL + "battery_on", float(powered), 1)  # there is one
        set_first(self.store, _ELECTRICAL + "generator_on", float(powered), self.model.info.engine_count)
        self.store.set(_ELECTRICAL + "inverter_on", float(powered))
        self.store.set("sim/cockpit2/switches/avionics_power_on", float(powered))
        self._effects.start()
        self._placements.clear()  # nothing of where the aircraft was counts
        self.frame.start(self.model.state)
        self.frame.update(self.model.state, self._altimeter_inhg() * INHG_PA)
        self._update_instruments()
        self.electrics.update(0.0, self.store, self.frame, self.failed)
        self._publish_surfaces()

    def load_aircraft(self, name: str) -> None:
        """Loads another aircraft where the present one is, or before the first flight.

        Raises:
            FlightModelError: There is none of that name, or none that flies there; the present one flies on.
        """
        model, before = self._new_aircraft(name), self.model.state
        if not self.flying:
            self._take_aircraft(name, model)
            return
        low = before.altitude_m - before.terrain_elevation_m < Placements.GROUND_HEIGHT_M
        start = InitialState(
            latitude_deg=before.latitude_deg,
            longitude_deg=before.longitude_deg,
            heading_deg=math.degrees(before.heading_rad),
            on_ground=before.on_ground_any or low,
            altitude_m=before.altitude_m,
            terrain_elevation_m=before.terrain_elevation_m,
        )
        controls = model.reset(start)
        self._take_aircraft(name, model)
        self._starts.last = start
        self._begin(controls, start.engines_running)

    def _new_aircraft(self, name: str) -> FlightModel:
        """An aircraft that can be taken, in the weather of now."""
        model = self._make_model(name)
        self._surface_slots_of(model)
        self.settings.weather.apply(model)
        return model

    def _take_aircraft(self, name: str, model: FlightModel) -> None:
        self.model, self.aircraft, self.frame.info = model, name, model.info
        self.inputs.release_data()
        self._bind_aircraft()

    def save_situation(self, path: str) -> None:
        """Keeps the whole flight under a name."""
        self._situations[path] = (self.aircraft, self.model.save(), self.inputs.save())

    def load_situation(self, path: str) -> bool:
        """Returns whether there is a situation of that name."""
        if path not in self._situations:
            return False
        aircraft, situation, levers = self._situations[path]
        model = self.model if aircraft == self.aircraft else self._new_aircraft(aircraft)
        model.restore(situation)
        self.settings.weather.apply(model)  # as clients read it, who may have changed it since
        if model is not self.model:
            self._take_aircraft(aircraft, model)
        self._begin(model.trim_controls, powered=True)
        self.inputs.restore(levers)
        return True

    def _bind_aircraft(self) -> None:
        """Gives the datarefs the loaded aircraft's surfaces, names and loading."""
        info = self.model.info
        self.store.values[self._surface_slots] = 0.0  # of the aircraft before
        self.table.clear_arrays()
        self.cameras.take_seat(info)
        self._surface_names = [spec.name for spec in self.model.surfaces]
        self._surface_slots = self._surface_slots_of(self.model)
        bound = dict(zip(self._surface_names, map(int, self._surface_slots)))
        old = {self.store.locate(path): name for path, name in old_names(self.model.surfaces).items()}
        self.inputs.bind_surfaces(bound, {slot: bound[name] for slot, name in old.items()})
        self._surface_names += old.values()
        self._surface_slots = np.array([*self._surface_slots, *old], dtype=int)
        self.store.set_text(_IDENTITY + "acf_ICAO", info.icao)
        self.store.set_text(_IDENTITY + "acf_descrip", info.description)
        self.store.set_text(_IDENTITY + "acf_ui_name", info.description)
        self.store.set_text(_IDENTITY + "acf_author", "xplane_bridge")
        self.store.set_text(_IDENTITY + "acf_tailnum", "N0XPB")
        self.store.set_text(_IDENTITY + "acf_relative_path", aircraft_path(info.name))
        self._commands = commands.commands(self)

    def _surface_slots_of(self, model: FlightModel) -> np.ndarray:
        paths = [surface_dataref(spec) for spec in model.surfaces]
        slots = [self.store.slot(path) for path in paths]
        missing = [path for path, slot in zip(paths, slots) if slot is None]
        if missing:
            raise FlightModelError(
                f"aircraft {model.info.name}: X-Plane has no datarefs {', '.join(missing)} for its surfaces"
            )
        return np.array(slots, dtype=int)

    # --- requests -----------------------------------------------------------------------------------------------------

    def on_dref(self, request: protocol.DrefWrite) -> Optional[str]:
        """DREF: writes a dataref; errors are silent."""
        try:
            return None if self.store.write(request.path, request.value) else "dataref"
        except FlightModelError as error:  # a loading or weather that the aircraft cannot have
            _LOG.info("DREF %s %g: %s", request.path, request.value, error)
            return "value"

    def on_data(self, request: protocol.DataPacket) -> Optional[str]:
        """DATA: rows that control something take hold of it."""
        for row, slots in request.rows:
            self.inputs.take_row(row, slots)
        return None

    def on_command(self, request: protocol.CommandRequest) -> Optional[str]:
        """CMND."""
        action = self._commands.get(request.path)
        if action is None:
            return "command"
        action()
        return None

    def on_placement(self, request: protocol.Placement) -> Optional[str]:
        """PREL: a new flight."""
        if request.aircraft != 0:
            return "aircraft"
        if "prel" in self.otherwise:
            return "otherwise"
        return self._starts.place(request)

    def on_aircraft(self, request: protocol.AircraftLoad) -> Optional[str]:
        """ACFN: loads the aircraft named by the path; other aircraft than the user's are ignored."""
        if request.aircraft != 0:
            return "aircraft"
        name = request.path.replace("\\", "/").rsplit("/", 1)[-1]
        name = name[:-4] if name.endswith(".acf") else name
        try:
            self.load_aircraft(name)
        except FlightModelError as error:
            _LOG.info("ACFN %s: %s", request.path, error)
            return "aircraft"
        return None

    def on_situation(self, request: protocol.Situation) -> Optional[str]:
        """SIMO: situations live in memory, by path; movies are not supported."""
        if request.action == protocol.Situation.SAVE:
            if not self.flying:
                return "situation"
            self.save_situation(request.path)
            return None
        if request.action == protocol.Situation.LOAD:
            return None if self.load_situation(request.path) else "situation"
        return "movie"

    def on_vehicle(self, request: protocol.VehiclePose) -> Optional[str]:
        """VEHX holds the aircraft at the pose without a flight model; VEHS (X-Plane 12) puts it there once."""
        if request.label == "VEHS" and (not self.is_12 or "vehs" in self.otherwise):
            return "version"
        if request.aircraft != 0:
            return None if self.traffic.place(request) else "aircraft"
        if not Placements.place_vehicle(self.model, request):
            return "value"
        self.frozen = self.frozen or request.label == "VEHX"
        return None

    def on_rows(self, request: protocol.RowSelection) -> Optional[str]:
        """DSEL, USEL (network), DCOC, UCOC (cockpit display): the numbers are the rows' indices."""
        name = "data_to_internet" if request.label in ("DSEL", "USEL") else "data_to_screen"
        slots = self.store.dataref("sim/network/dataout/" + name).slots
        for row in request.rows:
            if 0 <= row < protocol.ROW_COUNT:
                self.store.values[slots[row]] = float(request.label in ("DSEL", "DCOC"))
        return None

    # --- what goes out ------------------------------------------------------------------------------------------------

    def selected_rows(self) -> np.ndarray:
        """Indices of the rows selected for the network, ascending."""
        selected = self.store.array("sim/network/dataout/data_to_internet")[: protocol.ROW_COUNT]
        return np.flatnonzero(selected)

    @property
    def data_rate(self) -> int:
        """DATA datagrams a second."""
        return int(self.store.get("sim/network/dataout/network_data_rate"))

    def position(self) -> protocol.RposResponse:
        """What RPOS says now."""
        return rpos.response(self.frame, "rpos-axes" not in self.otherwise) if self.flying else rpos.NOWHERE


def aircraft_path(name: str) -> str:
    """`acf_relative_path` of an emulated aircraft, and what ACFN takes."""
    return f"Aircraft/xplane_bridge/{name}/{name}.acf"
