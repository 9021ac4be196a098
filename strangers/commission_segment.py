"""A CAN segment and an RS-485 line on TCP, for slaves and masters that live in this process.

`CanSegment` plays an SLCAN adapter for several clients at once, as Lawicel's manual has it;
`SerialLine` hands octets from each client to all others. On both sit nodes of ours. Both keep what
went by, with its time and who sent it, so that a walk can tell the program under test from others.
No script to run: the walks `commission_*.py` build on it.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import selectors
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TextIO, TypeVar

import profibus_book as book
from devicenet_master import Frame

Message = TypeVar("Message")

# A telegram that breaks off is given up after this pause.
BROKEN_OFF_SECONDS = 0.1


@dataclass
class Guest:
    """A client on TCP; `opened_at` is when it opened its channel (SLCAN) or connected."""

    number: int
    socket: socket.socket
    connected_at: float
    opened_at: float | None = None
    left_at: float | None = None
    # The number that it gave with `S`: 4 is 125k, 5 is 250k, 6 is 500k.
    rate: str = ""
    arrived: bytes = b""
    arrived_at: float = 0.0
    # Octets that the guest wrote, whatever they mean.
    octets: int = 0

    @property
    def is_there(self) -> bool:
        """It has not hung up."""
        return self.left_at is None


@dataclass
class Heard(Generic[Message]):
    """A frame or telegram that went by, its host's time in seconds, and the guest who sent it."""

    at: float
    message: Message
    guest: Guest | None

    @property
    def is_ours(self) -> bool:
        """Sent by a guest, not by a node of this process."""
        return self.guest is not None

    def __str__(self) -> str:
        text = self.message.hex(" ").upper() if isinstance(self.message, bytes) else self.message
        return f"{text}"


class Node(Generic[Message]):
    """Whoever sits on the medium in this process; all is called on the medium's own thread."""

    medium: Medium[Message]

    def begin(self) -> None:
        """The node is on the medium and may send."""

    def hear(self, message: Message, at: float) -> None:
        """A message of somebody else."""
        raise NotImplementedError

    def send(self, message: Message) -> None:
        """Puts a message on the medium."""
        self.medium.put(message, self)

    def after(self, seconds: float, action: Callable[[], None]) -> None:
        """Does something later."""
        self.medium.after(seconds, action)


class Medium(Generic[Message]):
    """A medium on TCP with nodes of ours, on a thread of its own."""

    def __init__(self, log: TextIO | None = None) -> None:
        self.heard: list[Heard[Message]] = []
        self.guests: list[Guest] = []
        self._log = log
        self._nodes: list[Node[Message]] = []
        self._pending: deque[tuple[Message, Node[Message] | None, Guest | None]] = deque()
        self._timers: list[tuple[float, int, Callable[[], None]]] = []
        self._count = itertools.count()
        self._ended = False
        self.fault: BaseException | None = None
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listener.getsockname()[1])
        self._bell, self._ear = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._ear, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    # --- For the thread of the walk

    def join(self, node: Node[Message]) -> None:
        """Puts a node on the medium."""

        def joins() -> None:
            node.medium = self
            self._nodes.append(node)
            node.begin()

        self._ask(joins)

    def part(self, node: Node[Message]) -> None:
        """Takes a node off the medium, in the middle of whatever it does."""

        def parts() -> None:
            with contextlib.suppress(ValueError):
                self._nodes.remove(node)

        self._ask(parts)

    def close(self) -> None:
        """Hangs up on everybody; what went wrong on the thread is raised here."""
        self._ended = True
        self._bell.send(b".")
        self._thread.join(5)
        for guest in self.guests:
            guest.socket.close()
        for end in (self._listener, self._bell, self._ear):
            end.close()
        self._selector.close()
        if self.fault is not None:
            raise self.fault

    def _ask(self, action: Callable[[], None]) -> None:
        done = threading.Event()

        def does() -> None:
            action()
            done.set()

        self.after(0, does)
        self._bell.send(b".")
        if not done.wait(5):
            raise RuntimeError(f"the medium's thread has ended: {self.fault}")

    # --- For nodes

    def put(self, message: Message, node: Node[Message]) -> None:
        """Hands a message of a node to all others, unless it was taken off the medium."""
        if node in self._nodes:
            self._pending.append((message, node, None))

    def after(self, seconds: float, action: Callable[[], None]) -> None:
        """Does something later, on this thread."""
        heapq.heappush(self._timers, (time.monotonic() + seconds, next(self._count), action))

    # --- The thread

    def _run(self) -> None:
        try:
            while not self._ended:
                self._turn()
        except BaseException as fault:  # noqa: BLE001 (told in `close`)
            self.fault = fault

    def _turn(self) -> None:
        left = self._timers[0][0] - time.monotonic() if self._timers else 1.0
        for key, _ in self._selector.select(max(0.0, left)):
            if key.fileobj is self._listener:
                self._welcome()
            elif key.fileobj is self._ear:
                self._ear.recv(64)
            else:
                self._read(key.data)
        now = time.monotonic()
        due = []
        while self._timers and self._timers[0][0] <= now:
            due.append(heapq.heappop(self._timers)[2])
        for action in due:
            action()
            self._deliver()
        self._deliver()

    def _welcome(self) -> None:
        connection, _ = self._listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        guest = Guest(len(self.guests), connection, time.time())
        self.guests.append(guest)
        self._selector.register(connection, selectors.EVENT_READ, guest)
        self.welcome(guest)

    def _read(self, guest: Guest) -> None:
        try:
            octets = guest.socket.recv(4096)
        except OSError:
            octets = b""
        if not octets:
            guest.left_at = time.time()
            self._selector.unregister(guest.socket)
            guest.socket.close()
            return
        guest.octets += len(octets)
        self.read(guest, octets)
        self._deliver()

    def _deliver(self) -> None:
        while self._pending:
            message, node, guest = self._pending.popleft()
            at = time.time()
            self.heard.append(Heard(at, message, guest))
            if self._log is not None:
                self._log.write(f"({at:.6f}) {self.line(message, guest)}\n")
                self._log.flush()
            for other in self.guests:
                if other is not guest and other.is_there:
                    self.write(other, message)
            for listener in list(self._nodes):
                if listener is not node:
                    listener.hear(message, at)

    def tell(self, guest: Guest, octets: bytes) -> None:
        """Writes to one guest; one that has left hears nothing."""
        with contextlib.suppress(OSError):
            guest.socket.sendall(octets)

    # --- What each medium brings

    def welcome(self, guest: Guest) -> None:
        """A guest has connected."""
        raise NotImplementedError

    def read(self, guest: Guest, octets: bytes) -> None:
        """A guest has written."""
        raise NotImplementedError

    def write(self, guest: Guest, message: Message) -> None:
        """Hands a message to a guest."""
        raise NotImplementedError

    def line(self, message: Message, guest: Guest | None) -> str:
        """A message for the log."""
        raise NotImplementedError


