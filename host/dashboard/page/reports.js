/** @file What happened: the newest events, of the plant or of one encoder. */

import { element } from "./dom.js";
import { panel } from "./panel.js";
import { clock } from "./units.js";

const SHOWN = 60;

/**
 * The list of events, newest first.
 * @param {import("./state.js").PlantState} live
 * @param {{title: string, only?: {bus: string, device: string}}} options `only` leaves out what
 *   happened to other encoders
 */
export function createReports(live, { title, only }) {
  const list = element("ol", { class: "reports" });
  const none = element("p", { class: "hint" }, "Nothing has happened yet.");
  const seat = element(
    "div",
    { class: "scroll", tabindex: 0, role: "group", "aria-label": title },
    none,
    list,
  );
  const { root, body } = panel(title, "events");
  body.append(seat);

  const concerns = (report) =>
    !only || (report.bus === only.bus && (report.device ?? only.device) === only.device);
  const entry = (report) => {
    const from = [report.bus, report.device].filter(Boolean).join("/");
    return element(
      "li",
      { class: report.trouble ? "trouble" : null },
      element("time", {}, clock(report.at, 2)),
      only ? null : element("span", { class: "from" }, from),
      element("span", {}, report.trouble ? element("strong", {}, "! ") : null, report.text),
    );
  };
  const fill = () => {
    const shown = live.reports.filter(concerns).slice(-SHOWN).reverse();
    list.replaceChildren(...shown.map(entry));
    none.hidden = shown.length > 0;
  };
  const take = ({ detail: report }) => {
    if (report === null) return fill();
    if (!concerns(report)) return;
    list.prepend(entry(report));
    if (list.children.length > SHOWN) list.lastChild.remove();
    none.hidden = true;
  };
  live.addEventListener("report", take);
  fill();
  return { root, close: () => live.removeEventListener("report", take) };
}
