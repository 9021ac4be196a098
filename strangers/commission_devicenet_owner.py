"""A DeviceNet master that owns a slave and polls it, whatever else goes on. No script to run.

It allocates explicit and poll, sets both packet rates, then polls every 50 ms. A poll says for whom
it is, not from whom; so a master that is to be known by others asks something else, too, now and
then.
"""

from __future__ import annotations

import time

from commission_devicenet_slave import CONNECTION
from commission_segment import Node
from devicenet_master import (
    ALLOCATE,
    EXPLICIT,
    GET,
    POLL,
    POLL_COMMAND,
    REQUEST,
    RESPONSE,
    SET,
    UNCONNECTED_REQUEST,
    Frame,
    group_2,
    poll_response_identifier,
)

CYCLE_SECONDS = 0.05
POLL_RATE = 500
# A poll out of so many is followed by a question.
ASKS_EVERY = 5


class Owner(Node[Frame]):
    """A master with MAC ID `mac` that owns the slave with MAC ID `slave`."""

    def __init__(self, mac: int, slave: int, does_poll: bool = True) -> None:
        self.mac = mac
        self.slave = slave
        self.does_poll = does_poll
        self.asks = False
        self.is_ready = False
        self.polls = 0
        self.answers = 0
        # Anything that its slave said to it and that a slave in order does not say.
        self.trouble: list[str] = []
        no_limit, rate = (0).to_bytes(2, "little"), POLL_RATE.to_bytes(2, "little")
        self._to_do = [
            (UNCONNECTED_REQUEST, bytes([ALLOCATE, 3, 1, EXPLICIT | POLL * does_poll, mac])),
            (REQUEST, bytes([SET, CONNECTION, 1, 9]) + no_limit),
        ]
        if does_poll:
            self._to_do.append((REQUEST, bytes([SET, CONNECTION, 2, 9]) + rate))

    @property
    def is_served(self) -> bool:
        """No poll has stayed without an answer but the last."""
        return not self.trouble and self.polls - self.answers <= 1

    def begin(self) -> None:
        """Allocates."""
        self._next()

    def _next(self) -> None:
        if self._to_do:
            port, body = self._to_do.pop(0)
            self._ask(port, body)
            return
        self.is_ready = True
        if self.does_poll:
            self._poll()

    def _ask(self, port: int, body: bytes) -> None:
        self.send(Frame(time.time(), group_2(self.slave, port), bytes([self.mac]) + body))

    def _poll(self) -> None:
        self.polls += 1
        self.send(Frame(time.time(), group_2(self.slave, POLL_COMMAND), b""))
        if self.asks and self.polls % ASKS_EVERY == 0:
            self._ask(REQUEST, bytes([GET, 3, 1, 1]))
        self.after(CYCLE_SECONDS, self._poll)

    def hear(self, message: Frame, at: float) -> None:
        """Answers of its slave."""
        if message.identifier == poll_response_identifier(self.slave):
            self.answers += 1
        is_response = message.identifier == group_2(self.slave, RESPONSE)
        if not is_response or message.data[:1] != bytes([self.mac]):
            return
        if message.data[1:2] == b"\x94":
            self.trouble.append(str(message))
        elif not self.is_ready:
            self._next()
