"""Lets Wireshark's DeviceNet dissector judge a session: every frame must be one it knows.

Usage: tshark_judges.py session LOG     judge the candump -L style log of devicenet_session.py
       tshark_judges.py chapters LOG…  the logs of devicenet_chapters.py, together one walk
       tshark_judges.py --self-test    show that the judge accepts good frames and refuses bad ones

Two passes. In the first one the frames are as they were: tshark names each message by its
identifier and reads the duplicate MAC ID checks. It does not look into the explicit messages of
group 2, though those of group 3 have the same layout. So in the second pass they get an
identifier of group 3, and tshark names their services.
"""

from __future__ import annotations

import struct
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

LINKTYPE_CAN_SOCKETCAN = 227
EXPLICIT_MESSAGES = (3, 4, 6)

# What the dissector calls the messages of the predefined connection set that a session may carry.
DUPLICATE_MAC = "Duplicate MAC ID Check Messages"
UNCONNECTED = "Group 2 Only Unconnected Explicit Request Messages"
REQUEST = "Master's Explicit Request Messages"
RESPONSE = "Slave's Explicit/Unconnected Response Messages"
POLL_COMMAND = "Master's I/O Poll Command/COS/Cyclic Messages"
POLL_RESPONSE = "Slave's I/O Poll Response or COS/Cyclic Ack Message"
CHANGE_OF_STATE = "Slave's I/O Change of State or Cyclic Message"
CHANGE_ACKNOWLEDGE = "Master's Change of State or Cyclic Acknowledge Message"
HEARTBEAT = "Device Heartbeat Message - Response"
EXPLICIT_AND_POLL = (DUPLICATE_MAC, UNCONNECTED, REQUEST, RESPONSE, POLL_COMMAND, POLL_RESPONSE)
ALLOWED = (*EXPLICIT_AND_POLL, CHANGE_OF_STATE, CHANGE_ACKNOWLEDGE)
# Octets that a message of ours must have, where it is not any number.
LENGTHS = {DUPLICATE_MAC: (7,), CHANGE_OF_STATE: (4, 5), POLL_RESPONSE: (4, 5)}

SERVICES = (
    "Get Attribute Single - Request",
    "Get Attribute Single - Response",
    "Set Attribute Single - Response",
    "Save - Request",
    "Save - Response",
    "Restore - Request",
    "Restore - Response",
    "Reset - Request",
    "Reset - Response",
)
# What must be seen of each walk, so that no half of it is missed.
EXPECTED = {
    "session": (*EXPLICIT_AND_POLL, *SERVICES),
    "chapters": (
        *ALLOWED,
        *SERVICES,
        HEARTBEAT,
        "Apply Attributes - Request",
        "Apply Attributes - Response",
        "Get Attributes All - Request",
    ),
}
# The dissector does not know the error response (94); it takes Allocate (4B) and Release (4C) for
# the open and close services of group 3, and so the short response to Allocate for a broken one.
# These are judged by the session itself. A service that neither knows goes through, so that its
# refusal can be seen.
NOT_JUDGED = {0x14, 0x4B, 0x4C}


@dataclass(frozen=True)
class Frame:
    """One line of the log."""

    microseconds: int
    identifier: int
    data: bytes

    def __str__(self) -> str:
        return f"{self.identifier:03X}#{self.data.hex().upper()}"


@dataclass(frozen=True)
class Verdict:
    """What tshark says about one frame."""

    protocols: str
    info: str
    expert: str
    duplicate_mac: str


def read_log(path: Path) -> list[Frame]:
    """Reads lines like `(1700000000.000000) vcan0 42F#00D401D2040000`."""
    frames = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        try:
            time, _channel, frame = line.split()
            seconds, microseconds = time.strip("()").split(".")
            identifier, data = frame.split("#")
            at = int(seconds) * 1_000_000 + int(microseconds)
            frames.append(Frame(at, int(identifier, 16), bytes.fromhex(data)))
        except ValueError as error:
            place = f"{path}:{number}"
            raise SystemExit(f"{place}: not a candump -L line: {line!r} ({error})") from None
    return frames


