"""Lets strangers read our captures: python-can the text formats, tshark the pcapng of both buses.

Usage: captures.py FOLDER    judge what `make_samples FOLDER` wrote

make_samples is an example of codewheel-capture: our own devices and masters in virtual time, the same
traffic in every format. python-can must find the same frames in each of them, with their times and
directions. tshark must know every CAN frame as a DeviceNet message, and with our dissector
(docs/wireshark) name every PROFIBUS telegram, also some that are written here by hand.
"""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import can
from can.io import ASCReader, CanutilsLogReader, TRCReader

LUA = Path(__file__).parent.parent / "docs/wireshark/codewheel_profibus.lua"
LINKTYPE_USER0 = 147
IDENT_NUMBER = 0x059B

# What tshark must see of the DeviceNet session.
DEVICENET = (
    "Duplicate MAC ID Check Messages",
    "Group 2 Only Unconnected Explicit Request Messages",
    "Master's Explicit Request Messages",
    "Slave's Explicit/Unconnected Response Messages",
    "Master's I/O Poll Command/COS/Cyclic Messages",
    "Slave's I/O Poll Response or COS/Cyclic Ack Message",
    "Slave's I/O Change of State or Cyclic Message",
    "Master's Change of State or Cyclic Acknowledge Message",
)
# What the dissector must name of the PROFIBUS session.
SERVICES = (
    "Slave_Diag",
    "Set_Prm",
    "Chk_Cfg",
    "Data_Exchange",
    "Global_Control",
    "FDL status",
    "token",
)


@dataclass(frozen=True)
class Frame:
    """A CAN frame as a stranger read it."""

    microseconds: int
    identifier: int
    is_extended: bool
    is_received: bool
    data: bytes


def fail(sentence: str) -> None:
    """Ends with what is wrong."""
    raise SystemExit(f"captures.py: {sentence}")


def expect(condition: bool, sentence: str) -> None:
    """Ends with `sentence` unless `condition` holds."""
    if not condition:
        fail(sentence)


def frame_of(message: can.Message) -> Frame:
    """What python-can read."""
    return Frame(
        round(message.timestamp * 1_000_000),
        message.arbitration_id,
        message.is_extended_id,
        message.is_rx,
        bytes(message.data),
    )


