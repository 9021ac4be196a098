"""Does the master itself go by the book? Tested against scripted answers on a virtual bus."""

from __future__ import annotations

import itertools
import threading
import unittest
import unittest.mock

import can

import devicenet_master as book

_channels = itertools.count()

Script = dict[str, list[str]]


class ScriptedSlave:
    """Answers given frames (`42C#3F0E0107`) with given frames; it understands nothing."""

    def __init__(self, channel: str, script: Script) -> None:
        self._bus = can.Bus(channel, interface="virtual")
        self._script = {asked: list(answers) for asked, answers in script.items()}
        self._stopped = threading.Event()
        self.heard: list[str] = []
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while True:
            message = self._bus.recv(0.01)
            if message is None:
                if self._stopped.is_set():
                    return
                continue
            asked = f"{message.arbitration_id:03X}#{bytes(message.data).hex().upper()}"
            self.heard.append(asked)
            for answer in self._script.get(asked, []):
                identifier, data = answer.split("#")
                self._bus.send(
                    can.Message(
                        arbitration_id=int(identifier, 16),
                        data=bytes.fromhex(data),
                        is_extended_id=False,
                    )
                )

    def stop(self) -> None:
        """Hears what is still on its way, and leaves the bus."""
        self._stopped.set()
        self._thread.join()
        self._bus.shutdown()


