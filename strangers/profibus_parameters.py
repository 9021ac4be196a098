"""Parameters, configurations and what follows from them: chapters 4, 6 and 8 of the manual.

No script: see `profibus_chapters.py`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import profibus_book as book
from profibus_book import Parameters
from profibus_walk import (
    CFG_FAULT,
    NOT_SUPPORTED,
    PARAMETERISED,
    POWER_ON,
    PRM_FAULT,
    RUNNING,
    STILL_AT,
    Start,
    Walk,
)
from steps import Wrong, expect, expect_within, position_at

TURNS_A_SECOND = 2
LEGAL_CONFIGURATIONS = [0xD1, 0xF1, 0xD0, 0xF0]


class Settings(Walk):
    """All steps begin while the slave waits for parameters, on a shaft at rest."""

    # --- What is taken and what is refused

    def takes(self, what: str, parameters: Parameters) -> None:
        """Parameters that are accepted."""
        self.master.set_prm(parameters)
        self.expect_head(PARAMETERISED, f"head after {what}")

    def refuses(self, what: str, parameters: Parameters, head: bytes = PRM_FAULT) -> str:
        """Parameters that are not, whatever the configuration after them; what stderr says."""
        mark = len(self.messages())
        self.master.set_prm(parameters)
        self.master.chk_cfg(book.TWO_WORDS_BOTH_WAYS)
        self.expect_head(head, f"head after {what}")
        self.expect_rs(lambda: self.master.exchange(bytes(4)), f"Data_Exchange after {what}")
        # Bits of faults stay until the next Set_Prm.
        self.expect_head(head, f"head a little later after {what}")
        return self.message_since(mark, "Set_Prm")

    def takes_four_lengths(self) -> str:
        seen = []
        for length in range(41):
            parameters = replace(self.default, length=length)
            self.release()
            if length in (7, 17, 25):
                self.takes(f"{length} octets", parameters)
                seen.append(str(length))
            elif length == 9:
                self.takes("9 octets of class 1", replace(parameters, class_2=False))
                self.takes("9 octets without scaling", replace(parameters, scaling=False))
                seen.append("9")
            else:
                self.refuses(f"{length} octets", parameters)
        self.refuses("237 octets", replace(self.default, length=237))
        return f"{', '.join(seen)} of 0 to 40"

    def explains_that_octets_10_to_17_are_missing(self) -> str:
        said = self.refuses("9 octets of class 2 with scaling", replace(self.default, length=9))
        if "octets 10–17 missing" not in said:
            raise Wrong(f"stderr should say 'octets 10–17 missing', it says: {said}")
        return said

    def is_of_class_1_with_seven_octets(self) -> str:
        self.master.bring_up(replace(self.default, length=7))
        diagnosis = self.master.slave_diag()
        expect("octets of the diagnosis", len(diagnosis.octets), 16)
        expect("octet 7", diagnosis.octet(7), 0x0A)
        expect("operating status: CW, class 2 supported, no scaling", diagnosis.octet(9), 0x02)
        expect("position", self.master.position(bytes(4)), STILL_AT)
        return "16 octets, octet 9 02, the code itself"

    def refuses_a_wrong_ident_number(self) -> str:
        said = [
            self.refuses(f"ident {ident:04X}", replace(self.default, ident=ident))
            for ident in (0x0000, 0x059A, 0x9B05, 0xFFFF)
        ]
        return said[0]

    def refuses_a_watchdog_without_a_factor(self) -> str:
        for factors in [(0, 1), (1, 0), (0, 0)]:
            said = self.refuses(f"factors {factors}", replace(self.default, watchdog=factors))
        self.takes("factors 0 without WD_On", self.default)
        return said

    def does_not_support_dp_v1(self) -> str:
        for bit in (0x80, 0x40, 0x20, 0xE0):
            parameters = replace(self.default, octet_8=bit)
            said = self.refuses(f"octet 8 {bit:02X}", parameters, NOT_SUPPORTED)
        self.takes("octet 8 03", replace(self.default, octet_8=0x03))
        self.takes("octet 8 04", replace(self.default, octet_8=0x04))
        return f"52 05 00 FF; {said}"

    def ignores_reserved_bits_and_octets(self) -> str:
        for what, parameters in [
            ("octet 1 b0 to b2", replace(self.default, octet_1=0x07)),
            ("octet 8 b3 and b4", replace(self.default, octet_8=0x18)),
            ("octet 9 b4 to b7", replace(self.default, octet_9=0xF0)),
            ("octets 18 to 25", replace(self.default, reserved=b"\xff" * 8, length=25)),
            ("commissioning diagnostics", replace(self.default, commissioning=True)),
        ]:
            self.takes(what, parameters)
        self.master.chk_cfg(0xF1)
        expect("position", self.master.position(bytes(4)), STILL_AT % self.geometry.codes)
        return "octets 1, 8, 9, 18 to 25"

    def has_the_limits_of_chapter_4(self) -> str:
        geometry = self.geometry
        steps, codes, turns = geometry.steps, geometry.codes, geometry.turns
        for n, total in [
            (1, 1),
            (1, turns),
            (steps, 1),
            (steps, codes),
            (steps - 1, (steps - 1) * turns),
            (3600, 3600 * turns),
            (2, turns),
        ]:
            self.takes(f"n {n}, T {total}", replace(self.default, steps=n, total=total))
            diagnosis = self.master.slave_diag()
            expect("n and T", (diagnosis.steps, diagnosis.total), (n, total))
        kept = self.master.slave_diag().part(32, 47)
        most = 0xFFFF_FFFF
        for n, total in [
            (0, 1),
            (0, 0),
            (1, 0),
            (steps + 1, 1),
            (steps + 1, codes),
            (most, 1),
            (steps, codes + 1),
            (steps, most),
            (most, most),
            (1, turns + 1),
            (3600, 3600 * turns + 1),
            (steps - 1, codes),
        ]:
            said = self.refuses(f"n {n}, T {total}", replace(self.default, steps=n, total=total))
            seen = self.master.slave_diag().part(32, 47)
            expect(f"octets 32 to 47 after refused n {n}, T {total}", seen, kept)
        return f"n 1 … {steps}, T 1 … n · {turns}; e.g. {said}"

    def explains_a_total_beyond_the_codes(self) -> str:
        turns = self.geometry.turns
        beyond = replace(self.default, steps=3600, total=self.geometry.codes)
        said = self.refuses("T too large", beyond)
        wanted = f"Set_Prm octets 14–17: total resolution {self.geometry.codes} exceeds "
        wanted += f"3600 × {turns} = {3600 * turns}"
        if wanted not in said:
            raise Wrong(f"stderr should say '{wanted}', it says: {said}")
        return said

    def does_not_look_at_values_that_have_no_effect(self) -> str:
        wild = replace(self.default, steps=0, total=0xFFFF_FFFF)
        self.takes("class 1 with wild values", replace(wild, class_2=False))
        self.takes("no scaling with wild values", replace(wild, scaling=False))
        self.master.chk_cfg(0xF1)
        expect("position", self.master.position(bytes(4)), STILL_AT % self.geometry.codes)
        return "class 2 off, scaling off: n 0, T FFFFFFFF are taken"

    # --- Positions

    def computes_positions_exactly(self) -> str:
        geometry, seen = self.geometry, []
        raw = STILL_AT % geometry.codes
        for n, total in [
            (geometry.steps, geometry.codes),
            (3600, 3600 * geometry.turns),
            (3600, min(3600 * 256, 3600 * geometry.turns)),
            (1000, 777),
            (3599, 3599),
            (1, geometry.turns),
            (geometry.steps - 1, geometry.steps - 1),
        ]:
            for clockwise in (True, False):
                parameters = Parameters(steps=n, total=total, counter_clockwise=not clockwise)
                self.release()
                self.to("DATA_EXCH", parameters)
                wanted = position_at(raw, n, total, clockwise=clockwise, disc=geometry.steps)
                what = f"position, n {n}, T {total}, {'CW' if clockwise else 'CCW'}"
                expect(what, self.master.position(bytes(4)), wanted)
            seen.append(f"{n}/{total}: {wanted}")
        return ", ".join(seen)

    def scales_only_in_class_2_with_scaling(self) -> str:
        raw = STILL_AT % self.geometry.codes
        example = Parameters(steps=1000, total=1000)
        for parameters, octet_9 in [
            (replace(example, scaling=False), 0x02),
            (replace(example, class_2=False), 0x02),
            (replace(example, class_2=False, scaling=False), 0x02),
            (replace(example, class_2=False, counter_clockwise=True), 0x03),
            (replace(example, scaling=False, counter_clockwise=True), 0x03),
        ]:
            self.release()
            self.to("DATA_EXCH", parameters)
            wanted = -raw % self.geometry.codes if parameters.counter_clockwise else raw
            expect(f"position with {parameters}", self.master.position(bytes(4)), wanted)
            expect("octet 9", self.master.slave_diag().octet(9), octet_9)
        return f"else {raw} clockwise, {-raw % self.geometry.codes} the other way"

    def runs_on_without_a_jump_on_a_turning_shaft(self) -> str:
        """N · M is no multiple of T, so the zero of the code falls anywhere in the range."""
        n, total, seconds = 1000, 777, 2.5
        moved = []
        for clockwise in (True, False):
            self.release()
            self.to("DATA_EXCH", Parameters(steps=n, total=total, counter_clockwise=not clockwise))
            begin = before = time.time()
            position, way = self.master.position(bytes(4)), 0
            while before - begin < seconds:
                time.sleep(0.002)
                new, now = self.master.position(bytes(4)), time.time()
                step = (new - position if clockwise else position - new) % total
                due = TURNS_A_SECOND * n * (now - before)
                expect_within(f"steps from {position} to {new}", step, 0, due * 1.5 + 30)
                position, before, way = new, now, way + step
            due = TURNS_A_SECOND * n * (before - begin)
            expect_within("steps in all", way, due * 0.98 - 30, due * 1.02 + 30)
            moved.append(way)
        return f"{moved[0]} steps clockwise, {moved[1]} the other way, in {seconds:g} s"

    # --- Configurations

    def takes_four_configurations(self) -> str:
        raw = STILL_AT % self.geometry.codes
        for configuration in LEGAL_CONFIGURATIONS:
            size = 4 if configuration & 1 else 2
            out = size if configuration & 0x20 else 0
            self.release()
            self.to("DATA_EXCH", configuration=configuration)
            expect("Get_Cfg", self.stranger.get_cfg(), bytes([configuration]))
            answer = self.master.exchange(bytes(out))
            wanted = (raw % 256**size).to_bytes(size, "big")
            expect(f"data with {configuration:02X}", answer.data, wanted)
            expect("RD_Inp", self.stranger.rd_inp(), wanted)
        return "D1, F1: 4 octets; D0, F0: the low 16 bits"

    def refuses_all_other_configurations(self) -> str:
        cases: list[tuple[int, ...]] = [
            (octet,) for octet in range(256) if octet not in LEGAL_CONFIGURATIONS
        ]
        cases += [(), (0xF1, 0xF1), (0xD1, 0x00), (0x00, 0xF1), (0x40, 0x81), (0xF1,) * 244]
        for case in cases:
            self.master.set_prm(self.default)
            self.master.chk_cfg(*case)
            self.expect_head(CFG_FAULT, f"head after Chk_Cfg {bytes(case).hex(' ')}")
        self.master.set_prm(self.default)
        self.expect_head(PARAMETERISED, "head after the next Set_Prm")
        return f"{len(cases)} of them: 06 05 00 FF, until the next Set_Prm"

    def changes_its_configuration_while_it_runs(self) -> str:
        raw = STILL_AT % self.geometry.codes
        self.to("DATA_EXCH")
        for configuration in (0xF1, 0xD1, 0xD0, 0xF0, 0xF1):
            self.master.chk_cfg(configuration)
            self.expect_head(RUNNING, f"head after Chk_Cfg {configuration:02X}")
            size = 4 if configuration & 1 else 2
            answer = self.master.exchange(bytes(size if configuration & 0x20 else 0))
            wanted = (raw % 256**size).to_bytes(size, "big")
            expect(f"data with {configuration:02X}", answer.data, wanted)
        self.master.exchange(bytes.fromhex("01 02 03 04"))
        self.master.chk_cfg(0xF1)
        expect("outputs after the same octet", self.master.rd_outp().hex(), "01020304")
        self.master.chk_cfg(0xD1)
        self.master.chk_cfg(0xF1)
        expect("outputs after another octet", self.master.rd_outp(), bytes(4))
        self.master.chk_cfg(0xF2)
        self.expect_head(CFG_FAULT, "head after Chk_Cfg F2")
        return "F1, D1, D0, F0; F2: 06 05 00 FF"

    def refuses_data_of_another_length(self) -> str:
        for configuration, lengths in [
            (0xF1, (1, 2, 3, 5, 8, 244)),
            (0xF0, (1, 3, 4, 8)),
            (0xD1, (1, 2, 4)),
            (0xD0, (1, 2, 4)),
        ]:
            for length in lengths:
                self.release()
                self.to("DATA_EXCH", configuration=configuration)
                what = f"{length} octets with {configuration:02X}"
                self.expect_rs(partial(self.master.exchange, bytes(length)), what)
                self.expect_head(POWER_ON, f"head after {what}")
        return "RS, then it waits for parameters"

    # --- The runs

    def settings_run(self, model: str) -> None:
        """All of it for one geometry."""
        self.chapter(f"4, 6, 8 Parameters of {model}")
        with self.running_run(Start(model=model)):
            self.fresh(self.has_the_limits_of_chapter_4)
            self.fresh(self.explains_a_total_beyond_the_codes)
            self.fresh(self.does_not_look_at_values_that_have_no_effect)
            self.fresh(self.computes_positions_exactly)
            self.fresh(self.scales_only_in_class_2_with_scaling)
            self.fresh(self.takes_four_configurations)

    def refusals_run(self) -> None:
        """What does not depend on the geometry."""
        self.chapter("6 Set_Prm and Chk_Cfg")
        with self.running_run(Start()):
            self.fresh(self.takes_four_lengths)
            self.fresh(self.explains_that_octets_10_to_17_are_missing)
            self.fresh(self.is_of_class_1_with_seven_octets)
            self.fresh(self.refuses_a_wrong_ident_number)
            self.fresh(self.refuses_a_watchdog_without_a_factor)
            self.fresh(self.does_not_support_dp_v1)
            self.fresh(self.ignores_reserved_bits_and_octets)
            self.fresh(self.refuses_all_other_configurations)
            self.fresh(self.changes_its_configuration_while_it_runs)
            self.fresh(self.refuses_data_of_another_length)

    def parameter_runs(self) -> list[Callable[[], None]]:
        """All, with the limits of each geometry."""
        models = ("hmg11-p13", "heag162-p18", "pmg10-p29")
        settings = [partial(self.settings_run, model) for model in models]
        return [self.refusals_run, *settings, self.crossing_run]

    def crossing_run(self) -> None:
        """A shaft that passes the zero of its code several times."""
        with self.running_run(Start(model="hmg11-p13", shaft=f"turn rpm={60 * TURNS_A_SECOND}")):
            self.fresh(self.runs_on_without_a_jump_on_a_turning_shaft)
