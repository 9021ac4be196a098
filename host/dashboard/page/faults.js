/** @file The levers of the laboratory: faults to provoke and to end. */

import { element, freshId, setAttribute, setText } from "./dom.js";
import { button, Outcome, panel } from "./panel.js";
import { parseWhole } from "./units.js";

/** What stands in a field that must be filled. */
const EXAMPLES = { integer: "4000", probability: "0.5", time: "20ms" };

/** The panel of faults. */
export function createFaults({ device, locked, send }) {
  const { root, body } = panel("Faults to provoke", "faults");
  const levers = device.faults.map((fault) => createLever(fault, { locked, send }));
  if (levers.length === 0)
    body.append(element("p", { class: "hint" }, "Nothing can go wrong with it here."));
  else body.append(element("ul", { class: "levers" }, ...levers.map((lever) => lever.root)));
  return {
    root,
    update(now) {
      const active = new Set(now?.faults ?? []);
      for (const lever of levers) lever.update(active.has(lever.kind));
    },
  };
}

function createLever(fault, { locked, send }) {
  const outcome = new Outcome();
  const disabled = Boolean(locked);
  const fields = fault.parameters.map((parameter) => createField(parameter, disabled));
  const badge = element("span", { class: "standing" });
  const provoke = (event) => {
    event.preventDefault();
    const body = { kind: fault.kind };
    for (const field of fields) {
      const { value, wrong } = field.read();
      if (wrong) return outcome.tell(wrong, true);
      if (value !== null) body[field.name] = value;
    }
    return outcome.of(send("POST", "faults", body));
  };
  const clear = button(
    "Clear",
    () => outcome.of(send("DELETE", `faults/${encodeURIComponent(fault.kind)}`)),
    {
      disabled,
      hidden: true,
      "aria-label": `Clear: ${fault.title}`,
    },
  );
  const start = element(
    "button",
    {
      type: "submit",
      disabled,
      title: locked,
      "aria-label": `Provoke: ${fault.title}`,
    },
    "Provoke",
  );
  const root = element(
    "li",
    { class: "lever" },
    element(
      "form",
      { onsubmit: provoke },
      element("div", { class: "lever-head" }, element("h3", {}, fault.title), badge, clear, start),
      element("p", { class: "hint" }, fault.help),
      fields.length
        ? element("div", { class: "lever-fields" }, ...fields.map((field) => field.root))
        : null,
    ),
    outcome.root,
  );
  return {
    root,
    kind: fault.kind,
    update(active) {
      setText(badge, active ? "active" : "");
      setAttribute(root, "data-active", active);
      // A fault that is over at once has nothing to clear, unless the state says it lasts.
      setAttribute(clear, "hidden", !active);
    },
  };
}

function createField({ name, type, required, default: usual, help }, disabled) {
  const id = freshId("fault");
  const input = element("input", {
    id,
    type: "text",
    size: 9,
    autocomplete: "off",
    disabled,
    required,
    title: help,
    placeholder: usual ?? (required ? EXAMPLES[type] : null),
  });
  return {
    name,
    root: element(
      "div",
      { class: "lever-field" },
      element("label", { for: id }, name),
      input,
      help ? element("span", { class: "fine" }, help) : null,
    ),
    read() {
      const text = input.value.trim();
      if (text === "") return { value: null };
      if (type === "integer") {
        const value = parseWhole(text);
        return value === null ? { wrong: `${name} is a whole number, not "${text}".` } : { value };
      }
      if (type === "time") return { value: text };
      const value = Number(text);
      return Number.isFinite(value) ? { value } : { wrong: `${name} is a number, not "${text}".` };
    },
  };
}
