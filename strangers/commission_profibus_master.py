"""A PROFIBUS-DP master that owns slaves and a token ring, written from the book alone.

It brings its slaves up, exchanges data with them, asks the gap for masters that want to join,
passes the token, and takes it up again where it got lost. A commissioning tool must look on without
disturbing it, or join its ring without breaking it. No script to run.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import profibus_book as book
from commission_segment import Node
from profibus_book import BookViolation, Parameters, Telegram, is_of_a_master

# Answers to an FDL status, bits 4 and 5: what the station is.
STATION, SLAVE, NOT_READY, READY, IN_RING = 0x30, 0x00, 0x10, 0x20, 0x30
TRIES = 3
# With nothing on the line for so long the token is lost.
LOST_SECONDS = 0.6
# A newcomer listens for so long.
FIRST_SECONDS = 0.15


@dataclass
class Owned:
    """A slave that this master serves."""

    address: int
    parameters: bytes
    configuration: bytes
    outputs: bytes
    # Slave_Diag, Set_Prm, Chk_Cfg, Slave_Diag, then Data_Exchange for ever.
    step: int = 0
    frame_count: bool | None = None
    misses: int = 0
    exchanges: int = 0
    # How often it had to be brought up again after data were exchanged.
    falls: int = 0
    inputs: bytes = b""

    def request(self, own: int) -> Telegram:
        """The next request."""
        count = book.FRAME_COUNT if self.frame_count in (None, True) else 0
        count |= book.FRAME_COUNT_VALID if self.frame_count is not None else 0
        steps: list[tuple[int | None, bytes]] = [
            (book.SLAVE_DIAG, b""),
            (book.SET_PRM, self.parameters),
            (book.CHK_CFG, self.configuration),
            (book.SLAVE_DIAG, b""),
            (None, self.outputs),
        ]
        dsap, data = steps[self.step]
        ssap = None if dsap is None else book.MASTER_SAP
        return Telegram(self.address, own, book.SRD_HIGH | count, data, dsap, ssap)

    def answered(self, octets: bytes | None) -> None:
        """Takes the answer; three silences, or RS, begin anew."""
        if octets is None:
            self.misses += 1
            if self.misses >= TRIES:
                self._fall()
            return
        self.misses = 0
        self.frame_count = self.frame_count is False
        answer = None if octets[0] == book.SHORT_ACKNOWLEDGE else Telegram.parse(octets)
        if answer is not None and answer.function == book.RS:
            self._fall()
        elif self.step == 3 and answer is not None:
            diagnosis = book.Diagnosis(answer.data)
            self.step = 0 if diagnosis.waits_for_parameters or diagnosis.is_not_ready else 4
        elif self.step < 4:
            self.step += 1
        elif answer is not None:
            self.inputs = answer.data
            self.exchanges += 1
            if answer.function == book.DATA_HIGH:
                self.step = 3

    def _fall(self) -> None:
        self.falls += self.exchanges > 0 and self.step == 4
        self.step, self.frame_count, self.misses = 0, None, 0


def encoder_at(address: int, outputs: bytes = bytes(4), watchdog: int = 100) -> Owned:
    """An encoder with the parameters of its GSD file; the watchdog in units of 10 ms."""
    parameters = Parameters(watchdog=(1, watchdog)).octets()
    return Owned(address, parameters, bytes([book.TWO_WORDS_BOTH_WAYS]), outputs)


class RingMaster(Node[bytes]):
    """A master at `address`; without token it behaves as those of the simple sort do."""

    def __init__(
        self,
        address: int,
        slaves: list[Owned] | None = None,
        has_token: bool = True,
        slot: float = 0.02,
        pause: float = 0.01,
        highest: int = 20,
    ) -> None:
        self.address = address
        self.slaves = slaves or []
        self.next = address
        self.tokens_taken_up = 0
        self.passed_to: dict[int, int] = {}
        self.got_from: dict[int, int] = {}
        # Addresses that left the ring without a word, as far as this master can tell.
        self.lost: list[int] = []
        self._has_token = has_token
        self._is_in_ring = False
        self._slot = slot
        self._pause = pause
        self._highest = highest
        self._gap = address
        self._turn = 0
        self._next_slave = 0
        self._answered: Callable[[bytes | None], None] | None = None
        self._heard_at = 0.0
        self._heard_after_pass = True

    # --- The line

    def begin(self) -> None:
        """It listens; where nobody is to be heard, it takes the token."""
        begun = self._heard_at = time.monotonic()
        self.after(FIRST_SECONDS, lambda: self._heard_at == begun and self._hold())
        self.after(LOST_SECONDS, self._look_for_the_token)

    def _look_for_the_token(self) -> None:
        if time.monotonic() - self._heard_at > LOST_SECONDS:
            self.tokens_taken_up += 1
            self.next = self.address
            self._hold()
        self.after(0.1, self._look_for_the_token)

    def send(self, message: bytes) -> None:
        """Its own telegrams are a life sign, too."""
        self._heard_at = time.monotonic()
        super().send(message)

    def hear(self, message: bytes, at: float) -> None:
        """A token, a request to it, or the answer that it waits for."""
        self._heard_at = time.monotonic()
        self._heard_after_pass = True
        if message[:1] == bytes([book.SD4]):
            if len(message) == 3 and message[1] == self.address and message[2] != self.address:
                self.got_from[message[2]] = self.got_from.get(message[2], 0) + 1
                self._hold()
            return
        try:
            if is_of_a_master(message):
                telegram = Telegram.parse(message)
                if telegram.da == self.address and telegram.fc == book.FDL_STATUS:
                    kind = NOT_READY if not self._has_token else READY
                    kind = IN_RING if self._is_in_ring else kind
                    self.send(Telegram(telegram.sa, self.address, kind).octets())
                return
        except BookViolation:
            return
        if self._answered is not None:
            answered, self._answered = self._answered, None
            self._turn += 1
            answered(message)

    def _ask(self, octets: bytes, answered: Callable[[bytes | None], None]) -> None:
        self._answered = answered
        self._turn += 1
        turn = self._turn
        self.send(octets)

        def silent() -> None:
            if turn == self._turn:
                self._answered = None
                answered(None)

        self.after(self._slot, silent)

    # --- A turn with the token

    def _hold(self) -> None:
        self._is_in_ring = self._has_token
        self._turn += 1
        self._serve(0)

    def _serve(self, index: int) -> None:
        """Asks each slave once, then the gap."""
        if index >= len(self.slaves):
            self._ask_gap()
            return
        slave = self.slaves[index]

        def answered(octets: bytes | None) -> None:
            slave.answered(octets)
            self._serve(index + 1)

        self._ask(slave.request(self.address).octets(), answered)

    def _ask_gap(self) -> None:
        """One address between this master and the next."""
        if not self._has_token:
            self._later(self._hold)
            return
        self._gap = self._gap + 1 if self._gap < self._highest else 0
        owned = {slave.address for slave in self.slaves}
        if self._gap == self.next or self._gap == self.address:
            self._gap = self.address
            self._pass(0)
            return
        if self._gap in owned:
            self._pass(0)
            return
        asked = self._gap

        def answered(octets: bytes | None) -> None:
            if octets is not None and octets[0] == book.SD1:
                kind = Telegram.parse(octets).fc & STATION
                if kind in (READY, IN_RING):
                    self.next = asked
            self._pass(0)

        self._ask(Telegram(asked, self.address, book.FDL_STATUS).octets(), answered)

    def _pass(self, tries: int) -> None:
        to = self.next
        if tries == TRIES:
            self.lost.append(to)
            self.next = self._gap = self.address
            self._hold()
            return
        self.passed_to[to] = self.passed_to.get(to, 0) + 1
        if to == self.address:
            self.send(book.token(to, self.address))
            self._later(self._hold)
            return
        self._turn += 1
        turn = self._turn
        self._heard_after_pass = False
        self.send(book.token(to, self.address))

        def look() -> None:
            if turn == self._turn and not self._heard_after_pass:
                self._pass(tries + 1)

        self.after(self._slot, look)

    def _later(self, action: Callable[[], None]) -> None:
        self._turn += 1
        turn = self._turn
        self.after(self._pause, lambda: turn == self._turn and action())
