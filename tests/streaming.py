"""A run in front of cameras that stream: what they film, its faults, and its bench."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from workbench.live import LiveTask
from workbench.run import load_bench
from workbench.run.virtual import film, move, true_robot
from workbench.schemas import Mode, load_model, load_shape
from workbench.tracking import Take

RATE_HZ = 120
VIRTUAL = load_bench("virtual")
MODEL, SHAPE = load_model("thesis", Path()), load_shape("thesis-initial", Path())


def filmed(
    duration: float, rest: float = 1.0, speed: float = 17.0, mode: Mode = "hop", seed: int = 1
) -> Take:
    """What the virtual bench's cameras see of a drive; it differs from the model as ever."""
    section = VIRTUAL.content.virtual
    assert section is not None
    section = section.model_copy(update={"export": "motive-1.23"})
    line = VIRTUAL.content.line
    volts = (speed - line.offset) / line.slope
    rise = [(rest + 0.1 * k, line.lowest + (volts - line.lowest) * k / 5) for k in range(6)]
    history = [(0.0, 0.0), *rise, (rest + duration, 0.0)]
    robot = true_robot(MODEL.content, SHAPE.content, section)
    motion = move(robot, mode, history, rest + duration + 0.5, section)
    return film(motion, VIRTUAL.content.tracking, section, np.random.default_rng(seed))


def slipped(take: Take, body: str, at_s: float, by_m: float) -> Take:
    """The take with a body whose markers slip forward."""
    return _moved(take, body, at_s, lambda since: np.full(len(since), by_m), axis=2)


def fallen(take: Take, at_s: float) -> Take:
    """The take of a robot that walks off its plate: it falls from then on."""
    for body in take.bodies:
        take = _moved(take, body, at_s, lambda since: -9.81 / 2 * since**2, axis=1)
    return take


def _moved(
    take: Take, body: str, at_s: float, way: Callable[[np.ndarray], np.ndarray], axis: int
) -> Take:
    """The take with a body moved along an axis of the export: y is up, -z forward."""
    one, late = take.bodies[body], take.times >= at_s
    sign = -1.0 if axis == 2 else 1.0
    step = np.zeros((np.count_nonzero(late), 3))
    step[:, axis] = sign * way(take.times[late] - at_s)
    measured, solved, position = (part.copy() for part in (one.measured, one.solved, one.position))
    measured[late] += step[:, None]
    solved[late] += step[:, None]
    position[late] += step
    changed = replace(one, measured=measured, solved=solved, position=position)
    return replace(take, bodies={**take.bodies, body: changed})


def task(mode: Mode = "hop", rest: float = 1.0, **given: object) -> LiveTask:
    """What the live twin of such a run observes."""
    texts = (MODEL.text, SHAPE.text, VIRTUAL.text)
    return LiveTask("a run", mode, *texts, rest, **given)  # type: ignore[arg-type]


def lab(root: Path, folder: Path, supply: str, port: int) -> Path:
    """The file of a bench whose supply and cameras are elsewhere on loopback."""
    text, _, _ = (
        (root / "workbench" / "run" / "bench-virtual.yaml").read_text().partition("virtual:\n")
    )
    place = f"{{kind: rtu-over-tcp, address: '{supply}'}}"
    live = f"  live: {{server: 127.0.0.1, command_port: {port}}}\n"
    path = folder / "lab.yaml"
    path.write_text(text.replace("{kind: simulated}", place) + live)
    return path
