"""Angles and points measured by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.photo.rendering import TARGET, Scene, centreline, thesis_angles
from workbench.errors import InputError
from workbench.photo import read_angles, read_points


def table(path: Path, rows: np.ndarray, head: str = "") -> Path:
    lines = [head] if head else []
    path.write_text("\n".join([*lines, *(",".join(f"{v:.3f}" for v in row) for row in rows)]))
    return path


def test_angles_with_and_without_errors(tmp_path: Path) -> None:
    degrees = np.degrees(thesis_angles)
    rows = np.column_stack([degrees, np.full(16, 0.5)])
    told = read_angles(table(tmp_path / "a.csv", rows, "angle_deg,error_deg"), TARGET)
    assert np.degrees(told.angles) == pytest.approx(degrees, abs=1e-3)
    assert told.uncertainty == pytest.approx(np.full(16, np.radians(0.5)))
    plain = read_angles(table(tmp_path / "b.csv", degrees[:, None]), TARGET)
    assert plain.uncertainty is None
    assert plain.foot_seen


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("1\n2\n", "2 angles, 16 are needed"),
        ("alpha\n1\nx\n", r"a\.csv:3: 'x' is not numbers"),
        ("1,2,3\n", "3 numbers, 1 or 2 are needed"),
        ("200\n" * 16, "200 deg is no angle between increments"),
        ("1,0.5\n" * 15 + "1\n", "on every line or on none"),
    ],
)
def test_angles_that_cannot_be(tmp_path: Path, text: str, match: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=match):
        read_angles(path, TARGET)


def digitised(noise_mm: float, seed: int = 1) -> tuple[np.ndarray, Scene]:
    """64 points [mm] on a page whose forward is -x and whose up is +y."""
    generator = np.random.default_rng(seed)
    angles = thesis_angles + generator.normal(0, 0.04, 16)
    scene = Scene(angles, turn=0.0)
    points, _ = centreline(scene)
    picked = points[np.linspace(0, len(points) - 1, 64).astype(int)]
    picked[1:-1] += generator.normal(0, noise_mm / 1000, (62, 2))
    return 1000 * picked * [-1.0, 1.0], scene


def test_points_give_all_angles_when_forward_is_known(tmp_path: Path) -> None:
    pulls = []
    for seed in range(8):
        rows, scene = digitised(0.1, seed)
        bent = read_points(table(tmp_path / "p.csv", rows, "x,y"), TARGET, "-x", "+y")
        off = bent.angles - scene.angles
        assert bent.uncertainty is not None
        assert np.degrees(np.sqrt(np.mean(off**2))) < 0.6
        pulls.append(off / bent.uncertainty)
    assert 0.6 < np.sqrt(np.mean(np.square(pulls))) < 1.5


def test_points_without_directions_are_turned_by_the_target(tmp_path: Path) -> None:
    rows, scene = digitised(0.0)
    bent = read_points(table(tmp_path / "p.csv", rows[::-1]), TARGET)
    assert not bent.foot_seen
    assert np.degrees(bent.angles[1:] - scene.angles[1:]) == pytest.approx(np.zeros(15), abs=0.05)


def test_points_that_cannot_be(tmp_path: Path) -> None:
    rows, _ = digitised(0.0)
    path = table(tmp_path / "p.csv", rows)
    with pytest.raises(InputError, match="--up: None is no axis; give both"):
        read_points(path, TARGET, "+x")
    with pytest.raises(InputError, match="must be at right angles"):
        read_points(path, TARGET, "+x", "-x")
    with pytest.raises(InputError, match="10 points, at least 32 are needed"):
        read_points(table(path, rows[:10]), TARGET)
    with pytest.raises(InputError, match=r"run over .* mm, the strip is 615 mm long"):
        read_points(table(path, rows / 10), TARGET)
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_points(tmp_path / "none.csv", TARGET)
