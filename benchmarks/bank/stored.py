"""Cases as small files: what the cameras saw and the label, so that no test simulates them anew.

    python -m benchmarks.bank.stored

writes the reduced cases of `tests.bank.reduced` to `tests/data/bank`. A file is Parquet, one row a
picture, all runs in turn; places are whole numbers of 0.01 mm, a thirtieth of the noise, and null
where a body was not seen. The metadata hold the case, its label and what each run was. What is
read back is what `measured` and `judge` need: the bodies' own angles are not kept.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from benchmarks.bank.cases import Case, Made, Run
from benchmarks.bank.courses import RATE_HZ, Course
from benchmarks.bank.make import make_case
from benchmarks.bank.observe import Filmed

__all__ = ["FOLDER", "RESOLUTION_M", "read_made", "write_made"]

FOLDER = Path(__file__).parents[2] / "tests" / "data" / "bank"
RESOLUTION_M = 1e-5

_BODIES, _AXES = ("foot", "top", "rotor"), "xyz"
_AGAIN = "write it anew with `python -m benchmarks.bank.stored`"


def write_made(made: Made, folder: Path = FOLDER) -> Path:
    """Write the runs and the label of a case, and return the file."""
    names = [f"{body}_{axis}_10um" for body in _BODIES for axis in _AXES]
    places = np.concatenate(
        [np.hstack([run.filmed.paths[body] for body in _BODIES]) for run in made.runs]
    )
    lost = ~np.isfinite(places)
    whole = np.round(np.where(lost, 0.0, places) / RESOLUTION_M).astype(np.int32)
    columns = [pa.array(whole[:, k], mask=lost[:, k]) for k in range(len(names))]
    about = {
        "case": asdict(made.case),
        "label": made.label,
        "runs": [_about(run) for run in made.runs],
    }
    table = pa.table(columns, names).replace_schema_metadata({"about": json.dumps(about)})
    path = _file(made.case, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    # differences from picture to picture need few bits
    packed = dict.fromkeys(names, "DELTA_BINARY_PACKED")
    pq.write_table(table, path, use_dictionary=False, column_encoding=packed, compression="zstd")
    return path


def read_made(case: Case, folder: Path = FOLDER) -> Made:
    """Read back what was written of a case.

    Raises:
        FileNotFoundError: when nothing was.
        ValueError: when the file was written of a case that differs from this one.
    """
    path = _file(case, folder)
    if not path.exists():
        raise FileNotFoundError(f"{path}: there is no such case; {_AGAIN}")
    table = pq.read_table(path)
    about = json.loads((table.schema.metadata or {})[b"about"])
    if about["case"] != json.loads(json.dumps(asdict(case))):
        raise ValueError(f"{path}: it was written of another case, {about['case']}; {_AGAIN}")
    places = RESOLUTION_M * np.column_stack(
        [column.to_numpy().astype(float) for column in table.columns]
    )
    ends = np.cumsum([run["pictures"] for run in about["runs"]])
    parts = np.split(places, ends[:-1])
    runs = tuple(_run(run, part) for run, part in zip(about["runs"], parts, strict=True))
    return Made(case, runs, about["label"])


def _about(run: Run) -> dict[str, Any]:
    times = run.filmed.times
    asked = {"name": run.name, "role": run.role, "course": run.course._asdict()}
    return asked | {"begin_s": float(times[0]), "pictures": len(times)}


def _run(about: dict[str, Any], places: np.ndarray) -> Run:
    times = about["begin_s"] + np.arange(len(places)) / RATE_HZ
    paths = dict(zip(_BODIES, np.split(places, len(_BODIES), axis=1), strict=True))
    course = Course(**about["course"])
    course = course._replace(steps=tuple((time, speed) for time, speed in course.steps))
    return Run(about["name"], about["role"], course, Filmed(times, paths, {}))


def _file(case: Case, folder: Path) -> Path:
    return folder / f"{case.name}.parquet"


def _write_all(cases: Iterable[Case]) -> None:
    for case in cases:
        path = write_made(make_case(case))
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    from tests.bank.reduced import CASES  # a draw of the tests; nothing else here needs it

    _write_all(CASES)
