/** @file The view of one encoder: its panels, and the links to its neighbours. */

import { command } from "./api.js";
import { createDevicePanel } from "./device.js";
import { element } from "./dom.js";
import { createFaults } from "./faults.js";
import { createHilo } from "./hilo.js";
import { createMeasured } from "./measured.js";
import { createMemory } from "./memory.js";
import { createObjects } from "./objects.js";
import { createReports } from "./reports.js";
import { linkTo } from "./routes.js";
import { createShaft } from "./shaft.js";
import { createTrace } from "./trace.js";

/**
 * The view of one encoder.
 * @param {object} options
 * @param {object} options.plant what does not change
 * @param {object} options.bus its bus in the plant
 * @param {object} options.device the encoder in the plant
 * @param {import("./state.js").PlantState} options.live
 * @param {import("./history.js").History} options.history
 */
export function createEncoder({ plant, bus, device, live, history }) {
  const place = { bus: bus.id, device: device.id };
  const context = {
    place,
    device,
    live,
    /** Why nothing can be changed, or `null`. */
    locked: plant.read_only ? "The page is read-only: start codewheel without --read-only." : null,
    send: (method, path, body) => command(place, method, path, body),
  };
  const heading = element("h1", { tabindex: -1 }, device.id);
  const reports = createReports(live, { title: "Events", only: place });
  const trace = createTrace(bus.id, device, live);
  const objects = createObjects(context);
  const parts = {
    shaft: createShaft(context),
    measured: createMeasured(context, history),
    device: createDevicePanel(context),
    memory: createMemory(context),
    faults: createFaults(context),
  };
  const subtitle = [device.title, bus.bus, device.product_name].filter(
    (text, index, all) => text && all.indexOf(text) === index,
  );
  const root = element(
    "div",
    { class: "encoder" },
    element(
      "div",
      { class: "encoder-head" },
      element(
        "nav",
        { "aria-label": "Encoders", class: "trail" },
        element("a", { href: "#/" }, "All encoders"),
        ...neighbours(plant, place),
      ),
      element(
        "div",
        { class: "names" },
        heading,
        element("p", { class: "model" }, subtitle.join(" · ")),
      ),
      context.locked ? element("p", { class: "notice" }, context.locked) : null,
    ),
    element("div", { class: "top" }, parts.shaft.root, parts.measured.root, parts.device.root),
    element(
      "div",
      { class: "lower" },
      element("div", { class: "column wide" }, objects.root, trace.root),
      element(
        "div",
        { class: "column" },
        parts.memory.root,
        createHilo().root,
        parts.faults.root,
        reports.root,
      ),
    ),
  );
  let changed = true;

  return {
    root,
    heading,
    title: `${device.id} · ${bus.id}`,
    wants: { device: `${bus.id}/${device.id}` },
    take({ patch, whole }) {
      changed ||= whole || Boolean(patch.buses?.[bus.id]?.devices?.[device.id]);
    },
    /** Writes what has changed since the last picture, and lets the needle go on. */
    frame(now) {
      const state = live.device(place);
      if (changed) for (const part of Object.values(parts)) part.update(state, now);
      changed = false;
      parts.shaft.frame(now, state);
      parts.measured.frame(now, state);
      trace.frame(now);
    },
    close() {
      reports.close();
      trace.close();
      objects.close();
    },
  };
}

function neighbours(plant, place) {
  const all = plant.buses.flatMap((bus) =>
    bus.devices.map((device) => ({ bus: bus.id, device: device.id })),
  );
  const here = all.findIndex((one) => one.bus === place.bus && one.device === place.device);
  const link = (text, one) =>
    one ? element("a", { href: linkTo(one) }, `${text} ${one.device}`) : null;
  return [link("Previous:", all[here - 1]), link("Next:", all[here + 1])];
}
