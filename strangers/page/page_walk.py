"""A stranger before the page: what people see, turn, set and break, in a browser that is not ours.

Usage: page_walk.py [PROGRAM] [--log FILE]

    python3 -m venv venv && venv/bin/pip install -r strangers/page/requirements.txt
    cargo build && venv/bin/python strangers/page/page_walk.py

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) with plant.toml and
opens its page in Chromium. Each step prints one line, `ok` or `FAILED`, with what was seen. The
messages of the program go to FILE.
"""

from __future__ import annotations

import argparse
import http.client
import json
import re
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, CDPSession, Locator, Page
from playwright.sync_api import Error as BrowserError

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from browser import PHONE, WIDE, Served, chromium, opened  # noqa: E402
from steps import Steps, Wrong, arguments_of, expect, expect_within, in_three_attempts  # noqa: E402

STEPS = 8192
PATIENCE = 5.0
LATENCY_MS = 150
HUNDRED = 100
# With a hundred encoders: two pictures may be missed now and then, and half a core is enough.
FRAME_MS, SHARE = 50, 0.5


def number(locator: Locator) -> int | None:
    """A whole number as the page writes it; None where it shows that there is none."""
    text = re.sub(r"[\s\u202f]", "", locator.inner_text()).replace("\u2212", "-")
    return int(text) if re.fullmatch(r"-?\d+", text) else None


def until(what: str, seen: Callable[[], object], wanted: object, seconds: float = PATIENCE) -> object:
    """Waits until `seen` is `wanted`, or until it is true of it where that can be called."""
    end = time.monotonic() + seconds
    while True:
        now = seen()
        if wanted(now) if callable(wanted) else now == wanted:
            return now
        if time.monotonic() > end:
            asked = "something else" if callable(wanted) else repr(wanted)
            raise Wrong(f"{what}: expected {asked} within {seconds:g} s, got {now!r}")
        time.sleep(0.03)


def spent(metrics: CDPSession) -> float:
    """Seconds of a processor that the main thread of the page has taken."""
    told = metrics.send("Performance.getMetrics")["metrics"]
    return next(metric["value"] for metric in told if metric["name"] == "TaskDuration")


