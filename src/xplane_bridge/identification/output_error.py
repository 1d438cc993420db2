"""Output error: the model is simulated from the inputs alone, and what the flight did otherwise is made least.

Exact discretisation for inputs that are straight between frames; frames may have any distance. Several windows share
A and B; each has an initial state and a bias of its own, so that none of them needs to begin in trim. Outputs are
weighted by the inverse of their residuals' variance, which is estimated with the model (maximum likelihood).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Sequence, Tuple

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

#: Phi, G0, G1 of `_step_maps`.
Maps = Tuple[np.ndarray, np.ndarray, np.ndarray]
#: Rounds of fit and weights, at most, and the change of the weights that ends them.
_ROUNDS, _SETTLED = 6, 0.02
_MOST_EVALUATIONS = 100
#: Residuals below this share of an output's movement are not weighted up further: the motion is not that linear.
_FLOOR = 1e-3
#: Times between frames that differ by less are equal [s]; a simulator's frames have a handful of lengths.
_TIME_GRAIN = 1e-5
#: Of the series of a step's exponential; a frame is short against every mode.
_TERMS = 16


@dataclass
class Samples:
    """One window: what the model is fitted to."""

    time: np.ndarray  #: [s], shape (n,)
    states: np.ndarray  #: shape (n, 4)
    inputs: np.ndarray  #: shape (n, m)


@dataclass
class Fit:
    """The model and how well it fits; arrays of windows in the order of the samples."""

    a: np.ndarray
    b: np.ndarray
    free: np.ndarray  #: row and column in [A B] of each parameter
    simulated: list[np.ndarray]
    residuals: list[np.ndarray]
    sensitivities: list[np.ndarray]  #: of each window, shape (n, 4, columns): the model's parameters, then its own
    variance: np.ndarray  #: of the residuals, by state
    cost: float  #: sum of weighted squares, by the weights of the fit
    converged: bool


def fit(samples: Sequence[Samples], a: np.ndarray, b: np.ndarray, free: Optional[np.ndarray] = None) -> Fit:
    """Fit A and B to the windows.

    Args:
        samples: The windows.
        a: Where to start, shape (4, 4).
        b: Likewise, shape (4, m).
        free: Which elements of A and B side by side are estimated; the others keep what they start with. None: all.
    """
    problem = _Problem(samples, np.hstack([a, b]), free)
    vector = problem.start()
    movement = np.concatenate([s.states - s.states.mean(axis=0) for s in samples]).var(axis=0)
    floor = np.maximum(_FLOOR**2 * movement, 1e-24)
    variance = np.maximum(problem.variance(vector), floor)
    for _ in range(_ROUNDS):
        problem.weights = 1.0 / np.sqrt(variance)
        result = problem.solve(vector)
        vector, before = result.x, variance
        variance = np.maximum(problem.variance(vector), floor)
        if np.all(np.abs(variance - before) < _SETTLED * before):
            break
    return problem.describe(vector, variance, bool(result.success), float(2.0 * result.cost))


def refit(samples: Sequence[Samples], found: Fit, free: Optional[np.ndarray] = None) -> list[np.ndarray]:
    """Fit other samples from a fit that is there, by its weights; gives their residuals."""
    problem = _Problem(samples, np.hstack([found.a, found.b]), free)
    problem.weights = 1.0 / np.sqrt(found.variance)
    runs = problem.simulated(problem.solve(problem.start()).x)
    return [s.states - run for s, run in zip(samples, runs)]


def simulate(samples: Samples, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Simulate a window with the initial state and the bias that fit it best: for validation."""
    problem = _Problem([samples], np.hstack([a, b]), None)
    return problem.simulated(problem.start())[0]


