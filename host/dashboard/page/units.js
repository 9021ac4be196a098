/** @file Numbers as people read and write them. Nothing here touches the document. */

/** What stands where there is no value. */
export const NOTHING = "–";

const MINUS = "\u2212";
const THIN = "\u202f";

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);

/** A whole number in groups of three digits: `12 345`. */
export function whole(value) {
  if (!isNumber(value)) return NOTHING;
  const digits = Math.abs(Math.round(value))
    .toString()
    .replace(/\B(?=(\d{3})+$)/g, THIN);
  return value < 0 && digits !== "0" ? MINUS + digits : digits;
}

/** A number with `decimals` decimals, grouped, and with a true minus sign. */
export function fixed(value, decimals) {
  if (!isNumber(value)) return NOTHING;
  const text = Math.abs(value).toFixed(decimals);
  const [front, back] = text.split(".");
  const sign = value < 0 && Number(text) !== 0 ? MINUS : "";
  const grouped = front.replace(/\B(?=(\d{3})+$)/g, THIN);
  return sign + grouped + (back === undefined ? "" : `.${back}`);
}

/** A share of a turn, 0 … 1, in degrees: never `360.0°`. */
export function degrees(share) {
  if (!isNumber(share)) return NOTHING;
  const tenths = Math.floor(modulo(share, 1) * 3600 + 1e-6) % 3600;
  return `${(tenths / 10).toFixed(1)}°`;
}

/** A share as per cent: `31 %`. */
export function percent(share, decimals = 0) {
  return isNumber(share) ? `${fixed(share * 100, decimals)}${THIN}%` : NOTHING;
}

/** Milliseconds with what three digits can say. */
export function milliseconds(value) {
  if (!isNumber(value)) return NOTHING;
  const decimals = value < 10 ? 3 : value < 100 ? 2 : 1;
  return `${fixed(value, decimals)}${THIN}ms`;
}

/** A time from the start of the plant: `4:07.25`, hours only where there are some. */
export function clock(seconds, decimals = 0) {
  if (!isNumber(seconds)) return NOTHING;
  const unit = 10 ** decimals;
  const parts = Math.floor(seconds * unit + 1e-6);
  const all = Math.floor(parts / unit);
  const two = (number) => String(number).padStart(2, "0");
  const hours = Math.floor(all / 3600);
  const minutes = Math.floor(all / 60) % 60;
  const front = hours > 0 ? `${hours}:${two(minutes)}` : `${minutes}`;
  const back = decimals > 0 ? `.${String(parts % unit).padStart(decimals, "0")}` : "";
  return `${front}:${two(all % 60)}${back}`;
}

/** Hexadecimal as the manuals write it: `E1000h`, with at least `digits` digits. */
export function hexadecimal(value, digits = 1) {
  if (!isNumber(value)) return NOTHING;
  const unsigned = value < 0 ? value + 2 ** 32 : value;
  return `${unsigned.toString(16).toUpperCase().padStart(digits, "0")}h`;
}

/**
 * A whole number as people and manuals write it: `921600`, `-4`, `0xE1000`, `E1000h`. Blanks that
 * group digits are taken.
 * @returns {number|null} `null` where the text is no number.
 */
export function parseWhole(text) {
  const plain = text.replace(/[\s\u202f_]/g, "").replace(MINUS, "-");
  if (/^-?\d+$/.test(plain)) return Number(plain);
  const match = /^0x([0-9a-f]+)$/i.exec(plain) ?? /^([0-9a-f]+)h$/i.exec(plain);
  return match ? Number.parseInt(match[1], 16) : null;
}

/**
 * A number of 32 bits as the two words that configuration tools ask for.
 * @returns {{hi: number, lo: number}|null} `null` where it has more than 32 bits.
 */
export function splitWords(value) {
  if (!Number.isInteger(value) || value < -(2 ** 31) || value >= 2 ** 32) return null;
  const unsigned = value < 0 ? value + 2 ** 32 : value;
  return { hi: Math.floor(unsigned / 65536), lo: unsigned % 65536 };
}

/** The number of two words; `null` where one is no word. */
export function joinWords(hi, lo) {
  const isWord = (word) => Number.isInteger(word) && word >= 0 && word <= 65535;
  return isWord(hi) && isWord(lo) ? hi * 65536 + lo : null;
}

/** The remainder that is never negative. */
export function modulo(value, divisor) {
  return ((value % divisor) + divisor) % divisor;
}

/**
 * The way from one value to another on a circle of `round` values, the shorter way round.
 * @returns {number} −round/2 … round/2
 */
export function shortestWay(from, to, round) {
  const way = modulo(to - from, round);
  return way > round / 2 ? way - round : way;
}
