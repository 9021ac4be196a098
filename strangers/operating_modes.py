"""Chapter 3 of the manual: operating modes. No script: see `devicenet_chapters.py`."""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable
from functools import partial

import devicenet_master as book
from devicenet_master import Frame
from steps import Wrong, expect, expect_within
from walkthrough import (
    ACKNOWLEDGE_HANDLER,
    CONFIGURING,
    CONNECTION,
    COS_CONNECTION,
    COS_DELTA,
    DEFAULT_TOTAL,
    DEVICENET,
    DIRECTION,
    ENCODER,
    ESTABLISHED,
    EXPECTED_PACKET_RATE,
    EXPLICIT_CONNECTION,
    IDENTITY,
    INHIBIT_TIME,
    POLL_CONNECTION,
    PRESET,
    STEPS,
    TIMED_OUT,
    TOTAL,
    Walk,
    expect_refusal,
    uint,
    unsigned,
)

COS = book.CHANGE_OF_STATE
CYCLIC = book.CYCLIC
UNACKNOWLEDGED = book.UNACKNOWLEDGED
# Acknowledge handler
ACKNOWLEDGE_TIMER, RETRY_LIMIT, PRODUCING_INSTANCE = 1, 2, 3


def gaps(frames: list[Frame]) -> list[float]:
    """Milliseconds between neighbours."""
    return [1000 * (after.at - before.at) for before, after in itertools.pairwise(frames)]


def positions(frames: list[Frame]) -> list[int]:
    """What assembly 1 carries."""
    return [unsigned(frame.data, 4) for frame in frames]


def steps_between(frames: list[Frame], total: int) -> list[int]:
    """How far the position grew from each to the next."""
    return [(after - before) % total for before, after in itertools.pairwise(positions(frames))]


