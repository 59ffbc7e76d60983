"""Films of a run: every frame at its time, both robots in it, in a file that others can play."""

from __future__ import annotations

import builtins
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.report.conftest import make_comparison
from workbench.errors import InputError, WorkbenchError
from workbench.report import Comparison, Film, write_frames, write_video
from workbench.report.film import film
from workbench.report.film.caption import pace
from workbench.report.film.stage import FilmStage, PixelWindow

SMALL = Film(rate_hz=4, width=320, height=180)
SHOT = Film(rate_hz=1, width=640, height=360)


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    """A second of a hop, long enough to move."""
    return replace(make_comparison(), duration_s=1.0)


@contextmanager
def rendering() -> Iterator[None]:
    """Skip where no driver renders without a window."""
    try:
        yield
    except WorkbenchError as error:
        if "without a window" not in str(error):
            raise
        pytest.skip(f"no picture can be rendered here: {error}")


def quiet(text: str) -> None:
    """Tell nobody."""


def pictures(comparison: Comparison, how: Film) -> list[tuple[float, np.ndarray]]:
    with rendering(), film(comparison, how) as frames:
        return list(frames)
    raise AssertionError


def share(picture: np.ndarray, kind: str) -> float:
    """Return how much of a picture is orange, blue or the red of forces."""
    red, green, blue = np.moveaxis(picture.astype(float) / 255, -1, 0)
    seen = {
        "orange": (red - blue > 0.35) & (green - blue > 0.1),
        "blue": blue - red > 0.35,
        "force": (red - green > 0.35) & (red - blue > 0.15) & (blue > green),
    }
    return float(np.mean(seen[kind]))


def test_frames_are_evenly_spaced_from_rest_to_the_end(comparison: Comparison) -> None:
    times = Film(rate_hz=30).times(comparison)
    assert times[0] == -0.5
    assert times[-1] == pytest.approx(1.5 - 1 / 30)
    np.testing.assert_allclose(np.diff(times), 1 / 30)


def test_four_times_slower_has_four_times_as_many_frames(comparison: Comparison) -> None:
    normal, slow = Film(rate_hz=30), Film(slow=4, rate_hz=30)
    assert len(slow.times(comparison)) == 4 * len(normal.times(comparison))


def test_both_robots_move_in_the_pictures(comparison: Comparison) -> None:
    shown = pictures(replace(comparison, duration_s=8.0), SHOT)
    assert [time for time, _ in shown] == pytest.approx(np.arange(-0.5, 8.5))
    for kind, least in (("orange", 5e-4), ("blue", 5e-3)):
        places = []
        for _, picture in (shown[1], shown[-1]):
            assert share(picture, kind) > least
            columns = np.flatnonzero(_only(picture, kind).any(axis=0))
            places.append(np.median(columns))
        assert places[1] - places[0] > 20  # pixels, to the right: forward


