"""The commissioning verbs against PROFIBUS slaves and masters that are not ours.

Usage: commission_profibus.py [PROGRAM] [--log FILE]

Runs PROGRAM (default: target/release/codewheel, else target/debug/codewheel) with its verbs, as
people and scripts do, on a line that is played here: an encoder by its manual, a valve island of
another maker, a master that owns the encoder and a token ring. Each step prints one line, `ok` or
`FAILED`. All telegrams go to FILE, with each run of the program.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import profibus_book as book
from commission_profibus_master import RingMaster, encoder_at
from commission_profibus_slave import DATA_EXCH, WAIT_PRM, Encoder, Slave, ValveIsland
from commission_segment import Node, SerialLine, Visit
from commission_walk import (
    BUS,
    DIFFERS,
    OK,
    REFUSED,
    TIME_OUT,
    USAGE,
    Outcome,
    Walk,
    expect_keys,
    soon,
)
from profibus_book import BookViolation, Telegram
from steps import Wrong, arguments_of, expect, expect_within

ENCODER, VALVES, NOBODY, OUR_ADDRESS, OWNER = 7, 12, 33, 0, 2
RAW = 100_000
TOTAL = 8192 * 65536
LISTENING = 1.0
VERB_SECONDS = 12.0
DEFAULT_USER = bytes.fromhex("00 00 20 00 20 00 00 00")


class Commission(Walk[bytes]):
    """Each verb on a line with strangers."""

    wrongs = (*Walk.wrongs, BookViolation)

    @property
    def bus(self) -> list[str]:
        """The line, at a rate that a PC can keep."""
        return ["--bus", f"rs485:127.0.0.1:{self.medium.port}", "--baud", "19200"]

    @contextlib.contextmanager
    def line(self, *nodes: Node[bytes]) -> Iterator[None]:
        """A line with slaves and masters."""
        medium = self._medium = SerialLine(self._log)
        try:
            for node in nodes:
                medium.join(node)
            yield
        finally:
            medium.close()

    # --- What many steps do

    def asked_as(self, slave: Slave, *arguments: str, **options: float) -> tuple[Outcome, Visit]:
        """Runs a verb at a slave that counts anew."""
        for each in self.slaves:
            each.forget()
        self.model.parameters.clear()
        self.model.outputs.clear()
        self.model.presets.clear()
        visit = self.visit()
        outcome = self.verb(*arguments, address=slave.address, **options)
        self.expect_by_the_book(visit)
        return outcome, visit

    def expect_by_the_book(self, visit: Visit[bytes]) -> None:
        """Nothing in the first second; then requests and tokens of our address alone."""
        if visit.silence < LISTENING:
            raise Wrong(f"the first octet left after {visit.silence:.3f} s: {visit.sent[0]}")
        for heard in visit.sent:
            if heard.message[0] == book.SD4:
                expect("sender of a token", heard.message[2], OUR_ADDRESS)
                continue
            telegram = Telegram.parse(heard.message)
            expect("sender", telegram.sa, OUR_ADDRESS)
            if not telegram.fc & 0x40 and telegram.fc & 0x0F != book.OK:
                raise Wrong(f"a master sends requests, and its own FDL status: {heard}")

    def expect_released(self, slave: Slave) -> None:
        """It waits for parameters, by an Unlock and not by its watchdog."""
        expect("state afterwards", slave.state, WAIT_PRM)
        expect("owner afterwards", slave.owner, book.NO_MASTER)
        expect("ends of the watchdog", slave.watchdog_ends, 0)
        if slave.locked_by:
            expect("unlocked by", set(slave.unlocked_by), {OUR_ADDRESS})

    def expect_silence(self, visit: Visit[bytes]) -> None:
        """Not an octet."""
        octets = sum(guest.octets for guest in visit.guests)
        expect("octets sent", octets, 0)

    # --- A line without a master

    def scans_after_a_second_of_silence(self) -> str:
        visit = self.visit()
        outcome = self.verb("scan", "--json").ended(OK)
        self.expect_by_the_book(visit)
        self.nodes = {each["address"]: each for each in outcome.objects if "address" in each}
        expect("nodes", sorted(self.nodes), [ENCODER, VALVES])
        for node in self.nodes.values():
            expect_keys("a node", node, "bus address role identity owner lamp state")
            expect("role", node["role"], "slave")
            expect("owner", node["owner"], None)
        expect("ident of the encoder", self.nodes[ENCODER]["identity"]["product_code"], 0x059B)
        expect("ident of the island", self.nodes[VALVES]["identity"]["product_code"], 0x7A31)
        expect("models of the island", self.nodes[VALVES]["identity"]["models"], [])
        models = self.nodes[ENCODER]["identity"]["models"]
        expect("amg11-p29 is one of the models", "amg11-p29" in models, True)
        others = [model for model in models if model.endswith(("13", "18"))]
        expect("models of another disc", others, [])
        silence = f"first octet after {visit.silence:.2f} s, {outcome.seconds:.1f} s in all"
        return f"{silence}; {self.nodes[ENCODER]['state']}; {self.nodes[VALVES]['state']}"

    def changes_nothing_by_a_scan(self) -> str:
        for slave in self.slaves:
            for sap in (book.SET_PRM, book.CHK_CFG, book.SET_SLAVE_ADD, None):
                asked = [each.octets().hex(" ") for each in slave.services(sap)]
                expect(f"requests to SAP {sap} of {slave.address}", asked, [])
        return ", ".join(f"{slave.address}: {len(slave.asked)} requests" for slave in self.slaves)

    def identifies_both(self) -> str:
        seen = []
        for slave, ident in ((self.encoder, 0x059B), (self.valves, 0x7A31)):
            outcome, _ = self.asked_as(slave, "identify", "--json")
            told = outcome.ended(OK).object
            expect("ident number", told["product_code"], ident)
            self.expect_released(slave)
            seen.append(f"{slave.address}: {told['models']} {told['firmware']}")
        return "; ".join(seen)

    def reads_the_encoder(self) -> str:
        outcome, _ = self.asked_as(self.encoder, "get", "--json")
        values = {each["name"]: each for each in outcome.ended(OK).objects}
        for value in values.values():
            keys = "name place title value label unit writable setting range"
            expect_keys("a value", value, keys)
        wanted = {"steps-per-turn": 8192, "total-resolution": TOTAL, "position": RAW}
        for name, value in wanted.items():
            expect(name, values.get(name, {}).get("value"), value)
        self.expect_released(self.encoder)
        return f"{len(values)} values, {outcome.seconds:.1f} s"

    def serves_with_what_is_in_force(self) -> str:
        """A session that only looks must not change what the encoder works with."""
        sent = {each[:10] for each in self.model.parameters}
        expect("octets 8 to 17 of Set_Prm", sent, {bytes.fromhex("00 0A") + DEFAULT_USER})
        prm = self.encoder.services(book.SET_PRM)[0]
        if not prm.data[0] & 0x08:
            raise Wrong(f"the watchdog is off: {prm.octets().hex(' ')}")
        if not 11 <= prm.data[3] <= 255:
            raise Wrong(f"min T_SDR is {prm.data[3]}")
        return prm.octets().hex(" ").upper()

    def reads_octets_of_a_stranger(self) -> str:
        outcome, _ = self.asked_as(self.valves, "get", "--json")
        values = {each["name"]: each["value"] for each in outcome.ended(OK).objects}
        expect("writes", [each for each in self.valves.services(book.SET_PRM)], [])
        one, _ = self.asked_as(self.valves, "get", "octet/8")
        if one.ended(OK).value.strip(":") not in ("80", "128"):
            raise Wrong(f"octet 8 is 80h, read {one.value}")
        return f"{values}; octet 8: {one.value}"

    def presets_with_the_octets_of_the_manual(self) -> str:
        outcome, _ = self.asked_as(self.encoder, "preset", "5", "--yes", "--json")
        told = outcome.ended(OK).object
        outputs = [octets.hex(" ") for octets, _ in itertools.groupby(self.model.outputs)]
        at = outputs.index("80 00 00 05") if "80 00 00 05" in outputs else None
        if at is None or outputs[at + 1 : at + 2] != ["00 00 00 05"]:
            raise Wrong(f"§7.4 wants 80 00 00 05, then 00 00 00 05; sent: {outputs}")
        others = [each for each in outputs if each.startswith(("8", "9", "a", "b", "c", "d", "e"))]
        expect("telegrams with the top bit", others, ["80 00 00 05"])
        expect("presets that it took", self.model.presets, [5])
        expect("before and after", (told["before"], told["after"]), (RAW, 5))
        self.expect_released(self.encoder)
        expect("offset", self.model.offset, 5 - RAW)
        return f"{' | '.join(outputs)}; undo {told['undo']}"

    def keeps_the_offset_while_it_looks(self) -> str:
        outcome, _ = self.asked_as(self.encoder, "get", "position")
        expect("position", outcome.ended(OK).value, "5")
        expect("offset", self.model.offset, 5 - RAW)
        return outcome.value

    def undoes_the_preset(self) -> str:
        outcome, _ = self.asked_as(self.encoder, "preset", "9", "--yes", "--json")
        self.undo(outcome)
        expect("position", self.model.position(), 5)
        return f"{outcome.object['undo']}"

    def refuses_a_preset_out_of_range_itself(self) -> str:
        """The encoder would show it as an alarm until it gets another."""
        outcome, _ = self.asked_as(self.encoder, "preset", str(TOTAL), "--yes")
        if outcome.status not in (USAGE, REFUSED):
            raise Wrong(f"{outcome}: expected exit status 2 or 4")
        expect("alarm", self.model.has_wrong_preset, False)
        expect("position", self.model.position(), 5)
        return f"exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}"

    def presets_once_though_an_answer_is_lost(self) -> str:
        """The request comes again, octet for octet, and is not executed again."""

        class Forgetful(Encoder):
            def output(self, octets: bytes) -> None:
                super().output(octets)
                if octets[:1] == b"\x80":
                    slave.temper.loses_answers = 1

        model = Forgetful(RAW)
        slave = Slave(ENCODER, model)
        with self.line(slave):
            outcome = self.verb("preset", "5", "--yes", address=ENCODER).ended(OK)
        expect("presets", model.presets, [5])
        retries = [each for each in slave.asked if each.is_retry]
        if not retries:
            raise Wrong("no request came again")
        return f"{len(retries)} retries, {outcome.seconds:.1f} s"

    def sets_the_example_of_chapter_8(self) -> str:
        """3600 steps x 256 turns = 921600: hi 14, lo 4096; the total first, since it must fit."""
        outcome, _ = self.asked_as(self.encoder, "set", "total-resolution", "921600", "--yes")
        outcome.ended(OK, " 14", " 4096")
        outcome, _ = self.asked_as(self.encoder, "set", "steps-per-turn", "3600", "--yes")
        outcome.ended(OK, " 0", " 3600")
        user = bytes.fromhex("00 0A 00 00 0E 10 00 0E 10 00")
        if user not in [each[:10] for each in self.model.parameters]:
            sent = [each.hex(" ") for each in self.model.parameters]
            raise Wrong(f"octets 8 to 17 of §6.1 are {user.hex(' ')}, accepted were {sent}")
        self.expect_released(self.encoder)
        return outcome.err.strip().splitlines()[-1]

    def tells_that_the_total_must_be_lower(self) -> str:
        """3600 is a number of steps, but 3600 x 65536 is less than the total that is in force."""
        for key, value in (("steps-per-turn", 8192), ("total-resolution", TOTAL)):
            self.asked_as(self.encoder, "set", key, str(value), "--yes")[0].ended(OK)
        outcome, _ = self.asked_as(self.encoder, "set", "steps-per-turn", "3600", "--yes")
        outcome.ended(REFUSED, "total", "235929600")
        expect("in force", (self.model.steps, self.model.total), (8192, TOTAL))
        self.expect_released(self.encoder)
        return outcome.err.strip().splitlines()[-1]

    def knows_no_preset_in_class_1(self) -> str:
        """Manual §7.4: only in class 2."""
        model = Encoder(RAW)
        model.is_class_2 = model.is_scaled = False
        slave = Slave(ENCODER, model)
        with self.line(slave):
            outcome = self.verb("preset", "5", "--yes", address=ENCODER)
        if outcome.status == OK:
            # Where it was told to be of class 2 for it, the preset must have come about.
            expect("presets", model.presets, [5])
        elif outcome.status not in (USAGE, REFUSED):
            raise Wrong(f"{outcome}: expected exit status 0, 2 or 4")
        expect("state afterwards", slave.state, WAIT_PRM)
        return f"exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}"

    def knows_no_position_of_a_stranger(self) -> str:
        seen = []
        for arguments in (["preset", "5", "--yes"], ["watch", "--for", "1s"]):
            outcome, _ = self.asked_as(self.valves, *arguments)
            expect("parameters", [str(each) for each in self.valves.services(book.SET_PRM)], [])
            if outcome.status not in (USAGE, REFUSED):
                raise Wrong(f"{outcome}: expected exit status 2 or 4")
            seen.append(f"exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}")
        return "; ".join(seen)

    def takes_up_what_a_killed_one_left(self) -> str:
        arguments = ["watch", *self.bus, "--address", str(ENCODER), "--json"]
        with self.running(*arguments) as process:
            assert process.stdout is not None
            process.stdout.readline()
            process.kill()
            process.wait()
        outcome, _ = self.asked_as(self.encoder, "get", "position")
        outcome.ended(OK)
        expect("state", self.encoder.state, WAIT_PRM)
        return f"position {outcome.value} after {outcome.seconds:.1f} s"

    def lets_a_master_into_its_ring(self) -> str:
        """Who has the token looks for others that want it, and goes on serving its slave."""
        newcomer = RingMaster(4, [])
        arguments = ["watch", *self.bus, "--address", str(ENCODER), "--json"]
        with self.running(*arguments) as process:
            assert process.stdout is not None
            process.stdout.readline()
            self.medium.join(newcomer)
            try:
                soon(lambda: newcomer.got_from.get(OUR_ADDRESS, 0) > 10, "a ring of two", 20.0)
                expect("state", self.encoder.state, DATA_EXCH)
                expect("tokens that got lost", newcomer.tokens_taken_up, 0)
                status, seconds = self.interrupt(process)
            finally:
                self.medium.part(newcomer)
        self.expect_released(self.encoder)
        return f"{newcomer.got_from[OUR_ADDRESS]} rotations; exit {status} after {seconds:.2f} s"

    def tells_what_does_not_fit(self) -> str:
        self.asked_as(self.encoder, "set", "direction", "ccw", "--yes")[0].ended(OK)
        outcome, _ = self.asked_as(self.encoder, "set", "steps-per-turn", "9000", "--yes")
        if outcome.status not in (USAGE, REFUSED):
            raise Wrong(f"{outcome}: expected exit status 2 or 4")
        expect("fault left behind", self.encoder.fault, 0)
        self.expect_released(self.encoder)
        return f"exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}"

    def tells_refused_parameters(self) -> str:
        self.encoder.temper.refuses_parameters = True
        outcome, _ = self.asked_as(self.encoder, "set", "direction", "cw", "--yes")
        self.encoder.temper.refuses_parameters = False
        outcome.ended(REFUSED).within(VERB_SECONDS)
        return outcome.err.strip().splitlines()[-1]

    def knows_no_save(self) -> str:
        seen = []
        for verb in ("save", "restore"):
            outcome, _ = self.asked_as(self.encoder, verb, "--yes")
            if outcome.status not in (USAGE, REFUSED):
                raise Wrong(f"{outcome}: expected exit status 2 or 4")
            seen.append(f"{verb}: exit {outcome.status}: {outcome.err.strip().splitlines()[-1]}")
        self.expect_released(self.encoder)
        return "; ".join(seen)

    def takes_and_applies_a_passport(self) -> str:
        file = str(self.folder / "encoder.toml")
        self.asked_as(self.encoder, "set", "total-resolution", "921600", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "set", "steps-per-turn", "3600", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "preset", "4242", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "backup", file)[0].ended(OK)
        expect("position after the backup", self.model.position(), 4242)
        self.asked_as(self.encoder, "diff", file)[0].ended(OK)
        self.asked_as(self.encoder, "set", "direction", "cw", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "preset", "1", "--yes")[0].ended(OK)
        self.asked_as(self.encoder, "diff", file)[0].ended(DIFFERS)
        self.asked_as(self.encoder, "apply", file, "--yes")[0].ended(OK)
        expect_within("position", self.model.position(), 4241, 4243)
        self.asked_as(self.encoder, "diff", file)[0].ended(OK)
        self.expect_released(self.encoder)
        return f"position {self.model.position()}"

    def tells_who_never_answers(self) -> str:
        visit = self.visit()
        outcome = self.verb("get", "--json", address=NOBODY).ended(TIME_OUT).within(VERB_SECONDS)
        self.expect_by_the_book(visit)
        expect_keys("an error", outcome.error, "kind tried came remedy message")
        return f"after {outcome.seconds:.1f} s: {outcome.error['message']}"

    def tells_a_slave_that_dies(self) -> str:
        slave = Slave(ENCODER, Encoder(RAW))
        with self.line(slave):
            arguments = ["watch", *self.bus, "--address", str(ENCODER), "--json"]
            with self.running(*arguments) as process:
                assert process.stdout is not None and process.stderr is not None
                process.stdout.readline()
                slave.is_alive = False
                begin = time.monotonic()
                status = process.wait(VERB_SECONDS)
                took = time.monotonic() - begin
                said = process.stderr.read().strip()
        expect("exit status", status, TIME_OUT)
        return f"after {took:.1f} s: {said.splitlines()[-1]}"

    def releases_on_ctrl_c_while_it_watches(self) -> str:
        self.encoder.forget()
        arguments = ["watch", *self.bus, "--address", str(ENCODER), "--json"]
        with self.running(*arguments) as process:
            assert process.stdout is not None
            process.stdout.readline()
            expect("state", self.encoder.state, DATA_EXCH)
            status, seconds = self.interrupt(process)
        self.expect_released(self.encoder)
        return f"exit {status} after {seconds:.2f} s"

    def releases_on_ctrl_c_while_it_opens(self) -> str:
        seen = []
        for sap in (book.SET_PRM, book.CHK_CFG):
            self.encoder.forget()
            with self.running("get", *self.bus, "--address", str(ENCODER)) as process:
                soon(lambda sap=sap: bool(self.encoder.services(sap)), "parameters")
                status, seconds = self.interrupt(process)
            self.expect_released(self.encoder)
            seen.append(f"exit {status} after {seconds:.2f} s")
        return ", ".join(seen)

    def is_let_go_by_the_watchdog_when_it_is_killed(self) -> str:
        self.encoder.forget()
        arguments = ["watch", *self.bus, "--address", str(ENCODER), "--json"]
        with self.running(*arguments) as process:
            assert process.stdout is not None
            process.stdout.readline()
            process.kill()
            process.wait()
        begin = time.monotonic()
        soon(lambda: self.encoder.state == WAIT_PRM, "the end of the watchdog", 15.0)
        return f"after {time.monotonic() - begin:.1f} s"

    # --- A line with another master

    def sends_nothing_beside_another_master(self) -> str:
        seen = []
        self.encoder.forget()
        before = self.owner.slaves[0].exchanges
        cases: list[tuple[list[str], tuple[int, ...]]] = [
            (["scan", "--json"], (OK,)),
            (["identify", "--address", str(ENCODER)], (OK, BUS, REFUSED)),
            (["set", "direction", "ccw", "--yes", "--address", str(ENCODER)], (BUS, REFUSED)),
            (["preset", "1", "--yes", "--address", str(ENCODER)], (BUS, REFUSED)),
            (["get", "--address", str(VALVES)], (BUS, REFUSED)),
        ]
        for arguments, statuses in cases:
            visit = self.visit()
            outcome = self.verb(*arguments)
            self.expect_silence(visit)
            if outcome.status not in statuses:
                raise Wrong(f"{outcome}: expected one of exit statuses {statuses}")
            said = outcome.err.strip().splitlines()
            seen.append(f"{arguments[0]}: exit {outcome.status} {said[-1] if said else ''}")
            if arguments[0] == "scan":
                told = outcome.objects
                self.nodes = {each["address"]: each for each in told if "address" in each}
                self.remarks = [each["remark"] for each in told if "remark" in each]
        self.expect_undisturbed(before)
        return "; ".join(seen)

    def expect_undisturbed(self, exchanges: int) -> None:
        """The owner exchanged data all the while."""
        slave = self.owner.slaves[0]
        expect("falls of its slave", slave.falls, 0)
        if slave.exchanges - exchanges < 30:
            raise Wrong(f"only {slave.exchanges - exchanges} exchanges of the owner")

    def names_the_owner(self) -> str:
        expect("owner", self.nodes[ENCODER]["owner"], OWNER)
        expect("role of the owner", self.nodes[OWNER]["role"], "master")
        if not self.remarks:
            raise Wrong("nothing is said about why nothing was asked")
        return f"{self.nodes[ENCODER]['state']}; {self.nodes[OWNER]['state']}; {self.remarks}"

    def watches_passively(self) -> str:
        before = self.owner.slaves[0].exchanges
        visit = self.visit()
        outcome = self.verb("watch", "--for", "3s", "--json", address=ENCODER).ended(OK)
        self.expect_silence(visit)
        expect("positions", {each["position"] for each in outcome.objects}, {RAW})
        self.expect_undisturbed(before)
        return f"{len(outcome.objects)} lines, cycle {outcome.objects[-1]['cycle_ms']} ms"

    def joins_the_ring_and_leaves_it_whole(self) -> str:
        before = self.owner.slaves[0].exchanges
        taken_up, lost = self.owner.tokens_taken_up, len(self.owner.lost)
        self.encoder.forget()
        self.valves.forget()
        visit = self.visit()
        outcome = self.verb("scan", "--join", "--json").ended(OK)
        self.expect_by_the_book(visit)
        nodes = {each["address"]: each for each in outcome.objects if "address" in each}
        expect("nodes", sorted(nodes), [OWNER, ENCODER, VALVES])
        expect("owner", nodes[ENCODER]["owner"], OWNER)
        expect("ident", nodes[VALVES]["identity"]["product_code"], 0x7A31)
        expect("tokens that got lost", self.owner.tokens_taken_up - taken_up, 0)
        if not self.owner.got_from.get(OUR_ADDRESS):
            raise Wrong("the token never came back from it")
        self.expect_undisturbed(before)
        for slave in self.slaves:
            prm = [each.sa for each in slave.services(book.SET_PRM) + slave.services(book.CHK_CFG)]
            expect(f"who parameterised {slave.address}", set(prm) - {OWNER}, set())
        soon(lambda: self.owner.next == OWNER, "a ring of one again", 3.0)
        self.expect_no_two_tokens(visit)
        return (
            f"{self.owner.got_from[OUR_ADDRESS]} rotations, dropped "
            f"{len(self.owner.lost) - lost} times, {outcome.seconds:.1f} s"
        )

    def expect_no_two_tokens(self, visit: Visit[bytes]) -> None:
        """It speaks only between the token to it and the token from it."""
        holds = False
        for heard in visit.all:
            is_token = heard.message[0] == book.SD4
            ours = heard.guest in visit.guests
            if is_token and heard.message[1] == OUR_ADDRESS and not ours:
                holds = True
            elif ours and not is_token and Telegram.parse(heard.message).fc & 0x40 and not holds:
                raise Wrong(f"it speaks without the token: {heard}")
            elif ours and is_token:
                if not holds:
                    raise Wrong(f"it passes a token that it was not given: {heard}")
                # It may repeat a token that the next one did not take.
                holds = heard.message[1] == OUR_ADDRESS or holds
            elif not ours and (is_token or Telegram.parse(heard.message).fc & 0x40):
                holds = False

    def leaves_the_ring_on_ctrl_c(self) -> str:
        before, rotations = self.owner.slaves[0].exchanges, self.owner.got_from.get(OUR_ADDRESS, 0)
        taken_up = self.owner.tokens_taken_up
        with self.running("scan", "--join", *self.bus) as process:
            soon(
                lambda: self.owner.got_from.get(OUR_ADDRESS, 0) > rotations + 5, "a ring of two", 30
            )
            status, seconds = self.interrupt(process)
        soon(lambda: self.owner.next == OWNER, "a ring of one again", 3.0)
        self.expect_undisturbed(before)
        # Who leaves hands the token on first.
        expect("tokens that got lost", self.owner.tokens_taken_up - taken_up, 0)
        return f"exit {status} after {seconds:.2f} s"

    def takes_no_slave_from_its_master(self) -> str:
        before = self.owner.slaves[0].exchanges
        self.encoder.forget()
        outcome = self.verb("set", "direction", "ccw", "--yes", "--join", address=ENCODER)
        outcome.ended(REFUSED, f"{OWNER}")
        prm = {each.sa for each in self.encoder.services(book.SET_PRM)}
        expect("who parameterised it", prm - {OWNER}, set())
        self.expect_undisturbed(before)
        return outcome.err.strip().splitlines()[-1]

    def has_its_address_taken(self) -> str:
        visit = self.visit()
        outcome = self.verb("scan", "--join", "--master", str(OWNER)).ended(BUS, f"{OWNER}")
        self.expect_silence(visit)
        return outcome.err.strip().splitlines()[-1]

    def leaves_a_master_without_token_alone(self) -> str:
        """Masters of the simple sort send no token, so nobody can join them.

        This one is slow besides: its pauses must not be taken for a token that got lost.
        """
        slave = Slave(ENCODER, Encoder(RAW))
        owner = RingMaster(OWNER, [encoder_at(ENCODER)], has_token=False, pause=0.25)
        with self.line(slave, owner):
            soon(lambda: owner.slaves[0].exchanges > 5, "data exchange")
            visit = self.visit()
            outcome = self.verb("scan", "--json").ended(OK)
            self.expect_silence(visit)
            nodes = {each["address"]: each for each in outcome.objects if "address" in each}
            expect("owner", nodes[ENCODER]["owner"], OWNER)
            visit = self.visit()
            joined = self.verb("scan", "--join", seconds=60)
            self.expect_silence(visit)
            expect("falls", owner.slaves[0].falls, 0)
            joined.ended(BUS)
        return f"with --join: exit {joined.status}: {joined.err.strip()}"

    def hears_nobody_on_an_empty_line(self) -> str:
        with self.line():
            outcome = self.verb("scan").ended(BUS)
        return f"after {outcome.seconds:.1f} s: {outcome.err.strip()}"

    # --- The run

    @property
    def slaves(self) -> list[Slave]:
        """Both."""
        return [self.encoder, self.valves]

    def new_slaves(self) -> list[Slave]:
        """An encoder and a valve island, fresh from the box."""
        self.model = Encoder(RAW)
        self.encoder, self.valves = Slave(ENCODER, self.model), Slave(VALVES, ValveIsland())
        return self.slaves

    def run_all(self, folder: Path) -> None:
        """All steps."""
        self.folder = folder
        self.chapter("A line without a master")
        with self.line(*self.new_slaves()):
            self.all_named(
                self.scans_after_a_second_of_silence,
                self.changes_nothing_by_a_scan,
                self.identifies_both,
                self.reads_the_encoder,
                self.serves_with_what_is_in_force,
                self.reads_octets_of_a_stranger,
                self.presets_with_the_octets_of_the_manual,
                self.keeps_the_offset_while_it_looks,
                self.undoes_the_preset,
                self.refuses_a_preset_out_of_range_itself,
                self.sets_the_example_of_chapter_8,
                self.tells_that_the_total_must_be_lower,
                self.knows_no_position_of_a_stranger,
                self.tells_what_does_not_fit,
                self.tells_refused_parameters,
                self.knows_no_save,
                self.takes_and_applies_a_passport,
                self.tells_who_never_answers,
                self.releases_on_ctrl_c_while_it_watches,
                self.releases_on_ctrl_c_while_it_opens,
                self.is_let_go_by_the_watchdog_when_it_is_killed,
                self.takes_up_what_a_killed_one_left,
                self.lets_a_master_into_its_ring,
            )
        self.chapter("A line with another master")
        self.owner = RingMaster(OWNER, [encoder_at(ENCODER)])
        with self.line(*self.new_slaves(), self.owner):
            soon(lambda: self.owner.slaves[0].exchanges > 5, "data exchange of the owner")
            self.all_named(
                self.sends_nothing_beside_another_master,
                self.names_the_owner,
                self.watches_passively,
                self.joins_the_ring_and_leaves_it_whole,
                self.leaves_the_ring_on_ctrl_c,
                self.takes_no_slave_from_its_master,
                self.has_its_address_taken,
            )
        self.chapter("Lines of their own")
        self.all_named(
            self.presets_once_though_an_answer_is_lost,
            self.knows_no_preset_in_class_1,
            self.tells_a_slave_that_dies,
            self.leaves_a_master_without_token_alone,
            self.hears_nobody_on_an_empty_line,
        )

    def all_named(self, *steps: Callable[[], str]) -> None:
        """One after the other."""
        for step in steps:
            self.named(step)


def main() -> int:
    """Runs the walk; 0 where every step passed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments = arguments_of(parser, "codewheel-commission-profibus.log", "telegrams")
    with tempfile.TemporaryDirectory() as directory, arguments.log.open("w") as log:
        folder = Path(directory)
        with (folder / "messages").open("w") as messages:
            walk = Commission(arguments.program.resolve(), messages, log)
            try:
                walk.run_all(folder)
            finally:
                print(f"the telegrams are in {arguments.log}")
                print(f"{walk.passed} passed, {walk.failed} failed")
    return 1 if walk.failed else 0


if __name__ == "__main__":
    sys.exit(main())
