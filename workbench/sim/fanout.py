"""Run many simulations on all cores of this machine, or on a cluster of several machines.

A cluster is reached through a `dask.distributed` scheduler; nothing else imports it. Jobs are cut
into batches, and a batch is a function of its jobs alone. So the results are the same, bit for bit,
for any number of workers and any size of batches, and a batch is repeated when its worker died or
its scheduler went down.
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
from workbench.sim.simulate import Precheck, Simulation, attempt_all, simulate_all

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
        batch_size: jobs that a worker is given at a time, and that are repeated when it dies; None
            takes up to 8, fewer when there are few jobs for many workers.
        patience: how long to wait without any worker, or without the scheduler, which may be
            started again at its address [s].

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
            _disconnect(self._client)

    def map(self, jobs: Sequence[Job], progress: Progress = lambda text: None) -> list[Simulation]:
        """Simulate every job; the results are in the order of the jobs.

        Args:
            jobs: any mix of robots and conditions.
            progress: is called after each batch with `simulation 8 of 24`; on this machine's cores
                once, at the end.

        Raises:
            InputError: when a robot cannot be built or does not stand, or when a worker's software
                is not the same as here.
            WorkbenchError: when workers or scheduler are lost for good.
        """
        return self._run(simulate_all, jobs, progress)

    def attempt(
        self,
        jobs: Sequence[Job],
        precheck: Precheck | None = None,
        progress: Progress = lambda text: None,
    ) -> list[Simulation | InputError]:
        """Simulate every job as `map` does; a refused one has its error as result.

        Args:
            jobs: any mix of robots and conditions.
            precheck: as for `attempt_all`; it must be importable on the workers.
            progress: as for `map`.

        Raises:
            InputError: when a worker's software is not the same as here.
            WorkbenchError: when workers or scheduler are lost for good.
        """
        return self._run(partial(attempt_all, precheck=precheck), jobs, progress)

    def _run(self, work: Work[R], jobs: Sequence[Job], progress: Progress) -> list[R]:
        if self._client is None:
            results = work(jobs)
            progress(reached(_COUNTED, len(jobs), len(jobs)))
            return results
        size = self._batch_size or _batch_size(len(jobs), self._threads_or_none(self._client))
        batches = [jobs[i : i + size] for i in range(0, len(jobs), size)]
        done: dict[int, list[R]] = {}
        while len(done) < len(batches):
            try:
                self._collect(self._client, work, batches, done, progress)
            except _SchedulerLost as loss:
                self._client = self._reconnect(loss)
        return [result for k in range(len(batches)) for result in done[k]]

    def _collect(
        self,
        client: Client,
        work: Work[R],
        batches: Sequence[Sequence[Job]],
        done: dict[int, list[R]],
        progress: Progress,
    ) -> None:
        """Compute the batches that are missing in `done`, and put their results into it."""
        here = versions()
        # one call a batch: a graph of all of them would pass the scheduler as one large message
        batch_of = {
            client.submit(_run_batch, work, batch, here, pure=False): k
            for k, batch in enumerate(batches)
            if k not in done
        }
        total = sum(map(len, batches))
        try:
            for future in self._finished(client, list(batch_of)):
                done[batch_of[future]] = self._fetch(client, future)
                progress(reached(_COUNTED, sum(len(batches[k]) for k in done), total))
        finally:
            with suppress(OSError, RuntimeError, AttributeError):  # no scheduler to cancel them
                client.cancel([future for future, k in batch_of.items() if k not in done])

    def _finished(self, client: Client, futures: Sequence[Future]) -> Iterator[Future]:
        """Yield each future when it has ended, as long as there are workers."""
        ended: Queue[Future] = Queue()
        for future in futures:
            future.add_done_callback(ended.put)
        remaining, alive = len(futures), monotonic()
        while remaining:
            try:
                yield ended.get(timeout=_POLL_S)
                remaining, alive = remaining - 1, monotonic()
            except Empty:
                if self._threads(client):
                    alive = monotonic()
                elif monotonic() - alive > self._patience:
                    raise self._no_workers() from None

    def _fetch(self, client: Client, future: Future) -> list[Any]:
        """Fetch a batch's results; its worker may still die."""
        distributed = _distributed()
        while True:
            try:
                results = future.result(timeout=self._patience)
                future.release()  # or the scheduler repeats it when its worker dies later
                return results
            except distributed.TimeoutError:
                if not self._threads(client):
                    raise self._no_workers() from None
            except distributed.KilledWorker as error:
                raise WorkbenchError(
                    f"a batch was given up, its workers ran out of memory or miss this workbench: "
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

    def _reconnect(self, loss: _SchedulerLost) -> Client:
        """Wait until the scheduler is there again."""
        if self._client is not None:
            _disconnect(self._client)
        deadline = monotonic() + self._patience
        while True:
            try:
                return _connect(self._scheduler)
            except InputError:
                if monotonic() > deadline:
                    raise self._no_scheduler() from loss
            sleep(_POLL_S)

    def _no_scheduler(self) -> WorkbenchError:
        return WorkbenchError(
            f"the scheduler {self._scheduler} has not answered for {self._patience:g} s; look at "
            "what it printed, start it and its workers again and repeat"
        )

    def _no_workers(self) -> WorkbenchError:
        return WorkbenchError(
            f"the scheduler {self._scheduler} has had no worker for {self._patience:g} s; start "
            f"`dask worker {self._scheduler}` on a machine with this workbench and repeat"
        )


class _SchedulerLost(Exception):
    """The scheduler is gone, and with it the batches of its workers."""


@cache
def versions() -> dict[str, str]:
    """Return the versions that must be the same on all machines for the same results."""
    packages = {name: metadata.version(name) for name in ("mujoco", "numba", "numpy")}
    return {"workbench": f"of sources {_sources()}"} | packages


def _sources() -> str:
    """Return a short hash of the workbench's sources; an installed version may be older."""
    root = Path(workbench.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py"), key=lambda p: p.relative_to(root).as_posix()):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_text(encoding="utf-8").encode())  # any line ending
    return digest.hexdigest()[:8]


def _batch_size(jobs: int, threads: int) -> int:
    return min(_LARGEST_BATCH, max(1, jobs // (_BATCHES_A_THREAD * max(1, threads))))


def _run_batch(work: Work[R], jobs: Sequence[Job], wanted: dict[str, str]) -> list[R]:
    """Simulate on a thread of a worker."""
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
    """Connect to a scheduler within a few seconds or say what to try."""
    distributed = _distributed()
    try:
        _await_greeting(address)
        return distributed.Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no scheduler answers at {address}: {error}; start one with `dask scheduler`, which "
            "prints its address, and see that no firewall is between"
        ) from None


def _disconnect(client: Client) -> None:
    """Close a client, whose scheduler may be gone."""
    with suppress(OSError, RuntimeError):
        client.close(timeout=_CONNECT_S)


def _await_greeting(address: str) -> None:
    """Wait for a scheduler's first byte; dask's own client has no timeout for a mute server."""
    url = urlsplit(address)
    if url.scheme not in ("tcp", "tls") or not url.hostname or not url.port:
        raise ValueError("an address looks like tcp://host:8786")
    with socket.create_connection((url.hostname, url.port), _CONNECT_S) as connection:
        if url.scheme == "tcp" and not connection.recv(1):
            raise ConnectionError("what listens there is no scheduler")


def _distributed() -> ModuleType:
    try:
        import distributed
    except ModuleNotFoundError:
        raise InputError(
            "a scheduler needs the package distributed; pip install hopping-workbench[cluster]"
        ) from None
    return distributed
