"""Failsafes of the shipped aircraft, judged by flying them."""

from __future__ import annotations

from registry import Context, Measure, benchmark

from support.failsafe_flights import SHIPPED, outcomes, table


@benchmark
def failsafes(_context: Context) -> list[Measure]:
    """Altitude lost in 30 s after the program that flew died, stepped; prints the table of docs/failsafes.md."""
    flown = list(outcomes())
    print(table(flown))
    return [
        Measure(f"{o.start.aircraft}, {o.start.phase}, {o.moment}", o.sunk_m, "m", o.start.room_m if o.lives else None)
        for o in flown
        if o.kind == SHIPPED
    ]
