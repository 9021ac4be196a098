/** @file Dials: the shaft as it stands, seen looking at the flange, and where position 0 lies. */

import { element, setAttribute, svg } from "./dom.js";
import { modulo } from "./units.js";

/** Above this speed a needle cannot be followed with 20 pictures a second; it becomes a fan. */
const BLUR_RPM = 240;
/** How long a needle goes on by the speed alone, in ms. */
const COAST = 120;

/**
 * Where the shaft stands and where position 0 lies, as shares of a turn clockwise.
 * @param {object} device as the state tells it
 * @param {{steps: number}} fixed as the plant tells it
 * @returns {{shaft: number|null, zero: number|null, speed: number}} `speed` in rpm, clockwise;
 *   `null` where nobody knows, `zero` without power too
 */
export function angles(device, { steps }) {
  if (!device?.power || typeof device.angle !== "number") {
    // A shaft turns without power too; only nobody measures it.
    const code = device?.shaft?.code;
    const known = typeof code === "number" && steps > 0;
    return { shaft: known ? modulo(code / steps, 1) : null, zero: null, speed: 0 };
  }
  const clockwise = device.direction === "CCW" ? -1 : 1;
  const speed = (device.rpm ?? 0) * clockwise;
  const hasCode = typeof device.code === "number" && steps > 0;
  const shaft = hasCode ? modulo(device.code / steps, 1) : modulo(device.angle * clockwise, 1);
  const { offset, steps_per_turn: scaled, total_resolution: total } = device;
  // Where the range is whole turns the offset alone says it, without the rounding of a position.
  const comesOutEven = hasCode && scaled > 0 && typeof offset === "number" && total % scaled === 0;
  const zero = comesOutEven
    ? modulo((-offset / scaled) * clockwise, 1)
    : modulo(shaft - device.angle * clockwise, 1);
  return { shaft, zero, speed };
}

/** A small dial for the overview: needle, marks and where position 0 lies. */
export function createSmallDial() {
  const needle = svg(
    "g",
    { class: "needle" },
    svg("path", { d: "M-3.4 0 L-0.8-40 L0.8-40 L3.4 0 L2 15 L-2 15Z" }),
  );
  const zero = svg("path", { class: "zero", d: "M-5-47 L5-47 L0-39Z" });
  const face = svg("circle", { class: "face", r: 46 });
  const marks = svg("path", { class: "marks", d: ticks(12, 41, 45) });
  const root = svg(
    "svg",
    { class: "dial small", viewBox: "-50 -50 100 100", "aria-hidden": "true" },
    face,
    marks,
    zero,
    needle,
    svg("circle", { class: "hub", r: 6 }),
  );
  return {
    root,
    update(device, fixed) {
      const { shaft, zero: mark } = angles(device, fixed);
      setAttribute(root, "data-off", mark === null);
      setAttribute(needle, "transform", `rotate(${((shaft ?? 0) * 360).toFixed(1)})`);
      if (mark !== null) setAttribute(zero, "transform", `rotate(${(mark * 360).toFixed(1)})`);
    },
  };
}

/**
 * The large dial: a code disc on its shaft, the needle, degrees, the mark of position 0, and an
 * arrow in the direction in which positions grow.
 * @param {string} shaft what kind of shaft: `solid`, `hollow`, or none
 */
