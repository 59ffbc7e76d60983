"""What a case is: drawn from a seed, its robot, runs and pictures made, its truth in a label.

Blocks: single causes at three sizes, nulls, pairs, causes outside the library, constructed ties,
faults of the sensor, and traps. Protocols: S is eight clamped runs, S+D five and ring-downs from
four pulls, S+D+H also three hops; two runs or more are held out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from benchmarks.bank.amounts import AMOUNTS, OUTSIDE_AMOUNTS, direction, scaled
from benchmarks.bank.courses import Course
from benchmarks.bank.observe import FAULTS, Filmed, Noise
from workbench.investigate import ProposedRun

__all__ = ["BLOCKS", "SIZES", "TIES", "TRAPS", "Block", "Case", "Made", "Plan", "Run", "draw_case",
           "draw_cases", "held", "hopping", "plan_of", "plans", "reduced"]  # fmt: skip

Block = Literal["single", "null", "pair", "outside", "tie", "sensor", "trap"]
Source = Literal["twin", "rod"]
Protocols = Literal["S", "S+D", "S+D+H"]

BLOCKS: dict[Block, float] = {
    "single": 0.50, "null": 0.15, "pair": 0.10, "outside": 0.075, "tie": 0.05, "sensor": 0.05,
    "trap": 0.075,
}  # fmt: skip
"""Share of the cases."""
SIZES = (0.3, 1.0, 3.0)
TIES: tuple[tuple[str, str, Protocols], ...] = (("local_stiffness_loss", "rest_shape_drift", "S"),)
"""True cause, its double, and the runs; a case is kept where the double leaves less than 30 %."""
TRAPS = ("mass_and_stiffness", "half_percent_speed", "nothing_slips", "unseen_coulomb", "softening",
         "slope_or_set", "droop_near_resonance", "clutter_only", "bad_trackable",
         "one_run")  # fmt: skip

_SPEEDS = (7.0, 8.5, 10.0, 11.5, 13.0, 15.0)
_MORE_SPEEDS = (9.2, 12.2)
_SPEED_WITHIN = 0.3
_PULLS_N = (0.15, 0.3, 0.5, 0.8)
_HOPS = (17.0, 18.0, 19.0)
_SHORT_S, _LONG_S = 8.0, 10.0
_REDUCED_S = 3.0
_REDUCED = ("clamped-1", "clamped-4", "clamped-5", "decay-1", "decay-4")  # the third is held out
_RAMP_S, _RAMP_STEPS = 0.5, 5
_LAG_S = (0.04, 0.06)
_ANGLE_RAD = 0.03


@dataclass(frozen=True)
class Case:
    """What is drawn before anything is simulated.

    Args:
        seed: of everything that follows.
        block: kind of case.
        generator: of the motions.
        protocols: which runs there are.
        noise: of the cameras.
        causes: names of effects or of causes outside the library.
        sizes: of the causes, in noise deviations.
        kind: of a sensor's fault, or of a trap.
        reduced: to five runs of three seconds.
        attempt: counts the robots and runs that were drawn for it.
        amounts: (cause, quantity, amount) of causes that were sized before; none sizes them.
    """

    seed: int
    block: Block
    generator: Source
    protocols: Protocols
    noise: Noise
    causes: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()
    kind: str = ""
    reduced: bool = False
    attempt: int = 0
    amounts: tuple[tuple[str, str, float], ...] = ()

    @property
    def name(self) -> str:
        """Return the folder's name; it says nothing of the truth."""
        return f"case-{self.seed:06d}"

    def rng(self, *part: int) -> np.random.Generator:
        """Return the generator of one part of what is drawn, another with every attempt."""
        return np.random.default_rng([self.seed, *part, self.attempt])


class Plan(NamedTuple):
    """A run before it is made: its name, whether it is held out, and what happens in it."""

    name: str
    role: Literal["train", "held_out"]
    course: Course


@dataclass(frozen=True, eq=False)
class Run:
    """A run as a laboratory has it.

    Args:
        name: of the run and of its take.
        role: whether a fit may see it.
        course: with the speeds, pull and start angle as they are written down.
        filmed: by the cameras.
    """

    name: str
    role: Literal["train", "held_out"]
    course: Course
    filmed: Filmed


