"""A DeviceNet Group 2 Only Server, written from the book alone, to be found, asked and told.

It checks its MAC ID, lets itself be allocated, speaks explicit messages with fragments both ways
and answers polls. It counts what it was asked and by whom, and its temper can be spoiled: it can
refuse, answer late, lose a fragment, or die. It shares no line with the master it judges. No script
to run: the walk `commission_devicenet.py` builds on it, `commission_test.py` judges it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from commission_devicenet_objects import DEVICENET, Device, Refusal
from devicenet_master import (
    ACKNOWLEDGE,
    ALLOCATE,
    APPLY,
    DUPLICATE_MAC,
    ERROR,
    EXPLICIT,
    FIRST,
    GET,
    LAST,
    MIDDLE,
    POLL,
    POLL_COMMAND,
    RELEASE,
    REQUEST,
    RESPONSE,
    SET,
    UNCONNECTED_REQUEST,
    DuplicateMacCheck,
    Frame,
    group_2,
    poll_response_identifier,
)
from commission_segment import Node

CONNECTION = 0x05
NO_MASTER = 0xFF
# The count of a first fragment that is the last one, too.
ONLY = 0x3F
CONFIGURING, ESTABLISHED, TIMED_OUT = 1, 3, 4
# Choices that this slave has, and the connection instances that they make.
INSTANCES = {EXPLICIT: 1, POLL: 2}
OWNED_BY_ANOTHER = (0x0C, 0x01)


@dataclass
class Asked:
    """A request that reached the slave."""

    at: float
    master: int
    service: int
    class_id: int
    instance: int
    data: bytes

    def __str__(self) -> str:
        path = f"{self.class_id:02X}/{self.instance}"
        return f"{self.service:02X} {path} {self.data.hex(' ')}".rstrip()


@dataclass
class Temper:
    """How the slave misbehaves; as it comes from the box, it does not."""

    # Refused with (general status, additional code), by service, by the class of the device's own.
    refuse: dict[int, tuple[int, int]] = field(default_factory=dict)
    # Seconds until an explicit response leaves, from that request on.
    late: float = 0.0
    late_from: int = 0
    # Counts of response fragments that get lost, once each.
    lost_fragments: set[int] = field(default_factory=set)
    # Counts of request fragments whose acknowledge gets lost, once each.
    lost_acknowledges: set[int] = field(default_factory=set)
    # Explicit requests after which it is dead.
    dies_after: int | None = None
    # Sets that it does and does not answer, counted from the next.
    swallows_sets: int = 0
    # A Set is acknowledged and does nothing.
    ignores_sets: bool = False


@dataclass
class Connection:
    """A connection that is allocated."""

    state: int
    packet_rate: int
    alive_at: float

    @property
    def limit(self) -> float:
        """Seconds without a message until it times out."""
        return 4 * self.packet_rate / 1000 if self.packet_rate else float("inf")


class Slave(Node[Frame]):
    """A slave with MAC ID `mac`."""

    BAUD = 0

    def __init__(
        self,
        mac: int,
        device: Device,
        inputs: Callable[[], bytes] = bytes,
        body_format: int = 0,
    ) -> None:
        self.mac = mac
        self.device = device
        # What a poll brings.
        self.inputs = inputs
        # 0: class and instance in 8 bits each, 1: 8/16, 2: 16/16, 3: 16/8.
        self.body_format = body_format
        self.temper = Temper()
        self.is_on_line = False
        self.is_alive = True
        self.owner = NO_MASTER
        self.connections: dict[int, Connection] = {}
        # What it was asked.
        self.checks: list[DuplicateMacCheck] = []
        self.allocations: list[tuple[int, int]] = []
        self.refused_allocations: list[tuple[int, int]] = []
        self.releases: list[tuple[int, int]] = []
        self.asked: list[Asked] = []
        self.polls = 0
        self.timeouts = 0
        self._incoming: tuple[int, bytes] | None = None
        self._outgoing: list[bytes] = []
        self._outgoing_count = 0
        self._outgoing_turn = 0

    # --- For the walk

    def services(self, service: int) -> list[Asked]:
        """The requests for one service."""
        return [asked for asked in self.asked if asked.service == service]

    def forget(self) -> None:
        """Starts counting anew."""
        for counted in (
            self.checks,
            self.allocations,
            self.refused_allocations,
            self.releases,
            self.asked,
        ):
            counted.clear()
        self.polls = self.timeouts = 0

    @property
    def is_free(self) -> bool:
        """Nobody owns it."""
        return self.owner == NO_MASTER

    # --- Getting on line

    def begin(self) -> None:
        """Checks its MAC ID: two requests, 1 s apart, and 1 s after the second it is on line."""
        self._check()
        self.after(1.0, self._check)
        self.after(2.0, self._go_on_line)

    def _check(self) -> None:
        if self.is_alive:
            self._say(DUPLICATE_MAC, self._claim(False).octets())

    def _claim(self, is_response: bool) -> DuplicateMacCheck:
        identity = self.device.classes[1][1]
        vendor, serial = (int(identity[number].value) for number in (1, 6))
        return DuplicateMacCheck(is_response, 0, vendor, serial)

    def _go_on_line(self) -> None:
        self.is_on_line = self.is_alive
        self._watch()

    # --- What arrives

    def hear(self, message: Frame, at: float) -> None:
        """A frame of somebody else."""
        if not self.is_alive or not 0x400 <= message.identifier <= 0x5FF:
            return
        if message.identifier >> 3 & 0x3F != self.mac:
            return
        port = message.identifier & 7
        if port == DUPLICATE_MAC:
            self._hear_check(message)
        elif self.is_on_line and port == UNCONNECTED_REQUEST:
            self._hear_unconnected(message.data)
        elif self.is_on_line and port == REQUEST:
            self._hear_explicit(message.data)
        elif self.is_on_line and port == POLL_COMMAND:
            self._hear_poll()

    def _hear_check(self, frame: Frame) -> None:
        check = DuplicateMacCheck.parse(frame)
        self.checks.append(check)
        if check.is_response or not self.is_on_line:
            self.is_alive = False
            return
        self._say(DUPLICATE_MAC, self._claim(True).octets())

    def _hear_unconnected(self, data: bytes) -> None:
        if len(data) < 2 or data[0] & 0x80:
            return
        body = data[1:]
        if body[0] not in (ALLOCATE, RELEASE) or body[1:3] != bytes([DEVICENET, 1]):
            self._answer(data[0], bytes([ERROR, 0x02, 0x03]))
            return
        try:
            answer = self._allocate(data[0] & 0x3F, body[0], body[3:])
        except Refusal as refusal:
            answer = bytes([ERROR, refusal.status, refusal.additional])
        self._answer(data[0], answer)

    def _allocate(self, master: int, service: int, data: bytes) -> bytes:
        if service == RELEASE:
            if len(data) != 1:
                raise Refusal(0x13 if len(data) < 1 else 0x15)
            if master != self.owner:
                raise Refusal(*OWNED_BY_ANOTHER)
            self.releases.append((master, data[0]))
            for bit, instance in INSTANCES.items():
                if data[0] & bit and self.connections.pop(instance, None) is None:
                    raise Refusal(0x0B, 0x02)
            self._forget_owner()
            return bytes([RELEASE | 0x80])
        if len(data) != 2:
            raise Refusal(0x13 if len(data) < 2 else 0x15)
        choice, allocator = data
        if self.owner not in (NO_MASTER, allocator):
            self.refused_allocations.append((allocator, choice))
            raise Refusal(*OWNED_BY_ANOTHER)
        if not choice:
            raise Refusal(0x09, 0x02)
        if choice & ~(EXPLICIT | POLL):
            raise Refusal(0x02, 0x02)
        if not choice & EXPLICIT and 1 not in self.connections:
            raise Refusal(0x09, 0x02)
        wanted = [instance for bit, instance in INSTANCES.items() if choice & bit]
        if any(
            instance in self.connections and self.connections[instance].state != TIMED_OUT
            for instance in wanted
        ):
            raise Refusal(0x0B, 0x02)
        self.owner = allocator
        self.allocations.append((allocator, choice))
        now = time.time()
        for instance in wanted:
            state, rate = (ESTABLISHED, 2500) if instance == 1 else (CONFIGURING, 0)
            self.connections[instance] = Connection(state, rate, now)
        return bytes([ALLOCATE | 0x80, self.body_format])

    def _forget_owner(self) -> None:
        if not any(each.state == ESTABLISHED for each in self.connections.values()):
            self.connections.clear()
            self.owner = NO_MASTER
            self._incoming, self._outgoing = None, []

    def _hear_poll(self) -> None:
        connection = self.connections.get(2)
        if connection is None or connection.state != ESTABLISHED:
            return
        connection.alive_at = time.time()
        self.polls += 1
        self.send(Frame(time.time(), poll_response_identifier(self.mac), self.inputs()))

    def _watch(self) -> None:
        """Ends connections that nobody has fed."""
        now = time.time()
        for instance, connection in list(self.connections.items()):
            if connection.state == ESTABLISHED and now - connection.alive_at > connection.limit:
                self.timeouts += 1
                if instance == 1:
                    del self.connections[1]
                else:
                    connection.state = TIMED_OUT
                self._forget_owner()
        if self.is_alive:
            self.after(0.02, self._watch)

    # --- Explicit messages

    def _hear_explicit(self, data: bytes) -> None:
        connection = self.connections.get(1)
        if connection is None or len(data) < 2 or data[0] & 0x3F != self.owner:
            return
        connection.alive_at = time.time()
        if not data[0] & 0x80:
            self._incoming = None
            self._request(data[0], data[1:])
            return
        kind, count = data[1] & 0xC0, data[1] & 0x3F
        if kind == ACKNOWLEDGE:
            self._hear_acknowledge(count)
            return
        self._hear_fragment(data[0], kind, count, data[2:])

    def _hear_fragment(self, header: int, kind: int, count: int, piece: bytes) -> None:
        if kind == FIRST and count in (0, ONLY):
            self._incoming = (count, piece)
        elif self._incoming is None:
            return
        else:
            last, body = self._incoming
            if count == last + 1 and kind in (MIDDLE, LAST):
                self._incoming = (count, body + piece)
            elif count != last:
                self._incoming = None
                return
        if count in self.temper.lost_acknowledges:
            self.temper.lost_acknowledges.discard(count)
            return
        self._say(RESPONSE, bytes([header, ACKNOWLEDGE | count, 0]))
        if (kind == LAST or count == ONLY) and self._incoming is not None:
            body, self._incoming = self._incoming[1], None
            self._request(header & 0x7F, body)

    def _request(self, header: int, body: bytes) -> None:
        wide_class, wide_instance = self.body_format in (2, 3), self.body_format in (1, 2)
        head = 3 + wide_class + wide_instance
        if len(body) < head:
            self._respond(header, bytes([ERROR, 0x13, 0xFF]))
            return
        at = 2 + wide_class
        class_id = int.from_bytes(body[1:at], "little")
        instance = int.from_bytes(body[at:head], "little")
        master = header & 0x3F
        asked = Asked(time.time(), master, body[0], class_id, instance, body[head:])
        self.asked.append(asked)
        if self.temper.dies_after is not None and len(self.asked) > self.temper.dies_after:
            self.is_alive = False
            return
        try:
            if body[0] in self.temper.refuse and class_id == self.device.linked_class:
                raise Refusal(*self.temper.refuse[body[0]])
            answer = bytes([body[0] | 0x80]) + self._serve(asked)
        except Refusal as refusal:
            answer = bytes([ERROR, refusal.status, refusal.additional])
        if body[0] == SET and class_id != CONNECTION and self.temper.swallows_sets:
            self.temper.swallows_sets -= 1
            return
        if self.temper.late and len(self.asked) >= self.temper.late_from:
            self.after(self.temper.late, lambda: self._respond(header, answer))
        else:
            self._respond(header, answer)

    def _serve(self, asked: Asked) -> bytes:
        if asked.class_id == DEVICENET:
            if asked.service in (ALLOCATE, RELEASE):
                return self._allocate(asked.master, asked.service, asked.data)[1:]
            return self._devicenet(asked)
        if asked.class_id == CONNECTION:
            return self._connection(asked)
        if asked.service == SET and self.temper.ignores_sets:
            return b""
        return self.device.serve(asked.service, asked.class_id, asked.instance, asked.data)

    def _devicenet(self, asked: Asked) -> bytes:
        connected = sum(bit for bit, instance in INSTANCES.items() if instance in self.connections)
        attributes = {
            1: bytes([self.mac]),
            2: bytes([self.BAUD]),
            3: b"\0",
            4: b"\0",
            5: bytes([connected, self.owner]),
        }
        return self._of_stack(asked, attributes, {})

    def _connection(self, asked: Asked) -> bytes:
        connection = self.connections.get(asked.instance)
        if connection is None:
            raise Refusal(0x16)
        is_explicit = asked.instance == 1
        produced = (
            group_2(self.mac, RESPONSE) if is_explicit else poll_response_identifier(self.mac)
        )
        consumed = group_2(self.mac, REQUEST if is_explicit else POLL_COMMAND)
        if asked.service == APPLY:
            raise Refusal(0x0C)
        attributes = {
            1: bytes([connection.state]),
            2: bytes([not is_explicit]),
            3: b"\x83" if is_explicit else b"\x82",
            4: produced.to_bytes(2, "little"),
            5: consumed.to_bytes(2, "little"),
            6: b"\x21" if is_explicit else b"\x01",
            7: (192 if is_explicit else len(self.inputs())).to_bytes(2, "little"),
            8: (64 if is_explicit else 0).to_bytes(2, "little"),
            9: connection.packet_rate.to_bytes(2, "little"),
            12: bytes([is_explicit]),
            13: b"\0\0",
            14: b"",
            15: b"\0\0",
            16: b"",
        }

        def establish(value: bytes) -> bytes:
            connection.packet_rate = int.from_bytes(value, "little")
            connection.state, connection.alive_at = ESTABLISHED, time.time()
            return value

        return self._of_stack(asked, attributes, {9: establish})

    @staticmethod
    def _of_stack(asked: Asked, attributes: dict[int, bytes], settable: dict) -> bytes:
        if asked.service not in (GET, SET):
            raise Refusal(0x08)
        if not asked.data:
            raise Refusal(0x13)
        number, value = asked.data[0], asked.data[1:]
        if number not in attributes:
            raise Refusal(0x14)
        if asked.service == GET:
            return attributes[number]
        if number not in settable:
            raise Refusal(0x0E)
        if len(value) != len(attributes[number]):
            raise Refusal(0x13 if len(value) < len(attributes[number]) else 0x15)
        return settable[number](value)

    # --- What leaves

    def _say(self, port: int, data: bytes) -> None:
        self.send(Frame(time.time(), group_2(self.mac, port), data))

    def _answer(self, header: int, body: bytes) -> None:
        self._say(RESPONSE, bytes([header & 0x7F]) + body)

    def _respond(self, header: int, body: bytes) -> None:
        if not self.is_alive:
            return
        if len(body) <= 7:
            self._answer(header, body)
            return
        pieces = [body[at : at + 6] for at in range(0, len(body), 6)]
        self._outgoing = []
        for count, piece in enumerate(pieces):
            kind = FIRST if count == 0 else LAST if count == len(pieces) - 1 else MIDDLE
            self._outgoing.append(bytes([header | 0x80, kind | count & 0x3F]) + piece)
        self._outgoing_count = 0
        self._send_fragment(is_retry=False)

    def _send_fragment(self, is_retry: bool) -> None:
        """Sends the fragment that is due, and again after 1 s without acknowledge."""
        self._outgoing_turn += 1
        turn = self._outgoing_turn
        if self._outgoing_count in self.temper.lost_fragments:
            self.temper.lost_fragments.discard(self._outgoing_count)
        else:
            self._say(RESPONSE, self._outgoing[self._outgoing_count])

        def give_up_or_repeat() -> None:
            if turn != self._outgoing_turn or not self._outgoing or not self.is_alive:
                return
            if is_retry:
                self._outgoing = []
            else:
                self._send_fragment(is_retry=True)

        self.after(1.0, give_up_or_repeat)

    def _hear_acknowledge(self, count: int) -> None:
        if not self._outgoing or count != self._outgoing_count & 0x3F:
            return
        self._outgoing_count += 1
        if self._outgoing_count == len(self._outgoing):
            self._outgoing = []
            self._outgoing_turn += 1
        else:
            self._send_fragment(is_retry=False)
