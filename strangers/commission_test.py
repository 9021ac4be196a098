"""Do the slaves of the commissioning walks go by the book? Judged by masters that know them not."""

from __future__ import annotations

import time
import unittest

import can

import devicenet_master as book
import profibus_book as profibus
from commission_devicenet_objects import ENCODER, VALVES, Encoder, valve_terminal
from commission_devicenet_slave import Slave
from commission_profibus_master import RingMaster, encoder_at
from commission_profibus_slave import Encoder as DpEncoder
from commission_profibus_slave import Slave as DpSlave
from commission_profibus_slave import ValveIsland
from commission_segment import CanSegment, Node, SerialLine


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
        slave = Slave(9, valve_terminal(), inputs=lambda: b"\x01\x02", **options)
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
        self.assertEqual(master.get(VALVES, 1, 100), bytes(range(40)))
        slave.temper.lost_fragments = {3}
        self.assertEqual(master.get(VALVES, 1, 100), bytes(range(40)))
        value = bytes(range(100, 120))
        self.assertEqual(master.set(VALVES, 1, 101, value), b"")
        self.assertEqual(master.get(VALVES, 1, 101), value)
        body = bytes([book.SET, VALVES, 1, 101]) + bytes(20)
        master.explicit(body, repeat_fragments=True)
        self.assertEqual(master.get(VALVES, 1, 101), bytes(20))
        self.assertEqual(master.get_without_first_acknowledge(VALVES, 1, 100), bytes(range(40)))

    def test_parameters_describe_themselves(self) -> None:
        _, master = self.valves()
        master.allocate(book.EXPLICIT)
        self.assertEqual(master.get(0x0F, 0, 2), b"\x0a\x00")
        self.assertEqual(master.get(0x0F, 2, 7), b"\x0cSwitch delay")
        self.assertEqual(master.get(0x0F, 2, 11), b"\x88\x13")
        self.assertEqual(master.get(0x0F, 2, 3), bytes.fromhex("20 64 24 01 30 02"))
        self.assertEqual(master.service(book.GET_ENUM_STRING, 0x0F, 1, b"\x02"), b"\x04Open")
        self.assertEqual(master.set(0x0F, 2, 1, b"\x07\x00"), b"")
        self.assertEqual(master.get(VALVES, 1, 2), b"\x07\x00")

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
            master.get(VALVES, 1, 1)
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
        self.assertEqual(master.get(VALVES, 1, 1), b"\x01")
        self.assertGreater(time.monotonic() - begin, 0.5)
        slave.temper.late, slave.temper.dies_after = 0, 2
        self.assertEqual(master.get(VALVES, 1, 1), b"\x01")
        master.RESPONSE_SECONDS = 0.3
        with self.assertRaises(book.Silence):
            master.get(VALVES, 1, 1)

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


