/** @file Rotary and DIP switches as pictures that can be turned. They act at the next power-up. */

import { element, freshId, setAttribute, setText, svg } from "./dom.js";
import { Outcome } from "./panel.js";
import { modulo } from "./units.js";

/**
 * The switches of a device under its cover.
 * @returns {{root: HTMLElement, update: function(object|undefined, boolean): void}}
 */
export function createSwitches({ device, locked, send }) {
  const outcome = new Outcome();
  const disabled = Boolean(locked);
  const set = { rotary: [], dip: [], termination: false };
  const put = (changes) => outcome.of(send("PUT", "switches", { ...set, ...changes }));

  const rotary = device.switches.rotary.map((fixed, place) =>
    createRotary(fixed, disabled, (digit) => put({ rotary: set.rotary.with(place, digit) })),
  );
  const dip = device.switches.dip.map((fixed, place) =>
    createDip(`DIP ${fixed.label}`, fixed.meaning?.split(":")[0], disabled, (on) =>
      put({ dip: set.dip.with(place, on) }),
    ),
  );
  const termination = createDip("Termination", "terminating resistor", disabled, (on) =>
    put({ termination: on }),
  );
  // "bit rate: 2 and 3 OFF OFF 125k, …" stands once for both switches, its first words at each.
  const legend = new Set(
    device.switches.dip.map((fixed) => fixed.meaning).filter((text) => text?.includes(":")),
  );
  const pending = element("p", { class: "pending" });
  const root = element(
    "div",
    { class: "switches" },
    element("h3", {}, "Switches"),
    element("div", { class: "rotaries" }, ...rotary.map((one) => one.root)),
    element("div", { class: "dips" }, ...dip.map((one) => one.root), termination.root),
    ...[...legend].map((text) => element("p", { class: "hint" }, text)),
    pending,
    outcome.root,
  );
  return {
    root,
    update(switches, on) {
      if (!switches) return;
      set.rotary = switches.now ?? [];
      set.dip = switches.dip ?? [];
      set.termination = Boolean(switches.termination);
      rotary.forEach((one, place) => one.update(set.rotary[place] ?? 0));
      dip.forEach((one, place) => one.update(Boolean(set.dip[place])));
      termination.update(set.termination);
      const waits = on ? waiting(switches) : [];
      setText(
        pending,
        waits.length
          ? `Acts at the next power-up: ${waits.join("; ")}.`
          : "The device reads its switches at power-up; the terminating resistor acts at once.",
      );
      setAttribute(pending, "data-waits", waits.length > 0);
    },
  };
}

/** What has been turned since the power-up, in words. */
function waiting({ now, at_power_up, dip, dip_at_power_up }) {
  const waits = [];
  if (at_power_up && String(now) !== String(at_power_up)) {
    waits.push(`address switches ${now.join("")}, in force ${at_power_up.join("")}`);
  }
  const word = (switches) => switches.map((on) => (on ? "ON" : "OFF")).join(" ");
  if (dip_at_power_up && String(dip) !== String(dip_at_power_up)) {
    waits.push(`DIP ${word(dip)}, in force ${word(dip_at_power_up)}`);
  }
  return waits;
}

function createRotary({ label, digits, meaning }, disabled, turn) {
  let now = 0;
  const pointer = svg(
    "g",
    { class: "rotary-pointer" },
    svg("circle", { r: 17 }),
    svg("path", { d: "M-3.2 12V-6h-3.6L0-15 6.8-6H3.2V12Z" }),
  );
  const marks = Array.from({ length: digits }, (_, digit) => {
    const angle = (digit / digits) * 2 * Math.PI;
    const [x, y] = [Math.sin(angle) * 29, -Math.cos(angle) * 29];
    return svg("text", { x: x.toFixed(1), y: y.toFixed(1) }, String(digit));
  });
  const picture = svg(
    "svg",
    { viewBox: "-40 -40 80 80", "aria-hidden": "true" },
    svg("rect", { class: "rotary-case", x: -39, y: -39, width: 78, height: 78, rx: 5 }),
    ...marks,
    pointer,
  );
  const spin = element(
    "div",
    {
      class: "rotary",
      role: "spinbutton",
      tabindex: 0,
      "aria-label": `Rotary switch ${label}${meaning ? `, ${meaning}` : ""}`,
      "aria-valuemin": 0,
      "aria-valuemax": digits - 1,
      "aria-valuenow": 0,
      "aria-disabled": disabled ? "true" : null,
    },
    picture,
  );
  const to = (digit) => {
    if (!disabled && digit !== now) turn(modulo(digit, digits));
  };
  spin.addEventListener("keydown", (event) => {
    const by = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1 }[event.key];
    if (by !== undefined) to(now + by);
    else if (event.key === "Home") to(0);
    else if (event.key === "End") to(digits - 1);
    else if (/^\d$/.test(event.key) && Number(event.key) < digits) to(Number(event.key));
    else return;
    event.preventDefault();
  });
  spin.addEventListener("click", (event) => {
    const box = spin.getBoundingClientRect();
    const x = event.clientX - box.left - box.width / 2;
    const y = event.clientY - box.top - box.height / 2;
    // In the middle it turns by one digit; outside it turns to the digit that was hit.
    const inMiddle = Math.hypot(x, y) < box.width / 4;
    const digit = Math.round((Math.atan2(x, -y) / (2 * Math.PI)) * digits);
    to(inMiddle ? now + 1 : modulo(digit, digits));
  });
  const root = element(
    "div",
    { class: "rotary-seat" },
    spin,
    element(
      "span",
      { class: "fine", "aria-hidden": "true" },
      `switch ${label}${meaning ? ` ${meaning}` : ""}`,
    ),
  );
  return {
    root,
    update(digit) {
      now = digit;
      setAttribute(spin, "aria-valuenow", digit);
      setAttribute(pointer, "transform", `rotate(${(digit / digits) * 360})`);
      marks.forEach((mark, place) => setAttribute(mark, "data-now", place === digit));
    },
  };
}

function createDip(title, meaning, disabled, turn) {
  let now = false;
  const id = freshId("dip");
  const word = element("span", { class: "dip-word", "aria-hidden": "true" }, "OFF");
  const toggle = element(
    "button",
    {
      type: "button",
      role: "switch",
      class: "dip",
      "aria-checked": "false",
      "aria-labelledby": id,
      disabled,
      onclick: () => turn(!now),
    },
    element("span", { class: "dip-knob", "aria-hidden": "true" }),
    word,
  );
  const root = element(
    "div",
    { class: "dip-seat" },
    toggle,
    element(
      "span",
      { id, class: "dip-name" },
      title,
      meaning ? element("span", { class: "fine" }, meaning) : null,
    ),
  );
  return {
    root,
    update(on) {
      now = on;
      setAttribute(toggle, "aria-checked", String(on));
      setText(word, on ? "ON" : "OFF");
    },
  };
}
