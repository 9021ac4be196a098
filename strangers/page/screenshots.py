#!/usr/bin/env python3
"""Makes the pictures of the page in docs/images, light and dark, from what it really shows.

Usage: screenshots.py [PROGRAM] [--seconds S]

    python3 -m venv venv && venv/bin/pip install -r strangers/page/requirements.txt
    cargo build --release && venv/bin/python strangers/page/screenshots.py

Runs the demo plant, lets it turn for some seconds and takes the overview and one encoder.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
import time
from pathlib import Path

from browser import Served, chromium, opened
from PIL import Image
from playwright.sync_api import Page
from steps import default_program

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
STEPS = 8192
SIZE = {"width": 1280, "height": 800}


def make_small(path: Path) -> None:
    """Leaves a picture as many colours as a flat page needs, which is a third of the octets."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


def swing_in_the_middle(page: Page) -> None:
    """Lets an encoder swing around the middle of its range, so that its curve does not wrap."""
    page.get_by_role("button", name="Rest", exact=True).click()
    page.locator(".measured .reading", has_text=re.compile(r"Speed\s*0\.0")).wait_for()
    field = page.get_by_label("The position here becomes")
    field.fill(str(STEPS // 2))
    field.press("Enter")
    page.get_by_text("Not saved", exact=False).wait_for()
    page.get_by_role("button", name="Swing", exact=True).click()


def main() -> int:
    parser = argparse.ArgumentParser(description="Makes the pictures of the page.")
    parser.add_argument("program", nargs="?", type=Path, default=default_program())
    parser.add_argument("--seconds", type=float, default=60, help="how long the trend becomes")
    arguments = parser.parse_args()
    # The page shows the name of the file as it was given.
    plant = Path("examples/demo.toml")
    with (
        tempfile.TemporaryDirectory() as folder,
        chromium() as browser,
        Served(arguments.program, plant, Path(folder) / "messages.log", folder=ROOT) as served,
    ):
        pages = []
        for scheme in ("light", "dark"):
            overview = opened(browser, served.address, "#/", SIZE, scheme)
            # The one that swings has a curve to look at.
            encoder = opened(browser, served.address, "#/", SIZE, scheme)
            encoder.locator(".card h3 a").nth(1).click()
            encoder.wait_for_selector(".object-table")
            pages += [(f"page-overview-{scheme}", overview), (f"page-encoder-{scheme}", encoder)]
        swing_in_the_middle(pages[1][1])
        time.sleep(arguments.seconds)
        for name, page in pages:
            path = IMAGES / f"{name}.png"
            page.bring_to_front()
            page.mouse.move(0, 0)
            page.evaluate("scrollTo(0, 0)")
            page.screenshot(path=path)
            make_small(path)
            print(f"{path.relative_to(ROOT)}: {path.stat().st_size} octets")
    return 0


if __name__ == "__main__":
    sys.exit(main())
