"""The commissioning verbs against DeviceNet slaves that are not ours.

Usage: commission_devicenet.py [PROGRAM] [--log FILE]

Runs PROGRAM (default: target/release/codewheel, else target/debug/codewheel) with its verbs, as
people and scripts do, on a segment that is played here: an encoder by its manual, valve terminals
of another maker, slaves of another master, slaves that refuse, die or never answer. Each step
prints one line, `ok` or `FAILED`. All frames go to FILE as candump -L lines, with each run of the
program.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import devicenet_master as book
from commission_devicenet_objects import VALVES, Encoder, valve_terminal
from commission_devicenet_owner import Owner
from commission_devicenet_slave import CONNECTION, Asked, Slave
from commission_segment import CanSegment, Visit
from commission_walk import (
    BUS,
    DIFFERS,
    OK,
    REFUSED,
    TIME_OUT,
    USAGE,
    Object,
    Outcome,
    Walk,
    expect_keys,
    soon,
)
from devicenet_master import Frame
from steps import Wrong, arguments_of, expect, expect_within

# Addresses on the segment.
ENCODER_MAC, VALVES_MAC, STUB_MAC, OWNED_MAC, OWNER_MAC, NOBODY = 5, 9, 11, 20, 0, 33
OUR_MAC = 62
RAW = 100_000
# Nothing is sent in the first second.
LISTENING = 1.0
# Listening, the check of the own MAC ID and what a verb says take so long at most.
VERB_SECONDS = 12.0
# General status codes with a word of what the CIP books call them.
STATUSES = {
    0x02: "resource unavailable",
    0x05: "path",
    0x08: "service not supported",
    0x09: "invalid attribute value",
    0x0B: "already in",
    0x0C: "object state conflict",
    0x0E: "attribute not settable",
    0x0F: "privilege",
    0x10: "device state conflict",
    0x13: "not enough data",
    0x14: "attribute not supported",
    0x15: "too much data",
    0x16: "object does not exist",
    0x18: "no stored attribute data",
    0x19: "store",
    0x1F: "vendor",
    0x20: "invalid parameter",
}
VALUE_KEYS = "name place title value label unit writable setting range"


class Commission(Walk[Frame]):
    """Each verb on a segment with strangers."""

    @property
    def bus(self) -> list[str]:
        """The segment at its rate by default."""
        return ["--bus", f"slcan:127.0.0.1:{self.medium.port}"]

    @contextlib.contextmanager
    def segment(self, *slaves: Slave) -> Iterator[None]:
        """A segment with slaves that are on line."""
        medium = self._medium = CanSegment(self._log)
        try:
            for slave in slaves:
                medium.join(slave)
            soon(lambda: all(slave.is_on_line for slave in slaves), "slaves on line")
            yield
        finally:
            medium.close()

    # --- What many steps do

    def written(self, slave: Slave) -> list[Asked]:
        """Sets, but for those of connections."""
        return [asked for asked in slave.services(book.SET) if asked.class_id != CONNECTION]

    def expect_released(self, *slaves: Slave) -> None:
        """Each is nobody's again, by a release and not by its watchdog."""
        for slave in slaves:
            expect(f"owner of MAC ID {slave.mac} afterwards", slave.owner, 0xFF)
            expect(f"time-outs of MAC ID {slave.mac}", slave.timeouts, 0)

    def expect_undisturbed(self, polls: int) -> None:
        """The owner went on polling since, and each poll but the last was answered."""
        expect("trouble of the owner", self.owner.trouble, [])
        expect("every poll was answered", self.owner.is_served, True)
        if self.owner.polls - polls < 20:
            raise Wrong(f"the owner polled {self.owner.polls - polls} times only")

    def expect_listened_first(self, visit: Visit[Frame]) -> float:
        """The first frame left a second after the channel was opened, or later."""
        if visit.silence < LISTENING:
            raise Wrong(f"the first frame left after {visit.silence:.3f} s: {visit.sent[0]}")
        return visit.silence

    def asked_as(self, slave: Slave, *arguments: str, **options: float) -> tuple[Outcome, Visit]:
        """Runs a verb at a slave that counts anew; afterwards it is nobody's."""
        slave.forget()
        visit = self.visit()
        outcome = self.verb(*arguments, address=slave.mac, **options)
        self.expect_listened_first(visit)
        return outcome, visit

    # --- Scan

    def scans_after_a_second_of_silence(self) -> str:
        for slave in self.all:
            slave.forget()
        polls = self.owner.polls
        visit = self.visit()
        outcome = self.verb("scan", "--json").ended(OK)
        silence = self.expect_listened_first(visit)
        self.nodes = {each["address"]: each for each in outcome.objects if "address" in each}
        self.checks = [
            heard for heard in visit.sent if heard.message.identifier == book.group_2(OUR_MAC, 7)
        ]
        expect("first frame", visit.sent[0], self.checks[0])
        expect("frames of the check of its own MAC ID", len(self.checks), 2)
        between = self.checks[1].at - self.checks[0].at
        expect_within("seconds between them", between, 0.9, 1.6)
        others = [heard for heard in visit.sent if heard not in self.checks]
        if others:
            after = others[0].at - self.checks[1].at
            expect_within("seconds from the second to the next frame", after, 0.9, 3.0)
        self.expect_undisturbed(polls)
        took = f"{len(visit.sent)} frames, {outcome.seconds:.1f} s"
        return f"first frame after {silence:.2f} s, {took}"

    def finds_all_with_their_identity(self) -> str:
        missing = {slave.mac for slave in self.all} - set(self.nodes)
        expect("missing", missing, set())
        expect("nodes besides", set(self.nodes) - {slave.mac for slave in self.all} - {0}, set())
        for node in self.nodes.values():
            expect_keys("a node", node, "bus address role identity owner lamp state")
        encoder, valves = (self.nodes[mac]["identity"] for mac in (ENCODER_MAC, VALVES_MAC))
        keys = "models vendor device_type product_code product_name revision serial firmware"
        expect_keys("an identity", encoder, keys)
        expect("serial of the encoder", encoder["serial"], 4711)
        expect("amg11-d29 is one of its models", "amg11-d29" in encoder["models"], True)
        seen = {key: valves[key] for key in ("models", "vendor", "product_code", "product_name")}
        wanted = {
            "models": [],
            "vendor": 777,
            "product_code": 0x1234,
            "product_name": "Valve Terminal 8",
        }
        expect("valve terminal", seen, wanted)
        expect("its serial", valves["serial"], 0xC0FFEE42)
        expect("its revision", valves["revision"], "2.7")
        return ", ".join(f"{mac}: {node['role']}" for mac, node in sorted(self.nodes.items()))

    def leaves_the_slave_of_another_alone(self) -> str:
        expect("owner, who only polls", self.nodes[OWNED_MAC]["owner"], "unknown")
        expect("allocations", self.owned.allocations, [])
        expect("allocations tried", self.owned.refused_allocations, [])
        expect("explicit requests", [f"{asked}" for asked in self.owned.asked], [])
        expect("owner still", self.owned.owner, OWNER_MAC)
        return f"{self.nodes[OWNED_MAC]['state']}"

    def names_an_owner_who_says_his_name(self) -> str:
        self.owner.asks = True
        outcome = self.verb("scan", "--json").ended(OK)
        self.owner.asks = False
        nodes = {each["address"]: each for each in outcome.objects if "address" in each}
        expect("owner", nodes[OWNED_MAC]["owner"], OWNER_MAC)
        expect("role of the owner", nodes.get(OWNER_MAC, {}).get("role"), "master")
        expect("requests of others", {each.master for each in self.owned.asked}, {OWNER_MAC})
        return f"{nodes[OWNER_MAC]['state']}"

    def releases_whom_it_asked_and_writes_nothing(self) -> str:
        free = [slave for slave in self.all if slave is not self.owned]
        self.expect_released(*free)
        for slave in free:
            expect(f"writes to {slave.mac}", [f"{each}" for each in self.written(slave)], [])
            masters = {master for master, _ in slave.allocations}
            expect(f"masters of {slave.mac}", masters, {OUR_MAC})
        return ", ".join(f"{slave.mac}: {len(slave.asked)} requests" for slave in free)

    def shows_a_table_to_people(self) -> str:
        outcome = self.verb("scan").ended(OK)
        for word in ("Valve Terminal 8", "4711", "amg11-d29"):
            if word not in outcome.out:
                raise Wrong(f"{outcome}: expected '{word}' in the table")
        return f"{len(outcome.out.splitlines())} lines"

    # --- Devices that nobody knows

    def identifies_what_it_does_not_know(self) -> str:
        outcome, _ = self.asked_as(self.valves, "identify", "--json")
        told = outcome.ended(OK).object
        expect("vendor", told["vendor"], 777)
        expect("models", told["models"], [])
        self.expect_released(self.valves)
        return f"{told['product_name']}, serial {told['serial']:X}"

    def reads_the_parameter_object(self) -> str:
        outcome, _ = self.asked_as(self.valves, "get", "--json")
        values = {each["name"]: each for each in outcome.ended(OK).objects}
        for value in values.values():
            expect_keys("a value", value, VALUE_KEYS)
        self.expect_released(self.valves)

        def parameter(number: int) -> Object:
            name = f"parameter/{number}"
            if name not in values:
                raise Wrong(f"no {name} in {sorted(values)}")
            return values[name]

        wanted: dict[int, dict[str, object]] = {
            1: {"title": "Fault action", "value": 1, "label": "Close", "range": [0, 2]},
            2: {"title": "Switch delay", "value": 250, "unit": "ms", "range": [0, 5000]},
            4: {"title": "Trim", "value": -12, "unit": "%", "range": [-100, 100]},
            5: {"title": "Options", "value": 5},
            6: {"title": "Cycles", "value": 4_000_000_000, "writable": False},
            7: {"title": "Position", "value": -2_000_000_000},
            8: {"title": "Tag", "value": "press 3"},
            10: {"title": "Old style", "value": 42},
        }
        for number, fields in wanted.items():
            seen = {key: parameter(number)[key] for key in fields}
            expect(f"parameter {number}", seen, fields)
        expect("parameter 3 is read only", parameter(3)["writable"], False)
        expect("parameter 2 can be written", parameter(2)["writable"], True)
        return f"{len(values)} values"

    def scales_what_is_scaled(self) -> str:
        """(value + offset) x multiplier x base / divisor: 237 raw are 23.7 V."""
        outcome, _ = self.asked_as(self.valves, "get", "parameter/3")
        expect("supply, for people", outcome.ended(OK).value.split()[0] in ("237", "23.7"), True)
        return outcome.value

    def reads_a_real(self) -> str:
        outcome, _ = self.asked_as(self.valves, "get", "parameter/9", "--json")
        return f"{outcome.ended(OK).object['value']}"

    def reads_any_attribute_in_fragments(self) -> str:
        outcome, _ = self.asked_as(self.valves, "get", "64/1/64")
        octets = outcome.ended(OK).value.replace(":", " ")
        expect("octets", bytes.fromhex(octets), bytes(range(40)))
        self.valves.temper.lost_fragments = {3}
        outcome, _ = self.asked_as(self.valves, "get", "64/1/64")
        octets = outcome.ended(OK).within(VERB_SECONDS).value.replace(":", " ")
        expect("octets after a lost fragment", bytes.fromhex(octets), bytes(range(40)))
        return f"40 octets; with a lost fragment after {outcome.seconds:.1f} s"

    def reads_stubs(self) -> str:
        outcome, _ = self.asked_as(self.stub, "get", "--json")
        values = {each["name"]: each for each in outcome.ended(OK).objects}
        expect("parameter 2", values.get("parameter/2", {}).get("value"), 250)
        expect("parameter 4", values["parameter/4"]["value"], -12)
        return f"{len(values)} values"

    def gives_scripts_the_value_alone(self) -> str:
        outcome, _ = self.asked_as(self.valves, "get", "parameter/2")
        expect("stdout", outcome.ended(OK).out, "250\n")
        return "250"

    # --- Writing

    def writes_once_and_reads_back(self) -> str:
        outcome, _ = self.asked_as(self.valves, "set", "parameter/2", "300", "--yes", "--json")
        told = outcome.ended(OK).object
        writes = self.written(self.valves)
        expect("writes", [f"{each}" for each in writes], ["10 0F/2 01 2c 01"])
        after = [each for each in self.valves.asked if each.at > writes[0].at]
        if not any(each.service == book.GET and each.class_id == 0x0F for each in after):
            raise Wrong(f"nothing was read back: {[str(each) for each in after]}")
        self.expect_released(self.valves)
        self.undo(outcome)
        expect("value after undo", self.value_of(VALVES, 2), 250)
        return f"keys {' '.join(told)}; undone"

    def value_of(self, class_id: int, attribute: int) -> object:
        """What the valve terminal holds."""
        return self.valves.device.classes[class_id][1][attribute].value

    def writes_nothing_without_consent(self) -> str:
        self.valves.forget()
        visit = self.visit()
        outcome = self.verb("set", "parameter/2", "300", address=VALVES_MAC).ended(USAGE, "--yes")
        expect("frames", [str(heard) for heard in visit.sent], [])
        expect("value", self.value_of(VALVES, 2), 250)
        return outcome.err.strip()

    def tells_a_value_out_of_range(self) -> str:
        outcome, _ = self.asked_as(self.valves, "set", "parameter/2", "6000", "--yes")
        if outcome.status not in (REFUSED, USAGE):
            raise Wrong(f"{outcome}: expected exit status 4 (or 2 where the range is known)")
        expect("value", self.value_of(VALVES, 2), 250)
        self.expect_released(self.valves)
        return f"exit {outcome.status}: {outcome.err.strip()}"

    def refuses_to_write_what_is_read_only(self) -> str:
        outcome, _ = self.asked_as(self.valves, "set", "parameter/6", "1", "--yes")
        if outcome.status not in (REFUSED, USAGE):
            raise Wrong(f"{outcome}: expected exit status 2 or 4")
        self.expect_released(self.valves)
        return f"exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}"

    def notices_a_device_that_ignores_a_write(self) -> str:
        self.valves.temper.ignores_sets = True
        outcome, _ = self.asked_as(self.valves, "set", "64/1/1", "02:", "--yes")
        self.valves.temper.ignores_sets = False
        # Written through the parameter it is judged by the parameter.
        outcome.ended(DIFFERS)
        self.expect_released(self.valves)
        return outcome.err.strip().splitlines()[-1]

    def writes_in_fragments(self) -> str:
        octets = ":".join(f"{octet:02X}" for octet in range(60, 80))
        self.valves.temper.lost_acknowledges = {1}
        outcome, _ = self.asked_as(self.valves, "set", "64/1/65", octets, "--yes")
        outcome.ended(OK)
        expect("octets", self.value_of(VALVES, 101), bytes(range(60, 80)))
        expect("writes", len(self.written(self.valves)), 1)
        return f"20 octets, one acknowledge lost, {outcome.seconds:.1f} s"

    def writes_once_though_the_answer_is_lost(self) -> str:
        """Nobody can know whether it was done, so it must not be done again without a word."""
        self.valves.temper.swallows_sets = 1
        outcome, _ = self.asked_as(self.valves, "set", "parameter/2", "333", "--yes")
        self.valves.temper.swallows_sets = 0
        expect("writes", len(self.written(self.valves)), 1)
        if outcome.status not in (OK, TIME_OUT):
            raise Wrong(f"{outcome}: expected exit status 0 or 5")
        soon(lambda: self.valves.is_free, "its release", 1.0)
        self.verb("set", "parameter/2", "250", "--yes", address=VALVES_MAC).ended(OK)
        return f"exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}"

    def knows_no_position_of_a_stranger(self) -> str:
        seen = []
        for arguments in (["preset", "5", "--yes"], ["watch", "--for", "1s"]):
            outcome, _ = self.asked_as(self.valves, *arguments)
            expect("writes", [str(each) for each in self.written(self.valves)], [])
            if outcome.status not in (USAGE, REFUSED):
                raise Wrong(f"{outcome}: expected exit status 2 or 4")
            self.expect_released(self.valves)
            seen.append(f"exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}")
        return "; ".join(seen)

    def opens_the_adapter_at_the_rate_that_is_asked_for(self) -> str:
        seen = {}
        for baud, number in (("125k", "4"), ("250k", "5"), ("500k", "6")):
            visit = self.visit()
            self.verb("get", "--baud", baud, "--timeout", "300ms", address=NOBODY).ended(TIME_OUT)
            expect(f"number of {baud}", [guest.rate for guest in visit.guests], [number])
            seen[baud] = number
        return ", ".join(f"{baud}: S{number}" for baud, number in seen.items())

    def defends_its_own_address(self) -> str:
        newcomer = Slave(OUR_MAC, valve_terminal())
        arguments = ["watch", "--json", *self.bus, "--address", str(ENCODER_MAC)]
        with self.running(*arguments) as process:
            assert process.stdout is not None
            process.stdout.readline()
            self.medium.join(newcomer)
            soon(lambda: not newcomer.is_alive, "an objection", 1.5)
            process.stdout.readline()
            self.interrupt(process)
        self.medium.part(newcomer)
        expect("objections", [each.is_response for each in newcomer.checks], [True])
        self.expect_released(self.encoder)
        return "R/R = 1, and it goes on"

    def takes_up_what_a_killed_one_left(self) -> str:
        arguments = ["watch", "--json", *self.bus, "--address", str(ENCODER_MAC)]
        with self.running(*arguments) as process:
            assert process.stdout is not None
            process.stdout.readline()
            process.kill()
            process.wait()
        outcome, _ = self.asked_as(self.encoder, "get", "position")
        outcome.ended(OK)
        expect("position", outcome.value, f"{RAW}")
        soon(lambda: self.encoder.is_free, "its release", 1.0)
        return f"position {outcome.value} after {outcome.seconds:.1f} s"

    # --- Trouble

    def tells_each_general_status(self) -> str:
        statuses = sorted(STATUSES)
        slaves = []
        for number, status in enumerate(statuses):
            slave = Slave(number, valve_terminal())
            slave.temper.refuse = {book.GET: (status, 0xFF)}
            slaves.append(slave)
        with self.segment(*slaves):

            def ask(number: int) -> Outcome:
                own = str(len(statuses) + number)
                return self.verb("get", "64/1/2", "--master", own, address=number)

            with ThreadPoolExecutor(4) as pool:
                outcomes = list(pool.map(ask, range(len(statuses))))
            self.expect_released(*slaves)
        wrong = []
        for status, outcome in zip(statuses, outcomes, strict=True):
            try:
                outcome.ended(REFUSED, f"{status:02X}", STATUSES[status])
            except Wrong as error:
                wrong.append(str(error))
        if wrong:
            raise Wrong("; ".join(wrong))
        return outcomes[0].err.strip()

    def tells_who_never_answers(self) -> str:
        visit = self.visit()
        outcome = self.verb("get", "--json", address=NOBODY).within(VERB_SECONDS).ended(TIME_OUT)
        self.expect_listened_first(visit)
        error = outcome.error
        expect_keys("an error", error, "kind tried came remedy message")
        return f"after {outcome.seconds:.1f} s: {error['message']}"

    def gives_up_at_the_timeout(self) -> str:
        outcome = self.verb("get", "--timeout", "2s", address=NOBODY).ended(TIME_OUT).within(3.5)
        return f"after {outcome.seconds:.1f} s: {outcome.err.strip()}"

    def tells_a_device_that_dies(self) -> str:
        slave = Slave(VALVES_MAC, valve_terminal())
        with self.segment(slave):
            slave.temper.dies_after = 20
            outcome = self.verb("get", address=VALVES_MAC).ended(TIME_OUT).within(VERB_SECONDS + 5)
        return f"after {outcome.seconds:.1f} s: {outcome.err.strip().splitlines()[-1]}"

    def waits_for_a_slow_device(self) -> str:
        self.valves.temper.late = 0.7
        outcome, _ = self.asked_as(self.valves, "get", "64/1/2")
        self.valves.temper.late = 0
        outcome.ended(OK)
        self.expect_released(self.valves)
        return f"700 ms an answer: {outcome.seconds:.1f} s"

    def finds_its_own_address_taken(self) -> str:
        for slave in self.all:
            slave.forget()
        outcome = self.verb("scan", "--master", str(VALVES_MAC)).ended(BUS, str(VALVES_MAC))
        expect("allocations", [slave.allocations for slave in self.all if slave.allocations], [])
        expect("the owner of the address is still there", self.valves.is_alive, True)
        return outcome.err.strip().splitlines()[-1]

    def hears_nobody_on_an_empty_bus(self) -> str:
        with self.segment():
            outcome = self.verb("scan").ended(BUS)
        return f"after {outcome.seconds:.1f} s: {outcome.err.strip()}"

    def understands_wider_paths(self) -> str:
        seen = []
        for body_format in (1, 2, 3):
            slave = Slave(VALVES_MAC, valve_terminal(), body_format=body_format)
            with self.segment(slave):
                outcome = self.verb("get", "64/1/2", address=VALVES_MAC)
                self.expect_released(slave)
            if outcome.status == OK:
                seen.append(f"format {body_format}: {outcome.value}")
            elif outcome.status in (BUS, REFUSED) and "format" in outcome.err:
                seen.append(f"format {body_format} is refused: {outcome.err.strip()}")
            else:
                raise Wrong(f"message body format {body_format}: {outcome}")
        return "; ".join(seen)

    # --- Slaves of others

    def watches_passively(self) -> str:
        polls = self.owner.polls
        visit = self.visit()
        outcome = self.verb("watch", "--for", "3s", "--json", address=OWNED_MAC).ended(OK)
        expect("frames", [str(heard) for heard in visit.sent], [])
        positions = {each["position"] for each in outcome.objects}
        expect("positions", positions, {RAW})
        cycles = [each["cycle_ms"] for each in outcome.objects if each["cycle_ms"]]
        if not cycles or not 40 <= sorted(cycles)[len(cycles) // 2] <= 100:
            raise Wrong(f"the owner's cycle is 50 ms or a little more, told: {cycles}")
        self.expect_undisturbed(polls)
        return f"{len(outcome.objects)} lines, cycle {cycles[-1]:.1f} ms, not a frame"

    def takes_no_slave_from_its_master(self) -> str:
        self.owned.forget()
        polls = self.owner.polls
        visit = self.visit()
        self.owner.asks = True
        outcome = self.verb("set", "direction", "ccw", "--yes", address=OWNED_MAC)
        self.owner.asks = False
        outcome.ended(REFUSED, f"MAC ID {OWNER_MAC}")
        expect("allocations tried", self.owned.refused_allocations, [])
        expect("writes", self.written(self.owned), [])
        self.expect_undisturbed(polls)
        return f"{len(visit.sent)} frames: {outcome.err.strip()}"

    def tells_a_slave_of_a_silent_master(self) -> str:
        """Its master has a connection and says nothing, so nobody can hear whose it is."""
        slave = Slave(VALVES_MAC, valve_terminal())
        with self.segment(slave):
            owner = Owner(OWNER_MAC, VALVES_MAC, does_poll=False)
            self.medium.join(owner)
            soon(lambda: owner.is_ready, "its master")
            slave.forget()
            outcome = self.verb("set", "parameter/2", "1", "--yes", address=VALVES_MAC)
            scanned = self.verb("scan", "--json").ended(OK)
            expect("its owner", slave.owner, OWNER_MAC)
            expect("allocations", slave.allocations, [])
            outcome.ended(REFUSED)
        nodes = [each for each in scanned.objects if each.get("address") == VALVES_MAC]
        expect("nodes of the scan", len(nodes), 1)
        if nodes[0]["owner"] is None:
            raise Wrong(f"the scan says that it is nobody's: {nodes[0]}")
        return f"{outcome.err.strip()}; scan: owner {nodes[0]['owner']}, {nodes[0]['state']}"

    # --- Leaving

    def releases_on_ctrl_c_while_it_watches(self) -> str:
        self.encoder.forget()
        arguments = ["watch", "--json", *self.bus, "--address", str(ENCODER_MAC)]
        with self.running(*arguments) as process:
            assert process.stdout is not None
            line = process.stdout.readline()
            if str(RAW) not in line:
                raise Wrong(f"the first line is {line!r}")
            expect("is served", self.encoder.is_free, False)
            status, seconds = self.interrupt(process)
        self.expect_released(self.encoder)
        return f"exit {status} after {seconds:.2f} s, releases {self.encoder.releases}"

    def releases_on_ctrl_c_while_it_opens(self) -> str:
        return self.interrupted_at(1)

    def releases_on_ctrl_c_while_it_reads(self) -> str:
        return self.interrupted_at(12)

    def interrupted_at(self, request: int) -> str:
        """Ctrl-C while an answer is awaited; the release itself needs no answer that is late."""
        slave = self.valves
        slave.forget()
        slave.temper.late, slave.temper.late_from = 0.4, request
        with self.running("get", *self.bus, "--address", str(slave.mac)) as process:
            soon(lambda: len(slave.asked) >= request, "a request")
            status, seconds = self.interrupt(process)
        slave.temper.late = 0
        try:
            soon(lambda: slave.is_free, "its release", 1.0)
        finally:
            # The next step needs it, however this one ended.
            soon(lambda: slave.is_free, "its time-out", 15.0)
        expect("time-outs", slave.timeouts, 0)
        return f"exit {status} after {seconds:.2f} s"

    def leaves_at_once_on_ctrl_c_while_it_listens(self) -> str:
        visit = self.visit()
        with self.running("scan", *self.bus) as process:
            soon(lambda: bool(visit.guests) and visit.guests[0].opened_at is not None, "a guest")
            status, seconds = self.interrupt(process, 2.0)
        expect("frames", visit.sent, [])
        return f"exit {status} after {seconds:.2f} s"

    # --- The encoder

    def reads_the_encoder(self) -> str:
        outcome, _ = self.asked_as(self.encoder, "get", "--json")
        values = {each["name"]: each["value"] for each in outcome.ended(OK).objects}
        for name, value in [("steps-per-turn", 8192), ("total-resolution", 536_870_912)]:
            expect(name, values.get(name), value)
        expect("position", values.get("position"), RAW)
        return f"{len(values)} values in {outcome.seconds:.1f} s"

    def sets_steps_per_turn(self) -> str:
        arguments = ["set", "steps-per-turn", "3600", "--yes", "--json"]
        outcome, _ = self.asked_as(self.encoder, *arguments)
        told = outcome.ended(OK).object
        expect("writes", [str(each) for each in self.written(self.encoder)], [self.steps_octets])
        expect("total", self.model.number(8), 3600 * 65536)
        changed = [each["name"] for each in told["changed"]]
        expect("what changed besides", "total-resolution" in changed, True)
        self.undo(outcome)
        expect("after undo", (self.model.number(7), self.model.number(8)), (8192, 536_870_912))
        return f"changed too: {', '.join(changed)}; undone by {told['undo']}"

    @property
    def steps_octets(self) -> str:
        """Set 2Fh/1/7 to 3600."""
        return f"10 2F/1 07 {(3600).to_bytes(4, 'little').hex(' ')}"

    def presets_and_undoes_it(self) -> str:
        outcome, _ = self.asked_as(self.encoder, "preset", "5", "--yes", "--json")
        told = outcome.ended(OK).object
        expect("before and after", (told["before"], told["after"]), (RAW, 5))
        writes = [f"{each}" for each in self.written(self.encoder)]
        expect("writes", writes, ["10 2F/1 0a 05 00 00 00"])
        self.expect_released(self.encoder)
        self.undo(outcome)
        expect("position after undo", self.model.number(12), RAW)
        return f"undone by {told['undo']}"

    def saves_restores_and_resets(self) -> str:
        self.asked_as(self.encoder, "preset", "77", "--yes")[0].ended(OK)
        expect("saves before", self.model.saves, 0)
        self.asked_as(self.encoder, "save", "--yes", "--json")[0].ended(OK)
        expect("saves", self.model.saves, 1)
        self.asked_as(self.encoder, "set", "direction", "ccw", "--yes")[0].ended(OK)
        expect("offset", self.model.number(91), 0)
        self.asked_as(self.encoder, "restore", "--yes")[0].ended(OK)
        expect("position after restore", self.model.number(12), 77)
        outcome, _ = self.asked_as(self.encoder, "reset", "--yes", "--json")
        outcome.ended(OK)
        expect("position after reset", self.model.number(12), RAW)
        self.undo(outcome)
        expect("position after the reset is undone", self.model.number(12), 77)
        expect("saves", self.model.saves, 1)
        self.expect_released(self.encoder)
        return f"reset undone by {outcome.object['undo']}"

    def takes_and_applies_a_passport(self) -> str:
        file = str(self.folder / "encoder.toml")
        self.asked_as(self.encoder, "set", "steps-per-turn", "1000", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "preset", "4242", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "backup", file)[0].ended(OK)
        expect("writes", self.written(self.encoder), [])
        self.asked_as(self.encoder, "diff", file)[0].ended(OK)
        self.asked_as(self.encoder, "reset", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "diff", file)[0].ended(DIFFERS)
        outcome, _ = self.asked_as(self.encoder, "apply", file, "--yes")
        outcome.ended(OK)
        position = self.model.number(12)
        expect_within("position", position, 4241, 4243)
        self.asked_as(self.encoder, "diff", file)[0].ended(OK)
        self.expect_released(self.encoder)
        return f"position {position}, applied in {outcome.seconds:.1f} s"

    def speaks_json_with_every_verb(self) -> str:
        """Scripts go by the keys, which must not change with what is found."""
        file = str(self.folder / "json.toml")
        change, yes = "before after undo", "--yes"
        keys = {
            ("identify",): "bus address models vendor device_type product_code product_name "
            "revision serial firmware",
            ("get", "position"): VALUE_KEYS,
            ("set", "cos-delta", "7", yes): f"name changed {change}",
            ("set", "cos-delta", "7", yes, "--verbose"): f"name changed {change}",
            ("preset", "3", yes): change,
            ("save", yes): "done changed undo",
            ("restore", yes): "done changed undo",
            ("backup", file): "file address serial position at_rest settings",
            ("apply", file, yes): "verdict steps differences remarks undo",
            ("reset", yes): "done changed undo",
            ("watch", "--for", "1s"): "at position turn degrees steps_per_second rpm alarm warning "
            "cycle_ms cycle_min_ms cycle_max_ms",
        }
        for arguments, wanted in keys.items():
            outcome, _ = self.asked_as(self.encoder, *arguments, "--json")
            objects = outcome.ended(OK).objects
            if not objects:
                raise Wrong(f"{outcome}: no object")
            for each in objects:
                expect_keys(" ".join(arguments[:2]), each, wanted)
        outcome, _ = self.asked_as(self.encoder, "diff", file, "--json")
        differences = outcome.ended(DIFFERS).objects
        if not differences:
            raise Wrong(f"{outcome}: no object")
        return f"{len(keys) + 1} commands; a difference has {' '.join(differences[0])}"

    # --- The run

    @property
    def all(self) -> list[Slave]:
        """Everybody on the segment."""
        return [self.encoder, self.valves, self.stub, self.owned]

    def run_all(self, folder: Path) -> None:
        """All steps; a segment of its own where a step needs one."""
        self.folder = folder
        self.model = Encoder(RAW)
        self.encoder = Slave(ENCODER_MAC, self.model.device, inputs=lambda: self.model.inputs)
        self.valves = Slave(VALVES_MAC, valve_terminal())
        self.stub = Slave(STUB_MAC, valve_terminal(full=False))
        other = Encoder(RAW, serial=815)
        self.owned = Slave(OWNED_MAC, other.device, inputs=lambda: other.inputs)
        with self.segment(*self.all):
            self.owner = Owner(OWNER_MAC, OWNED_MAC)
            self.medium.join(self.owner)
            soon(lambda: self.owner.answers > 5, "polls of the owner")
            self.on_the_segment()
        self.chapter("Segments of their own")
        self.named(self.tells_each_general_status)
        self.named(self.tells_a_device_that_dies)
        self.named(self.tells_a_slave_of_a_silent_master)
        self.named(self.hears_nobody_on_an_empty_bus)
        self.named(self.understands_wider_paths)

    def on_the_segment(self) -> None:
        """Steps with everybody on it."""
        chapters: dict[str, list[Callable[[], str]]] = {
            "Scan": [
                self.scans_after_a_second_of_silence,
                self.finds_all_with_their_identity,
                self.leaves_the_slave_of_another_alone,
                self.releases_whom_it_asked_and_writes_nothing,
                self.names_an_owner_who_says_his_name,
                self.shows_a_table_to_people,
                self.finds_its_own_address_taken,
            ],
            "Devices that nobody knows": [
                self.identifies_what_it_does_not_know,
                self.reads_the_parameter_object,
                self.scales_what_is_scaled,
                self.reads_a_real,
                self.reads_any_attribute_in_fragments,
                self.reads_stubs,
                self.gives_scripts_the_value_alone,
            ],
            "Writing": [
                self.writes_once_and_reads_back,
                self.writes_nothing_without_consent,
                self.tells_a_value_out_of_range,
                self.refuses_to_write_what_is_read_only,
                self.notices_a_device_that_ignores_a_write,
                self.writes_in_fragments,
                self.writes_once_though_the_answer_is_lost,
                self.knows_no_position_of_a_stranger,
            ],
            "Trouble": [
                self.tells_who_never_answers,
                self.gives_up_at_the_timeout,
                self.opens_the_adapter_at_the_rate_that_is_asked_for,
                self.waits_for_a_slow_device,
            ],
            "Slaves of others": [self.watches_passively, self.takes_no_slave_from_its_master],
            "Leaving": [
                self.releases_on_ctrl_c_while_it_watches,
                self.releases_on_ctrl_c_while_it_opens,
                self.releases_on_ctrl_c_while_it_reads,
                self.leaves_at_once_on_ctrl_c_while_it_listens,
                self.defends_its_own_address,
                self.takes_up_what_a_killed_one_left,
            ],
            "The encoder": [
                self.reads_the_encoder,
                self.sets_steps_per_turn,
                self.presets_and_undoes_it,
                self.saves_restores_and_resets,
                self.takes_and_applies_a_passport,
                self.speaks_json_with_every_verb,
            ],
        }
        for name, steps in chapters.items():
            self.chapter(name)
            for step in steps:
                self.named(step)


def main() -> int:
    """Runs the walk; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments = arguments_of(parser, "codewheel-commission-devicenet.log", "candump -L lines")
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        folder = Path(directory)
        with (folder / "messages").open("w") as messages:
            walk = Commission(arguments.program.resolve(), messages, log)
            try:
                walk.run_all(folder)
            finally:
                print(f"the frames are in {arguments.log}")
                print(f"{walk.passed} passed, {walk.failed} failed")
    return 1 if walk.failed else 0


if __name__ == "__main__":
    sys.exit(main())
