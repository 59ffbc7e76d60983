"""Spread many simulations over the cores of this machine, or over a cluster of several.

Several machines are reached through a `dask.distributed` scheduler; nothing else imports it. Jobs
are cut into batches, and a batch is one function of its jobs alone. So the results are the same,
bit for bit, for any number of workers and any size of batches, and a batch whose worker died is
simply done again. So is all that a scheduler had in hand when it went down.
"""

from __future__ import annotations

import hashlib
import socket
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache, partial
from importlib import metadata
from pathlib import Path
from queue import Empty, Queue
from time import monotonic, sleep
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, cast
from urllib.parse import urlsplit

import workbench
from workbench.errors import InputError, WorkbenchError
from workbench.progress import Progress, reached
from workbench.sim.condition import Condition
from workbench.sim.robot import Robot
from workbench.sim.simulate import Admit, Simulation, attempt_all, simulate_all

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["Fanout", "versions"]

Job = tuple[Robot, Condition]

R = TypeVar("R")


class Work(Protocol[R]):
    """Simulates jobs on so many threads; all cores by default."""

    def __call__(self, jobs: Sequence[Job], threads: int = 0) -> list[R]:
        """Return one result a job, in their order."""
        ...


_COUNTED = "simulation"
_LARGEST_BATCH = 8
_BATCHES_A_THREAD = 4  # so that a slow machine does not keep the others waiting at the end
_CONNECT_S = 5.0
_POLL_S = 1.0


class Fanout:
    """Simulates many jobs, each from rest, on all cores or on the workers of a cluster.

    The n-th result is that of the n-th job, and it does not depend on where it was computed.

    Args:
        scheduler: address of a `dask scheduler`, `tcp://host:8786`; None takes this machine's
            cores.
        batch_size: how many jobs a worker is given at a time, and at most has to do again when it
            dies; None takes up to 8, fewer when there are few jobs for many workers.
        patience: how long to go on without any worker, and without the scheduler: one that is
            started again at its address is given what was not done yet [s].

    Raises:
        InputError: when the scheduler cannot be reached or `distributed` is not installed.
    """

    def __init__(
        self, scheduler: str | None = None, *, batch_size: int | None = None, patience: float = 60.0
    ) -> None:
        if batch_size is not None and batch_size < 1:
            raise InputError(f"batch size {batch_size} is not possible; it is 1 job or more")
        self._scheduler = scheduler or ""
        self._batch_size = batch_size
        self._patience = patience
        self._client = _connect(scheduler) if scheduler else None

    def __enter__(self) -> Fanout:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the cluster."""
        self.close()

    def close(self) -> None:
        """Leave the cluster; its scheduler and workers stay."""
        if self._client is not None:
            _leave(self._client)

    def map(self, jobs: Sequence[Job], progress: Progress = lambda text: None) -> list[Simulation]:
        """Simulate every job; the results are in the order of the jobs.

        Args:
            jobs: any mix of robots and conditions.
            progress: is told after each batch, as `simulation 8 of 24`; on this machine's cores
                once, at the end.

        Raises:
            InputError: when a robot cannot be built or does not stand, or when a worker's software
                is not the same as here.
            WorkbenchError: when workers or scheduler are lost for good.
        """
        return self._spread(simulate_all, jobs, progress)

    def attempt(
        self,
        jobs: Sequence[Job],
        admit: Admit | None = None,
        progress: Progress = lambda text: None,
    ) -> list[Simulation | InputError]:
        """Simulate every job as `map` does; one that is refused costs only its own place.

        Args:
            jobs: any mix of robots and conditions.
            admit: looks at each model at rest before its first step and raises InputError to
                refuse it; it must be importable on the workers.
            progress: as for `map`.

        Raises:
            InputError: when a worker's software is not the same as here.
            WorkbenchError: when workers or scheduler are lost for good.
        """
        return self._spread(partial(attempt_all, admit=admit), jobs, progress)

    def _spread(self, work: Work[R], jobs: Sequence[Job], tell: Progress) -> list[R]:
        if self._client is None:
            results = work(jobs)
            tell(reached(_COUNTED, len(jobs), len(jobs)))
            return results
        size = self._batch_size or _batch_size(len(jobs), self._threads_or_none(self._client))
        batches = [jobs[i : i + size] for i in range(0, len(jobs), size)]
        done: dict[int, list[R]] = {}
        while len(done) < len(batches):
            try:
                self._collect(self._client, work, batches, done, tell)
            except _SchedulerLost as loss:
                self._client = self._connect_again(loss)
        return [result for k in range(len(batches)) for result in done[k]]

    def _collect(
        self,
        client: Client,
        work: Work[R],
        batches: Sequence[Sequence[Job]],
        done: dict[int, list[R]],
        tell: Progress,
    ) -> None:
        """Have the batches done that are not done yet, and put their results into `done`."""
        here = versions()
        # one call a batch: a graph of all of them would pass the scheduler as one large message
        places = {
            client.submit(_work_on_batch, work, batch, here, pure=False): k
            for k, batch in enumerate(batches)
            if k not in done
        }
        total = sum(map(len, batches))
        try:
            for future in self._finished(client, list(places)):
                done[places[future]] = self._fetch(client, future)
                tell(reached(_COUNTED, sum(len(batches[k]) for k in done), total))
        finally:
            with suppress(OSError, RuntimeError, AttributeError):  # nobody there to cancel them
                client.cancel([future for future, k in places.items() if k not in done])

    def _finished(self, client: Client, futures: Sequence[Future]) -> Iterator[Future]:
        """Yield each future when it has ended, as long as there is somebody to work on them."""
        ended: Queue[Future] = Queue()
        for future in futures:
            future.add_done_callback(ended.put)
        left, alive = len(futures), monotonic()
        while left:
            try:
                yield ended.get(timeout=_POLL_S)
                left, alive = left - 1, monotonic()
            except Empty:
                if self._threads(client):
                    alive = monotonic()
                elif monotonic() - alive > self._patience:
                    raise self._deserted() from None

    def _fetch(self, client: Client, future: Future) -> list[Any]:
        """Bring a batch's results here; its worker may die even now."""
        distributed = _distributed()
        while True:
            try:
                results = future.result(timeout=self._patience)
                future.release()  # or the scheduler has it done again when its worker dies later
                return results
            except distributed.TimeoutError:
                if not self._threads(client):
                    raise self._deserted() from None
            except distributed.KilledWorker as error:
                raise WorkbenchError(
                    f"a batch was given up, its workers ran out of memory or lack this workbench: "
                    f"{error}"
                ) from None
            except RuntimeError as error:
                raise WorkbenchError(f"the cluster {self._scheduler} failed: {error}") from error
            except distributed.CancelledError:
                raise _SchedulerLost from None

    def _threads(self, client: Client) -> int:
        """Return how many threads all workers have together."""
        try:
            return sum(cast("dict[str, int]", client.nthreads()).values())
        except (OSError, RuntimeError, AttributeError):  # dask's ways to say it is not connected
            raise _SchedulerLost from None

    def _threads_or_none(self, client: Client) -> int:
        try:
            return self._threads(client)
        except _SchedulerLost:
            return 0

    def _connect_again(self, loss: _SchedulerLost) -> Client:
        """Wait until the scheduler is there again."""
        if self._client is not None:
            _leave(self._client)
        given_up = monotonic() + self._patience
        while True:
            try:
                return _connect(self._scheduler)
            except InputError:
                if monotonic() > given_up:
                    raise self._lost() from loss
            sleep(_POLL_S)

    def _lost(self) -> WorkbenchError:
        return WorkbenchError(
            f"the scheduler {self._scheduler} has not answered for {self._patience:g} s; look at "
            "what it printed, start it and its workers again and repeat"
        )

    def _deserted(self) -> WorkbenchError:
        return WorkbenchError(
            f"the scheduler {self._scheduler} has had no worker for {self._patience:g} s; start "
            f"`dask worker {self._scheduler}` on a machine with this workbench and repeat"
        )


