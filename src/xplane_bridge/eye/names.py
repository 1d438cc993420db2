"""The datarefs of the eye."""

from __future__ import annotations

RUNNING_TIME = "sim/time/total_running_time_sec"
#: Horizontal, [deg]; written while the delay is measured, and given back.
FIELD_OF_VIEW = "sim/graphics/view/field_of_view_deg"

#: Whether X-Plane prints row 1 of the Data Output table, its times, into the picture; written by --verify,
#: and given back.
TIMES_ON_SCREEN = "sim/network/dataout/data_to_screen[1]"

#: What is asked for, every frame and in one datagram.
SUBSCRIBED = (RUNNING_TIME, FIELD_OF_VIEW, TIMES_ON_SCREEN)
