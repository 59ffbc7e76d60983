"""The pictures of a run, one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.film.caption import Caption
from workbench.film.offscreen import Offscreen
from workbench.film.stage import Stage
from workbench.review import Comparison

__all__ = ["Film", "film"]

_BEFORE_S = 0.5  # of rest that is shown
_AFTER_S = 0.5
_LEAST_SLOW, _MOST_SLOW = 0.1, 100.0


@dataclass(frozen=True)
class Film:
    """How a run is filmed.

    Args:
        slow: how many times slower than life.
        rate_hz: frames a second, as shown.
        width: of a frame [px], even.
        height: of a frame [px], even.
    """

    slow: float = 1.0
    rate_hz: int = 30
    width: int = 1280
    height: int = 720

    def times(self, comparison: Comparison) -> NDArray[np.float64]:
        """Return when in the run each frame is [s], from a little before time zero to its end.

        Raises:
            InputError: when the film cannot be this slow, or nothing of the run moves.
        """
        if not _LEAST_SLOW <= self.slow <= _MOST_SLOW:
            raise InputError(
                f"a film {self.slow:g} times slower than life cannot be made; "
                f"{_LEAST_SLOW:g} to {_MOST_SLOW:g} are allowed"
            )
        moving = [motion.times for motion in comparison.motions if len(motion)]
        if not moving:
            raise InputError(f"{comparison.run}: no motion is kept of this run, nothing to film")
        begin = max(-_BEFORE_S, min(float(times[0]) for times in moving))
        end = min(comparison.duration_s + _AFTER_S, max(float(times[-1]) for times in moving))
        return np.arange(begin, end, 1 / (self.rate_hz * self.slow))


@contextmanager
def film(comparison: Comparison, how: Film) -> Iterator[Iterator[tuple[float, NDArray[np.uint8]]]]:
    """Give the frames of a run, each with its time [s], as long as the `with` block lasts.

    Raises:
        InputError: as `Film.times`.
        WorkbenchError: when nothing renders here without a window.
    """
    times = how.times(comparison)
    stage = Stage(comparison, how.width, how.height)
    caption = Caption(comparison, how.slow, how.height)
    with Offscreen(stage.model, how.width, how.height) as screen:
        yield (
            (float(time), caption.on(screen.render(stage.at(time)), float(time))) for time in times
        )
