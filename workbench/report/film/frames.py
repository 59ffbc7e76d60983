"""The pictures of a run, one after the other."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import cycle
from typing import Self

import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.report.comparison import Comparison
from workbench.report.film.caption import Caption
from workbench.report.film.offscreen import Offscreen
from workbench.report.film.stage import FilmStage

__all__ = ["Film", "film"]

_BEFORE_S = 0.5  # of rest that is shown
_AFTER_S = 0.5
_AHEAD = 2  # pictures that a camera has begun before they are asked for
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
        """Return when in the run each frame is, (n,) [s], from a little before zero to its end.

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

    Yields:
        An iterator over time [s] and picture, (height, width, 3) in RGB.

    Raises:
        InputError: as `Film.times`.
        WorkbenchError: when nothing renders here without a window.
    """
    times = how.times(comparison)
    caption = Caption(comparison, how.slow, how.height)
    with ExitStack() as stack:
        cameras = [_Camera(comparison, how, times) for _ in range(_cameras())]
        for camera in cameras:
            stack.enter_context(camera)
        pictures = _taken(cameras, times.tolist())
        yield ((time, caption.on(picture, time)) for time, picture in pictures)


def _cameras() -> int:
    """Return how many cameras film at once: one a core where any thread may render."""
    return (os.cpu_count() or 1) if sys.platform == "linux" else 1


def _taken(
    cameras: Sequence[_Camera], times: Sequence[float]
) -> Iterator[tuple[float, NDArray[np.uint8]]]:
    """Yield each time and its picture; each camera is a few pictures ahead."""
    begun: deque[tuple[float, Future[NDArray[np.uint8]]]] = deque()
    for time, camera in zip(times, cycle(cameras)):  # they take turns
        begun.append((time, camera.shoot(time)))
        if len(begun) > _AHEAD * len(cameras):
            time, picture = begun.popleft()
            yield time, picture.result()
    for time, picture in begun:
        yield time, picture.result()


class _Camera:
    """Films a run in a thread of its own, to which its graphics context belongs.

    What never changes is rendered once; of each frame only a window around the robots and their
    shadows, which takes less than half of the time in software.
    """

    def __init__(self, comparison: Comparison, how: Film, times: NDArray[np.float64]) -> None:
        self._filmed, self._size = (comparison, times), (how.width, how.height)
        self._thread = ThreadPoolExecutor(1)

    def __enter__(self) -> Self:
        try:
            self._thread.submit(self._open).result()
        except BaseException:
            self._thread.shutdown()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.submit(self._screen.__exit__, None, None, None).result()
        self._thread.shutdown()

    def shoot(self, time: float) -> Future[NDArray[np.uint8]]:
        """Begin the picture at a time [s]."""
        return self._thread.submit(self._picture, time)

    def _open(self) -> None:
        self._stage = FilmStage(*self._filmed, *self._size)
        self._screen = Offscreen(self._stage.model, *self._size).__enter__()
        self._empty = self._screen.render(self._stage.empty())

    def _picture(self, time: float) -> NDArray[np.uint8]:
        scene, (left, bottom, width, height) = self._stage.at(time)
        picture = self._empty.copy()
        top = len(picture) - bottom
        picture[top - height : top, left : left + width] = self._screen.render(
            scene, (width, height)
        )
        return picture
