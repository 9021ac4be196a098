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
