"""`workbench/bench-1`: this lab's supply, limits, calibration, cameras and robot."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, SerializeAsAny, Tag, field_validator, model_validator

from workbench.errors import InputError
from workbench.schemas.calibration import Calibration, MotorLine
from workbench.schemas.model import UNITS
from workbench.schemas.quantity import UnitQuantity
from workbench.schemas.section import Section
from workbench.schemas.tracking import Bodies, ExportAxes, Limits, Marker
from workbench.schemas.wording import shortened

__all__ = [
    "BenchFile",
    "CameraSettings",
    "ConnectionSettings",
    "LiveSection",
    "SupplyLimits",
    "SupplySection",
    "VirtualSection",
]

Port = Annotated[int, Field(ge=1, le=65535)]
Probability = Annotated[float, Field(ge=0, lt=0.5)]

CalibrationOrPath = Annotated[
    Annotated[SerializeAsAny[Calibration], Tag("inline")] | Annotated[str, Tag("named")],
    Discriminator(lambda given: "named" if isinstance(given, str) else "inline"),
]
"""Only the kind that was meant is reported on."""


class ConnectionSettings(Section):
    """How the supply is reached."""

    kind: Literal["simulated", "serial", "rtu-over-tcp", "tcp"]
    """`tcp` is Modbus TCP, or a raw socket for supplies that speak text; `simulated` starts a
    device that answers the same bytes."""
    port: str | None = None
    """Serial port, best under /dev/serial/by-id, or COM3. When left out, the supply is looked for
    at each port, by its serial number."""
    address: str | None = None
    """host:port of a TCP connection."""
    baud: Annotated[int, Field(ge=1200, le=921600)] | None = None
    """Serial speed; that of the model when it leaves the factory when left out."""
    unit: Annotated[int, Field(ge=1, le=247)] = 1
    """Modbus unit id."""
    channel: Annotated[int, Field(ge=1)] = 1
    """Which output the motor hangs on, where a supply has several."""
    timeout: Annotated[float, UnitQuantity("time", low=0.1, high=5)] = 0.5
    """How long an answer may take; firmware 1.42 of a Riden needs 0.5 s."""
    gap: Annotated[float, UnitQuantity("time", low=0, high=2)] | None = None
    """Least time between an answer and the next command; what the family needs when left out."""
    echo: bool = False
    """Whether the adapter sends back what it is sent, as some for RS485 do."""

    @model_validator(mode="after")
    def _complete(self) -> ConnectionSettings:
        if self.kind in ("tcp", "rtu-over-tcp") and self.address is None:
            raise ValueError(f"kind: {self.kind} needs an address, host:port")
        self._refuse_other_way()
        return self

    def _refuse_other_way(self) -> None:
        """Refuse a key of another kind, and an address that cannot be reached as it is written."""
        of_kind = {"serial": "port", "tcp": "address", "rtu-over-tcp": "address"}
        for key in ("port", "address"):
            if getattr(self, key) is not None and key != of_kind.get(self.kind):
                raise ValueError(f"kind: {self.kind} has no {key}; remove it, or name another kind")
        if self.address is not None:
            host, colon, port = self.address.rpartition(":")
            whole = port.isascii() and port.isdecimal()
            if not (colon and host and whole and 1 <= int(port[:6]) <= 65535) or "/" in host:
                raise ValueError(
                    f"address: {shortened(self.address)!r} is not host:port with a port from 1 to "
                    "65535, such as 192.168.1.20:5025"
                )


class SupplyLimits(Section):
    """What the supply may never exceed here."""

    voltage: Annotated[float, UnitQuantity("voltage", above=0, high=60)] = 5.5
    current: Annotated[float, UnitQuantity("current", above=0, high=30)] = 1.5
    """Current limit of the output."""
    over_voltage: Annotated[float, UnitQuantity("voltage", above=0, high=62)] = 6.0
    over_current: Annotated[float, UnitQuantity("current", above=0, high=31)] = 1.6
    slew: Annotated[float, UnitQuantity("voltage_rate", above=0)] = 20.0
    """Fastest change of the voltage while the output is on."""

    @model_validator(mode="after")
    def _ordered(self) -> SupplyLimits:
        if self.over_voltage <= self.voltage:
            raise ValueError(
                f"over_voltage {self.over_voltage:g} V must be above voltage {self.voltage:g} V"
            )
        if self.over_current <= self.current:
            raise ValueError(
                f"over_current {self.over_current:g} A must be above current {self.current:g} A"
            )
        return self


class SupplySection(Section):
    """The motor's supply."""

    model: str
    """Model name as in `workbench supply models`."""
    family: Literal["riden", "dps", "hanmatek", "korad", "scpi"] | None = None
    """Which language it speaks; known from the model when left out."""
    serial: int | str | None = None
    """Serial number; when given, another supply on the same port is refused. A number is filled up
    with zeros to eight digits, as a Riden shows it."""
    connection: ConnectionSettings
    limits: SupplyLimits

    @model_validator(mode="after")
    def _findable(self) -> SupplySection:
        connection = self.connection
        if connection.kind == "serial" and connection.port is None and self.serial is None:
            raise ValueError(
                "connection: kind: serial needs a port, or the supply's serial number to find it by"
            )
        return self

    @property
    def serial_number(self) -> str | None:
        """The serial number as the supply reports it."""
        return f"{self.serial:08d}" if isinstance(self.serial, int) else self.serial


