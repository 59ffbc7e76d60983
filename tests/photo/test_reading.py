"""Angles read from synthetic photographs against those that were drawn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.photo.conftest import Picture
from tests.photo.rendering import TARGET, Optics, Scene, thesis_angles
from workbench.photo import FOOT_SIGMA_RAD, AsBent, find_board, read_photo

BAR_DEG = 0.3
Changed = Callable[[Callable[[Picture], Picture]], Path]
Taken = Callable[..., Path]


def off_deg(bent: AsBent, scene: Scene) -> np.ndarray:
    return np.degrees(bent.angles - scene.angles)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module")
def bent(photo: Path) -> AsBent:
    return read_photo(photo, TARGET, foot_aligned=True)


def test_all_angles_are_read_and_their_errors_told(bent: AsBent, scene: Scene) -> None:
    off, error = off_deg(bent, scene), bent.uncertainty
    assert error is not None
    assert rms(np.degrees(scene.angles - thesis_angles)) > 1.0  # there was something to find
    assert rms(off) < BAR_DEG
    assert 0.4 < rms(off / np.degrees(error)) < 2.0
    assert bent.foot_seen
    assert bent.source.startswith("photograph strip.jpg, SHA-256 ")


def test_the_camera_is_found_where_it_was(bent: AsBent, scene: Scene) -> None:
    columns, rows = scene.optics.size
    width, height = scene.board.size
    true = 1.12 * scene.optics.focal * max(height / columns, width / rows)
    assert bent.notes["camera_height_mm"] == pytest.approx(1000 * true, rel=0.1)
    assert bent.notes["scale"] == pytest.approx(true / (true - scene.width), abs=0.003)


@pytest.mark.parametrize("turns", [pytest.param(1, marks=pytest.mark.long), 2])
def test_a_turned_photograph_says_the_same(changed: Changed, bent: AsBent, turns: int) -> None:
    turned = read_photo(changed(lambda p: np.rot90(p, turns)), TARGET, foot_aligned=True)
    assert np.degrees(turned.angles) == pytest.approx(np.degrees(bent.angles), abs=0.1)


def test_without_the_foot_alpha_0_is_the_target_s(photo: Path, scene: Scene) -> None:
    loose = read_photo(photo, TARGET)
    assert loose.angles[0] == TARGET.angles[0]
    assert loose.uncertainty is not None
    assert loose.uncertainty[0] == pytest.approx(FOOT_SIGMA_RAD)
    assert not loose.foot_seen
    assert rms(off_deg(loose, scene)[1:]) < BAR_DEG


@pytest.mark.long
def test_a_strip_on_its_other_edge_is_recognised(taken: Taken, scene: Scene) -> None:
    other = read_photo(taken(mirrored=True, turn=-scene.turn), TARGET)
    assert other.notes["mirrored"] == 1
    assert rms(off_deg(other, scene)[1:]) < BAR_DEG


@pytest.mark.long
def test_a_strongly_bending_lens_is_straightened(taken: Taken, scene: Scene) -> None:
    optics = Optics(scene.optics.size, 1.8 * scene.optics.size[0], (-0.9, 0.3, 0.0, 0.0, 0.0))
    seen = read_photo(taken(optics=optics), TARGET, foot_aligned=True)
    assert rms(off_deg(seen, scene)) < BAR_DEG
    assert seen.notes["board_residual_mm"] < 0.1


@pytest.mark.long
def test_two_sheets_badly_joined_are_measured(taken: Taken, scene: Scene) -> None:
    path = taken(board=find_board("A4"), joint=(0.0012, 0.0007, np.radians(0.3)))
    seen = read_photo(path, TARGET, foot_aligned=True)
    assert rms(off_deg(seen, scene)) < BAR_DEG
    assert seen.notes["board_residual_mm"] < 0.15


@pytest.mark.long
def test_a_blue_tape_is_followed(taken: Taken, scene: Scene) -> None:
    path = taken(paint=(0.05, 0.12, 0.5), side=0.9)
    seen = read_photo(path, TARGET, foot_aligned=True, tape="blue")
    assert rms(off_deg(seen, scene)) < BAR_DEG


def test_a_print_stretched_one_way_is_put_right(photo: Path, bent: AsBent) -> None:
    stretched = read_photo(photo, TARGET, foot_aligned=True, printed=(1.005, 1.0))
    wide = np.degrees(stretched.angles - bent.angles)
    # a direction at 45 deg turns by half a 0.5 % stretch, 0.14 deg; and joints shift along the
    # strip by up to 0.25 % of its length, 1.5 mm, where it bends by up to 0.6 deg a mm
    assert 0.05 < np.abs(np.cumsum(wide)).max() < 1.1
