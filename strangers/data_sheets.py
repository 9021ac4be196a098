"""Readers that we did not write read the EDS and GSD files: do these say what the manuals say?

Usage: data_sheets.py FOLDER        the folder must hold all thirteen files and nothing else
       data_sheets.py --self-test FOLDER    show that broken copies of them are found out

eds-pie reads the EDS files. It knows the common sections (File, Device, Params) and judges the types
in them; of DeviceNet's own ones it has no description, so there it reads, and this script judges.
pyprofibus reads the GSD files as it does for its own master. Each file gets one line per subject.
"""

from __future__ import annotations

import contextlib
import io
import logging
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import eds_pie.eds_pie
from eds_pie.eds import EDS
from pyprofibus.gsd.interp import GsdInterp
from pyprofibus.util import ProfibusError

from steps import Wrong, expect

TURNS = 65_536
STEPS = 8_192


@dataclass(frozen=True)
class Product:
    """A line of the tables in chapter 1.2 of the DeviceNet manual."""

    code: int
    family: str

    @property
    def is_multiturn(self) -> bool:
        return self.family.endswith("Multiturn")


EDS_FILES = {
    f"{family.replace(' ', '')}D{bits}.eds": Product(code, f"{family} - {kind}")
    for family in ("AMG 11", "AMG 81", "PMG 10", "HMG 11", "HMG 10")
    for bits, code, kind in ((13, 0x0B, "Singleturn"), (29, 0x0A, "Multiturn"))
}
# Chapter 4 of the PROFIBUS manual: steps per turn, and total resolution.
GSD_FILES = {
    "PB13DPV0.GSD": (STEPS, STEPS),
    "PB18DPV0.GSD": (262_144, 262_144),
    "PB29DPV0.GSD": (STEPS, STEPS * TURNS),
}

# Chapter 7 of the DeviceNet manual: the attributes of class 2F behind the parameters, in order.
LINKS = (3, 4, 5, 6, 7, 8, 9, 10, 12, 80, 81, 82, 85, 83, 84, 88, 86, 87, 89)
# Chapter 8: what can be written, and the values with names.
SETTABLE = {3, 7, 8, 10}
NAMES = {
    3: ("CW", "CCW"),
    4: ("OFF", "ON"),
    5: ("OFF", "ON"),
    6: ("Steps",),
    85: ("OK", "Alarm"),
    88: ("OK", "Warning"),
}
# Type codes of CIP volume 1, appendix C: octets, lowest and highest value.
TYPES = {
    "BOOL": (0xC1, 1, 0, 1),
    "DINT": (0xC4, 4, -(2**31), 2**31 - 1),
    "USINT": (0xC6, 1, 0, 2**8 - 1),
    "UINT": (0xC7, 2, 0, 2**16 - 1),
    "UDINT": (0xC8, 4, 0, 2**32 - 1),
}
# Chapter 8: the types.
TYPE_OF = {
    **dict.fromkeys((3, 4, 5, 85, 88), "BOOL"),
    **dict.fromkeys((7, 8, 9, 10, 81, 89), "UDINT"),
    **dict.fromkeys((82, 83, 84, 86, 87), "UINT"),
    **dict.fromkeys((6, 80), "USINT"),
    12: "DINT",
}
ENUMERATED = 0x0002
READ_ONLY = 0x0010
NAME_LENGTHS = ((6, 16), (7, 4), (8, 64))

# What eds-pie says because it has no description of DeviceNet, and of nothing else.
NO_DESCRIPTION = re.compile(
    r'Requested Protocol Database "DeviceNet" not available!'
    r"|Unknown Entry \[\{section\.keyword,\}\]\.\{entry\.keyword\}"
    r"|Unknown Field \[(IO_Info|ParamClass|EnumPar|Groups)\]\..*"
)
SECTIONS = (
    "File",
    "Device",
    "Device Classification",
    "IO_Info",
    "ParamClass",
    "Params",
    "EnumPar",
    "Groups",
)

# Keywords of GSD files that pyprofibus does not know, and the types of parameters, which it skips.
NOT_READ = re.compile(r"FMS_supp = 0|DP_Encoder_\w+ = [\d.]+|(Bit\(\d\)|Unsigned16) \d+ \d+-\d+")
# EN 50170-2: the longest T_SDR in bits.
LONGEST_DELAYS = {
    **dict.fromkeys((9_600, 19_200, 45_450, 93_750, 187_500), 60),
    500_000: 100,
    1_500_000: 150,
    3_000_000: 250,
    6_000_000: 450,
    12_000_000: 800,
}
# Chapter 6.2 of the PROFIBUS manual: octets of input and of output.
MODULES = {0xD1: (4, 0), 0xF1: (4, 4), 0xD0: (2, 0), 0xF0: (2, 2)}
USER_OCTETS = 18


