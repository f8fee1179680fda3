"""Wiring of an orb: electrodes and their pins, and the times of a scan; pure.

`reading` makes one from TOML. What is the default here is in `default.toml`, with comments, and
docs/hardware.md draws it.
"""

from dataclasses import dataclass, field, replace
from typing import Final, Literal

Scheme = Literal["taxel", "column"]

SCHEMES: Final[tuple[Scheme, ...]] = ("taxel", "column")


@dataclass(frozen=True, slots=True)
class Electrodes:
    """Pins by their GPIO (BCM) numbers, and converter channels.

    Attributes:
        columns: Pins of the columns, left to right.
        rows: Pins of the rows, top to bottom.
        channels: The converter's channel of each row; a second converter's begin where the
            first one's end.
    """

    columns: tuple[int, ...] = (5, 6, 13, 19, 26)
    rows: tuple[int, ...] = (17, 27, 22, 23, 24)
    channels: tuple[int, ...] = (0, 1, 2, 3, 4)


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

    type: str = "mcp3208"
    bus: int = 0
    devices: tuple[int, ...] = (0,)
    clock_hz: int = 1_000_000
    ground: int | None = 6


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

    row_pf: float = 150.0
    bleed_mohm: float = 50.0
    reach: float = 1.0
    ghosting: float = 0.15


@dataclass(frozen=True, slots=True)
class Times:
    """The slots of a scan.

    Attributes:
        discharge_s: All electrodes grounded before each slot.
        settle_s: From the column's rise to the first conversion.
        samples: Conversions of one reading, which are averaged.
    """

    discharge_s: float = 100e-6
    settle_s: float = 100e-6
    samples: int = 4


@dataclass(frozen=True, slots=True)
class PumpWiring:
    """The pump and its pressure sensor.

    Attributes:
        pin: Switches the pump; high is on.
        channel: The converter's channel of the pressure sensor.
        zero_v: Its output without pressure.
        v_per_kpa: Its slope.
        target_kpa: What the orb is inflated to.
        limit_kpa: Where the pump is refused until somebody looks.
        longest_s: How long the pump may run without a rest.
        rest_s: How long it then rests.
    """

    pin: int = 12
    channel: int = 7
    zero_v: float = 0.2
    v_per_kpa: float = 0.27
    target_kpa: float = 2.2
    limit_kpa: float = 2.4
    longest_s: float = 20.0
    rest_s: float = 20.0


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

    name: str = "orb"
    pitch_mm: float = 10.0
    electrodes: Electrodes = field(default_factory=Electrodes)
    converter: ConverterWiring = field(default_factory=ConverterWiring)
    circuit: CircuitWiring = field(default_factory=CircuitWiring)
    times: Times = field(default_factory=Times)
    scheme: Scheme = "column"
    order: tuple[int, ...] = ()
    supply_v: float = 3.3
    button: int | None = 16
    led: int | None = 20
    pump: PumpWiring | None = field(default_factory=PumpWiring)
    gain: tuple[tuple[float, ...], ...] = ()

    @property
    def rows(self) -> int:
        """How many row electrodes there are."""
        return len(self.electrodes.rows)

    @property
    def columns(self) -> int:
        """How many column electrodes there are."""
        return len(self.electrodes.columns)

    def scanned(self, scheme: Scheme) -> "Wiring":
        """Return the same wiring with another scheme."""
        return replace(self, scheme=scheme)
