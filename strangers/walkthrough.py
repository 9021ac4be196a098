"""What all walks through a DeviceNet encoder share: the program on its bus, what steps often do.

No script to run: `devicenet_session.py` and `devicenet_chapters.py` build on it.
"""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TextIO

import can

import devicenet_master as book
from devicenet_master import BookViolation, Frame, Master, Refused, Silence, Wire
from steps import Process, Steps, Wrong, expect, shown

ADDRESS = 5
OUR_MAC = 0x3F
STRANGER_MAC = 10
VENDOR = 468
SERIAL = 1234

# The 29 bit multiturn encoders: 13 bit a turn, 16 bit of turns.
STEPS = 8192
TURNS = 65536
DEFAULT_TOTAL = STEPS * TURNS

# Classes
IDENTITY, MESSAGE_ROUTER, DEVICENET, ASSEMBLY, CONNECTION = 0x01, 0x02, 0x03, 0x04, 0x05
PARAMETER, ACKNOWLEDGE_HANDLER, ENCODER = 0x0F, 0x2B, 0x2F
# Attributes of the encoder position object
DIRECTION, STEPS_PER_TURN, TOTAL, PRESET, COS_DELTA, POSITION, OFFSET = 3, 7, 8, 10, 11, 12, 91
# Connection instances and attributes
EXPLICIT_CONNECTION, POLL_CONNECTION, COS_CONNECTION = 1, 2, 4
STATE, PRODUCED_SIZE, EXPECTED_PACKET_RATE, PRODUCED_PATH, INHIBIT_TIME = 1, 7, 9, 14, 17
CONFIGURING, ESTABLISHED, TIMED_OUT = 1, 3, 4

# The check itself takes 2 s from the start; a little more for a busy machine.
ON_LINE_SECONDS = 2.5


def expect_refusal(action: Callable[[], object], status: int, additional: int | None = None) -> str:
    """Runs what must be refused; returns the codes."""
    try:
        answer = action()
    except Refused as refused:
        expect("general status", f"{refused.status:02X}", f"{status:02X}")
        if additional is not None:
            expect("additional code", f"{refused.additional:02X}", f"{additional:02X}")
        return f"{refused.status:02X}/{refused.additional:02X}"
    raise Wrong(f"should have been refused with {status:02X}, but was answered {shown(answer)}")


def unsigned(octets: bytes, length: int) -> int:
    """An unsigned value of exactly `length` octets."""
    expect("length of the value", len(octets), length)
    return int.from_bytes(octets, "little")


def signed(octets: bytes) -> int:
    """A DINT."""
    expect("length of a DINT", len(octets), 4)
    return int.from_bytes(octets, "little", signed=True)


def uint(value: int) -> bytes:
    """Two octets."""
    return value.to_bytes(2, "little")


def udint(value: int) -> bytes:
    """Four octets."""
    return value.to_bytes(4, "little")


class Program(Process):
    """The program under test, as an encoder behind an SLCAN adapter on TCP."""

    def __init__(self, path: Path, model: str, memory: Path, messages: TextIO) -> None:
        super().__init__(path, messages)
        self.model = model
        self._memory = memory
        self.port = 0

    def start(self, shaft: str, address: int = ADDRESS, baud: str | None = None) -> str:
        """Starts it and waits until it says that it is ready; returns that line."""
        self.port = free_port()
        bus = f"slcan-listen:127.0.0.1:{self.port}"
        command = ["encoder", self.model, "--bus", bus, "--address", str(address)]
        command += ["--shaft", shaft, "--memory", str(self._memory), "--serial", str(SERIAL)]
        command += ["--baud", baud] if baud else []
        line = self.launch(command)
        expect("the first line on stdout", line, f"ready {self.model} address {address} on {bus}")
        return line


