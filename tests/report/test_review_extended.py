"""A recording with a third robot: the twin of an extended model beside the robot and its twin."""

from __future__ import annotations

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from rerun.chunk import Chunk, RrdReader

from workbench.motion import FOOT
from workbench.report import Comparison, HeadlessViewer, write_recording

PARTS = ["beam", "foot", "top", "rotor", "arm"]
TRACES = ["foot_x", "foot_z", "top_x", "top_z", "rotor_speed"]


@pytest.fixture(scope="module")
def recording(three: Comparison, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("three") / "three.rrd"
    write_recording(three, path)
    return path


def rows(chunks: list[Chunk], path: str) -> int:
    found = [c.num_rows for c in chunks if c.entity_path == path and not c.is_static]
    return max(found, default=0)


def scalars(chunks: list[Chunk], path: str) -> list[list[float]]:
    (chunk,) = [c for c in chunks if c.entity_path == path and not c.is_static]
    batch = chunk.to_record_batch()
    (name,) = [n for n in batch.schema.names if "Scalars" in n]
    return batch.column(name).to_pylist()


def test_the_third_robot_has_all_its_parts_and_curves(
    chunks: list[Chunk], three: Comparison
) -> None:
    assert three.extended is not None
    samples = len(three.extended.motion)
    wanted = {f"/extended/{part}": samples for part in PARTS}
    wanted |= {f"/plots/{trace}/extended": samples for trace in TRACES}
    wanted |= {f"/plots/extended_error_mm/{part}": len(three.real) for part in ("foot", "top")}
    assert {path: rows(chunks, path) for path in wanted} == wanted
    sent = [cell[0] for cell in scalars(chunks, "/plots/foot_x/extended")]
    assert sent == pytest.approx(three.extended.motion[FOOT[0]].tolist())


def test_robot_and_twin_stay_as_they_are_without_it(
    chunks: list[Chunk], comparison: Comparison, tmp_path: Path
) -> None:
    write_recording(comparison, tmp_path / "two.rrd")
    two = RrdReader(tmp_path / "two.rrd").stream().to_chunks()
    assert not [c.entity_path for c in two if "extended" in c.entity_path]
    for path in ("/plots/foot_x/twin", "/plots/error_mm/top"):
        assert scalars(chunks, path) == scalars(two, path)


def test_its_plotted_error_is_its_misfit(chunks: list[Chunk], three: Comparison) -> None:
    assert three.extended is not None
    driven = (three.real.times >= 0) & (three.real.times <= three.duration_s)
    misfit = three.extended.misfit
    for part, wanted in (("foot", misfit.foot_mm), ("top", misfit.top_mm)):
        sent = scalars(chunks, f"/plots/extended_error_mm/{part}")
        seen = [cell[0] for cell, use in zip(sent, driven, strict=True) if use and cell]
        assert np.sqrt(np.mean(np.square(seen))) == pytest.approx(wanted)
        assert wanted < getattr(three.misfit, f"{part}_mm")


def test_notes_and_properties_tell_of_it(chunks: list[Chunk], three: Comparison) -> None:
    assert three.extended is not None
    (notes,) = [c for c in chunks if c.entity_path == "/notes"]
    text = str(notes.to_record_batch().to_pylist()[0])
    assert "| Real | Extended twin, sloped | Difference |" in text
    assert f"| Error, T |  |  | {three.extended.misfit.top_mm:.1f} mm |" in text
    assert f"| Error, T |  |  | {three.misfit.top_mm:.1f} mm |" in text
    (run,) = [c for c in chunks if c.entity_path == "/__properties/run"]
    row = run.to_record_batch().to_pylist()[0]
    assert row["extended_model"] == ["sloped"]
    assert row["extended_misfit_mm"] == [three.extended.misfit.both_mm]
    assert row["extended_distance_m"] == [three.extended.summary.as_json()["distance_m"]]


@pytest.mark.viewer
def test_the_viewer_shows_it_alone_and_among_the_others(
    viewer: HeadlessViewer, tmp_path: Path
) -> None:
    viewer.set_time(8.0)
    views = viewer.state().views
    assert [report for view in views for report in view.reports] == []
    ids = {view.name: view.view_id for view in views}
    assert {"Extended twin", "Extended error [mm]"} <= set(ids)
    for view, colors in (("Extended twin", "g"), ("Twin", "b"), ("All three", "obg")):
        viewer.screenshot(tmp_path / "shot.png", ids[view])
        red, green, blue = np.moveaxis(
            matplotlib.image.imread(tmp_path / "shot.png")[..., :3], -1, 0
        )
        shares = {
            "o": np.mean(red - blue > 0.4),
            "b": np.mean(blue - red > 0.4),
            "g": np.mean((green - red > 0.3) & (green - blue > 0.15)),
        }
        assert {color for color, share in shares.items() if share > 5e-4} == set(colors)
