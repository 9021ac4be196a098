/** @file The state of the plant, kept up to date by its event stream. */

import { eventsAddress } from "./api.js";

/** How long nothing may come before the stream is opened anew, in ms. */
const SILENCE = 15_000;
const FIRST_PAUSE = 500;
const LONGEST_PAUSE = 5_000;
const REPORTS = 200;

/**
 * Applies a JSON merge patch (RFC 7396) to `target`, in place where both are objects.
 * @returns {*} the patched value
 */
export function mergePatch(target, patch) {
  if (!isObject(patch)) return patch;
  const merged = isObject(target) ? target : {};
  for (const [key, value] of Object.entries(patch)) {
    if (value === null) delete merged[key];
    else merged[key] = mergePatch(merged[key], value);
  }
  return merged;
}

function isObject(value) {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

/**
 * The live state and what was reported. It tells its listeners by events:
 *
 * - `state` – `detail` is the patch that was applied; `state` is up to date
 * - `report` – `detail` is a report; `reports` has it as the last one
 * - `objects`, `trace` – `detail` is what came
 * - `link` – `link` is another one
 */
export class PlantState extends EventTarget {
  /** The state as the API tells it; empty until the first message. */
  state = { at: 0, buses: {} };
  /** The newest reports, oldest first. */
  reports = [];
  /** @type {"connecting"|"live"|"lost"} */
  link = "connecting";

  #wants = {};
  #source = null;
  #fresh = true;
  #pause = FIRST_PAUSE;
  #retry = null;
  #watchdog = null;

  /** The state of one device, or `undefined`. */
  device({ bus, device }) {
    return this.state.buses?.[bus]?.devices?.[device];
  }

  /**
   * Says what the stream shall carry, and opens it anew if that is something else.
   * @param {{device?: string|null, trace?: string|null, rate?: number}} wants
   */
  want(wants) {
    const next = { ...this.#wants, ...wants };
    if (this.#source && eventsAddress(next) === eventsAddress(this.#wants)) return;
    this.#wants = next;
    this.#open();
  }

  /** Lets go of the stream, as nobody looks. {@link wake} takes it up again. */
  sleep() {
    this.#close();
  }

  /** Takes the stream up again, where it was let go. */
  wake() {
    if (!this.#source) this.#open();
  }

  #open() {
    this.#close();
    this.#fresh = true;
    const source = new EventSource(eventsAddress(this.#wants));
    this.#source = source;
    const on = (kind, take) =>
      source.addEventListener(kind, (event) => {
        this.#alive();
        take(JSON.parse(event.data));
      });
    on("state", (patch) => {
      // The first message is whole: what it does not name is gone.
      this.state = this.#fresh ? patch : mergePatch(this.state, patch);
      this.#tell("state", { patch, whole: this.#fresh });
      this.#fresh = false;
    });
    on("reports", (all) => {
      this.reports = all;
      this.#tell("report", null);
    });
    on("report", (report) => {
      this.reports.push(report);
      if (this.reports.length > REPORTS) this.reports.shift();
      this.#tell("report", report);
    });
    on("objects", (values) => this.#tell("objects", values));
    on("trace", (lines) => this.#tell("trace", lines));
    // The browser would try again by itself after some failures, not after all.
    source.addEventListener("error", () => this.#lost());
    this.#watch();
  }

  #alive() {
    this.#pause = FIRST_PAUSE;
    this.#watch();
    this.#setLink("live");
  }

  #watch() {
    clearTimeout(this.#watchdog);
    this.#watchdog = setTimeout(() => this.#lost(), SILENCE);
  }

  #lost() {
    this.#close();
    this.#setLink("lost");
    this.#retry = setTimeout(() => this.#open(), this.#pause);
    this.#pause = Math.min(this.#pause * 2, LONGEST_PAUSE);
  }

  #close() {
    clearTimeout(this.#retry);
    clearTimeout(this.#watchdog);
    this.#source?.close();
    this.#source = null;
  }

  #setLink(link) {
    if (this.link === link) return;
    this.link = link;
    this.#tell("link", link);
  }

  #tell(kind, detail) {
    this.dispatchEvent(new CustomEvent(kind, { detail }));
  }
}