def write_pcap(frames: list[Frame], path: Path) -> None:
    """Writes SocketCAN frames: identifier big endian, length, padding, eight octets."""
    with path.open("wb") as file:
        head = (0xA1B2C3D4, 2, 4, 0, 0, 65535, LINKTYPE_CAN_SOCKETCAN)
        file.write(struct.pack(">IHHIIII", *head))
        for frame in frames:
            octets = struct.pack(">IB3x8s", frame.identifier, len(frame.data), frame.data)
            at = divmod(frame.microseconds, 1_000_000)
            file.write(struct.pack(">IIII", *at, len(octets), len(octets)) + octets)


def ask_tshark(frames: list[Frame]) -> list[Verdict]:
    """Dissects the frames; one verdict for each."""
    fields = (
        "frame.protocols",
        "_ws.col.Info",
        "_ws.expert.message",
        "devicenet.dup_mac_id.rr",
        "devicenet.dup_mac_id.vendor",
        "devicenet.dup_mac_id.serial_number",
    )
    with tempfile.TemporaryDirectory() as directory:
        capture = Path(directory) / "session.pcap"
        write_pcap(frames, capture)
        command = ["tshark", "-n", "-r", str(capture), "-d", "can.subdissector,devicenet"]
        command += ["-T", "fields", *(word for field in fields for word in ("-e", field))]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"tshark failed with {done.returncode}:\n{done.stderr}")
    lines = done.stdout.splitlines()
    if len(lines) != len(frames):
        raise SystemExit(f"tshark dissected {len(lines)} of {len(frames)} frames:\n{done.stderr}")
    verdicts = []
    for line in lines:
        protocols, info, expert, *duplicate_mac = line.split("\t")
        verdicts.append(Verdict(protocols, info, expert, " ".join(duplicate_mac).strip()))
    return verdicts


def complaints(frame: Frame, verdict: Verdict, allowed: tuple[str, ...] | None) -> list[str]:
    """What is wrong with one frame, in tshark's words."""
    found = []
    # Of an empty frame tshark keeps the name in the info column only.
    if frame.data and not verdict.protocols.endswith("can:devicenet"):
        found.append(f"not dissected as DeviceNet but as {verdict.protocols}")
    if verdict.expert:
        found.append(verdict.expert)
    if allowed is not None and verdict.info not in allowed:
        found.append(f"no message of the predefined connection set: {verdict.info}")
    if "Malformed" in verdict.info:
        found.append(verdict.info)
    return [f"{frame}: {complaint}" for complaint in found]


def judge_identifiers(frames: list[Frame]) -> tuple[Counter[str], list[str]]:
    """First pass: the frames as they were."""
    names: Counter[str] = Counter()
    found = []
    for frame, verdict in zip(frames, ask_tshark(frames), strict=True):
        names[verdict.info] += 1
        found += complaints(frame, verdict, ALLOWED)
        lengths = LENGTHS.get(verdict.info)
        if lengths is not None and len(frame.data) not in lengths:
            due = " or ".join(str(length) for length in lengths)
            found.append(f"{frame}: '{verdict.info}' has {due} octets")
    return names, found


def as_group_3(frame: Frame) -> Frame | None:
    """A whole explicit message of group 2 under an identifier of group 3; None for all others."""
    is_explicit = frame.identifier >> 9 == 0b10 and frame.identifier & 7 in EXPLICIT_MESSAGES
    if not is_explicit or len(frame.data) < 2 or frame.data[0] & 0x80:
        return None
    if frame.data[1] & 0x7F in NOT_JUDGED:
        return None
    return replace(frame, identifier=0x600 | frame.identifier >> 3 & 0x3F)


def judge_services(frames: list[Frame], tried: frozenset[int]) -> tuple[Counter[str], list[str]]:
    """Second pass: the services of the explicit messages. `tried` are wrong on purpose."""
    moved = [group_3 for frame in frames if (group_3 := as_group_3(frame)) is not None]
    names: Counter[str] = Counter()
    found = []
    for frame, verdict in zip(moved, ask_tshark(moved), strict=True):
        if frame.data[1] in tried:
            continue
        names[verdict.info] += 1
        found += complaints(frame, verdict, None)
        if "Unknown" in verdict.info:
            found.append(f"{frame}: {verdict.info}")
        if verdict.info == HEARTBEAT and len(frame.data) != 8:
            found.append(f"{frame}: '{HEARTBEAT}' has 8 octets")
    return names, found


