"""What all walks through a PROFIBUS encoder share: the program on its line, what steps often do.

No script to run: `profibus_session.py` and `profibus_chapters.py` build on it.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

import profibus_book as book
from profibus_book import (
    BookViolation,
    Diagnosis,
    Master,
    Parameters,
    Refused,
    Seen,
    Silence,
    Wire,
)
from steps import Process, Steps, Wrong, expect, shown

ADDRESS = 7
OUR_ADDRESS = 2
STRANGER_ADDRESS = 3

# What octets 1 to 4 of the diagnosis say in each state.
POWER_ON = bytes.fromhex("02 05 00 FF")
PRM_FAULT = bytes.fromhex("42 05 00 FF")
CFG_FAULT = bytes.fromhex("06 05 00 FF")
NOT_SUPPORTED = bytes.fromhex("52 05 00 FF")
PARAMETERISED = bytes([0x02, 0x04, 0x00, OUR_ADDRESS])
RUNNING = bytes([0x00, 0x04, 0x00, OUR_ADDRESS])

# Where the shaft rests in most runs: no round number, far from the zero of the code.
STILL_AT = 100_000


@dataclass(frozen=True)
class Geometry:
    """A code disc with its turns, and what the diagnosis says about it."""

    steps: int
    turns: int
    type_octet: int
    turns_shown: int

    @property
    def codes(self) -> int:
        """How many positions it tells apart."""
        return self.steps * self.turns

    @property
    def default(self) -> Parameters:
        """The parameters of the GSD file."""
        return Parameters(steps=self.steps, total=self.codes)


SINGLETURN_13 = Geometry(8192, 1, 0x00, 0x0000)
SINGLETURN_18 = Geometry(262_144, 1, 0x00, 0x0000)
MULTITURN_29 = Geometry(8192, 65_536, 0x01, 0xFFFF)
GEOMETRIES = {"13": SINGLETURN_13, "18": SINGLETURN_18, "29": MULTITURN_29}


# By how much a code jumps that a shaft cannot turn between two samples.
JUMP = 4000


def jumps(seconds: float) -> list[str]:
    """Faults: the code jumps, and back, and there again, 100 ms apart.

    Only samples less than 2.5 ms apart tell a jump from a turn, and a busy machine may be too late
    for one of them.
    """
    there = [JUMP, -JUMP, JUMP]
    moments = [round(1000 * seconds) + 100 * number for number in range(3)]
    return [f"jump steps={steps} at={at}ms" for steps, at in zip(there, moments, strict=True)]


@dataclass(frozen=True)
class Start:
    """How an encoder is started."""

    model: str = "amg11-p29"
    shaft: str = f"still angle={STILL_AT}"
    address: int = ADDRESS
    # A path makes a pty of that name, None a TCP port.
    pty: Path | None = None
    baud: str = "19200"
    memory: Path | None = None
    faults: Sequence[str] = field(default_factory=tuple)

    @property
    def geometry(self) -> Geometry:
        """By the number in the model."""
        return GEOMETRIES[self.model[-2:]]

    @property
    def bus(self) -> str:
        """The URI of the line."""
        return f"rs485-listen:pty:{self.pty}" if self.pty else "rs485-listen:127.0.0.1:0"

    def arguments(self) -> list[str]:
        """The command line after the program."""
        command = ["encoder", self.model, "--bus", self.bus, "--address", str(self.address)]
        command += ["--baud", self.baud, "--shaft", self.shaft]
        command += ["--memory", str(self.memory)] if self.memory else []
        for fault in self.faults:
            command += ["--fault", fault]
        return command


class Walk(Steps):
    """Steps through what a running PROFIBUS encoder should do; each prints one line."""

    wrongs = (*Steps.wrongs, BookViolation, Refused, Silence)

    def __init__(self, process: Process, log: TextIO) -> None:
        super().__init__(process)
        self._log = log
        self._wire: Wire | None = None
        self.started = Start()
        self.began_at = 0.0

    def conversation(self) -> Sequence[Seen]:
        """The telegrams of this run."""
        return [] if self._wire is None else self.wire.seen

    # --- The frame around the steps

    @property
    def wire(self) -> Wire:
        """The line, once the program runs."""
        assert self._wire is not None
        return self._wire

    def begin(self, start: Start) -> None:
        """Starts an encoder and joins its line, as a step."""
        self.step(
            f"starts {' '.join(start.arguments()[1:])}", lambda: self.start(start), vital=True
        )

    def start(self, start: Start) -> str:
        """Starts an encoder and joins its line."""
        self.started = start
        self.began_at = time.time()
        line = self.process.launch(start.arguments())
        wanted = f"ready {start.model} address {start.address} on rs485-listen:"
        wanted += f"pty:{start.pty}" if start.pty else "127.0.0.1:"
        if not line.startswith(wanted):
            raise Wrong(f"the first line on stdout: expected '{wanted}…', got '{line}'")
        if start.pty:
            self._wire = Wire.over_serial(str(start.pty), int(start.baud), self._log)
        else:
            self._wire = Wire.over_tcp("127.0.0.1", int(line.rpartition(":")[2]), self._log)
        self._log.write(f"# {line}\n")
        self.master = Master(self.wire, OUR_ADDRESS, start.address)
        self.stranger = Master(self.wire, STRANGER_ADDRESS, start.address)
        return line

    def stop(self) -> str:
        """Ends the program."""
        self.leave_bus()
        return self.process.terminate()

    def leave_bus(self) -> None:
        """Closes the line, where it is open."""
        if self._wire is not None:
            # The program may have closed it first; the next steps tell why.
            with contextlib.suppress(OSError):
                self._wire.close()
            self._wire = None

    def end(self) -> None:
        """The last step of a run."""
        self.step("leaves on SIGTERM", self.stop)

    def chapter(self, name: str) -> None:
        """A headline."""
        print(f"--     {name}", flush=True)

    @contextlib.contextmanager
    def running_run(self, start: Start) -> Iterator[None]:
        """A run of steps with an encoder of its own; a vital failure ends this run only."""
        try:
            self.begin(start)
            yield
            self.end()
        finally:
            self.leave_bus()
            self.process.end()

    # --- States

    @property
    def geometry(self) -> Geometry:
        """Of the encoder that runs."""
        return self.started.geometry

    @property
    def default(self) -> Parameters:
        """Parameters of the GSD file for the encoder that runs."""
        return self.geometry.default

    def release(self) -> None:
        """Wherever it is, the slave waits for parameters afterwards, and a pause has passed."""
        time.sleep(0.06)
        self.master.frame_count = self.stranger.frame_count = None
        owner = self.master.slave_diag().octet(4)
        if owner == book.NO_MASTER:
            owner = self.master.own
        master = Master(self.wire, owner, self.started.address)
        # Nothing is left of refused parameters or a preset out of range after good ones of class 1.
        master.set_prm(Parameters(class_2=False, min_tsdr=0, length=9))
        master.unlock()
        self.expect_head(POWER_ON, "octets 1 to 4 of the diagnosis after Unlock")

    def fresh(self, action: Callable[[], str]) -> None:
        """A step like `named` that begins while the slave waits for parameters."""

        def inside() -> str:
            self.release()
            return action()

        self.step(action.__name__.replace("_", " "), inside)

    def state(self) -> str:
        """The state that the diagnosis shows, asked by the stranger, who changes nothing."""
        diagnosis = self.stranger.slave_diag()
        if diagnosis.waits_for_parameters:
            return "WAIT_PRM"
        return "WAIT_CFG" if diagnosis.is_not_ready else "DATA_EXCH"

    def to(
        self, state: str, parameters: Parameters | None = None, configuration: int = 0xF1
    ) -> None:
        """From WAIT_PRM to a state, as master."""
        if state in ("WAIT_CFG", "DATA_EXCH"):
            self.master.set_prm(parameters or self.default)
        if state == "DATA_EXCH":
            self.master.chk_cfg(configuration)
        if state == "refused":
            self.master.set_prm(Parameters(ident=0x0001))
        expect("state", self.state(), "WAIT_PRM" if state == "refused" else state)

    def expect_head(self, wanted: bytes, what: str = "octets 1 to 4 of the diagnosis") -> Diagnosis:
        """Reads the diagnosis as master and compares its head."""
        diagnosis = self.master.slave_diag()
        expect(what, diagnosis.head, wanted)
        return diagnosis

    def expect_rs(self, action: Callable[[], object], what: str) -> None:
        """Runs what must be answered RS."""
        try:
            answer = action()
        except Refused as refused:
            expect(f"answer to {what}", book.RESPONSES[refused.function], "RS")
            return
        raise Wrong(f"{what} should have been answered RS, but was {shown(answer)}")

    def message_since(self, mark: int, wanted: str) -> str:
        """A line on stderr since `mark` that contains `wanted`."""
        deadline = time.time() + 1.0
        while True:
            lines = self.messages()[mark:]
            for line in lines:
                if wanted in line:
                    return line.strip()
            if time.time() > deadline:
                raise Wrong(f"no line on stderr says '{wanted}'; it says {lines or 'nothing'}")
            time.sleep(0.02)

    def messages(self) -> list[str]:
        """The lines of the program on stderr."""
        return self.process.messages_path.read_text(errors="replace").splitlines()