export function createLargeDial(shaft) {
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const disc = svg("g", { class: "disc" }, ...tracks(), ...shaftEnd(shaft));
  const fan = svg("path", { class: "fan" });
  const needle = svg(
    "g",
    { class: "needle" },
    fan,
    svg("path", { d: "M-2.2-30 L-1.4-97 L0-101 L1.4-97 L2.2-30Z" }),
  );
  const zero = svg(
    "g",
    { class: "zero" },
    svg("path", { d: "M-6-118 L6-118 L0-107Z" }),
    svg("text", { y: -124.5 }, "0"),
  );
  const arrow = svg("path", {
    class: "arrow",
    d: "M-21-12 A24 24 0 0 1 21-12 M21-12 l-8-1.6 M21-12 l1.6-8",
  });
  const root = svg(
    "svg",
    { class: "dial large", viewBox: "-131 -131 262 262", "aria-hidden": "true" },
    svg("circle", { class: "bezel", r: 106 }),
    svg("circle", { class: "face", r: 104 }),
    svg("path", { class: "marks fine", d: ticks(180, 101, 104) }),
    svg("path", { class: "marks", d: ticks(36, 98, 104) }),
    svg("path", { class: "marks strong", d: ticks(12, 95, 104) }),
    ...labels(),
    disc,
    needle,
    zero,
    svg("g", { class: "arrow-seat" }, arrow),
  );
  let last = { shaft: null, zero: null, speed: 0 };
  let since = 0;

  return {
    root: element("div", { class: "dial-seat" }, root),
    /** Takes what the state tells now. */
    update(device, fixed) {
      const next = angles(device, fixed);
      if (next.shaft !== last.shaft) since = performance.now();
      last = next;
      setAttribute(root, "data-off", next.zero === null);
      setAttribute(root, "data-direction", device?.direction ?? "CW");
      if (next.zero !== null)
        setAttribute(zero, "transform", `rotate(${(next.zero * 360).toFixed(2)})`);
      const blur = Math.abs(next.speed) > BLUR_RPM;
      setAttribute(
        fan,
        "d",
        blur ? sector(Math.sign(next.speed), Math.min(Math.abs(next.speed) / 1500, 0.9)) : null,
      );
    },
    /** Draws one picture; called with each frame. */
    frame(now) {
      if (last.shaft === null) return;
      const coast =
        still.matches || Math.abs(last.speed) > BLUR_RPM ? 0 : Math.min(now - since, COAST);
      const turn = last.shaft + (last.speed / 60_000) * Math.max(coast, 0);
      const angle = `rotate(${(modulo(turn, 1) * 360).toFixed(2)})`;
      setAttribute(disc, "transform", angle);
      setAttribute(needle, "transform", angle);
    },
  };
}

function point(share, radius) {
  const angle = share * 2 * Math.PI;
  return `${(Math.sin(angle) * radius).toFixed(2)} ${(-Math.cos(angle) * radius).toFixed(2)}`;
}

function ticks(count, inner, outer) {
  const marks = Array.from({ length: count }, (_, mark) => mark / count);
  return marks.map((share) => `M${point(share, inner)} L${point(share, outer)}`).join("");
}

function labels() {
  return Array.from({ length: 12 }, (_, mark) => {
    const [x, y] = point(mark / 12, 86).split(" ");
    return svg("text", { class: "degree", x, y }, String(mark * 30));
  });
}

/** Tracks of a Gray code disc, the coarsest inside, as the encoder carries one. */
function tracks() {
  const sectors = 64;
  const gray = (code) => code ^ (code >> 1);
  return [5, 4, 3, 2, 1, 0].map((bit, track) => {
    const [inner, outer] = [36 + track * 6.6, 40.8 + track * 6.6];
    let path = "";
    for (let code = 0; code < sectors; code += 1) {
      const begins = (gray(code) >> bit) & 1 && !((gray(modulo(code - 1, sectors)) >> bit) & 1);
      if (!begins) continue;
      let end = code;
      while ((gray(end % sectors) >> bit) & 1) end += 1;
      path += ring(code / sectors, end / sectors, inner, outer);
    }
    return svg("path", { class: "track", d: path });
  });
}

function ring(from, to, inner, outer) {
  const large = to - from > 0.5 ? 1 : 0;
  return (
    `M${point(from, outer)}A${outer} ${outer} 0 ${large} 1 ${point(to, outer)}` +
    `L${point(to, inner)}A${inner} ${inner} 0 ${large} 0 ${point(from, inner)}Z`
  );
}

function shaftEnd(shaft) {
  const hub = svg("circle", { class: "hub", r: 30 });
  if (shaft === "hollow") {
    return [
      hub,
      svg("circle", { class: "bore", r: 19 }),
      svg("path", { class: "bore", d: "M-4-17h8v-6h-8Z" }),
    ];
  }
  if (shaft !== "solid") return [hub];
  return [hub, svg("path", { class: "shaft-end", d: "M-11.5-12 A16.6 16.6 0 1 0 11.5-12Z" })];
}

function sector(sign, share) {
  const [from, to] = sign > 0 ? [-share, 0] : [0, share];
  return ring(modulo(from, 1), modulo(from, 1) + (to - from), 32, 98);
}
