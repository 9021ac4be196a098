"""A master that we did not write: pyprofibus brings PROFIBUS encoders to data exchange.

Usage: pyprofibus_session.py [PROGRAM] [--log FILE]

    python3 -m venv venv && venv/bin/pip install -r strangers/requirements.txt
    cargo build && venv/bin/python strangers/pyprofibus_session.py

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) on a pseudo terminal
and lets pyprofibus play the DP master of class 1 there, over its serial PHY: FDL status, diagnosis,
parameters, configuration, data exchange, a preset, diagnosis on demand. pyprofibus decides what is
sent and whether an answer will do; the walk sets outputs and looks at inputs. Each step prints one
line, `ok` or `FAILED`. All telegrams go to FILE, in hexadecimal.

A pty has neither parity nor a rate, and pyprofibus waits for answers by the rate it was told: at
19200 baud it holds the line for 160 ms after a request that was lost, and its tightest time-out, of
10 ms for the FDL status, only repeats the request. So a busy machine makes it slower, not wrong.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TextIO

from pyprofibus.dp import DpCfgDataElement
from pyprofibus.dp_master import DPM1, DpSlaveDesc
from pyprofibus.phy_serial import CpPhySerial
from pyprofibus.util import ProfibusError

from profibus_book import BookViolation, Diagnosis, Parameters, Seen, Telegram
from profibus_walk import ADDRESS, Start, jumps
from steps import (
    Ended,
    Process,
    Steps,
    Wrong,
    arguments_of,
    expect,
    expect_within,
    in_three_attempts,
)

OUR_ADDRESS = 2
BAUD = 19200
WATCHDOG_MS = 1500
# From the first request to data exchange; it takes some 30 ms where nothing disturbs.
BRING_UP_SECONDS = 5.0
PRM_FAULT, RUNNING = bytes.fromhex("42 05 00 FF"), bytes([0x00, 0x0C, 0x00, OUR_ADDRESS])
TOP = 0x8000_0000
EXAMPLE = Parameters(steps=3600, total=3600 * 256)
JUMP_AFTER = 14.0


class NotedPhy(CpPhySerial):  # type: ignore[misc]
    """The serial PHY of pyprofibus, which notes what goes through it."""

    def __init__(self, path: Path, log: TextIO) -> None:
        self.seen: list[Seen] = []
        self._log = log
        super().__init__(port=str(path))

    def sendData(self, telegramData: bytearray, srd: bool) -> None:  # noqa: N802, N803
        """A telegram of the master."""
        self._note(Seen(time.time(), bytes(telegramData), is_ours=True))
        super().sendData(telegramData, srd)

    def pollData(self, timeout: float = 0.0) -> bytearray | None:  # noqa: N802
        """A telegram of the slave, where a whole one has come."""
        data: bytearray | None = super().pollData(timeout)
        if data is not None:
            self._note(Seen(time.time(), bytes(data)))
        return data

    def _note(self, seen: Seen) -> None:
        self.seen.append(seen)
        self._log.write(f"({seen.at:.6f}) {'M' if seen.is_ours else 'S'} {seen}\n")
        self._log.flush()


class PyprofibusSession(Steps):
    """The steps. Those of one run build on each other."""

    wrongs = (*Steps.wrongs, ProfibusError)

    def __init__(self, process: Process, log: TextIO, directory: Path) -> None:
        super().__init__(process)
        self._log = log
        self._path = directory / "pb"
        self._phy: NotedPhy | None = None
        self._out = bytes(4)

    def conversation(self) -> Sequence[Seen]:
        """The telegrams of this run."""
        return [] if self._phy is None else self._phy.seen

    # --- The master

    def starts(self, start: Start) -> str:
        """Starts an encoder and opens its line."""
        line = self.process.launch(start.arguments())
        self.began_at = time.time()
        self._phy = NotedPhy(self._path, self._log)
        self._phy.setConfig(baudrate=BAUD)
        return line

    def configure(self, parameters: Parameters) -> None:
        """A master with one slave, by hand: configuration F1h, 18 user octets as in the GSD."""
        self._master: Any = DPM1(phy=self._phy, masterAddr=OUR_ADDRESS)
        slave = DpSlaveDesc()
        slave.slaveAddr = slave.setPrmTelegram.da = slave.chkCfgTelegram.da = ADDRESS
        slave.identNumber = slave.setPrmTelegram.identNumber = 0x059B
        slave.name = "encoder"
        # As the slave sees it: input is what it takes.
        slave.inputSize = slave.outputSize = 4
        slave.setCfgDataElements([DpCfgDataElement(0xF1)])
        slave.setUserPrmData(parameters.octets()[7:17] + bytes(8))
        slave.setGroupMask(1)
        slave.setSyncMode(True)
        slave.setFreezeMode(True)
        slave.setWatchdog(WATCHDOG_MS)
        self._master.addSlave(slave)
        self._master.initialize()
        self._slave: Any = slave
        self._out = bytes(4)

    def turn(self) -> int | None:
        """Runs the master once; a position, where data came."""
        self._slave.setMasterOutData(bytearray(self._out))
        self._master.run()
        data = self._slave.getMasterInData()
        time.sleep(0.0005)
        if data is None:
            return None
        expect("length of the data", len(data), 4)
        return int.from_bytes(data, "big")

    def until(self, what: str, seconds: float, done: Callable[[], bool]) -> float:
        """Runs the master until something is so; the seconds that it took."""
        begin = time.time()
        while not done():
            if time.time() - begin > seconds:
                raise Wrong(f"{what}: not within {seconds:g} s")
            self.turn()
        return time.time() - begin

    def position(self) -> int:
        """The next position that the master passes on."""
        deadline = time.time() + BRING_UP_SECONDS
        while time.time() < deadline:
            if (position := self.turn()) is not None:
                return position
        raise Wrong(f"the master passed no data on for {BRING_UP_SECONDS:g} s")

    def after(self, out: int) -> int:
        """The position in the answer to given outputs."""
        self._out = out.to_bytes(4, "big")
        begin = len(self.conversation())

        def is_sent() -> bool:
            telegrams = self.conversation()[begin:]
            return any(seen.is_ours and seen.octets[7:-2] == self._out for seen in telegrams)

        self.until(f"a telegram with the outputs {self._out.hex(' ')}", 2.0, is_sent)
        return self.position()

    def diagnoses(self, begin: int = 0) -> list[Diagnosis]:
        """The diagnoses that the master has read since entry `begin` of the conversation."""
        found = []
        for seen in self.conversation()[begin:]:
            if not seen.is_ours and seen.octets[0] == 0x68:
                try:
                    telegram = Telegram.parse(seen.octets)
                except BookViolation:
                    # A master that is late gives an answer up in its midst, and asks again.
                    continue
                if telegram.ssap == 0x3C:
                    found.append(Diagnosis.parse(telegram.data))
        return found

    # --- Steps

    def comes_to_data_exchange(self, parameters: Parameters) -> str:
        """By pyprofibus's own state machine."""
        self.configure(parameters)
        begin = len(self.conversation())
        took = self.until("data exchange", BRING_UP_SECONDS, self._slave.isConnected)
        self.position()
        sent = [seen.octets for seen in self.conversation()[begin:] if seen.is_ours]
        diagnosis = self.diagnoses(begin)[-1]
        expect("head of the last diagnosis", diagnosis.head, RUNNING)
        expect("n and T", (diagnosis.steps, diagnosis.total), (parameters.steps, parameters.total))
        return f"in {1000 * took:.0f} ms with {len(sent)} requests; {diagnosis.head.hex(' ')}"

    def follow(self, parameters: Parameters) -> str:
        """A shaft that turns once a second: the positions must keep step."""
        return in_three_attempts(lambda: self.five_positions(parameters))

    def five_positions(self, parameters: Parameters) -> str:
        """Five of them, and how far it is from one to the next."""
        seen = []
        for _ in range(5):
            position = self.position()
            seen.append((self.conversation()[-1].at, position))
            begin = time.time()
            while time.time() - begin < 0.2:
                self.turn()
        moved = []
        for (before, old), (after, new) in zip(seen, seen[1:], strict=False):
            due = parameters.steps * (after - before)
            step = (new - old) % parameters.total
            # The position may be older than the moment when the master passes it on.
            slack = 0.15 * due + 0.1 * parameters.steps
            expect_within("steps between two positions", step, due - slack, due + slack)
            moved.append(f"+{step}")
        return f"{seen[0][1]}, then {', '.join(moved)}"

    def presets(self, parameters: Parameters) -> str:
        """The value with the top bit, then without."""
        return in_three_attempts(lambda: self.preset_42_on_the_fly(parameters))

    def preset_42_on_the_fly(self, parameters: Parameters) -> str:
        """The clock bit, and where the shaft is then."""
        self.after(0)
        first = self.after(TOP | 42)
        second = self.after(42)
        expect_within("position in the answer", first, 42, 42 + 0.1 * parameters.steps)
        expect_within("position without the top bit", second, first, 42 + 0.3 * parameters.steps)
        return f"{first}, then {second}"

    def holds_the_watchdog(self) -> str:
        """As long as the master runs, and not much longer."""
        begin = len(self.conversation())
        end = time.time() + 2 * WATCHDOG_MS / 1000
        while time.time() < end:
            self.turn()
        heads = {diagnosis.head for diagnosis in self.diagnoses(begin)}
        expect("diagnoses of another kind meanwhile", heads - {RUNNING}, set())
        time.sleep(1.5 * WATCHDOG_MS / 1000)
        with contextlib.redirect_stdout(io.StringIO()):
            took = self.until(
                "a diagnosis with Prm_Req",
                BRING_UP_SECONDS,
                lambda: any(d.waits_for_parameters for d in self.diagnoses(begin)),
            )
            self.until("data exchange again", BRING_UP_SECONDS, self._runs_since(begin))
        return f"found out {1000 * took:.0f} ms after a pause, and came up again"

    def _runs_since(self, begin: int) -> Callable[[], bool]:
        """Whether the slave was seen without parameters, and then in data exchange."""

        def runs() -> bool:
            heads = [diagnosis.head for diagnosis in self.diagnoses(begin)]
            return RUNNING in heads and self._slave.isConnected()

        return runs

    def reads_the_diagnosis_when_the_code_jumps(self) -> str:
        begin = len(self.conversation())
        left = self.began_at + JUMP_AFTER + 2 - time.time()
        with contextlib.redirect_stdout(io.StringIO()):
            self.until(
                "a diagnosis with the alarm",
                left,
                lambda: any(diagnosis.alarms for diagnosis in self.diagnoses(begin)),
            )
            self.until(
                "a diagnosis without the alarm",
                4.0,
                lambda: self.diagnoses(begin)[-1].alarms == 0,
            )
        first, last = self.diagnoses(begin)[0], self.diagnoses(begin)[-1]
        expect("first diagnosis", first.head, b"\x08" + RUNNING[1:])
        expect("last diagnosis", last.head, RUNNING)
        self.position()
        return f"{first.head.hex(' ')} with octet 8 01, then {last.head.hex(' ')} with 00"

    def learns_that_its_parameters_were_refused(self) -> str:
        """It asks for the diagnosis only after its configuration was acknowledged."""
        begin = len(self.conversation())
        self.configure(Parameters(steps=3600, total=536_870_912))
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            self.until(
                "a diagnosis with Prm_Fault",
                BRING_UP_SECONDS,
                lambda: any(d.head == PRM_FAULT for d in self.diagnoses(begin)),
            )
            self.until(
                "word of the master about it",
                1.0,
                lambda: "faulty parameterization" in said.getvalue(),
            )
        return said.getvalue().splitlines()[0]

    def leaves(self) -> str:
        """Ends the program."""
        self.close()
        return self.process.terminate()

    def close(self) -> None:
        """Closes the line, where it is open."""
        if self._phy is not None:
            self._phy.close()
            self._phy = None

    def run(self, model: str, parameters: Parameters, faults: Sequence[str] = ()) -> None:
        """All steps with one model, the last with refused parameters where that is possible."""
        start = Start(model=model, shaft="turn rpm=60", pty=self._path, faults=faults)
        try:
            arguments = " ".join(start.arguments()[1:])
            self.step(f"starts {arguments}", lambda: self.starts(start), vital=True)
            self.step(
                "comes to data exchange",
                lambda: self.comes_to_data_exchange(parameters),
                vital=True,
            )
            self.step("follows the shaft", lambda: self.follow(parameters))
            self.step("presets", lambda: self.presets(parameters))
            self.named(self.holds_the_watchdog)
            if faults:
                self.named(self.reads_the_diagnosis_when_the_code_jumps)
            self.named(self.learns_that_its_parameters_were_refused)
            self.step(
                "comes to data exchange afterwards",
                lambda: self.comes_to_data_exchange(parameters),
            )
            self.step("leaves on SIGTERM", self.leaves)
        except Ended:
            # The failed step was counted.
            pass
        finally:
            self.close()
            self.process.end()


def main() -> int:
    """Runs the session; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    log_name = "codewheel-pyprofibus-session.log"
    arguments = arguments_of(parser, log_name, "telegrams in hexadecimal")
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        messages_path = Path(directory) / "messages"
        with messages_path.open("w") as messages:
            process = Process(arguments.program.resolve(), messages)
            session = PyprofibusSession(process, log, Path(directory))
            session.run("amg11-p29", EXAMPLE, jumps(JUMP_AFTER))
            session.run("heag162-p18", Parameters(steps=262_144, total=262_144))
        if session.failed:
            tail = messages_path.read_text(errors="replace").splitlines()[-15:]
            print("the program's last messages:", *(tail or ["(none)"]), sep="\n  ")
        print(f"the telegrams are in {arguments.log}")
        print(f"{session.passed} passed, {session.failed} failed")
    return 1 if session.failed else 0


if __name__ == "__main__":
    sys.exit(main())
