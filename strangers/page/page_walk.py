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
import re
import statistics
import sys
import tempfile
import time
from pathlib import Path

from browser import Served, chromium, number, opened, until
from playwright.sync_api import Browser, Locator
from playwright.sync_api import Error as BrowserError
from steps import Steps, Wrong, arguments_of, expect, expect_within
from surroundings import PLANT, Surroundings

STEPS = 8192
# The goal for the median from a key press to the changed number. It is told beside what was
# measured; only a page that hangs fails.
LATENCY_MS, HUNG_MS = 150, 1500


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
        return (
            self.panel(panel)
            .locator(".outcome")
            .filter(has_text=re.compile("."))
            .first.inner_text()
        )

    # --- Finding the way

    def shows_every_encoder(self) -> str:
        cards = self.page.locator(".card")
        until("cards", cards.count, 4)
        for place in range(4):
            until(
                f"card {place}",
                lambda at=place: number(cards.nth(at).locator(".big")),
                lambda n: n is not None,
            )
        buses = [self.page.get_by_role("region", name=name).count() for name in ("line", "field")]
        expect("regions of the buses", buses, [1, 1])
        return self.page.locator(".counts").inner_text()

    def opens_an_encoder_with_the_keyboard_and_goes_back(self) -> str:
        page = self.page
        page.locator("body").press("Tab")
        expect(
            "first stop", page.evaluate("document.activeElement.textContent"), "Skip to the content"
        )
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
        for key, by in (
            ("ArrowRight", STEPS // 360),
            ("Shift+ArrowRight", STEPS // 4),
            ("PageUp", STEPS),
            ("PageDown", -STEPS),
            ("Shift+ArrowLeft", -STEPS // 4),
        ):
            before = self.settled()
            self.page.keyboard.press(key)
            # Parts of a step wait, so that 360 degrees are a turn.
            wanted = range(before + by - 1, before + by + 2)
            until(key, lambda: number(self.position), wanted.__contains__)
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
        x, y, radius = (
            box["x"] + box["width"] / 2,
            box["y"] + box["height"] / 2,
            box["width"] * 0.35,
        )
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
        if median > HUNG_MS:
            raise Wrong(f"median {median:.0f} ms, the goal is {LATENCY_MS} ms")
        return f"median {median:.0f} ms, longest {max(seen):.0f} ms; the goal is {LATENCY_MS} ms"

    def follows_a_motion_and_rests(self) -> str:
        field = self.page.get_by_label("Another motion")
        field.fill("turn rpm=nonsense")
        field.press("Enter")
        refused = until(
            "refusal", lambda: self.outcome("Shaft"), lambda text: text.startswith("Refused")
        )
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
        writes = (
            self.panel("Preset and memory")
            .locator(".reading")
            .filter(has_text="Writes")
            .locator(".number")
        )
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
            told = until(
                "refusal",
                lambda: self.outcome("Preset and memory"),
                lambda text, value=value: text.startswith("Refused") and value in text,
            )
            seen.append(repr(told))
            expect("position", number(self.position), 777)
        return ", ".join(seen)

    def shows_the_shaft_without_power_too(self) -> str:
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
        refused = until(
            "refusal", row.locator(".outcome").inner_text, lambda text: text.startswith("Refused")
        )
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
        address = (
            self.panel("Device").locator(".reading").filter(has_text="Address").locator(".number")
        )
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
        lever = (
            self.panel("Faults to provoke").get_by_role("listitem").filter(has_text="steps").first
        )
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
        lever = (
            self.panel("Faults to provoke")
            .locator(".lever")
            .filter(
                has=self.page.get_by_role(
                    "button", name=re.compile("Provoke:.*(holds|stuck|sensor)", re.I)
                )
            )
            .first
        )
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
        self.named(self.shows_the_shaft_without_power_too)
        self.named(self.changes_a_setting_and_shows_old_and_new)
        self.named(self.switches_act_at_the_next_power_up)
        self.named(self.provokes_an_alarm_that_ends_by_itself)
        self.named(self.provokes_and_clears_a_fault_that_lasts)
        self.named(self.traces_the_bus_only_while_it_listens)
        self.named(self.presets_on_profibus_through_the_master)
        self.named(self.asks_nobody_but_the_plant)
        self.named(self.the_console_is_quiet)


def main() -> int:
    parser = argparse.ArgumentParser(description="A stranger before the page.")
    arguments = arguments_of(parser, "codewheel-page.log", "the messages of the program")
    with (
        tempfile.TemporaryDirectory() as folder,
        chromium() as browser,
        Served(arguments.program, PLANT, arguments.log) as served,
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
