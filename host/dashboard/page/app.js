/** @file The page: which view is shown, the link to the plant, one picture after the other. */

import { fetchPlant, Refusal } from "./api.js";
import { element, setText } from "./dom.js";
import { createEncoder } from "./encoder.js";
import { Histories } from "./history.js";
import { createOverview } from "./overview.js";
import { encoderAt } from "./routes.js";
import { PlantState } from "./state.js";
import { installTheme } from "./theme.js";
import { clock } from "./units.js";

/** Messages a second: many encoders on one page need not all tell so often. */
const [FAST, CALM] = [20, 10];
const MANY = 24;
const RETRY = 2000;
/** How long a page may be hidden before it lets go of its stream, in ms. */
const HIDDEN = 60_000;

const byId = (id) => document.getElementById(id);
const main = byId("main");

installTheme(byId("theme"));
byId("skip").addEventListener("click", (event) => {
  // The address of the view stands behind the hash, so the link must not follow its own.
  event.preventDefault();
  main.focus();
});
start();

async function start() {
  let plant = null;
  while (plant === null) {
    try {
      plant = await fetchPlant();
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      warn(`${error.message} Trying again …`);
      await new Promise((resolve) => setTimeout(resolve, RETRY));
    }
  }
  warn("");
  setText(byId("plant-name"), plant.name ?? "");
  setText(byId("version"), `codewheel ${plant.version}`);
  byId("read-only").hidden = !plant.read_only;
  show(plant);
}

function show(plant) {
  const live = new PlantState();
  const histories = new Histories();
  const overview = createOverview(plant, live);
  const encoders = plant.buses.reduce((sum, bus) => sum + bus.devices.length, 0);
  main.append(overview.root);
  let view = null;
  let scrolled = 0;

  const route = () => {
    const first = view === null;
    const found = encoderAt(plant, location.hash);
    if (view === overview) scrolled = scrollY;
    else if (view) {
      view.close();
      view.root.remove();
    }
    overview.root.hidden = found !== null;
    view = found
      ? createEncoder({ plant, ...found, live, history: histories.of(found.place) })
      : overview;
    if (found) main.append(view.root);
    document.title = `${view.title} – Codewheel`;
    live.want({
      device: view.wants?.device ?? null,
      rate: found || encoders <= MANY ? FAST : CALM,
    });
    if (first) return;
    scrollTo(0, found ? 0 : scrolled);
    view.heading.focus({ preventScroll: true });
  };

  live.addEventListener("state", ({ detail }) => {
    histories.take(live.state, detail.patch);
    overview.take(detail);
    if (view !== overview) view.take(detail);
  });
  live.addEventListener("link", () => {
    if (live.link === "live") reloadIfAnother(plant);
    showLink(live);
  });
  sleepWhileHidden(live);
  addEventListener("hashchange", route);
  route();

  const time = byId("stream-text");
  const picture = (now) => {
    view.frame(now);
    if (live.link === "live") setText(time, `live, ${clock(live.state.at)}`);
    requestAnimationFrame(picture);
  };
  requestAnimationFrame(picture);
}

/**
 * A browser has six connections for a plant, so pages that nobody looks at must not hold them all.
 * For a while they do, since who comes back wants to see the last minute.
 */
function sleepWhileHidden(live) {
  let timer = null;
  document.addEventListener("visibilitychange", () => {
    clearTimeout(timer);
    if (document.hidden) timer = setTimeout(() => live.sleep(), HIDDEN);
    else live.wake();
  });
}

/** What answers again after a while may be another plant, or the same one with other devices. */
async function reloadIfAnother(plant) {
  try {
    const now = await fetchPlant();
    if (JSON.stringify(now) !== JSON.stringify(plant)) location.reload();
  } catch (error) {
    // The link tells by itself that it is lost again.
    if (!(error instanceof Refusal)) throw error;
  }
}

function showLink(live) {
  document.documentElement.dataset.link = live.link;
  if (live.link === "lost") {
    setText(byId("stream-text"), "lost");
    warn("The plant does not answer. What you see is old; trying again …");
  } else warn("");
}

function warn(text) {
  const banner = byId("banner");
  banner.hidden = text === "";
  banner.replaceChildren(text ? element("p", {}, text) : "");
}
