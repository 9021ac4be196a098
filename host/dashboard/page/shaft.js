/** @file The shaft: the large dial under the hand, and the motion it follows. */

import { createLargeDial } from "./dial.js";
import { element, freshId, setText } from "./dom.js";
import { button, Outcome, panel } from "./panel.js";
import { makeTurnable } from "./turning.js";
import { NOTHING } from "./units.js";

const CHOICES = [
  ["Rest", "still"],
  ["Turn slowly", "turn rpm=6"],
  ["Turn", "turn rpm=60"],
  ["Turn fast", "turn rpm=-750"],
  ["Swing", "sine amplitude=160deg period=8s"],
  ["Go and return", "profile 0s:0 2s:1.5turns 3s:1.5turns 5s:0 6s:0 repeat"],
];

/** The panel of the shaft. */
export function createShaft({ device, locked, send }) {
  const dial = createLargeDial(device.shaft);
  const outcome = new Outcome();
  const why =
    locked ?? (device.can_turn ? null : (device.why_not_turned ?? "It cannot be turned here."));
  const post = (body) => outcome.of(send("POST", "shaft", body));
  const quietly = async (body) => {
    try {
      await send("POST", "shaft", body);
    } catch (error) {
      outcome.tell(error.message, true);
    }
  };
  const turning = makeTurnable(dial.root, {
    steps: device.steps,
    by: (steps) => quietly({ by: steps }),
    stop: () => post({ stop: true }),
    why,
  });
  const arrow = element("p", { class: "counting" });
  const now = element("span", { class: "number" }, NOTHING);
  const motion = createMotion(post, Boolean(why));
  const { root, body } = panel("Shaft", "shaft");
  body.append(
    dial.root,
    arrow,
    turning.hint,
    element("p", { class: "motion-now" }, "Motion: ", now),
    motion,
    outcome.root,
  );
  return {
    root,
    update(state, time) {
      dial.update(state, device);
      turning.update(state, time);
      setText(now, state?.shaft?.motion ?? NOTHING);
      const direction = state?.direction;
      setText(
        arrow,
        direction
          ? `Positions grow ${direction === "CCW" ? "counter-clockwise" : "clockwise"} (${direction}), seen looking at the flange.`
          : "",
      );
    },
    frame(time, state) {
      dial.frame(time);
      turning.update(state, time);
    },
  };
}

function createMotion(post, disabled) {
  const id = freshId("motion");
  const text = element("input", {
    id,
    type: "text",
    spellcheck: "false",
    autocomplete: "off",
    disabled,
    placeholder: "turn rpm=60",
    "aria-describedby": `${id}-hint`,
  });
  const go = (event) => {
    event.preventDefault();
    if (text.value.trim()) post({ motion: text.value.trim() });
  };
  const choose = (motion) => {
    text.value = motion;
    post(motion === "still" ? { stop: true } : { motion });
  };
  return element(
    "form",
    { class: "motion", onsubmit: go },
    element(
      "div",
      { class: "choices-row", role: "group", "aria-label": "Motions to choose from" },
      ...CHOICES.map(([name, motion]) =>
        button(name, () => choose(motion), { disabled, title: motion }),
      ),
    ),
    element("label", { for: id }, "Another motion"),
    element(
      "div",
      { class: "field-row" },
      text,
      element("button", { type: "submit", disabled }, "Go"),
    ),
    element(
      "p",
      { class: "hint", id: `${id}-hint` },
      "As ",
      element("code", {}, "turn rpm=60"),
      ", ",
      element("code", {}, "sine amplitude=90deg period=2s"),
      " or ",
      element("code", {}, "profile 0s:0 1s:90deg 3s:2turns"),
      ".",
    ),
  );
}
