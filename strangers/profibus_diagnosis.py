"""Diagnosis: chapter 7.1 and 7.2 of the manual. No script: see `profibus_chapters.py`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import profibus_book as book
from profibus_book import Diagnosis, Parameters
from profibus_walk import (
    CFG_FAULT,
    JUMP,
    PARAMETERISED,
    POWER_ON,
    PRM_FAULT,
    RUNNING,
    STILL_AT,
    Start,
    Walk,
    jumps,
)
from steps import Wrong, expect, expect_within, position_at

MODELS = {
    "13": ["amg11-p13", "amg81-p13", "pmg10-p13", "hmg11-p13", "hmg10-p13", "heag162-p13"],
    "18": ["heag162-p18"],
    "29": ["amg11-p29", "amg81-p29", "pmg10-p29", "hmg11-p29", "hmg10-p29", "heag162-p29"],
}
# The only one with a lithium cell.
WITH_CELL = "amg81-p29"
EXTENDED = bytes([RUNNING[0] | 0x08]) + RUNNING[1:]
TOP = 0x8000_0000


class Diagnoses(Walk):
    """Slave_Diag, octet by octet."""

    def class_2_octets(self, parameters: Parameters, offset: int = 0, alarms: int = 0) -> bytes:
        """Octets 7 to 57, as the manual has them for the model that runs."""
        geometry = self.geometry
        status = parameters.counter_clockwise | 0x02 | parameters.scaling << 3
        cell = 0x20 if self.started.model == WITH_CELL else 0x00
        return b"".join(
            [
                bytes([0x33, alarms, status, geometry.type_octet]),
                geometry.steps.to_bytes(4, "big"),
                geometry.turns_shown.to_bytes(2, "big"),
                bytes.fromhex("00 00 01 00 00 00") + bytes([cell]),
                bytes.fromhex("01 10 01 21 FF FF FF FF"),
                offset.to_bytes(4, "big", signed=True) + bytes(4),
                parameters.steps.to_bytes(4, "big") + parameters.total.to_bytes(4, "big"),
                b"*" * 10,
            ]
        )

    def expect_diagnosis(self, head: bytes, octets: bytes, what: str) -> Diagnosis:
        """The whole diagnosis."""
        diagnosis = self.master.slave_diag()
        expect(f"diagnosis {what}", diagnosis.octets, head + b"\x05\x9b" + octets)
        return diagnosis

    # --- Each model

    def tells_all_octets_in_every_state(self) -> str:
        octets = self.class_2_octets(self.default)
        self.expect_diagnosis(POWER_ON, octets, "at power-up")
        configuration = 0xF0 if self.geometry.codes <= 2**15 else 0xF1
        expect("Get_Cfg before a configuration", self.master.get_cfg(), bytes([configuration]))
        self.master.set_prm(self.default)
        self.expect_diagnosis(PARAMETERISED, octets, "after Set_Prm")
        self.master.chk_cfg(0xF1)
        self.expect_diagnosis(RUNNING, octets, "in data exchange")
        self.master.chk_cfg(0x00)
        self.expect_diagnosis(CFG_FAULT, octets, "after a wrong configuration")
        self.master.set_prm(replace(self.default, ident=0))
        self.expect_diagnosis(PRM_FAULT, octets, "after wrong parameters")
        other = Parameters(steps=3600, total=3600, counter_clockwise=True)
        self.master.bring_up(other)
        octets = self.class_2_octets(other)
        self.expect_diagnosis(RUNNING, octets, "with n and T 3600, CCW")
        self.master.unlock()
        self.expect_diagnosis(POWER_ON, octets, "after Unlock")
        return octets[:23].hex(" ")

    def tells_16_octets_in_class_1(self) -> str:
        for counter_clockwise in (False, True):
            parameters = Parameters(class_2=False, counter_clockwise=counter_clockwise, length=9)
            self.master.set_prm(parameters)
            octets = self.class_2_octets(replace(self.default, scaling=False))
            octets = b"\x0a\x00" + bytes([0x02 | counter_clockwise]) + octets[3:10]
            self.expect_diagnosis(PARAMETERISED, octets, "after Set_Prm")
            self.master.chk_cfg(0xD1)
            self.expect_diagnosis(RUNNING, octets, "in data exchange")
        self.master.set_prm(Parameters(ident=0))
        expect("octets after refused parameters", len(self.master.slave_diag().octets), 57)
        return f"{octets.hex(' ')}; 57 octets after refused parameters"

    def tells_the_offset_signed(self) -> str:
        raw = STILL_AT % self.geometry.codes
        plain = position_at(raw, 3600, 3600, disc=self.geometry.steps)
        parameters = Parameters(steps=3600, total=3600)
        self.to("DATA_EXCH", parameters)
        self.master.exchange(bytes(4))
        for preset in (0, 3599, plain, plain - 1):
            expect("positions", self.master.preset(preset), (preset, preset))
            octets = self.class_2_octets(parameters, offset=preset - plain)
            self.expect_diagnosis(RUNNING, octets, f"after preset {preset}")
        return f"{-plain} after 0, {3599 - plain} after 3599, 0 after {plain}, -1 after that less 1"

    # --- Position errors and the pending diagnosis

    def is_pending_until_its_master_has_read_it(self) -> str:
        self.to("DATA_EXCH")
        self.master.exchange(bytes(4))
        out_of_range = (TOP | 0x7FFF_FFFF).to_bytes(4, "big")
        self.master.exchange(out_of_range)
        for _ in range(3):
            function = self.master.exchange(out_of_range).function
            expect("response while nobody has read", function, book.DATA_HIGH)
        expect("alarms, read by a stranger", self.stranger.slave_diag().alarms, 1)
        function = self.master.exchange(out_of_range).function
        expect("response after a stranger has read", function, book.DATA_HIGH)
        self.expect_diagnosis(EXTENDED, self.class_2_octets(self.default, alarms=1), "then")
        function = self.master.exchange(out_of_range).function
        expect("response after its master has read", function, book.DATA_LOW)
        self.master.exchange(bytes(4))
        self.master.exchange((TOP | 5).to_bytes(4, "big"))
        answer = self.master.exchange(bytes([0, 0, 0, 5]))
        expect("response after the alarm went", answer.function, book.DATA_HIGH)
        expect("position", answer.data, bytes([0, 0, 0, 5]))
        diagnosis = self.expect_head(RUNNING)
        expect("alarms", diagnosis.alarms, 0)
        function = self.master.exchange(bytes(4)).function
        expect("response after that was read", function, book.DATA_LOW)
        return "DH, 08 04 00 02 and octet 8 01; DL once its master has read; the same when it went"

    def stays_pending_while_the_answer_did_not_go_out(self) -> str:
        """Another octet before the answer drops it, so its master has not read it."""
        self.to("DATA_EXCH")
        self.master.exchange(bytes(4))
        self.master.exchange((TOP | 0x7FFF_FFFF).to_bytes(4, "big"))
        diagnosis = self.master.request(dsap=book.SLAVE_DIAG)
        configuration = replace(diagnosis, dsap=book.GET_CFG)
        answer = self.master.answer_to(diagnosis.octets() + configuration.octets())
        self.master.toggle()
        seen = self.master.checked(configuration, answer)
        expect("answer to the second of two requests at once", seen and seen.data, b"\xf1")
        function = self.master.exchange(bytes(4)).function
        expect("response after a diagnosis that did not go out", function, book.DATA_HIGH)
        self.expect_head(EXTENDED)
        function = self.master.exchange(bytes(4)).function
        expect("response after one that did", function, book.DATA_LOW)
        return "DH, then DL after a diagnosis that went out"

    def is_pending_on_entry_where_something_changed(self) -> str:
        self.to("DATA_EXCH")
        self.master.exchange(bytes(4))
        self.master.exchange((TOP | 0x7FFF_FFFF).to_bytes(4, "big"))
        self.expect_head(EXTENDED)
        class_1 = Parameters(class_2=False, length=9)
        functions = []
        for parameters in (self.default, class_1, class_1):
            self.master.set_prm(parameters)
            self.master.chk_cfg(book.TWO_WORDS_BOTH_WAYS)
            functions.append(self.master.exchange(bytes(4)).function)
            self.master.slave_diag()
        wanted = [book.DATA_LOW, book.DATA_HIGH, book.DATA_LOW]
        expect("responses on entry: same alarm, alarm gone, still gone", functions, wanted)
        return "DL while the alarm stays, DH when it went meanwhile, DL once that was read"

    def tells_on_entry_what_changed_before(self) -> str:
        """The alarm of a preset out of range goes with parameters of class 1."""
        self.to("DATA_EXCH")
        self.master.exchange(bytes(4))
        self.master.exchange((TOP | 0x7FFF_FFFF).to_bytes(4, "big"))
        self.expect_head(EXTENDED)
        self.master.set_prm(self.default)
        diagnosis = self.expect_head(bytes([0x0A]) + PARAMETERISED[1:])
        expect("alarms after the same parameters", diagnosis.alarms, 1)
        self.master.set_prm(Parameters(class_2=False, length=9))
        diagnosis = self.expect_head(PARAMETERISED)
        expect("alarms in class 1", diagnosis.alarms, 0)
        self.master.set_prm(self.default)
        self.master.chk_cfg(0xF1)
        diagnosis = self.expect_head(RUNNING)
        expect("alarms in class 2 again", diagnosis.alarms, 0)
        return "kept with the same parameters, gone with class 1"

    def tells_jumps_of_the_code(self) -> str:
        """Jumps 1.2 s apart: the alarm ends 2.5 s after the last."""
        self.to("DATA_EXCH")
        seen: list[tuple[float, int]] = []
        deadline = self.began_at + 9.0
        before = self.master.slave_diag().alarms
        expect("alarms before", before, 0)
        while time.time() < deadline:
            answer = self.master.exchange(bytes(4))
            if answer.function == book.DATA_HIGH:
                alarms = self.expect_pending()
                seen.append((self.wire.seen[-1].at - self.began_at, alarms))
            time.sleep(0.005)
        expect("alarms one after the other", [alarms for _, alarms in seen], [1, 0])
        (began, _), (ended, _) = seen
        expect_within("seconds to the alarm", began, 3.0, 4.0)
        expect_within("seconds to its end", ended, 4.2 + 2.5, 4.4 + 2.5 + 1)
        return f"jumps at 3 and 4.2 s: alarm from {began:.2f} to {ended:.2f} s"

    def alarms_in_class_1(self) -> str:
        self.to("DATA_EXCH", Parameters(class_2=False, length=9), 0xD1)
        expect("alarms before", self.master.slave_diag().alarms, 0)
        deadline = self.began_at + 4
        while self.master.exchange().function == book.DATA_LOW:
            if time.time() > deadline:
                raise Wrong("no DH after the jump")
            time.sleep(0.005)
        diagnosis = self.expect_head(EXTENDED)
        expect("octets", len(diagnosis.octets), 16)
        expect("alarms", diagnosis.alarms, 1)
        return "DH, 16 octets, octet 8 01"

    # --- The lithium cell

    def warns_of_its_cell(self) -> str:
        self.to("DATA_EXCH")
        seen: list[tuple[float, bytes]] = []
        deadline = self.began_at + 4.0
        expect("warnings before", self.master.slave_diag().part(20, 23), bytes([0, 0, 0, 0x20]))
        while time.time() < deadline:
            answer = self.master.exchange(bytes(4))
            expect("position", answer.data, STILL_AT.to_bytes(4, "big"))
            if answer.function == book.DATA_HIGH:
                diagnosis = self.master.slave_diag()
                warns = diagnosis.octet(21) != 0
                head = EXTENDED if warns else RUNNING
                expect("octets 1 to 4", diagnosis.head, head)
                expect("alarms", diagnosis.alarms, 0)
                seen.append((self.wire.seen[-1].at - self.began_at, diagnosis.part(20, 23)))
            time.sleep(0.005)
        wanted = [bytes([0, 0x20, 0, 0x20]), bytes([0, 0, 0, 0x20])]
        expect("octets 20 to 23 one after the other", [octets for _, octets in seen], wanted)
        return "; ".join(f"{at:.2f} s: {octets.hex(' ')}" for at, octets in seen)

    # --- The SSI line of a HEAG 162

    def alarms_while_its_ssi_line_is_broken(self) -> str:
        """From 1 s to 2 s nothing comes from the encoder behind it; the alarm lasts 2.5 s more."""
        self.to("DATA_EXCH")
        seen: list[tuple[float, int]] = []
        held = STILL_AT.to_bytes(4, "big")
        while time.time() < self.began_at + 5.6:
            answer = self.master.exchange(bytes(4))
            expect("position all the time", answer.data, held)
            if answer.function == book.DATA_HIGH:
                alarms = self.expect_pending()
                seen.append((self.wire.seen[-1].at - self.began_at, alarms))
            time.sleep(0.005)
        expect("alarms one after the other", [alarms for _, alarms in seen], [1, 0])
        (began, _), (ended, _) = seen
        expect_within("seconds to the alarm", began, 1.0, 1.8)
        expect_within("seconds to its end", ended, 2.0 + 2.5, 2.0 + 2.5 + 1)
        return f"{STILL_AT} is held; alarm from {began:.2f} to {ended:.2f} s"

    def expect_pending(self) -> int:
        """Reads a diagnosis that was announced; its alarms, which Ext_Diag must tell."""
        diagnosis = self.master.slave_diag()
        expect("Ext_Diag", diagnosis.has_extended, bool(diagnosis.alarms))
        expect("Stat_Diag", diagnosis.octet(2) & 0x02, 0)
        return diagnosis.alarms

    def alarms_at_a_jump_of_its_ssi_encoder(self) -> str:
        self.to("DATA_EXCH")
        while self.master.exchange(bytes(4)).function == book.DATA_LOW:
            if time.time() > self.began_at + 3:
                raise Wrong("no DH after the jump")
            time.sleep(0.005)
        expect("alarms", self.expect_pending(), 1)
        time.sleep(0.3)
        position = self.master.position(bytes(4))
        expect("position after the jumps", position, STILL_AT + JUMP)
        return f"DH, octet 8 01, position {position}"

    # --- The runs

    def diagnosis_runs(self) -> list[Callable[[], None]]:
        """Each of the 13 models, then what comes and goes."""
        ssi = [self.broken_ssi_run, self.ssi_jump_run]
        models = [partial(self.model_run, model) for same in MODELS.values() for model in same]
        return [*models, self.pending_run, self.jumps_run, self.class_1_run, self.cell_run, *ssi]

    def model_run(self, model: str) -> None:
        """What the octets say of a model."""
        self.chapter(f"7.1, 7.2 Diagnosis of {model}")
        with self.running_run(Start(model=model)):
            self.named(self.tells_all_octets_in_every_state)
            self.fresh(self.tells_16_octets_in_class_1)
            self.fresh(self.tells_the_offset_signed)

    def pending_run(self) -> None:
        """Alarms that a master makes."""
        self.chapter("7.1 Alarms and warnings")
        with self.running_run(Start()):
            self.fresh(self.is_pending_until_its_master_has_read_it)
            self.fresh(self.stays_pending_while_the_answer_did_not_go_out)
            self.fresh(self.is_pending_on_entry_where_something_changed)
            self.fresh(self.tells_on_entry_what_changed_before)

    def jumps_run(self) -> None:
        """Alarms of the code disc."""
        faults = jumps(3.0) + jumps(4.2)
        with self.running_run(Start(shaft="turn rpm=60", faults=faults)):
            self.fresh(self.tells_jumps_of_the_code)

    def class_1_run(self) -> None:
        """The same in class 1."""
        with self.running_run(Start(shaft="turn rpm=60", faults=jumps(1.0))):
            self.fresh(self.alarms_in_class_1)

    def cell_run(self) -> None:
        """A warning."""
        cell = ["cell-low at=1s", "cell-right at=2500ms"]
        with self.running_run(Start(model=WITH_CELL, faults=cell)):
            self.fresh(self.warns_of_its_cell)

    def broken_ssi_run(self) -> None:
        """A wire breaks and is mended."""
        faults = ["ssi-unplugged at=1s", "ssi-right at=2s"]
        with self.running_run(Start(model="heag162-p29", faults=faults)):
            self.fresh(self.alarms_while_its_ssi_line_is_broken)

    def ssi_jump_run(self) -> None:
        """The code of the encoder behind it jumps, at rest."""
        with self.running_run(Start(model="heag162-p29", faults=jumps(1.0))):
            self.fresh(self.alarms_at_a_jump_of_its_ssi_encoder)