class CanSegment(Medium[Frame]):
    """An SLCAN adapter with several clients: it acknowledges each frame that a client sends."""

    def welcome(self, guest: Guest) -> None:
        """Its channel is closed until it says `O` or `L`."""

    def read(self, guest: Guest, octets: bytes) -> None:
        """Commands end with CR; a frame is answered `z` CR, what is not understood BEL."""
        guest.arrived += octets
        while b"\r" in guest.arrived:
            command, _, guest.arrived = guest.arrived.partition(b"\r")
            self.tell(guest, self._answer(guest, command.decode("latin-1")))

    def _answer(self, guest: Guest, command: str) -> bytes:
        kind = command[:1]
        if kind in ("t", "T", "r", "R"):
            if kind != "t" or guest.opened_at is None:
                return b"\a"
            length = int(command[4])
            data = bytes.fromhex(command[5 : 5 + 2 * length])
            frame = Frame(time.time(), int(command[1:4], 16), data, is_ours=True)
            self._pending.append((frame, None, guest))
            return b"z\r"
        if kind in ("O", "L"):
            guest.opened_at = time.time()
            return b"\r"
        if kind == "S":
            guest.rate = command[1:]
        if kind == "C":
            guest.opened_at = None
            return b"\r"
        answers = {"V": b"V1013\r", "N": b"N0001\r", "F": b"F00\r"}
        known = kind in ("", "S", "s", "Z", "X", "M", "m", "W", "U")
        return answers.get(kind, b"\r" if known else b"\a")

    def write(self, guest: Guest, message: Frame) -> None:
        """Only a guest with an open channel hears."""
        if guest.opened_at is not None:
            line = f"t{message.identifier:03X}{len(message.data)}{message.data.hex().upper()}\r"
            self.tell(guest, line.encode())

    def line(self, message: Frame, guest: Guest | None) -> str:
        """As candump -L has it; the interface is the guest's."""
        return f"{'vcan0' if guest is None else f'guest{guest.number}'} {message}"


class SerialLine(Medium[bytes]):
    """An RS-485 line with raw octets: guests hear octets at once, nodes hear telegrams."""

    def welcome(self, guest: Guest) -> None:
        """It is on the line at once."""
        guest.opened_at = guest.connected_at

    def read(self, guest: Guest, octets: bytes) -> None:
        """Octets of several telegrams, or a piece of one."""
        now = time.time()
        if now - guest.arrived_at > BROKEN_OFF_SECONDS:
            guest.arrived = b""
        guest.arrived_at = now
        guest.arrived += octets
        while guest.arrived:
            try:
                length = book.length_of(guest.arrived)
            except book.BookViolation:
                # Noise: all that has come is one message which nobody understands.
                length = len(guest.arrived)
            if length is None or len(guest.arrived) < length:
                return
            telegram, guest.arrived = guest.arrived[:length], guest.arrived[length:]
            self._pending.append((telegram, None, guest))

    def write(self, guest: Guest, message: bytes) -> None:
        """The telegram in one piece."""
        self.tell(guest, message)

    def line(self, message: bytes, guest: Guest | None) -> str:
        """In hexadecimal, with who sent it."""
        return f"{'node' if guest is None else f'guest{guest.number}'} {message.hex(' ').upper()}"


@dataclass
class Visit(Generic[Message]):
    """What a program did on a medium from `begin` on: the guests that came, what they sent."""

    medium: Medium[Message]
    begin: int = field(init=False)
    first_guest: int = field(init=False)

    def __post_init__(self) -> None:
        self.begin = len(self.medium.heard)
        self.first_guest = len(self.medium.guests)

    @property
    def guests(self) -> list[Guest]:
        """Those who came since the visit began."""
        return self.medium.guests[self.first_guest :]

    @property
    def all(self) -> list[Heard[Message]]:
        """Everything that went by since."""
        return self.medium.heard[self.begin :]

    @property
    def sent(self) -> list[Heard[Message]]:
        """What these guests sent."""
        guests = self.guests
        return [heard for heard in self.all if heard.guest in guests]

    @property
    def silence(self) -> float:
        """Seconds from the opened channel to what was sent first; infinite where nothing was."""
        sent = self.sent
        if not sent or sent[0].guest is None:
            return float("inf")
        opened = sent[0].guest.opened_at
        return sent[0].at - (opened if opened is not None else sent[0].guest.connected_at)
