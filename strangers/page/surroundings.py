"""What is asked of the page besides: everybody can use it, nobody can forge, many fit on it.

No script to run: see `page_walk.py`.
"""

from __future__ import annotations

import http.client
import json
import statistics
import time
from functools import partial
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from browser import PHONE, WIDE, Served, number, opened, until
from playwright.sync_api import Browser, CDPSession, Page
from playwright.sync_api import Error as BrowserError
from steps import Steps, Wrong, expect, in_three_attempts

PLANT = Path(__file__).resolve().parent / "plant.toml"
HUNDRED = 100
# With a hundred encoders half a core is enough. That is judged by processor time; how often a
# picture comes is measured and told only, since a busy machine delays them all.
SHARE = 0.5


def spent(metrics: CDPSession) -> float:
    """Seconds of a processor that the main thread of the page has taken."""
    told = metrics.send("Performance.getMetrics")["metrics"]
    return next(metric["value"] for metric in told if metric["name"] == "TaskDuration")


class Surroundings(Steps):
    """What is asked of the page besides: everybody can use it, nobody can forge, many fit on it."""

    wrongs = (*Steps.wrongs, BrowserError)

    def __init__(self, served: Served, browser: Browser, folder: Path) -> None:
        super().__init__(served)  # type: ignore[arg-type]
        self.served = served
        self.browser = browser
        self.folder = folder

    def conversation(self) -> list[object]:
        return []

    def nothing_for_axe_to_find(self, route: str, scheme: str, size: dict[str, int]) -> str:
        page = opened(self.browser, self.served.address, route, size, scheme)
        try:
            page.wait_for_selector(".card .big" if route == "#/" else ".object-table")
            time.sleep(0.5)
            if route != "#/":
                page.get_by_role("button", name="Listen").click()
                page.get_by_role("button", name="Change Steps per turn").click()
            found = Axe().run(page)
            if found.violations_count:
                nodes = [
                    f"{rule['id']}: {node['target']} {node['failureSummary']}"
                    for rule in found.response["violations"]
                    for node in rule["nodes"][:3]
                ]
                raise Wrong("; ".join(nodes))
            wide = page.evaluate("document.documentElement.scrollWidth")
            expect("width of the document", wide, size["width"])
            return f"{len(found.response['passes'])} rules passed"
        finally:
            page.context.close()

    def nothing_moves_where_motion_is_not_wanted(self) -> str:
        page = opened(self.browser, self.served.address)
        page.emulate_media(reduced_motion="reduce")
        page.evaluate("document.querySelector('.lamp').dataset.pattern = 'slow'")
        name = page.evaluate("getComputedStyle(document.querySelector('.lamp-dot')).animationName")
        page.context.close()
        expect("animation of a lamp", name, "none")
        return "a flashing lamp is a steady dot beside its words"

    def asked(
        self, headers: dict[str, str], method: str = "GET", path: str = "/api/v1/plant"
    ) -> int:
        connection = http.client.HTTPConnection("127.0.0.1", self.served.port, timeout=5)
        body = json.dumps({"on": True}) if method != "GET" else None
        connection.putrequest(method, path, skip_host=True)
        sent = {"Host": f"127.0.0.1:{self.served.port}"} | headers
        if body is not None:
            sent = {"Content-Type": "application/json", "Content-Length": str(len(body))} | sent
        for name, value in sent.items():
            connection.putheader(name, value)
        connection.endheaders(body.encode() if body else None)
        status = connection.getresponse().status
        connection.close()
        return status

    def refuses_a_forged_host_or_origin(self) -> str:
        power = "/api/v1/buses/line/devices/drive/power"
        expect("honest", self.asked({}), 200)
        expect("honest write", self.asked({}, "PUT", power), 200)
        forged = {
            "host": self.asked({"Host": "rebound.example"}),
            "origin": self.asked({"Origin": "http://elsewhere.example"}),
            "origin of a write": self.asked({"Origin": "http://elsewhere.example"}, "PUT", power),
            "site of a write": self.asked({"Sec-Fetch-Site": "cross-site"}, "PUT", power),
            "form": self.asked({"Content-Type": "text/plain"}, "PUT", power),
        }
        for what, status in forged.items():
            if status not in (400, 403, 415, 421):
                raise Wrong(f"{what}: answered {status}")
        return ", ".join(f"{what} {status}" for what, status in forged.items())

    def says_when_the_plant_is_gone_and_comes_back(self, program: Path) -> str:
        first = Served(program, PLANT, self.folder / "gone.log")
        page = opened(self.browser, first.address)
        first.end()
        banner = page.get_by_role("alert")
        told = until("banner", banner.inner_text, lambda text: "does not answer" in text)
        again = ("--listen", f"127.0.0.1:{first.port}")
        with Served(program, PLANT, self.folder / "back.log", *again):
            until(
                "link", lambda: page.evaluate("document.documentElement.dataset.link"), "live", 15
            )
            until("banner", banner.count, 0)
        page.context.close()
        return repr(told)

    def lets_go_of_the_stream_while_nobody_looks(self) -> str:
        page = self.browser.new_page()
        page.clock.install()
        page.goto(self.served.address)
        told = page.locator("#stream-text")
        until("time", told.inner_text, lambda text: text.startswith("live"))
        hide = """(hidden) => {
            Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
            document.dispatchEvent(new Event("visibilitychange"));
        }"""
        page.evaluate(hide, True)
        page.clock.fast_forward(61_000)
        time.sleep(0.5)
        asleep = told.inner_text()
        time.sleep(2.5)
        expect("time of a page that sleeps", told.inner_text(), asleep)
        page.evaluate(hide, False)
        until("time", told.inner_text, lambda text: text not in (asleep, "lost"))
        page.close()
        return f"asleep at {asleep!r}, then live again"

    def read_only_says_why(self, program: Path) -> str:
        with Served(program, PLANT, self.folder / "read.log", "--read-only") as served:
            page = opened(self.browser, served.address, "#/line/drive")
            page.wait_for_selector(".object-table")
            expect("controls of the shaft", page.locator(".motion button:enabled").count(), 0)
            expect("power", page.locator(".device .power").is_enabled(), False)
            expect("changes", page.locator(".object-table button:enabled").count(), 0)
            told = page.locator(".notice").inner_text()
            page.context.close()
            whole = Surroundings(served, self.browser, self.folder)
            power = "/api/v1/buses/line/devices/drive/power"
            expect("a write", whole.asked({}, "PUT", power), 403)
        return repr(told)

    def a_hundred_encoders_stay_fluid(self, program: Path) -> str:
        plant = self.folder / "hundred.toml"
        plant.write_text(hundred())
        with Served(program, plant, self.folder / "hundred.log") as served:
            page = opened(self.browser, served.address)
            until("cards", page.locator(".card").count, HUNDRED)
            time.sleep(2)
            told = in_three_attempts(partial(self.fluid, page))
            moved = page.locator(".card .big").first
            before = number(moved)
            until("a position", lambda: number(moved), lambda now: now != before)
            page.context.close()
        return told

    def fluid(self, page: Page) -> str:
        """What the pictures of five seconds cost, in time of the processor and on the wall."""
        metrics = page.context.new_cdp_session(page)
        metrics.send("Performance.enable", {"timeDomain": "threadTicks"})
        begin = spent(metrics)
        gaps = page.evaluate(
            """() => new Promise((done) => {
                const gaps = [];
                const begin = performance.now();
                let last = begin;
                const picture = (now) => {
                    gaps.push(now - last);
                    last = now;
                    if (now - begin < 5000) requestAnimationFrame(picture);
                    else done(gaps.sort((a, b) => a - b));
                };
                requestAnimationFrame(picture);
            })"""
        )
        share = (spent(metrics) - begin) / 5
        median, late = statistics.median(gaps), gaps[int(len(gaps) * 0.95)]
        told = (
            f"picture every {median:.1f} ms, 95 % within {late:.1f} ms, "
            f"main thread {share * 100:.0f} % of a core"
        )
        if share > SHARE:
            raise Wrong(told)
        return told

    def run(self, program: Path) -> None:
        for route in ("#/", "#/line/drive", "#/field/converter"):
            for scheme in ("light", "dark"):
                for name, size in (("wide", WIDE), ("phone", PHONE)):
                    if "field" in route and (scheme, name) != ("light", "wide"):
                        continue
                    check = partial(self.nothing_for_axe_to_find, route, scheme, size)
                    self.step(f"nothing for axe to find, {route} {scheme} {name}", check)
        self.named(self.nothing_moves_where_motion_is_not_wanted)
        self.named(self.lets_go_of_the_stream_while_nobody_looks)
        self.named(self.refuses_a_forged_host_or_origin)
        for later in (
            self.says_when_the_plant_is_gone_and_comes_back,
            self.read_only_says_why,
            self.a_hundred_encoders_stay_fluid,
        ):
            self.step(later.__name__.replace("_", " "), partial(later, program))


def hundred() -> str:
    """A plant of a hundred encoders that turn, on two buses of each kind."""
    buses = [
        ("east", "devicenet"),
        ("west", "devicenet"),
        ("north", "profibus"),
        ("south", "profibus"),
    ]
    parts = []
    for bus, kind in buses:
        is_devicenet = kind == "devicenet"
        rate = "500k" if is_devicenet else "1.5M"
        model = "amg11-d29" if is_devicenet else "amg11-p29"
        master = "scanner" if is_devicenet else "dp-master"
        interval = 'interval = "50ms"\n' if is_devicenet else ""
        parts.append(
            f'[[bus]]\nname = "{bus}"\nkind = "{kind}"\nuri = "virtual:{bus}"\nbaud = "{rate}"\n'
        )
        for address in range(3, 3 + HUNDRED // len(buses)):
            parts.append(
                f'[[device]]\nbus = "{bus}"\nname = "{bus}-{address}"\nmodel = "{model}"\n'
                f'address = {address}\nshaft = "turn rpm={address * 7}"\n'
            )
        parts.append(f'[[master]]\nbus = "{bus}"\nkind = "{master}"\naddress = 1\n{interval}')
    return "\n".join(parts)
