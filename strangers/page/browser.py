"""What the walks and the screenshots share: the program with its page, and a browser before it.

No script to run: `page_walk.py` and `screenshots.py` build on it. It lets them import what stands
beside this folder.
"""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from playwright.sync_api import Browser, Locator, Page, sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from steps import Wrong  # noqa: E402

CHROMIUM = "/usr/bin/chromium"
SWITCHES = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
READY_SECONDS = 20.0
PATIENCE = 5.0

WIDE = {"width": 1280, "height": 800}
PHONE = {"width": 390, "height": 844}


class Served:
    """The program with its page."""

    def __init__(
        self, program: Path, plant: Path, log: Path, *options: str, folder: Path | None = None
    ) -> None:
        """Starts a plant with its page, at a free port unless `options` name one, in `folder`."""
        where = () if "--listen" in options else ("--listen", "127.0.0.1:0")
        arguments = [program.absolute(), "run", plant, *where, *options]
        self._log = log
        with log.open("w") as messages:
            self._process = subprocess.Popen(
                [str(argument) for argument in arguments],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=messages,
            )
        try:
            self.address = self._told_address()
        except BaseException:
            self.end()
            raise

    def _told_address(self) -> str:
        """Where the page is, as the program tells it in its messages."""
        end = time.monotonic() + READY_SECONDS
        while time.monotonic() < end:
            told = self._log.read_text()
            if found := re.search(r"page (http://\S+)", told):
                return found.group(1).rstrip("/")
            if (status := self._process.poll()) is not None:
                raise SystemExit(f"the program left with exit status {status}:\n{told}")
            time.sleep(0.05)
        raise SystemExit(f"no page after {READY_SECONDS:g} s:\n{self._log.read_text()}")

    @property
    def port(self) -> int:
        """The port of the page."""
        return int(self.address.rsplit(":", 1)[1])

    def exit_status(self) -> int | None:
        """None while it runs."""
        return self._process.poll()

    def end(self) -> None:
        """Leaves no process behind."""
        self._process.terminate()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


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
    context = browser.new_context(viewport=size, color_scheme=scheme, has_touch=size["width"] < 500)
    page = context.new_page()
    heard = complaints if complaints is not None else []
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.on(
        "console",
        lambda message: (
            heard.append(message.text) if message.type in ("error", "warning") else None
        ),
    )
    page.goto(f"{address}/{route}")
    page.wait_for_selector("html[data-link=live]")
    return page


def number(locator: Locator) -> int | None:
    """A whole number as the page writes it; None where it shows that there is none."""
    text = re.sub(r"[\s\u202f]", "", locator.inner_text()).replace("\u2212", "-")
    return int(text) if re.fullmatch(r"-?\d+", text) else None


def until(
    what: str, seen: Callable[[], object], wanted: object, seconds: float = PATIENCE
) -> object:
    """Waits until `seen` is `wanted`, or until it is true of it where that can be called."""
    end = time.monotonic() + seconds
    while True:
        now = seen()
        if wanted(now) if callable(wanted) else now == wanted:
            return now
        if time.monotonic() > end:
            asked = "what was wanted did not come" if callable(wanted) else f"expected {wanted!r}"
            raise Wrong(f"{what}: {asked} within {seconds:g} s, got {now!r}")
        time.sleep(0.03)
