"""From an export file to a track, against the motion the export was made from."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.errors import InputError
from workbench.motion import FOOT, PITCH, ROTOR_ANGLE, ROTOR_SPEED, TOP, position
from workbench.tracking import (
    CLEANING,
    Axes,
    BodyNames,
    Cloud,
    SampleStatus,
    Take,
    Track,
    make_track,
    raw_points,
    read_take,
    write_motive,
    write_row,
)

Lose = Callable[[Take, str, int, int], Take]
ZERO_WITHIN_S = 0.012


def track_of(take: Take, **options: Any) -> Track:
    return make_track(take, **({"bodies": BodyNames(), "axes": Axes()} | options))


def samples(track: Track) -> np.ndarray:
    """Return which samples of the truth the track's samples are."""
    return np.rint((track.motion.times + track.zero_in_take_s) * 120).astype(int)


@pytest.mark.parametrize("kind", ["row 1.0", "row 1.1", "motive 1.21", "motive 1.25"])
def test_a_file_becomes_the_motion_it_was_made_from(
    kind: str, tmp_path: Path, hop: Any, foot_markers: Any
) -> None:
    flavour, version = kind.split()
    if flavour == "row":
        write_row(hop.take, tmp_path / "x.csv", version)  # type: ignore[arg-type]
    else:
        write_motive(hop.take, tmp_path / "x.csv", version, "YXZ", "Millimeters")  # type: ignore[arg-type]
    take = read_take(tmp_path / "x.csv")
    track = track_of(take, markers=foot_markers)
    truth, at = hop.truth, samples(track)
    for names, told in ((FOOT, truth.foot), (TOP, truth.top)):
        assert np.sqrt(np.mean((position(track.motion, names) - told[at]) ** 2)) < 1e-4
    assert np.abs(track.motion[PITCH] - truth.pitch[at]).max() < 2e-3
    assert np.abs(track.motion[ROTOR_ANGLE] - truth.angle[at]).max() < 0.02
    assert np.abs(track.motion[ROTOR_SPEED] - truth.speed[at])[12:-12].max() < 0.8
    assert track.zero_in_take_s == pytest.approx(2.0, abs=ZERO_WITHIN_S)
    assert track.rest_s == pytest.approx(2.0, abs=ZERO_WITHIN_S)
    assert track.start_angle_rad == pytest.approx(0.6, abs=2e-3)
    assert (track.warnings, track.take_sha256) == ((), take.sha256)


def test_axes_of_the_export_make_no_difference(new_hop: Any) -> None:
    axes = Axes(up="z", forward="x")
    track, plain = track_of(new_hop(axes=axes).take, axes=axes), track_of(new_hop().take)
    apart = np.abs(position(track.motion, TOP) - position(plain.motion, TOP))
    assert np.sqrt(np.mean(apart**2)) < 2e-4


def test_pitch_comes_from_the_markers_where_no_places_are_given(hop: Any) -> None:
    track = track_of(hop.take)
    assert np.abs(track.motion[PITCH] - hop.truth.pitch[samples(track)]).max() < 2e-3
    source = track.report["bodies"]["foot"]["source"]
    assert "rigid body that the take shows, fitted to the measured markers" in source
    assert track.report["bodies"]["top"]["source"] == "centroid of the measured markers"


def test_pitch_is_relative_to_how_the_body_was_defined(hop: Any) -> None:
    foot = hop.take.bodies["Foot"]
    defined = Rotation.from_rotvec([0.4, 1.1, -0.3])
    roll = np.where(hop.take.times > 3, 0.2, 0.0)  # about the forward axis, -z in the export
    rolled = Rotation.from_rotvec(np.outer(roll, [0, 0, -1]))
    turned = Rotation.from_quat(foot.quaternion, scalar_first=True) * rolled * defined
    none = foot.measured[:, :0]  # without markers only the pose is left to tell the pitch
    tilted = replace(
        foot,
        quaternion=turned.as_quat(scalar_first=True),
        measured=none,
        solved=none,
        marker_names=(),
    )
    track = track_of(replace(hop.take, bodies={**hop.take.bodies, "Foot": tilted}))
    assert np.abs(track.motion[PITCH] - hop.truth.pitch[samples(track)]).max() < 1e-3


