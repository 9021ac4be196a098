"""Characters and telegrams: chapter 5.1 of the manual. No script: see `profibus_chapters.py`."""

from __future__ import annotations

import os
import pty
import random
import time
import tty
from collections.abc import Callable
from functools import partial

import profibus_book as book
from profibus_book import MASTER_SAP, Master, Parameters, Silence, Telegram, Wire
from profibus_walk import (
    ADDRESS,
    CFG_FAULT,
    OUR_ADDRESS,
    PRM_FAULT,
    RUNNING,
    STRANGER_ADDRESS,
    Start,
    Walk,
)
from steps import Wrong, expect, expect_within

SLAVE_DIAG = Telegram(ADDRESS, OUR_ADDRESS, 0x6D, b"", book.SLAVE_DIAG, MASTER_SAP).octets()
GET_CFG = Telegram(ADDRESS, OUR_ADDRESS, 0x6D, b"", book.GET_CFG, MASTER_SAP).octets()
CONFIGURATION = Telegram(OUR_ADDRESS, ADDRESS, 0x08, b"\xf1", MASTER_SAP, book.GET_CFG).octets()
# A telegram that goes on after this pause goes on; after the long one it is abandoned.
SHORT_PAUSE, LONG_PAUSE = 0.010, 0.120
RATES = ["9.6k", "19.2k", "45.45k", "93.75k", "187.5k", "500k", "1.5M", "3M", "6M", "12M"]


def broken(at: int, octet: int) -> bytes:
    """The request Slave_Diag with one octet replaced."""
    return SLAVE_DIAG[:at] + bytes([octet]) + SLAVE_DIAG[at + 1 :]


def nonsense(chance: random.Random) -> bytes:
    """DA, SA, FC and data that frame a telegram for the slave, or nearly so, and mean little."""
    da, sa = chance.choice([0x07, 0x87, 0x7F, 0xFF]), chance.choice([0x02, 0x82, 0x83])
    fc = chance.choice([0x4D, 0x5D, 0x6D, 0x7D, 0x46, 0x49, chance.randrange(256)])
    data = bytes([chance.randrange(0x36, 0x40), MASTER_SAP])[: (da >> 7) + (sa >> 7)]
    return bytes([da, sa, fc]) + data + chance.randbytes(chance.choice([0, 1, 2, 4, 17, 60]))


