"""Does the PROFIBUS master itself go by the book? Judged by printed telegrams and scripts."""

from __future__ import annotations

import socket
import threading
import unittest

import profibus_book as book
from profibus_book import Diagnosis, Parameters, Telegram

# A 29 bit slave, address 7, asked by master 2 after power-up.
POWER_UP = bytes.fromhex(
    "68 3E 3E 68 82 87 08 3E 3C 02 05 00 FF 05 9B 33 00 0A 01 00 00 20 00 FF FF 00 00 01"
    "00 00 00 00 01 10 01 21 FF FF FF FF"
    + "00" * 8
    + "00 00 20 00 20 00 00 00"
    + "2A" * 10
    + "A1 16"
)


class ScriptedSlave:
    """Answers given octets with given octets; it understands nothing."""

    def __init__(self, script: list[tuple[str, str]]) -> None:
        self._script = [(bytes.fromhex(a), bytes.fromhex(b)) for a, b in script]
        self.heard: list[bytes] = []
        ours, self._theirs = socket.socketpair()
        ours.setblocking(False)
        self.wire = book.Wire(ours.fileno(), ours.close)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        for asked, answer in self._script:
            heard = self._theirs.recv(300)
            self.heard.append(heard)
            if heard != asked:
                return
            self._theirs.sendall(answer)

    def stop(self) -> None:
        """Hangs up."""
        # So that a thread that still listens ends.
        self._theirs.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._theirs.close()
        self.wire.close()


