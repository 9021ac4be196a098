"""All the PROFIBUS manual says, chapter by chapter: a stranger looks whether it is so.

Usage: profibus_chapters.py [PROGRAM] [--log FILE] [--part NAME ...]

    python3 -m venv venv && venv/bin/pip install -r strangers/requirements.txt
    cargo build && venv/bin/python strangers/profibus_chapters.py

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) as one encoder after
the other behind a TCP port that carries the octets of the line, and plays the DP master
(profibus_book.py) through chapters 3 to 9 of the manual. Each step prints one line, `ok` or
`FAILED`, with what was seen; the last line counts them, and the exit status is 1 if any failed. All
telegrams go to FILE, in hexadecimal. `--part` walks some of it:

    telegrams   chapter 5.1: frames, addresses, function codes, frame count bit
    rates       chapter 5.1: delays, each rate
    services    chapters 5.2 and 6: each service in each state, two masters
    watchdog    chapter 6.1: response monitoring
    parameters  chapters 4, 6, 8: limits, lengths, configurations, positions, three geometries
    diagnosis   chapter 7: each octet of each model, alarms, the lithium cell
    data        chapters 7.3, 7.4: preset, Sync, Freeze, Clear
    lamp        chapter 9.5: what the lamp shows
    segment     chapter 3: 31 slaves on one line
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import TextIO

from profibus_data import UserData
from profibus_diagnosis import Diagnoses
from profibus_lamp import Lamp
from profibus_parameters import Settings
from profibus_segment import Segment
from profibus_services import Services
from profibus_telegrams import Telegrams
from steps import Ended, Process, arguments_of

PARTS = [
    "telegrams",
    "rates",
    "services",
    "watchdog",
    "parameters",
    "diagnosis",
    "data",
    "lamp",
    "segment",
]


class Chapters(Telegrams, Services, Settings, Diagnoses, UserData, Lamp, Segment):
    """All chapters."""


def walk(process: Process, directory: Path, log: TextIO, parts: list[str]) -> tuple[int, int]:
    """The runs of `parts`; passed and failed steps."""
    chapters = Chapters(process, log)
    chapters.plant = directory / "plant.toml"
    runs = {
        "telegrams": [chapters.telegrams_run],
        "rates": [chapters.rates_run],
        "services": [chapters.services_run],
        "watchdog": [chapters.watchdog_run],
        "parameters": chapters.parameter_runs(),
        "diagnosis": chapters.diagnosis_runs(),
        "data": chapters.user_data_runs(),
        "lamp": [chapters.lamp_run],
        "segment": [chapters.segment_run],
    }
    for part in PARTS:
        for run in runs[part] if part in parts else []:
            try:
                run()
            except Ended:
                # The failed step was counted; the other runs do not need this one.
                pass
            finally:
                chapters.leave_bus()
                process.end()
    return chapters.passed, chapters.failed


def main() -> int:
    """Walks; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", nargs="+", choices=PARTS, default=PARTS, help="some of it only")
    log_name = "codewheel-profibus-chapters.log"
    arguments = arguments_of(parser, log_name, "telegrams in hexadecimal")
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        messages_path = Path(directory) / "messages"
        with messages_path.open("w") as messages:
            process = Process(arguments.program.resolve(), messages)
            passed, failed = walk(process, Path(directory), log, arguments.part)
        if failed:
            tail = messages_path.read_text(errors="replace").splitlines()[-15:]
            print("the program's last messages:", *(tail or ["(none)"]), sep="\n  ")
    print(f"the telegrams are in {arguments.log}; {time.monotonic() - begin:.0f} s")
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