class Telegrams(Walk):
    """All steps begin while the slave waits for parameters; its shaft may turn."""

    def is_there(self) -> None:
        """After a pause the slave answers as ever: it waits for nothing from before."""
        time.sleep(SHORT_PAUSE)
        # Nothing is forgotten here, so an answer that came late would be seen.
        self.wire.send(GET_CFG)
        answer = self.master.next_answer(GET_CFG)
        expect("answer to Get_Cfg after a pause", answer, CONFIGURATION)

    def ignores(self, what: str, octets: bytes) -> str:
        """Writes what must stay without an answer, and looks that the slave is still there."""
        try:
            self.master.expect_silence(octets)
            self.is_there()
        except (book.BookViolation, Silence) as error:
            raise Wrong(f"{what}: {error}") from None
        return what

    def ignores_all(self, cases: dict[str, bytes]) -> str:
        """The same for many."""
        return ", ".join(self.ignores(what, octets) for what, octets in cases.items())

    def answered_rs(self, request: Telegram, what: str) -> None:
        """A request that must be answered RS, whatever its frame count bit."""
        self.expect_rs(partial(self.master.send_and_receive, request), what)

    # --- Frames

    def answers_the_request_of_the_book_with_the_telegram_of_the_book(self) -> str:
        asked = bytes.fromhex("68 05 05 68 87 82 6C 3C 3E EF 16")
        wanted = "68 3E 3E 68 82 87 08 3E 3C 02 05 00 FF 05 9B 33 00 0A 01 00 00 20 00 FF FF 00"
        wanted += "00 01 00 00 00 00 01 10 01 21 FF FF FF FF" + "00" * 8
        wanted += "00 00 20 00 20 00 00 00" + "2A" * 10 + "A1 16"
        expect("power-up diagnosis", self.master.answer_to(asked), bytes.fromhex(wanted))
        return "68 3E 3E 68 82 87 08 3E 3C 02 05 00 FF … A1 16"

    def drops_what_is_broken(self) -> str:
        wrong_end = broken(len(SLAVE_DIAG) - 1, 0x17)
        return self.ignores_all(
            {
                "wrong FCS": broken(9, SLAVE_DIAG[9] ^ 0x01),
                "wrong end": wrong_end,
                "LE differs": broken(2, 0x06),
                "second 68 missing": broken(3, 0x67),
                "first octet 69": broken(0, 0x69),
                "LE 3": bytes.fromhex("68 03 03 68 07 02 49 52 16"),
                "LE 0": bytes.fromhex("68 00 00 68 00 16"),
                "LE 250": b"\x68\xfa\xfa\x68"
                + (body := bytes([ADDRESS, OUR_ADDRESS, 0x6D]) + bytes(247))
                + bytes([sum(body) & 0xFF, 0x16]),
                "SD1 with a wrong FCS": bytes.fromhex("10 07 02 49 53 16"),
                "SD1 with a wrong end": bytes.fromhex("10 07 02 49 52 17"),
                "SD3 with a wrong FCS": bytes.fromhex("A2 87 82 6D 3C 3E 00 00 00 00 00 00 00 16"),
                "garbage": bytes(range(0x20, 0x60)),
                "a lone 16": b"\x16",
                "a lone E5": b"\xe5",
                "broken off": SLAVE_DIAG[:-3],
            }
        )

    def takes_no_telegram_out_of_a_broken_one(self) -> str:
        inside = book.framed(bytes([0x22, OUR_ADDRESS, 0x6D]) + SLAVE_DIAG + b"\x00\x00")
        return self.ignores_all(
            {
                "inside a wrong FCS": inside[:-2] + b"\xff\x16",
                "after garbage": b"\x00\xff\x55" + SLAVE_DIAG,
                "after a wrong FCS": broken(9, 0x00) + SLAVE_DIAG,
                "after a broken SD1": bytes.fromhex("10 07 02 49 00 16") + SLAVE_DIAG,
                "after LE differs": bytes.fromhex("68 05 06 68") + SLAVE_DIAG,
                "inside a telegram to somebody else": inside,
            }
        )

    def reads_telegrams_in_pieces(self) -> str:
        expect("answer in one piece", self.master.answer_to(GET_CFG), CONFIGURATION)
        self.wire.forget()
        for octet in GET_CFG[:-1]:
            self.wire.send(bytes([octet]))
            time.sleep(SHORT_PAUSE)
        expect("answer octet by octet", self.master.answer_to(GET_CFG[-1:]), CONFIGURATION)
        for at in (1, 3, 4, 7, 10):
            self.wire.send(GET_CFG[:at])
            time.sleep(SHORT_PAUSE)
            answer = self.master.answer_to(GET_CFG[at:])
            expect(f"answer cut after {at} octets", answer, CONFIGURATION)
        return "octet by octet with 10 ms between, and cut in two"

    def abandons_a_telegram_after_a_long_pause(self) -> str:
        self.wire.send(GET_CFG[:6])
        time.sleep(LONG_PAUSE)
        expect("answer to a whole one", self.master.answer_to(GET_CFG), CONFIGURATION)
        self.wire.send(GET_CFG[:6])
        time.sleep(LONG_PAUSE)
        self.master.expect_silence(GET_CFG[6:])
        self.is_there()
        return "a whole one is answered after half a one; the other half means nothing"

    def answers_the_last_of_several_in_one_write(self) -> str:
        token = book.token(OUR_ADDRESS, OUR_ADDRESS)
        for before, what in [
            (token, "a token"),
            (Telegram(8, OUR_ADDRESS, 0x49).octets(), "a request to somebody else"),
            (Telegram(OUR_ADDRESS, 8, 0x00).octets(), "somebody else's answer"),
            (Telegram(127, OUR_ADDRESS, 0x46, b"\0\0", 0x3A, 0x3E).octets(), "Global_Control"),
            (SLAVE_DIAG, "Slave_Diag, whose answer is dropped"),
        ]:
            answer = self.master.answer_to(before + GET_CFG)
            expect(f"answer after {what}", answer, CONFIGURATION)
            self.master.expect_silence(b"", 0.1)
        return "after a token, others' telegrams, Global_Control and a Slave_Diag that is dropped"

    def reads_sd3_like_sd2(self) -> str:
        head = bytes([0x80 | ADDRESS, 0x80 | OUR_ADDRESS, 0x6D])
        short = Parameters().octets()[:6]
        parameters = book.framed_in_eight(head + bytes([book.SET_PRM, MASTER_SAP]) + short)
        expect("answer to Set_Prm with 6 octets", self.master.answer_to(parameters), b"\xe5")
        self.expect_head(PRM_FAULT)
        self.master.frame_count = None
        self.release()
        self.to("WAIT_CFG")
        self.master.frame_count = None
        configuration = book.framed_in_eight(head + bytes([book.CHK_CFG, MASTER_SAP, *[0xF1] * 6]))
        expect("answer to Chk_Cfg with 6 octets", self.master.answer_to(configuration), b"\xe5")
        self.expect_head(CFG_FAULT)
        return "Set_Prm: E5 and Prm_Fault; Chk_Cfg: E5 and Cfg_Fault"

    def survives_anything(self) -> str:
        """Noise, broken requests and well-formed nonsense, from a seed."""
        chance = random.Random(1921)
        good = [SLAVE_DIAG, GET_CFG, Telegram(ADDRESS, OUR_ADDRESS, 0x7D, bytes(4)).octets()]
        for count in range(600):
            if count % 3 == 0:
                octets = chance.randbytes(chance.randrange(1, 300))
            elif count % 3 == 1:
                good_one, octet = chance.choice(good), chance.randrange(256)
                at = chance.randrange(len(good_one))
                octets = good_one[:at] + bytes([octet]) + good_one[at + 1 :]
            else:
                octets = book.framed(nonsense(chance))
            self.wire.send(octets)
            time.sleep(0.07 if count % 50 == 0 else 0.002)
            # Whatever it answers must be a telegram.
            self.wire.forget()
        time.sleep(LONG_PAUSE)
        self.wire.forget()
        self.is_there()
        diagnosis = self.master.slave_diag()
        expect("ident number", diagnosis.number(5, 6), 0x059B)
        return "600 times: what it answers are telegrams, and it is still there"

    # --- Addresses and function codes

    def answers_only_at_its_own_address(self) -> str:
        def diag(da: int, sa: int = OUR_ADDRESS, fc: int = 0x6D) -> bytes:
            return Telegram(da, sa, fc, b"", book.SLAVE_DIAG, MASTER_SAP).octets()

        cases = {f"DA {da}": diag(da) for da in (0, 6, 8, 71, 126, 127)}
        cases |= {f"SA {sa}": diag(ADDRESS, sa) for sa in (ADDRESS, 126, 127)}
        cases |= {
            f"FDL status from {sa}": Telegram(ADDRESS, sa, 0x49).octets()
            for sa in (ADDRESS, 126, 127)
        }
        cases["FDL status of 127"] = Telegram(127, OUR_ADDRESS, 0x49).octets()
        return self.ignores_all(cases)

    def ignores_what_is_no_request(self) -> str:
        codes = [0x08, 0x00, 0x0D, 0x2D, 0xC9, 0xCD, 0xED]
        codes += [0x40, 0x41, 0x42, 0x47, 0x48, 0x4A, 0x4B]
        return self.ignores_all(
            {
                f"FC {fc:02X}": Telegram(
                    ADDRESS, OUR_ADDRESS, fc, b"", book.SLAVE_DIAG, MASTER_SAP
                ).octets()
                for fc in codes
            }
            | {f"FC {fc:02X} in SD1": Telegram(ADDRESS, OUR_ADDRESS, fc).octets() for fc in codes}
        )

    def ignores_sdn_other_than_global_control(self) -> str:
        saps = [None, book.SLAVE_DIAG, book.GET_CFG, book.SET_PRM, book.CHK_CFG, 0x00, 0x3F]
        return self.ignores_all(
            {
                f"SDN {fc:02X} to SAP {sap}": Telegram(
                    ADDRESS, OUR_ADDRESS, fc, b"\xf1\x00", sap, None if sap is None else MASTER_SAP
                ).octets()
                for fc in (book.SDN_LOW, book.SDN_HIGH)
                for sap in saps
            }
        )

    def refuses_sda_ident_and_lsap(self) -> str:
        seen = []
        for state in ("WAIT_PRM", "WAIT_CFG", "DATA_EXCH"):
            self.release()
            self.to(state)
            for code in (book.SDA_LOW, book.SDA_HIGH, book.IDENT, book.LSAP_STATUS):
                self.answered_rs(Telegram(ADDRESS, OUR_ADDRESS, code), f"{code:02X} in {state}")
                if code in (book.SDA_LOW, book.SDA_HIGH):
                    request = Telegram(ADDRESS, OUR_ADDRESS, code, b"", book.SLAVE_DIAG, MASTER_SAP)
                    self.answered_rs(request, f"{code:02X} Slave_Diag in {state}")
            expect("state", self.state(), state)
            seen.append(state)
        return f"RS in {', '.join(seen)}"

    def tells_its_fdl_status_in_every_state(self) -> str:
        for state in ("WAIT_PRM", "refused", "WAIT_CFG", "DATA_EXCH"):
            self.release()
            self.to(state)
            self.master.fdl_status()
            self.stranger.fdl_status()
            Master(self.wire, 0, ADDRESS).fdl_status()
            Master(self.wire, 125, ADDRESS).fdl_status()
        return "10 SA TS 00 FCS 16 for masters 0, 2, 3, 125"

    def takes_srd_low_and_high_alike(self) -> str:
        low = self.master.slave_diag(book.SRD_LOW)
        high = self.master.slave_diag(book.SRD_HIGH)
        expect("diagnosis by SRD high", high.octets, low.octets)
        self.to("DATA_EXCH")
        seen = set()
        for function in (book.SRD_LOW, book.SRD_HIGH):
            answer = self.master.data_of(self.master.request(bytes(4), function=function))
            seen.add((answer.fc, len(answer.data)))
        expect("FC and length of the data", seen, {(book.DATA_LOW, 4)})
        return "the same diagnosis, the same data"

    def demands_both_address_extensions_or_none(self) -> str:
        for name, body in [
            ("DA only", "87 02 6D 3C"),
            ("SA only", "07 82 6D 3E"),
            ("DA only, in data", "87 02 6D 3C 3E"),
            ("SA only, in data", "07 82 6D 3C 3E"),
        ]:
            octets = book.framed(bytes.fromhex(body))
            wanted = Telegram(OUR_ADDRESS, ADDRESS, book.RS).octets()
            expect(f"answer to {name}", self.master.answer_to(octets), wanted)
        return "RS for one alone"

    def takes_any_source_access_point(self) -> str:
        for ssap in (0x00, 0x01, 0x33, 0x36, 0x3D, 0x3E, 0x3F):
            request = self.master.request(dsap=book.GET_CFG, ssap=ssap)
            answer = self.master.data_of(request)
            expect("SAPs of the answer", (answer.dsap, answer.ssap), (ssap, book.GET_CFG))
        return "swapped in the answer: 00, 01, 33, 36, 3D, 3E, 3F"

    # --- Frame count bit, on a turning shaft

    def raw(self, fc: int, out: bytes = bytes(4), sa: int = OUR_ADDRESS) -> bytes:
        """A Data_Exchange with a given FC, and its answer."""
        return self.master.answer_to(Telegram(ADDRESS, sa, fc, out).octets())

    def differs(self, what: str, fc: int, before: bytes) -> bytes:
        """The same request must be executed: the shaft has moved."""
        time.sleep(0.005)
        answer = self.raw(fc)
        if answer == before:
            raise Wrong(f"{what}: the old answer came again: {answer.hex(' ')}")
        return answer

    def same(self, what: str, fc: int, before: bytes) -> None:
        """The same request must be answered as before, though the shaft has moved."""
        time.sleep(0.005)
        expect(what, self.raw(fc), before)

    def repeats_the_stored_answer_to_a_repeated_request(self) -> str:
        self.to("DATA_EXCH")
        begun = self.raw(0x6D)
        first = self.differs("FCB toggled, 0", 0x5D, begun)
        self.same("repeated with FCB 0", 0x5D, first)
        self.same("repeated again", 0x5D, first)
        second = self.differs("FCB toggled, 1", 0x7D, first)
        self.same("repeated with FCB 1", 0x7D, second)
        return "5D and 7D are repeated, 6D, 5D, 7D are new"

    def executes_each_request_without_valid_frame_count(self) -> str:
        self.to("DATA_EXCH")
        first = self.raw(0x4D)
        second = self.differs("FCV 0, FCB 0 again", 0x4D, first)
        third = self.differs("FCV 0, FCB 1", 0x6D, second)
        self.differs("FCV 0, FCB 1 again", 0x6D, third)
        return "4D and 6D twice"

    def executes_another_request_with_an_unchanged_frame_count(self) -> str:
        """The trap: a master that lost our answers falls back with an unchanged FCB."""
        self.to("DATA_EXCH")
        self.raw(0x6D)
        data = self.raw(0x5D)
        request = Telegram(ADDRESS, OUR_ADDRESS, 0x5D, b"", book.SLAVE_DIAG, MASTER_SAP)
        answer = self.master.checked(request, self.master.answer_to(request.octets()))
        if answer is None or answer.ssap != book.SLAVE_DIAG:
            raise Wrong(f"Slave_Diag with the old FCB was answered {answer}")
        expect("diagnosis", answer.data[:4], RUNNING)
        other = self.raw(0x5D, b"\x00\x00\x00\x01")
        if other == data:
            raise Wrong("other data with the old FCB was answered with the old data")
        return "Slave_Diag 5D after Data_Exchange 5D is answered with the diagnosis"

    def drops_the_stored_answer(self) -> str:
        self.to("DATA_EXCH")
        events: list[tuple[str, Callable[[], object]]] = [
            ("a token", lambda: self.wire.send(book.token(OUR_ADDRESS, OUR_ADDRESS))),
            ("an FDL status", self.master.fdl_status),
            ("a request to another", lambda: self.wire.send(bytes.fromhex("10 08 02 49 53 16"))),
            ("another master's request", self.stranger.slave_diag),
        ]
        for what, event in events:
            self.raw(0x6D)
            first = self.raw(0x5D)
            self.same(f"before {what}", 0x5D, first)
            event()
            self.differs(f"after {what}", 0x5D, first)
        self.raw(0x6D)
        first = self.raw(0x5D)
        self.master.global_control(0)
        time.sleep(0.01)
        self.same("after Global_Control", 0x5D, first)
        self.master.expect_silence(broken(9, 0x00))
        self.same("after a broken telegram", 0x5D, first)
        dropped = ", ".join(what for what, _ in events)
        return f"after {dropped}; not after Global_Control"

    def keeps_one_stored_answer_for_one_master(self) -> str:
        self.to("DATA_EXCH")
        self.raw(0x6D)
        ours = self.raw(0x5D)
        request = Telegram(ADDRESS, STRANGER_ADDRESS, 0x5D, b"", book.GET_CFG, MASTER_SAP)
        answer = self.master.checked(request, self.master.answer_to(request.octets()))
        expect("the stranger's Get_Cfg with the same FC", answer and answer.data, b"\xf1")
        self.differs("our request after the stranger's", 0x5D, ours)
        return "another SA is new, and so are we afterwards"

    # --- Delays and rates

    def delay_with(self, min_tsdr: int) -> float:
        """Milliseconds from the request to the first octet of the answer, the fastest of nine."""
        self.release()
        self.to("DATA_EXCH", Parameters(min_tsdr=min_tsdr))
        delays = []
        for _ in range(9):
            self.master.exchange(bytes(4))
            asked, answered = self.wire.seen[-2:]
            delays.append(1000 * (answered.at - asked.at))
        return min(delays)

    def obeys_min_tsdr(self) -> str:
        bit = 1000 / 9600
        seen = {min_tsdr: self.delay_with(min_tsdr) for min_tsdr in (11, 255, 0, 5, 100)}
        self.master.set_prm(Parameters(min_tsdr=255))
        asked, answered = self.wire.seen[-2:]
        own = answered.at - asked.at
        expect_within("ms to the acknowledge of 255 itself", 1000 * own, 100 * bit, 190 * bit)
        self.release()
        self.to("DATA_EXCH", Parameters(min_tsdr=255, watchdog=(10, 1)))
        time.sleep(0.3)
        self.stranger.slave_diag()
        asked, answered = self.wire.seen[-2:]
        kept = 1000 * (answered.at - asked.at)
        expect_within("ms to an answer after the watchdog", kept, 255 * bit, 345 * bit)
        text = ", ".join(f"{tsdr}: {delay:.1f} ms" for tsdr, delay in seen.items())
        for min_tsdr, least, most in [
            (11, 11, 100),
            (255, 255, 345),
            # 0 keeps the 255.
            (0, 255, 345),
            (5, 11, 100),
            (100, 100, 190),
        ]:
            if not least * bit <= seen[min_tsdr] <= most * bit:
                raise Wrong(
                    f"min T_SDR {min_tsdr} of 9.6k is {least * bit:.1f} ms or a little more: {text}"
                )
        return text

    def answers_at(self, baud: str) -> str:
        """The FDL status at a rate."""
        self.start(Start(baud=baud))
        try:
            self.master.fdl_status()
            self.master.bring_up()
        finally:
            self.stop()
        return "FDL status, data exchange"

    def answers_on_a_serial_port(self) -> str:
        """The other way round: the port is ours, a pty, and the program opens it."""
        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        name = os.ttyname(theirs)
        try:
            line = self.process.launch(
                ["encoder", "amg11-p29", "--bus", f"rs485:{name}", "--baud", "19200"]
                + ["--address", str(ADDRESS), "--shaft", "still angle=7"]
            )
            expect("first line", line, f"ready amg11-p29 address {ADDRESS} on rs485:{name}")
            self._wire = Wire(ours, lambda: os.close(ours), self._log)
            master = Master(self.wire, OUR_ADDRESS, ADDRESS)
            master.bring_up()
            expect("position", master.position(bytes(4)), 7)
            self.process.terminate()
        finally:
            self.leave_bus()
            self.process.end()
            os.close(theirs)
        return line

    # --- The runs

    def telegrams_run(self) -> None:
        """Spec by spec, on a turning shaft."""
        self.chapter("5.1 Telegrams")
        with self.running_run(Start(shaft="turn rpm=60")):
            self.named(self.answers_the_request_of_the_book_with_the_telegram_of_the_book)
            self.fresh(self.drops_what_is_broken)
            self.fresh(self.takes_no_telegram_out_of_a_broken_one)
            self.fresh(self.reads_telegrams_in_pieces)
            self.fresh(self.abandons_a_telegram_after_a_long_pause)
            self.fresh(self.answers_the_last_of_several_in_one_write)
            self.fresh(self.reads_sd3_like_sd2)
            self.fresh(self.survives_anything)
            self.fresh(self.answers_only_at_its_own_address)
            self.fresh(self.ignores_what_is_no_request)
            self.fresh(self.ignores_sdn_other_than_global_control)
            self.fresh(self.refuses_sda_ident_and_lsap)
            self.fresh(self.tells_its_fdl_status_in_every_state)
            self.fresh(self.takes_srd_low_and_high_alike)
            self.fresh(self.demands_both_address_extensions_or_none)
            self.fresh(self.takes_any_source_access_point)
            self.chapter("5.1 Frame count bit")
            self.fresh(self.repeats_the_stored_answer_to_a_repeated_request)
            self.fresh(self.executes_each_request_without_valid_frame_count)
            self.fresh(self.executes_another_request_with_an_unchanged_frame_count)
            self.fresh(self.drops_the_stored_answer)
            self.fresh(self.keeps_one_stored_answer_for_one_master)

    def rates_run(self) -> None:
        """Delays at 9.6k, then each rate."""
        self.chapter("5.1 Delays and rates")
        with self.running_run(Start(baud="9.6k")):
            self.fresh(self.obeys_min_tsdr)
        for baud in RATES:
            self.step(f"answers at {baud}", partial(self.answers_at, baud))
        self.named(self.answers_on_a_serial_port)
