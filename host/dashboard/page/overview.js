/** @file The overview: buses with their masters, and each encoder as a card. */

import { command, Refusal } from "./api.js";
import { createSmallDial } from "./dial.js";
import { element, freshId, setAttribute, setText } from "./dom.js";
import { createLamp } from "./lamp.js";
import { Outcome } from "./panel.js";
import { createReports } from "./reports.js";
import { linkTo } from "./routes.js";
import { degrees, fixed, milliseconds, NOTHING, percent, whole } from "./units.js";

/** More encoders than these get small cards. */
const MANY = 24;

/**
 * The overview of the plant. It stays in the document while an encoder is shown.
 * @param {object} plant what does not change
 * @param {import("./state.js").PlantState} live
 */
export function createOverview(plant, live) {
  const cards = new Map();
  const encoders = plant.buses.reduce((sum, bus) => sum + bus.devices.length, 0);
  const heads = plant.buses.map((bus) => createBus(bus, plant.read_only, cards));
  const counts = element("p", { class: "counts" });
  const find = createFilter((words, troubled) => show(cards, words, troubled));
  const reports = createReports(live, { title: "Events" });
  const heading = element("h1", { tabindex: -1 }, "Encoders");
  const root = element(
    "div",
    { class: encoders > MANY ? "overview many" : "overview" },
    element("div", { class: "overview-head" }, heading, counts, find.root),
    ...heads.map((bus) => bus.root),
    reports.root,
  );
  const changed = new Set();

  const take = ({ patch, whole: all }) => {
    if (all) for (const key of cards.keys()) changed.add(key);
    for (const [bus, changes] of Object.entries(patch.buses ?? {})) {
      for (const device of Object.keys(changes?.devices ?? {})) changed.add(`${bus}/${device}`);
    }
  };

  return {
    root,
    heading,
    title: "Encoders",
    take,
    /** Writes what has changed since the last picture. */
    frame() {
      for (const key of changed) {
        const card = cards.get(key);
        card?.update(live.device(card.place));
      }
      changed.clear();
      for (const bus of heads) bus.update(live.state.buses[bus.id]);
      setText(counts, summary(cards));
      if (find.wantsTrouble()) find.again();
    },
  };
}

function summary(cards) {
  let [alarms, warnings, off] = [0, 0, 0];
  for (const { standing } of cards.values()) {
    if (standing === "alarm") alarms += 1;
    if (standing === "warning") warnings += 1;
    if (standing === "off") off += 1;
  }
  const some = (number, one, many) => (number === 1 ? `1 ${one}` : `${number} ${many}`);
  const parts = [some(cards.size, "encoder", "encoders")];
  if (alarms) parts.push(some(alarms, "alarm", "alarms"));
  if (warnings) parts.push(some(warnings, "warning", "warnings"));
  if (off) parts.push(`${off} without power`);
  if (parts.length === 1) parts.push("no alarm");
  return parts.join(" · ");
}

function createFilter(apply) {
  const [findId, onlyId] = [freshId("find"), freshId("only")];
  const text = element("input", {
    type: "search",
    id: findId,
    placeholder: "name, model, address",
  });
  const only = element("input", { type: "checkbox", id: onlyId });
  const again = () => apply(text.value.toLowerCase().split(/\s+/).filter(Boolean), only.checked);
  text.addEventListener("input", again);
  only.addEventListener("change", again);
  const root = element(
    "form",
    { class: "filter", role: "search", onsubmit: (event) => event.preventDefault() },
    element("label", { for: findId }, "Find"),
    text,
    element(
      "span",
      { class: "tick" },
      only,
      element("label", { for: onlyId }, "only with trouble"),
    ),
  );
  return { root, again, wantsTrouble: () => only.checked };
}

function show(cards, words, troubled) {
  for (const card of cards.values()) {
    const found = words.every((word) => card.words.includes(word));
    setAttribute(card.root, "hidden", !found || (troubled && FINE.includes(card.standing)));
  }
}

function createBus(bus, readOnly, cards) {
  const id = freshId("bus");
  const load = element("span", { class: "number" }, NOTHING);
  const bar = element("span", { class: "load-bar", "aria-hidden": "true" }, element("span"));
  const masters = new Map();
  for (const master of bus.masters) masters.set(master.id, createMaster(master));
  const grid = element("ul", { class: "cards" });
  for (const device of bus.devices) {
    const card = createCard({ bus: bus.id, device: device.id }, device, readOnly);
    cards.set(`${bus.id}/${device.id}`, card);
    grid.append(card.root);
  }
  const facts = element(
    "dl",
    { class: "bus-facts" },
    fact("bit rate", element("span", {}, bus.bit_rate)),
    fact("load", element("span", {}, bar, load)),
    ...[...masters.values()].map((master) => master.root),
    fact("port", element("span", { class: "port" }, bus.uri)),
  );
  const root = element(
    "section",
    { class: "bus", "aria-labelledby": id },
    element(
      "div",
      { class: "bus-head" },
      element("h2", { id }, bus.id, element("span", { class: "kind" }, bus.bus)),
      facts,
    ),
    grid,
  );
  return {
    root,
    id: bus.id,
    update(now) {
      setText(load, percent(now?.load));
      const share = Math.min(now?.load ?? 0, 1);
      bar.firstChild.style.transform = `scaleX(${share.toFixed(3)})`;
      for (const [name, master] of masters) master.update(now?.masters?.[name]);
    },
  };
}

