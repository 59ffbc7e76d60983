"""Bodies with unknown names are guessed from how far apart they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.tracking import (
    Axes,
    BodyNames,
    Take,
    guess_bodies,
    raw_points,
    read_take,
    write_motive,
    write_row,
)

UNNAMED = ("RigidBody 004", "RigidBody 002", "RigidBody 003")
RIGHT = BodyNames(*UNNAMED)
Move = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def with_copy(take: Take, name: str, source: str, move: Move) -> Take:
    """Return the take with one more body, its markers made from another one's."""
    body = take.bodies[source]
    moved = replace(
        body,
        name=name,
        measured=move(body.measured),
        solved=move(body.solved),
        position=body.position,
    )
    return replace(take, bodies={name: moved, **take.bodies})


def still(at: list[float]) -> Move:
    return lambda markers: np.zeros_like(markers) + np.array(at)


def without_poses(take: Take) -> Take:
    bodies = {
        name: replace(body, quaternion=np.full_like(body.quaternion, np.nan))
        for name, body in take.bodies.items()
    }
    return replace(take, bodies=bodies)


def refused(take: Take, names: BodyNames, markers: dict[str, list[list[int]]] | None = None) -> str:
    with pytest.raises(InputError) as caught:
        raw_points(take, names, Axes(), markers)
    return str(caught.value)


def test_a_wrong_name_is_answered_with_the_bodies_that_move_like_the_robot(new_hop: Any) -> None:
    take = new_hop(names=UNNAMED).take
    assert refused(take, BodyNames()) == (
        "hop.csv: the foot 'Foot' is not in the take; there are 'RigidBody 004', 'RigidBody 002', "
        "'RigidBody 003'. By their distances foot is 'RigidBody 004', top is 'RigidBody 002', "
        "rotor is 'RigidBody 003': write bodies: {foot: RigidBody 004, top: RigidBody 002, rotor: "
        "RigidBody 003}"
    )


def test_the_guess_can_be_written_as_it_stands(new_hop: Any) -> None:
    take = new_hop(names=UNNAMED).take
    guess = guess_bodies(take)
    assert guess == RIGHT
    assert raw_points(take, RIGHT, Axes()).foot.name == "RigidBody 004"


@pytest.mark.parametrize("names", [("A", "B", "C"), ("C", "B", "A"), ("B", "C", "A")])
def test_the_order_of_the_bodies_makes_no_difference(
    new_hop: Any, names: tuple[str, str, str]
) -> None:
    take = new_hop(names=names).take
    ordered = replace(take, bodies={name: take.bodies[name] for name in sorted(take.bodies)})
    assert guess_bodies(ordered) == BodyNames(*names)
    assert guess_bodies(without_poses(ordered), Axes()) == BodyNames(*names)


def test_clutter_does_not_hide_the_robot(new_hop: Any) -> None:
    take = new_hop(names=UNNAMED).take
    take = with_copy(take, "wand", UNNAMED[2], lambda markers: markers * 3 + 1.5)
    take = with_copy(take, "plate", UNNAMED[0], still([0.2, 0.05, -0.4]))
    take = with_copy(take, "far", UNNAMED[0], still([2.0, 0.0, 1.0]))
    assert guess_bodies(take) == RIGHT
    assert guess_bodies(take, Axes()) == RIGHT


def test_two_feet_that_explain_t_equally_well_give_no_guess(new_hop: Any) -> None:
    take = new_hop(names=UNNAMED).take
    twin = with_copy(take, "twin", UNNAMED[0], lambda markers: markers + np.array([0.0, 0.0, 0.02]))
    assert guess_bodies(twin) is None


def test_axes_tell_that_t_is_above_the_foot(new_hop: Any) -> None:
    take = new_hop(names=UNNAMED).take
    assert guess_bodies(take, Axes(up="-y")) is None


def test_a_rotor_that_never_turns_gives_no_guess(new_hop: Any) -> None:
    assert guess_bodies(without_poses(new_hop(seconds=1.5, names=UNNAMED).take)) is None


def test_a_body_that_turns_about_itself_is_the_rotor(new_hop: Any) -> None:
    hop = new_hop(names=UNNAMED)
    # T circles nearly as wide as the rotor and against it, so that T moves more than the rotor
    arm = np.column_stack([np.cos(hop.truth.angle), 0 * hop.truth.angle, -np.sin(hop.truth.angle)])
    middle, axes = hop.truth.foot + np.array([0.07, 0.0, 0.28]), Axes()
    half = hop.truth.angle / 2
    turning = np.column_stack([np.cos(half), 0 * half, np.sin(half), 0 * half])
    bodies = dict(hop.take.bodies)
    for name, radius in (("RigidBody 002", -0.03), ("RigidBody 003", 0.005)):
        path = axes.points_to_export(middle + radius * arm)
        markers = path[:, None] + np.zeros((1, 2, 3))
        bodies[name] = replace(bodies[name], position=path, measured=markers, solved=markers)
    turned = axes.quaternions_to_export(turning)
    bodies["RigidBody 003"] = replace(bodies["RigidBody 003"], quaternion=turned)
    take = replace(hop.take, bodies=bodies)
    assert guess_bodies(take) == RIGHT


def test_too_few_bodies_or_samples_give_no_guess(new_hop: Any, lose: Any) -> None:
    take = new_hop(names=UNNAMED).take
    two = replace(take, bodies={name: take.bodies[name] for name in UNNAMED[:2]})
    assert guess_bodies(two) is None
    assert guess_bodies(lose(take, UNNAMED[1], 5, len(take))) is None
    assert refused(two, BodyNames()).endswith("there are 'RigidBody 004', 'RigidBody 002'")


def test_a_name_with_a_slip_is_answered_with_the_one_meant(hop: Any) -> None:
    text = refused(hop.take, BodyNames(foot="foot"))
    assert "did you mean 'Foot'? By their distances" in text
    assert "top: T, rotor: Rotor}" in text


def test_names_that_yaml_would_misread_are_quoted(new_hop: Any) -> None:
    text = refused(new_hop(names=("a: b", "12", "Ok-1")).take, BodyNames())
    assert text.endswith('{foot: "a: b", top: "12", rotor: Ok-1}')


def test_places_of_a_body_that_is_not_there_are_refused(hop: Any) -> None:
    text = refused(hop.take, BodyNames(), {"Feet": [[0, 0, 0]]})
    assert text.startswith("hop.csv: markers: body 'Feet' is not in the take; there are 'Foot'")


@pytest.mark.parametrize("kind", ["row 1.0", "row 1.1", "motive 1.21", "motive 1.25"])
def test_bodies_of_a_file_are_guessed(new_hop: Any, tmp_path: Path, kind: str) -> None:
    flavour, version = kind.split()
    write = write_row if flavour == "row" else write_motive
    write(new_hop(names=UNNAMED).take, tmp_path / "x.csv", version)  # type: ignore[arg-type]
    assert guess_bodies(read_take(tmp_path / "x.csv")) == RIGHT


def test_the_real_exports_hold_no_robot(real_exports: Path) -> None:
    files = sorted(real_exports.glob("*.csv"))
    assert len(files) == 3
    for file in files:
        assert guess_bodies(read_take(file)) is None
