"""A DeviceNet master for one slave, written from the book alone, over python-can.

It speaks to a Group 2 Only Server: duplicate MAC ID check, allocation of the predefined
master/slave connection set, explicit messages with fragmentation both ways, poll, change of state
and cyclic with their acknowledge, heartbeat. It shares no line with the slave it judges. Numbers in
comments are hexadecimal where the book has them so.

Whatever does not go by the book raises `BookViolation`, silence raises `Silence`, and an error
response raises `Refused`; each says what was sent and what came back.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TextIO

import can

# Services
GET_ALL = 0x01
RESET = 0x05
APPLY = 0x0D
GET = 0x0E
SET = 0x10
RESTORE = 0x15
SAVE = 0x16
ALLOCATE = 0x4B
GET_ENUM_STRING = 0x4B
RELEASE = 0x4C
ERROR = 0x94

# Allocation choice bits
EXPLICIT = 0x01
POLL = 0x02
CHANGE_OF_STATE = 0x10
CYCLIC = 0x20
UNACKNOWLEDGED = 0x40

# Group 2 message numbers
ACKNOWLEDGE_COMMAND = 2
RESPONSE = 3
REQUEST = 4
POLL_COMMAND = 5
UNCONNECTED_REQUEST = 6
DUPLICATE_MAC = 7

# Fragment types
FIRST, MIDDLE, LAST, ACKNOWLEDGE = 0x00, 0x40, 0x80, 0xC0

STATUS_NAMES = {
    0x02: "resource unavailable",
    0x05: "path unknown",
    0x08: "service not supported",
    0x09: "invalid attribute value",
    0x0B: "already in that mode",
    0x0C: "object state conflict",
    0x0E: "attribute not settable",
    0x10: "device state conflict",
    0x13: "not enough data",
    0x14: "attribute not supported",
    0x15: "too much data",
    0x16: "object does not exist",
    0x18: "no stored data",
    0x19: "store failed",
    0x20: "invalid parameter",
}


class BookViolation(Exception):
    """The slave sent something that the book does not allow here."""


class Silence(Exception):
    """No answer in time."""


class Refused(Exception):
    """An error response; `status` and `additional` hold its codes."""

    def __init__(self, asked: bytes, status: int, additional: int) -> None:
        self.status = status
        self.additional = additional
        name = STATUS_NAMES.get(status, "a status the book does not list")
        super().__init__(
            f"request {asked.hex(' ')} refused with {status:02X}/{additional:02X} ({name})"
        )


def group_2(mac: int, message: int) -> int:
    """The identifier of group 2 message `message` with MAC ID `mac`: 10 mac message."""
    return 0x400 | mac << 3 | message


def poll_response_identifier(mac: int) -> int:
    """The identifier of group 1 message 15 (poll response): 0 1111 mac."""
    return 0x3C0 | mac


def change_of_state_identifier(mac: int) -> int:
    """The identifier of group 1 message 13 (change of state or cyclic): 0 1101 mac."""
    return 0x340 | mac


@dataclass
class Frame:
    """A frame that was seen, with the host's time in seconds."""

    at: float
    identifier: int
    data: bytes
    is_ours: bool = False

    def __str__(self) -> str:
        return f"{self.identifier:03X}#{self.data.hex().upper()}"


@dataclass
class Wire:
    """A python-can bus that keeps every frame of both directions, candump style, in `log`."""

    bus: can.BusABC
    log: TextIO | None = None
    seen: list[Frame] = field(default_factory=list)

    def send(self, identifier: int, data: bytes) -> Frame:
        """Sends a data frame."""
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        frame = self._note(Frame(time.time(), identifier, data, is_ours=True))
        self.bus.send(message)
        return frame

    def receive(self, seconds: float) -> Frame | None:
        """The next frame of anybody else, or None after `seconds`."""
        deadline = time.time() + seconds
        while True:
            message = self.bus.recv(max(0.0, deadline - time.time()))
            if message is None:
                if time.time() >= deadline:
                    return None
                continue
            if message.is_extended_id or message.is_remote_frame or message.is_error_frame:
                raise BookViolation(f"DeviceNet has standard data frames only, got: {message}")
            return self._note(Frame(time.time(), message.arbitration_id, bytes(message.data)))

    def _note(self, frame: Frame) -> Frame:
        self.seen.append(frame)
        if self.log is not None:
            self.log.write(f"({frame.at:.6f}) vcan0 {frame}\n")
            self.log.flush()
        return frame


