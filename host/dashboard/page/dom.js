/** @file Nodes of the document: made in one call, written only when something changed. */

const SVG = "http://www.w3.org/2000/svg";

/**
 * Makes an HTML element. Text goes in as text, never as markup.
 * @param {string} name
 * @param {Object<string, string|number|boolean|null|undefined|function>} [attributes] `true` sets
 *   an empty attribute, `false` and `null` none; a function under `onclick` and the like listens.
 * @param {...(Node|string|null|undefined)} children
 * @returns {HTMLElement}
 */
export function element(name, attributes = {}, ...children) {
  return furnish(document.createElement(name), attributes, children);
}

/**
 * Makes an SVG element; otherwise as {@link element}.
 * @returns {SVGElement}
 */
export function svg(name, attributes = {}, ...children) {
  return furnish(document.createElementNS(SVG, name), attributes, children);
}

function furnish(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") node.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child != null));
  return node;
}

const texts = new WeakMap();

/** Writes the text of a node, and touches it only where the text is another one. */
export function setText(node, text) {
  const written = String(text);
  if (texts.get(node) === written) return;
  texts.set(node, written);
  node.textContent = written;
}

/** Sets an attribute, or takes it away for `null` and `false`, only where it changes. */
export function setAttribute(node, name, value) {
  if (value == null || value === false) {
    if (node.hasAttribute(name)) node.removeAttribute(name);
    return;
  }
  const written = value === true ? "" : String(value);
  if (node.getAttribute(name) !== written) node.setAttribute(name, written);
}

let numbers = 0;

/** A fresh id, for a label and what it labels. */
export function freshId(word) {
  numbers += 1;
  return `${word}-${numbers}`;
}
