"""The references of the ground law against the engine's equations and against one another."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from benchmarks.contact.chain import forces, mass_matrix, state_of
from benchmarks.contact.events import READINGS, solve_events
from benchmarks.contact.stepping import march
from benchmarks.contact.twin import begin, dropped, hop, reference, thesis_chain, thesis_robot
from workbench.sim import build_spec

ROOT = Path(__file__).resolve().parents[1]


def test_the_chain_accelerates_as_the_engine_s_does() -> None:
    spec = build_spec(thesis_robot(), "free")
    spec.delete(spec.numeric("ground"))
    model = spec.compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(1)
    data.qpos[:], data.qvel[:] = rng.normal(size=model.nq), 3 * rng.normal(size=model.nv)
    data.act[0], data.ctrl[:] = 0.3, 17.0
    mujoco.mj_forward(model, data)
    q, v = state_of(data)
    mass, force = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    mass_matrix(thesis_chain(), q, mass)
    forces(thesis_chain(), q, v, 0.3, 17.0, force)
    expected = data.qacc.copy()
    expected[2:] = np.cumsum(expected[2:])
    assert np.linalg.solve(mass, force) == pytest.approx(expected, rel=1e-9)


@pytest.mark.budget(40)  # compiles both references where no cache is kept
def test_references_and_twin_agree_over_half_a_second_of_hopping() -> None:
    """Greatest distances of the feet at 18 rad/s, from where the twin is after 2 s."""
    c = thesis_chain()
    start = hop(begin(), 18.0, 2.0, keep=[240])[1][0]
    twin, _ = hop(start, 18.0, 0.5)
    s = reference(c, start)
    drive = np.array([s.act, 18.0])
    exact = solve_events(c, READINGS["slides"], s, 18.0, 0.5, 100)
    stepped = march(c, False, s.q, s.v, drive, len(twin), 100, 1 / 12000)
    assert exact.events > 10
    for name, foot, bar in (("Moreau", stepped, 0.1), ("twin", twin, 0.3)):
        off = 1000 * np.linalg.norm(foot[:, :2] - exact.foot[:, :2], axis=1).max()
        print(f"{name}: {off:.3f} mm from the events")
        assert off < bar


@pytest.mark.parametrize(("forward", "pitch"), [(0.3, 0.05), (-0.25, -0.04), (-0.1, -0.03)])
def test_a_hard_landing_is_that_of_the_reference(forward: float, pitch: float) -> None:
    """From 50 mm an edge lands at 1.2 m/s, is stopped and slides back within a step."""
    state = dropped(0.05, forward, pitch)
    there = solve_events(
        thesis_chain(), READINGS["slides"], reference(thesis_chain(), state), 0.0, 0.15, 100
    )
    off = hop(state, 0.0, 0.15)[0][:, :2] - there.foot[:, :2]
    assert 1000 * np.linalg.norm(off, axis=1).max() < 0.5  # mm


@pytest.mark.long
def test_the_benchmark_prints_its_tables() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.contact", "--quick"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    for head in (
        "references from rest",
        "landings",
        "same state",
        "static below v_th",
        "Moreau",
        "4 draws",
    ):
        assert head in done.stdout
    assert "nan" not in done.stdout
