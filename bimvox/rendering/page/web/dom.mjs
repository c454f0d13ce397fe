// Makes elements. Text always becomes text nodes with its control characters written out, because names come from untrusted files.
import { plain } from "./words.mjs";

export const byId = (id) => document.getElementById(id);

/** An element with attributes, listeners (`onclick: ...`) and children (elements or text). */
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined).map((child) => (typeof child === "string" ? plain(child) : child)));
  return element;
}

export function fill(element, ...children) {
  element.replaceChildren(...children.filter((child) => child !== null && child !== undefined));
}

/** A list of terms: [term, text or element, long?]; entries without a value are left out. */
export function terms(entries) {
  const list = el("dl");
  for (const [term, value, long] of entries) {
    if (value === null || value === undefined || value === "") continue;
    list.append(el("dt", {}, term), el("dd", { class: long ? "long" : null }, value));
  }
  return list;
}
