// The modules of the page that need no document, by node's test runner: node --test strangers/page

import assert from "node:assert/strict";
import { test } from "node:test";

const page = "../../host/dashboard/page";
const units = await import(`${page}/units.js`);
const { mergePatch } = await import(`${page}/state.js`);
const { History, extremes } = await import(`${page}/history.js`);
const { angles } = await import(`${page}/dial.js`);
const { TurnSender } = await import(`${page}/turning.js`);
const { encoderAt, linkTo } = await import(`${page}/routes.js`);
const { matches } = await import(`${page}/trace.js`);

test("numbers are read as people and manuals write them", () => {
  for (const text of ["921600", "0xE1000", "0Xe1000", "E1000h", "e1000H", "921 600"]) {
    assert.equal(units.parseWhole(text), 921600, text);
  }
  assert.equal(units.parseWhole("-4000"), -4000);
  for (const text of ["", "h", "0x", "+1", "1.5", "E1000", "hh", "14 x"]) {
    assert.equal(units.parseWhole(text), null, text);
  }
});

test("a number is two words, as the manual splits 921600", () => {
  assert.deepEqual(units.splitWords(921600), { hi: 14, lo: 4096 });
  assert.equal(units.joinWords(14, 4096), 921600);
  assert.deepEqual(units.splitWords(-1), { hi: 65535, lo: 65535 });
  assert.equal(units.splitWords(2 ** 32), null);
  assert.equal(units.joinWords(65536, 0), null);
});

test("an angle is never 360 degrees", () => {
  assert.equal(units.degrees(0.99999), "359.9°");
  assert.equal(units.degrees(1), "0.0°");
  assert.equal(units.degrees(0.25), "90.0°");
  assert.equal(units.degrees(undefined), units.NOTHING);
});

test("a minus is a minus, and zero has none", () => {
  assert.equal(units.whole(-1234), "\u22121\u202f234");
  assert.equal(units.fixed(-0.01, 1), "0.0");
  assert.equal(units.fixed(-750, 1), "\u2212750.0");
});

test("a time has hours only where there are some", () => {
  assert.equal(units.clock(67.25, 2), "1:07.25");
  assert.equal(units.clock(3605), "1:00:05");
  assert.equal(units.clock(null), units.NOTHING);
});

test("a merge patch changes what it names, and null takes away", () => {
  const state = {
    at: 1,
    buses: { line: { load: 0.5, devices: { drive: { faults: ["stuck"], alarm: true } } } },
  };
  mergePatch(state, {
    at: 2,
    buses: { line: { load: null, devices: { drive: { faults: [], alarm: false } } } },
  });
  assert.deepEqual(state, {
    at: 2,
    buses: { line: { devices: { drive: { faults: [], alarm: false } } } },
  });
  mergePatch(state, { buses: { field: { load: 0.1 } } });
  assert.equal(state.buses.field.load, 0.1);
});

test("a history keeps a minute, and what held when it began", () => {
  const history = new History();
  for (let at = 0; at <= 100; at += 0.5) {
    history.push(at, { power: true, position: at * 10, rpm: 1, master: { position: at } });
  }
  const samples = history.last(100, "position");
  assert.equal(samples.at(-1).value, 1000);
  assert.ok(samples[0].at <= 40 && samples[1].at >= 40);
  assert.deepEqual(extremes(history.last(100, "polled")), { min: 39.5, max: 100, now: 100 });
  // However often it is told.
  for (let at = 101; at <= 201; at += 0.05) history.push(at, { power: true, position: at });
  assert.ok(history.last(201, "position")[0].at <= 141.1);
  history.push(202, { power: false });
  assert.equal(extremes(history.last(202, "position")).now, null);
});

test("a plant that starts anew has a history of its own", () => {
  const history = new History();
  history.push(50, { power: true, position: 7 });
  history.push(0.5, { power: true, position: 8 });
  assert.deepEqual(history.last(1, "position"), [{ at: 0.5, value: 8 }]);
});

test("the mark of position 0 stands still while the shaft turns, whatever the direction", () => {
  const at = (code, direction) => {
    const unwrapped = direction === "CW" ? code : -code;
    const position = (((unwrapped + 2048) % 8192) + 8192) % 8192;
    return angles(
      {
        power: true,
        code,
        direction,
        offset: 2048,
        steps_per_turn: 8192,
        total_resolution: 8192,
        angle: position / 8192,
        rpm: 60,
      },
      { steps: 8192 },
    );
  };
  for (const direction of ["CW", "CCW"]) {
    const zero = direction === "CW" ? 0.75 : 0.25;
    for (const code of [0, 1000, 8191]) assert.equal(at(code, direction).zero, zero, direction);
    // Where the shaft stands on the mark the position is 0.
    assert.equal(at(zero * 8192, direction).shaft, zero);
  }
  assert.equal(at(0, "CCW").speed, -60);
});

test("turns add up to whole steps, one command at a time", async () => {
  const sent = [];
  const sender = new TurnSender(8192, async (by) => sent.push(by));
  sender.turn(0.25);
  for (let drag = 0; drag < 1000; drag += 1) sender.turn(0.001);
  await new Promise((resolve) => setTimeout(resolve, 150));
  assert.deepEqual(sent, [2048, 8192]);
});

test("an address names an encoder, whatever is in its name", () => {
  const plant = { buses: [{ id: "a/b", devices: [{ id: "ü 1" }] }] };
  const found = encoderAt(plant, linkTo({ bus: "a/b", device: "ü 1" }));
  assert.deepEqual(found.place, { bus: "a/b", device: "ü 1" });
  for (const hash of ["", "#/", "#/a%2Fb", "#/a%2Fb/none", "#/%/x"])
    assert.equal(encoderAt(plant, hash), null);
});

test("a filter takes words, and leaves out those behind a minus", () => {
  const line = {
    from: "5",
    to: null,
    name: "poll response",
    text: "position 4096",
    octets: "00 10",
  };
  assert.ok(matches(line, ["poll", "4096"]));
  assert.ok(!matches(line, ["poll", "-response"]));
  assert.ok(matches(line, []));
});