@dataclass
class DuplicateMacCheck:
    """A duplicate MAC ID check message: 7 octets."""

    is_response: bool
    port: int
    vendor: int
    serial: int

    def octets(self) -> bytes:
        """[R/R | physical port] [vendor] [serial]."""
        head = bytes([self.is_response << 7 | self.port])
        return head + self.vendor.to_bytes(2, "little") + self.serial.to_bytes(4, "little")

    @classmethod
    def parse(cls, frame: Frame) -> DuplicateMacCheck:
        """Reads a received one."""
        data = frame.data
        if len(data) != 7:
            raise BookViolation(f"a duplicate MAC ID check message has 7 octets, got {frame}")
        return cls(
            bool(data[0] & 0x80),
            data[0] & 0x7F,
            int.from_bytes(data[1:3], "little"),
            int.from_bytes(data[3:7], "little"),
        )


@dataclass
class Heartbeat:
    """A device heartbeat message: 8 octets on the identifier of the explicit responses."""

    at: float
    instance: int
    state: int
    flags: int
    consistency: int

    @staticmethod
    def is_one(frame: Frame, mac: int) -> bool:
        """Its header carries the MAC ID of the device itself, and the service is CD."""
        return frame.identifier == group_2(mac, RESPONSE) and frame.data[:2] == bytes([mac, 0xCD])

    @classmethod
    def parse(cls, frame: Frame) -> Heartbeat:
        """[MAC] [CD] [instance] [state] [flags] [configuration consistency value]."""
        data = frame.data
        if len(data) != 8:
            raise BookViolation(f"a device heartbeat has 8 octets, got {frame}")
        instance, consistency = (int.from_bytes(data[at : at + 2], "little") for at in (2, 6))
        return cls(frame.at, instance, data[4], data[5], consistency)