def judge(
    frames: list[Frame], expected: tuple[str, ...], tried: frozenset[int] = frozenset()
) -> tuple[Counter[str], list[str]]:
    """What tshark saw, and all complaints, those about what the session lacks included."""
    if not frames:
        return Counter(), ["the log has no frames"]
    messages, found = judge_identifiers(frames)
    services, more = judge_services(frames, tried)
    found += more
    seen = messages + services
    found += [f"tshark saw no '{name}'" for name in expected if not seen[name]]
    return seen, found


GOOD = """\
42F#00D401D2040000 42F#80D401D2040000 42E#3F4B0301033F 42B#3FCB00 42C#3F0E010101 42B#3F8ED401
42C#BF00102F010A1027 42B#BFC000 42C#BF810000 42B#BFC100 42B#3F90 42B#3F9414FF
42C#3F010F01 42C#3F0D0504 42B#3F8D45032A04 345#00100000 42A# 345#0010000003 42B#05CD010003001234
42C#3F162F01 42B#3F96 42C#3F152F01 42B#3F95 42C#3F052F01 42B#3F85 42D# 3C5#00100000
42E#3F4C030101 42B#3FCC"""

# Each of these among good frames must be refused, with these words.
BAD = {
    "7F5#00D401D2040000": "Invalid CAN Message",
    "7D1#00D401D2040000": "Reserved Group 4 Message",
    "42F#00D4": "Malformed",
    "42F#00D401D204000000": "has 7 octets",
    "345#001000": "has 4 or 5 octets",
    "3C5#": "has 4 or 5 octets",
    "42B#05CD01000300": "has 8 octets",
    "0C5#00100000": "Other Group 1 Message",
    "605#3F0E0101": "no message of the predefined connection set",
    "42B#3FF7": "Unknown Service Code",
}


def from_words(words: str) -> list[Frame]:
    """Frames a millisecond apart."""
    pairs = [word.split("#") for word in words.split()]
    return [
        Frame(1_700_000_000_000_000 + 1_000 * at, int(identifier, 16), bytes.fromhex(data))
        for at, (identifier, data) in enumerate(pairs)
    ]


def self_test() -> None:
    """Fails where the judge is too strict or too kind."""
    expected = EXPECTED["chapters"]
    _, found = judge(from_words(GOOD), expected)
    if found:
        raise SystemExit("the judge refuses good frames:\n  " + "\n  ".join(found))
    for bad, words in BAD.items():
        _, first = judge_identifiers(from_words(f"{GOOD} {bad}"))
        _, second = judge_services(from_words(f"{GOOD} {bad}"), frozenset())
        found = first + second
        if not found or not any(bad[3:] in line and words in line for line in found):
            raise SystemExit(f"the judge accepts {bad}, which is wrong ({words}); it says {found}")
    lacking = GOOD.replace("42D#", "").replace("42C#3F162F01", "").replace("42A#", "")
    _, found = judge(from_words(lacking), expected)
    if len(found) != 3:
        raise SystemExit(f"the judge misses that poll, save, acknowledge lack; it says {found}")
    print(f"the judge accepts the good frames, refuses {len(BAD)} bad ones, misses what is lacking")


def main(arguments: list[str]) -> None:
    """Judges the log named, or itself."""
    if arguments == ["--self-test"]:
        self_test()
        return
    if len(arguments) < 2 or arguments[0] not in EXPECTED:
        raise SystemExit(__doc__)
    walk, *logs = arguments
    frames = [frame for log in logs for frame in read_log(Path(log))]
    # Both walks ask for service 32h, which nobody has, to see it refused.
    names, found = judge(frames, EXPECTED[walk], tried=frozenset({0x32}))
    for name, count in sorted(names.items()):
        print(f"  {count:5} {name}")
    if found:
        raise SystemExit(f"tshark refuses {' '.join(logs)}:\n  " + "\n  ".join(found))
    print(f"tshark accepts {len(frames)} frames")


if __name__ == "__main__":
    main(sys.argv[1:])
