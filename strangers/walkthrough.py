"""What all walks through an encoder share: the program as a process, steps with a line each.

No script to run: `devicenet_session.py` and `devicenet_chapters.py` build on it.
"""

from __future__ import annotations

import argparse
import contextlib
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TextIO

import can

import devicenet_master as book
from devicenet_master import BookViolation, Master, Refused, Silence, Wire

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

# How much of a conversation is printed with a failure; all of it is in the log.
SHOWN_FRAMES = 40
READY_SECONDS = 10.0
# The check itself takes 2 s from the start; a little more for a busy machine.
ON_LINE_SECONDS = 2.5


class Wrong(Exception):
    """Something else was seen than what the book asks for."""


def expect(what: str, seen: object, wanted: object) -> None:
    """Raises `Wrong` with both values where they differ."""
    if seen != wanted:
        raise Wrong(f"{what}: expected {shown(wanted)}, got {shown(seen)}")


def shown(value: object) -> str:
    """A value for people: octets in hexadecimal."""
    if isinstance(value, bytes):
        return f"[{value.hex(' ')}]"
    return repr(value)


def expect_within(what: str, seen: float, low: float, high: float) -> None:
    """Raises `Wrong` where `seen` is outside low … high."""
    if not low <= seen <= high:
        raise Wrong(f"{what}: expected {low:g} … {high:g}, got {seen:g}")


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


def unwrapped(raw: int, steps: int, clockwise: bool) -> int:
    """The scaled position before range and offset: ⌊r·n/S⌋ clockwise, −⌈r·n/S⌉ the other way."""
    return raw * steps // STEPS if clockwise else -raw * steps // STEPS


def position_at(raw: int, steps: int, total: int, offset: int = 0, clockwise: bool = True) -> int:
    """The position of a shaft that stands at `raw`, in the first run of the raw code."""
    return (unwrapped(raw, steps, clockwise) % total + offset) % total


class Ended(SystemExit):
    """A vital step failed, so the run has no sense any more."""


class Program:
    """The program under test, as a process."""

    def __init__(self, path: Path, model: str, memory: Path, messages: TextIO) -> None:
        self._path = path
        self.model = model
        self._memory = memory
        self._messages = messages
        self._process: subprocess.Popen[str] | None = None
        self.port = 0

    def start(self, shaft: str, address: int = ADDRESS, baud: str | None = None) -> str:
        """Starts it and waits until it says that it is ready; returns that line."""
        self.port = free_port()
        bus = f"slcan-listen:127.0.0.1:{self.port}"
        command = [str(self._path), "encoder", self.model, "--bus", bus]
        command += ["--address", str(address), "--shaft", shaft]
        command += ["--memory", str(self._memory), "--serial", str(SERIAL)]
        command += ["--baud", baud] if baud else []
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._messages,
            text=True,
        )
        line = self._first_line()
        expect("the first line on stdout", line, f"ready {self.model} address {address} on {bus}")
        return line

    def _first_line(self) -> str:
        assert self._process is not None and self._process.stdout is not None
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            if not selector.select(READY_SECONDS):
                raise Wrong(f"the program said nothing on stdout for {READY_SECONDS:g} s")
        line = self._process.stdout.readline()
        if not line:
            status = self._process.wait(5)
            raise Wrong(f"the program left with exit status {status} before it was ready")
        return line.rstrip("\n")

    def exit_status(self) -> int | None:
        """None while it runs or was not started. A program just dying gets a moment for it."""
        if self._process is None:
            return None
        try:
            return self._process.wait(0.3)
        except subprocess.TimeoutExpired:
            return None

    def terminate(self) -> str:
        """Asks it to leave, which it must do with exit status 0 within 5 s."""
        assert self._process is not None
        if (status := self._process.poll()) is not None:
            raise Wrong(f"the program left by itself with exit status {status}")
        begin = time.monotonic()
        self._process.send_signal(signal.SIGTERM)
        try:
            status = self._process.wait(5)
        except subprocess.TimeoutExpired:
            raise Wrong("the program still runs 5 s after SIGTERM") from None
        expect("exit status after SIGTERM", status, 0)
        self.end()
        return f"exit status 0 after {time.monotonic() - begin:.2f} s"

    def end(self) -> None:
        """Leaves no process behind, whatever happened."""
        if self._process is not None:
            if self._process.poll() is None:
                self._process.kill()
            self._process.wait()
            if self._process.stdout is not None:
                self._process.stdout.close()
            self._process = None


def free_port() -> int:
    """A TCP port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Walk:
    """Steps through what a running program should do; each prints one line."""

    def __init__(self, program: Program, log: TextIO) -> None:
        self._program = program
        self._log = log
        self._bus: can.BusABC | None = None
        self.passed = 0
        self.failed = 0
        self.heard: set[int] = set()

    # --- The frame around the steps

    def step(self, name: str, action: Callable[[], str], vital: bool = False) -> None:
        """Runs a step and prints its line. A vital step that fails ends the session."""
        begin = 0 if self._bus is None else len(self.wire.seen)
        try:
            seen = action()
        except (Wrong, BookViolation, Refused, Silence, can.CanError, OSError) as error:
            self.failed += 1
            died = self._program.exit_status()
            reason = "" if died is None else f" (the program has left with exit status {died})"
            print(f"FAILED {name}: {error}{reason}", flush=True)
            self.show_conversation(begin)
            if vital or died is not None:
                raise Ended(1) from None
            return
        self.passed += 1
        print(f"ok     {name}: {seen}", flush=True)

    def show_conversation(self, begin: int) -> None:
        """The last frames of a step, from frame `begin` on, with milliseconds before the last."""
        frames = [] if self._bus is None else self.wire.seen[begin:][-SHOWN_FRAMES:]
        for frame in frames:
            whose = "master " if frame.is_ours else "encoder"
            before = 1000 * (frame.at - frames[-1].at)
            print(f"       {whose} {before:8.1f} ms  {frame}", flush=True)

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

    def named(self, action: Callable[[], str], vital: bool = False) -> None:
        """A step that is called like its method."""
        self.step(action.__name__.replace("_", " "), action, vital)

    def connected(self, action: Callable[[], str]) -> None:
        """The same, with an explicit connection of its own."""

        def inside() -> str:
            with self.connections():
                return action()

        self.step(action.__name__.replace("_", " "), inside)


def default_program() -> Path:
    """The release build where there is one, else the debug build."""
    target = Path(__file__).resolve().parent.parent / "target"
    release = target / "release" / "codewheel"
    return release if release.exists() else target / "debug" / "codewheel"


def arguments_of(parser: argparse.ArgumentParser, log: str) -> argparse.Namespace:
    """What every walk is told: the program, and the file for the frames."""
    parser.add_argument("program", nargs="?", type=Path, default=default_program())
    path = Path(tempfile.gettempdir()) / log
    parser.add_argument("--log", type=Path, default=path, help="candump -L lines")
    arguments = parser.parse_args()
    # So that the program is ended, too.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    if not arguments.program.is_file():
        parser.error(f"no program at {arguments.program}; build it with 'cargo build' first")
    return arguments