class Master:
    """A master with MAC ID `own` that speaks to the slave with MAC ID `slave`."""

    ACKNOWLEDGE_SECONDS = 1.0
    # A Save may take 5 s.
    RESPONSE_SECONDS = 6.0

    def __init__(self, wire: Wire, own: int, slave: int) -> None:
        self.wire = wire
        self.own = own
        self.slave = slave
        self.xid = False
        self._waiting: deque[Frame] = deque()

    # --- Duplicate MAC ID check

    def ask_duplicate_mac(self, vendor: int, serial: int) -> DuplicateMacCheck:
        """Claims the slave's MAC ID, as a newcomer does; returns the slave's objection."""
        claim = DuplicateMacCheck(False, 0, vendor, serial)
        self.forget()
        self.wire.send(group_2(self.slave, DUPLICATE_MAC), claim.octets())
        frame = self._expect(group_2(self.slave, DUPLICATE_MAC), 1.0, "objection to its MAC ID")
        return DuplicateMacCheck.parse(frame)

    def hear_duplicate_mac(self, seconds: float) -> tuple[Frame, DuplicateMacCheck]:
        """The next duplicate MAC ID check message with the slave's MAC ID."""
        identifier = group_2(self.slave, DUPLICATE_MAC)
        frame = self._expect(identifier, seconds, "duplicate MAC ID check message")
        return frame, DuplicateMacCheck.parse(frame)

    # --- The unconnected port

    def allocate(self, choice: int) -> None:
        """Allocates connections. Only `CB 00` (message body format 8/8) is a success."""
        answer = self.unconnected(bytes([ALLOCATE, 3, 1, choice, self.own]))
        if answer != bytes([ALLOCATE | 0x80, 0]):
            raise BookViolation(f"Allocate is answered CB 00, got {answer.hex(' ')}")

    def release(self, choice: int) -> None:
        """Releases connections."""
        answer = self.unconnected(bytes([RELEASE, 3, 1, choice]))
        if answer != bytes([RELEASE | 0x80]):
            raise BookViolation(f"Release is answered CC, got {answer.hex(' ')}")

    def unconnected(self, body: bytes) -> bytes:
        """Any request on the Group 2 only port."""
        self.forget()
        self.wire.send(group_2(self.slave, UNCONNECTED_REQUEST), bytes([self._header()]) + body)
        return self._checked(body, self._receive_body(self.RESPONSE_SECONDS))

    # --- Explicit messages

    def get(self, class_id: int, instance: int, attribute: int) -> bytes:
        """Get_Attribute_Single."""
        return self.service(GET, class_id, instance, bytes([attribute]))

    def set(self, class_id: int, instance: int, attribute: int, value: bytes) -> bytes:
        """Set_Attribute_Single; returns what the response carries (timers: the value granted)."""
        return self.service(SET, class_id, instance, bytes([attribute]) + value)

    def service(self, service: int, class_id: int, instance: int, data: bytes = b"") -> bytes:
        """Any service over the explicit connection; returns the data of the response."""
        return self.explicit(bytes([service, class_id, instance]) + data)[1:]

    def explicit(self, body: bytes, repeat_fragments: bool = False) -> bytes:
        """Any message body over the explicit connection; returns the body of the response."""
        self.forget()
        self.send_explicit(body, repeat_fragments)
        return self._checked(body, self._receive_body(self.RESPONSE_SECONDS))

    def send_explicit(self, body: bytes, repeat_fragments: bool = False) -> None:
        """Sends a message body, in fragments where it needs more than 7 octets."""
        identifier = group_2(self.slave, REQUEST)
        if len(body) <= 7:
            self.wire.send(identifier, bytes([self._header()]) + body)
            return
        pieces = [body[at : at + 6] for at in range(0, len(body), 6)]
        for count, piece in enumerate(pieces):
            kind = FIRST if count == 0 else LAST if count == len(pieces) - 1 else MIDDLE
            head = bytes([self._header(fragmented=True), kind | count & 0x3F])
            for _ in range(2 if repeat_fragments and kind != LAST else 1):
                self.wire.send(identifier, head + piece)
                self._expect_acknowledge(count & 0x3F)

    def _expect_acknowledge(self, count: int) -> None:
        wanted = bytes([self._header(fragmented=True), ACKNOWLEDGE | count, 0])
        identifier = group_2(self.slave, RESPONSE)
        what = f"acknowledge of fragment {count}"
        frame = self._expect(identifier, self.ACKNOWLEDGE_SECONDS, what)
        if frame.data != wanted:
            raise BookViolation(f"{what} is {wanted.hex(' ')}, got {frame.data.hex(' ')}")

    def _receive_body(self, seconds: float, ignore_first_fragment: bool = False) -> bytes:
        """Receives one message body, and acknowledges its fragments."""
        identifier = group_2(self.slave, RESPONSE)
        body = b""
        count = 0
        ignored_at: float | None = None
        while True:
            frame = self._expect(identifier, seconds, "response")
            if len(frame.data) < 2 or frame.data[0] & 0x7F != self._header():
                raise BookViolation(
                    f"a response carries our XID and MAC ID ({self._header():02X}), got {frame}"
                )
            if not frame.data[0] & 0x80:
                if body:
                    raise BookViolation(f"a whole message in the middle of fragments: {frame}")
                return frame.data[1:]
            kind, number = frame.data[1] & 0xC0, frame.data[1] & 0x3F
            if ignore_first_fragment and ignored_at is None:
                ignored_at = frame.at
                continue
            if ignored_at is not None and count == 0 and not 0.7 <= frame.at - ignored_at <= 1.5:
                raise BookViolation(
                    "a fragment without acknowledge is repeated after 1 s, this one after "
                    f"{frame.at - ignored_at:.2f} s"
                )
            self._check_fragment(frame, kind, number, count)
            body += frame.data[2:]
            self.wire.send(
                group_2(self.slave, REQUEST),
                bytes([self._header(fragmented=True), ACKNOWLEDGE | number, 0]),
            )
            if kind == LAST:
                return body
            count += 1

    @staticmethod
    def _check_fragment(frame: Frame, kind: int, number: int, count: int) -> None:
        if kind == ACKNOWLEDGE:
            raise BookViolation(f"an acknowledge where a response fragment is due: {frame}")
        if (kind == FIRST) != (count == 0):
            raise BookViolation(f"fragment {count} of a response has the wrong type: {frame}")
        if number != count & 0x3F:
            raise BookViolation(f"fragment {count} of a response has the wrong count: {frame}")
        if kind != LAST and len(frame.data) != 8:
            raise BookViolation(f"a fragment that is not the last one is not full: {frame}")

    def get_without_first_acknowledge(self, class_id: int, instance: int, attribute: int) -> bytes:
        """A Get whose fragmented response loses its first acknowledge, so it must be repeated."""
        body = bytes([GET, class_id, instance, attribute])
        self.forget()
        self.send_explicit(body)
        answer = self._receive_body(self.RESPONSE_SECONDS, ignore_first_fragment=True)
        return self._checked(body, answer)[1:]

    def expect_no_response(self, body: bytes, seconds: float = 0.5) -> None:
        """Sends an explicit request that must stay without an answer."""
        self.forget()
        self.wire.send(group_2(self.slave, REQUEST), bytes([self._header()]) + body)
        self._expect_nothing(group_2(self.slave, RESPONSE), seconds, "explicit response")

    # --- Poll

    def poll(self) -> Frame:
        """Polls once and returns the response; a second response is a violation."""
        self.forget()
        self.wire.send(group_2(self.slave, POLL_COMMAND), b"")
        identifier = poll_response_identifier(self.slave)
        response = self._expect(identifier, 0.5, "poll response")
        self._expect_nothing(identifier, 0.01, "second poll response")
        return response

    def expect_no_poll_response(self, data: bytes = b"", seconds: float = 0.4) -> None:
        """Polls a connection that must not answer."""
        self.forget()
        self.wire.send(group_2(self.slave, POLL_COMMAND), data)
        self._expect_nothing(poll_response_identifier(self.slave), seconds, "poll response")

    # --- Change of state and cyclic

    def listen(self, seconds: float, acknowledge: bool = False) -> list[Frame]:
        """What the change of state or cyclic connection produces in `seconds`."""
        identifier = change_of_state_identifier(self.slave)
        deadline = time.time() + seconds
        heard = []
        while (left := deadline - time.time()) > 0:
            frame = self._next(lambda frame: frame.identifier == identifier, left)
            if frame is not None:
                heard.append(frame)
                if acknowledge:
                    self.acknowledge()
        return heard

    def next_production(self, seconds: float) -> Frame:
        """The next frame of the change of state or cyclic connection."""
        return self._expect(change_of_state_identifier(self.slave), seconds, "production")

    def acknowledge(self, data: bytes = b"") -> Frame:
        """The master's acknowledge; only an empty one counts."""
        return self.wire.send(group_2(self.slave, ACKNOWLEDGE_COMMAND), data)

    # --- Heartbeat

    def heartbeats(self, seconds: float) -> list[Heartbeat]:
        """The device heartbeats of the next `seconds`."""
        self.forget()
        deadline = time.time() + seconds
        heard = []
        while (left := deadline - time.time()) > 0:
            frame = self._next(lambda frame: Heartbeat.is_one(frame, self.slave), left)
            if frame is not None:
                heard.append(Heartbeat.parse(frame))
        return heard

    # --- Below

    def _header(self, fragmented: bool = False) -> int:
        return fragmented << 7 | self.xid << 6 | self.own

    def _checked(self, asked: bytes, answer: bytes) -> bytes:
        if not answer:
            raise BookViolation(f"an empty response to {asked.hex(' ')}")
        if answer[0] == ERROR:
            if len(answer) != 3:
                raise BookViolation(f"an error response is 94 and two codes: {answer.hex(' ')}")
            raise Refused(asked, answer[1], answer[2])
        if answer[0] != asked[0] | 0x80:
            raise BookViolation(
                f"the response to service {asked[0]:02X} is {asked[0] | 0x80:02X}, "
                f"got {answer.hex(' ')}"
            )
        return answer

    def forget(self) -> None:
        """Drops what arrived before the next request, so an old answer is never taken for a new."""
        self._waiting.clear()
        # An encoder that produces all the time never leaves the bus silent.
        deadline = time.time() + 0.05
        # python-can's slcan reads octet by octet: with no time at all it never completes a frame.
        while self.wire.receive(0.005) is not None and time.time() < deadline:
            pass

    def _next(self, wanted: Callable[[Frame], bool], seconds: float) -> Frame | None:
        for frame in self._waiting:
            if wanted(frame):
                self._waiting.remove(frame)
                return frame
        deadline = time.time() + seconds
        while (left := deadline - time.time()) > 0:
            arrived = self.wire.receive(left)
            if arrived is None:
                continue
            if wanted(arrived):
                return arrived
            self._waiting.append(arrived)
        return None

    def _is_answer(self, frame: Frame, identifier: int) -> bool:
        """Heartbeats come in between, under the identifier of the responses."""
        return frame.identifier == identifier and not Heartbeat.is_one(frame, self.slave)

    def _expect(self, identifier: int, seconds: float, what: str) -> Frame:
        frame = self._next(lambda frame: self._is_answer(frame, identifier), seconds)
        if frame is None:
            others = ", ".join(str(frame) for frame in self._waiting) or "nothing"
            raise Silence(
                f"no {what} ({identifier:03X}) of MAC ID {self.slave} within {seconds:g} s; "
                f"the bus carried: {others}"
            )
        return frame

    def _expect_nothing(self, identifier: int, seconds: float, what: str) -> None:
        frame = self._next(lambda frame: self._is_answer(frame, identifier), seconds)
        if frame is not None:
            raise BookViolation(f"no {what} is due here, got {frame}")
