"""Wiring of an orb: electrodes and their pins, and the times of a scan; pure.

`wiring_file` makes one from TOML: `config.settings` checks each entry against the metadata of its
field. The defaults are in `default.toml`, with comments, and docs/hardware.md draws them.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, get_args

from controller.sensors.hardware.converters import names

Scheme = Literal["taxel", "column"]

SCHEMES: Final[tuple[Scheme, ...]] = get_args(Scheme)
MAX_ELECTRODES: Final = 32  # of one kind


def _number(default: Any, low: float, high: float, **limits: Any) -> Any:
    """Return a field for a number within limits."""
    return field(default=default, metadata={"range": (low, high), **limits})


def _numbers(default: tuple[int, ...], high: int, most: int = MAX_ELECTRODES) -> Any:
    """Return a field for a list of different whole numbers from 0."""
    expected = f"a list of 1 to {most} different whole numbers from 0 to {high}"
    limits = {"range": (0, high), "count": (1, most), "expected": expected}
    return field(default=default, metadata=limits)


def _pin(default: int | None) -> Any:
    """Return a field for the number of a GPIO pin."""
    return _number(default, 0, 27)


@dataclass(frozen=True, slots=True)
class Electrodes:
    """Pins by their GPIO (BCM) numbers, and converter channels.

    Attributes:
        columns: Pins of the columns, left to right.
        rows: Pins of the rows, top to bottom.
        channels: The converter's channel of each row; a second converter's begin where the
            first one's end.
    """

    columns: tuple[int, ...] = _numbers((5, 6, 13, 19, 26), 27)
    rows: tuple[int, ...] = _numbers((17, 27, 22, 23, 24), 27)
    channels: tuple[int, ...] = _numbers((0, 1, 2, 3, 4), 63)


@dataclass(frozen=True, slots=True)
class ConverterWiring:
    """The converters, all of one type.

    Attributes:
        type: A module in `controller/sensors/hardware/converters`.
        bus: The SPI bus.
        devices: Its chip selects, one a converter.
        clock_hz: SPI clock.
        ground: The input of each converter that is tied to ground: reading it empties the
            sampling capacitor of what the last reading left there. None: there is none, and each
            row is read once while it is grounded, which only the scheme "taxel" can do.
    """

    type: str = field(default="mcp3208", metadata={"choices": tuple(names())})
    bus: int = _number(0, 0, 6)
    devices: tuple[int, ...] = _numbers((0,), 3, 4)
    clock_hz: int = _number(1_000_000, 10_000, 10_000_000)
    ground: int | None = _number(6, 0, 7)


@dataclass(frozen=True, slots=True)
class CircuitWiring:
    """The analogue parts, as they were soldered in.

    Attributes:
        row_pf: Capacitance of a row to ground: its capacitor, converter input, pin and lead.
        bleed_mohm: R_m of the paper (section 3.2), from each row to ground.
        reach: Share of a row's voltage that comes to the converter: below 1 with C_m in series.
        ghosting: Share of its row's other taxels that is left in a taxel's reading. By default as
            much as in the virtual orb's, on which the bundle that ships was trained.
    """

    row_pf: float = _number(150.0, 1.0, 10_000.0)
    bleed_mohm: float = _number(50.0, 0.1, 10_000.0)
    reach: float = _number(1.0, 0.01, 1.0)
    ghosting: float = _number(0.15, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Times:
    """The slots of a scan.

    Attributes:
        discharge_s: All electrodes grounded before each slot.
        settle_s: From the column's rise to the first conversion.
        samples: Conversions of one reading, which are averaged.
    """

    discharge_s: float = _number(100e-6, 1.0, 100_000.0, divisor=1e6, key="discharge_us")
    settle_s: float = _number(100e-6, 1.0, 100_000.0, divisor=1e6, key="settle_us")
    samples: int = _number(4, 1, 256)


@dataclass(frozen=True, slots=True)
class PumpWiring:
    """The pump and its pressure sensor.

    Attributes:
        pin: Switches the pump; high is on.
        channel: The converter's channel of the pressure sensor.
        zero_v: Its output without pressure.
        v_per_kpa: Its slope.
        target_kpa: What the orb is inflated to.
        limit_kpa: Pressure at which the pump is refused until the next start.
        longest_s: How long the pump may run without a rest.
        rest_s: How long it then rests.
    """

    pin: int = _pin(12)
    channel: int = _number(7, 0, 63)
    zero_v: float = _number(0.2, 0.0, 5.0)
    v_per_kpa: float = _number(0.27, 0.001, 10.0)
    target_kpa: float = _number(2.2, 0.05, 20.0)
    limit_kpa: float = _number(2.4, 0.05, 20.0)
    longest_s: float = _number(20.0, 0.5, 120.0)
    rest_s: float = _number(20.0, 0.5, 600.0)


@dataclass(frozen=True, slots=True)
class Wiring:
    """Everything about one orb's hardware.

    Attributes:
        name: What the orb is called.
        pitch_mm: Distance of two taxels.
        electrodes: Pins and channels.
        converter: Which, and where.
        circuit: The analogue parts.
        times: The slots.
        scheme: "taxel": one row floats at a time, as in the paper; "column": all rows of a
            column settle together.
        order: The columns in the order of scanning; (): left to right.
        supply_v: Of the pins; also the converter's reference.
        button: The label button's pin, to ground; None: there is none.
        led: The status LED's pin; None: there is none.
        pump: The pump; None: the orb is inflated by hand.
        gain: Factor of each taxel, (rows, columns), from a capacitance meter; (): all 1.
    """

    name: str = field(
        default="orb",
        metadata={
            "pattern": r"[A-Za-z0-9_-]{1,24}",
            "expected": "1 to 24 letters, digits, - and _",
        },
    )
    pitch_mm: float = _number(10.0, 0.1, 1000.0)
    electrodes: Electrodes = field(default_factory=Electrodes)
    converter: ConverterWiring = field(default_factory=ConverterWiring)
    circuit: CircuitWiring = field(default_factory=CircuitWiring)
    times: Times = field(default_factory=Times)
    scheme: Scheme = "column"
    order: tuple[int, ...] = _numbers((), MAX_ELECTRODES - 1)
    supply_v: float = _number(3.3, 1.0, 5.5)
    button: int | None = _pin(16)
    led: int | None = _pin(20)
    pump: PumpWiring | None = field(default_factory=PumpWiring)
    gain: tuple[tuple[float, ...], ...] = ()

    @property
    def rows(self) -> int:
        """Number of row electrodes."""
        return len(self.electrodes.rows)

    @property
    def columns(self) -> int:
        """Number of column electrodes."""
        return len(self.electrodes.columns)

    def scanned(self, scheme: Scheme) -> "Wiring":
        """Return the same wiring with another scheme."""
        return replace(self, scheme=scheme)