def test_marker_places_keep_a_hidden_marker_from_moving_the_foot(
    hop: Any, foot_markers: Any
) -> None:
    foot = hop.take.bodies["Foot"]
    measured = foot.measured.copy()
    measured[400:700, 1] = np.nan
    take = replace(hop.take, bodies={**hop.take.bodies, "Foot": replace(foot, measured=measured)})
    fitted = track_of(take, markers=foot_markers)
    assert fitted.motion.validity(FOOT[0]).all()
    assert np.sqrt(np.mean((position(fitted.motion, FOOT) - hop.truth.foot) ** 2)) < 1.5e-4
    assert "fitted to the measured markers" in fitted.report["bodies"]["foot"]["source"]
    learned = track_of(take)
    assert learned.motion.validity(FOOT[0]).all()
    moved = position(learned.motion, FOOT) - (hop.truth.foot + tilt_of_centroid(hop.truth.pitch))
    assert np.sqrt(np.mean(moved**2)) < 2e-4


def tilt_of_centroid(pitch: np.ndarray) -> np.ndarray:
    """Return how the markers' centroid, 12 mm above the foot's centre, moves as the foot tilts."""
    return 0.012 * np.column_stack([np.sin(pitch), 0 * pitch, np.cos(pitch) - 1])


def test_two_markers_off_centre_are_told_of(hop: Any) -> None:
    track = track_of(hop.take, markers={"T": [[0, -20, 5], [0, 20, 15]]})
    assert track.warnings[0].startswith("the markers of 'T' have their centroid 9.7 mm off")


def test_markers_that_are_seldom_all_seen_give_way_to_the_solved_ones(hop: Any) -> None:
    top = hop.take.bodies["T"]
    measured = top.measured.copy()
    measured[100:, 1] = np.nan
    take = replace(hop.take, bodies={**hop.take.bodies, "T": replace(top, measured=measured)})
    track = track_of(take)
    source = track.report["bodies"]["top"]["source"]
    assert source.startswith("centroid of the solved markers (the measured ones give its place in")
    assert track.motion.validity(TOP[0]).all()


def test_without_measured_markers_the_source_is_named(hop: Any) -> None:
    blind = {
        name: replace(body, measured=np.full_like(body.measured, np.nan))
        for name, body in hop.take.bodies.items()
    }
    posed = {
        name: replace(
            body, measured=body.measured[:, :0], solved=body.solved[:, :0], marker_names=()
        )
        for name, body in hop.take.bodies.items()
    }
    for bodies, source in ((blind, "centroid of the solved markers"), (posed, "pose position")):
        report = track_of(replace(hop.take, bodies=bodies)).report
        assert {report["bodies"][role]["source"] for role in ("top", "rotor")} == {source}
        foot = report["bodies"]["foot"]["source"]
        assert foot == source or "fitted to the solved markers" in foot


def test_the_origin_is_the_median_of_the_last_two_seconds_at_rest(new_hop: Any) -> None:
    hop = new_hop(noise_m=0.0)
    late = np.concatenate([np.zeros(240, dtype=int), np.arange(len(hop.take))])
    bodies = {
        name: replace(
            body,
            **{
                field: getattr(body, field)[late].copy()
                for field in ("position", "quaternion", "measured", "solved", "missing")
            },
        )
        for name, body in hop.take.bodies.items()
    }
    n = len(late)
    take = replace(hop.take, indices=np.arange(n), times=np.arange(n) / 120, bodies=bodies)
    bodies["Foot"].measured[:240] += 1.5e-3  # still, but not where it rests before the start
    track = track_of(replace(take, cloud=Cloud.empty(n)))
    assert track.rest_s == pytest.approx(4.0, abs=ZERO_WITHIN_S)
    before = np.abs(track.motion.times + 1.0) < 0.1
    assert np.abs(position(track.motion, FOOT)[before]).max() < 1e-6


def test_gaps_in_the_rotor_do_not_lose_turns(hop: Any, lose: Lose) -> None:
    take = hop.take
    for start in range(300, 900, 40):
        take = lose(take, "Rotor", start, start + 9)
    track = track_of(take)
    assert np.abs(track.motion[ROTOR_ANGLE] - hop.truth.angle[samples(track)]).max() < 0.15
    assert track.warnings == ()


def test_turns_in_a_long_gap_are_counted_by_the_speed_beside_it(hop: Any, lose: Lose) -> None:
    track = track_of(lose(hop.take, "Rotor", 600, 720))  # 2.7 turns
    assert track.warnings == ()
    known = np.isfinite(track.motion[ROTOR_ANGLE])
    apart = track.motion[ROTOR_ANGLE] - hop.truth.angle[samples(track)]
    assert np.abs(apart[known]).max() < 0.05


def test_a_gap_in_the_run_up_leaves_the_turns_unknown_and_says_so(hop: Any, lose: Lose) -> None:
    track = track_of(lose(hop.take, "Rotor", 250, 420))
    assert (
        "in 1 gap(s), the longest 1.42 s, the rotor may have made unseen turns" in track.warnings[0]
    )


