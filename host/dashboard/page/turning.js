/** @file The dial under the hand: drag it, or press keys, and the shaft turns. */

import { element, freshId, setAttribute } from "./dom.js";
import { degrees, whole } from "./units.js";

/** At most 20 commands a second; what happens in between adds up. */
const PERIOD = 50;
/** How often the slider tells its value to screen readers, in ms. */
const SPEAK = 1000;

const KEYS = {
  ArrowRight: 1 / 360,
  ArrowUp: 1 / 360,
  ArrowLeft: -1 / 360,
  ArrowDown: -1 / 360,
  PageUp: 1,
  PageDown: -1,
};

/**
 * Adds up turns and sends them as whole steps, one command at a time.
 */
export class TurnSender {
  #steps;
  #send;
  #owed = 0;
  #busy = false;

  /**
   * @param {number} steps raw steps of a turn
   * @param {function(number): Promise<*>} send takes whole raw steps, clockwise
   */
  constructor(steps, send) {
    this.#steps = steps;
    this.#send = send;
  }

  /** Turns by a share of a turn, clockwise. Parts of a step wait for the next ones. */
  turn(share) {
    this.#owed += share * this.#steps;
    if (!this.#busy) this.#flush();
  }

  async #flush() {
    this.#busy = true;
    // A key press turns at least to the next step; a drag leaves its rest owed.
    for (let by = this.#take(); by !== 0; by = this.#take()) {
      const pause = new Promise((resolve) => setTimeout(resolve, PERIOD));
      await Promise.all([this.#send(by), pause]);
    }
    this.#busy = false;
  }

  #take() {
    const by = Math.trunc(this.#owed);
    this.#owed -= by;
    return by;
  }
}

/**
 * Makes a dial a slider that turns the shaft.
 * @param {HTMLElement} seat what carries the dial
 * @param {object} options `steps` of a turn; `by(steps)` and `stop()` send; `why` says why it
 *   cannot be turned, `null` where it can
 * @returns {{hint: HTMLElement, update: function(object, number): void}}
 */
export function makeTurnable(seat, { steps, by, stop, why }) {
  const hint = element(
    "p",
    { class: "hint", id: freshId("hint") },
    why ?? "Drag the dial, or focus it and press ",
  );
  if (!why) {
    const key = (name) => element("kbd", {}, name);
    hint.append(
      key("←"),
      " ",
      key("→"),
      " one degree, with ",
      key("Shift"),
      " a quarter turn; ",
      key("Page ↑"),
      " ",
      key("Page ↓"),
      " a turn; ",
      key("Home"),
      " stop.",
    );
  }
  const attributes = {
    role: "slider",
    tabindex: 0,
    "aria-label": "Shaft",
    "aria-valuemin": 0,
    "aria-valuemax": 360,
    "aria-valuenow": 0,
    "aria-describedby": hint.id,
    "aria-disabled": why ? "true" : null,
  };
  for (const [name, value] of Object.entries(attributes)) setAttribute(seat, name, value);
  if (!why) {
    const sender = new TurnSender(steps, by);
    listenToKeys(seat, sender, stop);
    listenToPointer(seat, sender);
  }
  let spoken = -SPEAK;
  return {
    hint,
    update(device, now) {
      if (now - spoken < SPEAK) return;
      spoken = now;
      const on = device?.power && typeof device.angle === "number";
      setAttribute(seat, "aria-valuenow", on ? Math.round(device.angle * 360) % 360 : 0);
      const text = on
        ? `position ${whole(device.position)}, ${degrees(device.angle)}, turn ${whole(device.turns)}`
        : "no power";
      setAttribute(seat, "aria-valuetext", text);
    },
  };
}

function listenToKeys(seat, sender, stop) {
  seat.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "Home") stop();
    else if (event.key in KEYS) {
      const share = KEYS[event.key];
      const isArrow = event.key.startsWith("Arrow");
      sender.turn(event.shiftKey && isArrow ? Math.sign(share) / 4 : share);
    } else return;
    event.preventDefault();
  });
}

function listenToPointer(seat, sender) {
  let held = null;
  const angle = (event) => {
    const box = seat.getBoundingClientRect();
    const x = event.clientX - box.left - box.width / 2;
    const y = event.clientY - box.top - box.height / 2;
    return Math.atan2(x, -y) / (2 * Math.PI);
  };
  seat.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    seat.setPointerCapture(event.pointerId);
    seat.classList.add("held");
    held = angle(event);
  });
  seat.addEventListener("pointermove", (event) => {
    if (held === null) return;
    const next = angle(event);
    const way = next - held;
    held = next;
    // Half a turn at once is the seam between −180° and 180°, not the hand.
    sender.turn(way > 0.5 ? way - 1 : way < -0.5 ? way + 1 : way);
  });
  const release = () => {
    held = null;
    seat.classList.remove("held");
  };
  seat.addEventListener("pointerup", release);
  seat.addEventListener("pointercancel", release);
}
