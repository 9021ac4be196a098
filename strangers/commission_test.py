"""Do the slaves of the commissioning walks go by the book? Judged by masters that know them not."""

from __future__ import annotations

import time
import unittest

import can

import devicenet_master as book
from commission_devicenet_objects import ENCODER, VALVES, Encoder, valve_terminal
from commission_devicenet_slave import Slave
from commission_segment import CanSegment

CLASS_64 = VALVES


class DeviceNetSlaveGoesByTheBook(unittest.TestCase):
    def joined(self, *slaves: Slave) -> tuple[CanSegment, book.Master]:
        segment = CanSegment()
        self.addCleanup(segment.close)
        bus = can.Bus(
            f"socket://127.0.0.1:{segment.port}",
            interface="slcan",
            bitrate=125_000,
            sleep_after_open=0,
        )
        self.addCleanup(bus.shutdown)
        wire = book.Wire(bus)
        master = book.Master(wire, own=0x3F, slave=slaves[0].mac)
        master.RESPONSE_SECONDS = 2.5
        for slave in slaves:
            segment.join(slave)
        deadline = time.monotonic() + 5
        while not all(slave.is_on_line for slave in slaves) and time.monotonic() < deadline:
            wire.receive(0.05)
        return segment, master

    def valves(self, **options: object) -> tuple[Slave, book.Master]:
        slave = Slave(9, valve_terminal(), inputs=b"\x01\x02", **options)
        _, master = self.joined(slave)
        return slave, master

    def test_it_checks_its_mac_id_twice_and_objects_to_another_claim(self) -> None:
        slave, master = self.valves()
        claims = [str(frame) for frame in master.wire.seen]
        self.assertEqual(claims, ["44F#00090342EEFFC0"] * 2)
        objection = master.ask_duplicate_mac(vendor=1, serial=1)
        self.assertEqual(objection, book.DuplicateMacCheck(True, 0, 777, 0xC0FFEE42))
        self.assertEqual(len(slave.checks), 1)

    def test_a_master_has_it_and_another_is_kept_out(self) -> None:
        slave, master = self.valves()
        master.allocate(book.EXPLICIT | book.POLL)
        self.assertEqual(slave.allocations, [(0x3F, 3)])
        stranger = book.Master(master.wire, 10, 9)
        with self.assertRaises(book.Refused) as refused:
            stranger.allocate(book.EXPLICIT)
        self.assertEqual((refused.exception.status, refused.exception.additional), (0x0C, 0x01))
        self.assertEqual(master.get(3, 1, 5), b"\x03\x3f")
        self.assertEqual(master.set(5, 2, 9, b"\xe8\x03"), b"\xe8\x03")
        self.assertEqual(master.poll().data, b"\x01\x02")
        master.release(book.POLL)
        master.release(book.EXPLICIT)
        self.assertTrue(slave.is_free)
        self.assertEqual(slave.releases, [(0x3F, 2), (0x3F, 1)])

    def test_fragments_go_both_ways_and_lost_ones_come_again(self) -> None:
        slave, master = self.valves()
        master.allocate(book.EXPLICIT)
        self.assertEqual(master.get(CLASS_64, 1, 100), bytes(range(40)))
        slave.temper.lost_fragments = {3}
        self.assertEqual(master.get(CLASS_64, 1, 100), bytes(range(40)))
        value = bytes(range(100, 120))
        self.assertEqual(master.set(CLASS_64, 1, 101, value), b"")
        self.assertEqual(master.get(CLASS_64, 1, 101), value)
        body = bytes([book.SET, CLASS_64, 1, 101]) + bytes(20)
        master.explicit(body, repeat_fragments=True)
        self.assertEqual(master.get(CLASS_64, 1, 101), bytes(20))
        self.assertEqual(master.get_without_first_acknowledge(CLASS_64, 1, 100), bytes(range(40)))

    def test_parameters_describe_themselves(self) -> None:
        _, master = self.valves()
        master.allocate(book.EXPLICIT)
        self.assertEqual(master.get(0x0F, 0, 2), b"\x0a\x00")
        self.assertEqual(master.get(0x0F, 2, 7), b"\x0cSwitch delay")
        self.assertEqual(master.get(0x0F, 2, 11), b"\x88\x13")
        self.assertEqual(master.get(0x0F, 2, 3), bytes.fromhex("20 64 24 01 30 02"))
        self.assertEqual(master.service(book.GET_ENUM_STRING, 0x0F, 1, b"\x02"), b"\x04Open")
        self.assertEqual(master.set(0x0F, 2, 1, b"\x07\x00"), b"")
        self.assertEqual(master.get(CLASS_64, 1, 2), b"\x07\x00")

    def test_it_refuses_by_the_book(self) -> None:
        slave, master = self.valves()
        master.allocate(book.EXPLICIT)
        for body, status in [
            ("0E 63 01 01", 0x16),
            ("0E 64 02 01", 0x16),
            ("0E 64 01 63", 0x14),
            ("10 64 01 03 00 00", 0x0E),
            ("10 64 01 02 89 13", 0x09),
            ("10 64 01 02 01", 0x13),
            ("10 64 01 02 01 00 00", 0x15),
            ("32 64 01", 0x08),
        ]:
            with self.assertRaises(book.Refused) as refused:
                master.explicit(bytes.fromhex(body))
            self.assertEqual(refused.exception.status, status, body)
        slave.temper.refuse = {book.GET: (0x0F, 0x22)}
        with self.assertRaises(book.Refused) as refused:
            master.get(CLASS_64, 1, 1)
        self.assertEqual((refused.exception.status, refused.exception.additional), (0x0F, 0x22))

    def test_it_forgets_a_master_that_is_gone(self) -> None:
        slave, master = self.valves()
        master.allocate(book.EXPLICIT)
        master.set(5, 1, 9, b"\x64\x00")
        time.sleep(0.6)
        self.assertTrue(slave.is_free)
        self.assertEqual(slave.timeouts, 1)
        master.allocate(book.EXPLICIT)

    def test_it_can_be_late_or_die(self) -> None:
        slave, master = self.valves()
        master.allocate(book.EXPLICIT)
        slave.temper.late = 0.5
        begin = time.monotonic()
        self.assertEqual(master.get(CLASS_64, 1, 1), b"\x01")
        self.assertGreater(time.monotonic() - begin, 0.5)
        slave.temper.late, slave.temper.dies_after = 0, 2
        self.assertEqual(master.get(CLASS_64, 1, 1), b"\x01")
        master.RESPONSE_SECONDS = 0.3
        with self.assertRaises(book.Silence):
            master.get(CLASS_64, 1, 1)

    def test_the_encoder_counts_as_its_manual_says(self) -> None:
        encoder = Encoder(raw=100_000)
        _, master = self.joined(Slave(5, encoder.device))
        master.allocate(book.EXPLICIT)

        def number(attribute: int) -> int:
            return int.from_bytes(master.get(ENCODER, 1, attribute), "little", signed=True)

        self.assertEqual(number(12), 100_000)
        master.set(ENCODER, 1, 7, (3600).to_bytes(4, "little"))
        self.assertEqual((number(8), number(12)), (3600 * 65536, 100_000 * 3600 // 8192))
        master.set(0x0F, 8, 1, (5).to_bytes(4, "little"))
        self.assertEqual((number(12), number(91)), (5, 5 - 43_945))
        master.service(book.SAVE, ENCODER, 1)
        master.service(book.RESET, ENCODER, 1)
        self.assertEqual((number(7), number(12)), (8192, 100_000))
        master.service(book.RESTORE, ENCODER, 1)
        self.assertEqual((number(7), number(12)), (3600, 5))
        self.assertEqual(encoder.saves, 1)
        with self.assertRaises(book.Refused) as refused:
            master.set(ENCODER, 1, 7, (8193).to_bytes(4, "little"))
        self.assertEqual(refused.exception.status, 0x09)


if __name__ == "__main__":
    unittest.main()
