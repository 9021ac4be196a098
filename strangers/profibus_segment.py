"""31 slaves on one line: chapter 3 of the manual. No script: see `profibus_chapters.py`."""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from pathlib import Path

import profibus_book as book
from profibus_book import Master, Parameters, Wire
from profibus_walk import GEOMETRIES, OUR_ADDRESS, RUNNING, STRANGER_ADDRESS, Walk
from steps import Process, Wrong, expect, position_at

MODELS = ["amg11-p29", "hmg10-p13", "pmg10-p29", "heag162-p18", "amg81-p13"]
FIRST, COUNT = 10, 31
TOP = 0x8000_0000


def raw_of(address: int) -> int:
    """Where the shaft of a slave rests."""
    return 100 * address


class Segment(Walk):
    """A plant of many slaves, and a master for each."""

    plant: Path = Path("plant.toml")

    def write_plant(self, path: Path) -> None:
        """A plant file with all slaves on one TCP port."""
        text = ['[[bus]]\nname = "line"\nkind = "profibus"']
        text += ['uri = "rs485-listen:127.0.0.1:0"\nbaud = "12M"\n']
        for number in range(COUNT):
            text.append(f'[[device]]\nmodel = "{MODELS[number % len(MODELS)]}"')
            address = FIRST + number
            text.append(f'address = {address}\nshaft = "still angle={raw_of(address)}"\n')
        path.write_text("\n".join(text))

    def starts_31_slaves(self) -> str:
        self.write_plant(self.plant)
        mark = len(self.messages())
        self.process.launch(["run", str(self.plant)])
        line = self.message_since(mark, " on rs485-listen:127.0.0.1:")
        self.port = int(line.rpartition(" on rs485-listen:127.0.0.1:")[2].split(":")[0])
        self._wire = Wire.over_tcp("127.0.0.1", self.port, self._log)
        self.masters = [Master(self.wire, OUR_ADDRESS, FIRST + number) for number in range(COUNT)]
        return line

    def model_of(self, master: Master) -> str:
        """The model at the address of a master's slave."""
        return MODELS[(master.slave - FIRST) % len(MODELS)]

    def parameters_of(self, master: Master) -> Parameters:
        """Of the GSD file, with Sync and Freeze, groups 1 and 2 by turns."""
        default = GEOMETRIES[self.model_of(master)[-2:]].default
        return replace(default, sync=True, freeze=True, group=1 << master.slave % 2)

    def brings_all_to_data_exchange(self) -> str:
        for master in self.masters:
            master.fdl_status()
            diagnosis = master.bring_up(self.parameters_of(master))
            expect("head", diagnosis.head, RUNNING)
            geometry = GEOMETRIES[self.model_of(master)[-2:]]
            expect(f"S of {master.slave}", diagnosis.number(11, 14), geometry.steps)
            expect(f"turns of {master.slave}", diagnosis.number(15, 16), geometry.turns_shown)
        return f"{len(self.masters)} slaves, addresses {FIRST} to {FIRST + COUNT - 1}"

    def exchanges_data_with_all_in_turn(self) -> str:
        cycles = []
        for _ in range(20):
            begin = time.time()
            for master in self.masters:
                geometry = GEOMETRIES[self.model_of(master)[-2:]]
                wanted = position_at(
                    raw_of(master.slave), geometry.steps, geometry.codes, disc=geometry.steps
                )
                expect(f"position of {master.slave}", master.position(bytes(4)), wanted)
            self.wire.send(book.token(OUR_ADDRESS, OUR_ADDRESS))
            cycles.append(1000 * (time.time() - begin))
        return f"20 cycles, {statistics.median(cycles):.1f} ms each"

    def strikes_all_presets_of_a_group_at_once(self) -> str:
        ours = self.masters
        ours[0].global_control(book.SYNC)
        before = {master.slave: master.position(bytes(4)) for master in ours}
        ours[0].global_control(book.SYNC)
        for master in ours:
            held = master.position((TOP | master.slave).to_bytes(4, "big"))
            expect(f"held position of {master.slave}", held, before[master.slave])
        ours[0].global_control(book.SYNC, group=1)
        for master in ours:
            position = int.from_bytes(master.rd_inp(), "big")
            wanted = master.slave if master.slave % 2 == 0 else before[master.slave]
            expect(f"position of {master.slave} after Sync of group 1", position, wanted)
        ours[0].global_control(book.UNSYNC)
        for master in ours:
            expect(f"position of {master.slave}", master.position(bytes(4)), master.slave)
        return "group 1 at its Sync, the others at Unsync"

    def stays_away_from_addresses_that_nobody_has(self) -> str:
        for address in (0, 1, FIRST - 1, FIRST + COUNT, 99, 125, 126, 127):
            request = book.Telegram(address, OUR_ADDRESS, book.FDL_STATUS)
            self.masters[0].expect_silence(request.octets(), 0.02)
        return f"silence outside {FIRST} … {FIRST + COUNT - 1}"

    def hears_each_other_on_one_line(self) -> str:
        """A second connection is a second master on the same line."""
        other = Wire.over_tcp("127.0.0.1", self.port)
        try:
            stranger = Master(other, STRANGER_ADDRESS, FIRST)
            expect("locking master, told to another", stranger.slave_diag().octet(4), OUR_ADDRESS)
            self.wire.forget()
            time.sleep(0.02)
            other.forget()
            self.masters[0].exchange(bytes(4))
            heard = []
            while (seen := other.receive(0.1)) is not None:
                heard.append(seen.octets)
            if len(heard) != 2:
                raise Wrong(f"the other should hear request and answer, it heard {heard}")
        finally:
            other.close()
        return "request and answer are heard by both"

    def is_joined_by_another_encoder(self) -> str:
        """An encoder of another process, as a client of the line."""
        newcomer = Process(self.process.path, self.process.messages)
        address = FIRST + COUNT
        bus = f"rs485:127.0.0.1:{self.port}"
        try:
            line = newcomer.launch(
                ["encoder", "hmg11-p13", "--bus", bus, "--baud", "12M"]
                + ["--address", str(address), "--shaft", f"still angle={raw_of(address)}"]
            )
            expect("its first line", line, f"ready hmg11-p13 address {address} on {bus}")
            master = Master(self.wire, OUR_ADDRESS, address)
            master.bring_up(GEOMETRIES["13"].default)
            expect("its position", master.position(bytes(4)), raw_of(address))
            old = self.masters[0].position(bytes(4))
            newcomer.terminate()
        finally:
            newcomer.end()
        expect("position of the first when it has gone", self.masters[0].position(bytes(4)), old)
        return f"{line}; the others go on when it leaves"

    def segment_run(self) -> None:
        """All of it."""
        self.chapter("3 31 slaves on one line")
        try:
            self.named(self.starts_31_slaves, vital=True)
            self.named(self.brings_all_to_data_exchange)
            self.named(self.exchanges_data_with_all_in_turn)
            self.named(self.strikes_all_presets_of_a_group_at_once)
            self.named(self.stays_away_from_addresses_that_nobody_has)
            self.named(self.hears_each_other_on_one_line)
            self.named(self.is_joined_by_another_encoder)
            self.end()
        finally:
            self.leave_bus()
            self.process.end()
