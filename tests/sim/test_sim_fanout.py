from __future__ import annotations

import socket
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np
import psutil
import pytest

from workbench.errors import InputError, WorkbenchError
from workbench.sim import Condition, Fanout, Robot, Simulation, fanout, sample_times, simulate_all

if TYPE_CHECKING:
    from distributed import LocalCluster

distributed = pytest.importorskip("distributed", reason="needs the extra `cluster`")

Job = tuple[Robot, Condition]


def job(robot: Robot, omega: float, duration: float = 1.0) -> Job:
    return robot, Condition("hop", np.full(len(sample_times(duration)), omega), rest=0.2)


@pytest.fixture(scope="module")
def jobs(robot: Robot) -> list[Job]:
    """Jobs of different layout and length."""
    robots = (robot, replace(robot, increments=32))
    mixed = [job(each, omega) for omega in (16.0, 17.0, 18.0) for each in robots]
    return [*mixed, job(robot, 17.0, 2.0), job(robot, -17.0)]


@pytest.fixture(scope="module")
def local(jobs: list[Job]) -> list[Simulation]:
    return simulate_all(jobs)


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    """Two worker processes of one thread each; a nanny starts another one when one dies."""
    others = set(psutil.Process().children(recursive=True))  # of earlier tests
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as two:
        yield two
        children = set(psutil.Process().children(recursive=True)) - others
    _, alive = psutil.wait_procs([child for child in children if is_worker(child)], timeout=10)
    assert not alive


