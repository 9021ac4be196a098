"""User data, preset, Sync and Freeze: chapters 7.3 and 7.4 of the manual.

No script: see `profibus_chapters.py`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import profibus_book as book
from profibus_book import Parameters
from profibus_walk import POWER_ON, RUNNING, STILL_AT, Start, Walk
from steps import Wrong, expect, position_at

TOP = 0x8000_0000
PLAIN = position_at(STILL_AT, 3600, 3600 * 256)
EXAMPLE = Parameters(steps=3600, total=3600 * 256, sync=True, freeze=True)
EXTENDED = bytes([RUNNING[0] | 0x08]) + RUNNING[1:]


class UserData(Walk):
    """All steps begin while the slave waits for parameters, on a shaft at rest."""

    # --- Small things

    def out(self, value: int) -> int:
        """Exchanges two words; the position."""
        return self.master.position(value.to_bytes(4, "big"))

    def run(self, parameters: Parameters = EXAMPLE, configuration: int = 0xF1) -> None:
        """To data exchange, with the position that has no offset."""
        self.to("DATA_EXCH", parameters, configuration)
        if configuration == 0xF1:
            self.out(0)
            if self.out(TOP | PLAIN) != PLAIN or self.out(0) != PLAIN:
                raise Wrong("a preset with the plain position should give that position")

    def control(self, command: int, group: int = 0) -> None:
        """Global_Control to all; the next request comes after it on the same line."""
        self.master.global_control(command, group)

    # --- Preset

    def takes_a_preset_at_the_rise_of_the_top_bit(self) -> str:
        self.run()
        expect("position with the value alone", self.out(1234), PLAIN)
        expect("position in that very telegram", self.out(TOP | 1234), 1234)
        expect("position after the top bit went", self.out(1234), 1234)
        expect("offset", self.master.slave_diag().offset, 1234 - PLAIN)
        expect("position with 0", self.out(0), 1234)
        return f"1234 in the answer to 80 00 04 D2, offset {1234 - PLAIN}"

    def takes_one_preset_for_each_rise(self) -> str:
        self.run()
        expect("first", self.out(TOP | 1000), 1000)
        expect("another value while the top bit stays", self.out(TOP | 2000), 1000)
        expect("the same value again", self.out(TOP | 1000), 1000)
        expect("top bit off", self.out(2000), 1000)
        expect("second rise", self.out(TOP | 2000), 2000)
        return "the next only after the top bit was 0"

    def takes_the_whole_range(self) -> str:
        self.run()
        values = (0, 1, 3600 * 256 - 1, 3600, 0)
        for value in values:
            expect("position", self.out(TOP | value), value)
            expect("position", self.out(0), value)
            expect("offset", self.master.slave_diag().offset, value - PLAIN)
        return ", ".join(str(value) for value in values)

    def refuses_a_preset_out_of_range(self) -> str:
        self.run()
        for value in (3600 * 256, 3600 * 256 + 1, 0x7FFF_FFFF):
            expect("position", self.out(TOP | value), PLAIN)
            expect("offset", self.expect_head(EXTENDED).offset, 0)
            expect("alarms", self.master.slave_diag().alarms, 1)
            expect("position", self.out(0), PLAIN)
        time.sleep(2.7)
        expect("alarms after 2.7 s", self.expect_head(EXTENDED).alarms, 1)
        expect("position", self.out(TOP | 77), 77)
        expect("alarms after a preset in range", self.expect_head(RUNNING).alarms, 0)
        return "T, T + 1 and 7FFFFFFF: octet 8 01 until 77"

    def ends_that_alarm_with_parameters_of_class_1(self) -> str:
        self.run()
        self.out(TOP | 0x7FFF_FFFF)
        expect("alarms", self.expect_head(EXTENDED).alarms, 1)
        self.master.unlock()
        expect("alarms after Unlock", self.master.slave_diag().alarms, 1)
        self.master.set_prm(EXAMPLE)
        expect("alarms after good parameters", self.master.slave_diag().alarms, 1)
        self.to("DATA_EXCH", Parameters(class_2=False, length=9))
        expect("alarms in class 1", self.master.slave_diag().alarms, 0)
        return "not with Unlock, not with the same parameters, but in class 1"

    def presets_with_one_word(self) -> str:
        small = Parameters(steps=3600, total=32_000)
        self.to("DATA_EXCH", small, book.ONE_WORD_BOTH_WAYS)
        plain = position_at(STILL_AT, 3600, 32_000)
        words = []
        for out, wanted in [
            (0x0000, plain),
            (0x8000 | 1234, 1234),
            (0x8000 | 4321, 1234),
            (0x0000, 1234),
            (0x8000 | 31_999, 31_999),
            (0x0000, 31_999),
            (0x8000 | 32_000, 31_999),
            (0x0000, 31_999),
            (0x8000, 0),
        ]:
            data = self.master.exchange(out.to_bytes(2, "big")).data
            expect(f"data after {out:04X}", data, wanted.to_bytes(2, "big"))
            words.append(f"{out:04X} {wanted}")
        return ", ".join(words)

    def carries_the_low_word_of_a_wide_position(self) -> str:
        mark = len(self.messages())
        self.to("DATA_EXCH", replace(EXAMPLE, total=3600 * 65_536), book.ONE_WORD_BOTH_WAYS)
        self.message_since(mark, "position needs 28 bits, 16 are sent")
        self.master.exchange(b"\x00\x00")
        data = self.master.exchange((0x8000 | 0x1234).to_bytes(2, "big")).data
        expect("data after the preset 1234h", data, b"\x12\x34")
        self.release()
        self.to("DATA_EXCH", replace(EXAMPLE, total=3600 * 65_536))
        expect("position in two words", self.out(0), 0x1234)
        self.out(TOP | 0x1_2345)
        self.release()
        self.to("DATA_EXCH", replace(EXAMPLE, total=3600 * 65_536), book.ONE_WORD)
        expect("data with D0", self.master.exchange().data, b"\x23\x45")
        return "the low 16 bits"

    def ignores_presets_in_class_1(self) -> str:
        for parameters in (
            Parameters(class_2=False, length=9),
            Parameters(length=7),
            Parameters(class_2=False),
        ):
            self.release()
            self.to("DATA_EXCH", parameters)
            for out in (0, TOP | 1234, 0, TOP | 0x7FFF_FFFF, 0):
                expect("position", self.out(out), STILL_AT)
            expect("alarms", self.expect_head(RUNNING).alarms, 0)
        return f"{STILL_AT} all the time, no alarm"

    def keeps_a_preset_for_its_parameters(self) -> str:
        self.run()
        self.out(TOP | 1234)
        self.out(0)
        for other in (
            Parameters(class_2=False, length=9),
            Parameters(),
            replace(EXAMPLE, total=3600),
            replace(EXAMPLE, counter_clockwise=True),
            replace(EXAMPLE, scaling=False),
        ):
            self.release()
            self.to("DATA_EXCH", other)
            if other.class_2:
                expect("offset under other parameters", self.master.slave_diag().offset, 0)
            if (n := self.out(0)) == 1234:
                raise Wrong(f"position {n} under {other}: the offset should not be in force")
            self.release()
            self.to("DATA_EXCH", EXAMPLE)
            expect("position under its own parameters", self.out(0), 1234)
            expect("offset", self.master.slave_diag().offset, 1234 - PLAIN)
        return "1234 again after class 1, other n, T, direction, scaling off"

    # --- The top bit at the start

    def does_not_take_a_top_bit_that_was_stuck(self) -> str:
        self.run()
        self.release()
        self.to("DATA_EXCH", EXAMPLE)
        for _ in range(3):
            expect("position with a stuck top bit", self.out(TOP | 1234), PLAIN)
        self.master.set_prm(EXAMPLE)
        self.master.chk_cfg(0xF1)
        expect("position after another start", self.out(TOP | 1234), PLAIN)
        expect("position with the top bit off", self.out(1234), PLAIN)
        expect("position after a rise", self.out(TOP | 1234), 1234)
        return "only after it was 0 in a Data_Exchange"

    def does_not_take_it_after_the_watchdog(self) -> str:
        parameters = replace(EXAMPLE, watchdog=(10, 1))
        self.run(parameters)
        expect("preset", self.out(TOP | 50), 50)
        time.sleep(0.3)
        self.expect_head(POWER_ON)
        self.to("DATA_EXCH", parameters)
        expect("position with a stuck top bit", self.out(TOP | 1234), 50)
        return "50 stays"

    def takes_clear_as_a_zero(self) -> str:
        self.run()
        self.release()
        self.to("DATA_EXCH", EXAMPLE)
        expect("position with a stuck top bit", self.out(TOP | 1234), PLAIN)
        expect("position in the answer to no outputs", self.master.position(b""), PLAIN)
        expect("outputs", self.master.rd_outp(), bytes(4))
        expect("position after it", self.out(TOP | 1234), 1234)
        expect("the next without a zero", self.out(TOP | 99), 1234)
        self.control(book.CLEAR)
        expect("outputs after Clear", self.master.rd_outp(), bytes(4))
        self.expect_head(RUNNING, "head after Clear")
        expect("position after Clear", self.out(TOP | 99), 99)
        self.out(0)
        expect("outputs", self.master.rd_outp(), bytes(4))
        data = self.master.exchange(bytes.fromhex("00 00 00 07"))
        expect("length of the data", len(data.data), 4)
        expect("outputs once more", self.master.rd_outp().hex(), "00000007")
        return "an exchange without outputs and Clear count as 0; Clear acts once"

    # --- Sync

    def expect_modes(self, sync: bool, freeze: bool, what: str) -> None:
        """Sync_Mode and Freeze_Mode of the diagnosis."""
        octet = self.master.slave_diag().octet(2)
        expect(
            f"Sync_Mode and Freeze_Mode {what}",
            (bool(octet & 0x20), bool(octet & 0x10)),
            (sync, freeze),
        )

    def transfers_outputs_at_sync(self) -> str:
        self.run()
        self.control(book.SYNC)
        self.expect_modes(True, False, "after Sync")
        expect("position, held preset", self.out(TOP | 1234), PLAIN)
        expect("outputs, not transferred", self.master.rd_outp(), bytes(4))
        expect("position, still held", self.out(TOP | 1234), PLAIN)
        self.control(book.SYNC)
        expect("position after Sync", int.from_bytes(self.master.rd_inp(), "big"), 1234)
        expect("outputs, transferred", self.master.rd_outp(), (TOP | 1234).to_bytes(4, "big"))
        return "the preset strikes at the next Sync"

    def judges_the_top_bit_on_transferred_outputs(self) -> str:
        self.run()
        self.control(book.SYNC)
        expect("top bit on", self.out(TOP | 1234), PLAIN)
        expect("and off between two Syncs", self.out(0), PLAIN)
        self.control(book.SYNC)
        expect("position", self.out(0), PLAIN)
        self.out(TOP | 11)
        self.control(book.SYNC)
        expect("position after the next Sync", self.out(TOP | 11), 11)
        self.out(0)
        self.out(TOP | 22)
        self.control(book.SYNC)
        expect("0 between two Syncs was not seen", self.out(TOP | 22), 11)
        return "on and off between two Syncs is none; off and on neither"

    def transfers_at_once_at_unsync(self) -> str:
        self.run()
        self.control(book.SYNC)
        self.out(TOP | 1234)
        self.control(book.UNSYNC)
        self.expect_modes(False, False, "after Unsync")
        expect("position", int.from_bytes(self.master.rd_inp(), "big"), 1234)
        self.out(0)
        expect("position, at once again", self.out(TOP | 5), 5)
        self.out(0)
        # EN 50170-2: with both bits the function is inactive.
        self.control(book.SYNC | book.UNSYNC)
        self.expect_modes(False, False, "after Sync and Unsync at once")
        return "held outputs at Unsync, then each at once"

    def clears_held_outputs(self) -> str:
        self.run()
        self.control(book.SYNC)
        self.out(TOP | 1234)
        self.control(book.CLEAR)
        expect("outputs", self.master.rd_outp(), bytes(4))
        self.control(book.SYNC)
        expect("position after Clear and Sync", self.out(0), PLAIN)
        expect("outputs", self.master.rd_outp(), bytes(4))
        return "a held preset is gone"

    # --- Freeze

    def freezes_its_inputs(self) -> str:
        self.run()
        self.control(book.FREEZE)
        self.expect_modes(False, True, "after Freeze")
        expect("input through a preset", self.out(TOP | 1234), PLAIN)
        expect("RD_Inp", int.from_bytes(self.master.rd_inp(), "big"), PLAIN)
        expect("offset", self.master.slave_diag().offset, 1234 - PLAIN)
        self.control(book.FREEZE)
        expect("input after the next Freeze", self.out(0), 1234)
        expect("input through another preset", self.out(TOP | 9), 1234)
        self.control(book.UNFREEZE)
        self.expect_modes(False, False, "after Unfreeze")
        expect("input after Unfreeze", self.out(0), 9)
        self.control(book.FREEZE | book.UNFREEZE)
        self.expect_modes(False, False, "after Freeze and Unfreeze at once")
        return f"{PLAIN}, 1234 after Freeze, 9 after Unfreeze"

    def freezes_a_turning_shaft(self) -> str:
        self.to("DATA_EXCH", replace(self.default, sync=True, freeze=True))
        before = self.out(0)
        self.control(book.FREEZE)
        frozen = {self.out(0)}
        for _ in range(5):
            time.sleep(0.03)
            frozen.add(self.out(0))
        expect("how many different inputs", len(frozen), 1)
        self.control(book.FREEZE)
        second = self.out(0)
        time.sleep(0.03)
        expect("input after the second Freeze", self.out(0), second)
        self.control(book.UNFREEZE)
        after = self.out(0)
        if not before <= min(frozen) < second < after:
            raise Wrong(f"{before} ≤ {min(frozen)} < {second} < {after} was expected")
        return f"{before}, frozen {min(frozen)}, {second}, then {after}"

    # --- Whose Global_Control

    def has_no_effect(self, what: str, action: Callable[[], object]) -> str:
        """A Global_Control that must do nothing."""
        action()
        self.expect_modes(False, False, f"after {what}")
        return what

    def send_control(self, data: bytes, da: int) -> None:
        """Global_Control with any data."""
        self.master.without_answer(data, book.GLOBAL_CONTROL, da)

    def obeys_its_master_and_its_group_only(self) -> str:
        both = book.SYNC | book.FREEZE
        self.run(replace(EXAMPLE, group=0x05))
        seen = [
            self.has_no_effect("a stranger", lambda: self.stranger.global_control(both)),
            self.has_no_effect("group 2", lambda: self.control(both, 0x02)),
            self.has_no_effect("group FA", lambda: self.control(both, 0xFA)),
            self.has_no_effect("one octet", lambda: self.send_control(bytes([both]), 127)),
            self.has_no_effect("three octets", lambda: self.send_control(bytes([both, 0, 0]), 127)),
            self.has_no_effect("another DA", lambda: self.send_control(bytes([both, 0]), 8)),
        ]
        for group in (0x00, 0x01, 0x04, 0x06, 0xFF):
            self.control(both, group)
            self.expect_modes(True, True, f"after group {group:02X}")
            self.control(book.UNSYNC | book.UNFREEZE, group)
            self.expect_modes(False, False, f"after the end of group {group:02X}")
        self.master.global_control(both, da=self.started.address)
        self.expect_modes(True, True, "after a Global_Control to itself alone")
        return "not " + ", ".join(seen)

    def knows_sync_and_freeze_only_where_asked_for(self) -> str:
        both = book.SYNC | book.FREEZE
        for sync in (False, True):
            for freeze in (False, True):
                self.release()
                self.run(replace(EXAMPLE, sync=sync, freeze=freeze))
                self.control(both)
                self.expect_modes(
                    sync, freeze, f"where Sync {sync}, Freeze {freeze} were asked for"
                )
        self.master.chk_cfg(0xF1)
        self.expect_modes(True, True, "after the same configuration")
        self.master.chk_cfg(0xF0)
        self.expect_modes(False, False, "after another configuration")
        self.release()
        self.run(replace(EXAMPLE, watchdog=(10, 1)))
        self.control(both)
        time.sleep(0.3)
        self.expect_modes(False, False, "after the watchdog")
        return "by the bits of Set_Prm; off after another configuration and after the watchdog"

    def presets_once_where_the_request_is_repeated(self) -> str:
        """Its answer was lost; the repeated request finds the top bit as it was."""
        self.to("DATA_EXCH")
        self.out(0)
        request = self.master.request((TOP | 1000).to_bytes(4, "big"))
        answers = [self.master.answer_to(request.octets())]
        offset = self.stranger.slave_diag().offset
        for _ in range(2):
            # The stranger's request has made the slave forget its answer, so it executes again.
            time.sleep(0.02)
            answers.append(self.master.answer_to(request.octets()))
            expect("offset", self.stranger.slave_diag().offset, offset)
        seen = [int.from_bytes(book.Telegram.parse(answer).data, "big") for answer in answers]
        if not 1000 <= seen[0] < seen[1] < seen[2]:
            raise Wrong(f"the position should go on from 1000, it went {seen}")
        return f"{seen}, offset {offset}"

    # --- The runs

    def user_data_runs(self) -> list[Callable[[], None]]:
        """All."""
        return [self.preset_run, self.sync_and_freeze_run, self.turning_run]

    def preset_run(self) -> None:
        """What two words out can do."""
        self.chapter("7.4 Preset")
        with self.running_run(Start()):
            self.fresh(self.takes_a_preset_at_the_rise_of_the_top_bit)
            self.fresh(self.takes_one_preset_for_each_rise)
            self.fresh(self.takes_the_whole_range)
            self.fresh(self.refuses_a_preset_out_of_range)
            self.fresh(self.ends_that_alarm_with_parameters_of_class_1)
            self.fresh(self.presets_with_one_word)
            self.fresh(self.carries_the_low_word_of_a_wide_position)
            self.fresh(self.ignores_presets_in_class_1)
            self.fresh(self.keeps_a_preset_for_its_parameters)
            self.fresh(self.does_not_take_a_top_bit_that_was_stuck)
            self.fresh(self.does_not_take_it_after_the_watchdog)
            self.fresh(self.takes_clear_as_a_zero)

    def sync_and_freeze_run(self) -> None:
        """Global_Control."""
        self.chapter("5.2, 7.3 Sync and Freeze")
        with self.running_run(Start()):
            self.fresh(self.transfers_outputs_at_sync)
            self.fresh(self.judges_the_top_bit_on_transferred_outputs)
            self.fresh(self.transfers_at_once_at_unsync)
            self.fresh(self.clears_held_outputs)
            self.fresh(self.freezes_its_inputs)
            self.fresh(self.obeys_its_master_and_its_group_only)
            self.fresh(self.knows_sync_and_freeze_only_where_asked_for)

    def turning_run(self) -> None:
        """Freeze where it shows."""
        with self.running_run(Start(shaft="turn rpm=60")):
            self.fresh(self.freezes_a_turning_shaft)
            self.fresh(self.presets_once_where_the_request_is_repeated)
