"""Fixtures that several rooms' tests share."""

from __future__ import annotations

import itertools
import json
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.tiers import (
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_runtest_makereport,
    pytest_runtest_setup,
)
from workbench.cli import main

__all__ = [
    "pytest_collection_modifyitems",
    "pytest_configure",
    "pytest_runtest_makereport",
    "pytest_runtest_setup",
]

ROOT = Path(__file__).resolve().parents[1]
_NUMBERS = itertools.count()
FINISHED = """\
  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, ramp: 0.5 s, duration: 3 s}
  - run: {mode: decay, pull: 0.4 N, rest: 1 s, duration: 3 s}
"""


@dataclass(frozen=True)
class Answer:
    """What a command printed and how it ended."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        return json.loads(self.out)


Command = Callable[..., Answer]


@pytest.fixture(autouse=True)
def _ctrl_c_is_handled() -> None:
    """Handle SIGINT, so that children do not inherit that a shell's `&` or a test ignored it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _own_ledgers(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Give each test ledgers of its own, and never those of this user."""
    folder = tmp_path_factory.getbasetemp() / f"state-{next(_NUMBERS)}"
    monkeypatch.setenv("WORKBENCH_STATE", str(folder))


@pytest.fixture
def without_views(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the command line draw no views, for tests that look at none."""
    monkeypatch.setattr("workbench.report.comparison_set.write_views", lambda bundle: None)


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of finished runs, views included: a hop and a ring-down. To be read, or copied."""
    from tests.bundles import carried_out

    folder = tmp_path_factory.mktemp("finished")
    carried_out(folder, FINISHED, views=True)
    return folder / "runs"


@pytest.fixture
def root() -> Path:
    """The checkout's top folder."""
    return ROOT


@pytest.fixture
def workbench(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Run the command line in this process."""

    def run(*words: object) -> Answer:
        monkeypatch.setattr(sys, "argv", ["workbench", *map(str, words)])
        capsys.readouterr()
        code, before = 0, signal.getsignal(signal.SIGINT)
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
        finally:
            signal.signal(signal.SIGINT, before)
        out, err = capsys.readouterr()
        return Answer(code, out, err)

    return run
