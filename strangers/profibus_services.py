"""Every service in every state: chapters 5.2 and 6 of the manual. See `profibus_chapters.py`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import profibus_book as book
from profibus_book import Master, Parameters, Refused, Silence
from profibus_walk import (
    ADDRESS,
    CFG_FAULT,
    PARAMETERISED,
    POWER_ON,
    PRM_FAULT,
    RUNNING,
    STILL_AT,
    Start,
    Walk,
)
from steps import Wrong, expect, expect_within

STATES = ["WAIT_PRM", "refused", "WAIT_CFG", "DATA_EXCH"]
POSITION = STILL_AT.to_bytes(4, "big")
# The access points that a DP-V0 slave has.
KNOWN_SAPS = {
    book.RD_INP,
    book.RD_OUTP,
    book.GLOBAL_CONTROL,
    book.GET_CFG,
    book.SLAVE_DIAG,
    book.SET_PRM,
    book.CHK_CFG,
}


class Services(Walk):
    """All steps begin while the slave waits for parameters, on a shaft at rest."""

    # --- What is answered

    def answer(self, action: Callable[[], object]) -> str:
        """`SC` for nothing, the octets for data, or the refusal."""
        try:
            answer = action()
        except Refused as refused:
            return book.RESPONSES[refused.function]
        except Silence:
            return "silence"
        if answer is None:
            return "SC"
        if isinstance(answer, bytes):
            return answer.hex()
        return "answer"

    def table(
        self, service: Callable[[Master], object], rows: dict[str, tuple[str, str, str]]
    ) -> str:
        """Tries a service in each state of `rows`.

        Each row is the answer to the master and the state after it, and the answer to a stranger,
        after whom the state must be as before. Where the slave has no master yet, all are alike.
        """
        for state, (answer, after, strangers) in rows.items():
            # The stranger first, since he must change nothing.
            if state in ("WAIT_CFG", "DATA_EXCH"):
                self.release()
                self.to(state)
                expect(
                    f"{state}, stranger", self.answer(partial(service, self.stranger)), strangers
                )
                expect(f"state after the stranger in {state}", self.state(), state)
                expect(f"locking master in {state}", self.stranger.slave_diag().octet(4), 2)
            self.release()
            self.to(state)
            expect(f"{state}, master", self.answer(partial(service, self.master)), answer)
            expect(f"state afterwards in {state}", self.state(), after)
        return ", ".join(f"{state} {answer}" for state, (answer, _, _) in rows.items())

    def answers_slave_diag_in_every_state(self) -> str:
        return self.table(
            Master.slave_diag,
            {
                "WAIT_PRM": ("answer", "WAIT_PRM", "answer"),
                "refused": ("answer", "WAIT_PRM", "answer"),
                "WAIT_CFG": ("answer", "WAIT_CFG", "answer"),
                "DATA_EXCH": ("answer", "DATA_EXCH", "answer"),
            },
        )

    def answers_get_cfg_in_every_state(self) -> str:
        return self.table(
            Master.get_cfg,
            {
                "WAIT_PRM": ("f1", "WAIT_PRM", "f1"),
                "refused": ("f1", "WAIT_PRM", "f1"),
                "WAIT_CFG": ("f1", "WAIT_CFG", "f1"),
                "DATA_EXCH": ("f1", "DATA_EXCH", "f1"),
            },
        )

    def takes_set_prm_from_its_master_in_every_state(self) -> str:
        return self.table(
            lambda master: master.set_prm(self.default),
            {
                "WAIT_PRM": ("SC", "WAIT_CFG", ""),
                "refused": ("SC", "WAIT_CFG", ""),
                "WAIT_CFG": ("SC", "WAIT_CFG", "RS"),
                "DATA_EXCH": ("SC", "WAIT_CFG", "RS"),
            },
        )

    def takes_bad_parameters_with_an_acknowledge(self) -> str:
        return self.table(
            lambda master: master.set_prm(Parameters(ident=0x1234)),
            {
                "WAIT_PRM": ("SC", "WAIT_PRM", ""),
                "refused": ("SC", "WAIT_PRM", ""),
                "WAIT_CFG": ("SC", "WAIT_PRM", "RS"),
                "DATA_EXCH": ("SC", "WAIT_PRM", "RS"),
            },
        )

    def takes_chk_cfg_after_set_prm_only(self) -> str:
        return self.table(
            lambda master: master.chk_cfg(book.TWO_WORDS_BOTH_WAYS),
            {
                "WAIT_PRM": ("RS", "WAIT_PRM", ""),
                "refused": ("SC", "WAIT_PRM", ""),
                "WAIT_CFG": ("SC", "DATA_EXCH", "RS"),
                "DATA_EXCH": ("SC", "DATA_EXCH", "RS"),
            },
        )

    def takes_a_bad_chk_cfg_with_an_acknowledge(self) -> str:
        return self.table(
            lambda master: master.chk_cfg(0xD3),
            {
                "WAIT_PRM": ("RS", "WAIT_PRM", ""),
                "refused": ("SC", "WAIT_PRM", ""),
                "WAIT_CFG": ("SC", "WAIT_PRM", "RS"),
                "DATA_EXCH": ("SC", "WAIT_PRM", "RS"),
            },
        )

    def does_not_look_at_chk_cfg_after_refused_parameters(self) -> str:
        """The master learns of the refusal from the diagnosis after the configuration only."""
        self.to("refused")
        self.master.chk_cfg(0xD3)
        self.expect_head(PRM_FAULT, "head after Chk_Cfg D3")
        self.master.chk_cfg(0xF1, 0xF1)
        self.expect_head(PRM_FAULT, "head after a Chk_Cfg of two octets")
        self.expect_rs(lambda: self.stranger.chk_cfg(0xF1), "another master's Chk_Cfg")
        self.master.set_prm(self.default)
        self.expect_head(PARAMETERISED, "head after good parameters")
        self.master.chk_cfg(0xF1)
        self.expect_head(RUNNING, "head after a good configuration")
        self.master.set_prm(Parameters(ident=1))
        self.release()
        self.master.set_prm(self.default)
        self.master.chk_cfg(0xD3)
        self.expect_head(CFG_FAULT)
        self.expect_rs(lambda: self.master.chk_cfg(0xF1), "Chk_Cfg after a refused configuration")
        return "D3 and F1 F1 are answered SC with 42 05 00 FF; RS for another master"

    def exchanges_data_with_its_master_only(self) -> str:
        return self.table(
            lambda master: master.exchange(bytes(4)).data,
            {
                "WAIT_PRM": ("RS", "WAIT_PRM", ""),
                "refused": ("RS", "WAIT_PRM", ""),
                "WAIT_CFG": ("RS", "WAIT_CFG", "RS"),
                "DATA_EXCH": (POSITION.hex(), "DATA_EXCH", "RS"),
            },
        )

    def reads_inputs_for_any_master(self) -> str:
        return self.table(
            Master.rd_inp,
            {
                "WAIT_PRM": ("RS", "WAIT_PRM", ""),
                "refused": ("RS", "WAIT_PRM", ""),
                "WAIT_CFG": ("RS", "WAIT_CFG", "RS"),
                "DATA_EXCH": (POSITION.hex(), "DATA_EXCH", POSITION.hex()),
            },
        )

    def reads_outputs_for_any_master(self) -> str:
        seen = self.table(
            Master.rd_outp,
            {
                "WAIT_PRM": ("RS", "WAIT_PRM", ""),
                "refused": ("RS", "WAIT_PRM", ""),
                "WAIT_CFG": ("RS", "WAIT_CFG", "RS"),
                "DATA_EXCH": ("00000000", "DATA_EXCH", "00000000"),
            },
        )
        self.master.exchange(bytes.fromhex("01 23 45 67"))
        expect("outputs", self.stranger.rd_outp(), bytes.fromhex("01 23 45 67"))
        for configuration in (book.TWO_WORDS, book.ONE_WORD):
            self.release()
            self.to("DATA_EXCH", configuration=configuration)
            what = f"RD_Outp with {configuration:02X}"
            expect(what, self.answer(self.master.rd_outp), "NR")
        return seen + ", NR with D1 and D0"

    def does_not_support_set_slave_add(self) -> str:
        data = bytes([9, 0x05, 0x9B, 0])
        return self.table(
            lambda master: master.send_and_receive(master.request(data, book.SET_SLAVE_ADD)),
            {state: ("RS", "WAIT_PRM" if state == "refused" else state, "RS") for state in STATES},
        )

    def has_no_other_access_point(self) -> str:
        for state in STATES:
            self.release()
            self.to(state)
            for sap in sorted(set(range(64)) - KNOWN_SAPS):
                for data in (b"", b"\x01\x02"):
                    request = self.master.request(data, sap)
                    what = f"SAP {sap} in {state}"
                    self.expect_rs(partial(self.master.send_and_receive, request), what)
            after = "WAIT_PRM" if state == "refused" else state
            expect("state afterwards", self.state(), after)
        return f"RS at {64 - len(KNOWN_SAPS)} of 64 in every state"

    def acknowledges_a_repeated_request_whose_answer_was_lost(self) -> str:
        """The state has changed, so no answer is stored; executing it once more does no harm."""
        good, wrong = self.default.octets(), b"\x80" + bytes(6)
        for what, data, sap, after in [
            ("Set_Prm", good, book.SET_PRM, "WAIT_CFG"),
            ("Chk_Cfg", b"\xf1", book.CHK_CFG, "DATA_EXCH"),
            ("Set_Prm in data exchange", good, book.SET_PRM, "WAIT_CFG"),
            ("wrong parameters", wrong, book.SET_PRM, "WAIT_PRM"),
            ("Chk_Cfg after wrong parameters", b"\xf1", book.CHK_CFG, "WAIT_PRM"),
        ]:
            asked = self.master.request(data, sap).octets()
            expect(f"answer to {what}", self.master.answer_to(asked), b"\xe5")
            expect(f"answer to {what} again", self.master.answer_to(asked), b"\xe5")
            self.master.toggle()
            expect(f"state after {what}", self.state(), after)
        return "Set_Prm and Chk_Cfg twice each: E5"

    def clears_its_outputs_at_set_prm(self) -> str:
        self.to("DATA_EXCH")
        self.master.exchange(bytes.fromhex("01 02 03 04"))
        expect("outputs", self.master.rd_outp().hex(), "01020304")
        self.master.set_prm(self.default)
        self.expect_head(PARAMETERISED, "head after identical parameters")
        self.expect_rs(lambda: self.master.exchange(bytes(4)), "Data_Exchange after them")
        self.master.chk_cfg(0xF1)
        expect("outputs afterwards", self.master.rd_outp(), bytes(4))
        return "identical parameters: 02 04 00 02, outputs 0"

    # --- Two masters

    def belongs_to_the_master_that_parameterised_it(self) -> str:
        self.to("DATA_EXCH")
        self.stranger.slave_diag()
        for what, action in [
            ("Set_Prm", lambda: self.stranger.set_prm(self.default)),
            ("Unlock", self.stranger.unlock),
            ("Chk_Cfg", lambda: self.stranger.chk_cfg(0xF1)),
            ("Data_Exchange", lambda: self.stranger.exchange(bytes(4))),
        ]:
            self.expect_rs(action, f"the stranger's {what}")
            expect("position for its master", self.master.exchange(bytes(4)).data, POSITION)
        self.expect_head(RUNNING)
        self.master.unlock()
        self.expect_head(POWER_ON, "head after Unlock")
        self.stranger.bring_up(self.default)
        expect("position for the new master", self.stranger.exchange(bytes(4)).data, POSITION)
        self.expect_rs(lambda: self.master.exchange(bytes(4)), "the old master's Data_Exchange")
        return "RS to the stranger; after Unlock he may have it"

    # --- Lock and Unlock

    def locks_and_unlocks(self) -> str:
        free = Parameters(lock=False, unlock=True, ident=0x0000)
        both = Parameters(lock=True, unlock=True, ident=0x0000)
        for parameters, name in [(free, "Unlock"), (both, "Lock and Unlock")]:
            for state in ("WAIT_CFG", "DATA_EXCH"):
                self.release()
                self.to(state)
                self.master.set_prm(parameters)
                self.expect_head(POWER_ON, f"head after {name} in {state}")
        self.master.unlock()
        self.expect_head(POWER_ON, "head after Unlock while it waits for parameters")
        return "Unlock alone and with Lock, ident 0000: 02 05 00 FF"

    def changes_nothing_without_lock_and_unlock(self) -> str:
        neither = Parameters(
            lock=False, ident=0, steps=0, total=0, octet_8=0x80, watchdog=(0, 0), sync=True
        )
        for state, head in [
            ("WAIT_PRM", POWER_ON),
            ("WAIT_CFG", PARAMETERISED),
            ("DATA_EXCH", RUNNING),
        ]:
            self.release()
            self.to(state)
            self.master.set_prm(neither)
            self.expect_head(head, f"head afterwards in {state}")
            if state != "WAIT_PRM":
                self.expect_rs(lambda: self.stranger.set_prm(neither), "the stranger's")
        expect("position", self.master.exchange(bytes(4)).data, POSITION)
        return "SC, same state, nothing checked"

    # --- Watchdog

    def expect_watchdog(self, parameters: Parameters, seconds: float, state: str) -> float:
        """The time from the last telegram to the expiry, as a stranger sees it."""
        self.release()
        self.to(state, parameters)
        self.master.fdl_status()
        self.master.slave_diag()
        last = self.wire.seen[-1].at
        diagnosis = self.stranger.slave_diag()
        while diagnosis.octet(2) & 0x08:
            if time.time() - last > seconds + 1:
                raise Wrong(f"the watchdog of {seconds:g} s has not expired after a second more")
            time.sleep(0.004)
            diagnosis = self.stranger.slave_diag()
        lasted = self.wire.seen[-1].at - last
        expect(f"head afterwards in {state}", diagnosis.head, POWER_ON)
        expect_within("seconds to the expiry", lasted, seconds - 0.005, seconds + 0.3)
        if state == "DATA_EXCH":
            self.expect_rs(lambda: self.master.exchange(bytes(4)), "Data_Exchange afterwards")
        return lasted

    def expires_without_its_master(self) -> str:
        seen = []
        for factors, is_1_ms, seconds in [
            ((30, 1), False, 0.3),
            ((5, 10), False, 0.5),
            ((200, 1), True, 0.2),
            ((10, 15), True, 0.15),
        ]:
            parameters = replace(self.default, watchdog=factors, watchdog_1_ms=is_1_ms)
            for state in ("WAIT_CFG", "DATA_EXCH"):
                lasted = self.expect_watchdog(parameters, seconds, state)
            base = 1 if is_1_ms else 10
            seen.append(f"{factors[0]} · {factors[1]} · {base} ms: {1000 * lasted:.0f} ms")
        return ", ".join(seen)

    def shows_the_watchdog_in_the_diagnosis(self) -> str:
        parameters = replace(self.default, watchdog=(100, 10))
        self.master.set_prm(parameters)
        self.expect_head(bytes([0x02, 0x0C, 0x00, 0x02]))
        self.master.chk_cfg(0xF1)
        self.expect_head(bytes([0x00, 0x0C, 0x00, 0x02]))
        self.master.set_prm(self.default)
        self.expect_head(PARAMETERISED)
        return "02 0C 00 02, 00 0C 00 02; without it 02 04 00 02"

    def retriggers_by(self, what: str, action: Callable[[], object]) -> str:
        """Runs the action every 40 ms for 1.2 s under a watchdog of 500 ms."""
        self.release()
        self.to("DATA_EXCH", replace(self.default, watchdog=(50, 1)))
        for _ in range(30):
            action()
            time.sleep(0.04)
        expect(f"state after {what}", self.state(), "DATA_EXCH")
        return what

    def is_retriggered_by_any_request_of_its_master(self) -> str:
        request = self.master.request
        send = self.master.send_and_receive
        self.release()

        def refused() -> None:
            self.expect_rs(lambda: send(request(dsap=0x33)), "SAP 51")

        def replay() -> None:
            # The same octets again, so the stored answer comes.
            self.master.answer_to(bytes.fromhex("68 07 07 68 07 02 5D 00 00 00 00 66 16"))

        return ", ".join(
            [
                self.retriggers_by("Data_Exchange", lambda: self.master.exchange(bytes(4))),
                self.retriggers_by("Slave_Diag", self.master.slave_diag),
                self.retriggers_by("RD_Inp", self.master.rd_inp),
                self.retriggers_by("a refused request", refused),
                self.retriggers_by("a repeated request", replay),
            ]
        )

    def is_not_retriggered_by(self, what: str, action: Callable[[], object]) -> str:
        """Runs the action every 20 ms under a watchdog of 200 ms, which must expire."""
        self.release()
        self.to("DATA_EXCH", replace(self.default, watchdog=(20, 1)))
        deadline = time.time() + 0.4
        while time.time() < deadline:
            action()
            time.sleep(0.02)
        expect(f"state after {what}", self.state(), "WAIT_PRM")
        return what

    def is_not_retriggered_by_anything_else(self) -> str:
        def to_another() -> None:
            self.wire.send(bytes.fromhex("10 08 02 6D 77 16"))

        return ", ".join(
            [
                self.is_not_retriggered_by(
                    "Global_Control", partial(self.master.global_control, 0)
                ),
                self.is_not_retriggered_by("FDL status", self.master.fdl_status),
                self.is_not_retriggered_by("tokens", lambda: self.wire.send(book.token(2, 2))),
                self.is_not_retriggered_by("requests to others", to_another),
                self.is_not_retriggered_by("the stranger's requests", self.stranger.slave_diag),
                self.is_not_retriggered_by(
                    "broken telegrams", lambda: self.wire.send(bytes.fromhex("10 07 02 6D 00 16"))
                ),
            ]
        )

    def answers_what_came_just_before_it_expired(self) -> str:
        """The slave waits 255 bits with its answer, at 9600 26 ms; the watchdog expires in between."""
        for what, ask in [
            ("FDL status", self.stranger.fdl_status),
            ("Slave_Diag", self.stranger.slave_diag),
            ("Get_Cfg", self.stranger.get_cfg),
        ]:
            self.release()
            self.to("DATA_EXCH", replace(self.default, watchdog=(10, 1), min_tsdr=255))
            self.master.slave_diag()
            asked = self.wire.seen[-2].at
            time.sleep(max(0.0, asked + 0.090 - time.time()))
            try:
                ask()
            except Silence as silence:
                raise Wrong(f"{what} 90 ms after the last request: {silence}") from None
        return "FDL status, Slave_Diag and Get_Cfg 10 ms before the expiry"

    def leaves_no_answer_behind_when_it_expires(self) -> str:
        self.to("DATA_EXCH", replace(self.default, watchdog=(10, 1)))
        self.master.frame_count = True
        self.master.exchange(bytes(4))
        asked = self.wire.seen[-2].octets
        time.sleep(0.3)
        answer = self.master.answer_to(asked)
        wanted = book.Telegram(2, ADDRESS, book.RS).octets()
        expect("answer to the same request after the expiry", answer, wanted)
        return "the repeated request is answered RS"

    # --- The runs

    def services_run(self) -> None:
        """The table of services."""
        self.chapter("5.2, 6 Services in every state")
        with self.running_run(Start()):
            self.fresh(self.answers_slave_diag_in_every_state)
            self.fresh(self.answers_get_cfg_in_every_state)
            self.fresh(self.takes_set_prm_from_its_master_in_every_state)
            self.fresh(self.takes_bad_parameters_with_an_acknowledge)
            self.fresh(self.takes_chk_cfg_after_set_prm_only)
            self.fresh(self.takes_a_bad_chk_cfg_with_an_acknowledge)
            self.fresh(self.does_not_look_at_chk_cfg_after_refused_parameters)
            self.fresh(self.exchanges_data_with_its_master_only)
            self.fresh(self.reads_inputs_for_any_master)
            self.fresh(self.reads_outputs_for_any_master)
            self.fresh(self.does_not_support_set_slave_add)
            self.fresh(self.has_no_other_access_point)
            self.fresh(self.acknowledges_a_repeated_request_whose_answer_was_lost)
            self.fresh(self.clears_its_outputs_at_set_prm)
            self.fresh(self.belongs_to_the_master_that_parameterised_it)
            self.fresh(self.locks_and_unlocks)
            self.fresh(self.changes_nothing_without_lock_and_unlock)

    def watchdog_run(self) -> None:
        """Response monitoring."""
        self.chapter("6.1 Response monitoring")
        with self.running_run(Start()):
            self.fresh(self.shows_the_watchdog_in_the_diagnosis)
            self.fresh(self.expires_without_its_master)
            self.fresh(self.is_retriggered_by_any_request_of_its_master)
            self.fresh(self.is_not_retriggered_by_anything_else)
            self.fresh(self.leaves_no_answer_behind_when_it_expires)
        with self.running_run(Start(baud="9.6k")):
            self.fresh(self.answers_what_came_just_before_it_expired)
