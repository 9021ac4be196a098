#!/usr/bin/env python3
"""What 100 encoders cost a computer, with a page that watches them and without. Linux only.

    cargo build --release && host/dashboard/benches/load.py [--seconds 15] [--rounds 3] [--streams 1]

Runs examples/hundred.toml and reads, in turns, how much processor time the program takes while
nobody looks and while somebody reads the events. Prints shares of one core. Both are from the same
run, so a machine that is busy with other things shows in both. The last table says which thread
takes how much while somebody looks.
"""

import argparse
import contextlib
import http.client
import json
import os
import subprocess
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TICK = 1 / os.sysconf("SC_CLK_TCK")


class Reader(threading.Thread):
    """Reads the events until it is told to stop."""

    def __init__(self, address, query):
        super().__init__(daemon=True)
        self.connection = http.client.HTTPConnection(address, timeout=10)
        self.query = query
        self.stopped = False
        self.octets = 0
        self.moments = []

    def run(self):
        self.connection.request("GET", "/api/v1/events" + self.query)
        response = self.connection.getresponse()
        with contextlib.suppress(OSError, ValueError, AttributeError):
            while not self.stopped:
                line = response.readline()
                self.octets += len(line)
                if line == b"event: state\n":
                    self.moments.append(time.monotonic())

    def stop(self):
        self.stopped = True
        self.join(5)
        self.connection.close()


def times(pid):
    """Processor seconds of each thread so far, by number and name."""
    taken = {}
    for task in Path(f"/proc/{pid}/task").iterdir():
        name, _, rest = (task / "stat").read_text().partition("(")[2].rpartition(") ")
        fields = rest.split()
        taken[int(task.name), name] = (int(fields[11]) + int(fields[12])) * TICK
    return taken


def measure(pid, seconds):
    """The share of a core that each thread takes for so long."""
    before, begin = times(pid), time.monotonic()
    time.sleep(seconds)
    after, lasted = times(pid), time.monotonic() - begin
    return {task: (taken - before.get(task, 0)) / lasted for task, taken in after.items()}


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--program", default=ROOT / "target/release/codewheel")
    options.add_argument("--plant", default=ROOT / "examples/hundred.toml")
    options.add_argument("--seconds", type=float, default=15)
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--streams", type=int, default=1)
    options.add_argument("--query", default="")
    options = options.parse_args()
    program = subprocess.Popen(
        [options.program, "run", options.plant, "--listen", "127.0.0.1:0"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        address = None
        for line in program.stderr:
            if line.startswith("codewheel: page http://"):
                address = line.strip().removeprefix("codewheel: page http://")
                break
        threading.Thread(target=program.stderr.read, daemon=True).start()
        connection = http.client.HTTPConnection(address)
        connection.request("GET", "/api/v1/plant")
        plant = json.load(connection.getresponse())
        connection.close()
        devices = sum(len(bus["devices"]) for bus in plant["buses"])
        print(f"{devices} encoders on {len(plant['buses'])} buses, {options.streams} streams")
        time.sleep(3)
        threads = {}
        for number in range(options.rounds):
            alone = sum(measure(program.pid, options.seconds).values())
            readers = [Reader(address, options.query) for _ in range(options.streams)]
            for reader in readers:
                reader.start()
            time.sleep(1)
            counted = [(reader.octets, len(reader.moments)) for reader in readers]
            threads = measure(program.pid, options.seconds)
            watched = sum(threads.values())
            octets = sum(r.octets - octets for r, (octets, _) in zip(readers, counted))
            told = sum(len(r.moments) - told for r, (_, told) in zip(readers, counted))
            gaps = [b - a for r in readers for a, b in zip(r.moments, r.moments[1:])]
            for reader in readers:
                reader.stop()
            print(
                f"round {number + 1}: nobody looks {alone:6.1%}, watched {watched:6.1%} of a core; "
                f"{told / options.seconds / options.streams:.1f} states a second and "
                f"{octets / options.seconds / options.streams / 1000:.0f} kB/s a stream, "
                f"longest gap {max(gaps, default=0) * 1000:.0f} ms"
            )
            time.sleep(1)
        for (task, name), share in sorted(threads.items(), key=lambda item: -item[1])[:10]:
            print(f"  {share:6.1%}  {name} ({'main' if task == program.pid else task})")
    finally:
        program.terminate()
        program.wait(10)


if __name__ == "__main__":
    main()
