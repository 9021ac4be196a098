"""The links by which python-can finds an encoder, besides SLCAN over TCP, which every walk uses.

Usage: python_can_links.py [PROGRAM] [--log FILE]

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) as an AMG 11 D29,
once behind an SLCAN adapter at a pty and once behind a socketcand server, and plays the master with
python-can's own interfaces for these. Each step prints one line, `ok` or `FAILED`, with what was
seen. All frames go to FILE as candump -L lines.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TextIO

import can

import devicenet_master as book
from devicenet_master import BookViolation, Frame, Master, Refused, Silence, Wire
from steps import Process, Steps, Wrong, arguments_of, expect
from walkthrough import ADDRESS, CONNECTION, EXPECTED_PACKET_RATE, OUR_MAC, POLL_CONNECTION
from walkthrough import free_port, uint, unsigned

MODEL = "amg11-d29"
STILL_AT = 100_000
POLLS = 50
# The duplicate MAC ID check takes 2 s; before it is over nothing is answered.
ON_LINE_SECONDS = 10.0


class Links(Steps):
    """One encoder, one link, the same steps each time."""

    wrongs = (*Steps.wrongs, BookViolation, Refused, Silence, can.CanError)

    def __init__(self, process: Process, log: TextIO) -> None:
        super().__init__(process)
        self._log = log
        self._bus: can.BusABC | None = None

    def conversation(self) -> Sequence[Frame]:
        """The frames since the bus was joined."""
        return [] if self._bus is None else self.wire.seen

    def over(self, uri: str, join: Callable[[], can.BusABC]) -> None:
        """The steps over the bus `uri`, which `join` joins as python-can does."""
        self.step(f"starts on {uri}", partial(self.start, uri, join), vital=True)
        self.named(self.allocates_and_polls)
        self.named(self.polls_again_and_again)
        self.step("a second python-can joins after the first has left", partial(self.rejoin, join))
        self.named(self.polls_again_and_again)
        self.step("leaves when asked to", self.stop)

    def start(self, uri: str, join: Callable[[], can.BusABC]) -> str:
        """Starts the program and joins its bus."""
        shaft = f"still angle={STILL_AT}"
        command = ["encoder", MODEL, "--bus", uri, "--address", str(ADDRESS), "--shaft", shaft]
        line = self.process.launch(command)
        expect("the first line on stdout", line, f"ready {MODEL} address {ADDRESS} on {uri}")
        self.join(join)
        return line

    def join(self, join: Callable[[], can.BusABC]) -> None:
        """Joins the bus as its only client."""
        self._bus = join()
        self.wire = Wire(self._bus, self._log)
        self.master = Master(self.wire, OUR_MAC, ADDRESS)

    def allocates_and_polls(self) -> str:
        """Explicit and poll connections, and one poll."""
        end = time.monotonic() + ON_LINE_SECONDS
        while True:
            try:
                self.master.allocate(book.EXPLICIT | book.POLL)
                break
            except Silence:
                if time.monotonic() > end:
                    raise Wrong(f"not on-line within {ON_LINE_SECONDS:g} s") from None
        rate = self.master.set(CONNECTION, POLL_CONNECTION, EXPECTED_PACKET_RATE, uint(10_000))
        expect("packet rate granted", unsigned(rate, 2), 10_000)
        return f"position {self.polled()}"

    def polls_again_and_again(self) -> str:
        """As fast as answers come."""
        begin = time.monotonic()
        for _ in range(POLLS):
            self.polled()
        took = 1000 * (time.monotonic() - begin) / POLLS
        return f"{POLLS} polls, {took:.1f} ms each"

    def polled(self) -> int:
        """The position of one poll."""
        position = unsigned(self.master.poll().data, 4)
        expect("position", position, STILL_AT)
        return position

    def rejoin(self, join: Callable[[], can.BusABC]) -> str:
        """Leaves the bus and joins it anew; the connections of the encoder outlive that."""
        self.leave_bus()
        self.join(join)
        return f"position {self.polled()}"

    def stop(self) -> str:
        """Ends the program."""
        self.leave_bus()
        return self.process.terminate()

    def leave_bus(self) -> None:
        """Closes the bus, where it is open."""
        if self._bus is not None:
            # The program may have closed it first; the steps tell why.
            with contextlib.suppress(can.CanError, OSError):
                self._bus.shutdown()
            self._bus = None


def over_a_pty(links: Links, folder: Path) -> None:
    """python-can's `slcan` interface at a serial port."""
    path = folder / "adapter"
    links.over(
        f"slcan-listen:pty:{path}",
        lambda: can.Bus(str(path), interface="slcan", bitrate=125_000, sleep_after_open=0),
    )


def over_socketcand(links: Links) -> None:
    """python-can's `socketcand` interface."""
    port = free_port()
    links.over(
        f"socketcand-listen:127.0.0.1:{port}",
        lambda: can.Bus("can0", interface="socketcand", host="127.0.0.1", port=port),
    )


def main() -> int:
    """Walks over both links; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments = arguments_of(parser, "codewheel-python-can-links.log", "candump -L lines")
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        messages_path = Path(directory) / "messages"
        with messages_path.open("w") as messages:
            process = Process(arguments.program.resolve(), messages)
            links = Links(process, log)
            try:
                over_a_pty(links, Path(directory))
                over_socketcand(links)
            finally:
                links.leave_bus()
                process.end()
                if links.failed:
                    tail = messages_path.read_text(errors="replace").splitlines()[-15:]
                    print("the program's last messages:", *(tail or ["(none)"]), sep="\n  ")
                print(f"the frames are in {arguments.log}")
                print(f"{links.passed} passed, {links.failed} failed")
    return 1 if links.failed else 0


if __name__ == "__main__":
    sys.exit(main())
