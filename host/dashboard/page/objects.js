/** @file The objects, or octets, of a device: read live, and set where they can be set. */

import { fetchObjects, Refusal } from "./api.js";
import { element, freshId, setAttribute, setText } from "./dom.js";
import { Outcome, panel } from "./panel.js";
import { hexadecimal, NOTHING, parseWhole, splitWords, whole } from "./units.js";

/** The panel of objects. */
export function createObjects({ place, device, live, locked, send }) {
  const [findId, onlyId] = [freshId("object"), freshId("object")];
  const find = element("input", { type: "search", id: findId, placeholder: "name, key or number" });
  const only = element("input", { type: "checkbox", id: onlyId });
  const seat = element("div", { class: "groups" }, element("p", { class: "hint" }, "Reading …"));
  const outcome = new Outcome();
  const { root, body } = panel("Objects", "objects");
  body.append(
    element(
      "div",
      { class: "filter" },
      element("label", { for: findId }, "Find"),
      find,
      element("span", { class: "tick" }, only, element("label", { for: onlyId }, "only settings")),
    ),
    outcome.root,
    seat,
  );
  let rows = new Map();
  let groups = [];
  let standing = null;

  const filter = () => {
    const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const row of rows.values()) {
      const found =
        words.every((word) => row.words.includes(word)) && (!only.checked || row.editable);
      for (const line of row.lines) setAttribute(line, "data-hidden", !found);
    }
    for (const { root: table, keys } of groups) {
      setAttribute(table, "hidden", !keys.some((key) => !rows.get(key).isHidden()));
    }
  };
  find.addEventListener("input", filter);
  only.addEventListener("change", filter);

  async function read() {
    let told;
    try {
      told = await fetchObjects(place);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      outcome.tell(error.message, true);
      return;
    }
    outcome.tell("");
    const keys = told.flatMap((group) => group.objects.map((object) => object.key));
    // The same rows again: only their values are written, so nobody loses what is being typed.
    if (keys.length === rows.size && keys.every((key) => rows.has(key))) {
      for (const group of told)
        for (const object of group.objects) rows.get(object.key).learn(object);
      return;
    }
    rows = new Map();
    groups = told.map((group) => createGroup(group, rows, { locked, send }));
    seat.replaceChildren(...groups.map((group) => group.root));
    filter();
  }

  const take = ({ detail: values }) => {
    for (const [key, value] of Object.entries(values)) rows.get(key)?.show(value);
  };
  const follow = () => {
    const now = live.device(place);
    // What is saved and what may be set is another one after these.
    const next = [
      now?.power,
      now?.memory?.writes,
      now?.steps_per_turn,
      now?.total_resolution,
      now?.network?.state,
    ].join();
    if (next === standing) return;
    standing = next;
    read();
  };
  live.addEventListener("objects", take);
  live.addEventListener("state", follow);
  follow();
  return {
    root,
    device,
    close() {
      live.removeEventListener("objects", take);
      live.removeEventListener("state", follow);
    },
  };
}

function createGroup({ title, objects }, rows, context) {
  const head = ["Number", "Name", "Value", "Saved", ""].map((name) =>
    name
      ? element("th", { scope: "col" }, name)
      : element("th", { scope: "col" }, element("span", { class: "unseen" }, "Change")),
  );
  const keeps = objects.some((object) => object.saved != null);
  const body = element("tbody");
  for (const object of objects) {
    const row = createRow(object, context);
    rows.set(object.key, row);
    body.append(...row.lines);
  }
  const root = element(
    "table",
    { class: keeps ? "object-table" : "object-table unkept" },
    element("caption", {}, title),
    element("thead", {}, element("tr", {}, ...head)),
    body,
  );
  return { root, keys: objects.map((object) => object.key) };
}

