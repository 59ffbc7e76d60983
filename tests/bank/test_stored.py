"""Cases as files: what is read back, and that a file holds what its case makes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.bank.cases import Case, Made
from benchmarks.bank.make import make_case
from benchmarks.bank.stored import FOLDER, RESOLUTION_M, read_made, write_made
from benchmarks.bank.write import measured
from tests.bank.reduced import CASES

LARGEST_BYTES = 80_000
TWIN, ROD = (next(case for case in CASES if case.generator == one) for one in ("twin", "rod"))


def require_equal(found: Made, wanted: Made, within_m: float) -> None:
    assert found.label == wanted.label
    for one, other in zip(found.runs, wanted.runs, strict=True):
        assert (one.name, one.role, one.course) == (other.name, other.role, other.course)
        assert np.allclose(one.filmed.times, other.filmed.times, rtol=0, atol=1e-12)
        for body, path in other.filmed.paths.items():
            assert np.allclose(one.filmed.paths[body], path, rtol=0, atol=within_m, equal_nan=True)


def test_a_case_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    made = read_made(TWIN)
    made.runs[1].filmed.paths["top"][40:45] = np.nan
    write_made(made, tmp_path)
    again = read_made(TWIN, tmp_path)
    require_equal(again, made, 1e-12)
    assert np.isnan(again.runs[1].filmed.paths["top"]).sum() == 5 * 3


def test_a_case_is_measured_as_it_was_filmed() -> None:
    made = read_made(ROD)
    for run, filmed in zip(measured(made), made.runs, strict=True):
        assert (run.name, run.role) == (filmed.name, filmed.role)
        assert run.motion.valid.all()
        assert run.motion.times[-1] == pytest.approx(filmed.course.duration, abs=0.02)


def test_a_file_of_another_case_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"no such case; write it anew with `python -m"):
        read_made(TWIN, tmp_path)
    write_made(read_made(TWIN), tmp_path)
    with pytest.raises(ValueError, match="written of another case"):
        read_made(replace(TWIN, noise="B"), tmp_path)


def test_there_is_a_small_file_for_each_case() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == {case.name for case in CASES}
    assert max(path.stat().st_size for path in FOLDER.iterdir()) < LARGEST_BYTES


@pytest.mark.long
@pytest.mark.parametrize("case", [TWIN, ROD], ids=lambda case: case.generator)
def test_a_case_that_is_made_anew_equals_its_file(case: Case) -> None:
    require_equal(read_made(case), make_case(case), RESOLUTION_M)