class LiveSection(Section):
    """Motive's NatNet stream, as its streaming pane has it."""

    server: str
    """Address of the tracking PC."""
    local: str | None = None
    """Address of this computer that reaches it; found when left out."""
    multicast: bool = False
    """Motive's transmission type; unicast when false."""
    group: str = "239.255.42.99"
    """Multicast address."""
    command_port: Port = 1510
    data_port: Port = 1511
    """Of a multicast stream."""


class CameraSettings(Section):
    """The tracking system."""

    axes: ExportAxes = ExportAxes()
    bodies: Bodies = Bodies()
    markers: dict[str, tuple[Marker, ...]] = {}
    """Where the markers sit on a body: forward, left, up in mm."""
    limits: Limits = {}
    """By body, the greatest error of a sample that counts; as the export reports it."""
    cleaning: Literal["default", "thesis"] = "default"
    """Recipe that turns a take into a track."""
    takes: str | None = None
    """Folder where exports appear: after a run the export is awaited there. Best an absolute path;
    without it the operator is asked for the path of each export."""
    takes_timeout: Annotated[float, UnitQuantity("time", above=0)] = 1800.0
    """Longest wait for an export."""
    takes_tolerance: Annotated[float, UnitQuantity("time", above=0)] = 60.0
    """How far the clocks of this computer and of the tracking PC may lie apart."""
    live: LiveSection | None = None
    """Record this stream during each run; no export is awaited then."""

    @model_validator(mode="after")
    def _one_way(self) -> CameraSettings:
        if self.live is not None and self.takes is not None:
            raise ValueError("takes come from the folder `takes` or from `live`, not from both")
        return self


class VirtualSection(Section):
    """The robot and the cameras that replace the real ones; the twin never reads this."""

    seed: Annotated[int, Field(ge=0)] = 0
    real_time: bool = False
    """Wait as long as a real bench would, also for a person at its prompts; otherwise the clock is
    simulated, and prompts are passed."""
    parameters: dict[str, float] = {}
    """Where the true robot differs from the model: parameter of the model file -> true value."""
    effects: dict[str, dict[str, Annotated[float, Field(allow_inf_nan=False)]]] = {}
    """What the true robot has and the model has not: effect -> quantity -> value, SI."""
    motor_slope: Annotated[float, UnitQuantity("speed_per_voltage", above=0)] = 4.4
    motor_offset: Annotated[float, UnitQuantity("speed")] = -2.9
    motor_lag: Annotated[float, UnitQuantity("time", above=0)] = 0.05
    """First-order lag of the motor behind the voltage."""
    start_angle: Annotated[float, UnitQuantity("angle")] = 1.5707963267948966
    """Angle of the rotor before the run; 90 deg is straight down."""
    increments: Annotated[int, Field(ge=4, le=128)] = 16
    """How many the true beam has; the twin's has 16."""
    noise: Annotated[float, UnitQuantity("length", low=0, high=0.01)] = 0.0002
    """Standard deviation of a marker's coordinate."""
    gap_share: Probability = 0.0
    """Share of marker samples that are lost."""
    gap_length: Annotated[float, UnitQuantity("time", above=0)] = 0.04
    """Mean length of a gap."""
    export: Literal["row-1.0", "motive-1.23"] = "row-1.0"

    @field_validator("parameters", mode="after")
    @classmethod
    def _known(cls, parameters: dict[str, float]) -> dict[str, float]:
        unknown = [name for name in parameters if name not in UNITS]
        if unknown:
            raise ValueError(f"unknown model parameter {unknown[0]!r}; known: {', '.join(UNITS)}")
        return parameters


class BenchFile(Section):
    """A bench."""

    schema_: Annotated[Literal["workbench/bench-1"], Field(alias="schema")]
    name: str
    model: str = "thesis"
    """Robot model used where the protocol names none: a name or a path."""
    shape: str = "thesis-initial"
    """Beam shape used where the protocol names none: a name or a path."""
    supply: SupplySection
    calibration: CalibrationOrPath
    """The speed-voltage line, or the path of a calibration file from this file's folder."""
    tracking: CameraSettings = CameraSettings()
    virtual: VirtualSection | None = None
    """Present only on a bench without hardware."""

    @property
    def line(self) -> MotorLine:
        """Return the speed-voltage line.

        Raises:
            InputError: when it is in a file that was not read with the bench.
        """
        if isinstance(self.calibration, str):
            raise InputError(
                f"bench {self.name!r}: calibration {self.calibration} was not read; "
                "read the bench with `load_bench`"
            )
        return self.calibration

    @model_validator(mode="after")
    def _virtual_supply(self) -> BenchFile:
        simulated = self.supply.connection.kind == "simulated"
        if simulated and self.virtual is None:
            raise ValueError("supply.connection.kind simulated needs a section 'virtual'")
        if self.virtual is not None and not simulated:
            raise ValueError("a section 'virtual' needs supply.connection.kind simulated")
        return self
