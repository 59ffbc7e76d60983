"""Ordinary mistakes made at the command line: each answer says what is wrong and what to do."""

from __future__ import annotations

import errno
import os
import re
import shutil
import socket
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import serial

from tests.bundles import NOW, asked_for
from tests.conftest import ROOT, Command
from workbench.bundle import Bundle
from workbench.hw.connection import port_trouble
from workbench.schemas import SCHEMAS
from workbench.schemas.files import KINDS

EXPORT = ROOT / "tests" / "data" / "tracking" / "hop_motive_1.23.csv"
LAB = ROOT / "docs" / "examples" / "lab-bench.yaml"
SHAPE = ROOT / "models" / "thesis-initial.yaml"
PROTOCOL = """\
schema: workbench/protocol-1
title: Short hop
steps:
  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, duration: 2 s}
"""
SHEET = """\
schema: workbench/sheet-1
model: thesis
shape: thesis-initial
tracking: {up: y, forward: -z}
bodies: {foot: Foot, top: T, rotor: Rotor}
runs:
  - {take: gone.csv, mode: hop, omega: 17 rad/s}
"""


@dataclass(frozen=True)
class Mistake:
    """One mistake.

    Args:
        words: of the command line.
        wrong: what the answer must name.
        helps: what it must say to do, or what is allowed.
        code: exit code.
    """

    words: str
    wrong: str
    helps: str
    code: int = 2


