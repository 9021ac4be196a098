/** @file The last minute of every encoder, kept while the page is open. */

const SPAN = 60;
/** A sample that came so soon after the one before gives its place to the next; seconds. */
const CLOSEST = 0.1;
const ROOM = 640;

/** A ring of samples of one encoder: time, position, what the master got, speed. */
export class History {
  #times = new Float64Array(ROOM);
  #columns = {
    position: new Float64Array(ROOM),
    polled: new Float64Array(ROOM),
    rpm: new Float64Array(ROOM),
  };
  #end = 0;
  #length = 0;

  /** Takes what the state tells at `at`, in seconds from the start of the plant. */
  push(at, device) {
    const before = (this.#end + ROOM - 1) % ROOM;
    // A time that goes back is that of another run of the plant.
    if (this.#length > 0 && at < this.#times[before]) this.#length = 0;
    const earlier = (this.#end + ROOM - 2) % ROOM;
    const close = this.#length > 1 && this.#times[before] - this.#times[earlier] < CLOSEST;
    const place = close ? before : this.#end;
    if (!close) {
      this.#end = (this.#end + 1) % ROOM;
      this.#length = Math.min(this.#length + 1, ROOM);
    }
    const on = device?.power;
    this.#times[place] = at;
    this.#columns.position[place] = on ? (device.position ?? NaN) : NaN;
    this.#columns.polled[place] = device?.master?.position ?? NaN;
    this.#columns.rpm[place] = on ? (device.rpm ?? NaN) : NaN;
  }

  /**
   * The samples of the last minute before `now`, oldest first, and the one before them, which
   * still held when the minute began.
   * @param {"position"|"polled"|"rpm"} column
   * @returns {{at: number, value: number}[]} `value` is NaN where there was none
   */
  last(now, column) {
    const samples = [];
    for (let back = 1; back <= this.#length; back += 1) {
      const place = (this.#end + ROOM - back) % ROOM;
      samples.push({ at: this.#times[place], value: this.#columns[column][place] });
      if (this.#times[place] < now - SPAN) break;
    }
    return samples.reverse();
  }
}

/** The histories of all encoders of a plant. */
export class Histories {
  #all = new Map();

  /** The history of one encoder. */
  of({ bus, device }) {
    const key = `${bus}/${device}`;
    if (!this.#all.has(key)) this.#all.set(key, new History());
    return this.#all.get(key);
  }

  /** Takes what a patch has changed. */
  take(state, patch) {
    for (const [bus, changes] of Object.entries(patch.buses ?? {})) {
      for (const device of Object.keys(changes?.devices ?? {})) {
        const now = state.buses[bus]?.devices?.[device];
        if (now) this.of({ bus, device }).push(state.at, now);
      }
    }
  }
}

/**
 * Lowest, highest and newest value of samples; `null` where there is no value.
 * @param {{value: number}[]} samples
 */
export function extremes(samples) {
  let [min, max, now] = [null, null, null];
  for (const { value } of samples) {
    if (Number.isNaN(value)) continue;
    if (min === null || value < min) min = value;
    if (max === null || value > max) max = value;
  }
  const newest = samples.at(-1)?.value;
  if (newest !== undefined && !Number.isNaN(newest)) now = newest;
  return { min, max, now };
}
