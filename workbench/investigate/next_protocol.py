"""Trials of the hopping robot as protocol files: the menu of a bench, and the one to run next."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

from workbench.bundle import Bundle
from workbench.diagnose import Diagnosis
from workbench.errors import FileFaults, InputError
from workbench.investigate.next_experiment import propose
from workbench.investigate.proposed import TIMES, Proposal, ProposedRun
from workbench.progress import Progress
from workbench.run import make_bench
from workbench.schemas import (
    BenchFile,
    Document,
    ModelFile,
    Protocol,
    ShapeFile,
    builtin_folder,
    load,
    make_plan,
    parse,
    with_calibration,
)

__all__ = [
    "MENU",
    "Following",
    "bench_of",
    "following",
    "menu_of",
    "name_for",
    "next_object",
    "write_next",
]

_REST_S, _DURATION_S = 2.0, 8.0
_LONGEST_TITLE = 120
_LIKELY = 0.5  # chance from which a pair is mentioned
_PAIRS = 3

_AMOUNTS: dict[str, tuple[float, ...]] = {
    "clamped": (6.0, 7.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 20.0),
    "decay": (0.1, 0.2, 0.4, 0.6, 0.8, 1.0),
    "hop": (15.0, 16.0, 17.0, 18.0, 19.0, 20.0),
    "drop": (0.01, 0.02, 0.03, 0.04),
}
"""Mode -> speeds [rad/s], pulls [N] or heights [m]. Between 7 and 11 rad/s the clamped beam swings
by 0.3 m and hardly repeats; what it shows there is chance."""
_KEYS = {
    "clamped": ("speed", 1.0, "rad/s"),
    "hop": ("speed", 1.0, "rad/s"),
    "decay": ("pull", 1.0, "N"),
    "drop": ("height", 1000.0, "mm"),
}
"""Mode -> key of a protocol, factor from SI, unit."""
_BEFORE = {
    "clamped": "Wait until the beam is still.",
    "hop": "Stand the robot on the start line, facing the hopping direction.",
}

MENU = tuple(
    ProposedRun(mode, amount, _DURATION_S, _REST_S)
    for mode, amounts in _AMOUNTS.items()
    for amount in amounts
)
"""What the protocol language can ask of the robot."""


class Following:
    """What should be run after a diagnosis.

    Args:
        proposal: the runs and what is expected of them.
        protocol: the file.
    """

    def __init__(self, proposal: Proposal, protocol: Document[Protocol]) -> None:
        self.proposal, self.protocol = proposal, protocol

    @property
    def sentence(self) -> str:
        """Return it in words: the runs, and the pairs that they distinguish, the hardest first."""
        proposal = self.proposal
        runs = ", ".join(_worded(trial) for trial in proposal.trials)
        likely = [one for one in proposal.separations if one.chance >= _LIKELY]
        pairs = "; ".join(
            f"if {one.truth} is true, {one.alternative} is {one.distance:.1f} sigma off"
            for one in likely[:_PAIRS]
        )
        likely = f"probability of rejecting a wrong cause {100 * proposal.chance:.0f} %"
        sentence = f"{runs}, each {TIMES} times, about {proposal.minutes:.0f} min: {likely}"
        return sentence + (f" ({pairs})" if pairs else "")


def next_object(proposed: Following | None) -> dict[str, Any]:
    """Return what the command line's object says of the next experiment."""
    if proposed is None:
        return {"next_protocol": None, "next_experiment": None}
    experiment = proposed.proposal.as_json()
    return {"next_protocol": str(proposed.protocol.path), "next_experiment": experiment}


def following(
    found: Diagnosis, bundles: Sequence[Bundle], out: Path, name: str, progress: Progress
) -> Following | None:
    """Propose what the bench of some runs should do next and write it as a protocol.

    Args:
        found: the diagnosis of these runs.
        bundles: of the runs, of one robot.
        out: folder that `<name>-next.yaml` is written into.
        name: of the diagnosis.
        progress: called at each stage.

    Returns:
        None where nothing is left to separate, or no run that the bench can make does it.

    Raises:
        InputError: when the file exists.
    """
    proposal = propose(found, menu_of(bench_of(bundles)), progress)
    if proposal is None:
        return None
    first = bundles[0]
    model, shape = (
        name_for(first.document("model"), ModelFile, out),
        name_for(first.document("shape"), ShapeFile, out),
    )
    return Following(proposal, write_next(out / f"{name}-next.yaml", name, proposal, model, shape))


