#!/usr/bin/env python3
"""Writes the seeds of the corpus: conversations as people in the field know them.

    fuzz/make-seeds.py            writes fuzz/corpus/*/seed-*

How octets become operations is said at the head of each body, in the tests of the crates."""

from pathlib import Path
from struct import pack

HERE = Path(__file__).parent / "corpus"


def write(target, name, octets):
    folder = HERE / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"seed-{name}").write_bytes(octets)


# --- the encoder: MAC ID 5, master 10 -------------------------------------------------------------

ON_LINE = b"\x82" + pack("<H", 2100)
TAKEN, REFUSED, ACKNOWLEDGE, HOLD = b"\x85", b"\x86", b"\x8D", b"\x8B"


def frame(message, text=""):
    data = bytes.fromhex(text)
    return bytes([len(data) << 3 | message]) + data


def wait(ms):
    return b"\x82" + pack("<H", ms)


def allocate(choice):
    return ON_LINE + frame(6, f"0A4B0301{choice:02X}0A")


def ask(text):
    """An explicit request of master 10, in fragments where it needs them."""
    body = bytes.fromhex(text)
    if len(body) <= 7:
        return frame(4, "0A" + text)
    pieces = [body[i : i + 6] for i in range(0, len(body), 6)]
    kinds = [0] + [0x40] * (len(pieces) - 2) + [0x80]
    return b"".join(
        frame(4, f"8A{kind | i:02X}{piece.hex()}") for i, (kind, piece) in enumerate(zip(kinds, pieces))
    )


def shaft(code, flags=0):
    return b"\x8A" + pack("<IB", code, flags)


def power_cut(octets):
    return bytes([0x87, octets])


def record(flags=1, n=8192, total=1 << 29, preset=0, offset=0, k0=0, delta=1, k=0, r=0):
    return pack("<BIIIiqIqI", flags, n, total, preset, offset, k0, delta, k, r) + bytes([1] + [0] * 23)


D29, D13 = b"\x01\x05", b"\x00\x05"
POLL = ask("1005010900 00".replace(" ", "")) + ask("100502096400") + frame(5)
CHANGE = ask("1005040964 00".replace(" ", "")) + shaft(1000) + wait(5) + shaft(2000, 2) + wait(50)
NAME = ask("0E010107") + ACKNOWLEDGE * 4
SAVE = ask("162F01")

