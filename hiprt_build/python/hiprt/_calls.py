"""What calls of the compiled part have in common."""

from __future__ import annotations

from typing import Any, Callable

from ._errors import InputError

Progress = Callable[[int, int], Any]
"""progress(done, total), called every 50 ms on the calling thread. Returning False cancels."""


def checked_threads(threads: int) -> int:
    if not 0 <= threads < 1 << 31:
        raise InputError(f"threads: {threads} is not between 0 and 2^31 - 1")
    return int(threads)
