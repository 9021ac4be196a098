"""Chapters 4 to 8 of the manual: settings and objects. No script: see `devicenet_chapters.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import devicenet_master as book
from steps import Wrong, expect, position_at
from walkthrough import (
    ACKNOWLEDGE_HANDLER,
    ASSEMBLY,
    CONFIGURING,
    CONNECTION,
    COS_CONNECTION,
    COS_DELTA,
    DEFAULT_TOTAL,
    DEVICENET,
    DIRECTION,
    ENCODER,
    EXPLICIT_CONNECTION,
    IDENTITY,
    MESSAGE_ROUTER,
    OFFSET,
    PARAMETER,
    POLL_CONNECTION,
    POSITION,
    PRESET,
    PRODUCED_PATH,
    PRODUCED_SIZE,
    STATE,
    STEPS,
    STEPS_PER_TURN,
    TOTAL,
    TURNS,
    Walk,
    expect_refusal,
    signed,
    udint,
    uint,
    unsigned,
)

STILL_AT = 100_000
PRODUCED_PATH_LENGTH = 13
SERVICES = {book.RESET: "Reset", book.RESTORE: "Restore", book.SAVE: "Save"}


@dataclass(frozen=True)
class Attribute:
    """A row of the tables in chapter 8."""

    octets: int | None
    access: str = "read"
    value: int | None = None


# What an AMG 81 D29 says that was never set, at rest at STILL_AT.
ENCODER_ATTRIBUTES = {
    1: Attribute(1, value=24),
    2: Attribute(24),
    3: Attribute(1, "read/write", 0),
    4: Attribute(1, value=0),
    5: Attribute(1, value=1),
    6: Attribute(1, value=0),
    7: Attribute(4, "read/write", STEPS),
    8: Attribute(4, "read/write", DEFAULT_TOTAL),
    9: Attribute(4, value=0),
    10: Attribute(4, "read/write", 0),
    11: Attribute(4, "read/write", 1),
    12: Attribute(4, value=STILL_AT),
    80: Attribute(1, value=0b110),
    81: Attribute(4, value=STEPS),
    82: Attribute(2, value=0xFFFF),
    83: Attribute(2, value=0),
    84: Attribute(2, value=0x0001),
    85: Attribute(1, value=0),
    86: Attribute(2, value=0),
    87: Attribute(2, value=0x0010),
    88: Attribute(1, value=0),
    89: Attribute(4, value=0x0101_0110),
    91: Attribute(4, value=0),
    95: Attribute(2, value=2),
}

# Chapter 7: name and attribute of 2F for each instance of the parameter object.
PARAMETERS = {
    1: ("Sense of rotation", 3),
    2: ("Internal diagnostic function (not used)", 4),
    3: ("Scaling function", 5),
    4: ("Position format", 6),
    5: ("Steps per turn", 7),
    6: ("Total resolution in steps", 8),
    7: ("Measurement steps (not used)", 9),
    8: ("Preset value", 10),
    9: ("Position value", 12),
    10: ("Operating status", 80),
    11: ("Singleturn resolution", 81),
    12: ("Number of revolutions", 82),
    13: ("Alarm flag", 85),
    14: ("Alarm signals", 83),
    15: ("Supported alarm signals", 84),
    16: ("Warning flag", 88),
    17: ("Warning messages", 86),
    18: ("Supported warning messages", 87),
    19: ("Profile / software version", 89),
}
NAME_OCTETS, UNITS_OCTETS, HELP_OCTETS = 16, 4, 64
# Elementary data types: BOOL, DINT, USINT, UINT, UDINT.
DATA_TYPES = {0xC1: 1, 0xC4: 4, 0xC6: 1, 0xC7: 2, 0xC8: 4}
TYPE_OF = {3: 0xC1, 4: 0xC1, 5: 0xC1, 85: 0xC1, 88: 0xC1, 6: 0xC6, 80: 0xC6, 12: 0xC4}
TYPE_OF |= dict.fromkeys((7, 8, 9, 10, 81, 89), 0xC8) | dict.fromkeys((82, 83, 84, 86, 87), 0xC7)
SUPPORTS_ENUMERATION, READ_ONLY = 1 << 1, 1 << 4

# Chapter 5, with the revision of each class.
CLASSES = {
    IDENTITY: (1, 1),
    MESSAGE_ROUTER: (1, 1),
    DEVICENET: (1, 2),
    ASSEMBLY: (2, 2),
    PARAMETER: (19, 1),
    ACKNOWLEDGE_HANDLER: (1, 1),
    ENCODER: (1, 1),
}


def short_string(octets: bytes) -> str:
    """A SHORT_STRING of printable characters."""
    if not octets or octets[0] != len(octets) - 1:
        raise Wrong(f"no SHORT_STRING: [{octets.hex(' ')}]")
    text = octets[1:].decode("latin-1")
    if not text.isprintable():
        raise Wrong(f"a text with characters that do not print: {text!r}")
    return text


class DeviceObjects(Walk):
    """Chapters 4 to 8, on a shaft at rest at STILL_AT, for `connected`."""

    def encoder_octets(self, attribute: int) -> bytes:
        """An attribute of the encoder position object."""
        return self.master.get(ENCODER, 1, attribute)

    # --- Chapter 4: operating parameters

    def has_the_defaults_of_chapter_4(self) -> str:
        return self.expect_settings(0, STEPS, DEFAULT_TOTAL, 0, 0, 1)

    def takes_each_limit_and_refuses_the_next_value(self) -> str:
        master = self.master
        seen = []

        def sense(value: int) -> None:
            expect("data", master.set(ENCODER, 1, DIRECTION, bytes([value])), b"")

        limits: list[tuple[str, Callable[[int], None], int, int, int, list[int]]] = [
            ("sense", sense, DIRECTION, 0, 1, [2, 255]),
            ("steps", partial(self.put, STEPS_PER_TURN), STEPS_PER_TURN, 1, 8192, [0, 8193]),
            ("total", partial(self.put, TOTAL), TOTAL, 1, DEFAULT_TOTAL, [0, DEFAULT_TOTAL + 1]),
            (
                "preset",
                partial(self.put, PRESET),
                PRESET,
                0,
                DEFAULT_TOTAL - 1,
                [DEFAULT_TOTAL, (1 << 32) - 1],
            ),
            (
                "COS delta",
                partial(self.put, COS_DELTA),
                COS_DELTA,
                1,
                DEFAULT_TOTAL,
                [0, DEFAULT_TOTAL + 1, (1 << 32) - 1],
            ),
        ]
        for name, put, attribute, low, high, beyond in limits:
            self.encoder_service(book.RESET)
            for value in (low, high):
                put(value)
                read = int.from_bytes(self.encoder_octets(attribute), "little")
                expect(f"{name} read back", read, value)
                if attribute == STEPS_PER_TURN:
                    expect(f"total at {value} steps", self.number(TOTAL), value * TURNS)
            before = self.settings()
            for value in beyond:
                try:
                    expect_refusal(partial(put, value), 0x09)
                except Wrong as wrong:
                    raise Wrong(f"{name} {value}: {wrong}") from None
            expect(f"settings after the refusals of {name}", self.settings(), before)
            seen.append(f"{name} {low} … {high}")
        self.encoder_service(book.RESET)
        return ", ".join(seen)

    def limits_depend_on_what_is_in_force(self) -> str:
        self.put(STEPS_PER_TURN, 3600)
        expect_refusal(lambda: self.put(TOTAL, 3600 * TURNS + 1), 0x09)
        self.put(TOTAL, 3600 * TURNS)
        self.put(TOTAL, 3600 * 256)
        expect("the example 3600 x 256", self.number(TOTAL), 921_600)
        expect_refusal(lambda: self.put(PRESET, 921_600), 0x09)
        self.put(PRESET, 921_599)
        self.put(COS_DELTA, 921_600)
        expect_refusal(lambda: self.put(COS_DELTA, 921_601), 0x09)
        # The turns as programmed stay; preset and offset go; the COS delta comes down.
        self.put(STEPS_PER_TURN, 1000)
        self.expect_settings(0, 1000, 256_000, 0, 0, 256_000)
        self.put(TOTAL, 500)
        self.put(STEPS_PER_TURN, 2000)
        expect("total of less than one turn, 2000 steps", self.number(TOTAL), 2000)
        self.encoder_service(book.RESET)
        return "3600 x 256 = 921600 caps preset and COS delta; 1000 steps make 256000"

    # --- Chapter 5: object model

    def has_the_classes_and_instances_of_chapter_5(self) -> str:
        for class_id, (instances, revision) in CLASSES.items():
            where = f"class {class_id:02X}"
            expect(f"{where}, revision", self.master.get(class_id, 0, 1), uint(revision))
            expect(f"{where}, max instance", self.master.get(class_id, 0, 2), uint(instances))
            for attribute in (0, 99):
                expect_refusal(partial(self.master.get, class_id, 0, attribute), 0x14)
                expect_refusal(partial(self.master.get, class_id, instances, attribute), 0x14)
            for attribute in (1, 2):
                set_ = partial(self.master.set, class_id, 0, attribute, uint(1))
                try:
                    expect_refusal(set_, 0x08)
                except Wrong as wrong:
                    raise Wrong(f"{where}, Set of class attribute {attribute}: {wrong}") from None
            for instance in (instances + 1, 255):
                expect_refusal(partial(self.master.get, class_id, instance, 1), 0x16)
        for class_id in (0x00, 0x06, 0x10, 0x23, 0x2A, 0x2C, 0x2E, 0x30, 0xFF):
            expect_refusal(partial(self.master.get, class_id, 1, 1), 0x16)
        shown = ", ".join(f"{code:02X}: {count}" for code, (count, _) in CLASSES.items())
        return f"{shown}; one further instance or class 16"

    def has_one_explicit_and_two_io_connections(self) -> str:
        mac = self.master.slave
        with self.connections(book.POLL | book.CHANGE_OF_STATE, explicit_rate=None):
            expect("revision", self.master.get(CONNECTION, 0, 1), uint(1))
            expect("max instance", self.master.get(CONNECTION, 0, 2), uint(4))
            expect("state of connection 4", self.connection_state(COS_CONNECTION), CONFIGURING)
            for instance in (3, 5, 255):
                expect_refusal(partial(self.master.get, CONNECTION, instance, STATE), 0x16)
            explicit = self.connection_table(
                3, 0, 0x83, book.group_2(mac, 3), book.group_2(mac, 4), 0x21, 192, 64
            )
            self.expect_table(EXPLICIT_CONNECTION, explicit)
            poll = self.connection_table(1, 1, 0x82, 0x3C0 | mac, book.group_2(mac, 5), 0x01, 4, 0)
            self.expect_table(POLL_CONNECTION, poll)
        return "instances 1, 2, 4, not 3 and 5; attributes of explicit and poll as in the table"

    def has_no_connection_that_is_not_allocated(self) -> str:
        for instance in (POLL_CONNECTION, COS_CONNECTION):
            for service, data in [
                (book.GET, b"\x01"),
                (book.SET, b"\x09\x00\x00"),
                (book.RESET, b""),
                (book.APPLY, b""),
                (0x09, b""),
            ]:
                ask = partial(self.master.service, service, CONNECTION, instance, data)
                expect_refusal(ask, 0x16)
        return "16 to five services on instances 2 and 4"

    def refuses_what_a_connection_does_not_take(self) -> str:
        with self.connections(book.POLL):
            master = self.master
            delete = partial(master.service, 0x09, CONNECTION, POLL_CONNECTION)
            expect_refusal(delete, 0x08)
            reset = partial(master.service, book.RESET, CONNECTION, POLL_CONNECTION)
            expect_refusal(reset, 0x0C)
            for instance, fine, wrong in [
                (EXPLICIT_CONNECTION, (1, 3), (0, 2, 4)),
                (POLL_CONNECTION, (0, 1, 2), (3, 4)),
            ]:
                for action in fine:
                    master.set(CONNECTION, instance, 12, bytes([action]))
                    expect("watchdog action", master.get(CONNECTION, instance, 12)[0], action)
                for action in wrong:
                    set_ = partial(master.set, CONNECTION, instance, 12, bytes([action]))
                    expect_refusal(set_, 0x09)
        return "Delete 08, Reset while configuring 0C; watchdog actions 1 3 and 0 1 2, others 09"

    def tells_the_four_kinds_of_connection_4(self) -> str:
        mac = self.master.slave
        seen = []
        for choice, trigger in [(0x10, 0x13), (0x50, 0x10), (0x20, 0x03), (0x60, 0x00)]:
            self.master.allocate(choice)
            acknowledged = not choice & book.UNACKNOWLEDGED
            consumed = book.group_2(mac, 2) if acknowledged else 0xFFFF
            characteristics = 0x01 if acknowledged else 0x0F
            path = bytes.fromhex("202b2401") if acknowledged else b""
            table = self.connection_table(
                1, 1, trigger, 0x340 | mac, consumed, characteristics, 4, 0, consumed_path=path
            )
            self.expect_table(COS_CONNECTION, table)
            answer = self.master.service(book.APPLY, CONNECTION, COS_CONNECTION)
            expect("data in the response to Apply", answer, uint(0x340 | mac) + uint(consumed))
            expect("state after Apply", self.connection_state(COS_CONNECTION), 3)
            apply = partial(self.master.service, book.APPLY, CONNECTION, COS_CONNECTION)
            expect_refusal(apply, 0x0C)
            self.master.release(choice & ~book.UNACKNOWLEDGED)
            seen.append(f"choice {choice:02X}: {trigger:02X}, consumes {consumed:04X}")
        return "; ".join(seen)

    @staticmethod
    def connection_table(
        state: int,
        kind: int,
        trigger: int,
        produced: int,
        consumed: int,
        characteristics: int,
        produced_size: int,
        consumed_size: int,
        consumed_path: bytes = b"",
    ) -> dict[int, bytes | None]:
        """A column of the table of connection attributes; None is not supported."""
        is_io = kind == 1
        path = bytes.fromhex("20042401") if is_io else b""
        return {
            0: None,
            1: bytes([state]),
            2: bytes([kind]),
            3: bytes([trigger]),
            4: uint(produced),
            5: uint(consumed),
            6: bytes([characteristics]),
            7: uint(produced_size),
            8: uint(consumed_size),
            9: uint(0 if is_io else 2500),
            10: None,
            11: None,
            12: bytes([0 if is_io else 1]),
            13: uint(len(path)),
            14: path,
            15: uint(len(consumed_path)),
            16: consumed_path,
            17: uint(0) if is_io else None,
            18: None,
        }

    def expect_table(self, instance: int, table: dict[int, bytes | None]) -> None:
        """Compares all attributes of a connection, and that the fixed ones are not settable."""
        settable = (9, 12, 14, 17)
        for attribute, wanted in table.items():
            what = f"connection {instance}, attribute {attribute}"
            get = partial(self.master.get, CONNECTION, instance, attribute)
            try:
                if wanted is None:
                    expect_refusal(get, 0x14)
                else:
                    expect(what, get(), wanted)
                if wanted is not None and attribute not in settable:
                    set_ = partial(self.master.set, CONNECTION, instance, attribute, wanted)
                    expect_refusal(set_, 0x0E)
            except Wrong as wrong:
                raise Wrong(f"{what}: {wrong}") from None
        if instance == EXPLICIT_CONNECTION:
            expect_refusal(partial(self.master.set, CONNECTION, instance, 17, uint(0)), 0x0E)

    def tells_its_identity_at_once(self) -> str:
        singly = [self.master.get(IDENTITY, 1, attribute) for attribute in range(1, 11)]
        together = self.master.service(book.GET_ALL, IDENTITY, 1)
        for last in (7, 8, 9, 10):
            if together == b"".join(singly[:last]):
                name = short_string(singly[6])
                expect("name", name, "AMG 81 - Multiturn")
                return f"attributes 1 to {last} in {len(together)} octets, {name}"
        raise Wrong(
            f"attributes 1 to 10 are {b' '.join(singly).hex(' ')}, together {together.hex(' ')}"
        )

    # --- Chapter 6: I/O assemblies

    def has_two_assemblies(self) -> str:
        position = udint(STILL_AT)
        seen = []
        for instance, wanted in [(1, position), (2, position + b"\x00")]:
            data = self.master.get(ASSEMBLY, instance, 3)
            expect(f"assembly {instance}", data, wanted)
            size = self.master.get(ASSEMBLY, instance, 4)
            expect("size", size, uint(len(wanted)))
            expect_refusal(partial(self.master.set, ASSEMBLY, instance, 3, wanted), 0x0E)
            seen.append(f"{instance}: {data.hex(' ')}")
        return ", ".join(seen) + "; Set 0E"

    def chooses_the_assembly_by_path(self) -> str:
        with self.connections(book.POLL | book.CHANGE_OF_STATE | book.UNACKNOWLEDGED):
            return self.choose_the_assembly()

    def choose_the_assembly(self) -> str:
        """The inside of the step before."""
        master = self.master
        for connection in (POLL_CONNECTION, COS_CONNECTION):

            def get(attribute: int, connection: int = connection) -> bytes:
                return master.get(CONNECTION, connection, attribute)

            def put(path: str, connection: int = connection) -> None:
                path_octets = bytes.fromhex(path)
                master.set(CONNECTION, connection, PRODUCED_PATH, path_octets)

            for path, size in [
                ("20042402", 5),
                ("20042401", 4),
                ("200424023003", 5),
                ("200424013003", 4),
                ("20042402", 5),
            ]:
                put(path)
                expect("path read back", get(PRODUCED_PATH), bytes.fromhex(path))
                expect("its length", get(PRODUCED_PATH_LENGTH), uint(len(path) // 2))
                expect("produced size", get(PRODUCED_SIZE), uint(size))
            for wrong_path in ("20042403", "20042400", "20052401", "200424023004", "21042402"):
                expect_refusal(partial(put, wrong_path), 0x09)
            expect("path after the refusals", get(PRODUCED_PATH), bytes.fromhex("20042402"))
            self.set_packet_rate(connection, 10_000)
            expect_refusal(partial(put, "20042401"), 0x0C)
        wanted = udint(STILL_AT) + b"\x00"
        expect("poll response", master.poll().data, wanted)
        self.put(PRESET, 3)
        produced = master.listen(0.3)
        expect("produced by COS", [frame.data for frame in produced], [udint(3) + b"\x00"])
        self.encoder_service(book.RESET)
        return f"short and long paths on connections 2 and 4, others 09; {wanted.hex(' ')}"

    def has_kept_the_assemblies_without_save(self) -> str:
        with self.connections(book.POLL | book.CHANGE_OF_STATE | book.UNACKNOWLEDGED):
            return self.use_the_kept_assemblies()

    def use_the_kept_assemblies(self) -> str:
        """The inside of the step before."""
        for connection in (POLL_CONNECTION, COS_CONNECTION):
            path = self.master.get(CONNECTION, connection, PRODUCED_PATH)
            expect(f"path of connection {connection}", path, bytes.fromhex("20042402"))
            size = self.master.get(CONNECTION, connection, PRODUCED_SIZE)
            expect("produced size", size, uint(5))
            self.set_packet_rate(connection, 10_000)
            if connection == COS_CONNECTION:
                frames = self.master.listen(0.3)
                expect("octets produced", [len(frame.data) for frame in frames], [5])
        expect("octets polled", len(self.master.poll().data), 5)
        return "instance 2 on connections 2 and 4, 5 octets polled and produced"

    # --- Chapter 7: parameter object

    def parameter(self, instance: int, attribute: int) -> bytes:
        """An attribute of the parameter object."""
        return self.master.get(PARAMETER, instance, attribute)

    def has_19_parameters(self) -> str:
        def class_attribute(attribute: int, length: int) -> int:
            return unsigned(self.parameter(0, attribute), length)

        expect("revision", class_attribute(1, 2), 1)
        expect("max instance", class_attribute(2, 2), 19)
        expect("parameter class descriptor", class_attribute(8, 2), 0x000F)
        expect("configuration assembly", class_attribute(9, 2), 0)
        for instance, (name, attribute) in PARAMETERS.items():
            self.in_parameter(instance, name, partial(self.expect_parameter, instance, attribute))
        expect_refusal(partial(self.parameter, 20, 1), 0x16)
        return "19 instances, each linked as in the table and of the same value"

    def speaks_english(self) -> str:
        # 0 English, 1 French, 2 Spanish, 3 Italian, 4 German …
        expect("native language, class attribute 10", self.parameter(0, 10), b"\x00")
        return "native language 0"

    @staticmethod
    def in_parameter(instance: int, name: str, action: Callable[[], None]) -> None:
        """Says of which parameter a failure speaks."""
        try:
            action()
        except (Wrong, book.Refused) as error:
            raise Wrong(f"parameter {instance} ({name}): {error}") from None

    def expect_parameter(self, instance: int, attribute: int) -> None:
        """Compares link, type, value and the rest of one instance."""
        value = self.encoder_octets(attribute)
        expect("value", self.parameter(instance, 1), value)
        expect("link path size", self.parameter(instance, 2), b"\x06")
        path = bytes([0x20, 0x2F, 0x24, 0x01, 0x30, attribute])
        expect("link path", self.parameter(instance, 3), path)
        descriptor = unsigned(self.parameter(instance, 4), 2)
        row = ENCODER_ATTRIBUTES[attribute]
        expect("read only in the descriptor", bool(descriptor & READ_ONLY), row.access == "read")
        kind = self.parameter(instance, 5)
        expect("data type", kind, bytes([TYPE_OF[attribute]]))
        expect("data size", self.parameter(instance, 6), bytes([len(value)]))
        expect("octets of the data type", DATA_TYPES[kind[0]], len(value))
        for low_high_default in (10, 11, 12):
            expect("octets", len(self.parameter(instance, low_high_default)), len(value))
        for scaling, wanted in [(13, 1), (14, 1), (15, 1), (16, 0)]:
            expect(f"scaling attribute {scaling}", self.parameter(instance, scaling), uint(wanted))
        for link in (17, 18, 19, 20):
            expect(f"scaling link {link}", self.parameter(instance, link), uint(0))
        expect("decimals", self.parameter(instance, 21), b"\x00")
        for missing in (0, 22, 255):
            expect_refusal(partial(self.parameter, instance, missing), 0x14)
        for fixed in range(2, 22):
            set_ = partial(self.master.set, PARAMETER, instance, fixed, b"\x00")
            expect_refusal(set_, 0x0E)

    def names_its_parameters(self) -> str:
        names = []
        for instance, (manual, _) in PARAMETERS.items():
            name = short_string(self.parameter(instance, 7))
            units = short_string(self.parameter(instance, 8))
            help_ = short_string(self.parameter(instance, 9))
            what = f"parameter {instance} ({manual})"
            if not 0 < len(name) <= NAME_OCTETS:
                raise Wrong(f"{what}: a name has 1 to 16 characters, got {name!r}")
            if len(units) > UNITS_OCTETS or len(help_) > HELP_OCTETS:
                raise Wrong(f"{what}: units {units!r} or help {help_!r} too long")
            if len(manual) <= NAME_OCTETS:
                expect(f"name of {what}", name, manual)
            names.append(name)
        expect("different names", len(set(names)), len(names))
        return ", ".join(names)

    def tells_live_limits(self) -> str:
        def limits(instance: int) -> list[int]:
            return [int.from_bytes(self.parameter(instance, at), "little") for at in (10, 11, 12)]

        expect("sense: min, max, default", limits(1), [0, 1, 0])
        expect("steps: min, max, default", limits(5), [1, STEPS, STEPS])
        expect("total: min, max, default", limits(6), [1, DEFAULT_TOTAL, DEFAULT_TOTAL])
        expect("preset: min, max, default", limits(8), [0, DEFAULT_TOTAL - 1, 0])
        self.put(STEPS_PER_TURN, 3600)
        self.put(TOTAL, 921_600)
        expect("steps: min, max", limits(5)[:2], [1, STEPS])
        expect("total: min, max", limits(6)[:2], [1, 3600 * TURNS])
        expect("preset: min, max", limits(8)[:2], [0, 921_599])
        self.encoder_service(book.RESET)
        return "total up to 3600 x 65536 and preset up to 921599 under 3600 x 256"

    def sets_through_parameters(self) -> str:
        def put(instance: int, value: int, octets: int = 4) -> None:
            data = value.to_bytes(octets, "little")
            expect("data", self.master.set(PARAMETER, instance, 1, data), b"")

        put(1, 1, octets=1)
        put(5, 3600)
        put(6, 921_600)
        put(8, 1234)
        offset = 1234 - position_at(STILL_AT, 3600, 921_600, clockwise=False)
        self.expect_settings(1, 3600, 921_600, 1234, offset, 1)
        expect("position parameter", signed(self.parameter(9, 1)), 1234)
        expect("operating status parameter", self.parameter(10, 1), b"\x07")
        expect_refusal(lambda: put(1, 2, octets=1), 0x09)
        expect_refusal(lambda: put(5, 8193), 0x09)
        expect_refusal(lambda: put(5, 0), 0x09)
        expect_refusal(lambda: put(6, 3600 * TURNS + 1), 0x09)
        expect_refusal(lambda: put(8, 921_600), 0x09)
        expect_refusal(lambda: put(5, 1, octets=2), 0x13)
        expect_refusal(lambda: put(5, 1, octets=5), 0x15)
        for instance, (_, attribute) in PARAMETERS.items():
            if ENCODER_ATTRIBUTES[attribute].access == "read":
                octets = self.parameter(instance, 1)
                set_ = partial(self.master.set, PARAMETER, instance, 1, octets)
                expect_refusal(set_, 0x0E)
        return self.expect_settings(1, 3600, 921_600, 1234, offset, 1)

    def saves_restores_and_resets_parameters_at_class_level(self) -> str:
        for service in SERVICES:
            ask = partial(self.master.service, service, PARAMETER, 5)
            expect_refusal(ask, 0x08)

        def serve(service: int) -> None:
            answer = self.master.explicit(bytes([service, PARAMETER, 0]))
            expect(f"response to {SERVICES[service]}", answer, bytes([service | 0x80]))

        in_force = self.settings()
        serve(book.SAVE)
        serve(book.RESET)
        self.has_the_defaults_of_chapter_4()
        serve(book.RESTORE)
        expect("settings after Restore", self.settings(), in_force)
        serve(book.RESET)
        serve(book.SAVE)
        serve(book.RESTORE)
        self.has_the_defaults_of_chapter_4()
        return "95, 96, 85 at class 0F, 08 at an instance"

    def names_the_values_of_enumerations(self) -> str:
        seen = []
        for instance, (name, attribute) in PARAMETERS.items():

            def ask(value: int, instance: int = instance) -> str:
                data = bytes([value])
                answer = self.master.service(book.GET_ENUM_STRING, PARAMETER, instance, data)
                return short_string(answer)

            descriptor = unsigned(self.parameter(instance, 4), 2)
            if descriptor & SUPPORTS_ENUMERATION:
                value = self.parameter(instance, 1)[0]
                seen.append(f"{name} {value} = {ask(value)}")
                expect_refusal(partial(ask, 200), 0x20)
            else:
                expect_refusal(partial(ask, 0), 0x08)
            if attribute == DIRECTION:
                expect("names of the sense", [ask(0), ask(1)], ["CW", "CCW"])
                expect_refusal(partial(ask, 2), 0x20)
        if not seen:
            raise Wrong("no parameter supports enumeration, not even the sense of rotation")
        return ", ".join(seen)

    def tells_a_parameter_at_once(self) -> str:
        for instance in (1, 6):
            singly = b"".join(self.parameter(instance, attribute) for attribute in range(1, 22))
            together = self.master.service(book.GET_ALL, PARAMETER, instance)
            expect(f"parameter {instance}, all attributes", together, singly)
        return f"attributes 1 to 21 of two parameters; {len(together)} octets the latter"

    # --- Chapter 8: encoder position object

    def has_the_attributes_of_chapter_8(self) -> str:
        for attribute in range(256):
            row = ENCODER_ATTRIBUTES.get(attribute)
            get = partial(self.encoder_octets, attribute)
            try:
                if row is None:
                    expect_refusal(get, 0x14)
                    continue
                octets = get()
                expect("length", len(octets), row.octets)
                if row.value is not None:
                    expect("value", int.from_bytes(octets, "little"), row.value)
                if row.access == "read":
                    expect_refusal(partial(self.master.set, ENCODER, 1, attribute, octets), 0x0E)
            except Wrong as wrong:
                raise Wrong(f"attribute {attribute}: {wrong}") from None
        listed = list(self.encoder_octets(2))
        expect("list of attributes", listed, list(ENCODER_ATTRIBUTES))
        return f"{len(listed)} attributes with the octets and defaults of the tables, others 14"

    def refuses_services_that_chapter_8_does_not_name(self) -> str:
        for service in (0x01, 0x02, 0x06, 0x07, 0x0D, 0x32, 0x4B):
            for instance in (0, 1):
                expect_refusal(partial(self.master.service, service, ENCODER, instance), 0x08)
        return "08 at class and instance level"

    def presets(self) -> str:
        seen = []
        for clockwise in (True, False):
            self.master.set(ENCODER, 1, DIRECTION, bytes([not clockwise]))
            plain = position_at(STILL_AT, STEPS, DEFAULT_TOTAL, clockwise=clockwise)
            expect("position", self.number(POSITION), plain)
            for value in (0, 42, DEFAULT_TOTAL - 1):
                self.put(PRESET, value)
                expect("position", self.number(POSITION), value)
                expect("offset", self.number(OFFSET), value - plain)
                expect("preset read back", self.number(PRESET), value)
            seen.append(f"{'CW' if clockwise else 'CCW'} offset {value - plain}")
        self.encoder_service(book.RESET)
        expect("position after Reset", self.number(POSITION), STILL_AT)
        return f"position is the preset; {', '.join(seen)}; Reset: {STILL_AT} again"

    def saves_restores_and_resets(self) -> str:
        for instance in (1, 0):
            self.put(STEPS_PER_TURN, 3600)
            self.put(COS_DELTA, 77)
            self.put(PRESET, 5000)
            in_force = self.settings()
            for service, wanted in [
                (book.SAVE, in_force),
                (book.RESET, None),
                (book.RESTORE, in_force),
            ]:
                answer = self.master.explicit(bytes([service, ENCODER, instance]))
                expect(f"response to {SERVICES[service]}", answer, bytes([service | 0x80]))
                if wanted is None:
                    self.has_the_defaults_of_chapter_4()
                    expect("position", self.number(POSITION), STILL_AT)
                else:
                    expect(f"settings after {SERVICES[service]}", self.settings(), wanted)
                    expect("position", self.number(POSITION), 5000)
            for service in SERVICES:
                ask = partial(self.master.service, service, ENCODER, instance, b"\x00")
                expect_refusal(ask, 0x15)
            self.encoder_service(book.RESET)
            self.encoder_service(book.SAVE)
        return "Reset: defaults and offset 0; Restore: what was saved, offset and all"

    def saves_one_setting_and_leaves_another_unsaved(self) -> str:
        self.put(STEPS_PER_TURN, 3600)
        self.put(PRESET, 5000)
        self.put(COS_DELTA, 9)
        self.encoder_service(book.SAVE)
        self.put(PRESET, 6000)
        self.put(COS_DELTA, 10)
        # This is kept at once; it must not take the others along.
        self.master.set(IDENTITY, 1, 10, b"\x00")
        self.master.set(DEVICENET, 1, 3, b"\x01")
        return "saved preset 5000, COS delta 9; unsaved 6000, 10; BOI 1 is kept by itself"

    def has_after_power_off_what_was_saved(self) -> str:
        plain = position_at(STILL_AT, 3600, 3600 * TURNS)
        seen = self.expect_settings(0, 3600, 3600 * TURNS, 5000, 5000 - plain, 9)
        expect("position", self.number(POSITION), 5000)
        expect("BOI", self.master.get(DEVICENET, 1, 3), b"\x01")
        self.put(COS_DELTA, 10)
        self.encoder_service(book.RESTORE)
        expect("COS delta restored", self.number(COS_DELTA), 9)
        return f"{seen}; Restore brings it back"
