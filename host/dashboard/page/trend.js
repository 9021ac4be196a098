/** @file The last minute as a curve, with its numbers beside it. */

import { element, freshId, setAttribute, setText, svg } from "./dom.js";
import { extremes } from "./history.js";
import { fixed, whole } from "./units.js";

const SPAN = 60;
const PERIOD = 100;
/** How often the curve tells its numbers to screen readers, in ms. */
const SPEAK = 5000;
const [WIDTH, HEIGHT, MARGIN] = [600, 150, 6];
/** Seconds without a sample after which a value has held; less is a stream that was late. */
const HELD = 1;
/** Between two dots of the master, in units of the width. */
const DOTS = 10;

const QUANTITIES = {
  position: { title: "Position", unit: "steps", show: whole },
  rpm: { title: "Speed", unit: "rpm", show: (value) => fixed(value, 1) },
};

/**
 * The trend of one encoder. The curve of the position has the master's values as dots on it; a
 * table says lowest, highest and newest.
 * @param {import("./history.js").History} history
 */
export function createTrend(history) {
  const curve = svg("path", { class: "curve" });
  const dots = svg("path", { class: "dots" });
  const chart = svg(
    "svg",
    {
      class: "chart",
      viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
      preserveAspectRatio: "none",
      role: "img",
      "aria-label": "Trend of the last minute",
    },
    svg("path", { class: "grid", d: grid() }),
    curve,
    dots,
  );
  const cells = { max: element("td"), now: element("td"), min: element("td") };
  const name = freshId("quantity");
  let chosen = "position";
  let drawn = 0;
  let spoken = 0;
  const choice = (quantity) => {
    const id = freshId("choice");
    const choose = () => {
      chosen = quantity;
      drawn = spoken = 0;
    };
    const input = element("input", {
      type: "radio",
      id,
      name,
      checked: quantity === chosen,
      onchange: choose,
    });
    return element(
      "span",
      { class: "choice" },
      input,
      element("label", { for: id }, QUANTITIES[quantity].title),
    );
  };
  const row = (title, cell) => element("tr", {}, element("th", { scope: "row" }, title), cell);
  const table = element(
    "table",
    { class: "extremes" },
    element("caption", { class: "unseen" }, "The last minute in numbers"),
    element("tbody", {}, row("max", cells.max), row("now", cells.now), row("min", cells.min)),
  );
  const scale = ["\u221260 s", "\u221240 s", "\u221220 s", "now"];
  const root = element(
    "div",
    { class: "trend" },
    element(
      "div",
      { class: "trend-head" },
      element(
        "fieldset",
        { class: "choices" },
        element("legend", { class: "unseen" }, "What the trend shows"),
        choice("position"),
        choice("rpm"),
      ),
      element(
        "p",
        { class: "key" },
        element("span", { class: "key-line" }),
        "measured ",
        element("span", { class: "key-dots" }),
        "as the master got it",
      ),
    ),
    element(
      "div",
      { class: "trend-row" },
      element(
        "div",
        { class: "trend-seat" },
        chart,
        element(
          "div",
          { class: "scale", "aria-hidden": "true" },
          ...scale.map((text) => element("span", {}, text)),
        ),
      ),
      table,
    ),
  );

  return {
    root,
    /** Draws, at most ten times a second; `at` is the time of the plant. */
    frame(now, at, device) {
      if (now - drawn < PERIOD) return;
      drawn = now;
      const { title, unit, show } = QUANTITIES[chosen];
      const samples = history.last(at, chosen);
      const { min, max, now: newest } = extremes(samples);
      const isPosition = chosen === "position";
      const place = placement(at, min, max);
      const round = isPosition ? device?.total_resolution : null;
      setAttribute(
        curve,
        "d",
        min === null ? "" : lines(samples, at, round).map(place.line).join(""),
      );
      setAttribute(
        dots,
        "d",
        isPosition && min !== null ? dotted(history.last(at, "polled"), place) : "",
      );
      setText(cells.min, show(min));
      setText(cells.max, show(max));
      setText(cells.now, show(newest));
      if (now - spoken < SPEAK) return;
      spoken = now;
      setAttribute(
        chart,
        "aria-label",
        `${title} in the last minute: lowest ${show(min)}, ` +
          `highest ${show(max)}, now ${show(newest)} ${unit}`,
      );
    },
  };
}

function grid() {
  const upright = [0, 1, 2, 3, 4, 5, 6].map((ten) => `M${ten * 100} 0V${HEIGHT}`);
  const level = [MARGIN, HEIGHT / 2, HEIGHT - MARGIN].map((y) => `M0 ${y}H${WIDTH}`);
  return [...upright, ...level].join("");
}

/** Where moments and values lie in the chart. */
function placement(at, min, max) {
  const span = Math.max(max - min, 1);
  const middle = (min + max) / 2;
  const x = (time) => Math.max(WIDTH - ((at - time) / SPAN) * WIDTH, 0);
  const y = (value) => HEIGHT / 2 - ((value - middle) / span) * (HEIGHT - 2 * MARGIN);
  const place = ([time, value]) => `${x(time).toFixed(1)} ${y(value).toFixed(1)}`;
  return { x, y, line: (points) => `M${points.map(place).join("L")}` };
}

function dotted(samples, { x, y }) {
  let path = "";
  let last = -DOTS;
  for (const { at, value } of samples) {
    if (Number.isNaN(value) || x(at) - last < DOTS) continue;
    last = x(at);
    path += `M${last.toFixed(1)} ${y(value).toFixed(1)}h0`;
  }
  return path;
}

/** Lines without a break: a position that wraps, or a time without power, ends one. */
function lines(samples, at, round) {
  const all = [];
  let line = [];
  let before = null;
  const end = () => {
    if (line.length > 0) all.push(line);
    line = [];
  };
  for (const { at: time, value } of samples) {
    // Nothing is told while nothing changes: the value held until just before this one.
    if (before && time - before.time > HELD) line.push([time - 0.05, before.value]);
    const wraps = before && round && Math.abs(value - before.value) > round / 2;
    if (Number.isNaN(value) || wraps) end();
    if (!Number.isNaN(value)) line.push([time, value]);
    before = Number.isNaN(value) ? null : { time, value };
  }
  if (before) line.push([at, before.value]);
  end();
  return all;
}
