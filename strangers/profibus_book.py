"""A PROFIBUS-DP master for one slave, written from the book and the manual alone.

It speaks raw octets over TCP or a serial line, a pty too: telegrams, frame count bit, Slave_Diag,
Set_Prm, Chk_Cfg, Data_Exchange and the other services of DP-V0. It shares no line with the slave it
judges. Octets of parameters and diagnosis are numbered from 1, as the manual does.

Whatever does not go by the book raises `BookViolation`, silence raises `Silence`, and the answers
RS ("no service activated") and NR ("no data") raise `Refused`; each says what was sent and what
came back.
"""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TextIO

import serial

# Delimiters
SD1, SD2, SD3, SD4, SHORT_ACKNOWLEDGE, END = 0x10, 0x68, 0xA2, 0xDC, 0xE5, 0x16
LENGTHS = {SD1: 6, SD3: 14, SD4: 3, SHORT_ACKNOWLEDGE: 1}
EXTENSION = 0x80

# Function codes of requests, with bit 6 set
SDA_LOW, SDN_LOW, SDA_HIGH, SDN_HIGH = 0x43, 0x44, 0x45, 0x46
FDL_STATUS, SRD_LOW, SRD_HIGH, IDENT, LSAP_STATUS = 0x49, 0x4C, 0x4D, 0x4E, 0x4F
FRAME_COUNT, FRAME_COUNT_VALID = 0x20, 0x10
# Function codes of responses
OK, RS, DATA_LOW, NO_DATA, DATA_HIGH = 0x00, 0x03, 0x08, 0x09, 0x0A
RESPONSES = {OK: "OK", RS: "RS", DATA_LOW: "DL", NO_DATA: "NR", DATA_HIGH: "DH"}

# Service access points
SET_SLAVE_ADD, RD_INP, RD_OUTP, GLOBAL_CONTROL = 0x37, 0x38, 0x39, 0x3A
GET_CFG, SLAVE_DIAG, SET_PRM, CHK_CFG = 0x3B, 0x3C, 0x3D, 0x3E
MASTER_SAP = 0x3E
BROADCAST = 127
NO_MASTER = 0xFF

# Global_Control commands
CLEAR, UNFREEZE, FREEZE, UNSYNC, SYNC = 0x02, 0x04, 0x08, 0x10, 0x20

# Configurations: words in (and out)
TWO_WORDS, TWO_WORDS_BOTH_WAYS, ONE_WORD, ONE_WORD_BOTH_WAYS = 0xD1, 0xF1, 0xD0, 0xF0


class BookViolation(Exception):
    """The slave sent something that the book does not allow here."""


class Silence(Exception):
    """No answer in time."""


class Refused(Exception):
    """The answer RS or NR; `function` says which."""

    def __init__(self, asked: bytes, function: int) -> None:
        self.function = function
        super().__init__(f"[{asked.hex(' ')}] was answered {RESPONSES[function]}")


@dataclass(frozen=True)
class Telegram:
    """A request or a response with its addresses; both service access points or none."""

    da: int
    sa: int
    fc: int
    data: bytes = b""
    dsap: int | None = None
    ssap: int | None = None

    def octets(self) -> bytes:
        """As it goes over the wire: SD1 where it carries nothing, else SD2."""
        extensions = bytes(sap for sap in (self.dsap, self.ssap) if sap is not None)
        da = self.da | (EXTENSION if self.dsap is not None else 0)
        sa = self.sa | (EXTENSION if self.ssap is not None else 0)
        return framed(bytes([da, sa, self.fc]) + extensions + self.data)

    @classmethod
    def parse(cls, octets: bytes) -> Telegram:
        """Reads SD1, SD2 or SD3; whatever is wrong with it is a violation."""
        if not octets or length_of(octets) != len(octets) or octets[0] not in (SD1, SD2, SD3):
            raise BookViolation(f"no telegram with addresses: {octets.hex(' ')}")
        body = octets[4 if octets[0] == SD2 else 1 : -2]
        if octets[-1] != END:
            raise BookViolation(f"a telegram ends with 16, got {octets.hex(' ')}")
        if octets[-2] != sum(body) & 0xFF:
            raise BookViolation(f"the FCS must be {sum(body) & 0xFF:02X}, got {octets.hex(' ')}")
        da, sa, fc, data = body[0], body[1], body[2], body[3:]
        saps: list[int | None] = []
        for address in (da, sa):
            if address & EXTENSION and not data:
                raise BookViolation(f"an address extension is missing in {octets.hex(' ')}")
            saps.append(data[0] if address & EXTENSION else None)
            data = data[1:] if address & EXTENSION else data
        return cls(da & 0x7F, sa & 0x7F, fc, data, saps[0], saps[1])

    @property
    def function(self) -> int:
        """The function code of a response."""
        return self.fc & 0x0F


