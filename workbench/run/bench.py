"""From a bench file to opened devices; the virtual bench is composed here.

Formats, robot and cameras load where a run needs them: what is misspelt in a file is said before.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from workbench.bundle import Bundle
from workbench.errors import HardwareError, InputError, did_you_mean
from workbench.hw import (
    KEEP_TRYING_S,
    NO_RECORDS,
    Clock,
    Connection,
    Identity,
    LeaseClock,
    Limits,
    ModbusModel,
    Records,
    SimulatedClock,
    Supply,
    SystemClock,
    draw_current,
    open_guarded,
    open_supply,
    require_reachable,
    serve,
    simulated_supply,
)
from workbench.output import Ledger
from workbench.run.bench_supply import connection_of, found_at, ledgers_of, model_of
from workbench.run.subject import CameraSpan, Subject
from workbench.run.takes import Collector, Operator, TakeFolder, write_stream
from workbench.schemas import BenchFile, Document, load, with_calibration
from workbench.timeseries import TimeSeries

if TYPE_CHECKING:
    from workbench.live import LiveState  # which loads all of fit
    from workbench.tracking import Recorder

__all__ = [
    "BUILT_IN",
    "Bench",
    "CameraSpan",
    "Operator",
    "RealBench",
    "SimulatedBench",
    "Subject",
    "VirtualBench",
    "load_bench",
    "make_bench",
]

WireLog = Callable[[str], None]

BUILT_IN = Path(__file__).with_name("bench-virtual.yaml")
"""The file of the bench `virtual`."""

_TAIL_S = 0.5  # the cameras run on for a moment after the supply is off


class Bench(ABC):
    """A laboratory that a plan can be carried out on.

    Args:
        file: its file.
        clock: everything on the bench is timed and waited with it.
    """

    awaited = ""  # what a run waits for once the robot has moved, in words
    streams = False  # whether its cameras stream while a run goes on
    recorder: Recorder | None = None  # of that stream
    on_live_state: Callable[[LiveState | None], None] = staticmethod(lambda state: None)
    viewer: int | None = None  # port on loopback of who draws the live twin

    def __init__(self, file: BenchFile, clock: Clock) -> None:
        self.file = file
        self.clock = clock

    @abstractmethod
    def supply(self, bundle: Bundle) -> AbstractContextManager[Supply]:
        """Open the supply for the time of a `with` block that ends with the output off.

        Args:
            bundle: keeps what goes over the wire.
        """

    def ledgers(self) -> list[Ledger]:
        """Return the ledgers that may be of its supply; none where there is nothing to harm."""
        return []

    def ledger_of(self, identity: Identity) -> Ledger | None:
        """Return the ledger of a supply that is open; None where there is nothing to harm."""
        return None

    def require_ready(self, drives: bool) -> None:  # noqa: B027  most benches have all they need
        """Refuse a bench without what runs need, the supply where one `drives`."""

    @abstractmethod
    def start_cameras(self, operator: Operator) -> None:
        """Return when the cameras record."""

    @abstractmethod
    def collect(
        self, subject: Subject, span: CameraSpan, bundle: Bundle, operator: Operator
    ) -> Path | None:
        """Return the export of what the cameras saw; it may already lie in the bundle.

        None on a bench without cameras.
        """

    def keep_recorded(self, bundle: Bundle) -> None:  # noqa: B027  most benches record nothing
        """Keep what the cameras of a run that ended early sent so far."""

    def stop_cameras(self) -> None:  # noqa: B027  most benches have nothing to stop
        """Leave nothing running, however the run ended."""

    def collector(
        self, span: CameraSpan, bundle: Bundle, operator: Operator, used: dict[str, str]
    ) -> Collector:
        """Return what finds the take of a span and checks that it belongs to it."""
        tolerance, wanted = self.file.tracking.takes_tolerance, span.cameras
        return Collector(bundle, wanted, span.start, operator, self.clock, tolerance, used)

    @property
    def voltage_step(self) -> Decimal:
        """Return the smallest step of the supply [V].

        Raises:
            InputError: when the file names a supply that no driver knows.
        """
        return model_of(self.file).voltage_step_V

    def limits(self, current: float) -> Limits:
        """Return what the supply may do in a run with this current limit [A]."""
        limits = self.file.supply.limits
        values = (limits.voltage, current, limits.over_voltage, limits.over_current)
        return Limits(*(Decimal(repr(value)) for value in values))


class RealBench(Bench):
    """A bench with a supply on a port and cameras that a person starts.

    Args:
        file: its file.
        clock: everything on the bench is timed and waited with it. With a `LeaseClock` the supply
            is behind a guardian; no guardian can watch a client on a simulated clock.
    """

    keep_trying_s = KEEP_TRYING_S

    def __init__(self, file: BenchFile, clock: Clock) -> None:
        super().__init__(file, clock)
        self._folder: TakeFolder | None = None
        self.streams = file.tracking.live is not None
        self._used: dict[str, str] = {}
        where = f"in {file.tracking.takes}" if file.tracking.takes else "to be named"
        self.awaited = "" if self.streams else f"waiting for the export {where}"

    @contextmanager
    def supply(self, bundle: Bundle) -> Iterator[Supply]:
        """Open the supply that the bench file names."""
        records = Records(bundle.record.wire_log, bundle.record.guardian_log)
        with self.open_supply(records, bundle.record.wire) as supply:
            yield supply

    def open_supply(
        self,
        records: Records = NO_RECORDS,
        wire_log: WireLog = lambda line: None,
        *,
        force: bool = False,
    ) -> Supply:
        """Open the supply without a promise about its output, to look at it by hand.

        Args:
            records: where a guardian writes.
            wire_log: takes what goes over the wire where there is no guardian.
            force: let it switch off even what another program drives.
        """
        connection, clock, family = found_at(self.file), self.clock, model_of(self.file).family
        if isinstance(clock, LeaseClock):
            return open_guarded(
                connection,
                clock=clock,
                records=records,
                family=family,
                keep_trying_s=self.keep_trying_s,
                force=force,
            )
        return open_supply(connection, clock=clock, wire_log=wire_log, family=family)

    def ledgers(self) -> list[Ledger]:
        """Return the ledgers that may be of its supply: by serial number, or by where it was."""
        return ledgers_of(self.file)

    def ledger_of(self, identity: Identity) -> Ledger:
        """Return the ledger of the supply that is open."""
        address = connection_of(self.file).resolved_address
        return Ledger(Ledger.key_of(identity.model, identity.known_serial, address))

    def require_ready(self, drives: bool) -> None:
        """Raise HardwareError where the folder of exports or the supply's place do not open."""
        if self.file.tracking.takes is not None and self.file.tracking.live is None:
            TakeFolder(Path(self.file.tracking.takes), self.clock)
        if drives:
            require_reachable(found_at(self.file))

    def start_cameras(self, operator: Operator) -> None:
        """Record the stream, or ask for a recording.

        What lies in the folder of exports before it is not of this run.

        Raises:
            HardwareError: when the folder of exports cannot be listed, or no stream comes.
        """
        from workbench.tracking import Recorder, Stream

        takes, live = self.file.tracking.takes, self.file.tracking.live
        if live is not None:
            self.recorder = Recorder(Stream(**live.model_dump()))
            self.recorder.start()
            return
        self._folder = None if takes is None else TakeFolder(Path(takes), self.clock)
        operator.confirm("Start recording in the tracking software.")

    def collect(
        self, subject: Subject, span: CameraSpan, bundle: Bundle, operator: Operator
    ) -> Path:
        """Stop the recorder, or wait for the export in the bench's folder, or ask for its path.

        Raises:
            HardwareError: when none comes in time, or what was recorded does not show the run.
        """
        collector = self.collector(span, bundle, operator, self._used)
        if self.recorder is not None:
            self.clock.sleep(_TAIL_S)
            return collector.accept(write_stream(self.recorder, bundle))
        if self._folder is not None:
            return collector.wait(self._folder, self.file.tracking.takes_timeout)
        return collector.ask()

    def keep_recorded(self, bundle: Bundle) -> None:
        """Keep the stream so far: what it shows is why the run ended."""
        if self.recorder is not None:
            with suppress(HardwareError):  # of too few frames
                write_stream(self.recorder, bundle)

    def stop_cameras(self) -> None:
        """End a recorder that still runs."""
        if self.recorder is not None:
            self.recorder.close()
            self.recorder = None


