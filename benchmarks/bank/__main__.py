"""Run a draw of the bank: make each case, have it answered, score, write the page.

    python -m benchmarks.bank --seed 1 --cases 40 --work build/bank
    python -m benchmarks.bank --seed 34 --cases 200 --reduced
    python -m benchmarks.bank --seed 56 --cases 200 --held
    python -m benchmarks.bank --seed 38 --cases 40 --hops
    python -m benchmarks.bank --seed 46 --cases 200 --hops --of foot_cg sole_adhesion
    python -m benchmarks.bank --seed 34 --cases 200 --reduced --again
    python -m benchmarks.bank --seed 1 --flip hinge_cubic_stiffness

One line of JSON is kept for each case beside the page, where it is versioned: a later call, on any
machine, goes on where one was stopped, and the page reports all draws that were ever kept. Cases
lie in the work folder's `cases`, their labels in `sealed`; a process of its own answers, which is
given the case's folder only. With `--held` cases have nine runs of eight seconds without a hop;
with `--reduced` five of three seconds: a night holds hundreds, and what is small hardly shows. With
`--hops` all have twelve runs with three hops among them, and causes of about the size that is
asked, for to size one on hops takes half an hour. `--of` takes only the cases with one of the
effects named, `--again` those that an earlier state of the engine answered: their causes have the
amounts of the kept labels, for to find them takes longer than to answer. With `--flip` the cases of
one effect are answered once more by a twin that has it with the wrong sign.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.bank.baselines import NAMES
from benchmarks.bank.cases import draw_cases, held, hopping, reduced
from benchmarks.bank.kept import keep_all, kept
from benchmarks.bank.one_case import Line, alike, engine, run_case
from benchmarks.bank.resolving import ties_of
from benchmarks.bank.score import Judged, judge
from benchmarks.bank.tables import Reported, Turned, page

__all__ = ["reported_of"]

_FLIP = "-flip-"


def reported_of(folder: Path) -> Reported:
    """Return what all draws that are kept in a folder came to."""
    draws = {
        int(one.stem.removeprefix("seed-")): one
        for one in sorted(folder.glob("seed-*.jsonl"))
        if _FLIP not in one.name
    }
    lines = [line for draw in draws.values() for line in kept(draw).values()]
    answered = {line["seed"]: line for line in lines if "answer" in line}
    judged = {seed: judge(one["answer"], one["label"], one) for seed, one in answered.items()}
    plain = {
        name: [
            judge(one["plain"][name], one["label"])
            for one in answered.values()
            if name in one["plain"]
        ]
        for name in NAMES
    }
    failed = [
        f"case {line['seed']}: {line['failed']}".replace("\n", " ")
        for line in lines
        if "failed" in line
    ]
    engines = Counter(str(one.get("engine")) for one in answered.values())
    state = engine()
    before = alike(state)
    now = before | {state}
    newest = frozenset(seed for seed, one in answered.items() if one.get("engine") in now)
    signs = list(_signs(folder, judged))
    return Reported(
        tuple(judged.values()), plain, signs, ties_of(folder), len(lines), failed, tuple(draws),
        engines, newest, before,
    )  # fmt: skip


def _signs(folder: Path, judged: dict[int, Judged]) -> Iterator[Turned]:
    turned: dict[str, dict[int, Line]] = {}
    for file in sorted(folder.glob(f"seed-*{_FLIP}*.jsonl")):
        lines = turned.setdefault(file.stem.partition(_FLIP)[2], {})
        lines |= {seed: one for seed, one in kept(file).items() if "answer" in one}
    for effect, lines in turned.items():
        both = [seed for seed in lines if seed in judged]
        after = [judge(lines[seed]["answer"], lines[seed]["label"]) for seed in both]
        yield Turned(effect, [judged[seed] for seed in both], after)


def main() -> None:
    """Run the draw that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bank", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--work", type=Path, default=Path("build/bank"))
    parser.add_argument("--page", type=Path, default=Path("docs/reference/bank.md"))
    parser.add_argument("--kept", type=Path, default=Path("docs/reference/bank"))
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--reduced", action="store_true", help="five runs of three seconds")
    kinds.add_argument("--held", action="store_true", help="nine runs without a hop")
    kinds.add_argument("--hops", action="store_true", help="twelve runs, about the asked size")
    parser.add_argument("--of", nargs="+", default=(), help="only cases with one of these effects")
    parser.add_argument("--again", action="store_true", help="what an earlier engine answered")
    parser.add_argument("--flip", help="effect whose cases are answered with its sign turned")
    asked = parser.parse_args()
    cases = draw_cases(asked.seed, asked.cases)
    if asked.reduced:
        cases = reduced(cases)
    if asked.held:
        cases = held(cases)
    if asked.hops:
        cases = hopping(cases)
    name = f"seed-{asked.seed}"
    if asked.of:
        cases = [case for case in cases if set(asked.of) & set(case.causes)]
    if asked.flip:
        cases = [case for case in cases if asked.flip in case.causes]
        name += f"{_FLIP}{asked.flip}"
    log = asked.kept / f"{name}.jsonl"
    done, labels = kept(log), dict[int, Line]()
    if asked.again:
        answered, state = [line for line in done.values() if "label" in line], engine()
        now = alike(state) | {state}
        labels = {one["seed"]: one["label"] for one in answered if one["engine"] not in now}
        cases, done = [case for case in cases if case.seed in labels], {}
    task = partial(run_case, work=asked.work / name, turned=asked.flip, labels=labels)
    # in no order, so that a draw that is stopped holds a fair part of each block
    order = np.random.default_rng(asked.seed).permutation(len(cases))
    for line in keep_all([cases[k] for k in order], log, task, asked.processes, done):
        said = line.get("failed") or line["answer"].get("answer")
        print(f"case {line['seed']}: {said}", flush=True)
    reported = reported_of(asked.kept)
    asked.page.write_text(page(reported), encoding="utf-8")
    print(f"{len(reported.judged)} of {reported.drawn} cases judged; the page is {asked.page}")


if __name__ == "__main__":
    main()
