/** @file Panels, the lines in which commands tell what came of them, and controls that wait. */

import { Refusal } from "./api.js";
import { element, freshId } from "./dom.js";

/**
 * A titled part of a view: a region with a heading.
 * @param {string} title
 * @param {string} name its class
 * @param {...Node} tools what stands beside the heading
 * @returns {{root: HTMLElement, body: HTMLElement}}
 */
export function panel(title, name, ...tools) {
  const id = freshId("panel");
  const body = element("div", { class: "panel-body" });
  const head = element("div", { class: "panel-head" }, element("h2", { id }, title), ...tools);
  const root = element("section", { class: `panel ${name}`, "aria-labelledby": id }, head, body);
  return { root, body };
}

/** A line that tells what came of a command, politely to screen readers too. */
export class Outcome {
  root = element("p", { class: "outcome", role: "status" });
  #timer = null;

  /** Tells it; a success goes away after some seconds, a refusal stays. */
  tell(text, refused = false) {
    clearTimeout(this.#timer);
    this.root.textContent = refused ? `Refused: ${text}` : text;
    this.root.classList.toggle("refused", refused);
    if (!refused && text) this.#timer = setTimeout(() => this.tell(""), 8000);
  }

  /**
   * Waits for a command and tells what came of it.
   * @param {Promise<string>} answer
   * @returns {Promise<boolean>} whether it was carried out
   */
  async of(answer) {
    try {
      this.tell(await answer);
      return true;
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      this.tell(error.message, true);
      return false;
    }
  }
}

/** A button that does one thing. */
export function button(text, action, attributes = {}) {
  return element("button", { type: "button", onclick: action, ...attributes }, text);
}

/**
 * A name and a value under it, as on the front of an instrument.
 * @returns {{root: HTMLElement, value: HTMLElement}}
 */
export function reading(name, unit = "") {
  const value = element("span", { class: "number" }, "–");
  const shown = element("dd", {}, value, unit ? element("span", { class: "unit" }, unit) : null);
  return { root: element("div", { class: "reading" }, element("dt", {}, name), shown), value };
}
