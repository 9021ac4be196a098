"""All the manual says, chapter by chapter: a stranger reads it, and looks whether it is so.

Usage: devicenet_chapters.py [PROGRAM] [--log FILE] [--part NAME ...]

    python3 -m venv venv && venv/bin/pip install -r strangers/requirements.txt
    cargo build && venv/bin/python strangers/devicenet_chapters.py

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) as an AMG 81 D29
behind an SLCAN adapter on TCP, and plays the master with python-can through chapters 3 to 9 of the
manual: operating modes (operating_modes.py), settings and objects (device_objects.py), switches,
lamp and network (here). Each step prints one line, `ok` or `FAILED`, with what was seen; the last
line counts them, and the exit status is 1 if any failed. All frames go to FILE as candump -L lines.
All of it takes three minutes; `--part` walks some of it:

    turning     chapter 3 at 60 rpm: allocation, poll, change of state, cyclic
    resting     chapter 3 at rest: packet rate, acknowledge and its time-outs
    objects     chapters 4 to 9, with a power cut in the middle
    taken       chapter 9: the MAC ID belongs to somebody else
    rushing     chapter 8: the alarm, on a shaft that is too fast
    singleturn  an AMG 81 D13 at address 63 and 500 kbit/s

Times are judged by medians and with room, so that a busy machine does no harm.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TextIO

import devicenet_master as book
from device_objects import STILL_AT, DeviceObjects
from operating_modes import OperatingModes
from steps import Ended, Wrong, arguments_of, expect, expect_within
from walkthrough import (
    ADDRESS,
    ASSEMBLY,
    CONNECTION,
    COS_CONNECTION,
    COS_DELTA,
    DEFAULT_TOTAL,
    DEVICENET,
    ENCODER,
    ESTABLISHED,
    IDENTITY,
    POLL_CONNECTION,
    POSITION,
    PRODUCED_PATH,
    SERIAL,
    STEPS,
    STEPS_PER_TURN,
    TIMED_OUT,
    TOTAL,
    VENDOR,
    Program,
    Walk,
    expect_refusal,
    udint,
    uint,
    unsigned,
)

PARTS = ["turning", "resting", "objects", "taken", "rushing", "singleturn"]

HEARTBEAT_INTERVAL = 10
# At rest, then faster than any shaft may turn, then at rest.
RUSH_TURNS, RUSH_SECONDS = 1050, 3.0
RUSHING_SHAFT = f"profile 0s:0 5s:0 {5 + RUSH_SECONDS:g}s:{RUSH_TURNS}turns"


class Network(Walk):
    """Chapter 9: switches, lamp as far as the wire shows it, MAC ID, heartbeat; and the alarm."""

    # --- Chapter 9: switches and connections

    def tells_its_switches(self) -> str:
        return self.expect_switches(ADDRESS, 0)

    def expect_switches(self, address: int, baud: int) -> str:
        """The attributes of the DeviceNet object that come from the switches."""
        for attribute, wanted in [(1, address), (2, baud), (6, 0), (7, 0), (8, address), (9, baud)]:
            octets = self.master.get(DEVICENET, 1, attribute)
            expect(f"attribute {attribute}", octets, bytes([wanted]))
            set_ = partial(self.master.set, DEVICENET, 1, attribute, bytes([wanted]))
            expect_refusal(set_, 0x0E)
        return f"MAC ID {address}, baud rate {baud}; Set 0E"

    def keeps_boi_and_counts_bus_offs(self) -> str:
        for value in (1, 0):
            expect("data", self.master.set(DEVICENET, 1, 3, bytes([value])), b"")
            expect("BOI", self.master.get(DEVICENET, 1, 3), bytes([value]))
        expect_refusal(lambda: self.master.set(DEVICENET, 1, 3, b"\x02"), 0x09)
        expect("bus-off counter", self.master.get(DEVICENET, 1, 4), b"\x00")
        self.master.set(DEVICENET, 1, 4, b"\x00")
        return "BOI 0 and 1, 2 refused with 09; bus-off counter 0"

    def shows_the_states_of_the_lamp_in_its_connections(self) -> str:
        seen = []

        def status(what: str, wanted: int) -> None:
            value = unsigned(self.master.get(IDENTITY, 1, 5), 2) & 1
            expect(f"owned, {what}", value, wanted)

        with self.connections():
            status("explicit only", 1)
            expect_refusal(partial(self.connection_state, POLL_CONNECTION), 0x16)
            seen.append("green by the explicit connection")
            self.master.allocate(book.POLL)
            expect("state", self.connection_state(POLL_CONNECTION), 1)
            self.set_packet_rate(POLL_CONNECTION, 60)
            expect("state", self.connection_state(POLL_CONNECTION), ESTABLISHED)
            self.master.poll()
            time.sleep(0.4)
            expect("state 4 rates after the last poll", self.connection_state(2), TIMED_OUT)
            seen.append("red flashing when timed out")
            self.master.expect_no_poll_response(seconds=0.2)
            self.master.service(book.RESET, CONNECTION, POLL_CONNECTION)
            expect("state after Reset", self.connection_state(POLL_CONNECTION), ESTABLISHED)
            self.master.poll()
            seen.append("green after Reset")
        self.master.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]), 0.3)
        return ", ".join(seen)

    # --- Heartbeat

    def beats_its_heart_every_second(self) -> str:
        seen = []
        with self.connections():
            expect("interval", self.master.get(IDENTITY, 1, HEARTBEAT_INTERVAL), b"\x00")
            expect("heartbeats while the interval is 0", self.master.heartbeats(1.5), [])
            self.master.set(IDENTITY, 1, HEARTBEAT_INTERVAL, b"\x01")
            expect("interval", self.master.get(IDENTITY, 1, HEARTBEAT_INTERVAL), b"\x01")
            seen.append(self.expect_heartbeats("connected", 3.5, 3))
            state = unsigned(self.master.get(IDENTITY, 1, 8), 1)
            consistency = unsigned(self.master.get(IDENTITY, 1, 9), 2)
            beat = self.master.heartbeats(1.3)[-1]
            expect("state as attribute 8", beat.state, state)
            expect("value as attribute 9", beat.consistency, consistency)
        seen.append(self.expect_heartbeats("without a connection", 3.5, 3))
        return "; ".join(seen) + f"; state {state}, consistency {consistency:04X}"

    def expect_heartbeats(self, what: str, seconds: float, least: int) -> str:
        """A second apart, of instance 1, no flag set."""
        beats = self.master.heartbeats(seconds)
        if len(beats) < least:
            raise Wrong(f"{what}: only {len(beats)} heartbeats in {seconds:g} s")
        expect("instances and flags", {(b.instance, b.flags) for b in beats}, {(1, 0)})
        apart = [after.at - before.at for before, after in zip(beats, beats[1:], strict=False)]
        expect_within("seconds between heartbeats", statistics.median(apart), 0.97, 1.05)
        return f"{what} every {statistics.median(apart):.3f} s"

    def changes_the_consistency_value_with_what_is_kept(self) -> str:
        def value() -> int:
            return unsigned(self.master.get(IDENTITY, 1, 9), 2)

        before = value()
        self.put(COS_DELTA, 12_345)
        self.encoder_service(book.SAVE)
        after = value()
        if after == before:
            raise Wrong(f"the value stays {before:04X} though a Save changed the COS delta")
        return f"{before:04X}, after a Save {after:04X}"

    def beats_its_heart_again_after_power_off(self) -> str:
        seen = self.expect_heartbeats("kept without Save", 3.3, 3)
        with self.connections():
            self.master.set(IDENTITY, 1, HEARTBEAT_INTERVAL, b"\x00")
            expect("heartbeats when set to 0", self.master.heartbeats(1.5), [])
        return seen + "; none when set to 0"

    # --- Identity Reset

    def refuses_other_resets(self) -> str:
        for data, status in [(b"\x02", 0x20), (b"\xff", 0x20), (b"\x00\x00", 0x15)]:
            reset = partial(self.master.service, book.RESET, IDENTITY, 1, data)
            expect_refusal(reset, status)
        return "types 02 and FF 20, two octets 15"

    def returns_to_the_defaults_by_identity_reset_1(self) -> str:
        with self.connections():
            self.put(STEPS_PER_TURN, 3600)
            self.encoder_service(book.SAVE)
            self.master.set(IDENTITY, 1, HEARTBEAT_INTERVAL, b"\x01")
            self.master.set(DEVICENET, 1, 3, b"\x01")
            answer = self.master.explicit(bytes([book.RESET, IDENTITY, 1, 1]))
            expect("response to Reset", answer, b"\x85")
            expected = book.DuplicateMacCheck(False, 0, VENDOR, SERIAL)
            first, check = self.master.hear_duplicate_mac(2.0)
            expect("first request", check, expected)
            second, check = self.master.hear_duplicate_mac(2.0)
            expect_within("seconds between the requests", second.at - first.at, 0.9, 1.3)
        time.sleep(1.3)
        with self.connections(book.POLL):
            self.expect_settings(0, STEPS, DEFAULT_TOTAL, 0, 0, 1)
            expect("interval", self.master.get(IDENTITY, 1, HEARTBEAT_INTERVAL), b"\x00")
            expect("BOI", self.master.get(DEVICENET, 1, 3), b"\x00")
            expect("serial number", self.master.get(IDENTITY, 1, 6), udint(SERIAL))
            status = unsigned(self.master.get(IDENTITY, 1, 5), 2)
            expect("status: owned, not configured", status, 0x0001)
            path = self.master.get(CONNECTION, POLL_CONNECTION, PRODUCED_PATH)
            expect("produced path", path, bytes.fromhex("20042401"))
        return "85, two requests; settings, path, BOI and heartbeat of the factory, serial kept"

    # --- Duplicate MAC ID

    def defends_its_mac_id_and_stays(self) -> str:
        with self.connections(book.POLL):
            self.set_packet_rate(POLL_CONNECTION, 10_000)
            for serial in (1, SERIAL):
                objection = self.master.ask_duplicate_mac(vendor=VENDOR, serial=serial)
                wanted = book.DuplicateMacCheck(True, 0, VENDOR, SERIAL)
                expect("objection", objection, wanted)
            self.master.poll()
        return "objects to each request, and polls go on"

    def falls_silent_at_a_response_with_its_mac_id(self) -> str:
        master = self.master
        master.allocate(book.EXPLICIT | book.POLL | book.CHANGE_OF_STATE | book.UNACKNOWLEDGED)
        self.set_packet_rate(POLL_CONNECTION, 10_000)
        self.set_packet_rate(COS_CONNECTION, 100)
        master.poll()
        master.set(IDENTITY, 1, HEARTBEAT_INTERVAL, b"\x01")
        self.claim(is_response=True)
        time.sleep(0.05)
        return self.expect_silence()

    def claim(self, is_response: bool) -> None:
        """A duplicate MAC ID check message of somebody else with the MAC ID of the encoder."""
        claim = book.DuplicateMacCheck(is_response, 0, 1, 2)
        identifier = book.group_2(self.master.slave, book.DUPLICATE_MAC)
        self.wire.send(identifier, claim.octets())

    def expect_silence(self) -> str:
        """Nothing at all comes any more, whatever is asked."""
        while self.wire.receive(0.02) is not None:
            pass
        begin = len(self.wire.seen)
        slave = self.master.slave
        self.wire.send(book.group_2(slave, book.POLL_COMMAND), b"")
        get = bytes([self.master.own, book.GET, IDENTITY, 1, 1])
        self.wire.send(book.group_2(slave, book.REQUEST), get)
        allocate = bytes([self.master.own, book.ALLOCATE, 3, 1, 1, self.master.own])
        self.wire.send(book.group_2(slave, book.UNCONNECTED_REQUEST), allocate)
        self.claim(is_response=False)
        deadline = time.time() + 2.5
        while (left := deadline - time.time()) > 0:
            self.wire.receive(left)
        heard = [str(frame) for frame in self.wire.seen[begin:] if not frame.is_ours]
        expect("frames after the fault, in 2.5 s", heard, [])
        return "no answer to poll, Get, Allocate, claim; no production; for 2.5 s"

    def gives_up_when_its_mac_id_is_taken(self, is_response: bool) -> str:
        self.claim(is_response)
        time.sleep(0.05)
        seen = self.expect_silence()
        own = [frame for frame in self.wire.seen if not frame.is_ours]
        if len(own) > 1:
            raise Wrong(f"a second request although the MAC ID is taken: {own[1]}")
        return seen

    # --- Chapter 8: alarm

    def alarms_on_a_position_error(self) -> str:
        """Begins at rest; COS of a whole range, so only the flags make it produce."""
        with self.connections(book.POLL | book.CHANGE_OF_STATE | book.UNACKNOWLEDGED):
            for connection in (POLL_CONNECTION, COS_CONNECTION):
                path = bytes.fromhex("20042402")
                self.master.set(CONNECTION, connection, PRODUCED_PATH, path)
            self.put(COS_DELTA, DEFAULT_TOTAL)
            self.set_packet_rate(POLL_CONNECTION, 60_000)
            self.set_packet_rate(COS_CONNECTION, 0)
            expect("poll at rest", self.master.poll().data, bytes(5))
            expect("alarm signals and flag", (self.encoder(83), self.encoder(85)), (0, 0))
            self.master.forget()
            rising = self.master.next_production(9.0)
            expect("flags", rising.data[4], 0b01)
            expect("alarm signals and flag", (self.encoder(83), self.encoder(85)), (1, 1))
            expect("warnings and flag", (self.encoder(86), self.encoder(88)), (0, 0))
            expect("flags polled", self.master.poll().data[4], 0b01)
            expect("flags of assembly 2", self.master.get(ASSEMBLY, 2, 3)[4], 0b01)
            falling = self.master.next_production(9.0)
            wanted = udint(RUSH_TURNS * STEPS) + b"\x00"
            expect("position and flags afterwards", falling.data, wanted)
            lasted = falling.at - rising.at
            expect_within("seconds of the alarm", lasted, RUSH_SECONDS + 2.2, RUSH_SECONDS + 2.8)
            expect("alarm signals and flag", (self.encoder(83), self.encoder(85)), (0, 0))
            expect("poll", self.master.poll().data, wanted)
        speed = 60 * RUSH_TURNS / RUSH_SECONDS
        return f"{speed:.0f} rpm for {RUSH_SECONDS:g} s: alarm for {lasted:.2f} s"

    def encoder(self, attribute: int) -> int:
        """An attribute of the encoder position object, of any length."""
        return int.from_bytes(self.master.get(ENCODER, 1, attribute), "little")

    # --- Singleturn, another address and baud rate

    def is_a_singleturn_at_address_63_and_500_kbit(self) -> str:
        self.expect_switches(63, 2)
        expect("product code", self.master.get(IDENTITY, 1, 3), uint(0x0B))
        for attribute, wanted in [(81, STEPS), (82, 0), (87, 0), (95, 1), (TOTAL, STEPS)]:
            expect(f"attribute {attribute}", self.encoder(attribute), wanted)
        self.put(STEPS_PER_TURN, 1000)
        expect("total", self.number(TOTAL), 1000)
        self.put(TOTAL, 1000)
        for value in (999, 1001, 8192):
            expect_refusal(partial(self.put, TOTAL, value), 0x09)
        expect("position", self.number(POSITION), STILL_AT % STEPS * 1000 // STEPS)
        return "product code 0B, type 1, no revolutions; the total is the steps"

    def objects_at_address_63(self) -> str:
        objection = self.master.ask_duplicate_mac(vendor=1, serial=1)
        expect("objection", objection, book.DuplicateMacCheck(True, 0, VENDOR, SERIAL))
        return "on 5FF"


class Chapters(OperatingModes, DeviceObjects, Network):
    """All chapters, in eight runs of the program."""

    def begin(self, shaft: str, address: int = ADDRESS, baud: str | None = None) -> None:
        """Starts a run and waits until the encoder is on line."""
        start = partial(self.start, shaft, address, baud)
        self.step(f"starts {self._program.model} with the shaft '{shaft}'", start, vital=True)
        self.named(self.checks_its_mac_id_at_the_start)

    def end(self) -> None:
        """Ends a run."""
        self.step("leaves on SIGTERM", self.stop, vital=True)

    @staticmethod
    def chapter(number: str) -> None:
        """A line between the steps."""
        print(f"--- {number}", flush=True)

    def turning_run(self) -> None:
        """Chapter 3 on a turning shaft."""
        self.chapter("3 Operating modes, shaft turning at 60 rpm")
        self.begin("turn rpm=60")
        self.named(self.refuses_choices_in_the_order_of_the_book)
        self.named(self.refuses_what_is_already_allocated)
        self.named(self.forgets_a_master_that_established_nothing)
        self.named(self.answers_a_poll_before_the_rate_is_set_never)
        self.named(self.produces_every_delta_on_a_turning_shaft)
        self.named(self.produces_every_delta_the_other_way_on_a_turning_shaft)
        self.named(self.knows_deltas_of_a_whole_range_on_a_turning_shaft)
        self.named(self.keeps_the_inhibit_time_on_a_turning_shaft)
        self.named(self.beats_whatever_the_delta_on_a_turning_shaft)
        self.named(self.goes_on_when_acknowledged_on_a_turning_shaft)
        self.named(self.repeats_with_the_newest_position_on_a_turning_shaft)
        self.named(self.repeats_in_spite_of_the_inhibit_time_on_a_turning_shaft)
        self.named(self.polls_and_produces_at_the_same_time_on_a_turning_shaft)
        self.end()

    def resting_run(self) -> None:
        """Chapter 3 on a shaft at rest."""
        self.chapter("3 Operating modes, shaft at rest")
        self.begin(f"still angle={STILL_AT}")
        self.named(self.produces_only_by_the_packet_rate_at_rest)
        self.named(self.restarts_the_packet_rate_with_each_production)
        self.named(self.produces_after_a_real_change_of_settings)
        self.named(self.produces_nothing_where_nothing_changes)
        self.named(self.never_times_out_without_acknowledge)
        self.named(self.beats_in_the_time_set)
        self.named(self.takes_1_to_65535_ms)
        self.named(self.repeats_once_after_16_ms_without_acknowledge)
        self.named(self.takes_an_empty_frame_for_acknowledge_and_no_other)
        self.named(self.obeys_the_acknowledge_handler)
        self.named(self.beats_with_acknowledge)
        self.named(self.times_out_without_acknowledge)
        self.named(self.gives_ten_seconds_for_the_first_acknowledge)
        self.named(self.gives_four_packet_rates_where_they_are_longer_for_the_first_acknowledge)
        self.named(self.outlives_the_explicit_connection)
        self.named(self.is_free_when_the_last_connection_timed_out)
        self.end()

    def objects_run(self) -> None:
        """Chapters 4 to 9 on a shaft at rest."""
        self.chapter("4 Operating parameters")
        self.begin(f"still angle={STILL_AT}")
        self.connected(self.has_the_defaults_of_chapter_4)
        self.connected(self.takes_each_limit_and_refuses_the_next_value)
        self.connected(self.limits_depend_on_what_is_in_force)
        self.chapter("5 Object model")
        self.connected(self.has_the_classes_and_instances_of_chapter_5)
        self.named(self.has_one_explicit_and_two_io_connections)
        self.connected(self.has_no_connection_that_is_not_allocated)
        self.named(self.refuses_what_a_connection_does_not_take)
        self.connected(self.tells_the_four_kinds_of_connection_4)
        self.connected(self.tells_its_identity_at_once)
        self.chapter("6 I/O assemblies")
        self.connected(self.has_two_assemblies)
        self.named(self.chooses_the_assembly_by_path)
        self.chapter("7 Parameter object")
        self.connected(self.has_19_parameters)
        self.connected(self.names_its_parameters)
        self.connected(self.speaks_english)
        self.connected(self.tells_live_limits)
        self.connected(self.sets_through_parameters)
        self.connected(self.saves_restores_and_resets_parameters_at_class_level)
        self.connected(self.names_the_values_of_enumerations)
        self.connected(self.tells_a_parameter_at_once)
        self.chapter("8 Encoder position object")
        self.connected(self.has_the_attributes_of_chapter_8)
        self.connected(self.refuses_services_that_chapter_8_does_not_name)
        self.connected(self.presets)
        self.connected(self.saves_restores_and_resets)
        self.chapter("9 Switches, lamp, network")
        self.connected(self.tells_its_switches)
        self.connected(self.keeps_boi_and_counts_bus_offs)
        self.named(self.shows_the_states_of_the_lamp_in_its_connections)
        self.connected(self.changes_the_consistency_value_with_what_is_kept)
        self.named(self.defends_its_mac_id_and_stays)
        self.connected(self.refuses_other_resets)
        self.connected(self.saves_one_setting_and_leaves_another_unsaved)
        self.named(self.beats_its_heart_every_second)
        self.end()

    def second_objects_run(self) -> None:
        """What is left after power-off; ends in a fault that only power-off ends."""
        self.chapter("6, 8, 9 After power-off")
        self.begin(f"still angle={STILL_AT}")
        self.named(self.beats_its_heart_again_after_power_off)
        self.named(self.has_kept_the_assemblies_without_save)
        self.connected(self.has_after_power_off_what_was_saved)
        self.named(self.returns_to_the_defaults_by_identity_reset_1)
        self.named(self.falls_silent_at_a_response_with_its_mac_id)
        self.end()

    def taken_runs(self) -> None:
        """The MAC ID belongs to somebody else."""
        self.chapter("9.2 MAC ID taken")
        for is_response in (False, True):
            shaft = "still"
            self.step(f"starts with the shaft '{shaft}'", partial(self.start, shaft), vital=True)
            what = "response" if is_response else "request"
            self.step(
                f"gives up at a {what} with its MAC ID during the check",
                partial(self.gives_up_when_its_mac_id_is_taken, is_response),
            )
            self.end()

    def rushing_run(self) -> None:
        """The alarm of chapter 8."""
        self.chapter("8 Alarm")
        self.begin(RUSHING_SHAFT)
        self.named(self.alarms_on_a_position_error)
        self.end()

    def singleturn_run(self) -> None:
        """A singleturn at the other end of the switches."""
        self.chapter("4, 8, 9 Singleturn, address 63, 500 kbit/s")
        self.begin(f"still angle={STILL_AT % STEPS}", address=63, baud="500k")
        self.named(self.objects_at_address_63)
        self.connected(self.is_a_singleturn_at_address_63_and_500_kbit)
        self.end()


def walk(
    path: Path, directory: Path, messages: TextIO, log: TextIO, parts: list[str]
) -> tuple[int, int]:
    """The runs of `parts`; passed and failed steps."""
    multiturn = Program(path, "amg81-d29", directory / "memory", messages)
    chapters = Chapters(multiturn, log)
    singleturn = Program(path, "amg81-d13", directory / "singleturn-memory", messages)
    other = Chapters(singleturn, log)
    runs: list[tuple[str, Chapters, Callable[[], None]]] = [
        ("turning", chapters, chapters.turning_run),
        ("resting", chapters, chapters.resting_run),
        ("objects", chapters, chapters.objects_run),
        ("objects", chapters, chapters.second_objects_run),
        ("taken", chapters, chapters.taken_runs),
        ("rushing", chapters, chapters.rushing_run),
        ("singleturn", other, other.singleturn_run),
    ]
    for part, walker, run in runs:
        if part not in parts:
            continue
        try:
            run()
        except Ended:
            # The failed step was counted; the other runs do not need this one.
            pass
        finally:
            walker.leave_bus()
            walker._program.end()
    return chapters.passed + other.passed, chapters.failed + other.failed


def main() -> int:
    """Walks; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", nargs="+", choices=PARTS, default=PARTS, help="some of it only")
    arguments = arguments_of(parser, "codewheel-devicenet-chapters.log", "candump -L lines")
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        messages_path = Path(directory) / "messages"
        with messages_path.open("w") as messages:
            path = arguments.program.resolve()
            passed, failed = walk(path, Path(directory), messages, log, arguments.part)
        if failed:
            tail = messages_path.read_text(errors="replace").splitlines()[-15:]
            print("the program's last messages:", *(tail or ["(none)"]), sep="\n  ")
    print(f"the frames are in {arguments.log}; {time.monotonic() - begin:.0f} s")
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
