import os
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun.blueprint as rrb
from rerun.chunk import Chunk, RrdReader

from tests.report.conftest import FIGURE, NOISE_M, WEIGHT_N
from workbench.motion import RingDown
from workbench.report import Comparison, write_recording
from workbench.report.layout import layout
from workbench.report.scene import FORCE_M_PER_N
from workbench.timeseries import TimeSeries

ROBOTS = ["foot", "top", "rotor", "arm"]
TRACES = ["foot_x", "foot_z", "top_x", "top_z", "rotor_speed"]


@pytest.fixture(scope="module")
def recording(comparison: Comparison, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "compare.rrd"
    write_recording(comparison, path)
    return path


def rrd(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "rerun", "rrd", *map(str, arguments)]
    quiet = os.environ | {"CI": "1"}  # no usage statistics
    return subprocess.run(command, capture_output=True, text=True, env=quiet, timeout=60)


def rows(chunks: list[Chunk], path: str) -> set[int]:
    return {c.num_rows for c in chunks if c.entity_path == path and not c.is_static}


def scalars(chunks: list[Chunk], path: str) -> list[list[float]]:
    (chunk,) = [c for c in chunks if c.entity_path == path and not c.is_static]
    batch = chunk.to_record_batch()
    (name,) = [n for n in batch.schema.names if "Scalars" in n]
    return batch.column(name).to_pylist()


def test_the_file_is_complete(recording: Path) -> None:
    done = rrd("verify", recording)
    assert done.returncode == 0, done.stderr


def test_there_is_one_recording_named_by_the_run(recording: Path, comparison: Comparison) -> None:
    reader = RrdReader(recording)
    assert [entry.recording_id for entry in reader.recordings()] == [comparison.run]
    assert len(reader.blueprints()) == 1


def test_every_entity_has_a_row_for_every_sample(
    chunks: list[Chunk], comparison: Comparison
) -> None:
    real, twin = len(comparison.real), len(comparison.twin)
    wanted = {f"/real/{part}": real for part in ["link", *ROBOTS]}
    wanted |= {f"/twin/{part}": twin for part in ["beam", *ROBOTS]}
    wanted |= {f"/plots/{trace}/real": real for trace in TRACES}
    wanted |= {f"/plots/{trace}/twin": twin for trace in TRACES}
    wanted |= {f"/plots/{trace}/noise": real for trace in TRACES if trace != "rotor_speed"}
    wanted |= {"/plots/rotor_phase/twin": twin, "/plots/rotor_lag/twin": real}
    wanted |= {"/twin/ground": twin, "/plots/error_mm/noise": 2}
    wanted |= {"/plots/error_mm/foot": real, "/plots/error_mm/top": real}
    wanted |= {"/plots/supply/voltage_V": 140, "/phase": 4, "/log": 4}
    assert {path: max(rows(chunks, path), default=0) for path in wanted} == wanted


def test_an_estimated_beam_takes_the_place_of_the_thin_line(
    comparison: Comparison, tmp_path: Path
) -> None:
    estimated = replace(comparison, estimate=comparison.twin.between(-1.0, 5.0))
    write_recording(estimated, tmp_path / "estimated.rrd")
    chunks = RrdReader(tmp_path / "estimated.rrd").stream().to_chunks()
    assert rows(chunks, "/real/beam") == {len(comparison.twin.between(-1.0, 5.0))}
    assert rows(chunks, "/real/link") == set()


def test_all_times_are_on_the_one_timeline(chunks: list[Chunk]) -> None:
    assert {name for c in chunks for name in c.timeline_names} == {"t"}


def test_everything_is_sent_in_bulk(chunks: list[Chunk]) -> None:
    count = Counter(c.entity_path for c in chunks if not c.is_static)
    assert max(count.values()) == 2  # the foot: its pose and its box
    assert count["/twin/beam"] == 1


def test_plotted_error_is_the_misfit(chunks: list[Chunk], comparison: Comparison) -> None:
    times = comparison.real.times
    driven = (times >= 0) & (times <= comparison.duration_s)
    for part, misfit in (("foot", comparison.misfit.foot_mm), ("top", comparison.misfit.top_mm)):
        sent = scalars(chunks, f"/plots/error_mm/{part}")
        seen = [cell[0] for cell, use in zip(sent, driven, strict=True) if use and cell]
        assert np.sqrt(np.mean(np.square(seen))) == pytest.approx(misfit)
    longest = np.nanmax(comparison.error()["top_error_mm"])
    assert max(cell[0] for cell in sent if cell) == pytest.approx(longest)


def test_the_ground_pushes_where_the_foot_stands_and_nothing_while_it_flies(
    chunks: list[Chunk], comparison: Comparison
) -> None:
    (ground,) = [c for c in chunks if c.entity_path == "/twin/ground" and not c.is_static]
    batch = ground.to_record_batch()
    vectors, origins = (
        batch.column(next(n for n in batch.schema.names if part in n)).to_pylist()
        for part in ("vectors", "origins")
    )
    up = comparison.twin["foot_z_m"] > 1e-3
    assert up.sum() > 300
    assert not any(vectors[k] for k in np.flatnonzero(up))
    standing = int(np.flatnonzero(comparison.twin["foot_z_m"] == 0)[0])
    lengths = [length for _, _, length in vectors[standing]]
    assert lengths == pytest.approx([WEIGHT_N / 4 * FORCE_M_PER_N] * 4)
    half = (FIGURE.foot_length / 2, FIGURE.foot_width / 2)
    corners = {(round(x, 4), round(y, 4)) for x, y, _ in origins[standing]}
    assert corners == {(sx * half[0], sy * half[1]) for sx in (1, -1) for sy in (1, -1)}


def test_the_noise_band_is_twice_the_noise_to_either_side(
    chunks: list[Chunk], comparison: Comparison
) -> None:
    edges = scalars(chunks, "/plots/foot_z/noise")
    middle = scalars(chunks, "/plots/foot_z/real")
    assert [not cell for cell in edges] == [not cell for cell in middle]
    low, high = edges[100]
    assert (high - low) / 4 == pytest.approx(NOISE_M)
    assert (high + low) / 2 == pytest.approx(middle[100][0])


def test_the_rotor_s_lag_counts_whole_turns(chunks: list[Chunk], comparison: Comparison) -> None:
    lag = scalars(chunks, "/plots/rotor_lag/twin")
    end = int(np.searchsorted(comparison.real.times, comparison.duration_s))
    seen = [cell[0] for cell in lag[end - 20 : end] if cell]
    assert np.median(seen) == pytest.approx(np.degrees((17.0 - 16.9) * (10 - 0.25)), rel=0.02)
    phases = [cell[0] for cell in scalars(chunks, "/plots/rotor_phase/twin") if cell]
    assert 0 <= min(phases) < 20
    assert 340 < max(phases) < 360


def test_the_protocol_is_told_in_its_own_words(chunks: list[Chunk], comparison: Comparison) -> None:
    (chunk,) = [c for c in chunks if c.entity_path == "/protocol"]
    batch = chunk.to_record_batch()
    (name,) = [n for n in batch.schema.names if n.endswith("text")]
    assert comparison.protocol in batch.column(name).to_pylist()[0][0]


def test_a_run_that_was_cut_off_is_marked_and_shown_as_far_as_it_goes(
    comparison: Comparison, tmp_path: Path
) -> None:
    nothing = comparison.twin.between(100.0, 200.0)
    cut = replace(
        comparison, real=nothing, twin=nothing, mark="ABORTED, the program was killed", phases=()
    )
    write_recording(cut, tmp_path / "cut.rrd")
    assert rrd("verify", tmp_path / "cut.rrd").returncode == 0
    chunks = RrdReader(tmp_path / "cut.rrd").stream().to_chunks()
    (run,) = [c for c in chunks if c.entity_path == "/__properties/run"]
    assert run.to_record_batch().to_pylist()[0]["mark"] == [cut.mark]
    (log,) = [c for c in chunks if c.entity_path == "/log"]
    first = str(log.to_record_batch().to_pylist()[0])
    assert "ERROR" in first
    assert "the program was killed" in first
    names = {view.name for view in views_in(layout(cut).root_container)}
    assert names == {"Supply [V]", "Supply [A]", "Notes", "Protocol file", "Journal"}


def test_gaps_are_sent_empty(chunks: list[Chunk], comparison: Comparison) -> None:
    sent = scalars(chunks, "/plots/top_z/real")
    unseen = ~comparison.real.validity("top_z_m")
    assert unseen.sum() > 40
    assert [not cell for cell in sent] == unseen.tolist()


def test_properties_tell_run_and_distances(chunks: list[Chunk], comparison: Comparison) -> None:
    (run,) = [c for c in chunks if c.entity_path == "/__properties/run"]
    row = run.to_record_batch().to_pylist()[0]
    assert row["run"] == [comparison.run]
    assert row["real_distance_m"] == [comparison.real_summary.as_json()["distance_m"]]
    assert row["time_zero"] == ["the rotor's first motion"]
    assert row["rerun_version"]


def test_notes_say_that_the_real_beam_was_not_measured(chunks: list[Chunk]) -> None:
    (chunk,) = [c for c in chunks if c.entity_path == "/notes"]
    text = str(chunk.to_record_batch().to_pylist()[0])
    assert "was not measured" in text
    assert "| Distance | 0.217 m | 0.251 m |" in text
    assert "T was not seen for 0.4 s" in text


def test_the_same_comparison_gives_the_same_recording(
    recording: Path, comparison: Comparison, tmp_path: Path
) -> None:
    again, other = tmp_path / "again.rrd", tmp_path / "other.rrd"
    write_recording(comparison, again)
    write_recording(replace(comparison, real=comparison.real.shifted(0.01)), other)
    assert rrd("compare", recording, again).returncode == 0
    assert rrd("compare", recording, other).returncode != 0


def test_what_was_not_recorded_is_left_out(comparison: Comparison, tmp_path: Path) -> None:
    bare = replace(
        comparison,
        real=comparison.real.select(n for n in comparison.real.names if n != "foot_pitch_rad"),
        supply=None,
        phases=(),
        log=(),
        warnings=(),
    )
    write_recording(bare, tmp_path / "bare.rrd")
    paths = {c.entity_path for c in RrdReader(tmp_path / "bare.rrd").stream().to_chunks()}
    assert "/real/foot" in paths
    assert not {"/phase", "/log", "/plots/supply/voltage_V"} & paths


def test_a_robot_that_was_never_seen_is_not_drawn(comparison: Comparison, tmp_path: Path) -> None:
    real = comparison.real.between(-1.0, 1.0)
    unseen = TimeSeries(real.times, real.values, real.names, np.zeros_like(real.valid))
    twin = comparison.twin.between(-1.0, 1.0)
    write_recording(replace(comparison, real=unseen, twin=twin), tmp_path / "blind.rrd")
    chunks = RrdReader(tmp_path / "blind.rrd").stream().to_chunks()
    assert not any(scalars(chunks, "/plots/foot_x/real"))
    assert rrd("verify", tmp_path / "blind.rrd").returncode == 0


def test_a_drop_has_its_floor_below_and_no_view_of_the_rotor_s_speed(
    comparison: Comparison, tmp_path: Path
) -> None:
    numbers = RingDown(0.0245, 2.8, 0.03)
    fallen = replace(
        comparison, mode="drop", floor_m=-0.02, real_summary=numbers, twin_summary=numbers
    )
    write_recording(fallen, tmp_path / "drop.rrd")
    chunks = RrdReader(tmp_path / "drop.rrd").stream().to_chunks()
    (floor,) = [c for c in chunks if c.entity_path == "/floor/scale"]
    batch = floor.to_record_batch()
    (name,) = [n for n in batch.schema.names if "strips" in n]
    heights = {point[2] for strip in batch.column(name).to_pylist()[0] for point in strip}
    assert list(heights) == pytest.approx([-0.024])  # the foot is 8 mm thick
    (run,) = [c for c in chunks if c.entity_path == "/__properties/run"]
    row = run.to_record_batch().to_pylist()[0]
    assert (row["mode"], row["time_zero"]) == (["drop"], ["the release"])
    assert row["real_ring_hz"] == [2.8]
    names = [view.name for view in views_in(layout(fallen).root_container)]
    assert "Foot z [m]" in names
    assert "Rotor [rad/s]" not in names
    assert "Rotor [rad/s]" in [v.name for v in views_in(layout(comparison).root_container)]


def test_every_view_has_something_to_show(chunks: list[Chunk], comparison: Comparison) -> None:
    sent = {chunk.entity_path for chunk in chunks}
    for view in views_in(layout(comparison).root_container):
        assert shows(view, sent), view.name


def shows(view: Any, sent: set[str]) -> bool:
    """Tell whether every entity that a view asks for was sent; what ends in /** is a tree."""
    asked = [view.contents] if isinstance(view.contents, str) else list(view.contents)
    paths = [path.replace("$origin", view.origin) for path in asked]
    trees = [path.removesuffix("/**") for path in paths]
    return all(any(one == tree or one.startswith(f"{tree}/") for one in sent) for tree in trees)


def views_in(part: Any) -> list[Any]:
    inner = getattr(part, "contents", None)
    if not isinstance(part, rrb.Container) or inner is None:
        return [part]
    return [view for child in inner for view in views_in(child)]