class Complaints(logging.Handler):
    """Keeps what a reader complains of."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.found: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        message = record.getMessage()
        if not NO_DESCRIPTION.fullmatch(message):
            self.found.append(message)


def read_eds(path: Path) -> EDS:
    """The file as eds-pie sees it, which must find nothing wrong."""
    log = logging.getLogger()
    complaints = Complaints()
    # eds-pie has given the log a handler of its own, which would print all it says.
    handlers, log.handlers = log.handlers, [complaints]
    try:
        eds = eds_pie.eds_pie.CIP_EDS(path.read_bytes())
    except Exception as error:  # noqa: BLE001 - it raises nothing narrower
        raise Wrong(f"eds-pie cannot read it: {error}") from error
    finally:
        log.handlers = handlers
    expect("complaints of eds-pie", complaints.found, [])
    expect("sections", tuple(eds.sections), SECTIONS)
    return eds


def fields(eds: EDS, section: str, entry: str) -> list[int | str]:
    """The fields of an entry, numbers as numbers."""
    found = eds.get_entry(section, entry)
    if found is None:
        raise Wrong(f"no [{section}].{entry}")
    return [number_or_text(str(field.value)) for field in found.fields]


def number_or_text(value: str) -> int | str:
    try:
        return int(value, 0)
    except ValueError:
        return value


def octets_of(path: int | str) -> bytes:
    return bytes.fromhex(str(path))


def is_the_product(eds: EDS, product: Product) -> str:
    expect("Class1", fields(eds, "Device Classification", "Class1"), ["DeviceNet"])
    expect("ProdCode", fields(eds, "Device", "ProdCode"), [product.code])
    expect("ProdName", fields(eds, "Device", "ProdName"), [product.family])
    revision = [fields(eds, "Device", entry) for entry in ("MajRev", "MinRev")]
    expect("revision", revision, [[1], [1]])
    return f"code {product.code:02X}h, {product.family}"


def has_the_parameters(eds: EDS, product: Product) -> str:
    expect("MaxInst", fields(eds, "ParamClass", "MaxInst"), [len(LINKS)])
    names = [f"Param{instance}" for instance in range(1, len(LINKS) + 1)]
    expect("entries", list(eds.sections["Params"].entries), names)
    for name, attribute in zip(names, LINKS, strict=True):
        judge_parameter(name, attribute, fields(eds, "Params", name))
    full = STEPS * TURNS if product.is_multiturn else STEPS
    limits = {5: [1, STEPS, STEPS], 6: [1, full, full], 8: [0, full - 1, 0]}
    for instance, wanted in limits.items():
        found = fields(eds, "Params", f"Param{instance}")[9:12]
        expect(f"Param{instance}: limits and default", found, wanted)
    return f"{len(LINKS)}, n to {STEPS}, T to {full}"


def judge_parameter(name: str, attribute: int, found: list[int | str]) -> None:
    code, octets, lowest, highest = TYPES[TYPE_OF[attribute]]
    expect(f"{name}: number of fields", len(found), 21)
    path = octets_of(found[2])
    expect(f"{name}: path", path, bytes((0x20, 0x2F, 0x24, 1, 0x30, attribute)))
    expect(f"{name}: reserved, length of the path", found[:2], [0, len(path)])
    descriptor = int(found[3])
    expect(f"{name}: read only", bool(descriptor & READ_ONLY), attribute not in SETTABLE)
    expect(f"{name}: enumerated", bool(descriptor & ENUMERATED), attribute in NAMES)
    expect(f"{name}: type and size", found[4:6], [code, octets])
    for place, length in NAME_LENGTHS:
        if len(str(found[place])) > length:
            raise Wrong(f"{name}: {found[place]!r} has more than {length} characters")
    low, high, default = (int(value) for value in found[9:12])
    if not lowest <= low <= default <= high <= highest:
        raise Wrong(f"{name}: {low} … {default} … {high} are no limits of {TYPE_OF[attribute]}")
    expect(f"{name}: scaling, links, decimals", found[12:], [1, 1, 1, 0, 0, 0, 0, 0, 0])


def names_the_values(eds: EDS, _: Product) -> str:
    instances = {f"Param{place}": attribute for place, attribute in enumerate(LINKS, 1)}
    found = {
        entry: tuple(fields(eds, "EnumPar", entry)) for entry in eds.sections["EnumPar"].entries
    }
    wanted = {
        entry: NAMES[attribute] for entry, attribute in instances.items() if attribute in NAMES
    }
    expect("names", found, wanted)
    return f"of {len(found)} parameters"


def groups_every_parameter_once(eds: EDS, _: Product) -> str:
    grouped: list[int | str] = []
    for entry in eds.sections["Groups"].entries:
        name, count, *members = fields(eds, "Groups", entry)
        expect(f"{name}: members", len(members), count)
        grouped += members
    expect("all members", sorted(map(int, grouped)), list(range(1, len(LINKS) + 1)))
    return f"in {len(eds.sections['Groups'].entries)} groups"


def offers_the_connections(eds: EDS, _: Product) -> str:
    expect("Default", fields(eds, "IO_Info", "Default"), [0x0001])
    for entry, together in (("PollInfo", 0x000D), ("COSInfo", 0x0005), ("CyclicInfo", 0x0009)):
        expect(entry, fields(eds, "IO_Info", entry), [together, 1, 0])
    for instance, size in ((1, 4), (2, 5)):
        found = fields(eds, "IO_Info", f"Input{instance}")
        expect(f"Input{instance}", found[:3], [size, 0, 0x000D])
        path = octets_of(found[5])
        expect(f"Input{instance}: path", path, bytes((0x20, 0x04, 0x24, instance)))
        expect(f"Input{instance}: length of the path", found[4], len(path))
    expect("entries", len(eds.sections["IO_Info"].entries), 6)
    return "poll, COS, cyclic; inputs of 4 and 5 octets"


EDS_CHECKS = (
    is_the_product,
    has_the_parameters,
    names_the_values,
    groups_every_parameter_once,
    offers_the_connections,
)


@dataclass(frozen=True)
class Gsd:
    """A GSD file as pyprofibus sees it, and the types of the parameters, which it skips."""

    read: GsdInterp
    types: dict[int, tuple[int | None, int, int, int]]

    def field(self, name: str) -> Any:
        return self.read.getField(name)

    def octets(self, **numbers: int) -> bytes:
        """Set_Prm from octet 8 on: constant octets, over them the defaults or `numbers` by name."""
        constant = self.field("Ext_User_Prm_Data_Const")
        octets = bytearray(constant[0].dataBytes)
        names = {data.refNr: data.name for data in self.field("ExtUserPrmData")}
        for reference in self.field("Ext_User_Prm_Data_Ref"):
            bit, default, low, high = self.types[reference.refNr]
            value = numbers.get(names[reference.refNr], default)
            if not low <= value <= high:
                raise Wrong(f"{names[reference.refNr]}: {value} is not {low} to {high}")
            if bit is None:
                octets[reference.offset : reference.offset + 2] = value.to_bytes(2, "big")
            else:
                octets[reference.offset] &= ~(1 << bit)
                octets[reference.offset] |= value << bit
        return bytes(octets)


TYPE_LINE = re.compile(
    r"ExtUserPrmData = (\d+) .*\r\n(?:Bit\((\d)\)|Unsigned16) (\d+) (\d+)-(\d+)\r\n"
)


def read_gsd(path: Path) -> Gsd:
    """The file as pyprofibus sees it, which must know every line but the ones listed above."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said):
            read = GsdInterp.fromFile(str(path), debug=True)
    except ProfibusError as error:
        raise Wrong(f"pyprofibus cannot read it: {error}") from error
    skipped = re.findall(r"line \d+:\n(.*)\n --> Ignored unknown line", said.getvalue())
    expect("unknown lines", [line for line in skipped if not NOT_READ.fullmatch(line)], [])
    types = {}
    for number, bit, default, low, high in TYPE_LINE.findall(path.read_bytes().decode("ascii")):
        types[int(number)] = (int(bit) if bit else None, int(default), int(low), int(high))
    return Gsd(read, types)