def _only(picture: np.ndarray, kind: str) -> np.ndarray:
    """Return where the robots' colours are, without the legend below."""
    body = picture[: -picture.shape[0] // 8].astype(float) / 255
    red, _, blue = np.moveaxis(body, -1, 0)
    return red - blue > 0.35 if kind == "orange" else blue - red > 0.35


def test_forces_are_drawn_while_the_foot_stands_only(comparison: Comparison) -> None:
    standing, flying = (_alone(comparison, up) for up in (0.0, 0.02))
    assert share(standing, "force") > 2e-4
    assert share(flying, "force") == 0


def _alone(comparison: Comparison, up: float) -> np.ndarray:
    """Return the twin's picture where its foot is nearest to a height [m]."""
    twin = comparison.twin.between(0.0, 8.0)
    at = twin.times[int(np.argmin(np.abs(twin["foot_z_m"] - up)))]
    alone = replace(comparison, real=twin.between(100.0, 200.0), twin=twin.between(at, at + 0.1))
    shown = pictures(replace(alone, duration_s=8.0), replace(SHOT, rate_hz=1))[0][1]
    return shown[: -shown.shape[0] // 10]  # without the caption's names of the arrows


def test_all_of_the_robots_and_their_shadows_is_in_the_window_that_is_rendered(
    comparison: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The window lies where it belongs in the whole picture, and nothing lies outside."""
    run = replace(comparison, duration_s=8.0, estimate=comparison.twin)
    windows = pictures(run, SHOT)
    whole = PixelWindow(0, 0, SHOT.width, SHOT.height)
    monkeypatch.setattr(FilmStage, "_look_closer", lambda stage: whole)
    for (_, part), (_, full) in zip(windows, pictures(run, SHOT), strict=True):
        apart = np.abs(part.astype(int) - full).max(axis=2) > 24
        assert np.mean(apart) < 1e-4


def test_an_instant_at_which_nothing_was_seen_is_an_empty_floor(comparison: Comparison) -> None:
    times = np.array([0.5, 50.0])
    stage = FilmStage(comparison, times, SHOT.width, SHOT.height)
    assert stage.at(50.0).window[2:] == (1, 1)
    assert 100 < stage.at(0.5).window.width < SHOT.width


def test_the_caption_tells_time_pace_and_condition(comparison: Comparison) -> None:
    base = pictures(comparison, SHOT)[0][1]
    other = pictures(replace(comparison, label=("hop", "19 rad/s")), SHOT)[0][1]
    slow = pictures(comparison, replace(SHOT, slow=0.5))[0][1]
    height, width = base.shape[:2]
    left, right = np.s_[: height // 5, : width // 2], np.s_[: height // 5, width // 2 :]
    assert (base[left] != other[left]).any()
    assert (base[right] == other[right]).all()
    assert (base[right] != slow[right]).any()
    assert (base[left] == slow[left]).all()


def test_the_pace_is_told_in_words() -> None:
    assert [pace(slow) for slow in (4, 1, 0.5)] == ["1/4 speed", "", "2 times faster"]


def test_a_film_plays_at_its_rate_for_its_time(comparison: Comparison, tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    told: list[str] = []
    path = tmp_path / "hop.mp4"
    with rendering():
        write_video(comparison, path, SMALL, told.append)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.width, stream.codec_context.height) == (320, 180)
        assert float(stream.average_rate) == SMALL.rate_hz
        shown = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(shown) == len(SMALL.times(comparison)) == 8
    assert told == [f"frame {k} of 8" for k in range(1, 9)]
    assert share(shown[-1], "blue") > 1e-3
    assert [file.name for file in tmp_path.iterdir()] == ["hop.mp4"]


def test_frames_are_numbered_pictures(comparison: Comparison, tmp_path: Path) -> None:
    with rendering():
        write_frames(comparison, tmp_path / "frames", SMALL, quiet)
    files = sorted(file.name for file in (tmp_path / "frames").iterdir())
    assert files == [f"frame_{k:05d}.png" for k in range(8)]
    with Image.open(tmp_path / "frames" / files[0]) as first:
        assert first.size == (320, 180)
    with pytest.raises(InputError, match="holds something already"):
        write_frames(comparison, tmp_path / "frames", SMALL, quiet)


def test_a_failed_film_leaves_nothing_behind(comparison: Comparison, tmp_path: Path) -> None:
    pytest.importorskip("av")

    def fail(text: str) -> None:
        raise KeyboardInterrupt

    with rendering(), pytest.raises(KeyboardInterrupt):
        write_video(comparison, tmp_path / "hop.mp4", SMALL, fail)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("slow", [0.0, -1.0, 1000.0, float("nan")])
def test_a_pace_that_makes_no_sense_is_refused(comparison: Comparison, slow: float) -> None:
    with pytest.raises(InputError, match=r"times slower than life cannot be made; 0\.1 to 100"):
        Film(slow=slow).times(comparison)


def test_a_run_of_which_nothing_moved_is_refused(comparison: Comparison) -> None:
    nothing = comparison.twin.between(100.0, 200.0)
    with pytest.raises(InputError, match="no motion is kept of this run, nothing to film"):
        SMALL.times(replace(comparison, real=nothing, twin=nothing))


def test_another_kind_of_file_is_refused(comparison: Comparison, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"hop\.gif: a film is written as \.mp4"):
        write_video(comparison, tmp_path / "hop.gif", SMALL, quiet)


def test_without_the_extra_it_says_what_to_install(
    comparison: Comparison, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = builtins.__import__

    def missing(name: str, *rest: Any) -> Any:
        if name == "av":
            raise ImportError(name)
        return there(name, *rest)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(InputError, match=r"pip install hopping-workbench\[video\]; --frames"):
        write_video(comparison, tmp_path / "hop.mp4", SMALL, quiet)


def test_without_a_driver_it_says_what_to_install(
    comparison: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*size: int) -> None:
        raise RuntimeError("no EGL display")

    class Nothing:
        GLContext = staticmethod(none)

    monkeypatch.setattr(
        "workbench.report.film.offscreen.importlib.import_module", lambda name: Nothing
    )
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    with (
        pytest.raises(WorkbenchError, match=r"without a window; .*Tried: mujoco\..*no EGL display"),
        film(comparison, SMALL),
    ):
        pass