def framed(body: bytes) -> bytes:
    """Delimiters and FCS around DA, SA, FC and what follows them."""
    tail = bytes([sum(body) & 0xFF, END])
    if len(body) == 3:
        return bytes([SD1]) + body + tail
    return bytes([SD2, len(body), len(body), SD2]) + body + tail


def framed_in_eight(body: bytes) -> bytes:
    """The same with SD3, for a body that carries eight octets."""
    assert len(body) == 11
    return bytes([SD3]) + body + bytes([sum(body) & 0xFF, END])


def token(da: int, sa: int) -> bytes:
    """A token: SD4 DA SA."""
    return bytes([SD4, da, sa])


def length_of(octets: bytes) -> int | None:
    """How long the telegram is that begins here; None where more must come before one can say."""
    start = octets[0]
    if start in LENGTHS:
        return LENGTHS[start]
    if start != SD2:
        raise BookViolation(f"no telegram starts with {start:02X}: {octets.hex(' ')}")
    if len(octets) < 4:
        return None
    if octets[1] != octets[2] or octets[3] != SD2 or not 4 <= octets[1] <= 249:
        raise BookViolation(f"the head of a telegram is 68 LE LE 68, got {octets.hex(' ')}")
    return octets[1] + 6


@dataclass
class Seen:
    """A telegram, or what was written at once, with the host's time in seconds."""

    at: float
    octets: bytes
    is_ours: bool = False

    def __str__(self) -> str:
        return self.octets.hex(" ").upper()


@dataclass
class Wire:
    """A line that carries octets; keeps all of both directions, one telegram a line, in `log`."""

    descriptor: int
    close: Callable[[], None]
    log: TextIO | None = None
    seen: list[Seen] = field(default_factory=list)
    _arrived: bytes = b""

    @classmethod
    def over_tcp(cls, host: str, port: int, log: TextIO | None = None) -> Wire:
        """Connects; each write leaves at once."""
        connection = socket.create_connection((host, port), timeout=5)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)
        return cls(connection.fileno(), connection.close, log)

    @classmethod
    def over_serial(cls, path: str, baud: int, log: TextIO | None = None) -> Wire:
        """Opens a serial line, 8 bits and even parity. A pty takes it and has no parity."""
        port = serial.Serial(path, baud, parity=serial.PARITY_EVEN, timeout=0)
        return cls(port.fileno(), port.close, log)

    def send(self, octets: bytes) -> Seen:
        """Writes octets, in one piece."""
        seen = self._note(Seen(time.time(), octets, is_ours=True))
        left = octets
        while left:
            select.select([], [self.descriptor], [], 5)
            left = left[os.write(self.descriptor, left) :]
        return seen

    def receive(self, seconds: float) -> Seen | None:
        """The next telegram, or None where none begins within `seconds`."""
        deadline = time.time() + seconds
        while True:
            length = length_of(self._arrived) if self._arrived else None
            if length is not None and len(self._arrived) >= length:
                octets, self._arrived = self._arrived[:length], self._arrived[length:]
                return self._note(Seen(time.time(), octets))
            left = deadline - time.time()
            readable, _, _ = select.select([self.descriptor], [], [], max(0.0, left))
            if readable:
                octets = os.read(self.descriptor, 4096)
                if not octets:
                    raise ConnectionError("the program has closed the line")
                self._arrived += octets
            elif left <= 0:
                if self._arrived:
                    piece, self._arrived = self._arrived, b""
                    raise BookViolation(f"a telegram broke off: {piece.hex(' ')}")
                return None

    def forget(self) -> None:
        """Drops what arrived before, so an old answer is never taken for a new one."""
        while self.receive(0) is not None:
            pass

    def _note(self, seen: Seen) -> Seen:
        self.seen.append(seen)
        if self.log is not None:
            self.log.write(f"({seen.at:.6f}) {'M' if seen.is_ours else 'S'} {seen}\n")
            self.log.flush()
        return seen


