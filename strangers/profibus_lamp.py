"""The lamp in the bus cover: chapter 9.5 of the manual. No script: see `profibus_chapters.py`."""

from __future__ import annotations

import json
import threading
import time
from pathlib import Path

import profibus_book as book
from profibus_book import Master, Parameters, Wire
from profibus_walk import ADDRESS, JUMP, OUR_ADDRESS, Walk
from steps import Wrong, expect

# The program tells once a second what each device shows.
TOLD_WITHIN = 1.3
JUMP_AFTER = 9.0
TOP = 0x8000_0000


class Lamp(Walk):
    """One encoder of a plant, whose lamp the program tells while a master drives it."""

    plant: Path = Path("plant.toml")

    def starts_a_plant_of_one(self) -> str:
        moments = [f"{JUMP_AFTER + number / 10:g}s" for number in range(3)]
        # One of them may come while a busy machine does not look at the shaft.
        faults = ", ".join(f'{{ at = "{at}", kind = "jump", steps = {JUMP} }}' for at in moments)
        self.plant.write_text(
            f"""
            [[bus]]
            name = "line"
            kind = "profibus"
            uri = "rs485-listen:127.0.0.1:0"

            [[device]]
            model = "amg11-p29"
            address = {ADDRESS}
            shaft = "turn rpm=60"
            fault = [{faults}]
            """
        )
        self.began_at = time.time()
        first = json.loads(self.process.launch(["run", "--json", str(self.plant)]))
        self.lamp = first["lamp"]
        port = int(first["uri"].rpartition(":")[2])
        threading.Thread(target=self._listen, daemon=True).start()
        self._wire = Wire.over_tcp("127.0.0.1", port, self._log)
        self.master = Master(self.wire, OUR_ADDRESS, ADDRESS)
        return f"{first['device']} on {first['uri']}, lamp {self.lamp}"

    def _listen(self) -> None:
        """Remembers the newest lamp."""
        for line in self.process.lines():
            told = json.loads(line)
            self.lamp = told.get("lamp", self.lamp)

    def expect_lamp(self, wanted: str, why: str, seconds: float = TOLD_WITHIN) -> None:
        """Exchanges data or reads diagnosis until the lamp is told, and compares it."""
        deadline = time.time() + seconds
        while self.lamp != wanted:
            if time.time() > deadline:
                raise Wrong(f"lamp {why}: expected {wanted!r}, got {self.lamp!r}")
            time.sleep(0.02)

    def shows_each_state(self) -> str:
        self.expect_lamp("yellow", "at power-up")
        self.master.set_prm(Parameters(ident=1))
        self.expect_lamp("red flashing", "after wrong parameters")
        self.master.set_prm(Parameters())
        time.sleep(TOLD_WITHIN)
        self.expect_lamp("red flashing", "after good parameters, before the configuration")
        self.master.chk_cfg(book.TWO_WORDS_BOTH_WAYS)
        self.expect_lamp("green", "in data exchange")
        self.master.unlock()
        self.expect_lamp("yellow", "after Unlock")
        self.master.bring_up()
        self.expect_lamp("green", "in data exchange")
        self.master.exchange(bytes(4))
        self.master.exchange((TOP | 0x7FFF_FFFF).to_bytes(4, "big"))
        self.expect_lamp("red flashing fast", "after a preset out of range")
        self.master.exchange(bytes(4))
        self.master.exchange(TOP.to_bytes(4, "big"))
        self.expect_lamp("green", "after a preset in range")
        left = self.began_at + JUMP_AFTER - time.time()
        if left < 0:
            raise Wrong("the machine was too slow to see the steps before the jump")
        self.expect_lamp("red", "after a jump of the code", left + TOLD_WITHIN)
        self.expect_lamp("green", "2.5 s later", 2.5 + TOLD_WITHIN)
        expect("response to the next request", self.master.exchange(bytes(4)).function, 0x0A)
        return "yellow, red 1 Hz, green; red 5 Hz after a preset; red after a jump"

    def lamp_run(self) -> None:
        """All of it."""
        self.chapter("9.5 Lamp")
        try:
            self.named(self.starts_a_plant_of_one, vital=True)
            self.named(self.shows_each_state)
            self.end()
        finally:
            self.leave_bus()
            self.process.end()
