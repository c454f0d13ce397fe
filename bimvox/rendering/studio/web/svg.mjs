// Makes SVG elements. Text always becomes text nodes.
import { plain } from "../page/words.mjs";

const SPACE = "http://www.w3.org/2000/svg";

export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SPACE, tag);
  set(element, attributes);
  element.append(...children.filter((child) => child !== null && child !== undefined).map((child) => (typeof child === "string" ? plain(child) : child)));
  return element;
}

/** Set attributes that have changed; functions become listeners. */
export function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (value === null || value === undefined || value === false) element.removeAttribute(name);
    else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
  }
}

/** Polygons as path data; `at`: from metres to the coordinates of the drawing. */
export const pathOf = (polygons, at = (point) => point) =>
  polygons.map((polygon) => `M${polygon.map((point) => at(point).map((value) => Math.round(value * 1000) / 1000).join(" ")).join("L")}Z`).join("");

/** A text with a halo, legible over lines. */
export const label = (text, [x, y], attributes = {}) => svg("text", { x, y, class: "label", "text-anchor": "middle", ...attributes }, text);
