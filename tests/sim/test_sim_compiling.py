"""Compiled code is kept on disk, and compiled anew when anything that it was made from changes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from workbench.sim import compiling


def nothing() -> float:
    return 0.0


def kept_as(*offsets: int) -> str:
    compiling.callback(nothing, "float64()", offsets)
    return nothing.__qualname__


def test_the_same_code_is_kept_under_the_same_name() -> None:
    assert kept_as(8, 16) == kept_as(8, 16)
    assert compiling.callback(nothing, "float64()", (8, 16)).cache_hits == 1


def test_another_layout_is_another_name() -> None:
    assert kept_as(8, 16) != kept_as(8, 24)


def test_another_source_of_the_room_is_another_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    before = kept_as()
    copies = [Path(shutil.copy(source, tmp_path)) for source in compiling._SOURCES]
    monkeypatch.setattr(compiling, "_SOURCES", copies)
    assert kept_as() == before
    law = next(copy for copy in copies if copy.name == "ground.py")
    law.write_text(law.read_text("utf-8").replace("max(0.0 - p[14]", "max(1.0 - p[14]"), "utf-8")
    assert kept_as() != before


AT_ONCE = """\
import threading
from workbench.sim import droop_ripple, passive_forces
begin = threading.Barrier(4)
def install():
    begin.wait()
    passive_forces.install_force_laws()
    droop_ripple._install()
threads = [threading.Thread(target=install) for _ in range(4)]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(len(passive_forces._kept), len(droop_ripple._kept))
"""


def test_threads_that_build_their_first_robots_at_once_install_once(tmp_path: Path) -> None:
    """Batches do: with nothing on disk all of them would compile for a second."""
    done = subprocess.run(
        [sys.executable, "-c", AT_ONCE],
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["2", "2"]
