"""A DP-V0 slave, written from the book and the encoder's manual alone, to be found and told.

`Slave` has the services, the states and the frame count bit; what it is stands in a `Device`: an
AMG 11 P 29 after its manual, or a valve island of another maker. It counts what it was asked and by
whom. Octets are numbered from 1, as the manual does. It shares no line with the master it judges.
No script to run: the walk `commission_profibus.py` builds on it, `commission_test.py` judges it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import profibus_book as book
from commission_segment import Node
from profibus_book import BookViolation, Telegram
from steps import position_at

WAIT_PRM, WAIT_CFG, DATA_EXCH = "WAIT_PRM", "WAIT_CFG", "DATA_EXCH"
# Bits of octet 1 of the diagnosis
NOT_READY, CFG_FAULT, EXT_DIAG, NOT_SUPPORTED, PRM_FAULT = 0x02, 0x04, 0x08, 0x10, 0x40
# Bits of octet 2; the third is always there
PRM_REQ, STAT_DIAG, ALWAYS, WATCHDOG_ON = 0x01, 0x02, 0x04, 0x08


class Device:
    """What a slave is besides its state: an ident number, a configuration, inputs and outputs."""

    ident = 0
    configurations: tuple[bytes, ...] = ()

    def parameterize(self, user: bytes) -> bool:
        """Octets 8 and higher of Set_Prm; False is Prm_Fault."""
        raise NotImplementedError

    def extended(self) -> bytes:
        """The diagnosis from octet 7 on."""
        return b""

    def is_troubled(self) -> bool:
        """Ext_Diag."""
        return False

    def output(self, octets: bytes) -> None:
        """Outputs of a Data_Exchange."""

    def inputs(self, configuration: bytes) -> bytes:
        """Inputs of a Data_Exchange."""
        raise NotImplementedError

    def output_length(self, configuration: bytes) -> int:
        """How many octets of output that configuration has."""
        raise NotImplementedError


class ValveIsland(Device):
    """A device of another maker: two octets in, two out, three octets of diagnosis of its own."""

    ident = 0x7A31
    configurations = (b"\x11\x21",)

    def __init__(self) -> None:
        self.outputs = bytes(2)

    def parameterize(self, user: bytes) -> bool:
        """It wants three octets of its own, the last two 12 34."""
        return user[-2:] == b"\x12\x34"

    def extended(self) -> bytes:
        """Device related, three octets."""
        return b"\x03\x80\x01"

    def is_troubled(self) -> bool:
        """A valve is stuck."""
        return True

    def output(self, octets: bytes) -> None:
        """The valves."""
        self.outputs = octets

    def inputs(self, configuration: bytes) -> bytes:
        """The valves, inverted."""
        return bytes(octet ^ 0xFF for octet in self.outputs)

    def output_length(self, configuration: bytes) -> int:
        """Always two."""
        return 2


class Encoder(Device):
    """An AMG 11 P 29 by its manual, on a shaft that stands still at `raw`."""

    ident = 0x059B
    STEPS, TURNS = 8192, 65536
    configurations = (b"\xf1", b"\xd1", b"\xf0", b"\xd0")

    def __init__(self, raw: int) -> None:
        self.raw = raw
        self.steps, self.total = self.STEPS, self.STEPS * self.TURNS
        self.is_counter_clockwise = False
        self.is_class_2 = True
        self.is_scaled = True
        self.offset = 0
        self.has_wrong_preset = False
        self.presets: list[int] = []
        # Every Set_Prm that was accepted, octets 8 and higher, and every output that came.
        self.parameters: list[bytes] = []
        self.outputs: list[bytes] = []
        # The clock bit, octet by octet as it came; it must be seen 0 before it can rise.
        self._clock = True

    def parameterize(self, user: bytes) -> bool:
        """Octet 8, 9, then the two resolutions where class 2 scales: manual §6.1."""
        if len(user) < 2:
            return False
        is_class_2, is_scaled = bool(user[1] & 0x02), bool(user[1] & 0x08)
        is_scaled = is_scaled and is_class_2
        steps, total = self.STEPS, self.STEPS * self.TURNS
        if is_scaled:
            if len(user) < 10:
                return False
            steps, total = (int.from_bytes(user[at : at + 4], "big") for at in (2, 6))
            if not 1 <= steps <= self.STEPS or not 1 <= total <= steps * self.TURNS:
                return False
        is_counter_clockwise = bool(user[1] & 0x01)
        if (steps, total, is_counter_clockwise) != (
            self.steps,
            self.total,
            self.is_counter_clockwise,
        ):
            self.offset = 0
        self.steps, self.total, self.is_counter_clockwise = steps, total, is_counter_clockwise
        self.is_class_2, self.is_scaled = is_class_2, is_scaled
        self.has_wrong_preset = self.has_wrong_preset and is_class_2
        self.parameters.append(user)
        self._clock = True
        return True

    def extended(self) -> bytes:
        """Octets 7 to 57 in class 2, to 16 in class 1: manual §7.2."""
        body = bytes([self.has_wrong_preset])
        body += bytes([self.is_counter_clockwise | 0x02 | self.is_scaled << 3, 0x01])
        body += self.STEPS.to_bytes(4, "big") + b"\xff\xff"
        if self.is_class_2:
            # Octets 17 to 27
            body += b"\0" + b"\x00\x01" + b"\0\0" + b"\0\0" + b"\x01\x10" + b"\x01\x21"
            body += bytes(4) + self.offset.to_bytes(4, "big", signed=True) + bytes(4)
            body += self.steps.to_bytes(4, "big") + self.total.to_bytes(4, "big") + b"*" * 10
        return bytes([len(body) + 1]) + body

    def is_troubled(self) -> bool:
        """The preset was out of range: manual §7.1."""
        return self.has_wrong_preset

    def position(self) -> int:
        """The position in steps."""
        offset = self.offset if self.is_class_2 else 0
        return position_at(
            self.raw, self.steps, self.total, offset, not self.is_counter_clockwise, self.STEPS
        )

    def output(self, octets: bytes) -> None:
        """The rise of the top bit takes the rest as preset: manual §7.4."""
        self.outputs.append(octets)
        if not octets or not self.is_class_2:
            self._clock = self._clock and bool(octets)
            return
        value = int.from_bytes(octets, "big")
        top = 1 << 8 * len(octets) - 1
        clock, value = bool(value & top), value & ~top
        if clock and not self._clock:
            self.has_wrong_preset = value >= self.total
            if not self.has_wrong_preset:
                self.presets.append(value)
                self.offset += value - self.position()
        self._clock = clock

    def inputs(self, configuration: bytes) -> bytes:
        """The position, in one word or two."""
        size = 4 if configuration[0] & 1 else 2
        return (self.position() & (1 << 8 * size) - 1).to_bytes(size, "big")

    def output_length(self, configuration: bytes) -> int:
        """D0 and D1 have none."""
        return {0xF1: 4, 0xF0: 2}.get(configuration[0], 0)


@dataclass
class Asked:
    """A request that reached the slave, and whether it was a repeated one."""

    at: float
    telegram: Telegram
    is_retry: bool = False

    def __str__(self) -> str:
        return self.telegram.octets().hex(" ").upper()


@dataclass
class Temper:
    """How the slave misbehaves; as it comes from the box, it does not."""

    # Requests that it does not answer, counted from the next.
    deaf_to: int = 0
    # Answers that it gives, and that get lost; a retry finds them stored.
    loses_answers: int = 0
    # Service access points that it answers RS.
    refuse: set[int] = field(default_factory=set)
    # It takes every Set_Prm as wrong.
    refuses_parameters: bool = False


class Slave(Node[bytes]):
    """A slave at `address`."""

    def __init__(self, address: int, device: Device) -> None:
        self.address = address
        self.device = device
        self.temper = Temper()
        self.is_alive = True
        self.state = WAIT_PRM
        self.owner = book.NO_MASTER
        self.fault = 0
        self.configuration = device.configurations[0]
        self.asked: list[Asked] = []
        # Addresses that a Set_Prm locked it to, and that unlocked it.
        self.locked_by: list[int] = []
        self.unlocked_by: list[int] = []
        self.watchdog_ends = 0
        self._watchdog: float | None = None
        self._fed_at = 0.0
        self._is_pending = False
        self._stored: tuple[bytes, bytes] | None = None

    # --- For the walk

    def services(self, sap: int | None) -> list[Telegram]:
        """The requests to one service access point; None is Data_Exchange."""
        return [
            asked.telegram
            for asked in self.asked
            if asked.telegram.dsap == sap
            and not asked.is_retry
            and asked.telegram.fc & 0x0F != book.FDL_STATUS & 0x0F
        ]

    def forget(self) -> None:
        """Starts counting anew."""
        self.asked.clear()
        self.locked_by.clear()
        self.unlocked_by.clear()
        self.watchdog_ends = 0

    # --- What arrives

    def begin(self) -> None:
        """The watchdog is looked after."""
        self._watch()

    def _watch(self) -> None:
        if self._watchdog is not None and time.monotonic() - self._fed_at > self._watchdog:
            self.watchdog_ends += 1
            self._leave()
        self.after(0.01, self._watch)

    def hear(self, message: bytes, at: float) -> None:
        """A telegram of somebody else."""
        if not self.is_alive:
            return
        try:
            telegram = Telegram.parse(message)
        except BookViolation:
            self._forget_answer(message)
            return
        if not telegram.fc & 0x40 or telegram.sa in (self.address, 126, 127):
            return
        if telegram.da == book.BROADCAST:
            return
        if telegram.da != self.address:
            self._stored = None
            return
        self._hear_request(telegram, message, at)

    def _forget_answer(self, message: bytes) -> None:
        if message[:1] == bytes([book.SD4]):
            self._stored = None

    def _hear_request(self, telegram: Telegram, octets: bytes, at: float) -> None:
        asked = Asked(at, telegram)
        self.asked.append(asked)
        function = telegram.fc & 0x0F
        if self.temper.deaf_to:
            self.temper.deaf_to -= 1
            return
        if function == book.FDL_STATUS & 0x0F:
            self._stored = None
            self.send(Telegram(telegram.sa, self.address, book.OK).octets())
            return
        if function in (book.SDN_LOW & 0x0F, book.SDN_HIGH & 0x0F):
            return
        if telegram.sa == self.owner:
            self._fed_at = time.monotonic()
        answer = self._repeated(telegram, octets)
        asked.is_retry = answer is not None
        if answer is None:
            answer = self._answer(telegram)
            is_counted = bool(telegram.fc & (book.FRAME_COUNT | book.FRAME_COUNT_VALID))
            self._stored = (octets, answer) if is_counted else None
        if self.temper.loses_answers:
            self.temper.loses_answers -= 1
            return
        self.send(answer)

    def _repeated(self, telegram: Telegram, octets: bytes) -> bytes | None:
        """The stored answer, where the same request comes again with the same frame count bit."""
        if self._stored is None or not telegram.fc & book.FRAME_COUNT_VALID:
            return None
        return self._stored[1] if self._stored[0] == octets else None

    # --- Services

    def _answer(self, telegram: Telegram) -> bytes:
        sap = telegram.dsap
        rs = Telegram(telegram.sa, self.address, book.RS).octets()
        if telegram.fc & 0x0F not in (book.SRD_LOW & 0x0F, book.SRD_HIGH & 0x0F):
            return rs
        if sap in self.temper.refuse or (sap is None) != (telegram.ssap is None):
            return rs
        if sap == book.SLAVE_DIAG:
            return self._with_data(telegram, self._diagnosis(telegram.sa))
        if sap == book.GET_CFG:
            return self._with_data(telegram, self.configuration)
        is_owner = telegram.sa == self.owner
        if sap == book.SET_PRM and (self.state == WAIT_PRM or is_owner):
            self._set_prm(telegram)
            return bytes([book.SHORT_ACKNOWLEDGE])
        if sap == book.CHK_CFG and self.fault & PRM_FAULT and self.state == WAIT_PRM:
            return bytes([book.SHORT_ACKNOWLEDGE])
        if sap == book.CHK_CFG and self.state != WAIT_PRM and is_owner:
            self._chk_cfg(telegram.data)
            return bytes([book.SHORT_ACKNOWLEDGE])
        if sap == book.RD_INP and self.state == DATA_EXCH:
            return self._with_data(telegram, self.device.inputs(self.configuration))
        if sap is None and self.state == DATA_EXCH and is_owner:
            if len(telegram.data) not in (0, self.device.output_length(self.configuration)):
                self._leave()
                return rs
            self.device.output(telegram.data)
            return self._with_data(telegram, self.device.inputs(self.configuration))
        return rs

    def _with_data(self, telegram: Telegram, data: bytes) -> bytes:
        is_data = telegram.dsap is None
        self._is_pending = self._is_pending or (is_data and self._has_news())
        function = book.DATA_HIGH if is_data and self._is_pending else book.DATA_LOW
        saps = (telegram.ssap, telegram.dsap)
        return Telegram(telegram.sa, self.address, function, data, *saps).octets()

    def _has_news(self) -> bool:
        news = self.device.is_troubled()
        changed, self._told = news != getattr(self, "_told", False), news
        return changed

    def _diagnosis(self, master: int) -> bytes:
        if master == self.owner:
            self._is_pending = False
        first = self.fault | (0 if self.state == DATA_EXCH else NOT_READY)
        first |= EXT_DIAG if self.device.is_troubled() else 0
        second = ALWAYS | (PRM_REQ if self.state == WAIT_PRM else 0)
        second |= WATCHDOG_ON if self._watchdog is not None else 0
        head = bytes([first, second, 0, self.owner]) + self.device.ident.to_bytes(2, "big")
        return head + self.device.extended()

    def _set_prm(self, telegram: Telegram) -> None:
        octets = telegram.data
        self.fault = 0
        if len(octets) < 7:
            self._refuse(PRM_FAULT)
            return
        if octets[0] & 0x40:
            self.unlocked_by.append(telegram.sa)
            self._leave()
            return
        if not octets[0] & 0x80:
            return
        factors, has_watchdog = octets[1:3], bool(octets[0] & 0x08)
        is_right = int.from_bytes(octets[4:6], "big") == self.device.ident
        is_right = is_right and not (has_watchdog and 0 in factors)
        is_right = is_right and not self.temper.refuses_parameters
        if not is_right or not self.device.parameterize(octets[7:]):
            self._refuse(PRM_FAULT)
            return
        self.owner, self.state = telegram.sa, WAIT_CFG
        self.locked_by.append(telegram.sa)
        unit = 0.001 if len(octets) > 7 and octets[7] & 0x04 else 0.01
        self._watchdog = factors[0] * factors[1] * unit if has_watchdog else None
        self._fed_at = time.monotonic()

    def _chk_cfg(self, configuration: bytes) -> None:
        if configuration not in self.device.configurations:
            self._refuse(CFG_FAULT)
            return
        self.configuration, self.state = configuration, DATA_EXCH

    def _refuse(self, fault: int) -> None:
        self._leave()
        self.fault = fault

    def _leave(self) -> None:
        """Back to where it waits for parameters, and nobody's."""
        self.state, self.owner, self._watchdog = WAIT_PRM, book.NO_MASTER, None
        self._stored = None
