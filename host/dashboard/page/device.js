/** @file The device as it is mounted: lamp, power, state on the bus, switches. */

import { element, setAttribute, setText } from "./dom.js";
import { createLamp } from "./lamp.js";
import { button, Outcome, panel, reading } from "./panel.js";
import { createSwitches } from "./switches.js";
import { NOTHING } from "./units.js";

/** How long the power is off when it is switched off and on, in ms. */
const OFF = 300;

/** The panel of the device. */
export function createDevicePanel(context) {
  const { device, locked, send } = context;
  const outcome = new Outcome();
  const lamp = createLamp();
  const state = reading("State");
  const master = reading("Master");
  const address = reading("Address");
  const serial = reading("Serial number");
  const health = element("p", { class: "health" });
  let on = false;

  const power = button("Power", () => outcome.of(send("PUT", "power", { on: !on })), {
    class: "power large",
    disabled: Boolean(locked),
    "aria-pressed": "false",
  });
  const cycle = button("Off and on", () => outcome.of(switchOffAndOn()), {
    disabled: Boolean(locked),
    title: "Switches the power off and on again",
  });
  async function switchOffAndOn() {
    if (on) await send("PUT", "power", { on: false });
    await new Promise((resolve) => setTimeout(resolve, OFF));
    return send("PUT", "power", { on: true });
  }

  const switches = createSwitches(context);
  const { root, body } = panel("Device", "device");
  body.append(
    element(
      "div",
      { class: "front" },
      element("div", { class: "lamp-large" }, lamp.root),
      health,
      element("div", { class: "power-row" }, power, cycle),
    ),
    outcome.root,
    element("dl", { class: "readings" }, address.root, state.root, master.root, serial.root),
    switches.root,
  );
  setText(serial.value, device.serial ?? NOTHING);
  return {
    root,
    update(now) {
      on = Boolean(now?.power);
      lamp.update(now?.lamp);
      setAttribute(power, "aria-pressed", String(on));
      setText(power, on ? "Power is on" : "Power is off");
      setText(state.value, on ? (now.state ?? NOTHING) : "no power");
      setText(master.value, on ? (now.network?.master ?? "none") : NOTHING);
      setText(address.value, now?.address ?? NOTHING);
      setText(health, healthOf(now, on));
      setAttribute(
        health,
        "data-standing",
        on && now.alarm ? "alarm" : on && now.warning ? "warning" : null,
      );
      switches.update(now?.switches, on);
    },
  };
}

function healthOf(now, on) {
  if (!on) return "";
  const parts = [now.alarm ? "Alarm" : "No alarm", now.warning ? "warning" : "no warning"];
  return parts.join(", ");
}