def tshark(capture: Path, fields: tuple[str, ...], *options: str) -> list[list[str]]:
    """The fields of every packet."""
    command = ["tshark", "-n", "-r", str(capture), *options, "-T", "fields"]
    command += [word for field in fields for word in ("-e", field)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    expect(done.returncode == 0, f"tshark failed with {done.returncode}:\n{done.stderr}")
    expect("Lua" not in done.stderr, f"tshark complains about the dissector:\n{done.stderr}")
    return [line.split("\t") for line in done.stdout.splitlines()]


def python_can_reads_every_text_format(folder: Path) -> list[Frame]:
    """The same frames in each of them; gives those."""
    log = [frame_of(message) for message in CanutilsLogReader(folder / "devicenet.log")]
    expect(len(log) > 1_000, f"the log has {len(log)} frames")
    # The date of an .asc is UTC, and python-can takes it for the time of the place.
    asc_reader = ASCReader(folder / "devicenet.asc", relative_timestamp=False)
    asc = [frame_of(message) for message in asc_reader]
    trc = [frame_of(message) for message in TRCReader(folder / "devicenet.trc")]
    for name, frames in (("asc", asc), ("trc", trc)):
        expect(len(frames) == len(log), f"the .{name} has {len(frames)} of {len(log)} frames")
        for one, other in zip(log, frames, strict=True):
            # A float of seconds since 1970 has no more than a microsecond.
            near = abs(one.microseconds - other.microseconds) <= 1
            same = (one.identifier, one.is_extended, one.is_received, one.data) == (
                other.identifier,
                other.is_extended,
                other.is_received,
                other.data,
            )
            expect(near and same, f"the .{name} has {other} where the log has {one}")
    print(f"  python-can reads {len(log)} frames, the same ones, from .log, .asc and .trc")
    return log


def tshark_knows_every_frame(folder: Path, log: list[Frame]) -> None:
    """As a DeviceNet message, at its time."""
    fields = ("frame.time_epoch", "can.id", "can.len", "frame.protocols", "_ws.col.Info")
    options = ("-d", "can.subdissector,devicenet")
    packets = tshark(folder / "devicenet.pcapng", fields, *options)
    expect(len(packets) == len(log), f"the .pcapng has {len(packets)} of {len(log)} frames")
    names: Counter[str] = Counter()
    for frame, (epoch, identifier, length, protocols, info) in zip(log, packets, strict=True):
        seconds, nanoseconds = epoch.split(".")
        microseconds = int(seconds) * 1_000_000 + int(nanoseconds) // 1_000
        same = (microseconds, int(identifier), int(length)) == (
            frame.microseconds,
            frame.identifier,
            len(frame.data),
        )
        expect(same, f"tshark has {epoch} {identifier} where the log has {frame}")
        known = not frame.data or protocols.endswith("can:devicenet")
        expect(known, f"tshark takes {frame} for {protocols}")
        names[info] += 1
    for name in DEVICENET:
        expect(names[name] > 0, f"tshark saw no '{name}'")
    unknown = set(names) - set(DEVICENET)
    expect(not unknown, f"tshark saw what should not be there: {unknown}")
    print(f"  tshark knows all of them in the .pcapng, by {len(names)} names")


DISSECTED = (
    "_ws.col.Info",
    "codewheel_profibus.service",
    "codewheel_profibus.position",
    "codewheel_profibus.flag",
    "codewheel_profibus.value",
    "frame.packet_flags_symbol_error",
    "_ws.expert.message",
    "frame.len",
)


def dissect(capture: Path) -> list[dict[str, str]]:
    """What our dissector says of every telegram."""
    packets = tshark(capture, DISSECTED, "-X", f"lua_script:{LUA}")
    return [dict(zip(DISSECTED, packet, strict=True)) for packet in packets]


def telegrams_of(log: Path) -> list[tuple[bytes, bool]]:
    """The octets of a .log, and whether they were intact."""
    telegrams = []
    for line in log.read_text().splitlines():
        words = line.split()[2:]
        octets = bytes.fromhex("".join(word for word in words if word not in "T!"))
        telegrams.append((octets, "!" not in words))
    return telegrams


def the_dissector_names_every_telegram(folder: Path) -> None:
    """Services, positions, parameters, diagnoses; and what was disturbed is marked."""
    telegrams = telegrams_of(folder / "profibus.log")
    packets = dissect(folder / "profibus.pcapng")
    expect(len(packets) == len(telegrams), f"{len(packets)} packets, {len(telegrams)} telegrams")
    services: Counter[str] = Counter()
    seen: Counter[str] = Counter()
    positions = broken = 0
    for (octets, intact), packet in zip(telegrams, packets, strict=True):
        expect(int(packet["frame.len"]) == len(octets), f"{octets.hex(' ')} has another length")
        marked = packet["frame.packet_flags_symbol_error"] in ("1", "True")
        expect(marked != intact, f"{octets.hex(' ')} is marked wrongly")
        broken += not intact
        expect(packet["_ws.col.Info"] != "", f"nothing is said of {octets.hex(' ')}")
        services[packet["codewheel_profibus.service"]] += 1
        for word in (packet["codewheel_profibus.flag"], packet["codewheel_profibus.value"]):
            seen.update(word.split(","))
        position = packet["codewheel_profibus.position"]
        if position:
            # An answer of four octets: 68 07 07 68 02 07 FC and the position.
            expect(int(position) == int.from_bytes(octets[7:11]), f"{octets.hex(' ')}: {position}")
            positions += 1
    for name in SERVICES:
        expect(services[name] > 0, f"the dissector named no '{name}', only {dict(services)}")
    expect(positions > 100, f"the dissector showed {positions} positions")
    expect(broken > 3, f"{broken} telegrams are disturbed")
    for words in (
        "Sense of rotation: CW",
        "Steps per turn: 8192 step",
        "Total resolution: 536870912 step",
        "Lock_Req",
        "Prm_Fault",
        "position error or preset out of range",
        "Singleturn resolution: 262144 step",
        "Serial number: **********",
    ):
        expect(seen[words] > 0, f"the dissector never said '{words}'")
    print(f"  tshark with our dissector names {len(packets)} telegrams, {positions} positions")


def sd2(head: bytes, data: bytes) -> bytes:
    """A telegram: DA SA FC and what follows."""
    body = head + data
    length = bytes([len(body)])
    return b"\x68" + length * 2 + b"\x68" + body + bytes([sum(body) % 256, 0x16])


def write_pcap(telegrams: list[bytes], path: Path) -> None:
    """A capture of the old kind, a telegram a second."""
    with path.open("wb") as file:
        file.write(struct.pack(">IHHIIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, LINKTYPE_USER0))
        for at, octets in enumerate(telegrams):
            file.write(struct.pack(">IIII", at, 0, len(octets), len(octets)) + octets)


def slave_diag(ident: int) -> bytes:
    """The answer of slave 7 to master 2 with a position error, class 1 (PROFIBUS manual 7)."""
    standard = bytes([0x08, 0x0C, 0x00, 0x02]) + ident.to_bytes(2)
    ours = bytes.fromhex("0A 01 0B 01 00002000 FFFF")
    return sd2(bytes.fromhex("8287083E3C"), standard + ours)


def the_dissector_names_only_what_it_knows() -> None:
    """Another ident number, refusals, other access points, damages."""
    request = bytes.fromhex("6805056887826C3C3EEF16")
    outputs = sd2(bytes.fromhex("07025D"), bytes.fromhex("8000002A"))
    alarm = "position error or preset out of range"
    cases = [
        ([request, slave_diag(IDENT_NUMBER)], 1, "codewheel_profibus.flag", alarm, True),
        ([request, slave_diag(0x1234)], 1, "codewheel_profibus.flag", alarm, False),
        ([request, slave_diag(0x1234)], 1, "_ws.col.Info", "DL Slave_Diag", True),
        (
            [request, slave_diag(IDENT_NUMBER), outputs],
            2,
            "_ws.col.Info",
            "preset 42 clock 1",
            True,
        ),
        ([request, slave_diag(0x1234), outputs], 2, "_ws.col.Info", "preset", False),
        ([outputs], 0, "_ws.col.Info", "preset", False),
        ([request, b"\xe5"], 1, "_ws.col.Info", "acknowledge Slave_Diag", True),
        ([request, b"\xdc\x03\x02", b"\xe5"], 2, "_ws.col.Info", "Slave_Diag", False),
        ([sd2(bytes.fromhex("87826C303E"), b"")], 0, "_ws.col.Info", "SAP 48", True),
        ([bytes.fromhex("100702495316")], 0, "_ws.expert.message", "a wrong FCS", True),
        ([request[:5]], 0, "_ws.expert.message", "No telegram", True),
        ([b"\x55"], 0, "_ws.expert.message", "No telegram", True),
        ([bytes.fromhex("10020733 3C16")], 0, "_ws.col.Info", "RS", True),
    ]
    for telegrams, place, field, words, said in cases:
        with tempfile.TemporaryDirectory() as directory:
            capture = Path(directory) / "by_hand.pcap"
            write_pcap(telegrams, capture)
            packets = dissect(capture)
        octets = telegrams[place].hex(" ")
        found = packets[place][field]
        expect((words in found) == said, f"{octets}: '{words}' {'not ' * said}in '{found}'")
    print(f"  and says no more than it knows of {len(cases)} made by hand")


def main(arguments: list[str]) -> None:
    """Judges the folder."""
    if len(arguments) != 1:
        raise SystemExit(__doc__)
    folder = Path(arguments[0])
    os.environ["TZ"] = "UTC"
    time.tzset()
    log = python_can_reads_every_text_format(folder)
    tshark_knows_every_frame(folder, log)
    the_dissector_names_every_telegram(folder)
    the_dissector_names_only_what_it_knows()
    print(f"strangers read the captures in {folder}")


if __name__ == "__main__":
    main(sys.argv[1:])