@dataclass(frozen=True)
class Parameters:
    """What Set_Prm carries: manual §6.1. `length` cuts it, so that each length can be tried."""

    steps: int = 8192
    total: int = 8192 * 65536
    counter_clockwise: bool = False
    class_2: bool = True
    scaling: bool = True
    commissioning: bool = False
    watchdog: tuple[int, int] | None = None
    watchdog_1_ms: bool = False
    sync: bool = False
    freeze: bool = False
    lock: bool = True
    unlock: bool = False
    min_tsdr: int = 11
    ident: int = 0x059B
    group: int = 0
    octet_1: int = 0
    octet_8: int = 0
    octet_9: int = 0
    reserved: bytes = bytes(8)
    length: int = 17

    def octets(self) -> bytes:
        """Octets 1 to `length`; `octet_1`, `octet_8` and `octet_9` add bits that have no name."""
        station = self.lock << 7 | self.unlock << 6 | self.sync << 5 | self.freeze << 4
        station |= (self.watchdog is not None) << 3 | self.octet_1
        factors = self.watchdog if self.watchdog is not None else (0, 0)
        operating = self.counter_clockwise | self.class_2 << 1 | self.commissioning << 2
        operating |= self.scaling << 3 | self.octet_9
        head = bytes([station, *factors, self.min_tsdr]) + self.ident.to_bytes(2, "big")
        user = bytes([self.group, self.watchdog_1_ms << 2 | self.octet_8, operating])
        values = self.steps.to_bytes(4, "big") + self.total.to_bytes(4, "big")
        octets = head + user + values + self.reserved
        return octets.ljust(self.length, b"\0")[: self.length]


@dataclass(frozen=True)
class Diagnosis:
    """The answer to Slave_Diag: manual §7."""

    octets: bytes

    @classmethod
    def parse(cls, octets: bytes) -> Diagnosis:
        """Octet 7 counts the octets from itself on."""
        if len(octets) < 6:
            raise BookViolation(f"a diagnosis has at least 6 octets, got {octets.hex(' ')}")
        extended = octets[6:]
        if extended and extended[0] != len(extended):
            raise BookViolation(
                f"octet 7 says {extended[0]}, but {len(extended)} octets follow octet 6"
            )
        if not octets[1] & 0x04:
            raise BookViolation(f"bit 2 of octet 2 is always 1, got {octets[1]:02X}")
        return cls(octets)

    def octet(self, number: int) -> int:
        """Octet `number`, from 1."""
        return self.octets[number - 1]

    def part(self, first: int, last: int) -> bytes:
        """Octets `first` to `last`."""
        if last > len(self.octets):
            raise BookViolation(f"no octet {last}: the diagnosis has {len(self.octets)} octets")
        return self.octets[first - 1 : last]

    def number(self, first: int, last: int) -> int:
        """Octets `first` to `last`, most significant first."""
        return int.from_bytes(self.part(first, last), "big")

    @property
    def head(self) -> bytes:
        """Octets 1 to 4: station status and locking master."""
        return self.octets[:4]

    @property
    def waits_for_parameters(self) -> bool:
        """Prm_Req."""
        return bool(self.octet(2) & 0x01)

    @property
    def is_not_ready(self) -> bool:
        """Station_Not_Ready."""
        return bool(self.octet(1) & 0x02)

    @property
    def has_extended(self) -> bool:
        """Ext_Diag: the encoder has something to tell."""
        return bool(self.octet(1) & 0x08)

    @property
    def alarms(self) -> int:
        """Octet 8."""
        return self.octet(8)

    @property
    def offset(self) -> int:
        """Octets 32 to 35, signed."""
        return int.from_bytes(self.part(32, 35), "big", signed=True)

    @property
    def steps(self) -> int:
        """Octets 40 to 43: steps per revolution as programmed."""
        return self.number(40, 43)

    @property
    def total(self) -> int:
        """Octets 44 to 47: total resolution as programmed."""
        return self.number(44, 47)


