/** @file A number as the two words that configuration tools ask for, and back. */

import { element, freshId, setText } from "./dom.js";
import { panel } from "./panel.js";
import { hexadecimal, joinWords, parseWhole, splitWords } from "./units.js";

/** The panel that splits and joins. It sends nothing. */
export function createHilo() {
  const { root, body } = panel("Hi and lo word", "hilo");
  const field = (name, size) => {
    const id = freshId("word");
    const input = element("input", {
      id,
      type: "text",
      size,
      inputmode: "text",
      autocomplete: "off",
    });
    const hex = element("span", { class: "fine number" });
    const seat = element("div", { class: "word" }, element("label", { for: id }, name), input, hex);
    return { seat, input, hex };
  };
  const value = field("Value", 12);
  const hi = field("Hi", 6);
  const lo = field("Lo", 6);
  const told = element("p", { class: "hint" });

  const show = (number, words, from) => {
    if (from !== value) value.input.value = number;
    if (from === value) {
      hi.input.value = words.hi;
      lo.input.value = words.lo;
    }
    setText(value.hex, hexadecimal(number, 8));
    setText(hi.hex, hexadecimal(words.hi, 4));
    setText(lo.hex, hexadecimal(words.lo, 4));
    setText(told, "value = hi × 65536 + lo");
  };
  const split = () => {
    const number = parseWhole(value.input.value);
    const words = number === null ? null : splitWords(number);
    if (words) show(number, words, value);
    else setText(told, "Write a number of 32 bits, as 921600 or E1000h.");
  };
  const join = () => {
    const words = { hi: parseWhole(hi.input.value), lo: parseWhole(lo.input.value) };
    const number = joinWords(words.hi, words.lo);
    if (number !== null) show(number, words, hi);
    else setText(told, "Each word is 0 to 65535, as 4096 or 1000h.");
  };
  value.input.addEventListener("input", split);
  hi.input.addEventListener("input", join);
  lo.input.addEventListener("input", join);
  body.append(element("div", { class: "words" }, value.seat, hi.seat, lo.seat), told);
  value.input.value = "921600";
  split();
  return { root };
}
