/** @file The lamp of an encoder: a dot that shows it and a badge that says it. */

import { element, setAttribute, setText } from "./dom.js";
import { NOTHING } from "./units.js";

/**
 * A lamp. The badge has the words of the manual; the dot alone would tell by colour only.
 * @returns {{root: HTMLElement, update: function(object|undefined): void}}
 */
export function createLamp() {
  const dot = element("span", { class: "lamp-dot", "aria-hidden": "true" });
  const text = element("span", {}, NOTHING);
  const root = element("span", { class: "lamp", "data-colour": "off" }, dot, text);
  return {
    root,
    update(lamp) {
      setText(text, lamp?.text ?? NOTHING);
      setAttribute(root, "data-colour", lamp?.colour ?? "off");
      setAttribute(root, "data-pattern", pace(lamp?.pattern ?? ""));
    },
  };
}

function pace(pattern) {
  if (!pattern.includes("flash")) return null;
  return pattern.includes("5 Hz") ? "fast" : "slow";
}
