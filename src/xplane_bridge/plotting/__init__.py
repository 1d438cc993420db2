"""Figures of recorded flights. What to show is decided once (`flight_figures`); `interactive` and `static` draw it."""
