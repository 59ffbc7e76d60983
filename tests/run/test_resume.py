"""An experiment that was cut off at any instant goes on with what is on disk."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from datetime import datetime
from decimal import Decimal
from pathlib import Path

import pytest

from tests.bundles import asked_for, journal_of, manifest_of, note
from workbench.bundle import Bundle, verify
from workbench.errors import FileFaults, InputError
from workbench.run import (
    Course,
    Experiment,
    QuietOperator,
    carry_out,
    foresee,
    load_bench,
    read_experiment,
    resume,
)
from workbench.run.bench import VirtualBench

TEXT = """\
schema: workbench/protocol-1
title: Four runs
steps:
  - prompt: Clamp the foot.
  - sweep:
      {mode: clamped, voltages: [3 V, 4 V], repeats: 2, order: random, seed: 3,
       rest: 0.5 s, ramp: 0.2 s, duration: 1 s}
"""


class KilledError(BaseException):
    """Nothing catches it, as nothing catches SIGKILL."""


class Recorder(QuietOperator):
    def __init__(self) -> None:
        super().__init__()
        self.asked: list[str] = []

    def confirm(self, text: str) -> None:
        self.asked.append(text)


def experiment(folder: Path, text: str = TEXT) -> Experiment:
    path = folder / "p.yaml"
    path.write_text(text)
    bench = load_bench("virtual")
    return read_experiment(path, bench, VirtualBench(bench.content).voltage_step)


def runs(
    asked: Experiment,
    root: Path,
    course: Course | None = None,
    bench: VirtualBench | None = None,
    operator: QuietOperator | None = None,
) -> Iterator[Bundle]:
    lab = bench or VirtualBench(asked.bench.content)
    return carry_out(asked, lab, root, operator or QuietOperator(), lambda text: None, course)


def bundles(root: Path) -> list[Bundle]:
    return [Bundle.open(path) for path in sorted(root.iterdir()) if path.is_dir()]


def killed_after(bench: VirtualBench, waits: int) -> None:
    """Let the program die in a wait of its clock."""
    sleep, left = bench.clock.sleep, iter(range(waits))

    def dying(seconds: float) -> None:
        if next(left, None) is None:
            raise KilledError
        sleep(seconds)

    bench.clock.sleep = dying  # type: ignore[method-assign]


@pytest.fixture(autouse=True)
def _no_views(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twins and views take most of a run's time and have no part in this."""
    monkeypatch.setattr("workbench.run.engine.compare_with_twin", lambda bundle: None)


@pytest.mark.parametrize("seed", range(10))
def test_killed_at_any_instant_it_ends_with_every_condition_once(tmp_path: Path, seed: int) -> None:
    asked, root, rng = experiment(tmp_path), tmp_path / "runs", random.Random(seed)
    course = None
    for _ in range(3):
        bench = VirtualBench(asked.bench.content)
        killed_after(bench, rng.randrange(2, 40))
        with suppress(KilledError):
            list(runs(asked, root, course, bench))
        if not root.exists():
            continue
        course = resume(bundles(root)[0].path, root, asked.inputs())
    list(runs(asked, root, course))
    every = bundles(root)
    good = [manifest_of(b) for b in every if manifest_of(b)["status"] == "complete"]
    good.sort(key=lambda facts: facts["number"])
    assert [f["number"] for f in good] == [1, 2, 3, 4]
    planned = [(float(run.action.voltage), run.repeat) for run in asked.plan.runs]  # type: ignore[union-attr]
    assert [(f["voltage_V"], f["repeat"]) for f in good] == planned
    assert len({f["experiment"] for f in good}) == 1
    attempts = Counter(manifest_of(b)["number"] for b in every)
    assert {f["number"]: f["attempt"] for f in good} == dict(attempts)
    assert all(verify(b.path) == [] for b in every)


def test_what_broke_off_stays_and_says_so(tmp_path: Path) -> None:
    asked, root = experiment(tmp_path), tmp_path / "runs"
    bench, operator = VirtualBench(asked.bench.content), Recorder()
    killed_after(bench, 5)
    with pytest.raises(KilledError):
        list(runs(asked, root, None, bench))
    (broken,) = bundles(root)
    lines = journal_of(broken)
    (wrong,) = verify(broken.path)
    assert wrong.startswith("checksums.txt: missing; the run was cut off (status failed)")
    assert wrong.endswith("the output is off, confirmed")  # the block around the supply saw to it
    course = resume(broken.path, root, asked.inputs())
    assert (course.done, dict(course.tries)) == (frozenset(), {1: 1})
    done = list(runs(asked, root, course, operator=operator))
    assert operator.asked == ["Clamp the foot."]
    again = Bundle.open(broken.path)
    assert journal_of(again) == lines
    assert manifest_of(again)["error"].startswith("the program ended without a word here")
    assert verify(broken.path) == []
    assert [manifest_of(b)["attempt"] for b in done] == [2, 1, 1, 1]