@pytest.fixture
def alone() -> Iterator[str]:
    """The address of a scheduler without workers."""
    with distributed.LocalCluster(
        n_workers=0, processes=True, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as none:
        yield none.scheduler_address


def is_worker(process: psutil.Process) -> bool:
    try:
        return "spawn_main" in " ".join(process.cmdline())
    except psutil.Error:
        return False


def assert_same(found: Sequence[Simulation], wanted: Sequence[Simulation]) -> None:
    for one, other in zip(found, wanted, strict=True):
        assert one.outcome == other.outcome
        assert one.sink_m == other.sink_m
        assert one.motion.names == other.motion.names
        for name in ("times", "values", "valid"):
            assert getattr(one.motion, name).tobytes() == getattr(other.motion, name).tobytes()


def test_without_a_scheduler_it_is_simulate_all(jobs: list[Job], local: list[Simulation]) -> None:
    told: list[str] = []
    with Fanout() as spread:
        assert_same(spread.map(jobs, told.append), local)
    assert told == ["simulation 8 of 8"]


OTHER_SIZES = [pytest.param(size, marks=pytest.mark.long) for size in (None, 1, 100)]


@pytest.mark.parametrize("batch_size", [3, *OTHER_SIZES])
def test_two_workers_give_the_same_bits_for_any_batch_size(
    cluster: LocalCluster, jobs: list[Job], local: list[Simulation], batch_size: int | None
) -> None:
    told: list[str] = []
    with Fanout(cluster.scheduler_address, batch_size=batch_size) as spread:
        assert_same(spread.map(jobs, told.append), local)
        assert spread.map([]) == []
    assert told == sorted(told)
    assert told[-1] == "simulation 8 of 8"


@pytest.mark.long
def test_a_worker_killed_midway_costs_only_its_batch(
    cluster: LocalCluster, jobs: list[Job], local: list[Simulation]
) -> None:
    told: list[str] = []

    def kill_once(stage: str) -> None:
        if not told:
            psutil.Process(cluster.workers[0].pid).kill()
        told.append(stage)

    with Fanout(cluster.scheduler_address, batch_size=1) as spread:
        assert_same(spread.map([*jobs, *jobs], kill_once), [*local, *local])
    assert told == [f"simulation {k} of 16" for k in range(1, 17)]


@pytest.mark.long
def test_a_scheduler_killed_and_started_again_is_given_what_is_left(
    jobs: list[Job], local: list[Simulation]
) -> None:
    """Scheduler and worker are processes of their own, as on a lab's machines."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    running: list[psutil.Popen] = []
    told: list[str] = []

    def start() -> None:
        address = f"tcp://127.0.0.1:{port}"
        for words in (
            ("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"),
            ("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"),
        ):
            running.append(psutil.Popen([sys.executable, "-m", "dask", *words]))

    def restart_once(stage: str) -> None:
        if not told:
            for process in running:
                process.kill()
                process.wait()
            start()
        told.append(stage)

    start()
    try:
        with Fanout(listening(f"tcp://127.0.0.1:{port}"), batch_size=1, patience=60) as spread:
            assert_same(spread.map(jobs, restart_once), local)
    finally:
        for process in running:
            if process.is_running():
                process.kill()
            process.wait()
    assert told == [f"simulation {k} of 8" for k in range(1, 9)]


def listening(address: str) -> str:
    """Wait until a scheduler is there."""
    end = time.monotonic() + 60
    while True:
        try:
            Fanout(address).close()
            return address
        except InputError:
            assert time.monotonic() < end
            time.sleep(0.2)


@pytest.mark.long
def test_a_scheduler_gone_for_good_is_given_up_in_the_stated_time(
    jobs: list[Job], alone: str
) -> None:
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        address = cluster.scheduler_address
        with Fanout(address, batch_size=1, patience=0.5) as spread:

            def stop_all(stage: str) -> None:
                cluster.close()

            with pytest.raises(WorkbenchError, match=f"{address} has not answered for 0.5 s"):
                spread.map(jobs, stop_all)


def test_a_refused_robot_costs_its_own_place_only(
    cluster: LocalCluster, jobs: list[Job], local: list[Simulation], robot: Robot
) -> None:
    leaning = replace(robot, angles=(-0.5, *robot.angles[1:]))
    mixed = [*jobs[:2], job(leaning, 17.0), *jobs[2:]]
    for address in (None, cluster.scheduler_address):
        with Fanout(address, batch_size=4) as spread:
            results = spread.attempt(mixed)
        refused = results.pop(2)
        assert isinstance(refused, InputError)
        assert "does not stand" in str(refused)
        assert_same([one for one in results if isinstance(one, Simulation)], local)


def refuse_planar(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    if model.nq == 20:
        raise InputError(f"planar, T rests at {data.body('top').xpos[2]:.3f} m")


def test_admission_is_asked_of_the_model_at_rest(robot: Robot) -> None:
    pair = [job(robot, 17.0), job(replace(robot, planar=True), 17.0)]
    with Fanout() as spread:
        free, planar = spread.attempt(pair, refuse_planar)
    assert isinstance(free, Simulation)
    assert str(planar) == "planar, T rests at 0.270 m"


def test_a_robot_refused_on_a_worker_is_refused_here_in_the_same_words(
    cluster: LocalCluster, jobs: list[Job], local: list[Simulation], robot: Robot
) -> None:
    leaning = replace(robot, angles=(-0.5, *robot.angles[1:]))
    with Fanout(cluster.scheduler_address, batch_size=2) as spread:
        with pytest.raises(InputError, match=r"does not stand: with T at z = -?\d+\.\d+ m"):
            spread.map([*jobs, job(leaning, 17.0)])
        assert_same(spread.map(jobs), local)


@pytest.mark.long
def test_what_the_progress_raises_ends_the_work(cluster: LocalCluster, jobs: list[Job]) -> None:
    def stop(stage: str) -> None:
        raise KeyboardInterrupt(stage)

    with (
        Fanout(cluster.scheduler_address, batch_size=1) as spread,
        pytest.raises(KeyboardInterrupt, match="1 of 8"),
    ):
        spread.map(jobs, stop)


@pytest.mark.long
def test_other_software_on_a_worker_is_refused_by_name(
    cluster: LocalCluster, jobs: list[Job], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = fanout.versions()
    monkeypatch.setattr(fanout, "versions", lambda: found | {"mujoco": "3.9.9"})
    with (
        Fanout(cluster.scheduler_address) as spread,
        pytest.raises(
            InputError,
            match=rf"worker tcp://127.0.0.1:\d+ has other software: mujoco {found['mujoco']} there "
            "and 3.9.9 here",
        ),
    ):
        spread.map(jobs)


@pytest.mark.long
def test_without_any_worker_it_gives_up_in_the_stated_time(alone: str, jobs: list[Job]) -> None:
    with (
        Fanout(alone, patience=0.5) as spread,
        pytest.raises(WorkbenchError, match=rf"scheduler {alone} has had no worker for 0.5 s"),
    ):
        spread.map(jobs)


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("lab-pc:8786", "looks like tcp://host:8786"),
        ("tcp://lab-pc", "looks like tcp://host:8786"),
        ("tcp://127.0.0.1:1", "start one with `dask scheduler`"),
    ],
)
def test_a_wrong_address_is_told_with_what_to_try(address: str, why: str) -> None:
    with pytest.raises(InputError, match=f"no scheduler answers at {address}: .*{why}"):
        Fanout(address)


def test_a_port_where_nobody_speaks_is_told_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fanout, "_CONNECT_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        port = mute.getsockname()[1]
        with pytest.raises(InputError, match=f"no scheduler answers at tcp://127.0.0.1:{port}: "):
            Fanout(f"tcp://127.0.0.1:{port}")


def test_without_distributed_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install hopping-workbench\[cluster\]"):
        Fanout("tcp://127.0.0.1:8786")


def test_a_batch_of_no_jobs_is_refused() -> None:
    with pytest.raises(InputError, match="batch size 0 is not possible"):
        Fanout(batch_size=0)