DEVICE = {
    "on-line": D29 + ON_LINE + b"\x80" + pack("<H", 0x42F) + b"\x07\x00\xD4\x01\x01\x02\x03\x04",
    "duplicate-while-checking": D29 + b"\x3F\x80\xD4\x01\x01\x02\x03\x04" + wait(5000),
    "poll": D29 + allocate(3) + POLL + shaft(4711) + frame(5) * 3 + wait(500) + frame(5),
    "poll-times-out": D29 + allocate(3) + POLL + wait(12000) + frame(5) + ask("050502"),
    "assembly-2": D29 + allocate(3) + ask("1005020E20042402") + TAKEN + POLL,
    "long-path": D29 + allocate(3) + ask("1005020E200424023003") + TAKEN + ask("0E05020E") + POLL,
    "change-of-state": D29 + allocate(0x11) + CHANGE + frame(2) + wait(200),
    "change-unacknowledged": D29 + allocate(0x51) + CHANGE + wait(1000),
    "cyclic": D29 + allocate(0x21) + ask("100504090A00") + (wait(10) + frame(2)) * 5 + wait(300),
    "inhibit": D29 + allocate(0x51) + ask("100504110A00") + CHANGE,
    "fragmented-name": D29 + allocate(1) + NAME,
    "fragments-not-acknowledged": D29 + allocate(1) + ask("0E010107") + wait(2500),
    "settings": D29 + allocate(1) + ask("102F010710270000") + ask("102F010840420F00") + NAME,
    "preset": D29 + allocate(3) + shaft(100) + ask("102F010A2A000000") + POLL + ask("0E2F010A"),
    "save-and-power-cut": D29 + allocate(1) + ask("102F01071027 0000".replace(" ", "")) + SAVE + power_cut(40) + allocate(1),
    "save": D29 + allocate(1) + ask("102F010B05000000") + SAVE + TAKEN + power_cut(0) + allocate(1) + ask("0E2F010B"),
    "save-refused": D29 + allocate(1) + SAVE + REFUSED + SAVE + wait(6000) + TAKEN,
    "reset-0": D29 + allocate(1) + ask("050101") + ON_LINE,
    "reset-1": D29 + allocate(1) + ask("05010101") + TAKEN + ON_LINE,
    "deferred-delete": D29 + allocate(3) + ask("1005010C03") + ask("100502090000") + wait(11000) + ask("0E050101"),
    "release": D29 + allocate(3) + frame(6, "0A4C030103") + frame(6, "0B4B0301030B"),
    "stranger": D29 + allocate(1) + frame(6, "0B4B0301030B") + frame(4, "0B0E010101"),
    "bus-off": D29 + allocate(1) + ask("1003010301") + TAKEN + b"\x88" + wait(100) + b"\x89" + allocate(1),
    "plug-out-and-in": D29 + allocate(3) + POLL + b"\x8E" + wait(3000) + b"\x8F" + allocate(3) + POLL,
    "plug-out-after-bus-off": D29 + allocate(1) + b"\x88\x8E\x8F" + allocate(1),
    "heartbeat": D29 + allocate(1) + ask("1001010A01") + TAKEN + wait(3500),
    "held-medium": D29 + allocate(3) + POLL + HOLD + frame(5) * 2 + ask("0E010101") + wait(20) + HOLD,
    "switches-at-70": b"\x01\x46" + ON_LINE + b"\x8C\x05" + power_cut(0) + allocate(1),
    "cell-low": b"\x04\x05" + allocate(0x51) + ask("1005040E20042402") + TAKEN + CHANGE + shaft(5, 1),
    "singleturn": D13 + allocate(3) + ask("102F010764000000") + POLL + shaft(5000) + frame(5),
    "parameters": D29 + allocate(1) + ask("0E0F0007") + ask("100F050110270000") + ask("010F01") + ACKNOWLEDGE * 12,
    "record-with-reference": b"\x81\x05" + record(5, 3600, 360000, k=3, r=99) + allocate(3) + POLL + shaft(1 << 28) + TAKEN,
    "record-nobody-can-use": b"\x81\x05" + record(1, 0, 0) + allocate(1),
    "late": D29 + allocate(3) + POLL + b"\x84" + pack("<H", 6000) + frame(5),
}

for name, octets in DEVICE.items():
    write("device", name, octets)

# --- the memory -----------------------------------------------------------------------------------

WHOLE = b"\x00" + record()
OTHER = b"\x00" + record(2, 10000, 1_000_000, preset=5, offset=-5, delta=9)
for name, octets in {
    "first": b"\x01" + WHOLE,
    "alternating": b"\x01" + WHOLE + OTHER + WHOLE + OTHER,
    "first-write-cut": b"\x01\x01\x14" + record(),
    "second-write-cut": b"\x01" + WHOLE + b"\x01\x30" + record(2),
    "third-write-cut": b"\x01" + WHOLE + OTHER + b"\x01\x59" + record(2) + WHOLE,
    "not-cut": b"\x01" + WHOLE + b"\x01\x5C" + record(2),
    "bit-flips": b"\x01" + WHOLE + b"\x03\x00\x45\x00",
    "both-damaged": b"\x01" + WHOLE + OTHER + b"\x03\x00\x45\x00\x03\x01\x99\x00" + OTHER,
    "erased": b"\x01\x02\x00\x5C" + b"\xFF" * 92 + b"\x02\x01\x5C" + b"\x00" * 92,
    "newer-version": b"\x01\x02\x00\x10CWKR\x02\x00\x5C\x00" + bytes(8),
    "sequence-wraps": b"\x01\x04" + pack("<IB", 0xFFFFFFFF, 1) + record() + OTHER + WHOLE,
    "same-sequence": b"\x01" + b"".join(b"\x04" + pack("<IB", 7, s) + record(s) for s in (0, 1)) + WHOLE,
    "half-way-round": b"\x01" + b"".join(b"\x04" + pack("<IB", s << 31, s) + record(s) for s in (0, 1)),
    "reference": b"\x01\x00" + record(5, 3600, 360_000, k=-4, r=1 << 28),
    "singleturn": b"\x00\x00" + record(1, 100, 100, delta=100),
}.items():
    write("memory", name, octets)