class ProfibusSlaveGoesByTheBook(unittest.TestCase):
    def joined(self, *nodes: Node[bytes]) -> tuple[SerialLine, profibus.Master]:
        line = SerialLine()
        self.addCleanup(line.close)
        for node in nodes:
            line.join(node)
        wire = profibus.Wire.over_tcp("127.0.0.1", line.port)
        self.addCleanup(wire.close)
        return line, profibus.Master(wire, own=2, slave=7)

    def encoder(self, raw: int = 100_000) -> tuple[DpSlave, DpEncoder, profibus.Master]:
        device = DpEncoder(raw)
        slave = DpSlave(7, device)
        _, master = self.joined(slave)
        return slave, device, master

    def test_it_tells_the_diagnosis_of_the_manual_and_comes_up(self) -> None:
        slave, _, master = self.encoder()
        master.fdl_status()
        diagnosis = master.slave_diag()
        self.assertEqual(diagnosis.head, bytes.fromhex("02 05 00 FF"))
        self.assertEqual(len(diagnosis.octets), 57)
        self.assertEqual((diagnosis.number(5, 6), diagnosis.number(11, 14)), (0x059B, 8192))
        with self.assertRaises(profibus.Refused):
            master.exchange(bytes(4))
        steps, total = 3600, 3600 * 256
        master.bring_up(profibus.Parameters(steps=steps, total=total, watchdog=(1, 100)))
        self.assertEqual(slave.locked_by, [2])
        self.assertEqual(master.position(bytes(4)), 100_000 * 3600 // 8192)
        diagnosis = master.slave_diag()
        self.assertEqual(diagnosis.head, bytes.fromhex("00 0C 00 02"))
        self.assertEqual((diagnosis.steps, diagnosis.total), (steps, total))
        stranger = profibus.Master(master.wire, 3, 7)
        with self.assertRaises(profibus.Refused):
            stranger.set_prm(profibus.Parameters())
        master.unlock()
        self.assertEqual((slave.state, slave.unlocked_by), ("WAIT_PRM", [2]))

    def test_the_clock_bit_presets_once(self) -> None:
        _, device, master = self.encoder()
        master.bring_up()
        self.assertEqual(master.position(bytes.fromhex("80 00 00 05")), 100_000)
        self.assertEqual(master.position(bytes(4)), 100_000)
        self.assertEqual(master.preset(5), (5, 5))
        self.assertEqual(device.presets, [5])
        self.assertEqual(master.slave_diag().offset, 5 - 100_000)
        master.preset(536_870_912)
        self.assertEqual((device.presets, master.slave_diag().alarms), ([5], 1))
        master.preset(6)
        self.assertEqual(master.slave_diag().alarms, 0)

    def test_a_repeated_request_is_not_executed_again(self) -> None:
        slave, device, master = self.encoder()
        master.bring_up()
        master.exchange(bytes(4))
        request = master.request(bytes.fromhex("80 00 00 07")).octets()
        slave.temper.loses_answers = 1
        with self.assertRaises(profibus.Silence):
            master.answer_to(request, 0.1)
        self.assertEqual(master.answer_to(request)[-6:-2], bytes.fromhex("00 00 00 07"))
        self.assertEqual(device.presets, [7])
        self.assertEqual(len(device.outputs), 2)

    def test_wrong_parameters_are_told_in_the_diagnosis(self) -> None:
        slave, _, master = self.encoder()
        for wrong in (
            profibus.Parameters(ident=1),
            profibus.Parameters(steps=8193),
            profibus.Parameters(steps=1, total=65_537),
            profibus.Parameters(length=9),
        ):
            master.set_prm(wrong)
            master.chk_cfg(0xF1)
            self.assertEqual(master.slave_diag().head, bytes.fromhex("42 05 00 FF"))
        master.set_prm(profibus.Parameters())
        master.chk_cfg(0xF3)
        self.assertEqual(master.slave_diag().head, bytes.fromhex("06 05 00 FF"))
        self.assertEqual(slave.locked_by, [2])

    def test_the_watchdog_frees_it(self) -> None:
        slave, _, master = self.encoder()
        master.bring_up(profibus.Parameters(watchdog=(1, 10)))
        time.sleep(0.25)
        self.assertEqual((slave.watchdog_ends, slave.state), (1, "WAIT_PRM"))

    def test_a_device_of_another_maker_comes_up(self) -> None:
        slave = DpSlave(7, ValveIsland())
        _, master = self.joined(slave)
        self.assertEqual(master.get_cfg(), b"\x11\x21")
        parameters = profibus.Parameters(ident=0x7A31, length=7).octets() + b"\x00\x12\x34"
        master.acknowledged(master.request(parameters, profibus.SET_PRM))
        master.chk_cfg(0x11, 0x21)
        self.assertEqual(master.exchange(b"\x0f\xf0").data, b"\xf0\x0f")
        self.assertEqual(master.slave_diag().octets[4:], bytes.fromhex("7A 31 03 80 01"))

    def test_two_masters_share_a_ring_and_a_slave_falls_to_neither(self) -> None:
        slave = DpSlave(7, DpEncoder(5))
        first = RingMaster(2, [encoder_at(7)])
        second = RingMaster(4)
        line, _ = self.joined(slave, first)
        time.sleep(0.5)
        # The second is asked, as one of the gap, and says that it is ready.
        line.join(second)
        time.sleep(1.5)
        self.assertGreater(first.slaves[0].exchanges, 20)
        self.assertEqual(first.slaves[0].falls, 0)
        self.assertGreater(second.got_from.get(2, 0), 5)
        self.assertGreater(first.got_from.get(4, 0), 5)
        line.part(second)
        time.sleep(1.2)
        # Either it left with the token, which had to be taken up, or it was passed to in vain.
        self.assertEqual((len(first.lost) + first.tokens_taken_up, first.next), (1, 2))
        self.assertEqual(slave.locked_by, [2])


if __name__ == "__main__":
    unittest.main()
