"""A real bench's run: a supply on a port, a person at the cameras, exports in a folder."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from datetime import datetime, timedelta
from decimal import Decimal
from pathlib import Path

import pytest

from tests.bundles import journal_of, manifest_of
from tests.conftest import Command
from workbench.bundle import Bundle, verify
from workbench.errors import HardwareError, InputError, Interrupted
from workbench.hw import serve
from workbench.run import Experiment, RealBench, add_take, carry_out, load_bench
from workbench.run.bench import CameraSpan, Subject, VirtualBench
from workbench.run.takes import AnsweredAt
from workbench.schemas import (
    BenchFile,
    Document,
    ModelFile,
    Protocol,
    ShapeFile,
    load,
    load_model,
    load_shape,
    make_plan,
)

pytestmark = pytest.mark.usefixtures("without_views")

STEPS = "  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, duration: 2 s}\n"
TEN_MINUTES = timedelta(minutes=10)


class Studio:
    """The tracking PC and the person at it: films the robot that hangs on a simulated supply.

    Args:
        lab: its supply is the bench's supply.
        place: where exports go.
        scratch: a folder of its own.
    """

    present = True
    answered_at: AnsweredAt = "terminal"

    def __init__(self, lab: VirtualBench, place: Path, scratch: Path) -> None:
        self.lab, self.place, self.scratch = lab, place, scratch
        self.late = timedelta()
        self.began = datetime.min
        self.start = self.stop = 0.0
        self.at_export: Callable[[], object] = self.export
        self.told: list[str] = []
        self.answers: list[str] = []

    def show_text(self, text: str) -> None:
        self.told.append(text)
        if text.startswith("Stop recording"):
            self.stop = self.lab.clock.now()
            self.at_export()

    def show_picture(self, picture: Path) -> None:
        raise AssertionError(picture)

    def confirm(self, text: str) -> None:
        assert text == "Start recording in the tracking software."
        self.start, self.began = self.lab.clock.now(), datetime.now()

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        self.told.append(text)
        if text.startswith("Stop recording"):
            self.stop = self.lab.clock.now()
            self.at_export()
        return self.answers.pop(0)

    def film(self) -> Path:
        """Return an export of what happened while the recording ran."""
        window = CameraSpan(self.start, self.stop, self.began + self.late)
        box = Bundle.create(self.scratch, "film", datetime.now())
        model, shape = load_model("thesis", self.place), load_shape("thesis-initial", self.place)
        subject = Subject(model.content, shape.content, "hop")
        return self.lab.collect(subject, window, box, self)

    def export(self) -> None:
        film = self.film()
        film.rename(self.place / film.name)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "exports").mkdir()
    return tmp_path / "exports"


@pytest.fixture
def studio(tmp_path: Path, place: Path) -> Studio:
    file = load_bench("virtual").content
    assert file.virtual is not None
    motive = file.virtual.model_copy(update={"export": "motive-1.23"})
    lab = VirtualBench(file.model_copy(update={"virtual": motive}))
    return Studio(lab, place, tmp_path / "scratch")


@pytest.fixture
def lab_file(root: Path, tmp_path: Path, studio: Studio) -> Iterator[Path]:
    """A bench file whose supply is the studio's, on loopback, and whose exports have a folder."""
    text, _, _ = (
        (root / "workbench" / "run" / "bench-virtual.yaml").read_text().partition("virtual:\n")
    )
    with serve(studio.lab.device, framing="rtu") as address:
        connection = f"{{kind: rtu-over-tcp, address: '{address}'}}"
        text = text.replace("{kind: simulated}", connection) + f"  takes: '{studio.place}'\n"
        (tmp_path / "lab.yaml").write_text(text)
        yield tmp_path / "lab.yaml"


def runs(lab: Path, studio: Studio) -> Iterator[Bundle]:
    folder, bench = lab.parent, load(lab, BenchFile)
    (folder / "p.yaml").write_text(f"schema: workbench/protocol-1\ntitle: Test\nsteps:\n{STEPS}")
    protocol = load(folder / "p.yaml", Protocol)
    plan = make_plan(protocol, bench.content, Decimal("0.01"))
    asked = Experiment(protocol, bench, *_robot(folder), plan)
    device = RealBench(bench.content, studio.lab.clock)
    return carry_out(asked, device, folder / "runs", studio, lambda text: None)


def _robot(folder: Path) -> tuple[Document[ModelFile], Document[ShapeFile]]:
    return load_model("thesis", folder), load_shape("thesis-initial", folder)


def only_bundle(lab: Path) -> Bundle:
    (path,) = (lab.parent / "runs").iterdir()
    return Bundle.open(path)


def events(bundle: Bundle) -> list[str]:
    return [e["event"] for e in journal_of(bundle) if e["event"].startswith("take")]


def test_the_run_goes_on_when_its_export_appears(lab_file: Path, studio: Studio) -> None:
    (studio.place / "yesterday.csv").write_text("no export at all")
    (bundle,) = runs(lab_file, studio)
    assert manifest_of(bundle)["status"] == "complete"
    assert manifest_of(bundle)["real"]["speed_rad_s"] == pytest.approx(16.93, abs=0.3)
    assert bundle.take().read_bytes() == (studio.place / bundle.take().name).read_bytes()
    assert events(bundle) == ["take_wanted", "take_accepted"]
    assert verify(bundle.path) == []


