"""The questions, by subject, in the order of the card."""

from __future__ import annotations

from typing import Tuple

from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.questions import (
    airflow,
    attitude,
    controls,
    pausing,
    placing,
    rows,
    systems,
    views,
    wire,
)

#: What needs no flight first; what may leave traces (failures, other views, new flights) last.
CARD: Tuple[Question, ...] = (
    *wire.QUESTIONS,
    *systems.QUESTIONS_ON_GROUND,
    *placing.QUESTIONS,
    *attitude.QUESTIONS,
    *rows.QUESTIONS,
    *airflow.QUESTIONS,
    *pausing.QUESTIONS,
    *systems.QUESTIONS,
    *views.QUESTIONS,
    *controls.QUESTIONS,
)
