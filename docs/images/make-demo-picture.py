#!/usr/bin/env python3
"""Makes demo.svg, the picture of the demo in README.md, from what the program really prints.

    cargo build --release && docs/images/make-demo-picture.py

Runs the program on a terminal of its own for some seconds, takes the last table it has drawn and
writes it as SVG. Needs Python 3.9 and a system with pseudo-terminals; no packages.
"""

import argparse
import fcntl
import os
import pty
import re
import select
import signal
import struct
import termios
import time
from html import escape
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROGRAM = HERE.parents[1] / "target/release/codewheel"

COLUMNS, ROWS = 160, 40
CELL, LINE, MARGIN, BAR = 7.8, 20, 18, 34

# Which sides of its cell a box character reaches: left, right, up, down.
SIDES = {
    "─": "LR", "═": "LR", "│": "UD", "┆": "UD", "╪": "LRUD", "╞": "RUD", "╡": "LUD",
    "┌": "RD", "┬": "LRD", "┐": "LD", "└": "RU", "┴": "LRU", "┘": "LU",
}
DOUBLE = "═╪╞╡"


def play(program: Path, seconds: float) -> str:
    """What the program writes to a terminal within `seconds`."""
    child, terminal = pty.fork()
    if child == 0:
        os.execv(program, [str(program), "--quiet"])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
    written = b""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if select.select([terminal], [], [], 0.1)[0]:
            try:
                written += os.read(terminal, 65536)
            except OSError:
                break
    os.kill(child, signal.SIGINT)
    os.waitpid(child, 0)
    return written.decode()


def last_table(written: str) -> list[str]:
    """The lines of the last whole table and of the buses below it, without control sequences."""
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", written)
    # What is followed by another table has been drawn to its end.
    tables = re.findall(r"┌[^┌]*?┘(?:\s+[^┌\n]* · [^┌\n]*)+(?=\s+┌)", plain)
    if not tables:
        raise SystemExit("the program has drawn no table")
    return [line.rstrip() for line in tables[-1].splitlines()]


def borders(lines: list[str]) -> tuple[list[str], list[str]]:
    """The box characters as path segments: solid ones, dotted ones."""
    solid, dotted = [], []
    for row, line in enumerate(lines):
        top = BAR + MARGIN + row * LINE
        middle = top + LINE / 2
        for column, character in enumerate(line):
            sides = SIDES.get(character)
            if sides is None:
                continue
            left = MARGIN + column * CELL
            centre = left + CELL / 2
            begin = left if "L" in sides else centre
            end = left + CELL if "R" in sides else centre
            if begin != end:
                for offset in (-1.5, 1.5) if character in DOUBLE else (0,):
                    solid.append(f"M{begin:.1f} {middle + offset:.1f}H{end:.1f}")
            up = top if "U" in sides else middle
            down = top + LINE if "D" in sides else middle
            if up != down:
                bars = dotted if character == "┆" else solid
                bars.append(f"M{centre:.1f} {up:.1f}V{down:.1f}")
    return solid, dotted


def words(lines: list[str]) -> list[str]:
    """The words as text elements, each where and as wide as its cells, whatever the font is."""
    elements = []
    for row, line in enumerate(lines):
        y = BAR + MARGIN + row * LINE + LINE * 0.7
        for word in re.finditer(rf"[^\s{''.join(SIDES)}]+", line):
            x, width = MARGIN + word.start() * CELL, len(word.group()) * CELL
            kind = ' class="head"' if row == 1 else ""
            elements.append(
                f'<text{kind} x="{x:.1f}" y="{y:.1f}" textLength="{width:.1f}"'
                f' lengthAdjust="spacingAndGlyphs">{escape(word.group())}</text>'
            )
    return elements


def picture(lines: list[str]) -> str:
    width = 2 * MARGIN + max(map(len, lines)) * CELL
    height = BAR + 2 * MARGIN + len(lines) * LINE
    solid, dotted = borders(lines)
    lights = "".join(
        f'<circle cx="{MARGIN + 4 + 18 * place}" cy="{BAR / 2}" r="5.5" fill="{colour}"/>'
        for place, colour in enumerate(["#f4665c", "#f5bd4f", "#61c554"])
    )
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}"'
        f' width="{width:.0f}" height="{height:.0f}" role="img">',
        "<title>The demo of codewheel: three encoders on DeviceNet, three on PROFIBUS</title>",
        "<style>text{font:13px ui-monospace,SFMono-Regular,Menlo,Consolas,'DejaVu Sans Mono',"
        "monospace;fill:#e6edf3}.head{fill:#7ee787;font-weight:bold}.bar{fill:#9aa4af}"
        "path{fill:none;stroke:#57606a}</style>",
        f'<rect x=".5" y=".5" width="{width - 1:.0f}" height="{height - 1:.0f}" rx="9"'
        ' fill="#0d1117" stroke="#57606a"/>',
        f'<path d="M.5 {BAR}H{width - 0.5:.0f}"/>{lights}',
        f'<text class="bar" x="{MARGIN + 66}" y="{BAR / 2 + 4.5}">$ cargo run --release</text>',
        f'<path d="{"".join(solid)}"/>',
        f'<path stroke-dasharray="3 3" d="{"".join(dotted)}"/>',
        *words(lines),
        "</svg>\n",
    ])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", nargs="?", type=Path, default=PROGRAM)
    parser.add_argument("--seconds", type=float, default=8.0, help="how long the demo runs")
    arguments = parser.parse_args()
    lines = last_table(play(arguments.program, arguments.seconds))
    target = HERE / "demo.svg"
    target.write_text(picture(lines), encoding="utf-8")
    print(target)


if __name__ == "__main__":
    main()