# --- the scanner ----------------------------------------------------------------------------------
# Slaves 5, 6, 7 and 63 have places 0 to 3; 40+place: the slave answers what it was asked.

SCANNER_ON_LINE = b"\x88" + pack("<H", 2100)


def good(place, text=""):
    data = bytes.fromhex(text)
    return bytes([0x80 | place, len(data)]) + data


def configured(place, size=4):
    """Allocate, deferred delete, produced size, consumed size, rate."""
    return good(place, "00") + good(place) + good(place, f"{size:02X}00") + good(place, "0000") + good(place, "C800")


def producing(place, size=4):
    """Allocate, deferred delete, produced size, rate."""
    return good(place, "00") + good(place) + good(place, f"{size:02X}00") + good(place, "E803")


def production(place, text="00100000"):
    data = bytes.fromhex(text)
    return bytes([0x94 | place, len(data)]) + data


def responses(place, text="00100000"):
    data = bytes.fromhex(text)
    return bytes([0x84 | place, len(data)]) + data


for name, octets in {
    "nobody-there": b"\x01\x00" + SCANNER_ON_LINE + b"\x88" + pack("<H", 5000),
    "one-slave": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + responses(0) * 3,
    "four-slaves": b"\x0F\x00" + SCANNER_ON_LINE + b"".join(configured(p) for p in range(4)) + b"".join(responses(p) for p in range(4)) * 3,
    "slave-lost": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + responses(0) + b"\x88" + pack("<H", 3000) + configured(0),
    "allocated-already": b"\x01\x00" + SCANNER_ON_LINE + b"\x8C\x00\x0B\x02" + good(0) + good(0) + configured(0),
    "another-device": b"\x11\x00" + SCANNER_ON_LINE + good(0, "00") + good(0, "0100") + b"\x88" + pack("<H", 3000),
    "right-device": b"\x11\x00" + SCANNER_ON_LINE + good(0, "00") + good(0, "D401") + good(0, "0A00") + good(0) + good(0, "0400") + good(0, "6400"),
    "slave-boots": b"\x03\x00" + SCANNER_ON_LINE + configured(0) + b"\x8D\x2F\x04\x07\x00\xD4\x01\x01\x02\x03\x04" + b"\x88" + pack("<H", 2000) + configured(0),
    "own-mac-taken": b"\x01\x00\x8D\x0F\x04\x07\x80\xD4\x01\x01\x02\x03\x04" + SCANNER_ON_LINE,
    "own-mac-defended": b"\x01\x00" + SCANNER_ON_LINE + b"\x8D\x0F\x04\x07\x00\xD4\x01\x01\x02\x03\x04",
    "request": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + b"\x8E\x00\x04\x0E\x01\x01\x07" + good(0, "41") + responses(0),
    "long-request": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + b"\x8E\x00\x14\x10\x05\x02\x0E" + bytes(16) + b"\x8F\x00" * 4 + good(0),
    "fragmented-response": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + b"\x8E\x00\x04\x0E\x01\x01\x07" + b"\x90\x00\x00\x06\x8E\x12AMG " + b"\x90\x00\x41\x0611 - M" + b"\x90\x00\x82\x03ult",
    "request-without-answer": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + b"\x8E\x00\x04\x0E\x01\x01\x07" + (responses(0) + b"\x88\x64\x00") * 20,
    "bus-off": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + b"\x91\x88\x64\x00\x92" + SCANNER_ON_LINE,
    "change-of-state": b"\x41\x00" + SCANNER_ON_LINE + producing(0) + (production(0) + b"\x88\x64\x00") * 3,
    "cyclic": b"\x82\x00" + SCANNER_ON_LINE + producing(1) + production(1) * 2 + b"\x88" + pack("<H", 3000),
    "explicit-only": b"\x84\x00" + SCANNER_ON_LINE + good(2, "00") + b"\x88" + pack("<H", 2600) + good(2, "03") + b"\x88" + pack("<H", 9000),
    "four-kinds": b"\x8F\x05" + SCANNER_ON_LINE + configured(0) + producing(1) + good(2, "00") + good(3, "00") + good(3) + good(3, "0400") + good(3, "0000") + good(3, "0400") + good(3) + good(3, "C800") + good(3, "E803") + responses(3) + production(3),
    "no-time-outs": b"\xC1\x05" + SCANNER_ON_LINE + good(0, "00") + good(0) + good(0, "0400") + good(0, "0000") + good(0, "0000") + responses(0) + b"\x88" + pack("<H", 2000),
    "long-output": b"\x01\x05\x9A\x00\x14" + bytes(20) + SCANNER_ON_LINE + good(0, "00") + good(0) + good(0, "0400") + good(0, "1400") + good(0, "C800") + responses(0) * 2,
    "long-input": b"\x01\x05" + SCANNER_ON_LINE + configured(0, 10) + responses(0, "0001020304050607") + responses(0, "81080900"),
    "scan": b"\x01\x00" + SCANNER_ON_LINE + b"\x9C\x00" + b"\x88" + pack("<H", 5000) + configured(0) + b"\x9C\x01" + b"\x88" + pack("<H", 7000),
    "remove-and-add": b"\x03\x00" + SCANNER_ON_LINE + configured(0) + b"\x98\x00" + good(0) * 2 + b"\x98\x01\x99\x01\x40\x99\x00\x00" + configured(0),
    "cancel": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + b"\x8E\x00\x04\x0E\x01\x01\x07\x9B\x8E\x00\x04\x0E\x01\x01\x01" + good(0, "D401") + b"\x93",
    "begins-anew": b"\x01\x00\x8D\x0F\x04\x07\x80\xD4\x01\x01\x02\x03\x04\x9D" + SCANNER_ON_LINE + configured(0),
    "slave-suspected": b"\x01\x00" + SCANNER_ON_LINE + configured(0) + responses(0) + b"\x9E\x00" + b"\x88" + pack("<H", 300) + configured(0),
    "pauses": b"\x0F\x0A" + SCANNER_ON_LINE + configured(0) + (responses(0) + b"\x88\x0A\x00") * 5,
}.items():
    write("scanner", name, octets)

