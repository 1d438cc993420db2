"""The datarefs of the eye."""

from __future__ import annotations

RUNNING_TIME = "sim/time/total_running_time_sec"
#: Horizontal, [deg]; the only one that the eye writes, and gives back.
FIELD_OF_VIEW = "sim/graphics/view/field_of_view_deg"

#: What is asked for, every frame and in one datagram.
SUBSCRIBED = (RUNNING_TIME, FIELD_OF_VIEW)