def test_prompts_of_runs_that_are_done_are_not_asked_again(tmp_path: Path) -> None:
    asked, root, operator = experiment(tmp_path), tmp_path / "runs", Recorder()
    first = next(runs(asked, root))
    course = resume(first.path, root, asked.inputs())
    assert course.done == {1}
    rest = list(runs(asked, root, course, operator=operator))
    assert [manifest_of(b)["number"] for b in rest] == [2, 3, 4]
    assert operator.asked == []


def test_noise_goes_on_where_it_was(tmp_path: Path) -> None:
    asked = experiment(tmp_path)
    whole = [b.take().read_bytes() for b in runs(asked, tmp_path / "whole")]
    first = next(runs(asked, tmp_path / "cut"))
    course = resume(first.path, tmp_path / "cut", asked.inputs())
    rest = [b.take().read_bytes() for b in runs(asked, tmp_path / "cut", course)]
    assert rest == whole[1:]


def test_a_changed_input_cannot_be_resumed(tmp_path: Path) -> None:
    asked, root = experiment(tmp_path), tmp_path / "runs"
    first = next(runs(asked, root))
    other = experiment(tmp_path, TEXT.replace("4 V", "5 V"))
    with pytest.raises(InputError, match=r"protocol p.yaml was changed. Put it back as it was"):
        resume(first.path, root, other.inputs())
    gone = {k: v for k, v in asked.inputs().items() if not k.startswith("model")}
    with pytest.raises(InputError, match=r"model thesis.yaml is gone"):
        resume(first.path, root, gone)


@pytest.mark.parametrize(
    "text",
    [
        f"# a comment\n{TEXT}",
        TEXT.replace("title: Four runs", "title:   'Four runs'   # said better"),
        TEXT.replace("rest: 0.5 s", "rest: 500 ms"),
        TEXT.replace("rest: 0.5 s, ramp: 0.2 s", "ramp: 0.2 s, rest: 0.5 s"),
    ],
)
def test_what_comes_to_the_same_is_the_same(tmp_path: Path, text: str) -> None:
    asked, root = experiment(tmp_path), tmp_path / "runs"
    first = next(runs(asked, root))
    assert resume(first.path, root, experiment(tmp_path, text).inputs()).done == {1}


def test_an_experiment_of_which_the_texts_were_kept_goes_on(tmp_path: Path) -> None:
    asked, root = experiment(tmp_path), tmp_path / "runs"
    first = next(runs(asked, root))
    kept = asked.texts() | {"calibration": asked.inputs()["calibration"]}
    note(first, inputs=kept)
    assert resume(first.path, root, asked.inputs(), asked.texts()).done == {1}
    other = experiment(tmp_path, f"# a comment\n{TEXT}")
    with pytest.raises(InputError, match=r"protocol p.yaml was changed"):
        resume(first.path, root, other.inputs(), other.texts())


LAB = Path(__file__).parents[2] / "docs" / "examples" / "lab-bench.yaml"
PORT = "/dev/serial/by-id/usb-1a86_USB_Serial-if00-port0"


def lab(folder: Path, *changes: tuple[str, str]) -> Experiment:
    text = LAB.read_text(encoding="utf-8").partition("  takes:")[0]
    for given, other in changes:
        assert given in text
        text = text.replace(given, other)
    (folder / "lab.yaml").write_text(text)
    (folder / "p.yaml").write_text(TEXT)
    return read_experiment(folder / "p.yaml", load_bench(str(folder / "lab.yaml")), Decimal("0.01"))


def begun(root: Path, asked: Experiment, **facts: object) -> Path:
    """A run of a real bench that was made."""
    facts = {"experiment": "e", "number": 1, "inputs": asked.inputs(), **facts}
    bundle = Bundle.create(root, "x", datetime.now(), asked_for())
    note(bundle, **facts)
    bundle.finish("complete")
    return bundle.path


OTHER_PORT = (PORT, "/dev/ttyUSB1")
NUMBERED = ("model: RD6006", "model: RD6006\n  serial: 1234")
READ = {"supply": {"model": "RD6006", "serial": "00001234", "firmware": "1.41"}}


def test_the_same_supply_may_be_reached_in_another_way(tmp_path: Path) -> None:
    run = begun(tmp_path / "runs", lab(tmp_path, NUMBERED))
    tcp = (
        f"{{kind: serial, port: {PORT}, baud: 115200}}",
        "{kind: rtu-over-tcp, address: '10.0.0.5:5020'}",
    )
    for way in (OTHER_PORT, tcp, ("baud: 115200", "baud: 9600")):
        assert resume(run, tmp_path, lab(tmp_path, NUMBERED, way).inputs()).done == {1}
    # what the supply said then will do as well
    run = begun(tmp_path / "read", lab(tmp_path), **READ)
    assert resume(run, tmp_path, lab(tmp_path, NUMBERED, OTHER_PORT).inputs()).done == {1}