function createRow(first, { locked, send }) {
  let object = first;
  let editor = null;
  const value = element("span", { class: "number" });
  const saved = element("span", { class: "number" });
  const name = element("span", { class: "object-name" }, object.title);
  const help = [object.help, object.note].filter(Boolean).map(sentence).join(" ");
  const change = element(
    "button",
    { type: "button", class: "quiet", "aria-expanded": "false", onclick: () => toggle() },
    "Change",
  );
  const outcome = new Outcome();
  const editorSeat = element("td", { colspan: 5 }, outcome.root);
  const editorLine = element("tr", { class: "editor", hidden: true }, editorSeat);
  const lastCell = element("td", { class: "change" });
  const line = element(
    "tr",
    {},
    element("td", { class: "place" }, object.place),
    element(
      "td",
      { class: "name" },
      name,
      element("span", { class: "fine key-name" }, ` ${object.key}`),
      help ? element("span", { class: "help" }, help) : null,
    ),
    element("td", { class: "value" }, value),
    element("td", { class: "saved" }, saved),
    lastCell,
  );

  function show(next) {
    object.value = next;
    setText(value, shown(object, next));
    setText(saved, object.saved == null ? "" : shown(object, object.saved));
    setAttribute(line, "data-unsaved", object.saved != null && object.saved !== next);
    editor?.compare();
  }
  function learn(next) {
    object = next;
    const why = locked ?? object.why_not;
    const mayChange = object.editable && !locked;
    lastCell.replaceChildren(...(object.editable ? [change] : []));
    setAttribute(change, "disabled", !mayChange);
    setAttribute(change, "title", mayChange ? null : why);
    setAttribute(change, "aria-label", `Change ${object.title}`);
    setAttribute(line, "title", object.editable ? null : why);
    show(object.value);
  }
  function toggle() {
    if (editor) return close();
    editor = createEditor(object, { close, write });
    outcome.tell("");
    editorSeat.prepend(editor.root);
    editorLine.hidden = false;
    change.setAttribute("aria-expanded", "true");
    editor.focus();
  }
  function close() {
    editor?.root.remove();
    editor = null;
    editorLine.hidden = outcome.root.textContent === "";
    change.setAttribute("aria-expanded", "false");
    change.focus();
  }
  async function write(next) {
    const done = await outcome.of(
      send("PUT", `objects/${encodeURIComponent(object.key)}`, { value: next }),
    );
    editorLine.hidden = false;
    if (done) close();
  }
  learn(first);
  return {
    lines: [line, editorLine],
    words: `${first.title} ${first.key} ${first.place} ${help}`.toLowerCase(),
    editable: first.editable || first.setting,
    isHidden: () => line.hasAttribute("data-hidden"),
    show,
    learn,
  };
}

/** The fields that take another value, with old → new beside them. */
function createEditor(object, { close, write }) {
  const id = freshId("value");
  const field = object.values?.length
    ? element("select", { id }, ...choices(object))
    : element("input", {
        id,
        type: "text",
        autocomplete: "off",
        value: object.value ?? "",
        inputmode: "text",
      });
  const difference = element("span", { class: "difference number" });
  const allowed = object.range ? `${whole(object.range[0])} … ${whole(object.range[1])}` : "";
  const read = () => {
    if (object.values?.length)
      return typeof object.value === "number" ? Number(field.value) : field.value;
    if (typeof object.value !== "number" && object.value != null) return field.value;
    return parseWhole(field.value);
  };
  const compare = () => {
    const next = read();
    const split = typeof next === "number" && !object.values?.length ? splitWords(next) : null;
    const words = split ? ` = ${hexadecimal(next)}, hi ${split.hi}, lo ${split.lo}` : "";
    setText(
      difference,
      next === null
        ? "Write a whole number, as 921600 or E1000h."
        : `${shown(object, object.value)} → ${shown(object, next)}${words}`,
    );
  };
  field.addEventListener("input", compare);
  const submit = (event) => {
    event.preventDefault();
    const next = read();
    if (next !== null) write(next);
  };
  const root = element(
    "form",
    { class: "edit", onsubmit: submit },
    element("label", { for: id }, `${object.title}${object.unit ? ` in ${object.unit}` : ""}`),
    field,
    element("button", { type: "submit", class: "main" }, "Write"),
    element("button", { type: "button", onclick: close }, "Cancel"),
    difference,
    allowed ? element("span", { class: "fine" }, `allowed: ${allowed}`) : null,
  );
  root.addEventListener("keydown", (event) => {
    if (event.key === "Escape") close();
  });
  compare();
  return {
    root,
    compare,
    focus() {
      field.focus();
      field.select?.();
    },
  };
}

function sentence(text) {
  return text.endsWith(".") ? text : `${text}.`;
}

function choices(object) {
  return object.values.map((name, number) => {
    const value = typeof object.value === "number" ? number : name;
    return element("option", { value, selected: value === object.value }, name);
  });
}

function shown(object, value) {
  if (value == null) return NOTHING;
  if (typeof value !== "number") return String(value);
  const named = object.values?.[value];
  if (named) return named;
  return object.unit ? `${whole(value)}\u00a0${object.unit}` : whole(value);
}