def is_the_slave(gsd: Gsd, _: tuple[int, int]) -> str:
    expect("Ident_Number", gsd.read.getIdentNumber(), 0x059B)
    expect("GSD_Revision", gsd.field("GSD_Revision"), 1)
    expect("Slave_Family", gsd.field("Slave_Family"), ["7"])
    for keyword, wanted in (
        ("Sync_Mode_supp", True),
        ("Freeze_Mode_supp", True),
        ("Auto_Baud_supp", True),
        ("Set_Slave_Add_supp", False),
        ("Min_Slave_Intervall", 1),
        ("Max_Diag_Data_Len", 59),
    ):
        expect(keyword, gsd.field(keyword), wanted)
    return f"{gsd.field('Model_Name')}, ident 059Bh"


def knows_the_rates(gsd: Gsd, _: tuple[int, int]) -> str:
    for rate, longest in LONGEST_DELAYS.items():
        expect(f"longest T_SDR at {rate}", gsd.read.getMaxTSDR(rate), longest)
        name = f"{rate / 1_000_000:g}M" if rate >= 1_000_000 else f"{rate / 1_000:g}"
        expect(f"{name}_supp", gsd.field(f"{name}_supp"), True)
    return f"{len(LONGEST_DELAYS)}, with their delays"


def sends_the_defaults(gsd: Gsd, full: tuple[int, int]) -> str:
    steps, total = full
    wanted = bytes((0x00, 0x0A)) + steps.to_bytes(4, "big") + total.to_bytes(4, "big") + bytes(8)
    expect("octets as an old tool sends them", gsd.field("User_Prm_Data"), wanted)
    expect("their number", gsd.field("User_Prm_Data_Len"), USER_OCTETS)
    expect("octets as pyprofibus sends them", gsd.read.getUserPrmData(), wanted)
    expect("octets as a new tool sends them", gsd.octets(), wanted)
    expect("their number", gsd.field("Max_User_Prm_Data_Len"), USER_OCTETS)
    return wanted.hex(" ")