class MasterGoesByTheBook(unittest.TestCase):
    def against(self, script: Script) -> tuple[book.Master, ScriptedSlave]:
        channel = f"channel-{next(_channels)}"
        slave = ScriptedSlave(channel, script)
        self.addCleanup(slave.stop)
        bus = can.Bus(channel, interface="virtual")
        self.addCleanup(bus.shutdown)
        master = book.Master(book.Wire(bus), own=0x3F, slave=5)
        master.RESPONSE_SECONDS = 0.3
        master.ACKNOWLEDGE_SECONDS = 0.3
        return master, slave

    def test_identifiers_are_those_of_the_table(self) -> None:
        self.assertEqual(book.group_2(5, book.UNCONNECTED_REQUEST), 0x42E)
        self.assertEqual(book.group_2(63, book.DUPLICATE_MAC), 0x5FF)
        self.assertEqual(book.group_2(5, book.ACKNOWLEDGE_COMMAND), 0x42A)
        self.assertEqual(book.poll_response_identifier(5), 0x3C5)
        self.assertEqual(book.change_of_state_identifier(5), 0x345)

    def test_a_claim_to_the_mac_id_is_objected_to(self) -> None:
        master, _ = self.against({"42F#00010002000000": ["42F#80D401D2040000"]})
        objection = master.ask_duplicate_mac(vendor=1, serial=2)
        self.assertEqual(objection, book.DuplicateMacCheck(True, 0, 468, 1234))

    def test_only_cb_00_is_an_allocation(self) -> None:
        master, _ = self.against({"42E#3F4B0301033F": ["42B#3FCB00"]})
        master.allocate(3)
        longer, _ = self.against({"42E#3F4B0301033F": ["42B#3FCB0000"]})
        with self.assertRaisesRegex(book.BookViolation, "CB 00, got cb 00 00"):
            longer.allocate(3)

    def test_a_refusal_is_raised_with_its_codes(self) -> None:
        master, _ = self.against({"42E#3F4B0301033F": ["42B#3F940C01"]})
        with self.assertRaisesRegex(book.Refused, "0C/01 .object state conflict") as caught:
            master.allocate(3)
        self.assertEqual((caught.exception.status, caught.exception.additional), (0x0C, 1))

    def test_a_foreign_header_or_service_is_a_violation(self) -> None:
        foreign, _ = self.against({"42C#3F0E0101": ["42B#0A8ED401"]})
        with self.assertRaisesRegex(book.BookViolation, "our XID and MAC ID"):
            foreign.explicit(b"\x0e\x01\x01")
        wrong, _ = self.against({"42C#3F0E010101": ["42B#3F90D401"]})
        with self.assertRaisesRegex(book.BookViolation, "response to service 0E is 8E"):
            wrong.get(1, 1, 1)

    def test_a_request_of_eight_octets_goes_in_two_acknowledged_fragments(self) -> None:
        master, slave = self.against(
            {
                "42C#BF00102F0107100E": ["42B#BFC000"],
                "42C#BF810000": ["42B#BFC100", "42B#3F90"],
            }
        )
        self.assertEqual(master.set(0x2F, 1, 7, (3600).to_bytes(4, "little")), b"")
        self.assertEqual(slave.heard, ["42C#BF00102F0107100E", "42C#BF810000"])

    def test_a_request_of_twelve_octets_ends_with_a_last_fragment(self) -> None:
        master, slave = self.against(
            {
                "42C#BF00102F01070102": ["42B#BFC000"],
                "42C#BF81030405060708": ["42B#BFC100", "42B#3F9415FF"],
            }
        )
        with self.assertRaises(book.Refused):
            master.set(0x2F, 1, 7, bytes(range(1, 9)))
        self.assertEqual(len(slave.heard), 2)

    def test_a_missing_or_wrong_acknowledge_is_told(self) -> None:
        silent, _ = self.against({})
        with self.assertRaisesRegex(book.Silence, "no acknowledge of fragment 0 .42B."):
            silent.set(0x2F, 1, 7, bytes(4))
        wrong, _ = self.against({"42C#BF00102F01070000": ["42B#BFC001"]})
        with self.assertRaisesRegex(book.BookViolation, "bf c0 00, got bf c0 01"):
            wrong.set(0x2F, 1, 7, bytes(4))

    def test_a_fragmented_response_is_put_together_and_acknowledged(self) -> None:
        master, slave = self.against(
            {
                "42C#3F0E010107": ["42B#BF008E12414D4720"],
                "42C#BFC000": ["42B#BF413131202D2020"],
                "42C#BFC100": ["42B#BF824D756C"],
            }
        )
        self.assertEqual(master.get(1, 1, 7), b"\x12AMG 11 -  Mul")
        slave.stop()
        self.assertEqual(slave.heard[1:], ["42C#BFC000", "42C#BFC100", "42C#BFC200"])

    def test_a_response_fragment_with_a_wrong_count_is_a_violation(self) -> None:
        master, _ = self.against(
            {"42C#3F0E010107": ["42B#BF008E12414D4720"], "42C#BFC000": ["42B#BF824D756C"]}
        )
        with self.assertRaisesRegex(book.BookViolation, "wrong count"):
            master.get(1, 1, 7)

    def test_a_poll_is_answered_once_or_not_at_all(self) -> None:
        master, _ = self.against({"42D#": ["3C5#00100000"]})
        self.assertEqual(master.poll().data, bytes([0, 0x10, 0, 0]))
        with self.assertRaisesRegex(book.BookViolation, "no poll response is due here"):
            master.expect_no_poll_response()
        twice, _ = self.against({"42D#": ["3C5#00100000", "3C5#00100000"]})
        with self.assertRaisesRegex(book.BookViolation, "no second poll response"):
            twice.poll()
        silent, _ = self.against({})
        with self.assertRaisesRegex(book.Silence, "no poll response .3C5. of MAC ID 5"):
            silent.poll()

    def test_what_is_produced_is_acknowledged_with_an_empty_frame(self) -> None:
        master, slave = self.against(
            {"42D#": ["345#00100000"], "42A#": ["345#01100000", "3C5#0110"]}
        )
        master.wire.send(0x42D, b"")
        heard = master.listen(0.2, acknowledge=True)
        self.assertEqual([str(frame) for frame in heard[:2]], ["345#00100000", "345#01100000"])
        slave.stop()
        self.assertEqual(slave.heard[:2], ["42D#", "42A#"])

    def test_a_heartbeat_is_never_taken_for_a_response(self) -> None:
        master, _ = self.against({"42C#3F0E010101": ["42B#05CD010003001234", "42B#3F8ED401"]})
        self.assertEqual(master.get(1, 1, 1), b"\xd4\x01")
        master, _ = self.against({"42D#": ["42B#05CD010003001234", "42B#3F8ED401"]})
        master.wire.send(0x42D, b"")
        # The script answered at once; that must not be dropped.
        with unittest.mock.patch.object(master, "forget"):
            heart = master.heartbeats(0.2)
        self.assertEqual([(h.instance, h.state, h.flags) for h in heart], [(1, 3, 0)])
        self.assertEqual(heart[0].consistency, 0x3412)

    def test_a_master_gets_through_while_the_slave_produces_all_the_time(self) -> None:
        master, slave = self.against({"42C#3F0E010101": ["42B#3F8ED401"]})
        chatter = threading.Event()

        def produce() -> None:
            while not chatter.wait(0.001):
                slave._bus.send(can.Message(arbitration_id=0x345, is_extended_id=False))

        thread = threading.Thread(target=produce)
        thread.start()
        try:
            self.assertEqual(master.get(1, 1, 1), b"\xd4\x01")
        finally:
            chatter.set()
            thread.join()


if __name__ == "__main__":
    unittest.main()
