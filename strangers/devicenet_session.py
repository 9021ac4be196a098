"""The acceptance session: a stranger puts a DeviceNet encoder through its paces.

Usage: devicenet_session.py [PROGRAM] [--log FILE]

    python3 -m venv venv && venv/bin/pip install -r strangers/requirements.txt
    cargo build && venv/bin/python strangers/devicenet_session.py

Starts PROGRAM (default: target/release/codewheel, else target/debug/codewheel) as an AMG 11 D29
behind an SLCAN adapter on TCP, and plays the master with python-can. What is expected comes from
the manual and the book alone; positions are computed here. Each step prints one line, `ok` or
`FAILED`, with what was seen. All frames go to FILE as candump -L lines.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import devicenet_master as book
from steps import Wrong, arguments_of, expect, expect_within, position_at
from walkthrough import (
    ADDRESS,
    CONFIGURING,
    CONNECTION,
    COS_DELTA,
    DEFAULT_TOTAL,
    DEVICENET,
    DIRECTION,
    ENCODER,
    ESTABLISHED,
    EXPLICIT_CONNECTION,
    IDENTITY,
    OFFSET,
    OUR_MAC,
    POLL_CONNECTION,
    POSITION,
    PRESET,
    PRODUCED_PATH,
    PRODUCED_SIZE,
    SERIAL,
    STEPS,
    STEPS_PER_TURN,
    TIMED_OUT,
    TOTAL,
    TURNS,
    VENDOR,
    Program,
    Walk,
    expect_refusal,
    udint,
    unsigned,
)

STILL_AT = 100_000


class Session(Walk):
    """The steps. Those of one run build on each other, in the order of `run`."""

    # What the first run saves, and the position of the second one under it.
    offset = 0
    kept_position = 0

    # --- Allocation

    def refuses_other_services_unconnected(self) -> str:
        ask = bytes([book.GET, IDENTITY, 1, 1])
        return expect_refusal(lambda: self.master.unconnected(ask), 0x02, 0x03)

    def refuses_wrong_choices(self) -> str:
        seen = [
            expect_refusal(lambda: self.master.allocate(0x00), 0x09, 0x02),
            expect_refusal(lambda: self.master.allocate(0x05), 0x02, 0x02),
            expect_refusal(lambda: self.master.allocate(book.POLL), 0x09, 0x02),
        ]
        return f"nothing {seen[0]}, bit-strobe {seen[1]}, poll alone {seen[2]}"

    def allocates_explicit_and_poll(self) -> str:
        self.master.allocate(book.EXPLICIT | book.POLL)
        owner = self.master.get(DEVICENET, 1, 5)
        expect("allocation information", owner, bytes([book.EXPLICIT | book.POLL, OUR_MAC]))
        return f"CB 00, allocated {owner.hex(' ')}"

    def keeps_another_master_out(self) -> str:
        other = self.stranger
        seen = expect_refusal(lambda: other.allocate(book.EXPLICIT | book.POLL), 0x0C, 0x01)
        expect_refusal(lambda: other.release(book.EXPLICIT), 0x0C, 0x01)
        other.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]))
        return f"Allocate and Release {seen}, Get without an answer"

    def refuses_a_second_allocation(self) -> str:
        return expect_refusal(lambda: self.master.allocate(book.POLL), 0x0B, 0x02)

    # --- Explicit messages

    def tells_its_identity(self) -> str:
        def get(attribute: int) -> bytes:
            return self.master.get(IDENTITY, 1, attribute)

        expect("vendor", unsigned(get(1), 2), VENDOR)
        expect("device type", unsigned(get(2), 2), 0)
        expect("product code", unsigned(get(3), 2), 0x0A)
        expect("revision", get(4), b"\x01\x01")
        expect("status, owned and not configured", unsigned(get(5), 2), 0x0001)
        expect("serial number", unsigned(get(6), 4), SERIAL)
        name = b"AMG 11 - Multiturn"
        expect("product name", get(7), bytes([len(name)]) + name)
        return f"product code 0A, serial {SERIAL}, {name.decode()}"

    def repeats_a_fragment_that_is_not_acknowledged(self) -> str:
        name = self.master.get_without_first_acknowledge(IDENTITY, 1, 7)
        expect("product name", name[1:], b"AMG 11 - Multiturn")
        return "first fragment again after 1 s"

    def echoes_the_transaction_bit(self) -> str:
        self.master.xid = True
        try:
            return f"serial {unsigned(self.master.get(IDENTITY, 1, 6), 4)} under XID 1"
        finally:
            self.master.xid = False

    def takes_a_repeated_fragment_once(self) -> str:
        body = bytes([book.SET, ENCODER, 1, COS_DELTA]) + udint(5)
        expect("response", self.master.explicit(body, repeat_fragments=True), b"\x90")
        expect("COS delta", self.number(COS_DELTA), 5)
        self.put(COS_DELTA, 1)
        return "acknowledged twice, appended once"

    def refuses_what_does_not_exist(self) -> str:
        master = self.master
        one = (1).to_bytes(2, "little")
        seen = [
            expect_refusal(lambda: master.get(IDENTITY, 1, 99), 0x14),
            expect_refusal(lambda: master.get(ENCODER, 1, 90), 0x14),
            expect_refusal(lambda: master.get(0x77, 1, 1), 0x16),
            expect_refusal(lambda: master.get(ENCODER, 2, 1), 0x16),
            expect_refusal(lambda: master.service(0x32, ENCODER, 1), 0x08),
            expect_refusal(lambda: master.set(IDENTITY, 1, 1, one), 0x0E),
            expect_refusal(lambda: master.set(ENCODER, 1, POSITION, udint(1)), 0x0E),
        ]
        return ", ".join(seen)

    def has_the_defaults_of_the_manual(self) -> str:
        return self.expect_settings(0, STEPS, DEFAULT_TOTAL, 0, 0, 1)

    # --- Poll

    def does_not_answer_a_poll_before_the_packet_rate_is_set(self) -> str:
        state = self.connection_state(POLL_CONNECTION)
        expect("state of the poll connection", state, CONFIGURING)
        self.master.expect_no_poll_response()
        return "configuring, no poll response"

    def establishes_the_poll_connection(self) -> str:
        self.set_packet_rate(EXPLICIT_CONNECTION, 0)
        granted = self.set_packet_rate(POLL_CONNECTION, 60_000)
        state = self.connection_state(POLL_CONNECTION)
        expect("state of the poll connection", state, ESTABLISHED)
        return f"{granted}, established"

    def drops_a_poll_with_data(self) -> str:
        self.master.expect_no_poll_response(data=b"\x00")
        return "no response, since the connection consumes 0 octets"

    def follow(self, steps: int, total: int, sign: int) -> str:
        """Five polls of a shaft that turns once a second: the positions must keep step."""
        polls = []
        for _ in range(5):
            polls.append(self.polled())
            time.sleep(0.2)
        moved = []
        for (before, old), (after, new) in itertools.pairwise(polls):
            due = steps * (after - before)
            step = sign * (new - old) % total
            expect_within("steps between two polls", step, due * 0.85 - 80, due * 1.15 + 80)
            moved.append(sign * step)
        return f"{polls[0][1]}, then " + ", ".join(f"{step:+}" for step in moved)

    def follows_the_shaft(self) -> str:
        return self.follow(STEPS, DEFAULT_TOTAL, +1)

    # --- Settings

    def scales_to_3600_steps(self) -> str:
        self.put(STEPS_PER_TURN, 3600)
        expect("total after steps per turn", self.number(TOTAL), 3600 * TURNS)
        self.put(TOTAL, 921_600)
        self.expect_settings(0, 3600, 921_600, 0, 0, 1)
        moved = self.follow(3600, 921_600, +1)
        return f"3600 steps per turn, total 235929600, then 921600; {moved}"

    def turns_the_other_way(self) -> str:
        expect("data in the response", self.master.set(ENCODER, 1, DIRECTION, b"\x01"), b"")
        expect("operating status", self.master.get(ENCODER, 1, 80), b"\x07")
        seen = self.follow(3600, 921_600, -1)
        self.master.set(ENCODER, 1, DIRECTION, b"\x00")
        expect("operating status", self.master.get(ENCODER, 1, 80), b"\x06")
        return seen

    def presets_the_moving_shaft(self) -> str:
        before = time.time()
        self.put(PRESET, 1000)
        at, position = self.polled()
        # The position was 1000 at some moment after `before`.
        most = 3600 * (at - before) * 1.15 + 80
        expect_within("steps since the preset", position - 1000, 0, most)
        expect("preset read back", self.number(PRESET), 1000)
        self.offset = self.number(OFFSET)
        if self.offset == 0:
            raise Wrong("the offset is 0, though the preset moved the position")
        return f"position {position} {1000 * (at - before):.1f} ms later, offset {self.offset}"

    def refuses_values_out_of_range(self) -> str:
        before = self.settings()
        for attribute, value in [
            (STEPS_PER_TURN, 0),
            (STEPS_PER_TURN, STEPS + 1),
            (TOTAL, 0),
            (TOTAL, 3600 * TURNS + 1),
            (PRESET, 921_600),
            (COS_DELTA, 0),
            (COS_DELTA, 921_601),
        ]:
            try:
                expect_refusal(partial(self.put, attribute, value), 0x09)
            except Wrong as wrong:
                raise Wrong(f"attribute {attribute} set to {value}: {wrong}") from None
        expect_refusal(lambda: self.master.set(ENCODER, 1, TOTAL, b"\x01\x00"), 0x13)
        expect_refusal(lambda: self.master.set(ENCODER, 1, TOTAL, bytes(5)), 0x15)
        expect("settings after the refusals", self.settings(), before)
        return "7 values 09, too short 13, too long 15, nothing changed"

    def writing_the_same_again_changes_nothing(self) -> str:
        self.put(STEPS_PER_TURN, 3600)
        self.master.set(ENCODER, 1, DIRECTION, b"\x00")
        return self.expect_settings(0, 3600, 921_600, 1000, self.offset, 1)

    def saves(self) -> str:
        answer = self.master.explicit(bytes([book.SAVE, ENCODER, 1]))
        expect("response to Save", answer, b"\x96")
        return "96"

    def changes_something_without_saving(self) -> str:
        self.put(COS_DELTA, 77)
        expect("COS delta", self.number(COS_DELTA), 77)
        return "COS delta 77 in force"

    def releases(self) -> str:
        self.master.release(book.POLL)
        self.master.expect_no_poll_response()
        self.master.release(book.EXPLICIT)
        self.master.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]))
        return "CC twice, then neither poll nor Get is answered"

    # --- After power-off

    def has_kept_what_was_saved(self) -> str:
        return self.expect_settings(0, 3600, 921_600, 1000, self.offset, 1)

    def says_that_it_is_configured(self) -> str:
        status = unsigned(self.master.get(IDENTITY, 1, 5), 2)
        expect("identity status, owned and configured", status, 0x0005)
        return f"{status:04X}"

    def expect_position(self, wanted: int) -> str:
        """Poll and attribute 12 must both give it."""
        expect("polled position", self.polled()[1], wanted)
        expect("attribute 12", self.number(POSITION), wanted)
        return f"{wanted}, polled and read"

    def stands_where_the_formula_says(self) -> str:
        self.kept_position = position_at(STILL_AT, 3600, 921_600, self.offset)
        return self.expect_position(self.kept_position)

    def restores(self) -> str:
        self.put(COS_DELTA, 77)
        answer = self.master.explicit(bytes([book.RESTORE, ENCODER, 1]))
        expect("response to Restore", answer, b"\x95")
        self.has_kept_what_was_saved()
        self.expect_position(self.kept_position)
        return "95, COS delta 77 is 1 again, same position"

    def resets_to_the_defaults(self) -> str:
        answer = self.master.explicit(bytes([book.RESET, ENCODER, 1]))
        expect("response to Reset", answer, b"\x85")
        self.has_the_defaults_of_the_manual()
        return "85, " + self.expect_position(STILL_AT)

    def computes_positions_exactly(self) -> str:
        seen = []
        for steps, clockwise in [(1000, True), (1000, False), (3599, False), (1, True), (1, False)]:
            self.put(STEPS_PER_TURN, steps)
            self.master.set(ENCODER, 1, DIRECTION, bytes([not clockwise]))
            total = self.number(TOTAL)
            expect("total of 65536 turns", total, steps * TURNS)
            wanted = position_at(STILL_AT, steps, total, clockwise=clockwise)
            self.expect_position(wanted)
            seen.append(f"{steps} {'CW' if clockwise else 'CCW'}: {wanted}")
        return ", ".join(seen)

    def presets_the_standing_shaft(self) -> str:
        self.put(PRESET, 42)
        total = self.number(TOTAL)
        plain = position_at(STILL_AT, 1, total, clockwise=False)
        expect("offset", self.number(OFFSET), 42 - plain)
        return self.expect_position(42) + f", offset {42 - plain}"

    def restores_the_saved_offset(self) -> str:
        self.master.explicit(bytes([book.RESTORE, ENCODER, 1]))
        self.has_kept_what_was_saved()
        return self.expect_position(self.kept_position)

    # --- The watchdog

    def reallocate_poll(self, assembly: int) -> None:
        """Allocates the poll connection anew and chooses what it produces."""
        self.master.allocate(book.POLL)
        expect("state when allocated anew", self.connection_state(POLL_CONNECTION), CONFIGURING)
        path = bytes([0x20, 0x04, 0x24, assembly])
        self.master.set(CONNECTION, POLL_CONNECTION, PRODUCED_PATH, path)

    def times_out_after_four_packet_rates(self) -> str:
        self.master.release(book.POLL)
        self.reallocate_poll(1)
        self.set_packet_rate(POLL_CONNECTION, 100)
        time.sleep(1.5)
        state = self.connection_state(POLL_CONNECTION)
        expect("state 1.5 s after it was established, none polled", state, ESTABLISHED)
        self.polled()
        time.sleep(0.25)
        self.polled()
        time.sleep(0.8)
        state = self.connection_state(POLL_CONNECTION)
        expect("state 0.8 s after the last poll", state, TIMED_OUT)
        self.master.expect_no_poll_response()
        return "established after 1.5 s without a poll, timed out 0.8 s after the last one"

    def gives_ten_seconds_for_the_first_poll(self) -> str:
        self.reallocate_poll(1)
        self.set_packet_rate(POLL_CONNECTION, 100)
        time.sleep(9.0)
        state = self.connection_state(POLL_CONNECTION)
        expect("state after 9 s without a first poll", state, ESTABLISHED)
        time.sleep(1.8)
        state = self.connection_state(POLL_CONNECTION)
        expect("state after 10.8 s without a first poll", state, TIMED_OUT)
        return "established after 9 s, timed out after 10.8 s"

    def produces_the_flags_with_assembly_2(self) -> str:
        self.reallocate_poll(2)
        self.set_packet_rate(POLL_CONNECTION, 60_000)
        size = unsigned(self.master.get(CONNECTION, POLL_CONNECTION, PRODUCED_SIZE), 2)
        expect("produced size", size, 5)
        data = self.master.poll().data
        expect("poll response", data, udint(self.kept_position) + b"\x00")
        path = bytes.fromhex("20042401")
        expect_refusal(
            lambda: self.master.set(CONNECTION, POLL_CONNECTION, PRODUCED_PATH, path), 0x0C
        )
        return f"{data.hex(' ')}; another path while established 0C"

    def checks_its_mac_id_anew_after_an_identity_reset(self) -> str:
        # Assembly 1 again, which is kept at once.
        self.master.release(book.POLL)
        self.reallocate_poll(1)
        answer = self.master.explicit(bytes([book.RESET, IDENTITY, 1]))
        expect("response to Reset", answer, b"\x85")
        expected = book.DuplicateMacCheck(False, 0, VENDOR, SERIAL)
        first, check = self.master.hear_duplicate_mac(2.0)
        expect("first request", check, expected)
        second, check = self.master.hear_duplicate_mac(2.0)
        expect("second request", check, expected)
        apart = second.at - first.at
        expect_within("seconds between the two requests", apart, 0.9, 1.3)
        self.answers_nothing_before_it_is_on_line()
        time.sleep(1.2)
        return f"two requests {apart:.2f} s apart from vendor {VENDOR}, serial {SERIAL}"

    def has_no_connection_after_the_reset(self) -> str:
        self.master.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]))
        return self.connect()

    def has_sent_nothing_but_its_own_identifiers(self) -> str:
        own = {
            book.poll_response_identifier(ADDRESS),
            book.group_2(ADDRESS, book.RESPONSE),
            book.group_2(ADDRESS, book.DUPLICATE_MAC),
        }
        foreign = sorted(f"{identifier:03X}" for identifier in self.heard - own)
        expect("other identifiers on the bus", foreign, [])
        return ", ".join(f"{identifier:03X}" for identifier in sorted(self.heard))

    # --- The three runs

    def first_run(self) -> None:
        """A fresh encoder on a turning shaft."""
        self.get_on_line("turn rpm=60 angle=0")
        self.named(self.objects_to_a_second_claim)
        self.named(self.refuses_other_services_unconnected)
        self.named(self.refuses_wrong_choices)
        self.named(self.allocates_explicit_and_poll, vital=True)
        self.named(self.keeps_another_master_out)
        self.named(self.refuses_a_second_allocation)
        self.named(self.does_not_answer_a_poll_before_the_packet_rate_is_set)
        self.named(self.establishes_the_poll_connection, vital=True)
        self.named(self.tells_its_identity)
        self.named(self.repeats_a_fragment_that_is_not_acknowledged)
        self.named(self.echoes_the_transaction_bit)
        self.named(self.takes_a_repeated_fragment_once)
        self.named(self.refuses_what_does_not_exist)
        self.named(self.has_the_defaults_of_the_manual)
        self.named(self.drops_a_poll_with_data)
        self.named(self.follows_the_shaft)
        self.named(self.scales_to_3600_steps)
        self.named(self.turns_the_other_way)
        self.named(self.presets_the_moving_shaft)
        self.named(self.refuses_values_out_of_range)
        self.named(self.writing_the_same_again_changes_nothing)
        self.named(self.saves)
        self.named(self.changes_something_without_saving)
        self.named(self.releases)
        self.step("leaves on SIGTERM", self.stop, vital=True)

    def second_run(self) -> None:
        """The same encoder after power-off, on a shaft that stands still."""
        self.get_on_line(f"still angle={STILL_AT}")
        self.step("is allocated again", self.connect, vital=True)
        self.named(self.has_kept_what_was_saved)
        self.named(self.says_that_it_is_configured)
        self.named(self.stands_where_the_formula_says)
        self.named(self.restores)
        self.named(self.resets_to_the_defaults)
        self.named(self.computes_positions_exactly)
        self.named(self.presets_the_standing_shaft)
        self.named(self.restores_the_saved_offset)
        self.named(self.times_out_after_four_packet_rates)
        self.named(self.gives_ten_seconds_for_the_first_poll)
        self.named(self.produces_the_flags_with_assembly_2)
        self.named(self.checks_its_mac_id_anew_after_an_identity_reset)
        self.named(self.has_no_connection_after_the_reset)
        self.named(self.stands_where_the_formula_says)
        self.step("leaves on SIGTERM", self.stop, vital=True)

    def third_run(self) -> None:
        """Once more: power-off must not move the position by a step."""
        self.get_on_line(f"still angle={STILL_AT}")
        self.step("is allocated again", self.connect, vital=True)
        self.step(
            "stands where it stood before power-off",
            lambda: self.expect_position(self.kept_position),
        )
        self.named(self.has_kept_what_was_saved)
        self.named(self.releases)
        self.step("leaves on SIGTERM", self.stop)
        self.named(self.has_sent_nothing_but_its_own_identifiers)

    def run(self) -> None:
        """All three."""
        self.first_run()
        self.second_run()
        self.third_run()


def main() -> int:
    """Runs the session; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments = arguments_of(parser, "codewheel-devicenet-session.log", "candump -L lines")
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        messages_path = Path(directory) / "messages"
        with messages_path.open("w") as messages:
            memory = Path(directory) / "memory"
            program = Program(arguments.program.resolve(), "amg11-d29", memory, messages)
            session = Session(program, log)
            try:
                session.run()
            finally:
                session.leave_bus()
                program.end()
                if session.failed:
                    tail = messages_path.read_text(errors="replace").splitlines()[-15:]
                    print("the program's last messages:", *(tail or ["(none)"]), sep="\n  ")
                print(f"the frames are in {arguments.log}")
                print(f"{session.passed} passed, {session.failed} failed")
    return 1 if session.failed else 0


if __name__ == "__main__":
    sys.exit(main())
