"""What a deviation means: joints, tip, distance, files and page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.as_built import Cost, deviation_of, simulate_cost, write_as_bent
from workbench.errors import InputError
from workbench.photo import AsBent
from workbench.report import deviation_figure, write_readback
from workbench.schemas import ShapeFile, load_model, load_shape
from workbench.sim import make_robot

ERROR = np.radians(0.1)


@pytest.fixture(scope="module")
def target() -> ShapeFile:
    return load_shape("thesis-initial", Path()).content


def bent_by(target: ShapeFile, changes: dict[int, float], error: float | None = ERROR) -> AsBent:
    """The target with some joints changed [deg]."""
    angles = np.array(target.angles)
    for joint, degrees in changes.items():
        angles[joint] += np.radians(degrees)
    covariance = None if error is None else np.eye(16) * error**2
    return AsBent(angles, covariance, True, "angles a.csv, SHA-256 0", {"scale": 1.01})


def test_the_joints_to_correct_and_which_way(target: ShapeFile) -> None:
    found = deviation_of(bent_by(target, {3: 2.0, 8: -3.0, 12: 0.5}), target)
    assert found.correct == (8, 3)
    assert found.in_words(3) == "open by 2.0\N{DEGREE SIGN}"
    assert found.in_words(8) == "close by 3.0\N{DEGREE SIGN}"


def test_a_doubtful_joint_is_not_corrected(target: ShapeFile) -> None:
    assert deviation_of(bent_by(target, {3: 2.0}, np.radians(1.5)), target).correct == ()
    assert deviation_of(bent_by(target, {3: 2.0}, None), target).correct == (3,)


def test_the_tip_turns_about_the_wrong_joint(target: ShapeFile) -> None:
    """One degree at the root moves the tip by its distance from the root, times that angle."""
    found = deviation_of(bent_by(target, {0: 1.0}), target)
    _, tip = (arcs.points_at(arcs.length) for arcs in found.arcs())
    reach = float(np.linalg.norm(tip))
    assert np.linalg.norm(found.tip_error) == pytest.approx(reach * np.radians(1.0), rel=1e-3)
    assert found.tip_error @ tip == pytest.approx(0, abs=0.01 * reach * reach)
    assert found.tip_error[0] > 0  # clockwise, forward over the top


def test_what_it_costs_is_simulated_with_its_spread(target: ShapeFile) -> None:
    model = load_model("thesis", Path()).content
    same = simulate_cost(bent_by(target, {}), target, model, duration=1.0, samples=2)
    assert same.change == 0
    assert same.target == same.bent
    assert (same.around_bent == same.around_target).all()
    assert same.around_bent.std() > 0
    other = simulate_cost(bent_by(target, {5: 4.0}, None), target, model, duration=1.0)
    assert other.target == same.target
    assert other.change == pytest.approx(other.bent - other.target)
    assert other.change != 0
    assert other.change_error is None


def test_a_speed_that_cannot_be_is_refused(target: ShapeFile) -> None:
    with pytest.raises(InputError, match="omega 900 rad/s is outside"):
        simulate_cost(bent_by(target, {}), target, load_model("thesis", Path()).content, 900.0)


def test_the_file_is_a_shape_that_the_twin_builds(target: ShapeFile, tmp_path: Path) -> None:
    path = tmp_path / "as-bent.yaml"
    bent = bent_by(target, {3: 2.0})
    write_as_bent(path, bent, target)
    read = load_shape(str(path), Path()).content
    assert read.angles == pytest.approx(bent.angles, abs=1e-5)
    assert read.uncertainty == pytest.approx(np.full(16, ERROR), abs=1e-5)
    assert read.state == "unloaded"
    assert "SHA-256" in read.source
    assert make_robot(load_model("thesis", Path()).content.values(), read).angles == read.angles
    with pytest.raises(InputError, match="exists; a shape is never changed, give another --out"):
        write_as_bent(path, bent, target)


def test_the_page_tells_it_all(target: ShapeFile, tmp_path: Path) -> None:
    bent = bent_by(target, {3: 2.0})
    cost = Cost(17.0, 10.0, 0.2, 0.25, np.array([0.2, 0.22]), np.array([0.24, 0.28]), 1)
    path = tmp_path / "as-bent.html"
    write_readback(path, "as-bent", bent, deviation_of(bent, target), cost, {"target": "x"})
    text = path.read_text(encoding="utf-8")
    for told in ("One joint needs correction", "open by 2.0", "1 of 6 fell", "+50 mm", "250"):
        assert told in text, told
    assert "<svg" in path.with_suffix(".svg").read_text(encoding="utf-8")


def test_the_figure_names_the_joints_to_correct(target: ShapeFile) -> None:
    figure = deviation_figure(deviation_of(bent_by(target, {3: 2.0, 8: -3.0}), target))
    told = [text.get_text() for text in figure.axes[0].texts]
    assert told == ["8: close by 3.0\N{DEGREE SIGN}", "3: open by 2.0\N{DEGREE SIGN}"]


def test_the_figure_marks_every_joint_that_the_headline_counts(target: ShapeFile) -> None:
    off = dict.fromkeys(range(1, 12), 2.5)
    deviation = deviation_of(bent_by(target, off), target)
    figure = deviation_figure(deviation)
    assert len(figure.axes[0].texts) == len(deviation.correct) == 11
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()][:2] == ["target", "as bent"]
