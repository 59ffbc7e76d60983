"""A search goes on bit for bit from its checkpoint, and from no other file."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.optimize import killed
from tests.optimize.contract import ALGORITHMS, NAMES, beam, facts, ridges
from tests.optimize.searches import SEARCHES, SMALL, WHOLE
from workbench.errors import InputError, Interrupted
from workbench.optimize import (
    Cmaes,
    CmaesOptions,
    Evaluation,
    GeneticAlgorithm,
    GeneticOptions,
    History,
    Space,
    search,
)
from workbench.optimize.checkpoint import Checkpoint

ROOT = Path(__file__).resolve().parents[2]
PENALTY = (102.0,)
STOPS = {WHOLE: (24, 25, 100, 192, 240), SMALL: (25, 60)}


def hop(checkpoint: Path, evaluations: int = 96, **changes: Any) -> History:
    chosen: dict[str, Any] = {"problem": "hop at 17 rad/s", "algorithm": Cmaes(beam(), 1)}
    chosen |= changes
    return search(chosen["problem"], chosen["algorithm"], ridges(), evaluations=evaluations,
                  penalty=PENALTY, checkpoint=checkpoint)  # fmt: skip


@pytest.mark.parametrize(("name", "whole"), SEARCHES)
def test_a_search_goes_on_as_if_it_had_never_stopped(name: str, whole: int, tmp_path: Path) -> None:
    goals = ALGORITHMS[name](beam(), 0).goals

    def go(evaluations: int, checkpoint: Path | None) -> History:
        return search("ridges", ALGORITHMS[name](beam(), 2), ridges(goals), penalty=PENALTY * goals,
                      evaluations=evaluations, checkpoint=checkpoint)  # fmt: skip

    for evaluations in STOPS[whole]:
        go(evaluations, tmp_path / "search.json")
    assert facts(go(whole, tmp_path / "search.json")) == facts(go(whole, None))


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
@pytest.mark.parametrize("name", ["ga", "cma, impatient"])
def test_a_search_that_was_killed_goes_on_bit_for_bit(name: str, tmp_path: Path) -> None:
    checkpoint, dice, kills = tmp_path / "search.json", random.Random(0), 0
    for _ in range(2):
        done = _asked(checkpoint)
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.optimize.killed", name, str(checkpoint)], cwd=ROOT
        )
        try:
            wanted = min(done + dice.randrange(24, 160), killed.EVALUATIONS)
            while process.poll() is None and _asked(checkpoint) < wanted:
                time.sleep(dice.uniform(0.001, 0.04))
        finally:
            process.kill()
        kills += process.wait() == -9
        assert _asked(checkpoint) > done
    assert kills >= 1
    rest = killed.run(name, checkpoint, pause=0.0)
    assert facts(rest) == facts(killed.run(name, None, pause=0.0))


def _asked(checkpoint: Path) -> int:
    """Return how many candidates the file holds, which is whole at any moment."""
    if not checkpoint.exists():
        return 0
    return sum(len(g["keys"]) for g in json.loads(checkpoint.read_text())["generations"])


def test_what_is_known_is_not_evaluated_again(tmp_path: Path) -> None:
    def never(_: NDArray[np.float64]) -> list[Evaluation]:
        raise Interrupted("evaluated again")

    hop(tmp_path / "search.json", 96)
    history = search("hop at 17 rad/s", Cmaes(beam(), 1), never, evaluations=96,
                     penalty=PENALTY, checkpoint=tmp_path / "search.json")  # fmt: skip
    assert history.asked == 96


def test_writes_that_take_long_are_far_apart_and_none_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever ends the search: the file then holds its last generation."""
    now, writes, path = [0.0], [0], tmp_path / "search.json"
    written = Checkpoint.write

    def write(self: Checkpoint, *where: Any) -> None:
        written(self, *where)
        writes[0] += 1
        now[0] += 0.7

    def watch(history: History, _: int) -> None:
        now[0] += 1.0
        if history.asked == 8 * 30:
            raise Interrupted("enough")

    monkeypatch.setattr(Checkpoint, "write", write)
    monkeypatch.setattr("workbench.optimize.checkpoint.time.monotonic", lambda: now[0])
    with pytest.raises(Interrupted, match="enough"):
        search("n", Cmaes(beam(), 0), ridges(), evaluations=480, penalty=PENALTY,
               checkpoint=path, watch=watch)  # fmt: skip
    assert _asked(path) == 8 * 30
    assert writes[0] == 4, "after 0, 11 and 22 s, and at the end"