def takes_hi_and_lo(gsd: Gsd, full: tuple[int, int]) -> str:
    """Chapter 8: 3600 steps and 256 turns; where there is one turn, 3600 steps."""
    steps, total = 3_600, 3_600 * 256 if full[1] > full[0] else 3_600
    numbers = {
        "Measuring units per rev. hi": steps >> 16,
        "Measuring units per rev. lo": steps & 0xFFFF,
        "Total measuring range (units) hi": total >> 16,
        "Total measuring range (units) lo": total & 0xFFFF,
    }
    sent = gsd.octets(**numbers)
    expect("octets 10 to 13", int.from_bytes(sent[2:6], "big"), steps)
    expect("octets 14 to 17", int.from_bytes(sent[6:10], "big"), total)
    for first, limit in ((5, full[0]), (7, full[1])):
        (_, _, *hi), (_, _, *lo) = gsd.types[first], gsd.types[first + 1]
        expect(f"parameter {first}: limits of hi", hi, [0, limit >> 16])
        expect(
            f"parameter {first + 1}: limits of lo", lo, [1, limit] if limit < 2**16 else [0, 0xFFFF]
        )
    return f"n {steps}, T {total} = {total >> 16}, {total & 0xFFFF}"


def has_the_modules(gsd: Gsd, _: tuple[int, int]) -> str:
    expect("modular", gsd.read.isModular(), True)
    expect("Max_Module", gsd.field("Max_Module"), 1)
    identifiers = []
    for module in gsd.field("Module"):
        gsd.read.clearConfiguredModules()
        gsd.read.setConfiguredModule(module.name)
        [element] = gsd.read.getCfgDataElements()
        identifiers.append(element.identifier)
        words = element.identifier & 0x0F
        length = 2 * (words + 1)
        data = tuple(length if element.identifier & bit else 0 for bit in (0x10, 0x20))
        expect(f"{module.name}: octets", data, MODULES.get(element.identifier))
    expect("identifiers", sorted(identifiers), sorted(MODULES))
    lengths = [gsd.field(f"Max_{what}_Len") for what in ("Input", "Output", "Data")]
    expect("most input, output, data", lengths, [4, 4, 8])
    return ", ".join(f"{identifier:02X}h" for identifier in identifiers)


GSD_CHECKS = (
    is_the_slave,
    knows_the_rates,
    sends_the_defaults,
    takes_hi_and_lo,
    has_the_modules,
)


