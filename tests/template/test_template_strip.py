"""What can be bent, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.schemas import Document, ShapeFile, load_model
from workbench.sim import make_robot, settle
from workbench.template import free_angles, make_strip

MakeShape = Callable[..., Document[ShapeFile]]


def test_the_thickness_is_required_and_never_guessed(thesis: Document[ShapeFile]) -> None:
    with pytest.raises(InputError, match=r"thickness is unknown .* --thickness \"2 mm\""):
        make_strip(thesis)


def test_the_thickness_comes_from_the_file_or_the_option(shape: MakeShape) -> None:
    assert make_strip(shape(thickness="1.5 mm")).thickness == pytest.approx(0.0015)
    assert make_strip(shape(thickness="1.5 mm"), 0.0015).thickness == pytest.approx(0.0015)
    assert make_strip(shape(), 0.003).thickness == 0.003


def test_two_thicknesses_that_differ_are_refused(shape: MakeShape) -> None:
    with pytest.raises(InputError, match=r"1\.5 mm thick, --thickness says 2 mm"):
        make_strip(shape(thickness="1.5 mm"), 0.002)


def test_bends_too_tight_for_the_thickness_are_named_with_their_radius(shape: MakeShape) -> None:
    angles = [-1.57] + 15 * [0.0]
    angles[4], angles[9] = 3.1, -2.5
    tight = shape(angles=angles, length="160 mm")  # radii of 3.2 mm and 4 mm
    with pytest.raises(
        InputError,
        match=r"radius below 10 mm, 5 times its thickness; too tight at station "
        r"4 \(3\.2 mm\), 9 \(4\.0 mm\)",
    ):
        make_strip(tight, 0.002)
    assert make_strip(tight, 0.0006).thickness == 0.0006


def test_a_strip_that_crosses_itself_is_refused_with_the_place(shape: MakeShape) -> None:
    circle = [-1.57] + 15 * [2 * np.pi / 12]  # once round in 12 increments, from 0.5 on
    with pytest.raises(InputError, match=r"would cross itself near stations [1-4] and 1[3-6]"):
        make_strip(shape(angles=[float(a) for a in circle]), 0.002)


def test_only_the_contours_of_a_thick_strip_may_cross(shape: MakeShape) -> None:
    """A hairpin whose legs lie 14.3 mm apart."""
    angles = [-1.57] + 15 * [0.0]
    angles[7] = angles[8] = np.pi / 2
    hairpin = shape(angles=[float(a) for a in angles], length="180 mm")
    legs = 180 / 16 / (np.pi / 2) * 2
    assert legs == pytest.approx(14.3, abs=0.05)
    make_strip(hairpin, 0.0014)
    with pytest.raises(InputError, match=r"too tight at station 7 \(7\.2 mm\), 8 \(7\.2 mm\)"):
        make_strip(hairpin, 0.0015)


def test_the_angles_of_a_standing_robot_are_refused_without_those_of_the_free_strip(
    shape: MakeShape,
) -> None:
    with pytest.raises(InputError, match=r"lists the angles of the standing robot"):
        make_strip(shape(state="loaded"), 0.002)


def test_the_freed_strip_stands_as_its_file_lists_it(shape: MakeShape) -> None:
    """Built from the free angles, the robot sags into the listed ones."""
    model = load_model("thesis", Path()).content
    listed = shape(state="loaded").content
    free = free_angles(listed, model)
    built = listed.model_copy(update={"angles": free, "state": "unloaded"})
    _, data = settle(make_robot(model.values(), built), "fixed", np.pi / 2)
    stood = [float(data.joint(f"hinge_{k}").qpos[0]) for k in range(16)]
    sag = np.abs(np.subtract(free, listed.angles)).max()
    missed = np.abs(np.subtract(stood, listed.angles)).max()
    print(f"\nload bends a joint by up to {np.degrees(sag):.2f} deg; missed {missed:.2e} rad")
    assert sag > np.radians(0.5)
    assert missed < 0.02 * sag


def test_a_free_strip_is_drawn_as_listed(shape: MakeShape) -> None:
    file = shape().content
    assert free_angles(file, load_model("thesis", Path()).content) == file.angles