def test_numbers_that_json_has_no_word_for_are_kept(tmp_path: Path) -> None:
    worth = {"nan": float("nan"), "more": float("inf"), "less": -float("inf"), "tenth": 0.1}

    def evaluate(candidates: NDArray[np.float64]) -> list[Evaluation]:
        return [Evaluation((1.0,), worth) for _ in candidates]

    def go() -> History:
        return search("n", Cmaes(beam(), 0), evaluate, evaluations=8, penalty=PENALTY,
                      checkpoint=tmp_path / "search.json")  # fmt: skip

    go()
    json.loads((tmp_path / "search.json").read_text(), parse_constant=pytest.fail)
    assert repr(dict(go().trials[3].evaluation.numbers)) == repr(worth)


def test_a_crash_while_writing_leaves_the_last_generation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "search.json"
    before = hop(path, 48)

    def torn(*_: object) -> None:
        raise OSError("no space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", torn)
        with pytest.raises(OSError, match="no space left"):
            hop(path, 96)
    assert facts(hop(path, 48)) == facts(before)


def other_space() -> Space:
    space = beam()
    return Space(NAMES, space.lower, space.upper + 0.1, space.start)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (
            {"problem": "hop at 19 rad/s"},
            'problem is "hop at 17 rad/s" there and "hop at 19 rad/s" here',
        ),
        (
            {"algorithm": GeneticAlgorithm(beam(), 1)},
            'algorithm is "cma" there and "ga" here; options population_size is 8 there and 12',
        ),
        ({"algorithm": Cmaes(beam(), 2)}, "options seed is 1 there and 2 here; take another"),
        (
            {"algorithm": Cmaes(beam(), 1, CmaesOptions(sigma=0.11))},
            "options sigma is [0-9.]+ there and 0.11 here",
        ),
        ({"algorithm": Cmaes(other_space(), 1)}, r"space upper is \[-1.0, 0.5.* \.\.\. there and"),
    ],
)
def test_another_search_s_file_is_refused_and_told_apart(
    changes: dict[str, Any], told: str, tmp_path: Path
) -> None:
    hop(tmp_path / "search.json", 48)
    before = (tmp_path / "search.json").read_bytes()
    with pytest.raises(InputError, match=rf"search\.json: of another search: .*{told}"):
        hop(tmp_path / "search.json", **changes)
    assert (tmp_path / "search.json").read_bytes() == before


def edited(text: str) -> str:
    content = json.loads(text)
    next(iter(content["trials"].values()))["fitness"] = [0.0]
    return json.dumps(content)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda text: text[: len(text) // 2], "not whole, .*; take another file, or delete it"),
        (lambda text: "", "not whole, Expecting value"),
        (lambda text: "[" * 100_000, "not whole, maximum recursion"),
        (lambda text: '{"schema": "workbench/shape-1"}', r"no search of this .*workbench/search-1"),
        (lambda text: "[]", "no search of this workbench"),
        (edited, "changed since it was written, its checksum differs"),
    ],
)
def test_a_torn_or_edited_file_is_refused(
    change: Callable[[str], str], told: str, tmp_path: Path
) -> None:
    path = tmp_path / "search.json"
    hop(path, 24)
    path.write_text(change(path.read_text()))
    with pytest.raises(InputError, match=rf"search\.json: {told}"):
        hop(path)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "search.json"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"search\.json: not whole"):
        hop(path)
    with pytest.raises(InputError, match="cannot be read, Is a directory"):
        hop(tmp_path)


def test_a_search_can_be_given_more_evaluations(tmp_path: Path) -> None:
    options = GeneticOptions(generations=10)
    short = hop(tmp_path / "s.json", 60, algorithm=GeneticAlgorithm(beam(), 1, options))
    longer = hop(tmp_path / "s.json", 120, algorithm=GeneticAlgorithm(beam(), 1, options))
    assert facts(longer)[:60] == facts(short)
    assert longer.asked == 120