class _SchedulerLost(Exception):
    """The scheduler is gone, and with it what its workers were doing."""


@cache
def versions() -> dict[str, str]:
    """Return what must be the same on all machines, for the same numbers everywhere."""
    packages = {name: metadata.version(name) for name in ("mujoco", "numba", "numpy")}
    return {"workbench": f"of sources {_sources()}"} | packages


def _sources() -> str:
    """Return a short hash of the workbench's code, which its installed version may be behind."""
    root = Path(workbench.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py"), key=lambda p: p.relative_to(root).as_posix()):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_text(encoding="utf-8").encode())  # any line ending
    return digest.hexdigest()[:8]


def _batch_size(jobs: int, threads: int) -> int:
    return min(_LARGEST_BATCH, max(1, jobs // (_BATCHES_A_THREAD * max(1, threads))))


def _work_on_batch(work: Work[R], jobs: Sequence[Job], wanted: dict[str, str]) -> list[R]:
    """Simulate on a worker, which calls this on each of its threads."""
    _check_versions(wanted, _distributed().get_worker().address)
    return work(jobs, threads=1)


def _check_versions(wanted: dict[str, str], worker: str) -> None:
    found = versions()
    if found != wanted:
        faults = [
            f"{name} {found.get(name, 'none')} there and {wanted[name]} here"
            for name in wanted
            if found.get(name) != wanted[name]
        ]
        raise InputError(
            f"the worker {worker} has other software: {', '.join(faults)}; "
            "install the same on all machines"
        )


def _connect(address: str) -> Client:
    """Reach a scheduler within a few seconds or say what to try."""
    distributed = _distributed()
    try:
        _greet(address)
        return distributed.Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no scheduler answers at {address}: {error}; start one with `dask scheduler`, which "
            "prints its address, and see that no firewall is between"
        ) from None


def _leave(client: Client) -> None:
    """Close a client; of one whose scheduler is gone nothing more is expected."""
    with suppress(OSError, RuntimeError):
        client.close(timeout=_CONNECT_S)


def _greet(address: str) -> None:
    """Wait for a scheduler's first byte; dask's own client waits without end for a mute server."""
    place = urlsplit(address)
    if place.scheme not in ("tcp", "tls") or not place.hostname or not place.port:
        raise ValueError("an address looks like tcp://host:8786")
    with socket.create_connection((place.hostname, place.port), _CONNECT_S) as line:
        if place.scheme == "tcp" and not line.recv(1):
            raise ConnectionError("what listens there is no scheduler")


def _distributed() -> ModuleType:
    try:
        import distributed
    except ModuleNotFoundError:
        raise InputError(
            "a scheduler needs the package distributed; pip install hopping-workbench[cluster]"
        ) from None
    return distributed