class MasterGoesByTheBook(unittest.TestCase):
    def against(self, *script: tuple[str, str]) -> tuple[book.Master, ScriptedSlave]:
        slave = ScriptedSlave(list(script))
        self.addCleanup(slave.stop)
        master = book.Master(slave.wire, own=2, slave=7)
        master.RESPONSE_SECONDS = 0.2
        return master, slave

    # --- Telegrams

    def test_a_request_without_data_is_sd1(self) -> None:
        self.assertEqual(Telegram(7, 2, 0x49).octets().hex(" "), "10 07 02 49 52 16")
        self.assertEqual(Telegram.parse(Telegram(7, 2, 0x49).octets()), Telegram(7, 2, 0x49))

    def test_the_power_up_diagnosis_is_read(self) -> None:
        telegram = Telegram.parse(POWER_UP)
        self.assertEqual((telegram.da, telegram.sa, telegram.fc), (2, 7, 8))
        self.assertEqual((telegram.dsap, telegram.ssap), (0x3E, 0x3C))
        self.assertEqual(telegram.octets(), POWER_UP)
        diagnosis = Diagnosis.parse(telegram.data)
        self.assertEqual(len(diagnosis.octets), 57)
        self.assertTrue(diagnosis.waits_for_parameters and diagnosis.is_not_ready)
        self.assertEqual(diagnosis.head, bytes.fromhex("02 05 00 FF"))
        self.assertEqual(diagnosis.number(5, 6), 0x059B)
        self.assertEqual(diagnosis.number(11, 14), 8192)
        self.assertEqual(diagnosis.number(15, 16), 0xFFFF)
        self.assertEqual(diagnosis.part(18, 19), b"\x00\x01")
        self.assertEqual(diagnosis.part(24, 27), bytes.fromhex("01 10 01 21"))
        self.assertEqual((diagnosis.offset, diagnosis.steps), (0, 8192))
        self.assertEqual(diagnosis.total, 536_870_912)
        self.assertEqual(diagnosis.part(48, 57), b"*" * 10)

    def test_a_negative_offset_is_read(self) -> None:
        octets = bytearray(Telegram.parse(POWER_UP).data)
        octets[31:35] = b"\xff\xff\xff\xfe"
        self.assertEqual(Diagnosis.parse(bytes(octets)).offset, -2)

    def test_a_diagnosis_whose_length_lies_is_a_violation(self) -> None:
        octets = Telegram.parse(POWER_UP).data
        with self.assertRaisesRegex(book.BookViolation, "octet 7 says 51, but 50"):
            Diagnosis.parse(octets[:-1])
        with self.assertRaisesRegex(book.BookViolation, "bit 2 of octet 2"):
            Diagnosis.parse(bytes.fromhex("02 01 00 FF 05 9B"))

    def test_each_broken_telegram_is_told(self) -> None:
        good = bytes.fromhex("68 05 05 68 87 82 6C 3C 3E EF 16")
        self.assertEqual(Telegram.parse(good), Telegram(7, 2, 0x6C, b"", 0x3C, 0x3E))
        for at, octet, message in [
            (9, 0xEE, "FCS must be EF"),
            (10, 0x17, "ends with 16"),
            (2, 0x06, "68 LE LE 68"),
            (3, 0x10, "68 LE LE 68"),
            (0, 0x69, "no telegram starts with 69"),
        ]:
            broken = bytearray(good)
            broken[at] = octet
            with self.assertRaisesRegex(book.BookViolation, message):
                Telegram.parse(bytes(broken))
        with self.assertRaisesRegex(book.BookViolation, "extension is missing"):
            Telegram.parse(book.framed(bytes.fromhex("87 82 6C 3C")))

    def test_every_prefix_of_a_telegram_is_not_yet_one(self) -> None:
        for whole in (POWER_UP, Telegram(7, 2, 0x49).octets(), book.token(3, 4)):
            for end in range(1, len(whole)):
                length = book.length_of(whole[:end])
                self.assertTrue(length is None or length > end)
            self.assertEqual(book.length_of(whole), len(whole))

    def test_sd3_carries_eight_octets(self) -> None:
        octets = book.framed_in_eight(bytes.fromhex("87 82 6D 3E 3E 01 02 03 04 05 06"))
        self.assertEqual(len(octets), 14)
        self.assertEqual(Telegram.parse(octets).data, bytes(range(1, 7)))

    # --- Parameters

    def test_parameters_are_those_of_the_printed_request(self) -> None:
        # 10 user octets, watchdog 1 · 20 · 10 ms.
        seen = Parameters(watchdog=(1, 20), octet_1=0x30, sync=False).octets()
        printed = "B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00"
        self.assertEqual(seen, bytes.fromhex(printed))

    def test_the_example_of_chapter_8_has_hi_14_and_lo_4096(self) -> None:
        octets = Parameters(steps=3600, total=3600 * 256).octets()
        self.assertEqual(octets[9:13], bytes.fromhex("00 00 0E 10"))
        self.assertEqual(int.from_bytes(octets[13:15], "big"), 14)
        self.assertEqual(int.from_bytes(octets[15:17], "big"), 4096)

    def test_a_length_cuts_or_fills_parameters(self) -> None:
        for length in (0, 7, 9, 17, 25, 40):
            self.assertEqual(len(Parameters(length=length).octets()), length)

    # --- The master

    def test_the_bring_up_is_the_printed_conversation(self) -> None:
        ready = Telegram.parse(POWER_UP).data[6:]
        diagnosis = Telegram(2, 7, 8, bytes.fromhex("00 0C 00 02 05 9B") + ready, 0x3E, 0x3C)
        parameters = "68 16 16 68 87 82 5D 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00"
        master, slave = self.against(
            ("68 05 05 68 87 82 6D 3C 3E F0 16", POWER_UP.hex()),
            (parameters + "A3 16", "E5"),
            ("68 06 06 68 87 82 7D 3E 3E F1 F3 16", "E5"),
            ("68 05 05 68 87 82 5D 3C 3E E0 16", diagnosis.octets().hex()),
            ("68 07 07 68 07 02 7D 00 00 00 00 86 16", "68 07 07 68 02 07 08 00 00 10 00 21 16"),
        )
        answer = master.bring_up(Parameters(watchdog=(1, 20), sync=True, freeze=True))
        self.assertEqual(answer.head, bytes.fromhex("00 0C 00 02"))
        self.assertEqual(master.position(bytes(4)), 0x1000)
        self.assertEqual(len(slave.heard), 5)

    def test_the_frame_count_bit_stays_until_an_answer_comes(self) -> None:
        master, slave = self.against(
            ("68 05 05 68 87 82 6D 3C 3E F0 16", POWER_UP.hex()),
            ("68 05 05 68 87 82 5D 3B 3E DF 16", ""),
            ("68 05 05 68 87 82 5D 3B 3E DF 16", "68 06 06 68 82 87 08 3E 3B F1 7B 16"),
        )
        master.slave_diag()
        with self.assertRaisesRegex(book.Silence, "no answer to .68 05 05 68 87 82 5d 3b 3e"):
            master.get_cfg()
        self.assertEqual(master.get_cfg(), b"\xf1")
        self.assertEqual(master.request().fc, 0x7D)
        self.assertEqual(len(slave.heard), 3)

    def test_rs_and_nr_are_refusals(self) -> None:
        master, _ = self.against(
            ("10 07 02 6D 76 16", "10 02 07 03 0C 16"),
            ("68 05 05 68 87 82 5D 39 3E DD 16", "10 02 07 09 12 16"),
        )
        with self.assertRaisesRegex(book.Refused, "answered RS"):
            master.exchange()
        with self.assertRaisesRegex(book.Refused, "answered NR"):
            master.rd_outp()

    def test_an_answer_of_another_kind_is_a_violation(self) -> None:
        for answer, message in [
            ("E5", "data is due"),
            ("68 07 07 68 03 07 08 00 00 10 00 22 16", "wrong addresses"),
            ("68 07 07 68 02 07 18 00 00 10 00 31 16", "FC 18 is none of a slave"),
            ("68 09 09 68 82 87 08 3E 3C 00 00 10 00 9B 16", "come back swapped"),
            ("A2 02 07 08 00 00 00 00 00 00 00 00 11 16", "sends SD1 or SD2"),
            ("68 05 05 68 02 07 03 00 00 0C 16", "RS is 10"),
            ("16", "no telegram starts with 16"),
            ("68 07 07 68 02 07 08", "broke off"),
        ]:
            master, _ = self.against(("10 07 02 6D 76 16", answer))
            with self.assertRaisesRegex(book.BookViolation, message):
                master.exchange()

    def test_silence_is_demanded_where_it_is_due(self) -> None:
        master, _ = self.against(("10 08 02 49 53 16", "10 02 07 00 09 16"))
        with self.assertRaisesRegex(book.BookViolation, "must not be answered"):
            master.expect_silence(bytes.fromhex("10 08 02 49 53 16"))
        master.expect_silence(bytes.fromhex("10 08 02 49 53 16"), 0.05)

    def test_what_other_masters_say_is_no_answer(self) -> None:
        others = "DC 03 02" + "10 08 03 49 54 16"
        master, _ = self.against(("10 07 02 49 52 16", others + "10 02 07 00 09 16"))
        master.fdl_status()

    def test_a_preset_is_sent_twice_with_the_top_bit_as_clock(self) -> None:
        master, slave = self.against(
            ("68 07 07 68 07 02 6D 80 00 00 2A 20 16", "68 07 07 68 02 07 08 00 00 00 2A 3B 16"),
            ("68 07 07 68 07 02 5D 00 00 00 2A 90 16", "68 07 07 68 02 07 08 00 00 00 2B 3C 16"),
        )
        self.assertEqual(master.preset(42), (42, 43))
        self.assertEqual(len(slave.heard), 2)


if __name__ == "__main__":
    unittest.main()
