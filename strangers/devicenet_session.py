"""The acceptance session: a stranger puts a DeviceNet encoder through its paces.

Usage: devicenet_session.py [PROGRAM] [--log FILE]

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) as an AMG 11 D29
behind an SLCAN adapter on TCP, and plays the master with python-can. What is expected comes from
the manual and the book alone; positions are computed here. Each step prints one line, `ok` or
`FAILED`, with what was seen. All frames go to FILE as candump -L lines.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
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

# The AMG 11 D29: 13 bit a turn, 16 bit of turns.
STEPS = 8192
TURNS = 65536
DEFAULT_TOTAL = STEPS * TURNS

STILL_AT = 100_000

# Classes
IDENTITY, DEVICENET, CONNECTION, ENCODER = 0x01, 0x03, 0x05, 0x2F
# Attributes of the encoder position object
DIRECTION, STEPS_PER_TURN, TOTAL, PRESET, COS_DELTA, POSITION, OFFSET = 3, 7, 8, 10, 11, 12, 91
# Connection instances and attributes
EXPLICIT_CONNECTION, POLL_CONNECTION = 1, 2
STATE, PRODUCED_SIZE, EXPECTED_PACKET_RATE, PRODUCED_PATH = 1, 7, 9, 14
CONFIGURING, ESTABLISHED, TIMED_OUT = 1, 3, 4

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


def udint(value: int) -> bytes:
    """Four octets."""
    return value.to_bytes(4, "little")


def unwrapped(raw: int, steps: int, clockwise: bool) -> int:
    """The scaled position before range and offset: ⌊r·n/S⌋ clockwise, −⌈r·n/S⌉ the other way."""
    return raw * steps // STEPS if clockwise else -raw * steps // STEPS


def position_at(raw: int, steps: int, total: int, offset: int = 0, clockwise: bool = True) -> int:
    """The position of a shaft that stands at `raw`, in the first run of the raw code."""
    return (unwrapped(raw, steps, clockwise) % total + offset) % total


class Program:
    """The program under test, as a process."""

    def __init__(self, path: Path, memory: Path, messages: TextIO) -> None:
        self._path = path
        self._memory = memory
        self._messages = messages
        self._process: subprocess.Popen[str] | None = None
        self.port = 0

    def start(self, shaft: str) -> str:
        """Starts it and waits until it says that it is ready; returns that line."""
        self.port = free_port()
        bus = f"slcan-listen:127.0.0.1:{self.port}"
        command = [str(self._path), "encoder", "amg11-d29", "--bus", bus]
        command += ["--address", str(ADDRESS), "--shaft", shaft]
        command += ["--memory", str(self._memory), "--serial", str(SERIAL)]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._messages,
            text=True,
        )
        line = self._first_line()
        expect("the first line on stdout", line, f"ready amg11-d29 address {ADDRESS} on {bus}")
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


class Session:
    """The steps. Those of one run build on each other, in the order of `run`."""

    def __init__(self, program: Program, log: TextIO) -> None:
        self._program = program
        self._log = log
        self._bus: can.BusABC | None = None
        self.passed = 0
        self.failed = 0
        self.heard: set[int] = set()
        self.offset = 0
        self.kept_position = 0

    # --- The frame around the steps

    def step(self, name: str, action: Callable[[], str], vital: bool = False) -> None:
        """Runs a step and prints its line. A vital step that fails ends the session."""
        try:
            seen = action()
        except (Wrong, BookViolation, Refused, Silence, can.CanError, OSError) as error:
            self.failed += 1
            died = self._program.exit_status()
            reason = "" if died is None else f" (the program has left with exit status {died})"
            print(f"FAILED {name}: {error}{reason}", flush=True)
            if vital or died is not None:
                raise SystemExit(1) from None
            return
        self.passed += 1
        print(f"ok     {name}: {seen}", flush=True)

    def start(self, shaft: str) -> str:
        """Starts the program and joins its bus."""
        line = self._program.start(shaft)
        self._bus = can.Bus(
            f"socket://127.0.0.1:{self._program.port}",
            interface="slcan",
            bitrate=125_000,
            sleep_after_open=0,
        )
        self.wire = Wire(self._bus, self._log)
        self.master = Master(self.wire, OUR_MAC, ADDRESS)
        self.stranger = Master(self.wire, STRANGER_MAC, ADDRESS)
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
        identifier = book.group_2(ADDRESS, book.DUPLICATE_MAC)
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

    # --- Allocation

    def refuses_other_services_unconnected(self) -> str:
        ask = bytes([book.GET, IDENTITY, 1, 1])
        return expect_refusal(lambda: self.master.unconnected(ask), 0x02, 0x03)

    def refuses_wrong_choices(self) -> str:
        seen = [
            expect_refusal(lambda: self.master.allocate(0x00), 0x09, 0x02),
            expect_refusal(lambda: self.master.allocate(0x05), 0x02, 0x02),
            expect_refusal(lambda: self.master.allocate(book.POLL), 0x09, 0x02),
        ]
        return f"nothing {seen[0]}, bit-strobe {seen[1]}, poll alone {seen[2]}"

    def allocates_explicit_and_poll(self) -> str:
        self.master.allocate(book.EXPLICIT | book.POLL)
        owner = self.master.get(DEVICENET, 1, 5)
        expect("allocation information", owner, bytes([book.EXPLICIT | book.POLL, OUR_MAC]))
        return f"CB 00, allocated {owner.hex(' ')}"

    def keeps_another_master_out(self) -> str:
        other = self.stranger
        seen = expect_refusal(lambda: other.allocate(book.EXPLICIT | book.POLL), 0x0C, 0x01)
        expect_refusal(lambda: other.release(book.EXPLICIT), 0x0C, 0x01)
        other.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]))
        return f"Allocate and Release {seen}, Get without an answer"

    def refuses_a_second_allocation(self) -> str:
        return expect_refusal(lambda: self.master.allocate(book.POLL), 0x0B, 0x02)

    # --- Explicit messages

    def tells_its_identity(self) -> str:
        def get(attribute: int) -> bytes:
            return self.master.get(IDENTITY, 1, attribute)

        expect("vendor", unsigned(get(1), 2), VENDOR)
        expect("device type", unsigned(get(2), 2), 0)
        expect("product code", unsigned(get(3), 2), 0x0A)
        expect("revision", get(4), b"\x01\x01")
        expect("status, owned and not configured", unsigned(get(5), 2), 0x0001)
        expect("serial number", unsigned(get(6), 4), SERIAL)
        name = b"AMG 11 - Multiturn"
        expect("product name", get(7), bytes([len(name)]) + name)
        return f"product code 0A, serial {SERIAL}, {name.decode()}"

    def repeats_a_fragment_that_is_not_acknowledged(self) -> str:
        name = self.master.get_without_first_acknowledge(IDENTITY, 1, 7)
        expect("product name", name[1:], b"AMG 11 - Multiturn")
        return "first fragment again after 1 s"

    def echoes_the_transaction_bit(self) -> str:
        self.master.xid = True
        try:
            return f"serial {unsigned(self.master.get(IDENTITY, 1, 6), 4)} under XID 1"
        finally:
            self.master.xid = False

    def takes_a_repeated_fragment_once(self) -> str:
        body = bytes([book.SET, ENCODER, 1, COS_DELTA]) + udint(5)
        expect("response", self.master.explicit(body, repeat_fragments=True), b"\x90")
        expect("COS delta", self.number(COS_DELTA), 5)
        self.put(COS_DELTA, 1)
        return "acknowledged twice, appended once"

    def refuses_what_does_not_exist(self) -> str:
        master = self.master
        one = (1).to_bytes(2, "little")
        seen = [
            expect_refusal(lambda: master.get(IDENTITY, 1, 99), 0x14),
            expect_refusal(lambda: master.get(ENCODER, 1, 90), 0x14),
            expect_refusal(lambda: master.get(0x77, 1, 1), 0x16),
            expect_refusal(lambda: master.get(ENCODER, 2, 1), 0x16),
            expect_refusal(lambda: master.service(0x32, ENCODER, 1), 0x08),
            expect_refusal(lambda: master.set(IDENTITY, 1, 1, one), 0x0E),
            expect_refusal(lambda: master.set(ENCODER, 1, POSITION, udint(1)), 0x0E),
        ]
        return ", ".join(seen)

    def has_the_defaults_of_the_manual(self) -> str:
        return self.expect_settings(0, STEPS, DEFAULT_TOTAL, 0, 0, 1)

    # --- Poll

    def does_not_answer_a_poll_before_the_packet_rate_is_set(self) -> str:
        state = self.connection_state(POLL_CONNECTION)
        expect("state of the poll connection", state, CONFIGURING)
        self.master.expect_no_poll_response()
        return "configuring, no poll response"

    def establishes_the_poll_connection(self) -> str:
        self.set_packet_rate(EXPLICIT_CONNECTION, 0)
        granted = self.set_packet_rate(POLL_CONNECTION, 60_000)
        state = self.connection_state(POLL_CONNECTION)
        expect("state of the poll connection", state, ESTABLISHED)
        return f"{granted}, established"

    def drops_a_poll_with_data(self) -> str:
        self.master.expect_no_poll_response(data=b"\x00")
        return "no response, since the connection consumes 0 octets"

    def follow(self, steps: int, total: int, sign: int) -> str:
        """Five polls of a shaft that turns once a second: the positions must keep step."""
        polls = []
        for _ in range(5):
            polls.append(self.polled())
            time.sleep(0.2)
        moved = []
        for (before, old), (after, new) in itertools.pairwise(polls):
            due = steps * (after - before)
            step = sign * (new - old) % total
            expect_within("steps between two polls", step, due * 0.85 - 80, due * 1.15 + 80)
            moved.append(sign * step)
        return f"{polls[0][1]}, then " + ", ".join(f"{step:+}" for step in moved)

    def follows_the_shaft(self) -> str:
        return self.follow(STEPS, DEFAULT_TOTAL, +1)

    # --- Settings

    def scales_to_3600_steps(self) -> str:
        self.put(STEPS_PER_TURN, 3600)
        expect("total after steps per turn", self.number(TOTAL), 3600 * TURNS)
        self.put(TOTAL, 921_600)
        self.expect_settings(0, 3600, 921_600, 0, 0, 1)
        moved = self.follow(3600, 921_600, +1)
        return f"3600 steps per turn, total 235929600, then 921600; {moved}"

    def turns_the_other_way(self) -> str:
        expect("data in the response", self.master.set(ENCODER, 1, DIRECTION, b"\x01"), b"")
        expect("operating status", self.master.get(ENCODER, 1, 80), b"\x07")
        seen = self.follow(3600, 921_600, -1)
        self.master.set(ENCODER, 1, DIRECTION, b"\x00")
        expect("operating status", self.master.get(ENCODER, 1, 80), b"\x06")
        return seen

    def presets_the_moving_shaft(self) -> str:
        before = time.time()
        self.put(PRESET, 1000)
        at, position = self.polled()
        # The position was 1000 at some moment after `before`.
        most = 3600 * (at - before) * 1.15 + 80
        expect_within("steps since the preset", position - 1000, 0, most)
        expect("preset read back", self.number(PRESET), 1000)
        self.offset = self.number(OFFSET)
        if self.offset == 0:
            raise Wrong("the offset is 0, though the preset moved the position")
        return f"position {position} {1000 * (at - before):.1f} ms later, offset {self.offset}"

    def refuses_values_out_of_range(self) -> str:
        before = self.settings()
        for attribute, value in [
            (STEPS_PER_TURN, 0),
            (STEPS_PER_TURN, STEPS + 1),
            (TOTAL, 0),
            (TOTAL, 3600 * TURNS + 1),
            (PRESET, 921_600),
            (COS_DELTA, 0),
            (COS_DELTA, 921_601),
        ]:
            try:
                expect_refusal(partial(self.put, attribute, value), 0x09)
            except Wrong as wrong:
                raise Wrong(f"attribute {attribute} set to {value}: {wrong}") from None
        expect_refusal(lambda: self.master.set(ENCODER, 1, TOTAL, b"\x01\x00"), 0x13)
        expect_refusal(lambda: self.master.set(ENCODER, 1, TOTAL, bytes(5)), 0x15)
        expect("settings after the refusals", self.settings(), before)
        return "7 values 09, too short 13, too long 15, nothing changed"

    def writing_the_same_again_changes_nothing(self) -> str:
        self.put(STEPS_PER_TURN, 3600)
        self.master.set(ENCODER, 1, DIRECTION, b"\x00")
        return self.expect_settings(0, 3600, 921_600, 1000, self.offset, 1)

    def saves(self) -> str:
        answer = self.master.explicit(bytes([book.SAVE, ENCODER, 1]))
        expect("response to Save", answer, b"\x96")
        return "96"

    def changes_something_without_saving(self) -> str:
        self.put(COS_DELTA, 77)
        expect("COS delta", self.number(COS_DELTA), 77)
        return "COS delta 77 in force"

    def releases(self) -> str:
        self.master.release(book.POLL)
        self.master.expect_no_poll_response()
        self.master.release(book.EXPLICIT)
        self.master.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]))
        return "CC twice, then neither poll nor Get is answered"

    # --- After power-off

    def has_kept_what_was_saved(self) -> str:
        return self.expect_settings(0, 3600, 921_600, 1000, self.offset, 1)

    def says_that_it_is_configured(self) -> str:
        status = unsigned(self.master.get(IDENTITY, 1, 5), 2)
        expect("identity status, owned and configured", status, 0x0005)
        return f"{status:04X}"

    def expect_position(self, wanted: int) -> str:
        """Poll and attribute 12 must both give it."""
        expect("polled position", self.polled()[1], wanted)
        expect("attribute 12", self.number(POSITION), wanted)
        return f"{wanted}, polled and read"

    def stands_where_the_formula_says(self) -> str:
        self.kept_position = position_at(STILL_AT, 3600, 921_600, self.offset)
        return self.expect_position(self.kept_position)

    def restores(self) -> str:
        self.put(COS_DELTA, 77)
        answer = self.master.explicit(bytes([book.RESTORE, ENCODER, 1]))
        expect("response to Restore", answer, b"\x95")
        self.has_kept_what_was_saved()
        self.expect_position(self.kept_position)
        return "95, COS delta 77 is 1 again, same position"

    def resets_to_the_defaults(self) -> str:
        answer = self.master.explicit(bytes([book.RESET, ENCODER, 1]))
        expect("response to Reset", answer, b"\x85")
        self.has_the_defaults_of_the_manual()
        return "85, " + self.expect_position(STILL_AT)

    def computes_positions_exactly(self) -> str:
        seen = []
        for steps, clockwise in [(1000, True), (1000, False), (3599, False), (1, True), (1, False)]:
            self.put(STEPS_PER_TURN, steps)
            self.master.set(ENCODER, 1, DIRECTION, bytes([not clockwise]))
            total = self.number(TOTAL)
            expect("total of 65536 turns", total, steps * TURNS)
            wanted = position_at(STILL_AT, steps, total, clockwise=clockwise)
            self.expect_position(wanted)
            seen.append(f"{steps} {'CW' if clockwise else 'CCW'}: {wanted}")
        return ", ".join(seen)

    def presets_the_standing_shaft(self) -> str:
        self.put(PRESET, 42)
        total = self.number(TOTAL)
        plain = position_at(STILL_AT, 1, total, clockwise=False)
        expect("offset", self.number(OFFSET), 42 - plain)
        return self.expect_position(42) + f", offset {42 - plain}"

    def restores_the_saved_offset(self) -> str:
        self.master.explicit(bytes([book.RESTORE, ENCODER, 1]))
        self.has_kept_what_was_saved()
        return self.expect_position(self.kept_position)

    # --- The watchdog

    def reallocate_poll(self, assembly: int) -> None:
        """Allocates the poll connection anew and chooses what it produces."""
        self.master.allocate(book.POLL)
        expect("state when allocated anew", self.connection_state(POLL_CONNECTION), CONFIGURING)
        path = bytes([0x20, 0x04, 0x24, assembly])
        self.master.set(CONNECTION, POLL_CONNECTION, PRODUCED_PATH, path)

    def times_out_after_four_packet_rates(self) -> str:
        self.master.release(book.POLL)
        self.reallocate_poll(1)
        self.set_packet_rate(POLL_CONNECTION, 100)
        time.sleep(1.5)
        state = self.connection_state(POLL_CONNECTION)
        expect("state 1.5 s after it was established, none polled", state, ESTABLISHED)
        self.polled()
        time.sleep(0.25)
        self.polled()
        time.sleep(0.8)
        state = self.connection_state(POLL_CONNECTION)
        expect("state 0.8 s after the last poll", state, TIMED_OUT)
        self.master.expect_no_poll_response()
        return "established after 1.5 s without a poll, timed out 0.8 s after the last one"

    def gives_ten_seconds_for_the_first_poll(self) -> str:
        self.reallocate_poll(1)
        self.set_packet_rate(POLL_CONNECTION, 100)
        time.sleep(9.0)
        state = self.connection_state(POLL_CONNECTION)
        expect("state after 9 s without a first poll", state, ESTABLISHED)
        time.sleep(1.8)
        state = self.connection_state(POLL_CONNECTION)
        expect("state after 10.8 s without a first poll", state, TIMED_OUT)
        return "established after 9 s, timed out after 10.8 s"

    def produces_the_flags_with_assembly_2(self) -> str:
        self.reallocate_poll(2)
        self.set_packet_rate(POLL_CONNECTION, 60_000)
        size = unsigned(self.master.get(CONNECTION, POLL_CONNECTION, PRODUCED_SIZE), 2)
        expect("produced size", size, 5)
        data = self.master.poll().data
        expect("poll response", data, udint(self.kept_position) + b"\x00")
        path = bytes.fromhex("20042401")
        expect_refusal(
            lambda: self.master.set(CONNECTION, POLL_CONNECTION, PRODUCED_PATH, path), 0x0C
        )
        return f"{data.hex(' ')}; another path while established 0C"

    def checks_its_mac_id_anew_after_an_identity_reset(self) -> str:
        # Assembly 1 again, which is kept at once.
        self.master.release(book.POLL)
        self.reallocate_poll(1)
        answer = self.master.explicit(bytes([book.RESET, IDENTITY, 1]))
        expect("response to Reset", answer, b"\x85")
        expected = book.DuplicateMacCheck(False, 0, VENDOR, SERIAL)
        first, check = self.master.hear_duplicate_mac(2.0)
        expect("first request", check, expected)
        second, check = self.master.hear_duplicate_mac(2.0)
        expect("second request", check, expected)
        apart = second.at - first.at
        expect_within("seconds between the two requests", apart, 0.9, 1.3)
        self.answers_nothing_before_it_is_on_line()
        time.sleep(1.2)
        return f"two requests {apart:.2f} s apart from vendor {VENDOR}, serial {SERIAL}"

    def has_no_connection_after_the_reset(self) -> str:
        self.master.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]))
        return self.connect()

    def has_sent_nothing_but_its_own_identifiers(self) -> str:
        own = {
            book.poll_response_identifier(ADDRESS),
            book.group_2(ADDRESS, book.RESPONSE),
            book.group_2(ADDRESS, book.DUPLICATE_MAC),
        }
        foreign = sorted(f"{identifier:03X}" for identifier in self.heard - own)
        expect("other identifiers on the bus", foreign, [])
        return ", ".join(f"{identifier:03X}" for identifier in sorted(self.heard))

    # --- The three runs

    def get_on_line(self, shaft: str) -> None:
        """Starts the program and waits until it is on line."""
        self.step(f"starts with the shaft '{shaft}'", lambda: self.start(shaft), vital=True)
        self.named(self.answers_nothing_before_it_is_on_line)
        self.named(self.checks_its_mac_id_at_the_start)

    def named(self, action: Callable[[], str], vital: bool = False) -> None:
        """A step that is called like its method."""
        self.step(action.__name__.replace("_", " "), action, vital)

    def first_run(self) -> None:
        """A fresh encoder on a turning shaft."""
        self.get_on_line("turn rpm=60 angle=0")
        self.named(self.objects_to_a_second_claim)
        self.named(self.refuses_other_services_unconnected)
        self.named(self.refuses_wrong_choices)
        self.named(self.allocates_explicit_and_poll, vital=True)
        self.named(self.keeps_another_master_out)
        self.named(self.refuses_a_second_allocation)
        self.named(self.does_not_answer_a_poll_before_the_packet_rate_is_set)
        self.named(self.establishes_the_poll_connection, vital=True)
        self.named(self.tells_its_identity)
        self.named(self.repeats_a_fragment_that_is_not_acknowledged)
        self.named(self.echoes_the_transaction_bit)
        self.named(self.takes_a_repeated_fragment_once)
        self.named(self.refuses_what_does_not_exist)
        self.named(self.has_the_defaults_of_the_manual)
        self.named(self.drops_a_poll_with_data)
        self.named(self.follows_the_shaft)
        self.named(self.scales_to_3600_steps)
        self.named(self.turns_the_other_way)
        self.named(self.presets_the_moving_shaft)
        self.named(self.refuses_values_out_of_range)
        self.named(self.writing_the_same_again_changes_nothing)
        self.named(self.saves)
        self.named(self.changes_something_without_saving)
        self.named(self.releases)
        self.step("leaves on SIGTERM", self.stop, vital=True)

    def second_run(self) -> None:
        """The same encoder after power-off, on a shaft that stands still."""
        self.get_on_line(f"still angle={STILL_AT}")
        self.step("is allocated again", self.connect, vital=True)
        self.named(self.has_kept_what_was_saved)
        self.named(self.says_that_it_is_configured)
        self.named(self.stands_where_the_formula_says)
        self.named(self.restores)
        self.named(self.resets_to_the_defaults)
        self.named(self.computes_positions_exactly)
        self.named(self.presets_the_standing_shaft)
        self.named(self.restores_the_saved_offset)
        self.named(self.times_out_after_four_packet_rates)
        self.named(self.gives_ten_seconds_for_the_first_poll)
        self.named(self.produces_the_flags_with_assembly_2)
        self.named(self.checks_its_mac_id_anew_after_an_identity_reset)
        self.named(self.has_no_connection_after_the_reset)
        self.named(self.stands_where_the_formula_says)
        self.step("leaves on SIGTERM", self.stop, vital=True)

    def third_run(self) -> None:
        """Once more: power-off must not move the position by a step."""
        self.get_on_line(f"still angle={STILL_AT}")
        self.step("is allocated again", self.connect, vital=True)
        self.step(
            "stands where it stood before power-off",
            lambda: self.expect_position(self.kept_position),
        )
        self.named(self.has_kept_what_was_saved)
        self.named(self.releases)
        self.step("leaves on SIGTERM", self.stop)
        self.named(self.has_sent_nothing_but_its_own_identifiers)

    def run(self) -> None:
        """All three."""
        self.first_run()
        self.second_run()
        self.third_run()


def default_program() -> Path:
    """The release build where there is one, else the debug build."""
    target = Path(__file__).resolve().parent.parent / "target"
    release = target / "release" / "codewheel"
    return release if release.exists() else target / "debug" / "codewheel"


def main() -> int:
    """Runs the session; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", nargs="?", type=Path, default=default_program())
    log = Path(tempfile.gettempdir()) / "codewheel-devicenet-session.log"
    parser.add_argument("--log", type=Path, default=log, help="candump -L lines")
    arguments = parser.parse_args()
    if not arguments.program.is_file():
        parser.error(f"no program at {arguments.program}; build it with 'cargo build' first")

    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        messages_path = Path(directory) / "messages"
        with messages_path.open("w") as messages:
            program = Program(arguments.program.resolve(), Path(directory) / "memory", messages)
            session = Session(program, log)
            try:
                session.run()
            finally:
                session.leave_bus()
                program.end()
                if session.failed:
                    tail = messages_path.read_text(errors="replace").splitlines()[-15:]
                    print("the program's last messages:", *(tail or ["(none)"]), sep="\n  ")
                print(f"the frames are in {arguments.log}")
                print(f"{session.passed} passed, {session.failed} failed")
    return 1 if session.failed else 0


if __name__ == "__main__":
    sys.exit(main())