# --- the PROFIBUS encoder: slave 7, masters 2 and 3 -------------------------------------------------

def slave(product=1, link=6):
    """AMG 11 P 29 at 1.5 Mbit/s where the link counts bits."""
    return bytes([product, link])


def asks(service, text=""):
    """0 Data_Exchange, 1 Slave_Diag, 2 Get_Cfg, 3 Set_Prm, 4 Chk_Cfg, 5 RD_Inp, 6 RD_Outp, 7 Global_Control."""
    data = bytes.fromhex(text)
    length = (len(data) - 1) // 2 if service == 3 else len(data)
    return bytes([length << 3 | service]) + data


def any_telegram(to, source, code, text=""):
    data = bytes.fromhex(text)
    return bytes([0x8D, to, source, code, len(data)]) + data


def octets_come(text, pause=True):
    data = bytes.fromhex(text)
    return bytes([0x80 if pause else 0x81, len(data)]) + data


P29, P13, CELL, CONVERTER, SHORT_WORD, ON_A_PC, SEARCHING = (
    slave(), slave(0), slave(3), slave(12), slave(12, 0x46), slave(1, 0x26), slave(1, 0x16)
)
FULL_RANGE = "B801C80B059B00000A0000200020000000"
MANUAL = "B801C80B059B00000A00000E10000E1000"
RUNNING = asks(3, MANUAL) + asks(4, "F1") + asks(1) + asks(0, "00000000")
ONE_WORD = asks(3, MANUAL) + asks(4, "F0") + asks(1) + asks(0, "0000")
PRESET = asks(0, "80001234") + asks(0, "00001234")
AGAIN, HEARS_ITSELF, BROKEN, MEDIUM = b"\x89", b"\x8B", b"\x88", b"\x8F"
FDL_STATUS = any_telegram(7, 2, 0x49)