def test_the_operator_can_insist_on_a_take_without_a_folder(lab_file: Path, studio: Studio) -> None:
    lab_file.write_text(lab_file.read_text().partition("  takes:")[0])
    studio.late = -TEN_MINUTES
    studio.at_export = lambda: studio.answers.extend([str(studio.film()), "yes"])
    (bundle,) = runs(lab_file, studio)
    assert manifest_of(bundle)["status"] == "complete"
    assert "0:10:00 before this run's cameras" in manifest_of(bundle)["take_forced"][0]
    assert "Another path, or yes to take it all the same" in studio.told[-1]


def test_a_folder_that_is_not_there_ends_the_run_before_the_motor_turns(
    lab_file: Path, studio: Studio
) -> None:
    studio.place.rmdir()
    with pytest.raises(HardwareError, match=r"exports: the folder of exports cannot be listed"):
        list(runs(lab_file, studio))
    turns_at = 2.9 / 4.4  # by the calibrated line; the scale was checked below it
    assert max(volts for _, volts in studio.lab.device.history) < turns_at


def missed(lab: Path, studio: Studio) -> Bundle:
    """Carry out a run whose export does not come in time."""
    studio.at_export = lambda: None
    with pytest.raises(HardwareError, match="no export of this run appeared within 30 min") as told:
        list(runs(lab, studio))
    bundle = only_bundle(lab)
    assert str(told.value).endswith(
        f"add its take later: workbench ingest TAKE --into {bundle.path}\n"
        f"go on: workbench run {lab.parent / 'p.yaml'} --bench {lab} --resume {bundle.path}"
    )
    assert "the output is off, confirmed" in str(told.value)
    return bundle


def test_a_take_that_did_not_come_can_be_added_later(
    lab_file: Path, studio: Studio, workbench: Command
) -> None:
    bundle = missed(lab_file, studio)
    assert manifest_of(bundle)["status"] == "failed"
    assert len(bundle.series.read("supply")) > 5
    assert verify(bundle.path) == []

    answer = workbench("ingest", studio.film(), "--into", bundle.path, "--json")
    assert answer.code == 0, answer.err
    assert answer.json["status"] == "complete"
    assert answer.json["real"]["speed_rad_s"] == pytest.approx(16.93, abs=0.3)
    assert verify(bundle.path) == []
    again = Bundle.open(bundle.path)
    assert manifest_of(again)["error"] is None
    assert events(again) == ["take_wanted", "take_added"]

    twice = workbench("ingest", studio.film(), "--into", bundle.path)
    assert twice.code == 2
    assert "holds a take already" in twice.err


def test_a_take_of_another_run_is_not_added_unless_insisted_on(
    lab_file: Path, studio: Studio, workbench: Command
) -> None:
    bundle, studio.late = missed(lab_file, studio), TEN_MINUTES
    take = studio.film()
    before = {path: path.read_bytes() for path in bundle.path.rglob("*") if path.is_file()}
    refused = workbench("ingest", take, "--into", bundle.path.name, "--runs", bundle.path.parent)
    assert refused.code == 2
    assert "0:10:00 after this run's cameras" in refused.err
    assert "--insist adds it all the same" in refused.err
    assert before == {path: path.read_bytes() for path in bundle.path.rglob("*") if path.is_file()}
    forced = workbench("ingest", take, "--into", bundle.path, "--insist")
    assert forced.code == 0
    assert "error of the twin" in forced.out
    assert "0:10:00 after" in manifest_of(Bundle.open(bundle.path))["take_forced"][0]
    assert verify(bundle.path) == []


def test_a_take_is_added_to_a_run_that_was_cut_off_while_it_waited(
    lab_file: Path, studio: Studio
) -> None:
    bundle = missed(lab_file, studio)
    (bundle.path / "checksums.txt").unlink()  # as after a power cut
    add_take(studio.film(), Bundle.open(bundle.path), lambda text: None)
    assert manifest_of(Bundle.open(bundle.path))["status"] == "complete"
    assert verify(bundle.path) == []


def test_a_bundle_that_was_changed_gets_no_take(lab_file: Path, studio: Studio) -> None:
    bundle = missed(lab_file, studio)
    (bundle.path / "wire.log").write_text("")
    with pytest.raises(InputError, match=r"changed since the run: wire\.log: changed"):
        add_take(studio.film(), bundle, lambda text: None)
    assert not bundle.has_take()


def test_a_run_that_did_not_reach_its_end_gets_no_take(lab_file: Path, studio: Studio) -> None:
    def stop(text: str) -> None:
        raise KeyboardInterrupt

    studio.confirm = stop  # type: ignore[method-assign]
    with pytest.raises(Interrupted) as told:
        list(runs(lab_file, studio))
    assert "--into" not in str(told.value)
    with pytest.raises(InputError, match=r"it is no run that was measured to its end \(kind run"):
        add_take(Path("any.csv"), only_bundle(lab_file), lambda text: None)


def test_a_take_without_the_robot_fails_in_words_and_stays(
    lab_file: Path, studio: Studio, workbench: Command
) -> None:
    bundle = missed(lab_file, studio)
    take = studio.film()
    take.write_text(take.read_text().replace("Rotor", "Stray"))
    answer = workbench("ingest", take, "--into", bundle.path)
    assert answer.code == 2
    assert "the rotor 'Rotor' is not in the take" in answer.err
    assert manifest_of(Bundle.open(bundle.path))["status"] == "failed"
    assert verify(bundle.path) == []


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["x.yaml", "--into", "RUN"], "--into takes one export, not a sheet"),
        (["x.csv", "--insist"], "--insist goes with --into RUN"),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    workbench: Command, words: list[str], text: str
) -> None:
    answer = workbench("ingest", *words)
    assert answer.code == 2
    assert text in answer.err