def test_the_raw_motion_is_the_take_itself(hop: Any, lose: Lose) -> None:
    take = lose(hop.take, "Foot", 500, 503)
    top = take.bodies["T"]
    measured = top.measured.copy()
    measured[700] += 0.05
    take = replace(take, bodies={**take.bodies, "T": replace(top, measured=measured)})
    track = track_of(take)
    raw, motion = track.raw, track.motion
    assert raw.names == motion.names
    np.testing.assert_allclose(raw.times + track.zero_in_take_s, take.times, atol=1e-12)
    given = raw_points(take, BodyNames(), Axes())
    apart = raw.select(TOP).values - given.top.position
    assert np.ptp(apart, axis=0).max() < 1e-12  # an origin is all that was taken off
    assert np.isnan(raw[FOOT[0]][500:503]).all()
    assert not raw.validity(FOOT[0])[500:503].any()
    assert raw[TOP[0]][700] - raw[TOP[0]][699] == pytest.approx(
        -0.05, abs=0.004
    )  # T moves 3 mm a sample
    assert not raw.validity(TOP[0])[700]
    assert not raw.validity(ROTOR_ANGLE)[700]
    seen = raw.validity(ROTOR_ANGLE)
    assert np.abs(raw[ROTOR_ANGLE] - motion[ROTOR_ANGLE])[seen].max() < 0.03


def test_every_missing_sample_has_its_reason(hop: Any, lose: Lose) -> None:
    take = lose(lose(hop.take, "Foot", 500, 503), "Foot", 600, 640)
    foot = take.bodies["Foot"]
    measured, missing = foot.measured.copy(), foot.missing.copy()
    measured[700] += 0.05
    measured[800], missing[800] = np.nan, SampleStatus.FROZEN
    foot = replace(foot, measured=measured, missing=missing)
    track = track_of(replace(take, bodies={**take.bodies, "Foot": foot}))
    raw, cleaned = track.raw_missing["foot"], track.missing["foot"]
    assert np.flatnonzero(raw == SampleStatus.LOST).tolist() == [*range(500, 503), *range(600, 640)]
    assert np.flatnonzero(raw == SampleStatus.GLITCH).tolist() == [700]
    assert np.flatnonzero(raw == SampleStatus.FROZEN).tolist() == [800]
    assert np.flatnonzero(cleaned == SampleStatus.FILLED).tolist() == [500, 501, 502, 700, 800]
    assert np.flatnonzero(cleaned == SampleStatus.LOST).tolist() == list(range(600, 640))
    np.testing.assert_array_equal(cleaned == SampleStatus.SEEN, track.motion.validity(FOOT[0]))
    np.testing.assert_array_equal(raw == SampleStatus.SEEN, track.raw.validity(FOOT[0]))


def test_the_thesis_recipe_tells_what_it_held(hop: Any, lose: Lose) -> None:
    take = lose(hop.take, "Foot", 500, 503)
    top = take.bodies["T"]
    solved = top.solved.copy()
    solved[700] += 0.5
    take = replace(take, bodies={**take.bodies, "T": replace(top, solved=solved)})
    track = track_of(take, recipe="thesis")
    assert np.flatnonzero(track.missing["foot"]).tolist() == [500, 501, 502]
    assert track.missing["top"][700] == SampleStatus.FILLED
    assert track.raw_missing["top"][700] == SampleStatus.GLITCH
    assert len(track.raw) == len(take) == len(track.motion) + 1
    np.testing.assert_allclose(
        track.raw[FOOT[0]][510:520], track.motion[FOOT[0]][510:520], atol=2e-3
    )


def test_the_thesis_recipe_keeps_its_own_base(hop: Any) -> None:
    track = track_of(hop.take, recipe="thesis")
    assert track.report["origin_m"] == pytest.approx([0.31, -0.22, 0.062], abs=1e-6)
    assert PITCH not in track.motion
    columns = CLEANING["thesis"](raw_points(hop.take, BodyNames(), Axes())).columns
    np.testing.assert_array_equal(track.motion[FOOT[2]], columns[FOOT[2]])
    assert track.motion.valid.all()


def test_a_rotor_that_never_moves_keeps_the_takes_time(new_hop: Any) -> None:
    take = new_hop(seconds=1.5).take
    track = track_of(take)
    assert track.zero_in_take_s == 0.0
    assert track.warnings == ("the rotor never moves; times are those of the take",)
    hinted = track_of(take, start_hint=1.0)
    assert (hinted.zero_in_take_s, hinted.motion.times[0]) == (1.0, -1.0)
    assert hinted.rest_s == pytest.approx(1.0, abs=0.01)


def test_a_hint_far_from_the_motion_gives_a_warning(hop: Any) -> None:
    track = track_of(hop.take, start_hint=5.0)
    assert "5 s were expected; the measured time is used" in track.warnings[0]
    assert track_of(hop.take, start_hint=2.0).warnings == ()


