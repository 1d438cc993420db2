"""A grabber's problems, all of them: one may last for less time than a test takes to look."""

from __future__ import annotations

from typing import List


class KeptProblems:
    """To be named before the grabber among the bases of a test's own.

    Attributes:
        problems: All that `problem` was, the newest last.
    """

    problems: List[str]

    @property
    def problem(self) -> str:
        return self.problems[-1]

    @problem.setter
    def problem(self, text: str) -> None:
        self.__dict__.setdefault("problems", []).append(text)