def bench_of(bundles: Sequence[Bundle]) -> Document[BenchFile] | None:
    """Return the bench that the last of some runs were made on; None where a sheet made them."""
    for bundle in reversed(bundles):
        file = bundle.document("bench")
        if file.exists():
            return with_calibration(load(file, BenchFile), bundle.document("calibration"))
    return None


def menu_of(bench: Document[BenchFile] | None) -> list[ProposedRun]:
    """Return the trials that a bench can make; all of them where no bench is known."""
    if bench is None:
        return list(MENU)
    step = make_bench(bench.content).voltage_step
    return [trial for trial in MENU if _can(trial, bench.content, step)]


def write_next(
    path: Path, name: str, proposal: Proposal, model: str, shape: str
) -> Document[Protocol]:
    """Write a proposal as a protocol, checked like any other, and return it as read back.

    Args:
        path: of the new file.
        name: of the diagnosis.
        proposal: the runs.
        model: as the file names it.
        shape: as the file names it.

    Raises:
        InputError: when the file exists.
    """
    if path.exists():
        raise InputError(f"{path}: exists; a protocol is never changed, give another --out")
    text = _text(name, proposal, [f"model: {json.dumps(model)}", f"shape: {json.dumps(shape)}"])
    document = parse(path, text, Protocol)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return document


def _text(name: str, proposal: Proposal, robot: Sequence[str] = ()) -> str:
    pairs = [
        f"#   if {one.truth} is true, {one.alternative} stays {one.distance:.1f} sigma off: "
        f"rejected with a probability of {100 * one.chance:.0f} %"
        for one in proposal.separations
    ]
    title = f"Next experiment of {name}"[:_LONGEST_TITLE]
    return "\n".join([
        f"# Proposed by diagnosis {json.dumps(name)}; about {proposal.minutes:.1f} min with all "
        "handling. Expected:",
        *pairs,
        "schema: workbench/protocol-1",
        f"title: {json.dumps(title)}",
        *robot,
        "steps:",
        *_steps(proposal.trials),
        "",
    ])  # fmt: skip


def _steps(trials: Sequence[ProposedRun]) -> list[str]:
    """Return the lines of the steps, mode by mode."""
    lines: list[str] = []
    for mode in _KEYS:
        own = [trial for trial in trials if trial.mode == mode]
        if own and mode == "clamped":
            lines.append("  - prompt: Clamp the foot.")
        before = f", before: [{json.dumps(_BEFORE[mode])}]" if mode in _BEFORE else ""
        for trial in own:
            key, factor, unit = _KEYS[mode]
            lines.append(
                f"  - run: {{mode: {mode}, {key}: {factor * trial.amount:g} {unit}, rest: "
                f"{trial.rest:g} s, duration: {trial.duration:g} s, repeats: {TIMES}{before}}}"
            )
    return lines


def _can(trial: ProposedRun, bench: BenchFile, voltage_step: Decimal) -> bool:
    """Return whether a bench allows a trial."""
    asked = Proposal((trial,), 0.0, (), 0.0)
    try:
        make_plan(parse(Path("trial.yaml"), _text("menu", asked), Protocol), bench, voltage_step)
    except FileFaults:
        return False
    return True


def name_for(file: Path, schema: type[ModelFile] | type[ShapeFile], folder: Path) -> str:
    """Return how a protocol in a folder names a file: built in by its name, else by its path."""
    name = load(file, schema).content.name
    built_in = builtin_folder() / f"{name}.yaml"
    if built_in.exists() and built_in.read_bytes() == file.read_bytes():
        return name
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()


def _worded(trial: ProposedRun) -> str:
    _, factor, unit = _KEYS[trial.mode]
    return f"{trial.mode} {factor * trial.amount:g} {unit}"
