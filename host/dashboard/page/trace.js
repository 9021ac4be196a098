/** @file The live trace of a bus, decoded: only while somebody listens. */

import { element, freshId, setAttribute, setText } from "./dom.js";
import { button, panel } from "./panel.js";
import { clock, whole } from "./units.js";

/** Lines that are kept, and lines that are drawn while the trace runs. */
const [KEPT, DRAWN] = [2000, 40];
const PERIOD = 100;

/**
 * Whether a line has all words of a filter, and none that begins with a minus.
 * @param {{from: string, to: string, name: string, text: string, octets: string}} line
 * @param {string[]} words in lower case
 */
export function matches(line, words) {
  const text = [line.from, line.to, line.identifier, line.name, line.text, line.octets]
    .join(" ")
    .toLowerCase();
  return words.every((word) =>
    word.startsWith("-") && word.length > 1 ? !text.includes(word.slice(1)) : text.includes(word),
  );
}

/** The panel of the trace of a bus, at first for one device. */
export function createTrace(bus, device, live) {
  const lines = [];
  let [lost, drawn, dirty, listening, paused] = [0, 0, true, false, false];
  const [findId, ownId] = [freshId("trace"), freshId("trace")];
  const find = element("input", {
    type: "search",
    id: findId,
    placeholder: "response -acknowledge",
  });
  const own = element("input", { type: "checkbox", id: ownId, checked: true });
  const touch = () => (dirty = true);
  find.addEventListener("input", touch);
  own.addEventListener("change", touch);

  const listen = button(
    "Listen",
    () => {
      listening = !listening;
      live.want({ trace: listening ? bus : null });
      show();
    },
    { "aria-pressed": "false" },
  );
  const pause = button(
    "Pause",
    () => {
      paused = !paused;
      show();
    },
    { "aria-pressed": "false", hidden: true },
  );
  const clear = button(
    "Clear",
    () => {
      lines.length = lost = 0;
      touch();
    },
    { hidden: true },
  );
  const counted = element("p", { class: "hint" });
  const rows = [];
  const rowsSeat = element("tbody");
  const head = ["time", "from", "to", "what", "says", "octets"].map((name) =>
    element("th", { scope: "col" }, name),
  );
  const table = element(
    "table",
    { class: "trace-table" },
    element("caption", { class: "unseen" }, "Traffic of the bus, newest first"),
    element("thead", {}, element("tr", {}, ...head)),
    rowsSeat,
  );
  const seat = element(
    "div",
    { class: "scroll", tabindex: 0, role: "group", "aria-label": "Trace", hidden: true },
    table,
  );
  const { root, body } = panel("Trace", "trace", pause, clear, listen);
  body.append(
    element(
      "div",
      { class: "filter" },
      element("label", { for: findId }, "Filter"),
      find,
      element(
        "span",
        { class: "tick" },
        own,
        element("label", { for: ownId }, `only ${device.id}`),
      ),
    ),
    counted,
    seat,
  );

  function show() {
    setText(listen, listening ? "Stop" : "Listen");
    setAttribute(listen, "aria-pressed", String(listening));
    setText(pause, paused ? "Go on" : "Pause");
    setAttribute(pause, "aria-pressed", String(paused));
    setAttribute(pause, "hidden", !listening);
    setAttribute(clear, "hidden", !listening && lines.length === 0);
    setAttribute(seat, "hidden", !listening && lines.length === 0);
    touch();
  }
  const take = ({ detail }) => {
    if (paused) return;
    lines.push(...detail.lines);
    if (lines.length > KEPT) lines.splice(0, lines.length - KEPT);
    lost += detail.lost;
    touch();
  };
  live.addEventListener("trace", take);
  show();

  return {
    root,
    /** Draws the newest lines, at most ten times a second. */
    frame(now) {
      if (!dirty || now - drawn < PERIOD) return;
      dirty = false;
      drawn = now;
      const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
      const address = own.checked
        ? String(live.device({ bus, device: device.id })?.address ?? "")
        : null;
      // Who pauses wants to read all that is there.
      const shown = newest(lines, words, address, paused || !listening ? KEPT : DRAWN);
      fill(rowsSeat, rows, shown);
      setText(counted, told({ listening, paused, count: lines.length, shown: shown.length, lost }));
    },
    close() {
      live.removeEventListener("trace", take);
      live.want({ trace: null });
    },
  };
}

function told({ listening, paused, count, shown, lost }) {
  if (!listening && count === 0) return "Nothing is recorded until you listen.";
  const parts = [`${whole(count)} lines kept`, `${whole(shown)} shown`];
  if (lost > 0) parts.push(`${whole(lost)} lost, the bus was faster`);
  if (paused) parts.push("paused");
  return `${parts.join(", ")}.`;
}

function newest(lines, words, address, most) {
  const found = [];
  for (let place = lines.length - 1; place >= 0 && found.length < most; place -= 1) {
    const line = lines[place];
    const concerns =
      address === null || String(line.from) === address || String(line.to) === address;
    if (concerns && matches(line, words)) found.push(line);
  }
  return found;
}

/** As candump writes a frame; of a telegram the octets alone. */
function octets({ identifier, octets: told }) {
  return identifier ? `${identifier}#${told}` : told;
}

function fill(seat, rows, lines) {
  while (rows.length < lines.length) {
    const cells = Array.from({ length: 6 }, () => element("td"));
    const row = element("tr", {}, ...cells);
    rows.push({ row, cells });
    seat.append(row);
  }
  rows.forEach(({ row, cells }, place) => {
    const line = lines[place];
    setAttribute(row, "hidden", !line);
    if (!line) return;
    const texts = [clock(line.at, 3), line.from, line.to, line.name, line.text, octets(line)];
    texts.forEach((text, column) => setText(cells[column], text ?? ""));
  });
}
