"""What every walk shares, whatever its bus: the program as a process, steps with a line each.

No script to run: `walkthrough.py` (DeviceNet) and `profibus_walk.py` build on it.
"""

from __future__ import annotations

import argparse
import contextlib
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol, TextIO

# How much of a conversation is printed with a failure; all of it is in the log.
SHOWN_ENTRIES = 40
READY_SECONDS = 10.0


class Wrong(Exception):
    """Something else was seen than what the book asks for."""


class Ended(SystemExit):
    """A vital step failed, so the run has no sense any more."""


def expect(what: str, seen: object, wanted: object) -> None:
    """Raises `Wrong` with both values where they differ."""
    if seen != wanted:
        raise Wrong(f"{what}: expected {shown(wanted)}, got {shown(seen)}")


def shown(value: object) -> str:
    """A value for people: octets in hexadecimal."""
    if isinstance(value, bytes):
        return f"[{value.hex(' ')}]"
    return repr(value)


def expect_within(what: str, seen: float, low: float, high: float) -> None:
    """Raises `Wrong` where `seen` is outside low … high."""
    if not low <= seen <= high:
        raise Wrong(f"{what}: expected {low:g} … {high:g}, got {seen:g}")


def position_at(
    raw: int,
    steps: int,
    total: int,
    offset: int = 0,
    clockwise: bool = True,
    disc: int = 8192,
) -> int:
    """The position of a shaft that stands at `raw`, in the first run of the raw code.

    ⌊r·n/S⌋ clockwise, −⌈r·n/S⌉ the other way, into the measuring range, then the offset; `disc` is
    S, the steps per turn of the code disc.
    """
    unwrapped = raw * steps // disc if clockwise else -raw * steps // disc
    return (unwrapped % total + offset) % total


def in_three_attempts(action: Callable[[], str]) -> str:
    """For what is judged by the clock on the wall: a busy machine may hold an answer up."""
    for _ in range(2):
        with contextlib.suppress(Wrong):
            return action()
    return action()


class Process:
    """The program under test."""

    def __init__(self, path: Path, messages: TextIO) -> None:
        self.path = path
        self.messages = messages
        self.messages_path = Path(messages.name)
        self._process: subprocess.Popen[str] | None = None

    def launch(self, arguments: Sequence[str]) -> str:
        """Starts it and waits until it says that it is ready; returns that line."""
        self._process = subprocess.Popen(
            [str(self.path), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self.messages,
            text=True,
        )
        return self._first_line()

    def _first_line(self) -> str:
        assert self._process is not None and self._process.stdout is not None
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            if not selector.select(READY_SECONDS):
                raise Wrong(f"the program said nothing on stdout for {READY_SECONDS:g} s")
        line = self._process.stdout.readline()
        if not line:
            status = self._process.wait(5)
            raise Wrong(f"the program left with exit status {status} before it was ready")
        return line.rstrip("\n")

    def lines(self) -> Iterator[str]:
        """What it says on stdout after the first line, as it comes, until it ends."""
        assert self._process is not None and self._process.stdout is not None
        # A stream that `end` has closed is at its end, too.
        with contextlib.suppress(ValueError):
            yield from self._process.stdout

    def exit_status(self) -> int | None:
        """None while it runs or was not started. A program just dying gets a moment for it."""
        if self._process is None:
            return None
        try:
            return self._process.wait(0.3)
        except subprocess.TimeoutExpired:
            return None

    def terminate(self) -> str:
        """Asks it to leave, which it must do with exit status 0 within 5 s."""
        assert self._process is not None
        if (status := self._process.poll()) is not None:
            raise Wrong(f"the program left by itself with exit status {status}")
        begin = time.monotonic()
        self._process.send_signal(signal.SIGTERM)
        try:
            status = self._process.wait(5)
        except subprocess.TimeoutExpired:
            raise Wrong("the program still runs 5 s after SIGTERM") from None
        expect("exit status after SIGTERM", status, 0)
        self.end()
        return f"exit status 0 after {time.monotonic() - begin:.2f} s"

    def end(self) -> None:
        """Leaves no process behind, whatever happened: it is killed where it still runs."""
        if self._process is not None:
            if self._process.poll() is None:
                self._process.kill()
            self._process.wait()
            if self._process.stdout is not None:
                self._process.stdout.close()
            self._process = None


class Entry(Protocol):
    """One frame or telegram of a conversation; its `str` is what the log has."""

    @property
    def at(self) -> float:
        """The host's time in seconds."""

    @property
    def is_ours(self) -> bool:
        """Whether the master sent it."""


class Steps:
    """Steps through what a running program should do; each prints one line."""

    # What a step may raise when the program, not the step, is wrong.
    wrongs: tuple[type[Exception], ...] = (Wrong, OSError)

    def __init__(self, process: Process) -> None:
        self.process = process
        self.passed = 0
        self.failed = 0

    def conversation(self) -> Sequence[Entry]:
        """What has gone over the bus since this run began."""
        raise NotImplementedError

    def step(self, name: str, action: Callable[[], str], vital: bool = False) -> None:
        """Runs a step and prints its line. A vital step that fails ends the session."""
        begin = len(self.conversation())
        try:
            seen = action()
        except self.wrongs as error:
            self.failed += 1
            died = self.process.exit_status()
            reason = "" if died is None else f" (the program has left with exit status {died})"
            print(f"FAILED {name}: {error}{reason}", flush=True)
            self.show_conversation(begin)
            if vital or died is not None:
                raise Ended(1) from None
            return
        self.passed += 1
        print(f"ok     {name}: {seen}", flush=True)

    def named(self, action: Callable[[], str], vital: bool = False) -> None:
        """A step that is called like its method."""
        self.step(action.__name__.replace("_", " "), action, vital)

    def show_conversation(self, begin: int) -> None:
        """The last entries of a step, from `begin` on, with milliseconds before the last."""
        entries = self.conversation()[begin:][-SHOWN_ENTRIES:]
        for entry in entries:
            whose = "master " if entry.is_ours else "encoder"
            before = 1000 * (entry.at - entries[-1].at)
            print(f"       {whose} {before:8.1f} ms  {entry}", flush=True)


def default_program() -> Path:
    """The release build where there is one, else the debug build."""
    target = Path(__file__).resolve().parent.parent / "target"
    release = target / "release" / "codewheel"
    return release if release.exists() else target / "debug" / "codewheel"


def arguments_of(parser: argparse.ArgumentParser, log: str, lines: str) -> argparse.Namespace:
    """What every walk is told: the program, and the file for what is heard, as `lines`."""
    parser.add_argument("program", nargs="?", type=Path, default=default_program())
    path = Path(tempfile.gettempdir()) / log
    parser.add_argument("--log", type=Path, default=path, help=lines)
    arguments = parser.parse_args()
    # So that the program is ended, too.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    if not arguments.program.is_file():
        parser.error(f"no program at {arguments.program}; build it with 'cargo build' first")
    return arguments
