"""What a run stops on: words and units, and benches that cannot see it."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest

from workbench.errors import FileFaults
from workbench.run import load_bench
from workbench.schemas import Plan, Protocol, StopWhen, load, make_plan

WORDS = "prediction error above 5 mm for 0.2 s"
RUN = "mode: hop, speed: 17 rad/s"


def plan(folder: Path, stop: str, run: str = RUN, *, live: bool = True) -> Plan:
    path = folder / "p.yaml"
    step = f"  - run: {{{run}, stop_when: {stop}}}"
    path.write_text(f"schema: workbench/protocol-1\ntitle: Test\nsteps:\n{step}\n")
    bench = load_bench("virtual").content
    if live:
        stream = type(bench.tracking).model_validate({"live": {"server": "127.0.0.1"}})
        bench = bench.model_copy(update={"tracking": stream})
    return make_plan(load(path, Protocol), bench, Decimal("0.01"))


@pytest.mark.parametrize(
    ("words", "limit"),
    [
        (WORDS, StopWhen(0.005, 0.2)),
        ("prediction error above 0.8 cm  for 150 ms", StopWhen(0.008, 0.15)),
    ],
)
def test_words_and_units_become_a_limit(tmp_path: Path, words: str, limit: StopWhen) -> None:
    (run,) = plan(tmp_path, words).runs
    assert run.stop_when is not None
    assert run.stop_when == pytest.approx(limit)


def test_a_limit_says_what_it_was_read_from() -> None:
    assert StopWhen(0.005, 0.2).words == WORDS


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("error above 5 mm", f"is nothing to stop on; write '{WORDS}'"),
        ("5 mm", f"is nothing to stop on; write '{WORDS}'"),
        ("0.005", f"is nothing to stop on; write '{WORDS}'"),
        ("prediction error above 5 for 0.2 s", "mm"),
        ("prediction error above 5 mm for 0.2 rad", "'0.2 rad'"),
        ("prediction error above 0 mm for 0.2 s", "give one above 0 mm and up to 1 m"),
        ("prediction error above 5 mm for 60 s", "for 60 s is outside of 0 s to 10 s"),
    ],
)
def test_other_words_are_refused_with_the_form(tmp_path: Path, words: str, message: str) -> None:
    with pytest.raises(FileFaults, match="stop_when") as error:
        plan(tmp_path, words)
    assert message in str(error.value)


def test_a_bench_whose_cameras_do_not_stream_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileFaults, match="stop_when needs cameras that stream, and bench 'v"):
        plan(tmp_path, WORDS, live=False)


def test_a_run_without_a_drive_has_nothing_to_stop(tmp_path: Path) -> None:
    with pytest.raises(FileFaults, match="mode decay has no drive; remove stop_when"):
        plan(tmp_path, WORDS, "mode: decay, pull: 0.39 N")