class OperatingModes(Walk):
    """Chapter 3. Those named `on_a_turning_shaft` want 60 rpm, all others a shaft at rest."""

    # --- Small things

    def produce(self, milliseconds: int) -> None:
        """Establishes connection 4."""
        self.set_packet_rate(COS_CONNECTION, milliseconds)

    def expect_count(self, what: str, frames: list[Frame], wanted: int) -> None:
        """Compares a number of frames, and shows them where it differs."""
        if len(frames) != wanted:
            begin = frames[0].at if frames else 0
            seen = ", ".join(f"{frame} at {1000 * (frame.at - begin):.0f} ms" for frame in frames)
            raise Wrong(f"{what}: expected {wanted} frames, got {len(frames)}: {seen or 'none'}")

    def set_handler(self, timer: int, limit: int) -> None:
        """Sets acknowledge timer and retry limit."""
        granted = self.master.set(ACKNOWLEDGE_HANDLER, 1, ACKNOWLEDGE_TIMER, uint(timer))
        expect("acknowledge timer granted", unsigned(granted, 2), timer)
        answer = self.master.set(ACKNOWLEDGE_HANDLER, 1, RETRY_LIMIT, bytes([limit]))
        expect("data in the response", answer, b"")

    def handler(self) -> tuple[int, int]:
        """Acknowledge timer and retry limit."""
        timer = self.master.get(ACKNOWLEDGE_HANDLER, 1, ACKNOWLEDGE_TIMER)
        limit = self.master.get(ACKNOWLEDGE_HANDLER, 1, RETRY_LIMIT)
        return unsigned(timer, 2), unsigned(limit, 1)

    # --- Allocation

    def refuses_choices_in_the_order_of_the_book(self) -> str:
        seen = []
        for choice, status, additional, why in [
            (0x00, 0x09, 0x02, "nothing"),
            (0x41, 0x09, 0x02, "suppression without COS or cyclic"),
            (0x43, 0x09, 0x02, "suppression with poll only"),
            (0x45, 0x09, 0x02, "suppression before bit-strobe"),
            (0xC1, 0x09, 0x02, "suppression before the reserved bit"),
            (0x11 | 0x04, 0x02, 0x02, "bit-strobe"),
            (0x11 | 0x08, 0x02, 0x02, "multicast poll"),
            (0x11 | 0x80, 0x02, 0x02, "reserved bit"),
            (0x34, 0x02, 0x02, "bit-strobe before COS and cyclic without explicit"),
            (0x10, 0x09, 0x02, "COS without explicit"),
            (0x50, 0x09, 0x02, "unacknowledged COS without explicit"),
            (0x20, 0x09, 0x02, "cyclic without explicit"),
            (0x30, 0x09, 0x02, "COS and cyclic without explicit"),
            (0x31, 0x09, 0x02, "COS and cyclic"),
            (0x73, 0x09, 0x02, "COS and cyclic, unacknowledged, with poll"),
        ]:
            self.refuse(partial(self.master.allocate, choice), choice, status, additional, why)
            seen.append(f"{choice:02X}")
        self.master.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]), 0.3)
        return f"{', '.join(seen)}, and nothing was allocated"

    def refuse(
        self, action: Callable[[], object], choice: int, status: int, additional: int, why: str
    ) -> None:
        """A choice that must be refused."""
        try:
            expect_refusal(action, status, additional)
        except Wrong as wrong:
            raise Wrong(f"choice {choice:02X} ({why}): {wrong}") from None

    def refuses_what_is_already_allocated(self) -> str:
        with self.connections(COS):
            for choice, status, additional, why in [
                (0x10, 0x0B, 0x02, "COS again"),
                (0x01, 0x0B, 0x02, "explicit again"),
                (0x12, 0x0B, 0x02, "poll with COS again"),
                (0x20, 0x0B, 0x02, "cyclic on the instance of COS"),
                (0x30, 0x09, 0x02, "COS and cyclic before already allocated"),
                (0x14, 0x02, 0x02, "bit-strobe before already allocated"),
            ]:
                self.refuse(partial(self.master.allocate, choice), choice, status, additional, why)
            get = partial(self.master.get, CONNECTION, POLL_CONNECTION, 1)
            expect_refusal(get, 0x16)
            for choice in (0x00, 0x31, 0x41, 0x90, 0x10, 0x02):
                allocate = partial(self.stranger.allocate, choice)
                self.refuse(allocate, choice, 0x0C, 0x01, "by another master")
            for choice, status, additional, why in [
                (0x00, 0x09, 0x02, "release of nothing"),
                (0x04, 0x02, 0x02, "release of bit-strobe"),
                (0x02, 0x0B, 0x02, "release of a poll that is not there"),
            ]:
                self.refuse(partial(self.master.release, choice), choice, status, additional, why)
            release = partial(self.stranger.release, COS)
            self.refuse(release, COS, 0x0C, 0x01, "release by a stranger")
            owner = self.master.get(DEVICENET, 1, 5)
            expect("allocation information", owner, bytes([0x11, self.master.own]))
        return "0B/02 for explicit, COS, cyclic; strangers 0C/01 first; allocation stays 11"

    def forgets_a_master_that_established_nothing(self) -> str:
        self.master.allocate(book.EXPLICIT | COS)
        self.master.release(book.EXPLICIT)
        self.stranger.allocate(book.EXPLICIT)
        owner = self.stranger.get(DEVICENET, 1, 5)
        expect("allocation information", owner, bytes([book.EXPLICIT, self.stranger.own]))
        expect_refusal(lambda: self.stranger.get(CONNECTION, COS_CONNECTION, 1), 0x16)
        self.stranger.release(book.EXPLICIT)
        return "COS that only configured went with the explicit connection; another master may come"

    # --- Change of state, not acknowledged

    def produces_every_delta_on_a_turning_shaft(self) -> str:
        seen = []
        with self.connections(COS | UNACKNOWLEDGED):
            for delta in (500, 2000):
                self.put(COS_DELTA, delta)
                self.produce(10_000)
                moved = steps_between(self.master.listen(2.0), DEFAULT_TOTAL)[1:]
                if not moved or min(moved) < delta:
                    raise Wrong(f"COS delta {delta}: the position moved by {moved}")
                middle = statistics.median(moved)
                expect_within(f"steps with delta {delta}", middle, delta, delta + 80)
                due = 2.0 * STEPS / delta
                expect_within("productions in 2 s", len(moved) + 2, due * 0.8, due + 2)
                seen.append(f"delta {delta}: {len(moved)} gaps of {min(moved)} … {max(moved)}")
        return "; ".join(seen)

    def produces_every_delta_the_other_way_on_a_turning_shaft(self) -> str:
        with self.connections(COS | UNACKNOWLEDGED):
            self.master.set(ENCODER, 1, DIRECTION, b"\x01")
            self.put(COS_DELTA, 1000)
            self.produce(10_000)
            moved = [-(-step % DEFAULT_TOTAL) for step in self.steps(1.5)]
            self.encoder_service(book.RESET)
        expect_within("steps, the nearest", max(moved), -1080, -1000)
        expect_within("steps, the median", statistics.median(moved), -1080, -1000)
        return f"{len(moved)} gaps of {max(moved)} … {min(moved)}"

    def steps(self, seconds: float) -> list[int]:
        """How far the position moved between the productions of a while."""
        found = steps_between(self.master.listen(seconds), DEFAULT_TOTAL)
        if not found:
            raise Wrong(f"fewer than two productions in {seconds:g} s")
        return found

    def knows_deltas_of_a_whole_range_on_a_turning_shaft(self) -> str:
        seen = []
        with self.connections(COS | UNACKNOWLEDGED):
            for delta in (900, 1000):
                self.put(TOTAL, 1000)
                self.put(COS_DELTA, delta)
                self.produce(10_000)
                frames = self.master.listen(1.5)
                apart = statistics.median(gaps(frames)[1:])
                due = 1000 * delta / STEPS
                expect_within(f"ms between productions, delta {delta}", apart, due - 3, due + 12)
                seen.append(f"delta {delta}: every {apart:.1f} ms")
            self.encoder_service(book.RESET)
        return f"range 1000, {', '.join(seen)}"

    def keeps_the_inhibit_time_on_a_turning_shaft(self) -> str:
        with self.connections(COS | UNACKNOWLEDGED):

            def inhibit(milliseconds: int) -> bytes:
                time_ = uint(milliseconds)
                return self.master.set(CONNECTION, COS_CONNECTION, INHIBIT_TIME, time_)

            expect("inhibit time granted", inhibit(100), uint(100))
            expect_refusal(lambda: self.produce(50), 0x09, 0x11)
            rate = self.master.get(CONNECTION, COS_CONNECTION, EXPECTED_PACKET_RATE)
            expect("packet rate after the refusal", rate, uint(0))
            expect("state", self.connection_state(COS_CONNECTION), CONFIGURING)
            self.produce(1000)
            frames = self.master.listen(2.5)
            expect_refusal(lambda: inhibit(10), 0x0C)
        apart = gaps(frames)
        expect_within("ms between productions, the median", statistics.median(apart), 98, 115)
        expect_within("ms between productions, the mean", statistics.mean(apart), 99, 120)
        return (
            f"100 ms: {len(apart)} gaps of {min(apart):.1f} … {max(apart):.1f} ms, "
            f"median {statistics.median(apart):.1f}; rate 50 ms below it 09/11; established 0C"
        )

    def produces_only_by_the_packet_rate_at_rest(self) -> str:
        with self.connections(COS | UNACKNOWLEDGED):
            self.produce(300)
            frames = self.master.listen(2.0)
            apart = gaps(frames)
            self.expect_count("at once and every 300 ms of 2 s", frames, 7)
            expect_within("ms between productions", statistics.median(apart), 295, 310)
            expect("positions", set(positions(frames)), {self.number(12)})
            self.produce(0)
            time.sleep(0.1)
            self.master.forget()
            self.expect_count("with packet rate 0, in 1.5 s", self.master.listen(1.5), 0)
        return f"{len(apart)} gaps, median {statistics.median(apart):.1f} ms; rate 0: silence"

    def restarts_the_packet_rate_with_each_production(self) -> str:
        with self.connections(COS | UNACKNOWLEDGED):
            self.produce(800)
            first = self.master.listen(0.4)
            self.expect_count("at once", first, 1)
            self.put(PRESET, 4711)
            after = self.master.listen(1.0)
            self.expect_count("after a preset half-way", after, 2)
            expect("positions", positions(after), [4711, 4711])
            apart = gaps(after)[0]
            expect_within("ms from the preset to the next", apart, 780, 850)
            self.encoder_service(book.RESET)
        return f"preset 400 ms into a rate of 800 ms: at once, then {apart:.0f} ms later"

    def produces_after_a_real_change_of_settings(self) -> str:
        with self.connections(COS | UNACKNOWLEDGED):
            self.produce(0)
            self.expect_count("on becoming established", self.master.listen(0.3), 1)
            seen = []
            for what, attribute, octets, wanted in [
                ("CCW", DIRECTION, b"\x01", 1),
                ("CCW again", DIRECTION, b"\x01", 0),
                ("total 1000", TOTAL, (1000).to_bytes(4, "little"), 1),
                ("total 1000 again", TOTAL, (1000).to_bytes(4, "little"), 0),
                ("preset 7", PRESET, (7).to_bytes(4, "little"), 1),
                ("preset 8", PRESET, (8).to_bytes(4, "little"), 1),
            ]:
                self.master.set(ENCODER, 1, attribute, octets)
                frames = self.master.listen(0.3)
                self.expect_count(what, frames, wanted)
                if frames:
                    expect(f"position after {what}", positions(frames), [self.number(12)])
                seen.append(f"{what} {wanted}")
            self.encoder_service(book.RESET)
        return ", ".join(seen)

    def produces_nothing_where_nothing_changes(self) -> str:
        with self.connections(COS | UNACKNOWLEDGED):
            self.encoder_service(book.RESET)
            self.produce(0)
            self.expect_count("on becoming established", self.master.listen(0.3), 1)
            before = self.settings()
            for service, what in [(book.RESET, "Reset"), (book.RESTORE, "Restore")]:
                self.encoder_service(service)
                frames = self.master.listen(0.3)
                expect(f"settings after {what}", self.settings(), before)
                self.expect_count(f"after a {what} that changed no setting", frames, 0)
        return "no production for Reset and Restore of settings that are in force already"

    def never_times_out_without_acknowledge(self) -> str:
        with self.connections(COS | UNACKNOWLEDGED):
            # Of the first time-out of 10 s nothing is left when the rate is set once more.
            self.produce(100)
            self.produce(100)
            frames = self.master.listen(2.5)
            state = self.connection_state(COS_CONNECTION)
            expect("state after 25 packet rates", state, ESTABLISHED)
            if len(frames) < 20:
                raise Wrong(f"only {len(frames)} productions in 2.5 s")
            # A stray acknowledge must not harm it.
            self.master.acknowledge()
            expect("state", self.connection_state(COS_CONNECTION), ESTABLISHED)
        return f"{len(frames)} productions in 2.5 s of a rate of 100 ms, still established"

    # --- Cyclic

    def beats_in_the_time_set(self) -> str:
        seen = []
        with self.connections(CYCLIC | UNACKNOWLEDGED):
            for rate, seconds, tolerance in [(20, 2.0, 1.0), (250, 2.0, 5.0)]:
                self.produce(rate)
                frames = self.master.listen(seconds)[1:]
                apart = gaps(frames)
                middle = statistics.median(apart)
                expect_within("median beat in ms", middle, rate - tolerance, rate + tolerance)
                mean = statistics.mean(apart)
                expect_within("mean beat in ms", mean, rate - tolerance, rate * 1.05 + 1)
                seen.append(f"{rate} ms: {len(apart)} beats, median {middle:.2f}, mean {mean:.2f}")
        return "; ".join(seen)

    def beats_whatever_the_delta_on_a_turning_shaft(self) -> str:
        with self.connections(CYCLIC | UNACKNOWLEDGED):
            self.put(COS_DELTA, 100_000)
            self.produce(50)
            frames = self.master.listen(1.5)[1:]
            self.encoder_service(book.RESET)
        middle = statistics.median(gaps(frames))
        expect_within("median beat in ms", middle, 49, 51)
        moved = statistics.median(steps_between(frames, DEFAULT_TOTAL))
        expect_within("steps in a beat", moved, 0.05 * STEPS * 0.95, 0.05 * STEPS * 1.05)
        return f"COS delta 100000: {len(frames)} beats of {middle:.2f} ms, {moved:.0f} steps each"

    def takes_1_to_65535_ms(self) -> str:
        with self.connections(CYCLIC | UNACKNOWLEDGED):
            self.produce(65_535)
            # Where the first was not sent at once, the rate is what is tested here.
            self.master.listen(0.1)
            self.expect_count("in 1 s of a beat of 65535 ms", self.master.listen(1.0), 0)
            self.produce(1)
            frames = self.master.listen(1.0)
        if len(frames) < 200:
            raise Wrong(f"a beat of 1 ms: only {len(frames)} frames in 1 s")
        return f"65535 ms granted and silent; 1 ms granted, {len(frames)} frames in 1 s"

    # --- With acknowledge

    def goes_on_when_acknowledged_on_a_turning_shaft(self) -> str:
        with self.connections(COS):
            self.set_handler(timer=100, limit=1)
            self.put(COS_DELTA, 1000)
            self.produce(500)
            moved = steps_between(self.master.listen(3.0, acknowledge=True), DEFAULT_TOTAL)
            state = self.connection_state(COS_CONNECTION)
            expect("state", state, ESTABLISHED)
            self.encoder_service(book.RESET)
        if min(moved) < 1000:
            raise Wrong(f"repeated although acknowledged: the position moved by {moved}")
        return f"{len(moved)} gaps of {min(moved)} … {max(moved)}, each acknowledged"

    def repeats_with_the_newest_position_on_a_turning_shaft(self) -> str:
        with self.connections(COS):
            self.put(COS_DELTA, 4000)
            self.produce(10_000)
            moved = steps_between(self.master.listen(2.2), DEFAULT_TOTAL)
            self.encoder_service(book.RESET)
        repeats, changes = moved[0::2], moved[1::2]
        if len(changes) < 2:
            raise Wrong(f"too few productions: the position moved by {moved}")
        expect_within("steps until a repeat", statistics.median(repeats), 80, 300)
        expect_within("steps until the next change, least", min(changes), 4000, 4200)
        return f"repeats after {repeats} steps, changes after {changes}"

    def repeats_once_after_16_ms_without_acknowledge(self) -> str:
        apart = []
        with self.connections(COS):
            expect("acknowledge timer and retry limit", self.handler(), (16, 1))
            self.produce(10_000)
            self.expect_count(
                "on becoming established, not acknowledged", self.master.listen(0.5), 2
            )
            for value in range(1000, 1007):
                self.put(PRESET, value)
                frames = self.master.listen(0.3)
                self.expect_count("after a preset, not acknowledged", frames, 2)
                expect("positions", positions(frames), [value, value])
                apart += gaps(frames)
            self.expect_count("until the next change", self.master.listen(1.0), 0)
            self.encoder_service(book.RESET)
        middle = statistics.median(apart)
        expect_within("ms until the repeat", middle, 14.5, 20)
        return f"seven presets: twice each, median {middle:.1f} ms apart, then silence"

    def takes_an_empty_frame_for_acknowledge_and_no_other(self) -> str:
        with self.connections(COS):
            self.set_handler(timer=120, limit=1)
            self.produce(10_000)
            frames = self.master.listen(0.4, acknowledge=True)
            self.expect_count("acknowledged", frames, 1)
            self.put(PRESET, 5)
            self.expect_count("acknowledged", self.master.listen(0.4, acknowledge=True), 1)
            self.put(PRESET, 6)
            first = self.master.listen(0.05)
            self.master.acknowledge(b"\x00")
            self.expect_count(
                "after an acknowledge of one octet", first + self.master.listen(0.4), 2
            )
            self.encoder_service(book.RESET)
        return "empty: one production; one octet: repeated"

    def repeats_in_spite_of_the_inhibit_time_on_a_turning_shaft(self) -> str:
        with self.connections(COS):
            granted = self.master.set(CONNECTION, COS_CONNECTION, INHIBIT_TIME, uint(400))
            expect("inhibit time granted", granted, uint(400))
            self.produce(10_000)
            frames = self.master.listen(3.0)
        # Each production, its repeat, and the next one when the inhibit time is over.
        if len(frames) < 6:
            raise Wrong(f"only {len(frames)} productions in 3 s")
        repeats, others = gaps(frames)[0::2], gaps(frames[0::2])
        expect_within("ms until a repeat, the median", statistics.median(repeats), 14.5, 22)
        expect_within("ms between changes, the median", statistics.median(others), 398, 440)
        return (
            f"inhibit time 400 ms: repeated after {statistics.median(repeats):.1f} ms, "
            f"the next change {statistics.median(others):.1f} ms after the last one"
        )

    def obeys_the_acknowledge_handler(self) -> str:
        def get(attribute: int) -> bytes:
            return self.master.get(ACKNOWLEDGE_HANDLER, 1, attribute)

        with self.connections(COS):
            expect("producing instance", get(PRODUCING_INSTANCE), uint(4))

            def put(attribute: int, octets: bytes) -> Callable[[], bytes]:
                return partial(self.master.set, ACKNOWLEDGE_HANDLER, 1, attribute, octets)

            expect_refusal(put(ACKNOWLEDGE_TIMER, uint(0)), 0x09)
            expect_refusal(put(ACKNOWLEDGE_TIMER, b"\x01"), 0x13)
            expect_refusal(put(ACKNOWLEDGE_TIMER, bytes(3)), 0x15)
            expect_refusal(put(PRODUCING_INSTANCE, uint(2)), 0x0E)
            expect_refusal(partial(get, 4), 0x14)
            expect("after the refusals", self.handler(), (16, 1))
            self.set_handler(timer=60, limit=3)
            self.produce(10_000)
            frames = self.master.listen(0.8)
            self.expect_count("retry limit 3", frames, 4)
            apart = statistics.median(gaps(frames))
            expect_within("ms between repeats", apart, 58, 70)
            self.set_handler(timer=60, limit=0)
            self.put(PRESET, 9)
            self.expect_count("retry limit 0", self.master.listen(0.4), 1)
            self.encoder_service(book.RESET)
        with self.connections(COS):
            expect("timer and limit when allocated anew", self.handler(), (16, 1))
        return f"60 ms and 3: four times, {apart:.1f} ms apart; limit 0: once; anew 16 and 1"

    def beats_with_acknowledge(self) -> str:
        with self.connections(CYCLIC):
            self.set_handler(timer=80, limit=1)
            self.produce(200)
            acked = self.master.listen(1.5, acknowledge=True)
            middle = statistics.median(gaps(acked))
            expect_within("median beat in ms, acknowledged", middle, 195, 205)
            lonely = self.master.listen(0.7)
            between = gaps(lonely)
            if len(lonely) < 4:
                raise Wrong(f"without acknowledge {len(lonely)} frames in 0.7 s, not twice a beat")
            expect_within("ms until a repeat", min(between), 70, 100)
        return f"beat {middle:.1f} ms; without acknowledge each again {min(between):.0f} ms later"

    def times_out_without_acknowledge(self) -> str:
        with self.connections(COS):
            self.produce(500)
            frames = self.master.listen(0.2, acknowledge=True)
            if not frames:
                raise Wrong("nothing was produced on becoming established")
            at = frames[-1].at
            self.expect_state_at(at + 1.6, ESTABLISHED)
            self.expect_state_at(at + 2.4, TIMED_OUT)
            self.expect_count("when timed out, in 1.2 s", self.master.listen(1.2), 0)
            answer = self.master.service(book.RESET, CONNECTION, COS_CONNECTION)
            expect("data in the response to Reset", answer, b"")
            at = time.time()
            frames = self.master.listen(0.3)
            if not frames:
                raise Wrong("nothing was produced on Reset of the timed-out connection")
            self.expect_state_at(at + 1.6, ESTABLISHED)
            self.expect_state_at(at + 2.4, TIMED_OUT)
        return "2 s after the acknowledge; Reset produces at once and gives 2 s again"

    def gives_ten_seconds_for_the_first_acknowledge(self) -> str:
        frames = self.frames_until_time_out(rate=500, seconds=10.0)
        if not 36 <= len(frames) <= 40:
            raise Wrong(f"some 19 packet rates, twice each: got {len(frames)} frames")
        return f"rate 500 ms: established after 9.6 s with {len(frames)} frames, gone after 10.5 s"

    def gives_four_packet_rates_where_they_are_longer_for_the_first_acknowledge(self) -> str:
        frames = self.frames_until_time_out(rate=2800, seconds=11.2)
        return (
            f"rate 2800 ms: established after 10.8 s with {len(frames)} frames, gone after 11.7 s"
        )

    def frames_until_time_out(self, rate: int, seconds: float) -> list[Frame]:
        """Never acknowledges: what was produced until shortly before connection 4 times out."""
        with self.connections(COS):
            self.produce(rate)
            at = time.time()
            frames = self.master.listen(seconds - 0.5)
            self.expect_state_at(at + seconds - 0.4, ESTABLISHED)
            self.expect_state_at(at + seconds + 0.5, TIMED_OUT)
            self.expect_count("when timed out, in 0.8 s", self.master.listen(0.8), 0)
            # A timed-out connection may be allocated anew.
            self.master.allocate(COS)
            expect("state when allocated anew", self.connection_state(COS_CONNECTION), CONFIGURING)
        return frames

    def outlives_the_explicit_connection(self) -> str:
        master = self.master
        master.allocate(book.EXPLICIT | COS | UNACKNOWLEDGED)
        self.produce(100)
        # The explicit connection times out after 4 x 100 ms, and deletes itself.
        self.set_packet_rate(EXPLICIT_CONNECTION, 100)
        frames = master.listen(2.0)
        if len(frames) < 16:
            raise Wrong(f"only {len(frames)} productions in 2 s when explicit timed out")
        master.expect_no_response(bytes([book.GET, IDENTITY, 1, 1]), 0.3)
        expect_refusal(lambda: self.stranger.allocate(book.EXPLICIT), 0x0C, 0x01)
        master.allocate(book.EXPLICIT)
        expect("state", self.connection_state(COS_CONNECTION), ESTABLISHED)
        master.release(COS)
        master.release(book.EXPLICIT)
        return f"{len(frames)} productions in 2 s, still the master's own, explicit comes anew"

    def is_free_when_the_last_connection_timed_out(self) -> str:
        master = self.master
        master.allocate(book.EXPLICIT | COS)
        self.produce(100)
        if not master.listen(0.3, acknowledge=True):
            raise Wrong("nothing was produced on becoming established")
        self.set_packet_rate(EXPLICIT_CONNECTION, 100)
        time.sleep(1.0)
        self.stranger.allocate(book.EXPLICIT)
        owner = self.stranger.get(DEVICENET, 1, 5)
        expect("allocation information", owner, bytes([book.EXPLICIT, self.stranger.own]))
        expect_refusal(lambda: self.stranger.get(CONNECTION, COS_CONNECTION, 1), 0x16)
        self.stranger.release(book.EXPLICIT)
        return "explicit and COS timed out; another master allocates 1 s later"

    def expect_state_at(self, moment: float, wanted: int) -> None:
        """Waits, and compares the state of connection 4."""
        time.sleep(max(0.0, moment - time.time()))
        state = self.connection_state(COS_CONNECTION)
        expect("state of connection 4", state, wanted)

    # --- Poll

    def polls_and_produces_at_the_same_time_on_a_turning_shaft(self) -> str:
        with self.connections(book.POLL | COS | UNACKNOWLEDGED):
            self.put(COS_DELTA, 1000)
            before = len(self.wire.seen)
            self.produce(10_000)
            self.set_packet_rate(POLL_CONNECTION, 1000)
            polled = []
            for _ in range(20):
                polled.append(self.master.poll())
                time.sleep(0.08)
            identifier = book.change_of_state_identifier(self.master.slave)
            produced = [
                frame for frame in self.wire.seen[before:] if frame.identifier == identifier
            ]
            for instance in (POLL_CONNECTION, COS_CONNECTION):
                expect(f"state of {instance}", self.connection_state(instance), ESTABLISHED)
            self.master.release(COS)
            self.expect_count("after the release of COS", self.master.listen(0.5), 0)
            self.master.poll()
            self.encoder_service(book.RESET)
        moved = steps_between(produced, DEFAULT_TOTAL)
        if len(moved) < 10 or min(moved) < 1000:
            raise Wrong(f"the position moved by {moved} between productions")
        both = sorted(polled + produced, key=lambda frame: frame.at)
        back = [step for step in steps_between(both, DEFAULT_TOTAL) if step > STEPS]
        if back:
            raise Wrong(f"the position ran back between poll and COS: {positions(both)}")
        return (
            f"{len(polled)} polls and {len(moved)} deltas in between, all in one rising line; "
            "COS released: silence, polls go on"
        )

    def answers_a_poll_before_the_rate_is_set_never(self) -> str:
        with self.connections(book.POLL):
            self.master.expect_no_poll_response(seconds=0.3)
            self.set_packet_rate(POLL_CONNECTION, 1000)
            size = len(self.master.poll().data)
            expect("octets", size, 4)
        return "configuring: silence; established: four octets"
