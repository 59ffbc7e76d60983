import numpy as np
import pytest

from workbench.motion import FOOT, FOOT_ERROR, TOP, TOP_ERROR
from workbench.report import Comparison, Figure
from workbench.report.geometry import beam_points, beam_root, foot_pitch, pitch_quaternions
from workbench.report.headline import headline, misfit_rows, verdict
from workbench.timeseries import TimeSeries


def test_rms_of_the_error_is_the_misfit(comparison: Comparison) -> None:
    error = comparison.error().between(0.0, comparison.duration_s)
    for column, misfit in (
        (FOOT_ERROR, comparison.misfit.foot_mm),
        (TOP_ERROR, comparison.misfit.top_mm),
    ):
        assert np.sqrt(np.nanmean(error[column] ** 2)) == pytest.approx(misfit)


def test_error_is_invalid_where_the_cameras_saw_nothing(comparison: Comparison) -> None:
    gap = comparison.error().between(4.05, 4.35)
    assert not gap.validity(TOP_ERROR).any()
    assert gap.validity(FOOT_ERROR).all()


def test_beam_starts_at_its_root_and_ends_at_the_top(comparison: Comparison) -> None:
    beam = beam_points(comparison.twin, comparison.figure)
    assert beam.shape == (len(comparison.twin), 17, 3)
    np.testing.assert_array_equal(beam[:, 0], beam_root(comparison.twin, comparison.figure))
    np.testing.assert_allclose(beam[:, -1], comparison.twin.select(TOP).values, atol=1e-12)


def test_beam_increments_are_equally_long(comparison: Comparison) -> None:
    beam = beam_points(comparison.twin, comparison.figure)
    steps = np.linalg.norm(np.diff(beam, axis=1), axis=2)
    np.testing.assert_allclose(steps, comparison.figure.beam_length / 16)


def test_a_positive_angle_turns_forward_down() -> None:
    columns = {name: np.zeros(1) for name in FOOT} | {"hinge_0_rad": np.array([np.pi / 2])}
    beam = beam_points(TimeSeries.of(np.zeros(1), columns), Figure(0.2, 0.2, 0.6, 0.05, 0.035))
    np.testing.assert_allclose(beam[0], [[0.05, 0, 0], [0.05, 0, -0.6]], atol=1e-15)


def test_a_twin_without_hinges_is_refused_by_name(comparison: Comparison) -> None:
    with pytest.raises(ValueError, match=r"no column hinge_0_rad.*there are foot_x_m"):
        beam_points(comparison.real, comparison.figure)


def test_a_foot_without_pitch_is_drawn_level(comparison: Comparison) -> None:
    level = foot_pitch(comparison.real.select(FOOT))
    np.testing.assert_array_equal(pitch_quaternions(level)[0], [0, 0, 0, 1])


def test_headline_has_units_and_signs(comparison: Comparison) -> None:
    distance, hop, speed = headline(comparison)
    assert distance == ("Distance", "0.217 m", "0.251 m", "+0.034 m (+16 %)")
    assert hop.real.endswith(" mm")
    assert speed.twin == "17.00 rad/s"
    assert [name for name, _ in misfit_rows(comparison.misfit)] == ["foot", "T", "foot and T"]
    assert "0.217 m" in verdict(comparison)