def checks_of(path: Path) -> Iterator[tuple[str, Callable[[], str]]]:
    """The checks of a file by name. To read it is the first; the others need it."""
    is_eds = path.name in EDS_FILES
    read = read_eds(path) if is_eds else read_gsd(path)
    yield "is read", lambda: "by eds-pie" if is_eds else "by pyprofibus"
    about = EDS_FILES[path.name] if is_eds else GSD_FILES[path.name]
    for check in EDS_CHECKS if is_eds else GSD_CHECKS:
        name = check.__name__.replace("_", " ")
        yield name, lambda check=check: check(read, about)  # type: ignore[misc]


def judge(path: Path) -> int:
    """Prints a line for each check of a file; how many failed."""
    failed = 0
    try:
        for name, check in checks_of(path):
            try:
                print(f"ok     {path.name} {name}: {check()}")
            except Wrong as error:
                failed += 1
                print(f"FAILED {path.name} {name}: {error}")
    except (Wrong, OSError) as error:
        failed += 1
        print(f"FAILED {path.name} is read: {error}")
    return failed


# One thing broken in a good file: the file, what stands there, what is put in its place.
BREAKAGES = (
    ("AMG11D29.eds", "CreateDate = 11-22-2026", "CreateDate = 31-22-2026"),
    ("AMG11D29.eds", "ProdCode = 10;", "ProdCode = 11;"),
    ("AMG11D29.eds", "ProdCode = 10;", 'ProdCode = "ten";'),
    ("AMG11D29.eds", "[Device Classification]", "[Device]"),
    ("AMG11D29.eds", "MajRev = 1;", "MajRev = 1"),
    ("AMG11D29.eds", "[Groups]", "[Group]"),
    ("AMG11D29.eds", "20 2F 24 01 30 07", "20 2F 24 01 30 08"),
    ("AMG11D29.eds", "1, 8192, 8192,", "1, 8193, 8192,"),
    ("AMG11D29.eds", "0xC8,", "0xC7,"),
    ("AMG11D29.eds", '"CCW";', '"CCW", "CW";'),
    ("AMG11D29.eds", '"Settings", 4,', '"Settings", 5,'),
    ("AMG11D29.eds", "0x0005,", "0x000D,"),
    ("AMG11D29.eds", "20 04 24 02", "20 04 24 03"),
    ("PB29DPV0.GSD", "Ident_Number = 0x059B", "Ident_Number = 0x059C"),
    ("PB29DPV0.GSD", "Max_Data_Len = 8", "Max_Data_len = 8"),
    ("PB29DPV0.GSD", "MaxTsdr_93.75 = 60", "MaxTsdr_93.75 = 600"),
    ("PB29DPV0.GSD", "45.45_supp = 1", "45.45_supp = 0"),
    ("PB29DPV0.GSD", "User_Prm_Data = 0x00,0x0A", "User_Prm_Data = 0x00,0x0B"),
    ("PB29DPV0.GSD", "Const(0) = 0x00,0x0A,0x00", "Const(0) = 0x00,0x0A,0x01"),
    ("PB29DPV0.GSD", "Data_Ref(6) = 7", "Data_Ref(7) = 7"),
    ("PB29DPV0.GSD", "Unsigned16 8192 0-8192", "Unsigned16 8192 0-8191"),
    ("PB29DPV0.GSD", "Bit(1) 1 0-1", "Bit(1) 0 0-1"),
    ("PB29DPV0.GSD", " 0xD0", " 0xD2"),
)


def self_test(folder: Path) -> int:
    """Every breakage must be found out, and the files as they are found good."""
    failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        for name, good, bad in BREAKAGES:
            text = (folder / name).read_bytes().decode("ascii")
            broken = Path(scratch) / name
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                broken.write_bytes(text.encode("ascii"))
                sound = judge(broken) == 0
                broken.write_bytes(text.replace(good, bad, 1).encode("ascii"))
                found_out = good in text and judge(broken) > 0
            if sound and found_out:
                print(f"ok     {name}: finds out {bad!r}")
            else:
                failed += 1
                print(f"FAILED {name}: {bad!r} in place of {good!r} goes unnoticed")
                print(said.getvalue(), end="")
    return 1 if failed else 0


def main() -> int:
    arguments = sys.argv[1:]
    if arguments[:1] == ["--self-test"] and len(arguments) == 2:
        return self_test(Path(arguments[1]))
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    files = {*EDS_FILES, *GSD_FILES}
    failed = 0
    for name in sorted({path.name for path in folder.iterdir()} - files):
        failed += 1
        print(f"FAILED {name} is no file that the manuals name")
    for name in sorted(files):
        failed += judge(folder / name)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
