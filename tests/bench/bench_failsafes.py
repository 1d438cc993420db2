"""Failsafes of the shipped aircraft, judged by flying them."""

from __future__ import annotations

from registry import Context, Measure, benchmark

from support.flights.failsafe_flights import KINDS, MOMENTS, SHIPPED, STARTS, fly, table

#: [s] of --seconds, the default, from which the program dies in every one of the moments.
_ALL_FROM_S = 20.0


@benchmark
def failsafes(context: Context) -> list[Measure]:
    """Altitude lost in 30 s after the program that flew died, stepped; prints the table of docs/control/failsafes.md.

    With less than 20 s it flies less often, a third of the flights at least: the budgets are for flights of 30 s.
    """
    count = max(1, round(len(MOMENTS) * context.seconds / _ALL_FROM_S))
    moments = list(MOMENTS)[:count]
    flown = [fly(start, moment, kind) for start in STARTS for moment in moments for kind in KINDS]
    print(table(flown))
    return [
        Measure(f"{o.start.aircraft}, {o.start.phase}, {o.moment}", o.sunk_m, "m", o.start.room_m if o.lives else None)
        for o in flown
        if o.kind == SHIPPED
    ]