class _Problem:
    """Residuals and their derivatives for a vector of A and B, and initial state and bias of each window."""

    def __init__(self, samples: Sequence[Samples], system: np.ndarray, free: Optional[np.ndarray]) -> None:
        self._n = system.shape[0]
        self._system = system.copy()
        self._free = np.argwhere(np.ones(system.shape, dtype=bool) if free is None else free)
        self._count = len(self._free)
        self.weights = np.ones(self._n)
        self._samples = samples
        #: States and inputs about each window's beginning, so that no large number enters.
        self._x = [s.states - s.states[0] for s in samples]
        self._u = [s.inputs - s.inputs[0] for s in samples]
        self._steps = []
        for s in samples:
            steps = np.diff(s.time)
            which = np.unique(np.round(steps / _TIME_GRAIN), return_inverse=True)[1]
            lengths = np.bincount(which, weights=steps) / np.bincount(which)
            self._steps.append((lengths, which))

    def start(self) -> np.ndarray:
        """A and B as given, with the initial states and biases that suit them: the response is linear in those."""
        own = np.zeros(2 * self._n * len(self._samples))
        vector = np.concatenate([self._system[tuple(self._free.T)], own])
        simulated, slopes = self._run(vector)
        for k, (x, y, slope) in enumerate(zip(self._x, simulated, slopes)):
            columns = slope[:, :, self._count :].reshape(-1, 2 * self._n)
            scale = self.weights if np.any(self.weights != 1.0) else 1.0 / np.maximum(x.std(axis=0), 1e-12)
            rows = np.tile(scale, len(x))
            vector[self._own(k)] = np.linalg.lstsq(columns * rows[:, None], (x - y).ravel() * rows, rcond=None)[0]
        return vector

    def solve(self, vector: np.ndarray) -> OptimizeResult:
        """Make the weighted residuals least."""
        return least_squares(
            self.residuals, vector, self.jacobian, method="lm", x_scale="jac", max_nfev=_MOST_EVALUATIONS, ftol=1e-10
        )

    def variance(self, vector: np.ndarray) -> np.ndarray:
        """Of the residuals, by state."""
        simulated = self._run(vector, slopes=False)[0]
        squares: np.ndarray = np.concatenate([(x - y) ** 2 for x, y in zip(self._x, simulated)])
        return np.asarray(squares.mean(axis=0))

    def residuals(self, vector: np.ndarray) -> np.ndarray:
        simulated = self._run(vector, slopes=False)[0]
        return np.concatenate([((y - x) * self.weights).ravel() for x, y in zip(self._x, simulated)])

    def jacobian(self, vector: np.ndarray) -> np.ndarray:
        slopes = self._run(vector)[1]
        out = np.zeros((sum(x.size for x in self._x), len(vector)))
        row = 0
        for k, slope in enumerate(slopes):
            block = (slope * self.weights[:, None]).reshape(-1, slope.shape[2])
            rows = slice(row, row + len(block))
            out[rows, : self._count], out[rows, self._own(k)] = block[:, : self._count], block[:, self._count :]
            row += len(block)
        return out

    def simulated(self, vector: np.ndarray) -> list[np.ndarray]:
        """States as they were measured."""
        runs = self._run(vector, slopes=False)[0]
        return [y + s.states[0] for y, s in zip(runs, self._samples)]

    def describe(self, vector: np.ndarray, variance: np.ndarray, converged: bool, cost: float) -> Fit:
        runs, slopes = self._run(vector)
        system = self._with(vector)
        residuals = [x - y for x, y in zip(self._x, runs)]
        a, b = system[:, : self._n], system[:, self._n :]
        return Fit(a, b, self._free, self.simulated(vector), residuals, slopes, variance, cost, converged)

    def _own(self, window: int) -> slice:
        first = self._count + 2 * self._n * window
        return slice(first, first + 2 * self._n)

    def _with(self, vector: np.ndarray) -> np.ndarray:
        system = self._system.copy()
        system[tuple(self._free.T)] = vector[: self._count]
        return system

    def _run(self, vector: np.ndarray, slopes: bool = True) -> tuple[list[np.ndarray], list[np.ndarray]]:
        n, system = self._n, self._with(vector)
        states, derivatives = [], []
        for k, u in enumerate(self._u):
            lengths, which = self._steps[k]
            maps = _step_maps(system[:, :n], lengths)
            own = vector[self._own(k)]
            forcing = u @ system[:, n:].T + own[n:]
            x = _walk(maps, which, own[:n, None], forcing[:, :, None])[:, :, 0]
            states.append(x)
            if slopes:
                derivatives.append(self._slopes(maps, which, np.hstack([x, u])))
        return states, derivatives

    def _slopes(self, maps: Maps, which: np.ndarray, known: np.ndarray) -> np.ndarray:
        """A derivative of the states obeys the model too, driven by what its parameter multiplies."""
        n, size = self._n, self._count + 2 * self._n
        forcing = np.zeros((len(known), n, size))
        for column, (row, multiplied) in enumerate(self._free):
            forcing[:, row, column] = known[:, multiplied]
        initial = np.zeros((n, size))
        initial[:, self._count : self._count + n] = np.eye(n)
        forcing[:, :, self._count + n :] = np.eye(n)
        return _walk(maps, which, initial, forcing)


def _step_maps(a: np.ndarray, lengths: np.ndarray) -> Maps:
    """Maps over steps of these lengths, x' = Phi x + G0 f + G1 f', for forcing that goes straight from f to f'."""
    steps = lengths[:, None, None]
    power = np.broadcast_to(np.eye(a.shape[0]), (len(lengths), *a.shape))
    phi, once, twice = power.copy(), power * steps, power * steps / 2.0
    for k in range(1, _TERMS):
        power = power @ a * (steps / k)
        phi = phi + power
        once = once + power * (steps / (k + 1))
        twice = twice + power * (steps / ((k + 1) * (k + 2)))
    return phi, once - twice, twice


def _walk(maps: Maps, which: np.ndarray, initial: np.ndarray, forcing: np.ndarray) -> np.ndarray:
    """States at all frames, shape (n, 4, columns).

    In blocks of frames: first all of them at once, each from rest, then from one to the next. For Python, a step of one
    block takes as long as one of all.
    """
    phi, first, last = maps
    frames, (n, columns) = len(which), initial.shape
    length = math.isqrt(max(frames, 1) - 1) + 1
    blocks = -(-frames // length)
    kinds = np.zeros(blocks * length, dtype=int)
    pushes = np.zeros((blocks * length, n, columns))
    kinds[:frames] = which
    pushes[:frames] = first[which] @ forcing[:-1] + last[which] @ forcing[1:]
    through = phi[kinds].reshape(blocks, length, n, n)
    states = pushes.reshape(blocks, length, n, columns)
    for k in range(1, length):
        states[:, k] += through[:, k] @ states[:, k - 1]
        through[:, k] = through[:, k] @ through[:, k - 1]
    begin = np.empty((blocks, n, columns))
    x = initial
    for block in range(blocks):
        begin[block] = x
        x = through[block, -1] @ x + states[block, -1]
    states += (through.reshape(blocks, length * n, n) @ begin).reshape(states.shape)
    return np.concatenate([initial[np.newaxis], states.reshape(-1, n, columns)[:frames]])