class SimulatedBench(Bench):
    """A bench whose supply is simulated, to the bytes that go over its line."""

    def __init__(self, file: BenchFile, clock: Clock) -> None:
        super().__init__(file, clock)
        self.model = model_of(file)
        serial = file.supply.serial
        self.device = simulated_supply(
            self.model.name,
            clock=self.clock,
            load=draw_current,
            serial=serial if isinstance(serial, int) else None,
            channel=file.supply.connection.channel,
        )

    @contextmanager
    def supply(self, bundle: Bundle) -> Iterator[Supply]:
        """Serve the simulated supply on loopback and reach it as a serial bridge would be.

        Without a guardian: the device lives in this process and dies with it.
        """
        family, modbus = self.model.family, isinstance(self.model, ModbusModel)
        with serve(self.device, framing="rtu") as address:
            kind, channel = "rtu-over-tcp" if modbus else "tcp", self.file.supply.connection.channel
            connection, log = Connection(kind, address, channel=channel), bundle.record.wire
            with open_supply(connection, clock=self.clock, wire_log=log, family=family) as supply:
                yield supply


class VirtualBench(SimulatedBench):
    """A bench without hardware; what replaces it is in `virtual` and `hw.simulated`."""

    def __init__(self, file: BenchFile) -> None:
        if file.virtual is None:
            raise InputError(f"bench {file.name!r} has no section 'virtual'")
        self.section = file.virtual
        super().__init__(file, SystemClock() if self.section.real_time else SimulatedClock())
        self._takes = 0

    def start_cameras(self, operator: Operator) -> None:
        """Record always."""

    def collect(
        self, subject: Subject, span: CameraSpan, bundle: Bundle, operator: Operator
    ) -> Path:
        """Let the true robot move as the terminals' voltage says and write the export."""
        from workbench.run.virtual import film
        from workbench.tracking import format_start_time, write_motive, write_row

        # a resumed experiment goes on with the noise of its place in the plan
        self._takes = max(self._takes + 1, bundle.asked.number if bundle.manifest.asked else 1)
        rng = np.random.default_rng([self.section.seed, self._takes])  # same seed, same takes
        filmed = film(self._motion(subject, span, rng), self.file.tracking, self.section, rng)
        take = replace(filmed, header={"Capture Start Time": format_start_time(span.began)})

        def write(path: Path) -> None:
            if self.section.export == "row-1.0":
                write_row(take, path, version="1.0")
            else:
                write_motive(take, path, version="1.23")

        path = bundle.write_take(f"take {span.began:%Y-%m-%d %H.%M.%S}.csv", write)
        return self.collector(span, bundle, operator, used={}).accept(path)  # same seed, same take

    def _motion(self, subject: Subject, span: CameraSpan, rng: np.random.Generator) -> TimeSeries:
        """Return what the true robot did while the cameras ran."""
        from workbench.run.virtual import held, let_go, move, true_robot

        robot = true_robot(subject.model, subject.shape, self.section)
        duration = span.stop - span.start + _TAIL_S
        if span.asked is not None:
            angle = self.section.start_angle
            condition = held(subject.mode, angle, subject.pull, subject.height)
            return let_go(robot, condition, span.asked - span.start, duration, rng)
        history = [(t - span.start, volts) for t, volts in self.device.history]
        return move(robot, subject.mode, history, duration, self.section)


def load_bench(name: str) -> Document[BenchFile]:
    """Read a bench, with the calibration that it names, by path, or the built-in one as `virtual`.

    Raises:
        InputError: when there is none of that name.
        FileFaults: when the file has faults.
    """
    if name == "virtual":
        return with_calibration(load(BUILT_IN, BenchFile))
    if not name.endswith((".yaml", ".yml")):
        what = f"no bench named {name!r}{did_you_mean(name, ['virtual'])}"
        raise InputError(f"{what}; built in: virtual; a path must end in .yaml")
    return with_calibration(load(Path(name), BenchFile))


def make_bench(file: BenchFile) -> Bench:
    """Return the bench of a file; nothing is opened yet."""
    return RealBench(file, LeaseClock()) if file.virtual is None else VirtualBench(file)