@dataclass(frozen=True, eq=False)
class Made:
    """A case with its runs, and the label that stays sealed."""

    case: Case
    runs: tuple[Run, ...]
    label: Mapping[str, Any] = field(default_factory=dict)


def draw_cases(seed: int, count: int) -> list[Case]:
    """Draw cases: every block by its share, every other case from each generator."""
    counts = {block: max(1, round(share * count)) for block, share in BLOCKS.items()}
    counts["single"] = max(0, count - sum(counts.values()) + counts["single"])
    blocks: list[Block] = []
    for block in BLOCKS:
        blocks.extend(block for _ in range(counts[block]))
    return [draw_case(1000 * seed + k, block, k) for k, block in enumerate(blocks[:count])]


def held(cases: Sequence[Case]) -> list[Case]:
    """Return those cases that runs with a held foot show, with nine of them at full length.

    Ties are left out: they are made for a set of runs.
    """
    known = AMOUNTS | OUTSIDE_AMOUNTS
    hop = {name for name, amount in known.items() if amount.shown == "hop"}
    shown = [one for one in cases if hop.isdisjoint(one.causes)]
    return [replace(one, protocols="S+D") for one in shown if one.block != "tie"]


def reduced(cases: Sequence[Case]) -> list[Case]:
    """Return the cases of `held` with five runs of three seconds."""
    return [replace(one, reduced=True) for one in held(cases)]


def hopping(cases: Sequence[Case]) -> list[Case]:
    """Return cases with hops in every one, their causes of about the size that was drawn.

    To size a cause on hops of the independent engine takes half an hour. Here the amounts are those
    that have the size at the stated parameters, within a factor of two. What needs its exact size
    (ties, traps) or no hop (faults of the sensor) is left out.
    """
    known, found = AMOUNTS | OUTSIDE_AMOUNTS, list[Case]()
    for one in cases:
        if one.block in ("tie", "trap", "sensor"):
            continue
        rng = one.rng(4)
        amounts = tuple(
            (name, quantity, amount)
            for name, size in zip(one.causes, one.sizes, strict=True)
            for quantity, amount in scaled(
                name, direction(name, rng), min(size, known[name].most)
            ).items()
        )
        found.append(replace(one, protocols="S+D+H", amounts=amounts))
    return found


