"""The acceptance session: a stranger puts a PROFIBUS encoder through its paces on a pty.

Usage: profibus_session.py [PROGRAM] [--log FILE]

    python3 -m venv venv && venv/bin/pip install -r strangers/requirements.txt
    cargo build && venv/bin/python strangers/profibus_session.py

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) as an AMG 11 P 29 on
a pseudo terminal, and plays the DP master (profibus_book.py) as a program does that has a serial
port: data exchange, the example of chapter 8, preset, refused parameters, power-off, alarm.
What is expected comes from the manual and the book alone; positions are computed here. Each step
prints one line, `ok` or `FAILED`, with what was seen. All telegrams go to FILE, in hexadecimal.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TextIO

import profibus_book as book
from profibus_book import Parameters
from profibus_walk import (
    MULTITURN_29,
    POWER_ON,
    PRM_FAULT,
    RUNNING,
    STILL_AT,
    Start,
    Walk,
    jumps,
)
from steps import (
    Ended,
    Process,
    Wrong,
    arguments_of,
    expect,
    expect_within,
    in_three_attempts,
    position_at,
)

# The example of chapter 8 of the manual.
STEPS, TOTAL = 3600, 3600 * 256
EXAMPLE = Parameters(steps=STEPS, total=TOTAL)
# All codes of the disc cannot be told with fewer steps than it has.
TOO_LARGE = Parameters(steps=STEPS, total=536_870_912)
REFUSAL = "Set_Prm octets 14–17: total resolution 536870912 exceeds 3600 × 65536 = 235929600"
TURNING = "turn rpm=60 angle=0"
JUMP_AFTER, ALARM_SECONDS = 3.0, 2.5


class Session(Walk):
    """The steps. Those of one run build on each other, in the order of `run`."""

    # What the preset of the second run leaves behind.
    offset = 0

    def __init__(self, process: Process, log: TextIO, directory: Path) -> None:
        super().__init__(process, log)
        self._on_pty = Start(pty=directory / "pb", memory=directory / "memory")

    # --- A fresh encoder on a turning shaft

    def tells_the_diagnosis_of_the_book_at_power_up(self) -> str:
        wanted = "02 05 00 FF 05 9B 33 00 0A 01 00 00 20 00 FF FF 00 00 01 00 00 00 00 01 10 01 21"
        wanted += "FF FF FF FF" + "00" * 8 + "00 00 20 00 20 00 00 00" + "2A" * 10
        expect("diagnosis", self.master.slave_diag().octets, bytes.fromhex(wanted))
        return "57 octets, 02 05 00 FF"

    def exchanges_no_data_before_it_has_parameters(self) -> str:
        self.expect_rs(self.master.exchange, "Data_Exchange")
        return "RS"

    def comes_up(self, parameters: Parameters) -> str:
        """Diagnosis, parameters, configuration F1h, diagnosis."""
        diagnosis = self.master.bring_up(parameters)
        expect("octets 1 to 4 of the diagnosis", diagnosis.head, RUNNING)
        expect("steps per revolution", diagnosis.steps, parameters.steps)
        expect("total resolution", diagnosis.total, parameters.total)
        return f"00 04 00 02, n {diagnosis.steps}, T {diagnosis.total}"

    def exchanges_data_with_the_defaults(self) -> str:
        return self.comes_up(MULTITURN_29.default)

    def follow(self, parameters: Parameters, sign: int) -> str:
        """A shaft that turns once a second: the positions must keep step."""
        return in_three_attempts(lambda: self.five_positions(parameters, sign))

    def five_positions(self, parameters: Parameters, sign: int) -> str:
        """Five of them, and how far it is from one to the next."""
        seen = []
        for _ in range(5):
            position = self.master.position(bytes(4))
            seen.append((self.wire.seen[-1].at, position))
            time.sleep(0.2)
        moved = []
        for (before, old), (after, new) in itertools.pairwise(seen):
            due = parameters.steps * (after - before)
            step = sign * (new - old) % parameters.total
            expect_within("steps between two positions", step, due * 0.85 - 80, due * 1.15 + 80)
            moved.append(sign * step)
        return f"{seen[0][1]}, then " + ", ".join(f"{step:+}" for step in moved)

    def follows_the_shaft(self) -> str:
        return self.follow(MULTITURN_29.default, +1)

    def takes_the_example_of_chapter_8(self) -> str:
        seen = self.comes_up(EXAMPLE)
        return f"{seen}; {self.follow(EXAMPLE, +1)}"

    def turns_the_other_way(self) -> str:
        other_way = replace(EXAMPLE, counter_clockwise=True)
        self.comes_up(other_way)
        expect("operating status, octet 9", self.master.slave_diag().octet(9), 0x0B)
        seen = self.follow(other_way, -1)
        self.comes_up(EXAMPLE)
        return seen

    def presets_the_moving_shaft(self) -> str:
        return in_three_attempts(self.preset_42_on_the_fly)

    def preset_42_on_the_fly(self) -> str:
        """The clock bit, and where the shaft is then."""
        # The top bit must have been 0 since the start.
        self.master.exchange(bytes(4))
        before = time.time()
        first, second = self.master.preset(42)
        after = self.wire.seen[-1].at
        # The position was 42 at some moment after `before`.
        most = STEPS * (after - before) * 1.15 + 80
        expect_within("position in the answer to the clock bit", first, 42, 42 + most)
        expect_within("position after the clock bit", second, first, 42 + most)
        self.offset = self.master.slave_diag().offset
        if self.offset == 0:
            raise Wrong("the offset is 0, though the preset moved the position")
        return f"{first}, then {second}; offset {self.offset}"

    def explains_refused_parameters(self) -> str:
        mark = len(self.messages())
        self.master.set_prm(TOO_LARGE)
        self.master.chk_cfg(book.TWO_WORDS_BOTH_WAYS)
        diagnosis = self.expect_head(PRM_FAULT)
        expect("octets of the diagnosis", len(diagnosis.octets), 57)
        kept = (diagnosis.steps, diagnosis.total, diagnosis.offset)
        expect("n, T and offset that were kept", kept, (STEPS, TOTAL, self.offset))
        return self.message_since(mark, REFUSAL)

    def comes_up_again_after_the_refusal(self) -> str:
        self.comes_up(EXAMPLE)
        expect("offset", self.master.slave_diag().offset, self.offset)
        return f"offset {self.offset}; {self.follow(EXAMPLE, +1)}"

    def loses_power(self) -> str:
        """Kills it, so that nothing can be written any more."""
        self.leave_bus()
        self.process.end()
        return "killed"

    # --- The same encoder after power-off, on a shaft that stands still

    def has_kept_the_offset(self) -> str:
        diagnosis = self.expect_head(POWER_ON)
        expect("offset, octets 32 to 35", diagnosis.offset, self.offset)
        return f"octets 32 to 35: {diagnosis.part(32, 35).hex(' ')} = {self.offset}"

    def has_the_offset_in_force_under_the_same_parameters(self) -> str:
        self.comes_up(EXAMPLE)
        wanted = position_at(STILL_AT, STEPS, TOTAL, self.offset)
        expect("position", self.master.position(bytes(4)), wanted)
        return f"{wanted}"

    def has_no_offset_under_other_parameters(self) -> str:
        seen = []
        for other in (
            MULTITURN_29.default,
            replace(EXAMPLE, steps=3599),
            replace(EXAMPLE, total=TOTAL - 1),
            replace(EXAMPLE, counter_clockwise=True),
        ):
            self.comes_up(other)
            clockwise = not other.counter_clockwise
            wanted = position_at(STILL_AT, other.steps, other.total, clockwise=clockwise)
            expect(f"position with {other}", self.master.position(bytes(4)), wanted)
            seen.append(f"n {other.steps}, T {other.total}: {wanted}")
        self.comes_up(EXAMPLE)
        wanted = position_at(STILL_AT, STEPS, TOTAL, self.offset)
        expect("position under the old parameters", self.master.position(bytes(4)), wanted)
        return "; ".join(seen) + f"; the old ones: {wanted}"

    def presets_the_standing_shaft(self) -> str:
        self.master.exchange(bytes(4))
        expect("positions", self.master.preset(42), (42, 42))
        self.offset = 42 - position_at(STILL_AT, STEPS, TOTAL)
        expect("offset", self.master.slave_diag().offset, self.offset)
        return f"42, offset {self.offset}"

    def stands_at_the_preset_after_power_off(self) -> str:
        self.has_kept_the_offset()
        self.comes_up(EXAMPLE)
        expect("position", self.master.position(bytes(4)), 42)
        return "42"

    def keeps_the_old_or_the_new_offset(self) -> str:
        """Loses power right after a preset, sooner and later."""
        plain = position_at(STILL_AT, STEPS, TOTAL)
        possible, kept = {self.offset}, 0
        for count, delay in enumerate([0.0, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1]):
            self.loses_power()
            self.start(self._on_pty)
            offset = self.master.slave_diag().offset
            if offset not in possible:
                raise Wrong(f"offset {offset} after power-off, only {possible} are possible")
            kept += offset == self.offset
            self.comes_up(EXAMPLE)
            self.master.exchange(bytes(4))
            expect("position", self.master.preset(1000 + count), (1000 + count, 1000 + count))
            self.offset = 1000 + count - plain
            possible = {offset, self.offset}
            time.sleep(delay)
        self.loses_power()
        self.start(self._on_pty)
        expect("offset 100 ms after the preset", self.master.slave_diag().offset, self.offset)
        return f"whole each time, {kept + 1} of 8 times the new one"

    # --- A position error

    def until(self, function: int, seconds: float) -> float:
        """Exchanges data until an answer has `function`; the time of that answer."""
        deadline = time.time() + seconds
        while time.time() < deadline:
            answer = self.master.exchange(bytes(4))
            if answer.function == function:
                return self.wire.seen[-1].at
            time.sleep(0.01)
        raise Wrong(f"no answer {book.RESPONSES[function]} within {seconds:g} s")

    def tells_a_jump_of_the_code(self) -> str:
        self.until(book.DATA_LOW, 0.1)
        self.alarm_at = self.until(book.DATA_HIGH, JUMP_AFTER + 2)
        after = self.alarm_at - self.began_at
        expect_within("seconds from the start to DH", after, JUMP_AFTER, JUMP_AFTER + 1.5)
        diagnosis = self.expect_head(b"\x08" + RUNNING[1:])
        expect("alarms, octet 8", diagnosis.alarms, 0x01)
        self.until(book.DATA_LOW, 0.1)
        return f"DH {after:.2f} s after the start, 08 04 00 02, octet 8 01; DL once it was read"

    def clears_the_alarm_by_itself(self) -> str:
        cleared_at = self.until(book.DATA_HIGH, ALARM_SECONDS + 2)
        # Counted from the jump, since a busy machine may have told of it late; jumps that follow
        # within 0.2 s make it longer.
        lasted = cleared_at - self.began_at - JUMP_AFTER
        expect_within("seconds of the alarm", lasted, ALARM_SECONDS - 0.05, ALARM_SECONDS + 1)
        diagnosis = self.expect_head(RUNNING)
        expect("alarms, octet 8", diagnosis.alarms, 0x00)
        self.until(book.DATA_LOW, 0.1)
        return f"DH after {lasted:.2f} s, 00 04 00 02, octet 8 00"

    # --- The runs

    def first_run(self) -> None:
        """A fresh encoder on a turning shaft."""
        self.begin(replace(self._on_pty, shaft=TURNING))
        self.named(self.tells_the_diagnosis_of_the_book_at_power_up)
        self.named(self.exchanges_no_data_before_it_has_parameters)
        self.named(self.exchanges_data_with_the_defaults, vital=True)
        self.named(self.follows_the_shaft)
        self.named(self.takes_the_example_of_chapter_8)
        self.named(self.turns_the_other_way)
        self.named(self.presets_the_moving_shaft)
        self.named(self.explains_refused_parameters)
        self.named(self.comes_up_again_after_the_refusal)
        self.named(self.loses_power, vital=True)

    def second_run(self) -> None:
        """The same encoder after power-off, on a shaft that stands still."""
        self.begin(self._on_pty)
        self.named(self.has_kept_the_offset)
        self.named(self.has_the_offset_in_force_under_the_same_parameters)
        self.named(self.has_no_offset_under_other_parameters)
        self.named(self.presets_the_standing_shaft)
        self.named(self.loses_power, vital=True)

    def third_run(self) -> None:
        """Once more: power-off must not move the position by a step."""
        self.begin(self._on_pty)
        self.named(self.stands_at_the_preset_after_power_off)
        self.named(self.keeps_the_old_or_the_new_offset)
        self.end()

    def fourth_run(self) -> None:
        """The code of the disc jumps."""
        self.begin(replace(self._on_pty, shaft=TURNING, faults=jumps(JUMP_AFTER)))
        self.step("exchanges data", lambda: self.comes_up(EXAMPLE), vital=True)
        self.named(self.tells_a_jump_of_the_code, vital=True)
        self.named(self.clears_the_alarm_by_itself)
        self.end()

    def run(self) -> None:
        """All four."""
        self.first_run()
        self.second_run()
        self.third_run()
        self.fourth_run()


def main() -> int:
    """Runs the session; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments = arguments_of(parser, "codewheel-profibus-session.log", "telegrams in hexadecimal")
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        messages_path = Path(directory) / "messages"
        with messages_path.open("w") as messages:
            process = Process(arguments.program.resolve(), messages)
            session = Session(process, log, Path(directory))
            try:
                session.run()
            except Ended:
                # The failed step was counted.
                pass
            finally:
                session.leave_bus()
                process.end()
                if session.failed:
                    tail = messages_path.read_text(errors="replace").splitlines()[-15:]
                    print("the program's last messages:", *(tail or ["(none)"]), sep="\n  ")
                print(f"the telegrams are in {arguments.log}")
                print(f"{session.passed} passed, {session.failed} failed")
    return 1 if session.failed else 0


if __name__ == "__main__":
    sys.exit(main())