for name, octets in {
    "bring-up": P29 + FDL_STATUS + asks(1) + asks(2) + asks(3, FULL_RANGE) + asks(4, "F1") + asks(1) + asks(0, "00000000") * 3,
    "one-call": P29 + b"\x8E\xF1" + asks(0, "00000000"),
    "preset": P29 + RUNNING + PRESET + TAKEN + asks(1) + shaft(4711) + asks(0, "00001234"),
    "preset-out-of-range": P29 + RUNNING + asks(0, "FFFFFFFF") + asks(0, "00000000") + asks(1) + PRESET,
    "preset-repeated": P29 + RUNNING + asks(0, "80000007") + AGAIN + shaft(99) + AGAIN,
    "preset-and-power-cut": P29 + RUNNING + PRESET + power_cut(40) + RUNNING,
    "preset-refused-by-the-memory": P29 + RUNNING + PRESET + REFUSED + PRESET + wait(61000) + TAKEN,
    "one-word": P13 + asks(3, "B801C80B059B000002") + asks(4, "F0") + asks(1) + asks(0, "0000") + asks(0, "8005"),
    "one-word-of-29-bits": P29 + ONE_WORD + asks(0, "8005"),
    "class-1": P29 + asks(3, "B801C80B059B00") + asks(4, "D1") + asks(1) + asks(0) * 3,
    "ccw": P29 + asks(3, "B801C80B059B00000B00000E10000E1000") + asks(4, "F1") + shaft(5, 2) + asks(0, "00000000") + wait(20),
    "parameters-refused": P29 + asks(3, "B801C80B059B00000A0000200120000000") + asks(4, "F1") + asks(1),
    "wrong-ident-number": P29 + asks(3, "B801C80B059C00") + asks(4, "F1") + asks(1),
    "dp-v1": P29 + asks(3, "B801C80B059B00800A") + asks(1),
    "configuration-refused": P29 + asks(3, MANUAL) + asks(4, "F1F1") + asks(1),
    "watchdog": P29 + asks(3, "8801010B059B00040A0000200020000000") + asks(4, "F1") + asks(0, "00000000") + wait(2) + asks(1),
    "sync": P29 + RUNNING + asks(7, "2000") + asks(0, "80000001") + asks(7, "2000") + asks(0, "00000000") + asks(7, "1000"),
    "freeze": P29 + RUNNING + asks(7, "0800") + shaft(1000) + asks(0, "00000000") + asks(7, "0800") + asks(7, "0400") + asks(5),
    "clear": P29 + RUNNING + asks(0, "80000001") + asks(7, "0200") + asks(0, "80000002") + asks(6),
    "lost-answers": P29 + RUNNING + MEDIUM + asks(0, "00000000") + AGAIN * 2 + MEDIUM + AGAIN + FDL_STATUS,
    "own-echo": P29 + RUNNING + HEARS_ITSELF + asks(1) + HEARS_ITSELF,
    "two-masters": P29 + RUNNING + any_telegram(0x87, 0x83, 0x5D, "3D3E" + FULL_RANGE) + any_telegram(0x87, 0x83, 0x5C, "3C3E") + any_telegram(7, 3, 0x7D, "00000000"),
    "unlock": P29 + RUNNING + asks(3, "4000000B059B00") + any_telegram(0x87, 0x83, 0x5D, "3D3E" + FULL_RANGE),
    "token-between": P29 + asks(1) + octets_come("DC0203") + AGAIN + octets_come("DC0302"),
    "another-station": P29 + asks(1) + any_telegram(8, 2, 0x49) + octets_come("100208000A16") + AGAIN,
    "broken": P29 + RUNNING + octets_come("680707680702") + BROKEN + octets_come("5D0000000066 16".replace(" ", ""), False) + b"\x83\x64\x00" + asks(0, "00000000"),
    "cut-off": P29 + octets_come("6805056887826C") + wait(1) + asks(1),
    "in-pieces": ON_A_PC + octets_come("680505688782") + octets_come("6C3C3EEF16", False) + RUNNING,
    "two-in-one-piece": ON_A_PC + octets_come("DC0202100702495216"),
    "sd3": P29 + octets_come("A207024D0000000000000000" + "5616"),
    "half-extended": P29 + any_telegram(0x87, 2, 0x5D, "3C") + any_telegram(7, 0x82, 0x5D, "3E"),
    "search": SEARCHING + wait(200) + FDL_STATUS * 2 + RUNNING + wait(1500) + FDL_STATUS + asks(1),
    "alarm": P29 + RUNNING + shaft(0, 2) + wait(1) + shaft(100_000, 2) + wait(2) + asks(0, "00000000") + asks(1) + asks(0, "00000000") + wait(2600) + asks(0, "00000000"),
    "cell-low": CELL + RUNNING + shaft(0, 1) + asks(0, "00000000") + asks(1) + shaft(0, 0) + asks(0, "00000000"),
    "line-fault": CONVERTER + shaft(0, 4) + RUNNING + shaft(5, 0) + asks(0, "00000000") + shaft(5, 4) + wait(3) + asks(1) + shaft(6, 8) + asks(0, "00000000"),
    "short-word": SHORT_WORD + RUNNING + shaft((1 << 25) - 1) + asks(0, "00000000") + shaft(0) + PRESET,
    "switches": P29 + b"\x8C\x02" + power_cut(0) + asks(1) + RUNNING + b"\x8C\x63" + power_cut(0) + RUNNING,
    "record-with-turns": b"\x81\x06" + record(5, 3600, 360000, k=3, r=99) + RUNNING + shaft(1 << 28) + TAKEN,
    "record-nobody-can-use": b"\x81\x06" + record(1, 0, 0) + RUNNING + PRESET + TAKEN,
    "late": P29 + RUNNING + b"\x84" + pack("<H", 6000) + asks(0, "00000000"),
}.items():
    write("profibus_slave", name, octets)

