"""What both walks through the commissioning verbs share: the program as a tool that is run.

No script to run: `commission_devicenet.py` and `commission_profibus.py` build on it.
"""

from __future__ import annotations

import contextlib
import json
import shlex
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TextIO, TypeVar

from commission_segment import Heard, Medium, Visit
from steps import SHOWN_ENTRIES, Process, Steps, Wrong, expect

Message = TypeVar("Message")
Object = dict[str, Any]

OK, DIFFERS, USAGE, BUS, REFUSED, TIME_OUT = range(6)
# A verb that takes longer has hung.
HUNG_SECONDS = 90.0


@dataclass
class Outcome:
    """How the program ended."""

    arguments: Sequence[str]
    status: int
    out: str
    err: str
    seconds: float

    def ended(self, status: int, *words: str) -> Outcome:
        """Raises `Wrong` unless it ended so, and said these words on stderr, in any case."""
        if self.status != status:
            raise Wrong(f"{self}: expected exit status {status}")
        for word in words:
            if word.lower() not in self.err.lower():
                raise Wrong(f"{self}: expected '{word}' on stderr")
        return self

    def within(self, seconds: float) -> Outcome:
        """Raises `Wrong` where it took longer."""
        if self.seconds > seconds:
            raise Wrong(f"{self}: took {self.seconds:.1f} s, expected {seconds:g} s at most")
        return self

    @property
    def objects(self) -> list[Object]:
        """Its JSON, an object a line; every line must be one."""
        try:
            objects = [json.loads(line) for line in self.out.splitlines()]
        except ValueError as error:
            raise Wrong(f"{self}: stdout is no JSON: {error}") from None
        if not all(isinstance(each, dict) for each in objects):
            raise Wrong(f"{self}: a line of stdout is no object")
        return objects

    @property
    def object(self) -> Object:
        """Its JSON, which must be one line."""
        objects = self.objects
        if len(objects) != 1:
            raise Wrong(f"{self}: expected one object")
        return objects[0]

    @property
    def error(self) -> Object:
        """The error as JSON: the last line of stderr."""
        lines = self.err.splitlines()
        try:
            return json.loads(lines[-1])["error"]
        except (IndexError, ValueError, KeyError, TypeError):
            raise Wrong(f"{self}: the last line of stderr is no JSON with an error") from None

    @property
    def value(self) -> str:
        """Stdout, which must be one line."""
        if self.out.count("\n") != 1:
            raise Wrong(f"{self}: expected one line on stdout")
        return self.out.strip()

    def __str__(self) -> str:
        said = " | ".join(self.err.splitlines()) or "nothing"
        out = " | ".join(self.out.splitlines())
        out = out if len(out) <= 600 else out[:600] + "…"
        return f"'{shlex.join(self.arguments)}' exit {self.status}, stderr: {said}, stdout: {out}"


class Walk(Steps, Generic[Message]):
    """Steps in which the program is run against strangers on a medium."""

    def __init__(self, program: Path, messages: TextIO, log: TextIO) -> None:
        super().__init__(Process(program, messages))
        self.program = program
        self._log = log
        self._medium: Medium[Message] | None = None

    @property
    def bus(self) -> list[str]:
        """The options that lead to the medium."""
        raise NotImplementedError

    def conversation(self) -> Sequence[Heard[Message]]:
        """What has gone by on the medium."""
        return [] if self._medium is None else self._medium.heard

    def show_conversation(self, begin: int) -> None:
        """The last messages of a step, with who sent them."""
        entries = self.conversation()[begin:][-SHOWN_ENTRIES:]
        for entry in entries:
            whose = "node   " if entry.guest is None else f"guest {entry.guest.number}"
            before = 1000 * (entry.at - entries[-1].at)
            print(f"       {whose} {before:8.1f} ms  {entry}", flush=True)

    @property
    def medium(self) -> Medium[Message]:
        """The medium, while there is one."""
        assert self._medium is not None
        return self._medium

    def chapter(self, name: str) -> None:
        """A headline."""
        print(f"--     {name}", flush=True)

    # --- Running the program

    def run(self, *arguments: str, seconds: float = HUNG_SECONDS) -> Outcome:
        """Runs a verb to its end, without a terminal."""
        begin = time.monotonic()
        try:
            done = subprocess.run(
                [str(self.program), *arguments],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise Wrong(f"'{shlex.join(arguments)}' still runs after {seconds:g} s") from None
        took = time.monotonic() - begin
        outcome = Outcome(arguments, done.returncode, done.stdout, done.stderr, took)
        self._log.write(f"# {outcome}\n")
        if "panicked" in outcome.err:
            raise Wrong(f"{outcome}: it panicked")
        return outcome

    def verb(self, *arguments: str, address: int | None = None, **options: float) -> Outcome:
        """Runs a verb on the medium."""
        at = [] if address is None else ["--address", str(address)]
        return self.run(*arguments, *self.bus, *at, **options)

    def undo(self, outcome: Outcome) -> list[Outcome]:
        """Runs the commands that undo it; scripts need `--yes`."""
        done = []
        for command in outcome.object["undo"]:
            words = shlex.split(command)
            expect("first word of the undo command", words[0], "codewheel")
            yes = [] if "--yes" in words else ["--yes"]
            done.append(self.run(*words[1:], *yes).ended(OK))
        return done

    @contextlib.contextmanager
    def running(self, *arguments: str) -> Iterator[subprocess.Popen[str]]:
        """Runs a verb beside the walk; it is killed where it still runs at the end."""
        process = subprocess.Popen(
            [str(self.program), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()
            process.communicate()

    @staticmethod
    def interrupt(process: subprocess.Popen[str], seconds: float = 5.0) -> tuple[int, float]:
        """Ctrl-C; returns the exit status and how long it took to leave."""
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        try:
            status = process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise Wrong(f"it still runs {seconds:g} s after Ctrl-C") from None
        return status, time.monotonic() - begin

    def visit(self) -> Visit[Message]:
        """From now on, what new guests do."""
        return Visit(self.medium)


def soon(condition: Callable[[], bool], what: str, seconds: float = 10.0) -> None:
    """Waits until something is so."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise Wrong(f"{what} did not come about within {seconds:g} s")
        time.sleep(0.01)


def expect_keys(what: str, seen: Object, wanted: str) -> None:
    """Compares the keys of an object, in any order."""
    expect(f"keys of {what}", sorted(seen), sorted(wanted.split()))
