"""Points of one frame at a time: the same as those of the whole take."""

from __future__ import annotations

import numpy as np
import pytest

from tests.streaming import VIRTUAL, filmed
from workbench.errors import InputError
from workbench.motion import ROTOR_ANGLE
from workbench.tracking import Axes, Body, BodyNames, FramePoints, Sample, Take, make_track

AXES, NAMES = Axes("y", "-z"), BodyNames("Foot", "T", "Rotor")
MARKERS = {name: np.array(places) for name, places in VIRTUAL.content.tracking.markers.items()}


def streamed(take: Take) -> tuple[list[Body], list[Sample]]:
    """What a stream of a take would bring."""
    bodies, first = [], 0
    for name, body in take.bodies.items():
        count = body.measured.shape[1]
        bodies.append(Body(name, int(body.id), np.zeros((count, 3)), first))
        first += count
    markers = np.concatenate([body.measured for body in take.bodies.values()], axis=1)
    none = np.full((len(bodies), 8), np.nan)
    return bodies, [Sample(k, k / 120, none, markers[k], {}) for k in range(len(take))]


@pytest.mark.parametrize("markers", [MARKERS, None], ids=["places given", "places learned"])
def test_frame_by_frame_points_are_where_the_track_has_them(markers: dict | None) -> None:
    take = filmed(2.0)
    bodies, frames = streamed(take)
    points = FramePoints(frames[:100], bodies, NAMES, AXES, markers)
    track = make_track(take, bodies=NAMES, axes=AXES, markers=markers).raw
    found = [points.of(frame) for frame in frames]
    for name in track.names:
        if name not in found[0]:
            continue
        here = np.array([one[name] for one in found])
        there = np.where(track.validity(name), track[name], np.nan)
        apart = here - there
        if name == ROTOR_ANGLE:
            apart = np.arctan2(np.sin(apart), np.cos(apart))
        seen = np.isfinite(apart)
        assert seen.sum() > 0.9 * len(frames), name
        assert np.abs(apart[seen]).max() < 5e-5, name  # what a shorter rest has for its median


def test_markers_that_do_not_fit_their_body_show_nothing_of_it() -> None:
    bodies, frames = streamed(filmed(0.5))
    points = FramePoints(frames[:100], bodies, NAMES, AXES, MARKERS)
    markers = frames[110].markers.copy()
    markers[bodies[1].first] += [0.02, 0, 0]  # one of T's two
    assert np.isfinite(points.of(frames[110])["top_x_m"])
    moved = points.of(frames[110]._replace(markers=markers))
    assert np.isnan(moved["top_x_m"])
    assert np.isnan(moved[ROTOR_ANGLE])
    assert np.isfinite(moved["foot_x_m"])


def test_a_body_that_is_not_streamed_is_named() -> None:
    bodies, frames = streamed(filmed(0.5))
    with pytest.raises(InputError, match="no body 'Tip'; it has Foot, T, Rotor"):
        FramePoints(frames[:100], bodies, BodyNames("Foot", "Tip", "Rotor"), AXES)