MISTAKES = [
    # a protocol that cannot be run
    Mistake("run gone.yaml", "gone.yaml: no such file", "in desk there is"),
    Mistake("run hop-17", "hop-17: no such file", "did you mean folder/hop-17.yaml?"),
    Mistake("run hop17", "hop17: no such file", "did you mean folder/hop-17.yaml?"),
    Mistake("run seconds.yaml", "unknown unit 'sec' in '2sec'", "did you mean 's'?"),
    Mistake("run grams.yaml", "pull: unknown unit 'g' in '40 g'", "40 g weigh 0.392 N"),
    Mistake("run comma.yaml", "duration: '2,0 s' has a decimal comma", "write '2.0 s'"),
    Mistake("run hop.yml", "hop.yml: no such file", "did you mean 'hop.yaml'?"),
    Mistake("run nowhere/hop.yaml", "nowhere/hop.yaml: no such file", "is no folder nowhere"),
    Mistake("run folder", "folder: cannot be read", "name a file in it"),
    Mistake("run take.csv", "take.csv:1:1: the file must be a mapping", "schema: workbench/prot"),
    Mistake("run binary.yaml", "not a UTF-8 text file (byte 0)", "save it as text in UTF-8"),
    Mistake("run empty.yaml", "empty.yaml:1:1:", "begins with `schema: workbench/protocol-1`"),
    Mistake("run tabs.yaml", "tabs.yaml:4:1: not valid YAML", "indent with spaces"),
    Mistake("run lab.yaml", "lab.yaml:3:1: this is a bench", "a protocol is needed here"),
    Mistake("run no-unit.yaml", "no-unit.yaml:4:22: speed: 17 has no unit", "'17 rad/s'"),
    Mistake("run odd-unit.yaml", "unknown unit 'rads'", "did you mean 'rad/s'?"),
    Mistake("run too-fast.yaml", "90 rad/s needs 21.114 V", "1.50 rad/s to 21.30 rad/s"),
    Mistake("run backwards.yaml", "duration: -2 s is not allowed", "must be above 0 s"),
    Mistake("run misspelt.yaml", "unknown key 'sped'", "did you mean 'speed'?"),
    # a bench that is not there
    Mistake("run hop.yaml --bench virtul", "no bench named 'virtul'", "did you mean 'virtual'?"),
    Mistake("run hop.yaml --bench lab", "no bench named 'lab'", "a path must end in .yaml"),
    Mistake("run hop.yaml --bench hop.yaml", "this is a protocol", "a bench is needed here"),
    Mistake("run hop.yaml --bench odd-supply.yaml", "no supply model 'RD9999'", "there are RD6006"),
    Mistake("run hop.yaml --bench channel.yaml", "HMP4040 has no channel 5", "there are 1 to 4"),
    Mistake("run hop.yaml --bench one-channel.yaml", "RD6006 has one channel, not 2", ""),
    Mistake(
        "run hop.yaml --bench no-line.yaml", "names it as its calibration", "workbench calibrate"
    ),
    Mistake("run hop.yaml --bench no-takes.yaml --dry-run", "no such folder", "make or mount it"),
    Mistake("run hop.yaml --bench lab.yaml", "there is no such port", "is the cable in", 3),
    Mistake("supply read --bench lab.yaml", "there is no such port", "Ports present", 3),
    Mistake("supply read --bench file-port.yaml", "the port does not open", "holding it", 3),
    Mistake("supply read --bench virtual", "no real supply", "workbench supply simulate"),
    Mistake("supply probe --port /dev/nothing", "answers at /dev/nothing", "is it on", 3),
    Mistake("supply simulate riden --tcp 5020", "'5020' is not host:port", "127.0.0.1:5020"),
    Mistake("supply simulate riden --tcp 127.0.0.1:BUSY", "can listen there", "another port"),
    # runs that are not there, or cannot be used
    Mistake("runs show gone", "gone: no run, folder of runs", "workbench runs list"),
    Mistake("runs show hop-runn", "hop-runn: no run, folder of runs", "did you mean 'hop-run'?"),
    Mistake("runs verify folder", "folder: not a bundle", "name the folder of a run"),
    Mistake("runs show runs/hop-run/take", "not a bundle", "did you mean runs/hop-run?"),
    Mistake("review hop.yaml", "no run, folder of runs, protocol or exp", "workbench runs list"),
    Mistake("identify hop-run", "only a complete run can be fitted", "workbench runs list"),
    Mistake("calibrate folder", "folder: not a bundle", "name the folder of a run"),
    Mistake("resonances runs", "holds no complete bundle", "protocols/clamped-sweep.yaml"),
    Mistake("diagnose", "nothing to diagnose", "give RUNS, or --rig"),
    Mistake("diagnose hop-run", "only a complete run can be fitted", "workbench runs list"),
    Mistake("diagnose --rig hop.yaml", "this is a protocol", "a rig is needed here"),
    Mistake("run hop.yaml --resume hop-run", "belongs to no experiment", "without --resume"),
    # exports
    Mistake("ingest gone.csv", "gone.csv: cannot be read", "see that the name is right"),
    Mistake("ingest folder", "folder: no export in it can be read", "put exports into it"),
    Mistake("ingest empty.csv", "the file is empty", "readable are OptiTrack exports"),
    Mistake("ingest foreign.csv", "the first cell is 'a'", "readable are OptiTrack exports"),
    Mistake("ingest cut.csv", "the row is cut short", "export the take again"),
    Mistake("ingest sheet.yaml", "sheet.yaml:7:6: no such file 'gone.csv'", "^"),
    Mistake("ingest take.csv --insist", "--insist goes with", "--into RUN"),
    Mistake("ingest take.csv --into gone", "gone: no run, folder of runs", "workbench runs list"),
    Mistake("live --out take.csv", "take.csv: exists", "give another --out"),
    # models, shapes and numbers
    Mistake("simulate --model tesis", "no model named 'tesis'", "did you mean 'thesis'?"),
    Mistake("simulate --shape short.yaml", "angles: 15 values", "at least 16 are needed"),
    Mistake("simulate --shape lab.yaml", "this is a bench", "a shape is needed here"),
    Mistake("simulate --omega fast", "--omega", "known units: rad/s, rpm, Hz"),
    Mistake("simulate --omega 17V", "unknown unit 'V'", "known units: rad/s, rpm, Hz"),
    Mistake("simulate --duration 1h", "3600 s is outside", "0.1 to 600 s"),
    Mistake("simulate --omega 99", "omega 99 rad/s is outside", "-60 to 60 rad/s"),
    Mistake("investigate hop.yaml --budget 30", "--budget: 30 has no unit", "'30 s'"),
    Mistake("optimize --goal distanc", "no goal named 'distanc'", "did you mean 'distance'?"),
    Mistake("optimize --vary omega=15", "'omega=15' is no variable", "omega=15:21"),
    Mistake("optimize --resume folder", "no search to go on with", "Name the folder of a search"),
    Mistake("template thesis-initial", "thickness is unknown", '--thickness "2 mm"'),
    Mistake("template thesis-initial --thickness 2", "2 has no unit", "'2 mm'"),
    Mistake("template thesis-initial --thickness 2mm --paper A9", "paper 'A9'", "there is A4"),
    Mistake("template confirm gone.pdf --h 99 --v 99", "no such template", "give the PDF"),
    Mistake("template read photo.jpg", "--shape is needed", "--shape thesis-initial"),
    Mistake("template read hop.yaml --shape thesis-initial", "is not a picture", "save it as JPEG"),
    # places where nothing can be written
    Mistake("run hop.yaml --runs take.csv", "take.csv/", "name another folder"),
    Mistake("template thesis-initial --thickness 2mm --out take.csv", "take.csv", "name another"),
    # the command itself
    Mistake("runn", "No such command 'runn'", "Did you mean 'run'"),
    Mistake("run hop.yaml --bensh x", "No such option: --bensh", "--bench"),
    Mistake("run", "Missing argument", "Try 'workbench run -h'"),
]


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that the mistakes are made with; commands are given in it."""
    here = tmp_path / "desk"
    (here / "folder").mkdir(parents=True)
    monkeypatch.chdir(here)
    lab, take = LAB.read_text("utf-8"), EXPORT.read_text("utf-8")
    texts = {
        "hop.yaml": PROTOCOL,
        "empty.yaml": "",
        "tabs.yaml": PROTOCOL.replace("  - run", "\t- run"),
        "no-unit.yaml": PROTOCOL.replace("17 rad/s", "17"),
        "odd-unit.yaml": PROTOCOL.replace("17 rad/s", "17 rads"),
        "too-fast.yaml": PROTOCOL.replace("17 rad/s", "90 rad/s"),
        "backwards.yaml": PROTOCOL.replace("2 s", "-2 s"),
        "folder/hop-17.yaml": PROTOCOL,
        "grams.yaml": PROTOCOL.replace("hop, speed: 17 rad/s", "decay, pull: 40 g"),
        "seconds.yaml": PROTOCOL.replace("2 s", "2sec"),
        "comma.yaml": PROTOCOL.replace(" 2 s", ' "2,0 s"'),
        "misspelt.yaml": PROTOCOL.replace("speed", "sped"),
        "lab.yaml": lab,
        "no-takes.yaml": lab.replace("takes: exports", "takes: export"),
        "odd-supply.yaml": lab.replace("RD6006", "RD9999"),
        "channel.yaml": lab.replace("RD6006", "HMP4040").replace("{kind:", "{channel: 5, kind:"),
        "one-channel.yaml": lab.replace("{kind:", "{channel: 2, kind:"),
        "no-line.yaml": f"{lab[: lab.index('calibration:')]}calibration: day.yaml\n"
        f"{lab[lab.index('tracking:') :]}",
        "file-port.yaml": re.sub(r"port: \S+,", "port: take.csv,", lab),
        "short.yaml": SHAPE.read_text("utf-8").replace("-2.558,", ""),
        "sheet.yaml": SHEET,
        "take.csv": take,
        "cut.csv": take[: len(take) // 2],
        "empty.csv": "",
        "foreign.csv": "a,b\n1,2\n",
    }
    for name, text in texts.items():
        (here / name).write_text(text, encoding="utf-8")
    (here / "exports").mkdir()
    (here / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    failed = Bundle.create(here / "runs", "made", NOW, asked_for(title="A hop"))
    failed = Bundle.open(failed.path.rename(here / "runs" / "hop-run"))
    (failed.path / "take").mkdir(parents=True)
    for kind, name in (("model", "thesis"), ("shape", "thesis-initial")):
        shutil.copyfile(ROOT / "models" / f"{name}.yaml", failed.path / f"{kind}.yaml")
    return here


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda one: one.words)
@pytest.mark.usefixtures("desk")
def test_the_answer_says_what_is_wrong_and_what_to_do(workbench: Command, mistake: Mistake) -> None:
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        busy = str(held.getsockname()[1])
        answer = workbench(*mistake.words.replace("BUSY", busy).split())
    told = " ".join(answer.err.replace("│", " ").split())
    assert answer.code == mistake.code, answer.err
    assert mistake.wrong in told
    assert mistake.helps in told
    assert "Traceback" not in told
    assert answer.out == ""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")
def test_a_port_that_another_program_holds_is_named(workbench: Command, desk: Path) -> None:
    import pty

    ours, theirs = pty.openpty()
    bench = desk / "held.yaml"
    bench.write_text(re.sub(r"port: \S+,", f"port: {os.ttyname(theirs)},", LAB.read_text("utf-8")))
    with serial.Serial(os.ttyname(theirs), exclusive=True):
        answer = workbench("supply", "read", "--bench", bench)
    os.close(ours)
    os.close(theirs)
    assert answer.code == 3
    assert "is another program holding it" in answer.err
    assert "Close that program, or name another port" in answer.err


def test_a_port_that_this_user_may_not_open_says_which_group_to_join(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "ttyUSB0").touch()
    monkeypatch.setattr(os, "access", lambda place, mode: False)
    if sys.platform != "win32":
        assert "sudo usermod -aG dialout" in port_trouble(str(tmp_path / "ttyUSB0"))


def test_every_kind_of_file_is_known_by_its_name() -> None:
    assert set(KINDS) == set(SCHEMAS)


@pytest.mark.parametrize(
    ("words", "file", "code"),
    [("run hop.yaml", "hop.yaml", 2), ("runs show hop-run", "manifest.json", 0)],
    ids=["protocol", "bundle"],
)
@pytest.mark.usefixtures("desk")
def test_what_this_user_may_not_read_is_named(
    workbench: Command, monkeypatch: pytest.MonkeyPatch, words: str, file: str, code: int
) -> None:
    opened = Path.open

    def refused(path: Path, *args: Any, **kwargs: Any) -> Any:
        if path.name == file:  # rights bind no administrator, as whom tests may run
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return opened(path, *args, **kwargs)

    monkeypatch.setattr(Path, "open", refused)
    answer = workbench(*words.split())
    assert answer.code == code  # of a run, what else there is is shown
    assert f"{file}: cannot be read: Permission denied; this user may not" in answer.err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_named_with_what_helps(workbench: Command, desk: Path) -> None:
    name = workbench("template", "thesis-initial", "--thickness", "2mm", "--json").json["files"][0]
    (desk / "full").mkdir()
    (desk / "full" / Path(name).name).symlink_to("/dev/full")
    answer = workbench(
        "template", "draw", "thesis-initial", "--thickness", "2mm", "--out", desk / "full"
    )
    assert answer.code == 2
    assert "the disk is full; make room, or name a folder on another one" in answer.err