def draw_case(seed: int, block: Block, turn: int) -> Case:
    """Draw one case.

    Args:
        seed: of the case.
        block: kind of case.
        turn: counts up; goes through generators, sizes and names in order.
    """
    rng = np.random.default_rng([seed, 0])
    source: Source = "rod" if turn % 2 or block == "outside" else "twin"
    noise: Noise = "A" if (turn // 2) % 2 else "B"
    size = SIZES[(turn // 2) % len(SIZES)]
    if block == "null":
        return Case(seed, block, source, _any(rng), noise)
    if block in ("single", "outside"):
        table = AMOUNTS if block == "single" else OUTSIDE_AMOUNTS
        name = list(table)[rng.integers(len(table))]
        size = size if block == "single" else max(size, 1.0)
        return Case(seed, block, source, _runs_for(rng, name), noise, (name,), (size,))
    if block == "pair":
        names = tuple(str(one) for one in rng.choice(list(AMOUNTS), 2, replace=False))
        sizes = ((3.0, 3.0), (3.0, 1.0))[turn % 2]
        return Case(seed, block, source, _runs_for(rng, *names), noise, names, sizes)
    if block == "tie":
        one, other, protocols = TIES[rng.integers(len(TIES))]
        return Case(seed, block, source, protocols, noise, (one, other), (1.0,))
    if block == "sensor":
        return Case(seed, block, source, "S+D", noise, kind=str(rng.choice(FAULTS)))
    return _trap(seed, source, noise, TRAPS[rng.integers(len(TRAPS))])


def _trap(seed: int, source: Source, noise: Noise, kind: str) -> Case:
    causes: dict[str, tuple[tuple[str, ...], Protocols]] = {
        "nothing_slips": (("friction_level",), "S+D"),
        "unseen_coulomb": (("hinge_coulomb_friction",), "S"),
        "softening": (("hinge_cubic_stiffness",), "S+D"),
        "slope_or_set": (("ground_slope",), "S+D"),
        "droop_near_resonance": (("motor_droop",), "S"),
        "one_run": (("rest_shape_drift",), "S+D"),
    }
    names, protocols = causes.get(kind, ((), "S+D"))
    return Case(seed, "trap", source, protocols, noise, names, (1.0,) * len(names), kind)


def _any(rng: np.random.Generator) -> Protocols:
    choices: tuple[Protocols, ...] = ("S", "S+D", "S+D+H")
    return choices[rng.integers(len(choices))]


def _runs_for(rng: np.random.Generator, *names: str) -> Protocols:
    shown = {(AMOUNTS | OUTSIDE_AMOUNTS)[name].shown for name in names}
    return "S+D+H" if "hop" in shown else _any(rng)


def plans(protocols: Protocols, rng: np.random.Generator, reduced: bool = False) -> list[Plan]:
    """Return the runs of a protocol set, two or three of them held out, with their own scatter.

    Args:
        protocols: which runs there are.
        rng: of speeds, pulls and lengths.
        reduced: whether only some of S+D remain, and of those the first seconds.
    """
    speeds = _SPEEDS + _MORE_SPEEDS if protocols == "S" else _SPEEDS[:5]
    last = len(speeds) - (2 if protocols == "S" else 1)
    made = []
    for k, speed in enumerate(speeds):
        speed = round(speed + rng.uniform(-_SPEED_WITHIN, _SPEED_WITHIN), 2)
        made.append(_plan("clamped", k, k >= last, _driven("clamped", speed, rng)))
    if protocols != "S":
        for k, pull in enumerate(_PULLS_N):
            course = Course("decay", _SHORT_S, pull=round(pull * rng.uniform(0.9, 1.1), 3))
            made.append(_plan("decay", k, k == 2, course))
    if protocols == "S+D+H":
        for k, speed in enumerate(_HOPS):
            speed = round(speed + rng.uniform(-_SPEED_WITHIN, _SPEED_WITHIN), 2)
            made.append(_plan("hop", k, k == len(_HOPS) - 1, _driven("hop", speed, rng)))
    if reduced:
        few = [plan for plan in made if plan.name in _REDUCED]
        return [one._replace(course=one.course._replace(duration=_REDUCED_S)) for one in few]
    return made


def _plan(mode: str, k: int, held: bool, course: Course) -> Plan:
    return Plan(f"{mode}-{k + 1}", "held_out" if held else "train", course)


def plan_of(trial: ProposedRun, number: int, rng: np.random.Generator) -> Plan:
    """Return a run that a diagnosis asks for, with its own scatter; it may be fitted.

    Args:
        trial: what is asked for.
        number: of the run, behind its name.
        rng: of start angle and lag.
    """
    name = f"{trial.mode}-{number}"
    if trial.mode in ("clamped", "hop"):
        return Plan(name, "train", _driven(trial.mode, trial.amount, rng, trial.duration))
    if trial.mode == "decay":
        return Plan(name, "train", Course("decay", trial.duration, pull=trial.amount))
    return Plan(name, "train", Course("drop", trial.duration, height=trial.amount))


def _driven(
    mode: Literal["clamped", "hop"],
    speed: float,
    rng: np.random.Generator,
    duration: float | None = None,
) -> Course:
    if duration is None:
        duration = float(rng.choice([_SHORT_S, _LONG_S]))
    angle = np.pi / 2 + rng.normal(0, _ANGLE_RAD)
    return Course(mode, duration, ramp(speed), angle, lag=float(rng.uniform(*_LAG_S)))


def ramp(speed: float) -> tuple[tuple[float, float], ...]:
    """Return the steps that a sheet's `ramp: 0.5 s` stands for, (time [s], speed [rad/s])."""
    rise = [
        (_RAMP_S * k / _RAMP_STEPS, speed * (k + 1) / (_RAMP_STEPS + 1)) for k in range(_RAMP_STEPS)
    ]
    return (*rise, (_RAMP_S, speed))
