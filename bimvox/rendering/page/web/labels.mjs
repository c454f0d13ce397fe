// Words at points of the site, drawn over the view.
import { byId, el, fill } from "./dom.mjs";

const GAP_PX = 4;

export class Labels {
  constructor() {
    this.groups = new Map();
    this.shown = [];
  }

  /** Sets the labels of a group: [{at, text}]. */
  set(name, entries) {
    const key = JSON.stringify(entries);
    if (this.groups.get(name)?.key === key) return;
    this.groups.set(name, { key, entries });
    this.shown = [...this.groups.values()].flatMap((group) => group.entries).map(({ at, text }) => ({ at, box: el("span", {}, text) }));
    fill(byId("labels"), ...this.shown.map(({ box }) => box));
  }

  /** Moves the labels to their places; one that would lie on another is left out. @param clip The camera's matrix. @param width, height CSS pixels */
  place(clip, width, height) {
    const taken = [];
    for (const { at, box } of this.shown) {
      const [x, y, , w] = [0, 1, 2, 3].map((row) => clip[row] * at[0] + clip[4 + row] * at[1] + clip[8 + row] * at[2] + clip[12 + row]);
      const left = ((x / w + 1) / 2) * width;
      const top = ((1 - y / w) / 2) * height;
      const [half, tall] = [(box.offsetWidth || 60) / 2 + GAP_PX, box.offsetHeight || 16];
      const clash = taken.some(([l, t, h]) => Math.abs(l - left) < h + half && Math.abs(t - top) < tall);
      box.style.visibility = w > 0 && !clash && left > 0 && left < width && top > 0 && top < height ? "visible" : "hidden";
      if (box.style.visibility === "hidden") continue;
      taken.push([left, top, half]);
      box.style.transform = `translate(-50%, -50%) translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
    }
  }
}