class Master:
    """A master with address `own` that speaks to the slave with address `slave`."""

    RESPONSE_SECONDS = 1.0

    def __init__(self, wire: Wire, own: int, slave: int) -> None:
        self.wire = wire
        self.own = own
        self.slave = slave
        # The frame count bit of the next request; None begins anew, with FCV = 0 and FCB = 1.
        self.frame_count: bool | None = None

    # --- Telegrams

    def request(
        self,
        data: bytes = b"",
        dsap: int | None = None,
        ssap: int | None = MASTER_SAP,
        function: int = SRD_HIGH,
    ) -> Telegram:
        """The next request: the frame count bit is the one due, and stays until an answer comes."""
        count = FRAME_COUNT if self.frame_count in (None, True) else 0
        count |= FRAME_COUNT_VALID if self.frame_count is not None else 0
        both = (dsap, ssap) if dsap is not None else (None, None)
        return Telegram(self.slave, self.own, function | count, data, *both)

    def answer_to(self, octets: bytes, seconds: float | None = None) -> bytes:
        """Writes octets and returns the next telegram that no master sent."""
        self.wire.forget()
        self.wire.send(octets)
        return self.next_answer(octets, seconds)

    def next_answer(self, asked: bytes, seconds: float | None = None) -> bytes:
        """The next telegram that no master sent."""
        seconds = self.RESPONSE_SECONDS if seconds is None else seconds
        deadline = time.time() + seconds
        while (left := deadline - time.time()) > 0:
            arrived = self.wire.receive(left)
            if arrived is not None and not is_of_a_master(arrived.octets):
                return arrived.octets
        raise Silence(f"no answer to [{asked.hex(' ')}] within {seconds:g} s")

    def expect_silence(self, octets: bytes, seconds: float = 0.06) -> None:
        """Writes octets that nobody may answer."""
        try:
            answer = self.answer_to(octets, seconds)
        except Silence:
            return
        raise BookViolation(f"[{octets.hex(' ')}] must not be answered, got {answer.hex(' ')}")

    def send_and_receive(self, request: Telegram, seconds: float | None = None) -> Telegram | None:
        """An SRD and its checked answer; None is the short acknowledge."""
        asked = request.octets()
        answer = self.answer_to(asked, seconds)
        self.toggle()
        return self.checked(request, answer)

    def toggle(self) -> None:
        """An answer came, so the next request has the other frame count bit."""
        self.frame_count = self.frame_count is False

    def checked(self, request: Telegram, answer: bytes) -> Telegram | None:
        """The answer where it is one to this request."""
        if answer == bytes([SHORT_ACKNOWLEDGE]):
            return None
        asked = request.octets().hex(" ")
        telegram = Telegram.parse(answer)
        if answer[0] == SD3:
            raise BookViolation(f"a slave sends SD1 or SD2, got {answer.hex(' ')} to [{asked}]")
        if telegram.fc not in RESPONSES:
            raise BookViolation(
                f"FC {telegram.fc:02X} is none of a slave: {answer.hex(' ')} to [{asked}]"
            )
        if (telegram.da, telegram.sa) != (request.sa, request.da):
            raise BookViolation(f"wrong addresses in {answer.hex(' ')}, the answer to [{asked}]")
        if telegram.function == RS:
            if answer[0] != SD1:
                raise BookViolation(f"RS is 10 DA SA 03 FCS 16, got {answer.hex(' ')} to [{asked}]")
            raise Refused(request.octets(), RS)
        if telegram.function == NO_DATA:
            raise Refused(request.octets(), NO_DATA)
        if (telegram.dsap, telegram.ssap) != (request.ssap, request.dsap):
            raise BookViolation(f"the SAPs of [{asked}] come back swapped, got {answer.hex(' ')}")
        return telegram

    def data_of(self, request: Telegram) -> Telegram:
        """An SRD that is answered with data."""
        answer = self.send_and_receive(request)
        if answer is None:
            raise BookViolation(f"data is due to [{request.octets().hex(' ')}], got E5")
        return answer

    def acknowledged(self, request: Telegram) -> None:
        """An SRD that is answered with the short acknowledge."""
        answer = self.send_and_receive(request)
        if answer is not None:
            raise BookViolation(
                f"E5 is due to [{request.octets().hex(' ')}], got {answer.octets().hex(' ')}"
            )

    def without_answer(self, data: bytes, dsap: int, da: int, function: int = SDN_HIGH) -> None:
        """An SDN."""
        telegram = Telegram(da, self.own, function, data, dsap, MASTER_SAP)
        self.wire.send(telegram.octets())

    # --- Services

    def fdl_status(self) -> None:
        """Asks whether the slave is there; the answer is 10 SA TS 00 FCS 16."""
        request = Telegram(self.slave, self.own, FDL_STATUS)
        wanted = Telegram(self.own, self.slave, OK).octets()
        answer = self.answer_to(request.octets())
        if answer != wanted:
            raise BookViolation(f"the FDL status is {wanted.hex(' ')}, got {answer.hex(' ')}")

    def slave_diag(self, function: int = SRD_HIGH) -> Diagnosis:
        """Slave_Diag."""
        answer = self.data_of(self.request(dsap=SLAVE_DIAG, function=function))
        if answer.function != DATA_LOW:
            raise BookViolation(f"a diagnosis comes with DL (08), got {answer.fc:02X}")
        return Diagnosis.parse(answer.data)

    def set_prm(self, parameters: Parameters) -> None:
        """Set_Prm."""
        self.acknowledged(self.request(parameters.octets(), SET_PRM))

    def unlock(self) -> None:
        """Set_Prm with Unlock alone, which keeps min T_SDR."""
        self.set_prm(Parameters(lock=False, unlock=True, min_tsdr=0, length=7))

    def chk_cfg(self, *configuration: int) -> None:
        """Chk_Cfg."""
        self.acknowledged(self.request(bytes(configuration), CHK_CFG))

    def get_cfg(self) -> bytes:
        """Get_Cfg."""
        return self.data_of(self.request(dsap=GET_CFG)).data

    def exchange(self, out: bytes = b"") -> Telegram:
        """Data_Exchange; the answer has DL, or DH while diagnosis is pending."""
        answer = self.data_of(self.request(out))
        if answer.function not in (DATA_LOW, DATA_HIGH):
            raise BookViolation(f"data comes with DL or DH, got {answer.octets().hex(' ')}")
        return answer

    def position(self, out: bytes = b"") -> int:
        """The position that Data_Exchange brings."""
        return int.from_bytes(self.exchange(out).data, "big")

    def rd_inp(self) -> bytes:
        """RD_Inp."""
        return self.data_of(self.request(dsap=RD_INP)).data

    def rd_outp(self) -> bytes:
        """RD_Outp."""
        return self.data_of(self.request(dsap=RD_OUTP)).data

    def global_control(self, command: int, group: int = 0, da: int = BROADCAST) -> None:
        """Global_Control; nobody answers."""
        self.without_answer(bytes([command, group]), GLOBAL_CONTROL, da)

    # --- What a master does with them

    def bring_up(
        self, parameters: Parameters | None = None, configuration: int = TWO_WORDS_BOTH_WAYS
    ) -> Diagnosis:
        """To data exchange by manual §5.2: diagnosis, parameters, configuration, diagnosis."""
        self.slave_diag()
        self.set_prm(parameters or Parameters())
        self.chk_cfg(configuration)
        diagnosis = self.slave_diag()
        if diagnosis.is_not_ready or diagnosis.waits_for_parameters:
            raise BookViolation(f"not ready for data exchange: {diagnosis.octets.hex(' ')}")
        if diagnosis.octet(4) != self.own:
            raise BookViolation(f"octet 4 is not the master's {self.own:02X}: {diagnosis.octets!r}")
        return diagnosis

    def preset(self, value: int, words: int = 2) -> tuple[int, int]:
        """Manual §7.4: the value with the top bit, then without; the positions of both answers."""
        size = 2 * words
        top = 1 << 8 * size - 1
        first = self.position((top | value).to_bytes(size, "big"))
        return first, self.position(value.to_bytes(size, "big"))


def is_of_a_master(octets: bytes) -> bool:
    """A token or a request: what other masters on the same line say."""
    if octets[0] == SD4:
        return True
    return octets[0] != SHORT_ACKNOWLEDGE and bool(Telegram.parse(octets).fc & 0x40)
