"""A slow test of the first tier fails the run and is named; one of the second may take its time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tiers import BUDGET_S

ROOT = Path(__file__).resolve().parents[1]
WORK = """\
import time
import pytest

def test_other():
    pass

def work(seconds):
    begun = time.process_time()
    while time.process_time() - begun < seconds:
        pass

{marks}
def test_slow():
    work(0.6)

def test_quick():
    work(0.1)
"""
CONFIG = """\
[pytest]
markers =
    long: second tier
    budget(seconds): may take more
"""


@pytest.fixture
def run(tmp_path: Path) -> list[str]:
    """The command that runs the tests of a folder with a budget of a third of a second."""
    (tmp_path / "pytest.ini").write_text(CONFIG)
    (tmp_path / "conftest.py").write_text(
        f"import tests.tiers as tiers\ntiers.BUDGET_S *= {0.3 / BUDGET_S}\n"
        "from tests.tiers import *\nfrom tests.tiers import pytest_collection_modifyitems, "
        "pytest_configure, pytest_runtest_makereport, pytest_runtest_setup\n"
    )
    return [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "xdist", str(tmp_path)]


BARE = {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
"""No plugins but those asked for: the others take longer to load than these tests to run."""


def outcome(run: list[str], marks: str, *words: str) -> tuple[int, str]:
    folder = Path(run[-1])
    (folder / "test_work.py").write_text(WORK.format(marks=marks))
    here = os.environ | BARE | {"COLUMNS": "200"}
    done = subprocess.run([*run, *words], cwd=folder, env=here, capture_output=True, text=True)
    return done.returncode, done.stdout


def test_a_slow_test_fails_the_first_tier_and_is_named(run: list[str]) -> None:
    code, printed = outcome(run, "", "-n", "2", "--dist", "loadgroup")
    assert code == 1
    assert "3 passed" in printed
    (line,) = [line for line in printed.splitlines() if line.startswith("too slow")]
    assert "test_work.py::test_slow" in line
    assert "s of processor time, 0.3 s are allowed" in line
    assert "test_quick" not in line
    assert "mark it `long`" in printed


def test_one_that_is_a_little_above_its_budget_is_named_and_passes(run: list[str]) -> None:
    code, printed = outcome(run, "@pytest.mark.budget(0.5)")
    assert code == 0, printed
    (line,) = [line for line in printed.splitlines() if line.startswith("too slow")]
    assert "test_work.py::test_slow" in line


@pytest.mark.parametrize("mark", ["@pytest.mark.long", "@pytest.mark.budget(5)"])
def test_a_slow_test_that_is_marked_passes(run: list[str], mark: str) -> None:
    code, printed = outcome(run, mark)
    assert code == 0, printed
    assert "too slow" not in printed
    slowest = printed[printed.index("cost") :].splitlines()[1]
    assert "test_slow" in slowest


def test_what_runs_alone_comes_first(run: list[str]) -> None:
    _, printed = outcome(run, "", "-v")
    assert printed.index("test_other PASSED") < printed.index("test_slow PASSED")
    _, printed = outcome(run, '@pytest.mark.xdist_group("alone")', "-v")
    assert printed.index("test_slow PASSED") < printed.index("test_other PASSED")


GROUPED = """\
import os
import pathlib
import pytest

@pytest.mark.parametrize("k", range(6))
def test_where(k):
    with open("workers.txt", "a") as file:
        file.write(os.environ["PYTEST_XDIST_WORKER"] + "\\n")
"""


@pytest.mark.parametrize("mark", ["", 'pytestmark = pytest.mark.xdist_group("alone")'])
def test_a_module_or_a_group_stays_on_one_worker(run: list[str], mark: str) -> None:
    folder = Path(run[-1])
    for name in ("one", "two"):
        (folder / f"test_{name}.py").write_text(GROUPED + mark)
    here = os.environ | BARE
    words = ["-n", "2", "--dist", "loadgroup", "--no-loadscope-reorder"]
    subprocess.run([*run, *words], cwd=folder, env=here, check=True)
    workers = (folder / "workers.txt").read_text().split()
    assert sorted(map(workers.count, set(workers))) == ([12] if mark else [6, 6])
