"""What is done again on a busy machine."""

from __future__ import annotations

from typing import Callable, TypeVar

T = TypeVar("T")


def again_until(fits: Callable[[T], bool], do: Callable[[], T], attempts: int = 4) -> T:
    """Does something until its result fits, for programs that give up after some seconds: others may not have come to
    run in these.

    Args:
        fits: Whether a result is what is expected.
        do: Gives one.
        attempts: How often at most.

    Returns:
        The last result, for the caller to judge.
    """
    result = do()
    for _ in range(attempts - 1):
        if fits(result):
            break
        result = do()
    return result
