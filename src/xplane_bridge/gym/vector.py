"""Many environments at once: worker processes of some environments each, numbers in shared memory.

A worker is sent one byte per step and sends one message back, empty but for what cannot be a number in an array: the
infos of environments whose episode begins or ends. The calling process is a worker too: it would only wait for the
others, and to be woken costs as much as half a step. Hence who waits for a message first looks for it a while.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import select
import time
from multiprocessing.connection import Connection
from typing import Any, Callable, Dict, Iterator, List, Mapping, NamedTuple, NoReturn, Optional, Sequence, Tuple, Union

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from xplane_bridge.emulator.flight.flight_model import FlightModelError
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.gym.env import RENDERED, FlyEnv, Observation
from xplane_bridge.gym.errors import GymError

_STEP, _RESET, _RENDER, _CLOSE = b"s", b"r", b"p", b"c"
#: How long a worker may take to end by itself [s]: over the nodes it ends those and a ROS master.
_PATIENCE_S = 20.0
#: How long a message is looked for before the process sleeps until it comes [s].
_LOOK_S = 100e-6
#: What options of a reset are refused with; the environments can be reset again.
_REFUSALS = (XplaneBridgeError, FlightModelError)

_Infos = Dict[int, Dict[str, Any]]


class WorkerError(GymError):
    """A worker process has ended, or its environment raised an error."""


class _Inbox:
    """Messages of a connection.

    Args:
        connection: Theirs.
        looks: Whether to look for them a while: only where each process has a processor for itself.
    """

    def __init__(self, connection: Connection, looks: bool) -> None:
        self._connection, self._look_s = connection, _LOOK_S if looks else 0.0
        self._ready = select.poll()
        self._ready.register(connection.fileno(), select.POLLIN)

    def receive(self) -> bytes:
        """Waits for the next message.

        Raises:
            EOFError, OSError: The other end is gone.
        """
        end = time.perf_counter() + self._look_s
        while time.perf_counter() < end and not self._ready.poll(0):
            pass
        return self._connection.recv_bytes()


class _Layout(NamedTuple):
    """What lies in shared memory, one row an environment: name to dtype and shape of a row."""

    columns: Dict[str, Tuple[str, Tuple[int, ...]]]

    def allocate(self, context: Any, count: int) -> Dict[str, Any]:
        return {
            name: context.RawArray("b", max(1, count * int(np.prod(shape)) * np.dtype(kind).itemsize))
            for name, (kind, shape) in self.columns.items()
        }

    def arrays(self, memory: Mapping[str, Any], count: int) -> Dict[str, np.ndarray]:
        return {
            name: np.frombuffer(memory[name], kind, count * int(np.prod(shape))).reshape(count, *shape)
            for name, (kind, shape) in self.columns.items()
        }


def _layout(observation: spaces.Space[Any], action: Any, renders: bool) -> _Layout:
    parts: Mapping[str, Any] = observation.spaces if isinstance(observation, spaces.Dict) else {"": observation}
    columns = {f"observation {name}": (part.dtype.str, part.shape) for name, part in parts.items()}
    columns.update(action=(action.dtype.str, action.shape), reward=("<f8", ()), sim_time=("<f8", ()))
    columns.update(terminated=("|b1", ()), truncated=("|b1", ()))
    if renders:
        columns["picture"] = ("|u1", (RENDERED[1], RENDERED[0], 3))
    return _Layout(columns)


class _Worker:
    """The environments of one process."""

    def __init__(self, arguments: Mapping[str, Any], rows: slice, arrays: Mapping[str, np.ndarray]) -> None:
        self._arrays = {name: array[rows] for name, array in arrays.items()}
        self._first = rows.start
        self._envs = [FlyEnv(**arguments) for _ in range(rows.stop - rows.start)]
        self._ended = [False] * len(self._envs)
        self._parts = [name[len("observation ") :] for name in arrays if name.startswith("observation ")]

    def reset(self, seeds: Sequence[Optional[int]], options: Any) -> Union[_Infos, Exception]:
        """Infos, or why the options are refused."""
        self._arrays["terminated"][:] = self._arrays["truncated"][:] = False
        try:
            return {self._first + i: self._begin(i, seed, options) for i, seed in enumerate(seeds)}
        except _REFUSALS as error:
            return error

    def step(self) -> _Infos:
        arrays, infos = self._arrays, {}
        for i, env in enumerate(self._envs):
            if self._ended[i]:
                infos[self._first + i] = self._begin(i)
                arrays["reward"][i], arrays["terminated"][i], arrays["truncated"][i] = 0.0, False, False
                continue
            observed, reward, terminated, truncated, info = env.step(arrays["action"][i])
            self._show(i, observed, info.pop("sim_time"))
            arrays["reward"][i], arrays["terminated"][i], arrays["truncated"][i] = reward, terminated, truncated
            self._ended[i] = terminated or truncated
            if info:
                infos[self._first + i] = info
        return infos

    def render(self) -> _Infos:
        for i, env in enumerate(self._envs):
            self._arrays["picture"][i] = env.render()
        return {}

    def close(self) -> None:
        for env in self._envs:
            env.close()

    def _begin(self, i: int, seed: Optional[int] = None, options: Any = None) -> Dict[str, Any]:
        observed, info = self._envs[i].reset(seed=seed, options=options)
        self._show(i, observed, info.pop("sim_time"))
        self._ended[i] = False
        return info

    def _show(self, i: int, observed: Observation, sim_time: float) -> None:
        for part in self._parts:
            self._arrays[f"observation {part}"][i] = observed[part] if part else observed
        self._arrays["sim_time"][i] = sim_time


def _work(
    connection: Connection,
    others: Sequence[Connection],
    layout: _Layout,
    memory: Mapping[str, Any],
    count: int,
    rows: slice,
    looks: bool,
    arguments: Dict[str, Any],
) -> None:
    """What a worker process does until a message ends it or its parent is gone.

    `others` are the parent's ends of pipes: held open here, they would hide that the parent is gone.
    """
    for other in others:
        other.close()
    inbox = _Inbox(connection, looks)
    worker = None
    try:
        worker = _Worker(arguments, rows, layout.arrays(memory, count))
        while True:
            order = inbox.receive()
            if order[:1] == _CLOSE:
                break
            if order[:1] == _RESET:
                answer = worker.reset(*pickle.loads(order[1:]))
            else:
                answer = worker.step() if order == _STEP else worker.render()
            connection.send_bytes(pickle.dumps(answer) if answer else b"")
    except (EOFError, KeyboardInterrupt):
        pass
    except Exception as error:
        connection.send_bytes(pickle.dumps(f"{type(error).__name__}: {error}"))
    finally:
        if worker is not None:
            worker.close()


def _seeds(seed: Union[int, Sequence[Optional[int]], None], count: int) -> List[Optional[int]]:
    """One of each environment, as `FlyEnv.reset` takes it: what that would refuse is refused before any is reset."""
    if seed is None or isinstance(seed, (int, np.integer)):
        seeds = [None if seed is None else int(seed) + i for i in range(count)]
    else:
        seeds = list(seed)
    if len(seeds) != count:
        raise GymError(f"seed: {len(seeds)} of them; expected one number, or {count}")
    for each in seeds:
        if each is not None and not (isinstance(each, (int, np.integer)) and each >= 0):
            raise GymError(f"seed: {each!r}; expected whole numbers from 0, or None")
    return [None if each is None else int(each) for each in seeds]


class FlyVectorEnv(VectorEnv[Any, Any, Any]):
    """`num_envs` of `FlyEnv`, with the observations that they have alone with the seeds `seed + index`.

    An episode that has ended begins anew with the next step, whose action is not flown (gymnasium's NEXT_STEP).
    What interrupts a call that waits for workers, Ctrl-C for one, closes the environments.

    Args:
        num_envs: How many.
        workers: Processes that fly, this one among them; None: one for each processor.
        context: How processes are started: "fork", "spawn", "forkserver"; None: as Python does.
        arguments: Of `FlyEnv`; a task must be one that the processes can import.

    Raises:
        GymError, CampaignError: Something of this makes no sense.
        WorkerError: A worker could not be started, or has ended.
    """

    def __init__(
        self, num_envs: int = 1, workers: Optional[int] = None, context: Optional[str] = None, **arguments: Any
    ) -> None:
        self.closed = True  # until there is something to close
        self._flying = False
        if num_envs < 1 or (workers is not None and workers < 1):
            raise GymError(f"num_envs: {num_envs!r}, workers: {workers!r}; expected 1 or more")
        model = FlyEnv(**arguments)  # raises what is wrong before a process is started
        self.num_envs, self.render_mode = num_envs, model.render_mode
        self.single_observation_space, self.single_action_space = model.observation_space, model.action_space
        self.observation_space = batch_space(model.observation_space, num_envs)
        self.action_space = batch_space(model.action_space, num_envs)
        self.metadata = {**model.metadata, "autoreset_mode": AutoresetMode.NEXT_STEP}
        self._commander = model.commander
        model.close()
        layout = _layout(model.observation_space, model.action_space, self.render_mode is not None)
        processes: Any = multiprocessing.get_context(context)
        memory = layout.allocate(processes, num_envs)
        self._arrays = layout.arrays(memory, num_envs)
        self._connections: List[Connection] = []
        self._inboxes: List[_Inbox] = []
        self._processes: List[Any] = []
        self.closed = False
        bounds = np.linspace(0, num_envs, min(workers or os.cpu_count() or 1, num_envs) + 1).astype(int).tolist()
        self._rows = list(zip(bounds, bounds[1:]))
        looks = len(self._rows) <= (os.cpu_count() or 1)
        for first, end in self._rows[:-1]:
            ours, theirs = processes.Pipe()
            self._connections.append(ours)
            self._inboxes.append(_Inbox(ours, looks))
            work = (theirs, list(self._connections), layout, memory, num_envs, slice(first, end), looks, arguments)
            process = processes.Process(target=_work, args=work, daemon=True)
            process.start()
            theirs.close()
            self._processes.append(process)
        self._own = _Worker(arguments, slice(*self._rows[-1]), self._arrays)

    def reset(
        self, *, seed: Union[int, Sequence[Optional[int]], None] = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[Observation, Dict[str, Any]]:
        """Begins an episode in each.

        Args:
            seed: Of the first, the next is that of the second and so on; or a list, one of each.
            options: As `FlyEnv.reset` has them, for all.

        Raises:
            GymError, CampaignError, FlightModelError: As `FlyEnv.reset`; the environments stay open and are to be reset
                again.
            WorkerError: A worker has ended; the environments are closed.
        """
        seeds = _seeds(seed, self.num_envs)
        options = None if options is None else dict(options)
        self._flying = False
        shares = [seeds[first:end] for first, end in self._rows]
        orders = [_RESET + pickle.dumps((share, options)) for share in shares[:-1]]
        infos = self._gather(self._call(orders, lambda: self._own.reset(shares[-1], options)))
        self._flying = True
        return self._observations(), infos

    def step(self, actions: Any) -> Tuple[Observation, np.ndarray, np.ndarray, np.ndarray, Dict[str, Any]]:
        """Flies on in all.

        Raises:
            GymError: There are no episodes, or one of these is no action: nothing was flown, the next step may follow.
            WorkerError: A worker has ended; the environments are closed.
        """
        given = np.asarray(actions, np.float32)
        self._check(given)
        arrays = self._arrays
        arrays["action"][:] = given
        infos = self._gather(self._call([_STEP] * len(self._connections), self._own.step))
        reward, terminated, truncated = (arrays[name].copy() for name in ("reward", "terminated", "truncated"))
        return self._observations(), reward, terminated, truncated, infos

    def render(self) -> Optional[Tuple[np.ndarray, ...]]:
        """The forward view of each, 640x480; None where no `render_mode` was asked for.

        Raises:
            GymError: There are no episodes.
            WorkerError: A worker has ended; the environments are closed.
        """
        if self.render_mode is None:
            return None
        self._check_flying("render")
        self._call([_RENDER] * len(self._connections), self._own.render)
        return tuple(self._arrays["picture"].copy())

    def close_extras(self, **_kwargs: Any) -> None:
        """Ends the workers; where this is interrupted, at once."""
        self.closed = True
        try:
            for connection in self._connections:
                with contextlib.suppress(OSError):  # it has ended
                    connection.send_bytes(_CLOSE)
            for process in self._processes:
                process.join(_PATIENCE_S)
        finally:
            for connection, process in zip(self._connections, self._processes):
                if process.is_alive():
                    process.terminate()
                    process.join()
                connection.close()
            self._own.close()

    def _observations(self) -> Observation:
        if isinstance(self.single_observation_space, spaces.Dict):
            return {name: self._arrays[f"observation {name}"].copy() for name in self.single_observation_space.spaces}
        return self._arrays["observation "].copy()

    def _check_flying(self, call: str) -> None:
        if not (self.closed or self._flying):
            raise GymError(f"{call}: no episodes are being flown; call reset first")

    def _check(self, actions: np.ndarray) -> None:
        """Refuses what an environment would refuse, before any of them flies."""
        self._check_flying("step")
        if actions.shape != self.action_space.shape:
            raise GymError(f"actions of shape {actions.shape}; expected {self.action_space.shape}")
        flown = ~(self._arrays["terminated"] | self._arrays["truncated"])  # the others begin anew
        for index in np.flatnonzero(flown & ~(np.abs(actions) <= 1.0).all(axis=1)):
            try:
                self._commander.command(actions[index])
            except GymError as error:
                raise GymError(f"environment {index}: {error}") from None

    def _call(
        self, orders: Sequence[bytes], own: Callable[[], Union[_Infos, Exception]]
    ) -> List[Union[_Infos, Exception]]:
        """Answers of all, of this process first, which flies its share while the workers fly theirs."""
        if self.closed:
            raise GymError("the environments are closed; make new ones")
        try:
            self._send(orders)
            return [self._answer_of(own), *self._receive()]
        except BaseException:
            # An answer that is left in its pipe would be taken for that of the next order.
            self.close()
            raise

    def _send(self, orders: Sequence[bytes]) -> None:
        for i, (connection, order) in enumerate(zip(self._connections, orders)):
            try:
                connection.send_bytes(order)
            except OSError:
                self._fail(i)

    @staticmethod
    def _answer_of(own: Callable[[], Union[_Infos, Exception]]) -> Union[_Infos, Exception]:
        try:
            return own()
        except Exception as error:
            raise WorkerError(f"{type(error).__name__}: {error}") from error

    def _receive(self) -> Iterator[Union[_Infos, Exception]]:
        for i, inbox in enumerate(self._inboxes):
            try:
                message = inbox.receive()
            except (EOFError, OSError):
                self._fail(i)
            answer = pickle.loads(message) if message else {}
            if isinstance(answer, str):
                raise WorkerError(answer)
            yield answer

    def _gather(self, answers: Sequence[Union[_Infos, Exception]]) -> Dict[str, Any]:
        """Infos of all as one; raises what one of them has refused."""
        infos: Dict[str, Any] = {}
        for answer in answers:
            if isinstance(answer, Exception):
                raise answer
            for index, info in answer.items():
                infos = self._add_info(infos, info, index)
        infos["sim_time"], infos["_sim_time"] = self._arrays["sim_time"].copy(), np.ones(self.num_envs, bool)
        return infos

    def _fail(self, i: int) -> NoReturn:
        """A worker is gone: says so, or what it has said last."""
        connection, process = self._connections[i], self._processes[i]
        process.join(_PATIENCE_S)
        reason = f"it has ended by itself, with exit code {process.exitcode} (negative: by that signal)"
        try:
            if connection.poll():
                reason = pickle.loads(connection.recv_bytes())
        except (EOFError, OSError):
            pass
        raise WorkerError(f"worker {i} of {len(self._processes)}: {reason}")
