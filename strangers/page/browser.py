"""What the walks and the screenshots share: the program with its page, and a browser before it.

No script to run: `page_walk.py` and `screenshots.py` build on it.
"""

from __future__ import annotations

import contextlib
import re
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from playwright.sync_api import Browser, Page, sync_playwright

CHROMIUM = "/usr/bin/chromium"
SWITCHES = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
READY_SECONDS = 20.0

WIDE = {"width": 1280, "height": 800}
PHONE = {"width": 390, "height": 844}


@contextlib.contextmanager
def serving(program: Path, plant: Path, messages: TextIO, *options: str) -> Iterator[str]:
    """Runs a plant with its page on a free port; yields the address of the page."""
    arguments = [program, "run", plant, "--listen", "127.0.0.1:0", "--quiet", *options]
    process = subprocess.Popen(
        [str(argument) for argument in arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=messages,
    )
    try:
        yield address_of(process, Path(messages.name))
    finally:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def address_of(process: subprocess.Popen[bytes], messages: Path) -> str:
    """The address that the program tells in its messages."""
    end = time.monotonic() + READY_SECONDS
    while time.monotonic() < end:
        if found := re.search(r"page (http://\S+)", messages.read_text()):
            return found.group(1).rstrip("/")
        if (status := process.poll()) is not None:
            raise SystemExit(
                f"the program left with exit status {status}:\n{messages.read_text()}"
            )
        time.sleep(0.05)
    raise SystemExit(f"no page after {READY_SECONDS:g} s:\n{messages.read_text()}")


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    """The browser of the system, without a window."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=SWITCHES)
        yield browser
        browser.close()


def opened(
    browser: Browser,
    address: str,
    route: str = "#/",
    size: dict[str, int] | None = None,
    scheme: str = "light",
    complaints: list[str] | None = None,
) -> Page:
    """A page that shows a view and is live; what the console complains of goes to `complaints`."""
    size = size or WIDE
    context = browser.new_context(
        viewport=size, color_scheme=scheme, has_touch=size["width"] < 500
    )
    page = context.new_page()
    heard = complaints if complaints is not None else []
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.on(
        "console",
        lambda message: heard.append(message.text) if message.type in ("error", "warning") else None,
    )
    page.goto(f"{address}/{route}")
    page.wait_for_selector("html[data-link=live]")
    return page