def test_a_supply_that_could_be_another_is_refused(tmp_path: Path) -> None:
    run = begun(tmp_path / "runs", lab(tmp_path), **READ)
    with pytest.raises(InputError, match=r"could be another one. Write serial: '00001234' under"):
        resume(run, tmp_path, lab(tmp_path, OTHER_PORT).inputs())
    other = ("model: RD6006", "model: RD6006\n  serial: 9")
    with pytest.raises(
        InputError, match=r"serial number 00001234, and the bench file names 0000000"
    ):
        resume(run, tmp_path, lab(tmp_path, other).inputs())
    assert resume(run, tmp_path, lab(tmp_path).inputs()).done == {1}


@pytest.mark.parametrize(
    "change",
    [
        ("voltage: 5.5 V,", "voltage: 5.4 V,"), ("slew: 20 V/s", "slew: 19 V/s"),
        ("model: RD6006", "model: RD6012"), ("up: y", "up: x"), ("slope: 4.4", "slope: 4.3"),
        ("rotor: Rotor", "rotor: R"), ("name: lab", "name: other"),
    ],
)  # fmt: skip
def test_whatever_changes_what_is_measured_is_refused(
    tmp_path: Path, change: tuple[str, str]
) -> None:
    run = begun(tmp_path / "runs", lab(tmp_path))
    with pytest.raises(InputError, match=r"(bench lab.yaml|calibration) was changed"):
        resume(run, tmp_path, lab(tmp_path, change).inputs())


def test_a_folder_of_exports_that_is_not_there_is_told_before_the_run(tmp_path: Path) -> None:
    here = ("bodies:", f"takes: {tmp_path / 'gone'}\n  bodies:")
    with pytest.raises(FileFaults, match=r"lab.yaml:\d+:3: takes: no such folder: .*gone; make or"):
        lab(tmp_path, here)
    (tmp_path / "gone").mkdir()
    lab(tmp_path, here)


def test_what_would_be_resumed_is_foreseen_and_nothing_is_changed(tmp_path: Path) -> None:
    asked, root = experiment(tmp_path), tmp_path / "runs"
    first = next(runs(asked, root))
    name = manifest_of(first)["experiment"]
    left = Bundle.create(root, "open", datetime.now(), asked_for(experiment=name, number=2))
    course = foresee(first.path, root, asked.inputs())
    assert (course.done, dict(course.tries)) == ({1}, {1: 1, 2: 1})
    assert not left.is_closed()


def test_a_run_without_an_experiment_is_told(tmp_path: Path) -> None:
    box = Bundle.create(tmp_path, "x", datetime.now())
    with pytest.raises(InputError, match="belongs to no experiment, so there is nothing to resume"):
        resume(box.path, tmp_path, {})


def test_what_another_process_carries_out_is_not_resumed(tmp_path: Path) -> None:
    asked, root = experiment(tmp_path), tmp_path / "runs"
    first = next(runs(asked, root))
    name = manifest_of(first)["experiment"]
    left = Bundle.create(root, "open", datetime.now(), asked_for(experiment=name, number=2))
    hold = (
        "import sys, time; from pathlib import Path; from workbench.run.control import claim\n"
        + ("with claim(Path(sys.argv[1]), sys.argv[2], {}):\n    print(flush=True); time.sleep(60)")
    )
    command = [sys.executable, "-c", hold, str(root), name]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        words = rf"{left.path.name} cannot be resumed: process {other.pid} still carries out"
        with pytest.raises(InputError, match=words):
            resume(first.path, root, asked.inputs())
        assert not left.is_closed()  # it is not ours to close
        other.kill()
    assert resume(first.path, root, asked.inputs()).done == {1}
    assert left.is_closed()


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_real_process_that_is_killed_goes_on_by_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text(TEXT.replace("repeats: 2, ", ""))
    command = [sys.executable, "-c", "from workbench.cli import main; main()", "run", "p.yaml"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 120
        while len(list(tmp_path.glob("runs/*/journal.jsonl"))) < 2:
            assert process.poll() is None, "it ended before it could be killed"
            assert time.monotonic() < deadline
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
    before = bundles(tmp_path / "runs")
    kept = {b.path: (b.path / "journal.jsonl").read_bytes() for b in before}
    resumed = subprocess.run(
        [*command, "--resume", before[-1].path.name], cwd=tmp_path, capture_output=True, text=True
    )
    assert resumed.returncode == 0, resumed.stderr
    assert "runs are complete" in resumed.stderr
    good = [
        manifest_of(b) for b in bundles(tmp_path / "runs") if manifest_of(b)["status"] == "complete"
    ]
    assert sorted(f["number"] for f in good) == [1, 2]
    assert all((path / "journal.jsonl").read_bytes() == text for path, text in kept.items())


def test_a_protocol_s_name_resumes_its_newest_experiment(tmp_path: Path) -> None:
    asked, root = experiment(tmp_path), tmp_path / "runs"
    next(first := runs(asked, root))
    first.close()  # type: ignore[attr-defined]
    made = bundles(root)[0].experiment
    assert resume(Path("p"), root, asked.inputs()).id == made
    assert resume(Path(made or ""), root, asked.inputs()).done == {bundles(root)[0].asked.number}
    next(runs(asked, root))
    with pytest.raises(InputError, match="names runs of 2 experiments; name one of them"):
        resume(root, root, asked.inputs())