function fact(name, value) {
  return element("div", {}, element("dt", {}, name), element("dd", {}, value));
}

function createMaster({ id, address }) {
  const text = element("span", { class: "number" }, NOTHING);
  return {
    root: fact(id.endsWith(` ${address}`) ? id : `${id} (${address})`, text),
    update(now) {
      if (!now) setText(text, NOTHING);
      else if (!now.on_line) setText(text, "off-line");
      else
        setText(
          text,
          `cycle ${milliseconds(now.cycle_ms)}, longest ${milliseconds(now.longest_ms)}`,
        );
    },
  };
}

/** How an encoder stands, in the order in which it matters. */
function standing(device) {
  if (!device) return "unknown";
  if (!device.power) return "off";
  if (device.alarm) return "alarm";
  if (device.warning) return "warning";
  return device.faults?.length ? "fault" : "good";
}

/** What the badge of a card says. */
const STANDINGS = {
  unknown: "",
  off: "no power",
  alarm: "alarm",
  warning: "warning",
  fault: "fault provoked",
  good: "",
};
const FINE = ["good", "unknown"];

function createCard(place, fixed_, readOnly) {
  const dial = createSmallDial();
  const lamp = createLamp();
  const number = () => element("span", { class: "number" }, NOTHING);
  const [position, angle, turns, speed, master, address] = Array.from({ length: 6 }, number);
  const state = element("span", {}, NOTHING);
  const alarm = element("span", { class: "standing" });
  const power = createPower(place, fixed_.id, readOnly);
  const id = freshId("card");
  const cell = (name, ...value) =>
    element("div", {}, element("dt", {}, name), element("dd", {}, ...value));
  const root = element(
    "li",
    { class: "card" },
    element(
      "div",
      { class: "card-head" },
      element("h3", { id }, element("a", { href: linkTo(place) }, fixed_.id)),
      element("span", { class: "model" }, fixed_.title),
      power.root,
    ),
    element(
      "div",
      { class: "card-main" },
      dial.root,
      element(
        "div",
        { class: "card-position" },
        element("p", { class: "big" }, position),
        element("p", { class: "fine" }, angle, " · turn ", turns),
        element("p", { class: "fine" }, speed, " rpm"),
      ),
    ),
    element("div", { class: "card-lamp" }, lamp.root, alarm),
    element(
      "dl",
      { class: "card-facts" },
      cell("address", address),
      cell("state", state),
      cell("master", master),
    ),
    power.outcome.root,
  );
  const card = {
    root,
    place,
    standing: "unknown",
    words: `${place.bus} ${fixed_.id} ${fixed_.model} ${fixed_.title}`.toLowerCase(),
    update(device) {
      dial.update(device, fixed_);
      lamp.update(device?.lamp);
      const on = device?.power;
      setText(position, on ? whole(device.position) : NOTHING);
      setText(angle, on ? degrees(device.angle) : NOTHING);
      setText(turns, on ? whole(device.turns) : NOTHING);
      setText(speed, on ? fixed(device.rpm, 1) : NOTHING);
      setText(address, device?.address ?? NOTHING);
      setText(state, on ? (device.state ?? NOTHING) : device ? "no power" : NOTHING);
      setText(master, masterText(device?.master));
      card.standing = standing(device);
      setAttribute(root, "data-standing", card.standing);
      setText(alarm, STANDINGS[card.standing]);
      power.update(device ? Boolean(on) : null);
    },
  };
  return card;
}

function masterText(master) {
  if (!master) return "none";
  if (master.state !== "running") return `${master.id}: ${master.state}`;
  return `${master.id}, ${fixed(master.answers_per_second, 0)}/s`;
}

function createPower(place, name, readOnly) {
  const outcome = new Outcome();
  let on = null;
  const word = element("span", {}, NOTHING);
  const root = element(
    "button",
    {
      type: "button",
      class: "power",
      "aria-pressed": "false",
      disabled: true,
      title: readOnly ? "The page is read-only." : "Power",
      onclick: () => send(),
    },
    element("span", { class: "unseen" }, `Power of ${name} `),
    word,
  );
  async function send() {
    try {
      await command(place, "PUT", "power", { on: !on });
      outcome.tell("");
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      outcome.tell(error.message, true);
    }
  }
  return {
    root,
    outcome,
    update(now) {
      on = now;
      setAttribute(root, "aria-pressed", String(Boolean(on)));
      setAttribute(root, "disabled", readOnly || on === null);
      setText(word, on === null ? NOTHING : on ? "on" : "off");
    },
  };
}
