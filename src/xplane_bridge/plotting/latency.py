"""Figure of measured delays: how well each delay explains the recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Mapping

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.analysis.latency import Delay


def save(results: Mapping[str, Delay], path: Path) -> None:
    """Write the figure; one panel a delay.

    Args:
        results: By name.
        path: File; its ending says the format.
    """
    made = Figure(figsize=(7, 2.4 * len(results)), layout="constrained")
    for axes, (name, result) in zip(made.subplots(len(results), 1, squeeze=False)[:, 0], results.items()):
        axes.semilogy(1e3 * result.searched, result.cost, color="tab:blue")
        axes.axvspan(1e3 * result.low, 1e3 * result.high, color="tab:orange", alpha=0.35, label="95 % interval")
        axes.axvline(1e3 * result.delay, color="tab:red", linewidth=1.0, label=f"{1e3 * result.delay:.1f} ms")
        axes.set_title(f"{name}   gain {result.gain:.2f}, correlation {result.correlation:.2f}", fontsize=10)
        axes.set_ylabel("cost over least (-)")
        axes.grid(alpha=0.3)
        axes.legend(loc="upper right", fontsize=8)
    axes.set_xlabel("delay (ms)")
    made.savefig(path, dpi=150)