@pytest.mark.parametrize(
    ("axes", "match"),
    [
        (Axes(up="-y", forward="-z"), "T is -0.2.. m above the foot at rest"),
        (Axes(up="y", forward="z"), "travels 0.3.. m backwards"),
        (Axes(up="y", forward="x"), "m sideways"),
    ],
)
def test_wrong_axes_are_noticed(hop: Any, axes: Axes, match: str) -> None:
    warnings = " ".join(track_of(hop.take, axes=axes).warnings)
    assert re.search(match, warnings)


def test_places_that_fit_in_no_order_are_told_of(hop: Any, foot_markers: Any) -> None:
    places = (np.array(foot_markers["Foot"]) * 1.1).tolist()
    track = track_of(hop.take, markers={"Foot": places})
    assert "the marker places of 'Foot' fit the take only to 16.3 mm" in track.warnings[0]


def test_a_body_that_is_not_there_is_named_with_those_that_are(hop: Any) -> None:
    with pytest.raises(InputError, match=r"foot 'foot' is not in the take.*did you mean 'Foot'"):
        track_of(hop.take, bodies=BodyNames(foot="foot"))
    with pytest.raises(InputError, match="there are 'Foot', 'T', 'Rotor'"):
        track_of(hop.take, bodies=BodyNames(rotor="Motor"))
    with pytest.raises(InputError, match="need three bodies"):
        track_of(hop.take, bodies=BodyNames(rotor="T"))
    with pytest.raises(InputError, match="markers of 'Foot': 3 places are given, the take has 4"):
        track_of(hop.take, markers={"Foot": np.eye(3)})


def test_a_body_that_is_never_seen_is_refused(hop: Any, lose: Lose) -> None:
    with pytest.raises(InputError, match="body 'T' is never seen"):
        raw_points(lose(hop.take, "T", 0, len(hop.take)), BodyNames(), Axes())


def test_the_report_is_json(hop: Any) -> None:
    for recipe in ("default", "thesis"):
        json.dumps(track_of(hop.take, recipe=recipe).report, allow_nan=False)


def moved(take: Take, name: str, forward: np.ndarray, up: np.ndarray) -> Take:
    """Move a body by (n,) along the bench's x and z; the export's y is up, its -z forward."""
    body, way = take.bodies[name], np.column_stack([0 * up, up, -forward])
    other = replace(
        body,
        position=body.position + way,
        measured=body.measured + way[:, None],
        solved=body.solved + way[:, None],
    )
    return replace(take, bodies={**take.bodies, name: other})


def test_time_zero_of_a_decay_is_the_release_of_t(new_hop: Any) -> None:
    take = new_hop(seconds=1.9).take  # the rotor would start at 2 s
    since = np.maximum(take.times - 1.003, 0)
    swing = 0.02 * (np.cos(10 * since) - 1)
    for name in ("T", "Rotor"):
        take = moved(take, name, swing, 0 * swing)
    track = track_of(take, mode="decay")
    assert track.zero_in_take_s == pytest.approx(1.003, abs=0.004)
    assert track.rest_s == pytest.approx(1.003, abs=0.004)
    assert track.warnings == ()
    ringing = track.motion.between(0.05, 0.8)
    expected = 0.071 + 0.02 * (np.cos(10 * ringing.times) - 1)
    assert np.abs(ringing[TOP[0]] - expected).max() < 0.002
    assert np.abs(track.motion[ROTOR_SPEED]).max() < 0.5
    assert track_of(take).warnings[0] == "the rotor never moves; times are those of the take"


def test_time_zero_of_a_drop_is_when_the_foot_begins_to_fall(new_hop: Any) -> None:
    take = new_hop(seconds=1.9).take
    fall = -np.minimum(4.9 * np.maximum(take.times - 1.003, 0) ** 2, 0.02)
    for name in ("Foot", "T", "Rotor"):
        take = moved(take, name, 0 * fall, fall)
    track = track_of(take, mode="drop")
    assert track.zero_in_take_s == pytest.approx(1.003, abs=0.004)
    assert track.motion[FOOT[2]][0] == pytest.approx(0, abs=3e-4)  # the hand is the origin
    assert track.motion[FOOT[2]][-1] == pytest.approx(-0.02, abs=3e-4)
    assert track.warnings == ()


def test_a_robot_that_is_never_let_go_is_named(new_hop: Any) -> None:
    take = new_hop(seconds=1.5).take
    assert track_of(take, mode="decay").warnings[0].startswith("T never moves; times are those")
    hinted = track_of(take, mode="drop", start_hint=1.0)
    assert hinted.warnings == ("the foot never moves; time zero is 1 s into the take, as given",)