def free_port() -> int:
    """A TCP port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Walk(Steps):
    """Steps through what a running DeviceNet encoder should do; each prints one line."""

    wrongs = (*Steps.wrongs, BookViolation, Refused, Silence, can.CanError)

    def __init__(self, program: Program, log: TextIO) -> None:
        super().__init__(program)
        self._program = program
        self._log = log
        self._bus: can.BusABC | None = None
        self.heard: set[int] = set()

    def conversation(self) -> list[Frame]:
        """The frames of this run."""
        return [] if self._bus is None else self.wire.seen

    # --- The frame around the steps

    def start(self, shaft: str, address: int = ADDRESS, baud: str | None = None) -> str:
        """Starts the program and joins its bus."""
        line = self._program.start(shaft, address, baud)
        self._bus = can.Bus(
            f"socket://127.0.0.1:{self._program.port}",
            interface="slcan",
            bitrate={None: 125_000, "250k": 250_000, "500k": 500_000}[baud],
            sleep_after_open=0,
        )
        self.wire = Wire(self._bus, self._log)
        own = OUR_MAC if address != OUR_MAC else OUR_MAC - 1
        self.master = Master(self.wire, own, address)
        self.stranger = Master(self.wire, STRANGER_MAC, address)
        return line

    def stop(self) -> str:
        """Ends the program."""
        self.leave_bus()
        return self._program.terminate()

    def leave_bus(self) -> None:
        """Closes the bus, where it is open."""
        if self._bus is not None:
            self.heard |= {frame.identifier for frame in self.wire.seen if not frame.is_ours}
            # The program may have closed it first; the next steps tell why.
            with contextlib.suppress(can.CanError, OSError):
                self._bus.shutdown()
            self._bus = None

    # --- Small things that many steps do

    def number(self, attribute: int) -> int:
        """An UDINT or DINT of the encoder position object."""
        octets = self.master.get(ENCODER, 1, attribute)
        return signed(octets) if attribute in (OFFSET, POSITION, COS_DELTA) else unsigned(octets, 4)

    def put(self, attribute: int, value: int) -> None:
        """Sets an UDINT or DINT of the encoder position object."""
        expect("data in the response", self.master.set(ENCODER, 1, attribute, udint(value)), b"")

    def settings(self) -> dict[str, int]:
        """What the encoder says about itself."""
        return {
            "direction": unsigned(self.master.get(ENCODER, 1, DIRECTION), 1),
            "steps per turn": self.number(STEPS_PER_TURN),
            "total": self.number(TOTAL),
            "preset": self.number(PRESET),
            "offset": self.number(OFFSET),
            "COS delta": self.number(COS_DELTA),
        }

    def expect_settings(self, *values: int) -> str:
        """Compares direction, steps per turn, total, preset, offset, COS delta."""
        seen = self.settings()
        expect("settings", seen, dict(zip(seen, values, strict=True)))
        return ", ".join(f"{name} {value}" for name, value in seen.items())

    def polled(self) -> tuple[float, int]:
        """Host time and position of one poll."""
        response = self.master.poll()
        return response.at, unsigned(response.data, 4)

    def connection_state(self, instance: int) -> int:
        """Attribute 1 of a connection."""
        return unsigned(self.master.get(CONNECTION, instance, STATE), 1)

    def set_packet_rate(self, instance: int, milliseconds: int) -> str:
        """Sets the expected packet rate; the value granted must be the one asked for."""
        value = milliseconds.to_bytes(2, "little")
        granted = self.master.set(CONNECTION, instance, EXPECTED_PACKET_RATE, value)
        expect("packet rate granted", unsigned(granted, 2), milliseconds)
        return f"{milliseconds} ms granted"

    def connect(self) -> str:
        """Allocates explicit and poll, with time-outs that no step here can run into."""
        self.master.allocate(book.EXPLICIT | book.POLL)
        explicit = self.set_packet_rate(EXPLICIT_CONNECTION, 0)
        poll = self.set_packet_rate(POLL_CONNECTION, 60_000)
        return f"CB 00, explicit {explicit}, poll {poll}"

    @contextlib.contextmanager
    def connections(self, choice: int = 0, explicit_rate: int | None = 0) -> Iterator[None]:
        """The explicit connection and those of `choice`, for a while. Rate 0 is no time-out."""
        self.master.allocate(book.EXPLICIT | choice)
        try:
            if explicit_rate is not None:
                self.set_packet_rate(EXPLICIT_CONNECTION, explicit_rate)
            yield
        finally:
            # Where the inside failed, that is what must be told.
            with contextlib.suppress(BookViolation, Refused, Silence):
                # Connection by connection: the inside may have released some.
                for bit in (book.POLL, book.CHANGE_OF_STATE, book.CYCLIC):
                    if choice & bit:
                        with contextlib.suppress(Refused):
                            self.master.release(bit)
                self.master.release(book.EXPLICIT)

    def encoder_service(self, service: int) -> None:
        """Save, Restore or Reset of the encoder position object."""
        answer = self.master.explicit(bytes([service, ENCODER, 1]))
        expect("response", answer, bytes([service | 0x80]))

    # --- Getting on line

    def answers_nothing_before_it_is_on_line(self) -> str:
        self.master.RESPONSE_SECONDS = 0.3
        try:
            self.master.allocate(book.EXPLICIT)
        except Silence:
            return "no answer to Allocate"
        finally:
            self.master.RESPONSE_SECONDS = Master.RESPONSE_SECONDS
        raise Wrong("Allocate was answered during the duplicate MAC ID check")

    def own_check(self) -> book.DuplicateMacCheck:
        """The last request of the check, whether it was already seen or is still to come."""
        identifier = book.group_2(self.master.slave, book.DUPLICATE_MAC)
        deadline = time.time() + ON_LINE_SECONDS
        while time.time() < deadline:
            self.wire.receive(0.1)
        frames = [f for f in self.wire.seen if f.identifier == identifier and not f.is_ours]
        if not frames:
            raise Wrong(f"no duplicate MAC ID check message ({identifier:03X}) after the start")
        return book.DuplicateMacCheck.parse(frames[-1])

    def checks_its_mac_id_at_the_start(self) -> str:
        expected = book.DuplicateMacCheck(False, 0, VENDOR, SERIAL)
        expect("request", self.own_check(), expected)
        return f"request from vendor {VENDOR}, serial {SERIAL}"

    def objects_to_a_second_claim(self) -> str:
        objection = self.master.ask_duplicate_mac(vendor=1, serial=1)
        expect("objection", objection, book.DuplicateMacCheck(True, 0, VENDOR, SERIAL))
        return f"response from vendor {objection.vendor}, serial {objection.serial}"

    def get_on_line(self, shaft: str) -> None:
        """Starts the program and waits until it is on line."""
        self.step(f"starts with the shaft '{shaft}'", lambda: self.start(shaft), vital=True)
        self.named(self.answers_nothing_before_it_is_on_line)
        self.named(self.checks_its_mac_id_at_the_start)

    def connected(self, action: Callable[[], str]) -> None:
        """The same, with an explicit connection of its own."""

        def inside() -> str:
            with self.connections():
                return action()

        self.step(action.__name__.replace("_", " "), inside)
