"""The benchmarks run and print their tables."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("cleaning", ["position error [mm]", "default  hop", "make_track, all of it"]),
        ("twin", ["floor: 8 bare mj_step loops", "ours: 1 hop, start-up included", "peak MB"]),
        ("integrators", ["implicitfast", "blew up", "against RK4 at 0.031 ms"]),
        ("tracking", ["1800 frames", "ours / peer, time", "memory to read / file", "row.csv"]),
        ("calibrate", ["ours: found nothing", "polyfit of the thesis' FFT", "holds the truth in"]),
        ("wire", ["readings of a ", "72-2540", "HMP4040", "wrong  processor s"]),
        ("replay", ["followed  replayed", "root mean square error [mm]", "13.2"]),
        ("photo", ["2 photographs of", "rms pull", "angles, rms:", "intervals hold"]),
        ("thesis", ["Appendix E, loaded", "-17 rad/s", "mu 0.2/0.4 (comment)", "k 9.5"]),
        ("feedback", ["a misspelt key in a protocol", "take of 1.0 kB", "make demo", "floor"]),
        ("catalogue", ["first list, no index yet", "search: speed, mode", "floor: a list of no"]),
        ("film", ["1280 x 720, 2.0 s of film", "processor [s]", "a frame [ms]"]),
        ("optimize", ["near the first shape, 0 failed", "the default search, ", "spread at most"]),
        ("search", ["smooth bowl, 96 evaluations, 2 seeds", "ours: cma", "scipy DE", "GNU Octave"]),
        (
            "fit",
            [
                "runs of 1.5 s, independent engine",
                "beam, independent engine",
                "ground, twin engine",
                "lines of workbench/fit",
            ],
        ),
        (
            "identify",
            ["workbench identify", "mujoco.sysid", "scipy least_squares", "looks at no data"],
        ),
    ],
)
def test_a_benchmark_prints_its_tables(name: str, told: list[str], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / f"{name}.py"), "--quick"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=180,
    )
    assert done.returncode == 0, done.stderr
    assert not [line for line in told if line not in done.stdout]
    assert "nan" not in done.stdout


def test_machines_whose_data_are_not_there_are_named_with_what_gets_them(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / "measured.py"), "--data", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split(":")[0] for line in lines] == ["emps", "servo", "dfki"]
    assert all("left out" in line and "git clone https://github.com/" in line for line in lines)