class PageWalk(Steps):
    """The steps before one page. They build on each other, in the order of `run`."""

    wrongs = (*Steps.wrongs, BrowserError)

    def __init__(self, served: Served, browser: Browser) -> None:
        super().__init__(served)  # type: ignore[arg-type]
        self.served = served
        self.browser = browser
        self.complaints: list[str] = []
        self.asked: list[str] = []
        self.page = opened(browser, served.address, complaints=self.complaints)
        self.page.on("request", lambda request: self.asked.append(request.url))

    def conversation(self) -> list[object]:
        return []

    def panel(self, name: str) -> Locator:
        return self.page.get_by_role("region", name=name, exact=True)

    @property
    def position(self) -> Locator:
        return self.panel("Measured").locator(".position-own .huge .number")

    @property
    def polled(self) -> Locator:
        return self.panel("Measured").locator(".position-polled .number")

    @property
    def dial(self) -> Locator:
        return self.page.get_by_role("slider", name="Shaft")

    def needle(self) -> float:
        """Where the needle of the large dial points, in degrees."""
        turned = self.page.locator(".dial.large > .needle").get_attribute("transform") or ""
        found = re.search(r"rotate\(([-\d.]+)\)", turned)
        return float(found.group(1)) if found else -1.0

    def settled(self) -> int:
        """The position of a shaft that has come to rest."""
        last = number(self.position)
        for _ in range(60):
            time.sleep(0.2)
            now = number(self.position)
            if now == last and now is not None:
                return now
            last = now
        raise Wrong("the shaft does not come to rest")

    def outcome(self, panel: str) -> str:
        return self.panel(panel).locator(".outcome").filter(has_text=re.compile(".")).first.inner_text()

    # --- Finding the way

    def shows_every_encoder(self) -> str:
        cards = self.page.locator(".card")
        until("cards", cards.count, 4)
        for place in range(4):
            until(f"card {place}", lambda at=place: number(cards.nth(at).locator(".big")), lambda n: n is not None)
        buses = [self.page.get_by_role("region", name=name).count() for name in ("line", "field")]
        expect("regions of the buses", buses, [1, 1])
        return self.page.locator(".counts").inner_text()

    def opens_an_encoder_with_the_keyboard_and_goes_back(self) -> str:
        page = self.page
        page.locator("body").press("Tab")
        expect("first stop", page.evaluate("document.activeElement.textContent"), "Skip to the content")
        for _ in range(20):
            page.keyboard.press("Tab")
            if page.evaluate("document.activeElement.textContent") == "drive":
                break
        page.keyboard.press("Enter")
        page.wait_for_url("**/#/line/drive")
        until("focus", lambda: page.evaluate("document.activeElement.tagName"), "H1")
        page.go_back()
        until("heading", lambda: page.get_by_role("heading", level=1).inner_text(), "Encoders")
        page.go_forward()
        until("heading", lambda: page.get_by_role("heading", level=1).inner_text(), "drive")
        return "by Tab and Enter, and back and forward by the history"

    # --- Turning

    def turns_by_the_keys(self) -> str:
        self.dial.focus()
        seen = []
        for key, by in (("ArrowRight", STEPS // 360), ("Shift+ArrowRight", STEPS // 4),
                        ("PageUp", STEPS), ("PageDown", -STEPS), ("Shift+ArrowLeft", -STEPS // 4)):
            before = self.settled()
            self.page.keyboard.press(key)
            # Parts of a step wait, so that 360 degrees are a turn.
            until(key, lambda: number(self.position), lambda now: abs(now - before - by) <= 1)
            seen.append(f"{key} {self.settled() - before:+}")
        return ", ".join(seen)

    def dial_and_polled_value_and_trend_follow(self) -> str:
        self.dial.focus()
        self.page.keyboard.press("Shift+ArrowRight")
        position = self.settled()
        until("polled value", lambda: number(self.polled), position)
        degrees = position % STEPS / STEPS * 360
        until("needle", self.needle, lambda now: abs(now - degrees) < 0.5)
        now = self.panel("Measured").locator(".extremes td").nth(1)
        until("trend", lambda: number(now), position)
        shown = self.page.locator(".chart .curve").get_attribute("d") or ""
        if shown.count("L") < 5:
            raise Wrong(f"the curve has no points: {shown!r}")
        return f"position {position}, needle {degrees:.1f}°, polled and trend the same"

    def turns_under_the_mouse(self) -> str:
        box = self.dial.bounding_box()
        assert box is not None
        x, y, radius = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, box["width"] * 0.35
        before = self.settled()
        mouse = self.page.mouse
        mouse.move(x, y - radius)
        mouse.down()
        mouse.move(x + radius * 0.7071, y - radius * 0.7071, steps=8)
        mouse.move(x + radius, y, steps=8)
        mouse.up()
        way = self.settled() - before
        expect_within("a quarter turn in steps", way, STEPS / 4 - 60, STEPS / 4 + 60)
        return f"a quarter turn to the right: {way:+} steps"

    def a_key_press_is_seen_soon(self) -> str:
        self.dial.focus()
        self.settled()
        self.page.evaluate(
            """() => {
                window.seen = [];
                let pressed = null;
                addEventListener("keydown", () => (pressed = performance.now()), true);
                new MutationObserver(() => {
                    if (pressed !== null) window.seen.push(performance.now() - pressed);
                    pressed = null;
                }).observe(document.querySelector(".position-own .huge .number"),
                    { childList: true, characterData: true, subtree: true });
            }"""
        )
        for press in range(15):
            self.page.keyboard.press("ArrowRight" if press % 2 else "ArrowLeft")
            # Not in step with the pictures of the plant.
            time.sleep(0.4 + 0.013 * press)
        seen = self.page.evaluate("window.seen")
        expect("presses that were seen", len(seen), 15)
        median = statistics.median(seen)
        if median > LATENCY_MS:
            raise Wrong(f"median {median:.0f} ms, wanted at most {LATENCY_MS} ms")
        return f"median {median:.0f} ms, longest {max(seen):.0f} ms"

    def follows_a_motion_and_rests(self) -> str:
        field = self.page.get_by_label("Another motion")
        field.fill("turn rpm=nonsense")
        field.press("Enter")
        refused = until("refusal", lambda: self.outcome("Shaft"), lambda text: text.startswith("Refused"))
        field.fill("turn rpm=60")
        field.press("Enter")
        speed = self.panel("Measured").locator(".reading").filter(has_text="rpm").locator(".number")
        until("speed", speed.inner_text, lambda text: 55 < float(text) < 65)
        self.dial.focus()
        self.page.keyboard.press("Home")
        until("speed", speed.inner_text, "0.0")
        return f"{refused!r}; 60 rpm; Home stops it"

    # --- Preset, memory, power

    def preset(self, value: str) -> None:
        field = self.page.get_by_label("The position here becomes")
        field.fill(value)
        field.press("Enter")

    def memory_button(self, name: str) -> None:
        self.panel("Preset and memory").get_by_role("button", name=name, exact=True).click()

    def power_off_and_on(self) -> None:
        power = self.panel("Device").locator(".power")
        power.click()
        until("power", lambda: power.get_attribute("aria-pressed"), "false")
        until("position without power", lambda: number(self.position), None)
        power.click()
        until("power", lambda: power.get_attribute("aria-pressed"), "true")
        until("position", lambda: number(self.position), lambda now: now is not None)

    def loses_a_preset_that_was_not_saved(self) -> str:
        self.memory_button("Save")
        time.sleep(0.3)
        before = self.settled()
        self.preset("1000h")
        until("position", lambda: number(self.position), 4096)
        unsaved = self.panel("Preset and memory").locator(".unsaved")
        told = until("unsaved", unsaved.inner_text, lambda text: text.startswith("Not saved"))
        self.power_off_and_on()
        until("position after the power cut", lambda: number(self.position), before)
        return f"4096, then {before} again; {told!r}"

    def keeps_a_preset_that_was_saved(self) -> str:
        writes = self.panel("Preset and memory").locator(".reading").filter(has_text="Writes").locator(".number")
        before = number(writes)
        self.preset("777")
        until("position", lambda: number(self.position), 777)
        self.memory_button("Save")
        until("writes", lambda: number(writes), lambda now: now > before)
        self.power_off_and_on()
        until("position after the power cut", lambda: number(self.position), 777)
        until("polled value", lambda: number(self.polled), 777)
        return f"777 before and after; writes {before} → {number(writes)}"

    def refuses_in_words(self) -> str:
        seen = []
        for value in ("999999999", "99999999999", "a lot"):
            self.preset(value)
            told = until("refusal", lambda: self.outcome("Preset and memory"),
                         lambda text, value=value: text.startswith("Refused") and value in text)
            seen.append(repr(told))
            expect("position", number(self.position), 777)
        return ", ".join(seen)

    def power_without_switching_shows_the_shaft_all_the_same(self) -> str:
        seen = self.needle()
        self.panel("Device").locator(".power").click()
        until("position without power", lambda: number(self.position), None)
        until("lamp", self.panel("Device").locator(".lamp").inner_text, "off")
        expect_within("needle without power", self.needle(), seen - 1, seen + 1)
        self.panel("Device").locator(".power").click()
        until("position", lambda: number(self.position), 777)
        return f"needle at {seen:.1f}° with and without power"

    # --- Settings

    def changes_a_setting_and_shows_old_and_new(self) -> str:
        objects = self.panel("Objects")
        objects.get_by_role("button", name="Change Steps per turn").click()
        field = objects.get_by_label("Steps per turn in step")
        field.fill("9000")
        field.press("Enter")
        row = objects.locator(".editor:visible")
        refused = until("refusal", row.locator(".outcome").inner_text, lambda text: text.startswith("Refused"))
        field.fill("3600")
        difference = row.locator(".difference").inner_text()
        if "8\u202f192" not in difference or "3\u202f600" not in difference:
            raise Wrong(f"the difference says {difference!r}")
        field.press("Enter")
        value = objects.locator("tr").filter(has_text="steps-per-turn").locator(".value").first
        until("value", value.inner_text, lambda text: text.startswith("3\u202f600"))
        self.memory_button("Restore")
        until("value", value.inner_text, lambda text: text.startswith("8\u202f192"))
        return f"{refused!r}; {difference!r}; Restore brought 8192 back"

    def switches_act_at_the_next_power_up(self) -> str:
        units = self.page.get_by_role("spinbutton", name=re.compile("switch 2"))
        address = self.panel("Device").locator(".reading").filter(has_text="Address").locator(".number")
        units.focus()
        self.page.keyboard.press("ArrowUp")
        until("switch", lambda: units.get_attribute("aria-valuenow"), "6")
        pending = self.panel("Device").locator(".pending")
        told = until("pending", pending.inner_text, lambda text: "06" in text)
        self.power_off_and_on()
        until("pending", pending.inner_text, lambda text: "06" not in text)
        until("address", address.inner_text, "6")
        units.focus()
        self.page.keyboard.press("5")
        until("switch", lambda: units.get_attribute("aria-valuenow"), "5")
        self.power_off_and_on()
        until("polled value", lambda: number(self.polled), lambda now: now is not None)
        return repr(told)

    # --- Faults, trace

    def provokes_an_alarm_that_ends_by_itself(self) -> str:
        lever = self.panel("Faults to provoke").get_by_role("listitem").filter(has_text="steps").first
        lever.get_by_label("steps").fill("4000")
        lever.get_by_role("button", name=re.compile("Provoke")).click()
        health = self.panel("Device").locator(".health")
        until("health", health.inner_text, lambda text: text.startswith("Alarm"))
        begin = time.monotonic()
        until("health", health.inner_text, lambda text: text.startswith("No alarm"))
        lasted = time.monotonic() - begin
        expect_within("seconds of alarm", lasted, 1.5, 4.0)
        events = self.panel("Events").locator("li").all_inner_texts()
        return f"{lasted:.1f} s; {events[0]!r}"

    def provokes_and_clears_a_fault_that_lasts(self) -> str:
        lever = self.panel("Faults to provoke").locator(".lever").filter(
            has=self.page.get_by_role("button", name=re.compile("Provoke:.*(holds|stuck|sensor)", re.I))
        ).first
        title = lever.get_by_role("heading").inner_text()
        lever.get_by_role("button", name=re.compile("Provoke")).click()
        badge = lever.locator(".standing")
        until("badge", badge.inner_text, "active")
        lever.get_by_role("button", name=re.compile("Clear")).click()
        until("badge", lambda: badge.text_content(), "")
        return title

    def traces_the_bus_only_while_it_listens(self) -> str:
        trace = self.panel("Trace")
        trace.get_by_role("button", name="Listen").click()
        rows = trace.locator("tbody tr:visible")
        trace.get_by_label("Filter").fill("response position")
        until("lines", rows.count, lambda count: count > 5)
        trace.get_by_role("button", name="Pause").click()
        time.sleep(0.3)
        cells = rows.first.locator("td").all_inner_texts()
        position = str(number(self.position))
        if position not in cells[4]:
            raise Wrong(f"no position {position} in {cells}")
        trace.get_by_role("button", name="Stop").click()
        return " | ".join(cells)

    # --- All the same whatever the bus

    def presets_on_profibus_through_the_master(self) -> str:
        self.page.goto(f"{self.served.address}/#/field/crane")
        until("heading", lambda: self.page.get_by_role("heading", level=1).inner_text(), "crane")
        until("polled value", lambda: number(self.polled), lambda now: now is not None)
        self.preset("4242")
        until("position", lambda: number(self.position), 4242)
        until("polled value", lambda: number(self.polled), 4242)
        return "4242 in the encoder and at the master"

    def asks_nobody_but_the_plant(self) -> str:
        strange = [url for url in self.asked if not url.startswith(self.served.address)]
        expect("other addresses", strange, [])
        return f"{len(self.asked)} requests"

    def the_console_is_quiet(self) -> str:
        # A browser notes each refused request; those were asked for.
        strange = [text for text in self.complaints if "Failed to load resource" not in text]
        expect("complaints", strange, [])
        return "no error, no warning"

    def run(self) -> None:
        self.named(self.shows_every_encoder, vital=True)
        self.named(self.opens_an_encoder_with_the_keyboard_and_goes_back, vital=True)
        self.named(self.turns_by_the_keys)
        self.named(self.dial_and_polled_value_and_trend_follow)
        self.named(self.turns_under_the_mouse)
        self.named(self.a_key_press_is_seen_soon)
        self.named(self.follows_a_motion_and_rests)
        self.named(self.loses_a_preset_that_was_not_saved)
        self.named(self.keeps_a_preset_that_was_saved)
        self.named(self.refuses_in_words)
        self.named(self.power_without_switching_shows_the_shaft_all_the_same)
        self.named(self.changes_a_setting_and_shows_old_and_new)
        self.named(self.switches_act_at_the_next_power_up)
        self.named(self.provokes_an_alarm_that_ends_by_itself)
        self.named(self.provokes_and_clears_a_fault_that_lasts)
        self.named(self.traces_the_bus_only_while_it_listens)
        self.named(self.presets_on_profibus_through_the_master)
        self.named(self.asks_nobody_but_the_plant)
        self.named(self.the_console_is_quiet)


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
                    f"{rule['id']}: {node['target']} {node['any'][:1] and node['any'][0]['message']}"
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

    def asked(self, headers: dict[str, str], method: str = "GET", path: str = "/api/v1/plant") -> int:
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
        first = Served(program, HERE / "plant.toml", self.folder / "gone.log")
        page = opened(self.browser, first.address)
        first.end()
        banner = page.get_by_role("alert")
        told = until("banner", banner.inner_text, lambda text: "does not answer" in text)
        again = ("--listen", f"127.0.0.1:{first.port}")
        with Served(program, HERE / "plant.toml", self.folder / "back.log", *again):
            until("link", lambda: page.evaluate("document.documentElement.dataset.link"), "live", 15)
            until("banner", banner.count, 0)
        page.context.close()
        return repr(told)

    def read_only_says_why(self, program: Path) -> str:
        with Served(program, HERE / "plant.toml", self.folder / "read.log", "--read-only") as served:
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
        told = (f"picture every {median:.1f} ms, 95 % within {late:.1f} ms, "
                f"main thread {share * 100:.0f} % of a core")
        if late > FRAME_MS or share > SHARE:
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
        self.named(self.refuses_a_forged_host_or_origin)
        for check in (self.says_when_the_plant_is_gone_and_comes_back, self.read_only_says_why,
                      self.a_hundred_encoders_stay_fluid):
            self.step(check.__name__.replace("_", " "), partial(check, program))


def hundred() -> str:
    """A plant of a hundred encoders that turn, on two buses of each kind."""
    buses = [("east", "devicenet"), ("west", "devicenet"), ("north", "profibus"), ("south", "profibus")]
    parts = []
    for bus, kind in buses:
        is_devicenet = kind == "devicenet"
        rate = "500k" if is_devicenet else "1.5M"
        model = "amg11-d29" if is_devicenet else "amg11-p29"
        master = "scanner" if is_devicenet else "dp-master"
        interval = 'interval = "50ms"\n' if is_devicenet else ""
        parts.append(f'[[bus]]\nname = "{bus}"\nkind = "{kind}"\nuri = "virtual:{bus}"\nbaud = "{rate}"\n')
        for address in range(3, 3 + HUNDRED // len(buses)):
            parts.append(
                f'[[device]]\nbus = "{bus}"\nname = "{bus}-{address}"\nmodel = "{model}"\n'
                f'address = {address}\nshaft = "turn rpm={address * 7}"\n'
            )
        parts.append(f'[[master]]\nbus = "{bus}"\nkind = "{master}"\naddress = 1\n{interval}')
    return "\n".join(parts)


def main() -> int:
    parser = argparse.ArgumentParser(description="A stranger before the page.")
    arguments = arguments_of(parser, "codewheel-page.log", "the messages of the program")
    plant = HERE / "plant.toml"
    with (
        tempfile.TemporaryDirectory() as folder,
        chromium() as browser,
        Served(arguments.program, plant, arguments.log) as served,
    ):
        walk = PageWalk(served, browser)
        walk.run()
        around = Surroundings(served, browser, Path(folder))
        around.run(arguments.program)
    passed, failed = walk.passed + around.passed, walk.failed + around.failed
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