# --- the PROFIBUS master: master 2, slaves 7 to 9 ---------------------------------------------------

MASTER = b"\x06"
BY_ITSELF, AS_IT_SHOULD, SHORT, SILENT = b"\x16", b"\x62", b"\x60", b"\x64"


def data(text, high=False):
    octets = bytes.fromhex(text)
    return bytes([0x20 * high | len(octets)]) + octets


def bits(count):
    return b"\x83" + pack("<H", count)


for name, octets in {
    "bring-up": BY_ITSELF + wait(100),
    "slow": b"\x10" + wait(5000),
    "fast": b"\x19" + wait(20),
    "nobody-there": MASTER + wait(100),
    "answers-one-by-one": MASTER + (bits(400) + AS_IT_SHOULD) * 60,
    "wrong-ident-number": MASTER + (bits(400) + data("42050002059C")) * 10,
    "prm-fault": MASTER + (bits(400) + AS_IT_SHOULD + bits(400) + data("420500FF059B")) * 10,
    "cfg-fault": MASTER + (bits(400) + AS_IT_SHOULD + bits(400) + data("060500FF059B")) * 10,
    "of-another-master": MASTER + (bits(400) + data("000C0003059B")) * 10,
    "not-ready": MASTER + (bits(400) + data("020C0002059B")) * 20,
    "short-diagnosis": MASTER + (bits(400) + data("0205")) * 5,
    "diagnosis-without-length": BY_ITSELF + wait(50) + SILENT + (bits(300) + data("080C0002059B 00 00".replace(" ", ""), True)) * 8,
    "high-priority": BY_ITSELF + wait(50) + SILENT + bits(300) + data("00001234", True) + SILENT + wait(5),
    "wrong-length": BY_ITSELF + wait(50) + SILENT + (bits(300) + data("001234")) * 6,
    "refused": BY_ITSELF + wait(50) + SILENT + (bits(300) + b"\x61\x03") * 6 + SILENT + wait(50),
    "no-resource": BY_ITSELF + wait(50) + SILENT + (bits(300) + b"\x61\x02") * 6,
    "acknowledges-everything": MASTER + (bits(400) + SHORT) * 12,
    "lost-and-back": BY_ITSELF + wait(50) + SILENT + wait(200) + SILENT + wait(100),
    "restarts": BY_ITSELF + wait(50) + b"\x63\x01" + wait(50) + b"\x63\x02" + wait(50),
    "outputs": BY_ITSELF + wait(50) + b"\x86\x07\x80" + wait(5) + b"\x86\x0A\x00" + b"\x87\x08" + wait(5),
    "own-address": BY_ITSELF + wait(50) + b"\x89\x07\x02\x49" + wait(1500),
    "another-master-joins": BY_ITSELF + wait(20) + b"\x89\x02\x05\x49" + b"\x88\x02\x05" + bits(500) + b"\x88\x05\x05" * 3 + wait(50),
    "token-to-nobody": MASTER + b"\x88\x7F\x02" + b"\x88\xFF\xFF" + wait(20),
    "broken": BY_ITSELF + wait(20) + SILENT + bits(100) + b"\x85" + octets_come("680707680702") + b"\x85" + bits(300) + SILENT + wait(50),
    "in-pieces": MASTER + bits(400) + octets_come("680B0B68", False) + bits(3) + octets_come("8287083E3C020500FF059B1116", False) + wait(20),
    "garbage": BY_ITSELF + octets_come("00112233445566778899AABBCCDDEEFF" * 8) + wait(10),
    "late": BY_ITSELF + wait(20) + b"\x84" + pack("<H", 3000) + wait(20),
    "to-another": MASTER + (bits(400) + b"\x42\x00\x05") * 5,
}.items():
    write("profibus_master", name, octets)

