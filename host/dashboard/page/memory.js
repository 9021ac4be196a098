/** @file Preset and kept memory: what is saved, what would be lost with the power. */

import { element, freshId, setAttribute, setText } from "./dom.js";
import { button, Outcome, panel, reading } from "./panel.js";
import { NOTHING, parseWhole, splitWords, whole } from "./units.js";

/** The panel of preset and memory. */
export function createMemory({ device, locked, send }) {
  const outcome = new Outcome();
  const disabled = Boolean(locked) || !device.editable;
  const state = reading("Memory");
  const writes = reading("Writes");
  const offset = reading("Offset", "steps");
  const unsaved = element("p", { class: "unsaved" });
  const id = freshId("preset");
  const value = element("input", {
    id,
    type: "text",
    inputmode: "numeric",
    value: "0",
    autocomplete: "off",
    disabled,
  });
  const preset = (event) => {
    event.preventDefault();
    const number = parseWhole(value.value);
    if (number === null || number < 0 || splitWords(number) === null) {
      const wanted = "write one of 32 bits, as 4096 or 1000h";
      outcome.tell(`"${value.value}" is no position: ${wanted}.`, true);
      return;
    }
    outcome.of(send("POST", "preset", { value: number }));
  };
  const action = (name, path, help) =>
    button(name, () => outcome.of(send("POST", path)), { disabled, title: help });
  const { root, body } = panel("Preset and memory", "memory");
  body.append(
    element(
      "form",
      { class: "preset", onsubmit: preset },
      element("label", { for: id }, "The position here becomes"),
      element(
        "div",
        { class: "field-row" },
        value,
        element("button", { type: "submit", class: "main", disabled }, "Preset"),
      ),
    ),
    element("dl", { class: "readings" }, state.root, writes.root, offset.root),
    unsaved,
    element(
      "div",
      { class: "choices-row" },
      action("Save", "save", "Keeps what is in force"),
      action("Restore", "restore", "Takes back what was saved"),
      action("Reset", "reset", "Takes the defaults"),
    ),
    element(
      "p",
      { class: "hint" },
      why(locked, device) ??
        "Save keeps what is in force, Restore takes back what was saved, Reset takes the defaults.",
    ),
    outcome.root,
  );
  return {
    root,
    update(now) {
      const memory = now?.memory;
      setText(state.value, memory?.state ?? NOTHING);
      setText(writes.value, whole(memory?.writes));
      setText(offset.value, whole(now?.power ? now.offset : undefined));
      const lost = memory?.unsaved ?? [];
      setText(
        unsaved,
        lost.length
          ? `Not saved, lost with the power: ${lost.join(", ")}.`
          : "Nothing would be lost with the power.",
      );
      setAttribute(unsaved, "data-waits", lost.length > 0);
    },
  };
}

function why(locked, device) {
  if (locked) return locked;
  return device.editable ? null : (device.why_not_editable ?? "It cannot be set here.");
}
