"""What two DeviceNet slaves are made of: a valve terminal of another maker, and an encoder.

The terminal has a Parameter object that describes itself in full, or in stubs; the encoder has what
its manual prints, and no word about itself in the Parameter object beyond a stub. Data types, the
Parameter object and its services are those of the CIP books. No script to run.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from devicenet_master import GET, GET_ALL, GET_ENUM_STRING, RESET, RESTORE, SAVE, SET
from steps import position_at

IDENTITY, MESSAGE_ROUTER, DEVICENET, ASSEMBLY, PARAMETER = 0x01, 0x02, 0x03, 0x04, 0x0F
ENCODER, VALVES = 0x2F, 0x64

# Elementary data types
BOOL, SINT, INT, DINT, USINT, UINT, UDINT = 0xC1, 0xC2, 0xC3, 0xC4, 0xC6, 0xC7, 0xC8
REAL, WORD, SHORT_STRING = 0xCA, 0xD2, 0xDA
FORMATS = {
    BOOL: "<?",
    SINT: "<b",
    INT: "<h",
    DINT: "<i",
    USINT: "<B",
    UINT: "<H",
    UDINT: "<I",
    REAL: "<f",
    WORD: "<H",
}

# Descriptor of a parameter
PATH_SETTABLE, ENUMERATED, SCALED, LINKS, READ_ONLY, MONITOR = 0x01, 0x02, 0x04, 0x08, 0x10, 0x20

# General status codes
SERVICE_NOT_SUPPORTED, INVALID_VALUE, NOT_SETTABLE, NOT_ENOUGH = 0x08, 0x09, 0x0E, 0x13
ATTRIBUTE_NOT_SUPPORTED, TOO_MUCH, NO_OBJECT = 0x14, 0x15, 0x16

# Parameters of an encoder that are no settings: the manual's chapter 7
LINKED = (3, 4, 5, 6, 7, 8, 9, 10, 12, 80, 81, 82, 85, 83, 84, 88, 86, 87, 89)


class Refusal(Exception):
    """An error response."""

    def __init__(self, status: int, additional: int = 0xFF) -> None:
        super().__init__(f"{status:02X}/{additional:02X}")
        self.status = status
        self.additional = additional


def text(words: str) -> bytes:
    """A SHORT_STRING."""
    return bytes([len(words)]) + words.encode("latin-1")


def packed(kind: int, value: float | str) -> bytes:
    """A value as it lies on the bus."""
    return text(str(value)) if kind == SHORT_STRING else struct.pack(FORMATS[kind], value)


@dataclass
class Attribute:
    """A value with its type; without limits none is checked."""

    kind: int
    value: float | str | bytes
    settable: bool = False
    limits: tuple[float, float] | None = None

    def octets(self) -> bytes:
        """As it lies on the bus."""
        return self.value if isinstance(self.value, bytes) else packed(self.kind, self.value)

    def take(self, octets: bytes) -> None:
        """Sets it, or refuses."""
        if not self.settable:
            raise Refusal(NOT_SETTABLE)
        if isinstance(self.value, bytes):
            expected = len(self.value)
        elif self.kind == SHORT_STRING:
            expected = 1 + (octets[0] if octets else 0)
        else:
            expected = struct.calcsize(FORMATS[self.kind])
        if len(octets) != expected:
            raise Refusal(NOT_ENOUGH if len(octets) < expected else TOO_MUCH)
        if isinstance(self.value, bytes):
            self.value = octets
            return
        if self.kind == SHORT_STRING:
            self.value = octets[1:].decode("latin-1")
            return
        (value,) = struct.unpack(FORMATS[self.kind], octets)
        if self.limits is not None and not self.limits[0] <= value <= self.limits[1]:
            raise Refusal(INVALID_VALUE)
        self.value = value


@dataclass
class Described:
    """How the Parameter object describes an attribute."""

    name: str
    attribute: int
    units: str = ""
    help: str = ""
    default: float | str = 0
    limits: tuple[float, float] = (0, 0)
    descriptor: int = 0
    strings: Sequence[str] = ()
    # Multiplier, divisor, base, offset; decimal places.
    scaling: tuple[int, int, int, int] = (1, 1, 1, 0)
    places: int = 0
    # Some makers write the numbers of the first DeviceNet edition: USINT is 8.
    kind_told: int | None = None


@dataclass
class Device:
    """Objects by class and instance, and how they are asked."""

    classes: dict[int, dict[int, dict[int, Attribute]]]
    linked_class: int = VALVES
    described: Sequence[Described] = ()
    # Whether parameters have attributes 7 and higher.
    is_full: bool = True
    # What Reset, Restore and Save of the linked class do.
    services: dict[int, Callable[[], None]] = field(default_factory=dict)
    # Told of each attribute that was set, with its value before.
    was_set: Callable[[int, int, float | str | bytes], None] = lambda *_: None

    def serve(self, service: int, class_id: int, instance: int, data: bytes) -> bytes:
        """The data of the response."""
        if class_id == PARAMETER and self.described:
            return self._parameter(service, instance, data)
        instances = self.classes.get(class_id)
        if instances is None:
            raise Refusal(NO_OBJECT)
        if class_id == self.linked_class and service in self.services:
            self.services[service]()
            return b""
        if instance == 0:
            return self._of_class(service, data, max(instances))
        if instance not in instances:
            raise Refusal(NO_OBJECT)
        attributes = instances[instance]
        if service == GET_ALL and class_id == IDENTITY:
            return b"".join(attribute.octets() for attribute in attributes.values())
        if service not in (GET, SET):
            raise Refusal(SERVICE_NOT_SUPPORTED)
        if not data:
            raise Refusal(NOT_ENOUGH)
        if data[0] not in attributes:
            raise Refusal(ATTRIBUTE_NOT_SUPPORTED)
        if service == GET:
            return attributes[data[0]].octets()
        self._set(class_id, attributes[data[0]], data[0], data[1:])
        return b""

    def _set(self, class_id: int, attribute: Attribute, number: int, octets: bytes) -> None:
        before = attribute.value
        attribute.take(octets)
        self.was_set(class_id, number, before)

    @staticmethod
    def _of_class(service: int, data: bytes, instances: int) -> bytes:
        if service != GET:
            raise Refusal(SERVICE_NOT_SUPPORTED)
        if not data:
            raise Refusal(NOT_ENOUGH)
        if data[0] not in (1, 2):
            raise Refusal(ATTRIBUTE_NOT_SUPPORTED)
        return packed(UINT, 1 if data[0] == 1 else instances)

    def _parameter(self, service: int, instance: int, data: bytes) -> bytes:
        if service in (GET, SET) and not data:
            raise Refusal(NOT_ENOUGH)
        if instance == 0:
            # Instances are supported; all attributes; Save is needed; values are kept.
            descriptor = 0x01 | self.is_full << 1
            numbers = {1: 1, 2: len(self.described), 8: descriptor, 9: 0}
            if service != GET:
                raise Refusal(SERVICE_NOT_SUPPORTED)
            if data[0] == 10 and self.is_full:
                return packed(USINT, 1)
            if data[0] not in numbers:
                raise Refusal(ATTRIBUTE_NOT_SUPPORTED)
            return packed(UINT, numbers[data[0]])
        if instance > len(self.described):
            raise Refusal(NO_OBJECT)
        told = self.described[instance - 1]
        target = self.classes[self.linked_class][1][told.attribute]
        attributes = self._attributes(told, target)
        if service == GET_ALL:
            return b"".join(attributes.values())
        if service == GET_ENUM_STRING and self.is_full:
            if not told.descriptor & ENUMERATED or not data:
                raise Refusal(SERVICE_NOT_SUPPORTED)
            if data[0] >= len(told.strings):
                raise Refusal(INVALID_VALUE)
            return text(told.strings[data[0]])
        if service == GET:
            if data[0] not in attributes:
                raise Refusal(ATTRIBUTE_NOT_SUPPORTED)
            return attributes[data[0]]
        if service == SET:
            if data[0] != 1:
                raise Refusal(NOT_SETTABLE if data[0] in attributes else ATTRIBUTE_NOT_SUPPORTED)
            self._set(self.linked_class, target, told.attribute, data[1:])
            return b""
        raise Refusal(SERVICE_NOT_SUPPORTED)

    def _attributes(self, told: Described, target: Attribute) -> dict[int, bytes]:
        kind = told.kind_told if told.kind_told is not None else target.kind
        path = bytes([0x20, self.linked_class, 0x24, 1, 0x30, told.attribute])
        size = len(target.octets())
        stub = {
            1: target.octets(),
            2: bytes([len(path)]),
            3: path,
            4: packed(UINT, told.descriptor),
            5: bytes([kind]),
            6: bytes([size]),
        }
        if not self.is_full:
            return stub
        low, high = told.limits
        if target.kind == SHORT_STRING:
            bounds = {10: text(""), 11: text(""), 12: text(str(told.default))}
        else:
            bounds = {
                10: packed(target.kind, low),
                11: packed(target.kind, high),
                12: packed(target.kind, told.default),
            }
        multiplier, divisor, base, offset = told.scaling
        return stub | {7: text(told.name), 8: text(told.units), 9: text(told.help)} | bounds | {
            13: packed(UINT, multiplier),
            14: packed(UINT, divisor),
            15: packed(UINT, base),
            16: packed(INT, offset),
            **{number: packed(UINT, 0) for number in range(17, 21)},
            21: bytes([told.places]),
        }


def identity(vendor: int, kind: int, code: int, serial: int, name: str) -> dict[int, Attribute]:
    """The Identity object."""
    return {
        1: Attribute(UINT, vendor),
        2: Attribute(UINT, kind),
        3: Attribute(UINT, code),
        4: Attribute(WORD, b"\x02\x07"),
        5: Attribute(WORD, 0),
        6: Attribute(UDINT, serial),
        7: Attribute(SHORT_STRING, name),
    }


VALVE_PARAMETERS = (
    Described(
        "Fault action",
        1,
        help="What the valves do when the master is lost",
        limits=(0, 2),
        descriptor=ENUMERATED,
        strings=("Hold", "Close", "Open"),
    ),
    Described("Switch delay", 2, "ms", "Delay of each valve", 100, (0, 5000)),
    Described(
        "Supply",
        3,
        "V",
        "Supply of the valves",
        240,
        (0, 400),
        READ_ONLY | MONITOR | SCALED,
        scaling=(1, 10, 1, 0),
        places=1,
    ),
    Described("Trim", 4, "%", "", 0, (-100, 100)),
    Described(
        "Options",
        5,
        limits=(0, 7),
        descriptor=ENUMERATED,
        strings=("Brake", "Beeper", "Boost"),
    ),
    Described("Cycles", 6, descriptor=READ_ONLY | MONITOR, limits=(0, 4_294_967_295)),
    Described("Position", 7, limits=(-2_147_483_648, 2_147_483_647)),
    Described("Tag", 8, help="A name of your own", default="none"),
    Described("Ratio", 9, limits=(0.0, 1.5), default=1.0),
    Described("Old style", 10, limits=(0, 200), kind_told=0x08),
)


def valve_terminal(full: bool = True) -> Device:
    """A device of another maker, with ten parameters of nine types and two attributes besides."""
    valves = {
        1: Attribute(USINT, 1, True, (0, 2)),
        2: Attribute(UINT, 250, True, (0, 5000)),
        3: Attribute(UINT, 237),
        4: Attribute(INT, -12, True, (-100, 100)),
        5: Attribute(WORD, 5, True, (0, 7)),
        6: Attribute(UDINT, 4_000_000_000),
        7: Attribute(DINT, -2_000_000_000, True),
        8: Attribute(SHORT_STRING, "press 3", True),
        9: Attribute(REAL, 0.5, True, (0.0, 1.5)),
        10: Attribute(USINT, 42, True, (0, 200)),
        100: Attribute(USINT, bytes(range(40))),
        101: Attribute(USINT, bytes(20), True),
    }
    return Device(
        {
            IDENTITY: {1: identity(777, 0x1B, 0x1234, 0xC0FFEE42, "Valve Terminal 8")},
            MESSAGE_ROUTER: {1: {}},
            VALVES: {1: valves},
        },
        described=VALVE_PARAMETERS,
        is_full=full,
    )


class Encoder:
    """An AMG 11 D 29 by its manual, on a shaft that stands still at `raw`."""

    STEPS, TURNS = 8192, 65536

    def __init__(self, raw: int, serial: int = 4711) -> None:
        self.raw = raw
        self.saves = 0
        zero, whole = 0, self.STEPS * self.TURNS
        listed = bytes([*range(1, 13), *range(80, 90), 91, 95])
        self.attributes = {
            1: Attribute(USINT, len(listed)),
            2: Attribute(USINT, listed),
            3: Attribute(BOOL, False, True, (0, 1)),
            4: Attribute(BOOL, False),
            5: Attribute(BOOL, True),
            6: Attribute(USINT, 0),
            7: Attribute(UDINT, self.STEPS, True, (1, self.STEPS)),
            8: Attribute(UDINT, whole, True, (1, whole)),
            9: Attribute(UDINT, 0),
            10: Attribute(UDINT, 0, True, (0, whole - 1)),
            11: Attribute(DINT, 1, True, (1, whole)),
            12: Attribute(DINT, zero),
            80: Attribute(USINT, 0x06),
            81: Attribute(UDINT, self.STEPS),
            82: Attribute(UINT, self.TURNS - 1),
            83: Attribute(UINT, 0),
            84: Attribute(UINT, 1),
            85: Attribute(BOOL, False),
            86: Attribute(UINT, 0),
            87: Attribute(UINT, 0),
            88: Attribute(BOOL, False),
            89: Attribute(UDINT, 0x0101_0110),
            91: Attribute(DINT, 0),
            95: Attribute(UINT, 2),
        }
        self.kept = self._settings()
        self.defaults = self._settings()
        # Chapter 6: the position, and in instance 2 the flags besides.
        self.assemblies = {1: {3: Attribute(USINT, b"")}, 2: {3: Attribute(USINT, b"")}}
        self._refresh()
        self.device = Device(
            {
                IDENTITY: {1: identity(468, 0, 0x0A, serial, "AMG 11 - Multiturn")},
                MESSAGE_ROUTER: {1: {}},
                ASSEMBLY: self.assemblies,
                ENCODER: {1: self.attributes},
            },
            linked_class=ENCODER,
            described=[Described("", attribute) for attribute in LINKED],
            is_full=False,
            services={
                RESET: lambda: self._put(self.defaults),
                RESTORE: lambda: self._put(self.kept),
                SAVE: self._save,
            },
            was_set=self._was_set,
        )

    def number(self, attribute: int) -> int:
        """A value as it is now."""
        value = self.attributes[attribute].value
        assert isinstance(value, int)
        return value

    def _settings(self) -> dict[int, int]:
        return {number: self.number(number) for number in (3, 7, 8, 10, 11, 91)}

    def _put(self, settings: dict[int, int]) -> None:
        for number, value in settings.items():
            self.attributes[number].value = value
        self._refresh()

    def _save(self) -> None:
        self.saves += 1
        self.kept = self._settings()

    def _was_set(self, class_id: int, attribute: int, before: float | str | bytes) -> None:
        if class_id != ENCODER:
            return
        if attribute == 10:
            self.attributes[91].value = self.number(10) - self._without_offset()
        elif attribute in (3, 7, 8) and self.number(attribute) != before:
            if attribute == 7:
                turns = max(1, self.number(8) // int(before))
                self.attributes[8].value = self.number(7) * turns
            self.attributes[10].value = self.attributes[91].value = 0
        self._refresh()

    def _without_offset(self) -> int:
        return position_at(self.raw, self.number(7), self.number(8), 0, not self.number(3))

    def _refresh(self) -> None:
        total, steps = self.number(8), self.number(7)
        self.attributes[12].value = (self._without_offset() + self.number(91)) % total
        self.attributes[10].limits = (0, total - 1)
        self.attributes[11].limits = (1, total)
        self.attributes[11].value = min(self.number(11), total)
        # Not more than the shaft can turn: steps per turn times the turns of the disc.
        self.attributes[8].limits = (1, steps * self.TURNS)
        self.attributes[80].value = 0x06 | bool(self.number(3))
        position = packed(DINT, self.number(12))
        self.assemblies[1][3].value, self.assemblies[2][3].value = position, position + b"\0"

    @property
    def inputs(self) -> bytes:
        """What a poll brings: instance 1 of the Assembly object."""
        return self.assemblies[1][3].octets()