# --- SLCAN ----------------------------------------------------------------------------------------

for name, text in {
    "session": "\x07\r\r\rV\rN\rS4\rZ0\rO\rt42D0\rF\rC\r",
    "pieces": "\x00S6\rO\rt42F700D40101020304\rT0000042D0\rr42D4\rR0000042D8\rC\r",
    "listen": "\x1fL\rt42D0\rC\rO\rt42D0\r",
    "timestamps": "\x03Z1\rO\rt3C5400100000\r",
    "refused": "\x05t42D0\rS9\rO\rO\rS4\rt42D9\rt8000\rX1\rQ0\rM00000000\rm00000000\rs031C\r",
    "line-feeds": "\x02O\r\nt42D0\r\nC\r\n",
    "too-long": "\x02O\r" + "t" * 60 + "\rt42D0\r",
    "python-can": "\x10C\rS6\rO\rt42E60A4B0301030A\rt42D0\rC\r",
    "lower-case": "\x01O\rt3c54aabbccdd\rT1fffffff0\rT200000000\r",
    "bells": "\x01O\r\x07\rt42D\x070\r",
    "nothing-but-ends": "\x08" + "\r" * 40,
}.items():
    write("slcan_adapter", name, text.encode("latin-1"))

for name, text in {
    "session": "\r\r\rV1013\rNCW01\rz\rt3C5400100000\rZ\rF00\r",
    "refused": "\x07\x07\r\x07",
    "timestamps": "t3C540010000012AB\rt3C5012AB\rT0000042D0EA5F\r",
    "garbage": "hello\rt3C520102EA\rt3C\x07z\r",
    "line-feeds": "z\r\nt42\nD0\r\n",
    "too-long": "t" * 60 + "\rt42D0\r",
    "remote": "r42D4\rR0000042D8\rr42D41234\r",
    "half": "t3C540010",
    "lower-case": "t3c54aabbccdd\rT1fffffff0\rT200000000\r",
    "slcand": "\rt42F700D40101020304\rt42F700D40101020304\r",
    "ends": "\r" * 12,
}.items():
    write("slcan_client", name, text.encode("latin-1"))
