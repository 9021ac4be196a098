/** @file What is measured: position, speed, what the master got, and the last minute. */

import { element, setAttribute, setText } from "./dom.js";
import { panel, reading } from "./panel.js";
import { createTrend } from "./trend.js";
import { degrees, fixed, hexadecimal, milliseconds, NOTHING, percent, whole } from "./units.js";

/** The panel of what is measured. */
export function createMeasured({ device, live }, history) {
  const { root, body } = panel("Measured", "measured");
  const position = element("span", { class: "number" }, NOTHING);
  const hex = element("span", { class: "number" }, NOTHING);
  const polled = element("span", { class: "number" }, NOTHING);
  const asked = element("span", { class: "fine" });
  const angle = reading("Angle");
  const turns = reading("Turn");
  const rpm = reading("Speed", "rpm");
  const velocity = element("dd", { class: "fine" }, NOTHING);
  rpm.root.append(velocity);
  const code = reading("Raw code");
  const range = element("span", { class: "range-bar", "aria-hidden": "true" }, element("span"));
  const share = element("span", {}, NOTHING);
  const total = element("span", { class: "number" }, NOTHING);
  const trend = createTrend(history);
  body.append(
    element(
      "div",
      { class: "positions" },
      element(
        "div",
        { class: "position-own" },
        element("h3", {}, "Position"),
        element("p", { class: "huge" }, position, element("span", { class: "unit" }, "steps")),
        element("p", { class: "fine" }, hex),
      ),
      element(
        "div",
        { class: "position-polled" },
        element("h3", {}, "At the master"),
        element("p", { class: "huge" }, polled),
        asked,
      ),
    ),
    element("dl", { class: "readings" }, angle.root, turns.root, rpm.root, code.root),
    element(
      "div",
      { class: "range" },
      range,
      element("p", { class: "fine" }, share, " of the measuring range of ", total, " steps"),
    ),
    trend.root,
  );
  return {
    root,
    update(state) {
      const on = state?.power ? state : null;
      setText(position, whole(on?.position));
      setText(hex, hexadecimal(on?.position));
      setText(angle.value, on ? degrees(on.angle) : NOTHING);
      const of = device.turns > 1 ? ` / ${whole(rangeTurns(on) ?? device.turns)}` : "";
      setText(turns.value, on ? `${whole(on.turns)}${of}` : NOTHING);
      setText(rpm.value, fixed(on?.rpm, 1));
      setText(velocity, `${whole(on?.velocity)} steps/s`);
      setText(code.value, whole(on?.code));
      const part = on?.total_resolution > 0 ? on.position / on.total_resolution : 0;
      range.firstChild.style.transform = `scaleX(${part.toFixed(4)})`;
      setText(share, on ? percent(part, 2) : NOTHING);
      setText(total, whole(on?.total_resolution));
      const master = state?.master;
      setText(polled, whole(master?.position));
      setText(asked, told(master));
      setAttribute(root, "data-off", !on);
    },
    frame(time, state) {
      trend.frame(time, live.state.at, state);
    },
  };
}

function rangeTurns(state) {
  const turns = state ? state.total_resolution / state.steps_per_turn : NaN;
  return Number.isInteger(turns) ? turns : null;
}

function told(master) {
  if (!master) return "No master serves it.";
  if (master.state !== "running") return `${master.id}: ${master.state}`;
  return `${master.id}, ${fixed(master.answers_per_second, 0)} answers/s, cycle ${milliseconds(master.cycle_ms)}`;
}
