"""A new user's first hour: from a clone, by README and tutorial alone, to a printed template.

Packages are not installed again: a `.venv` with the present interpreter's stands for what
`make install` makes, which then finds nothing left to do. `tests/test_wheel.py` covers packaging.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.quoting import Quoted, commands, section, squeezed

ROOT = Path(__file__).resolve().parents[1]
SAID = {"RUN": r"bundle: (runs/\S+)", "TEMPLATE": r"(templates/\S+\.pdf)"}
"""What stands for something on a page -> where an earlier command said what it is."""


@dataclass
class Beginner:
    """Somebody who types what the pages say, in one folder, and reads what comes.

    Args:
        clone: the folder.
        seen: everything that was printed so far.
    """

    clone: Path
    seen: str = ""

    def types(self, quoted: Quoted) -> None:
        """Type one command in a shell that has the environment of the lines `source` before."""
        line = quoted.line
        for word, said in SAID.items():
            if re.search(rf"\b{word}\b", line):
                line = re.sub(rf"\b{word}\b", re.findall(said, self.seen)[-1], line)
        done = subprocess.run(
            ["bash", "-c", f"[ -z $LATER ] || source .venv/bin/activate; {line}"],
            cwd=self.clone,
            env=self._environment() | {"LATER": "yes" if self.seen else ""},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=200,
        )
        assert done.returncode == 0, f"{line}\n{done.stdout}"
        told = squeezed(done.stdout)
        for expected in quoted.sees:
            assert expected in told, f"{line}\n{done.stdout}"
        self.seen += f"\n{told}"

    def _environment(self) -> dict[str, str]:
        ours = {k: v for k, v in os.environ.items() if not k.startswith("WORKBENCH_")}
        return ours | {"PYTHONPATH": str(self.clone), "COLUMNS": "300"}


@pytest.fixture
def beginner(tmp_path: Path) -> Beginner:
    """Somebody with a fresh clone whose packages are there already."""
    clone = tmp_path / "clone"
    made = subprocess.run(
        ["git", "clone", "--quiet", str(ROOT), str(clone)], capture_output=True, check=False
    )
    if made.returncode:
        pytest.skip("not a git checkout")
    programs = clone / ".venv" / "bin"
    programs.mkdir(parents=True)
    call = f'exec {sys.executable} -c "from workbench.cli import main; main()" "$@"\n'
    (programs / "workbench").write_text(f"#!/bin/sh\n{call}")
    (programs / "workbench").chmod(0o755)
    (programs / "activate").write_text(f'PATH="{programs}:$PATH"\n')
    (clone / ".venv" / "installed").touch()
    return Beginner(clone)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="the page's lines for Windows are its own")
def test_from_a_clone_to_a_diagnosis_and_a_template(beginner: Beginner) -> None:
    readme = beginner.clone / "README.md"
    start = list(commands(section(readme, "Start")))
    assert start == list(commands(readme.read_text("utf-8"))), "others would never be typed"
    hour = list(commands((beginner.clone / "docs" / "tutorial.md").read_text("utf-8")))
    assert start[0].line == "make install"
    for quoted in [*start, *hour]:
        beginner.types(quoted)
    status = ["git", "status", "--porcelain"]
    left = subprocess.run(status, cwd=beginner.clone, capture_output=True, text=True, check=True)
    assert left.stdout == "", "what commands write is not for git"
    (page,) = beginner.clone.glob("diagnoses/*/*.html")
    assert "frictionloss = 0.00150 N m" in page.read_text("utf-8")
    (pdf,) = beginner.clone.glob("templates/*.pdf")
    told = _poppler("pdfinfo", pdf)
    assert re.search(r"Pages:\s+3\n", told)
    assert re.search(r"Page size:\s+841\.\d+ x 595\.\d+ pts \(A4\)", told)
    assert "it must be 100 mm" in " ".join(_poppler("pdftotext", "-layout", pdf, "-").split())


def _poppler(program: str, *words: str | Path) -> str:
    if shutil.which(program) is None:
        pytest.skip(f"needs poppler's {program}")
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=True)
    return done.stdout
