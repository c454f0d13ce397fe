// Pointer and keyboard on the plan view: handles are moved, the ground moves the view, parts are chosen.
import { watchPointers } from "../page/pointer.mjs";
import { anchorOf, moved } from "./setup.mjs";
import { snapped, stepOf } from "./snap.mjs";

const REACH_PX = 9;
const PAN_PX = 60;

export function watchHands(app) {
  const { drawing } = app;
  const { sheet } = drawing;
  let drag = null;

  const grabbed = (event) => {
    const handle = event.target.closest?.("[data-handle]");
    if (handle) return handle.getAttribute("data-handle");
    // The yard is moved by its ground too, but not by a finger: that moves the view.
    return event.pointerType === "touch" ? null : event.target.closest?.("[data-area]")?.getAttribute("data-area") ?? null;
  };

  // Before the listeners that move the view: what is grabbed is no longer theirs.
  sheet.addEventListener(
    "pointerdown",
    (event) => {
      const id = event.button === 0 && !event.shiftKey ? grabbed(event) : null;
      if (drag) event.stopImmediatePropagation();
      if (drag || !id || !app.opened) return;
      event.stopImmediatePropagation();
      event.preventDefault();
      sheet.setPointerCapture(event.pointerId);
      drawing.handles.get(id)?.focus({ preventScroll: true });
      const anchor = anchorOf(app.setup, id);
      const at = drawing.metresAt(event);
      drag = { id, pointer: event.pointerId, start: app.setup, anchor, offset: [anchor[0] - at[0], anchor[1] - at[1]], from: [event.clientX, event.clientY], begun: false };
    },
    true,
  );
  sheet.addEventListener("pointermove", (event) => {
    if (!drag) return hover(event);
    if (event.pointerId !== drag.pointer) return;
    if (!drag.begun && Math.hypot(event.clientX - drag.from[0], event.clientY - drag.from[1]) < 4) return;
    drag.begun = true;
    const at = drawing.metresAt(event);
    const wanted = [at[0] + drag.offset[0], at[1] + drag.offset[1]];
    const { at: place } = snapped(wanted, drawing.edges, REACH_PX * drawing.view.scale, event.altKey);
    if (drag.place?.every((value, axis) => value === place[axis])) return; // it snaps to where it is already
    drag.place = place;
    app.preview(moved(drag.start, drag.id, [place[0] - drag.anchor[0], place[1] - drag.anchor[1]]), drag.id);
  });
  const end = (event) => {
    if (!drag || event.pointerId !== drag.pointer) return;
    const { id, begun } = drag;
    drag = null;
    if (begun && event.type === "pointerup") app.settle(`move of ${app.labelOf(id)}`);
    else app.preview(null);
    if (!begun && event.type === "pointerup") app.announceHandle(id);
  };
  sheet.addEventListener("pointerup", end);
  sheet.addEventListener("pointercancel", end);

  watchPointers(sheet, {
    orbit: (dx, dy) => !drag && drawing.pan(dx, dy),
    pan: (dx, dy) => !drag && drawing.pan(dx, dy),
    zoom: (factor, x, y) => drawing.zoom(factor, x === undefined ? undefined : [((x + 1) / 2) * drawing.view.width, ((1 - y) / 2) * drawing.view.height]),
    choose: (x, y) => {
      const box = sheet.getBoundingClientRect();
      const part = document.elementFromPoint(box.left + x, box.top + y)?.closest?.("[data-part]");
      app.choose(part && !part.classList.contains("ghost") ? part.getAttribute("data-part") : null);
    },
  });

  function hover(event) {
    if (event.pointerType === "touch") return;
    const part = event.target.closest?.("[data-part]");
    app.hint(part && !part.classList.contains("ghost") ? part.getAttribute("data-part") : null);
  }
  sheet.addEventListener("pointerleave", () => app.hint(null));

  sheet.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || !app.opened) return;
    if (event.key === "Escape" && drag) {
      drag = null;
      app.preview(null);
      event.stopPropagation();
      return;
    }
    const id = event.target.getAttribute("data-handle");
    const step = stepOf(event.key, event.shiftKey);
    const zoom = { "+": 0.8, "=": 0.8, "-": 1.25 }[event.key];
    if (id && step) {
      app.nudge(id, step, event.repeat);
      drawing.reveal(anchorOf(app.setup, id));
    } else if (id && (event.key === "Enter" || event.key === " ")) app.showFields(id);
    else if (id && (event.key === "Delete" || event.key === "Backspace")) app.removeCorner(id);
    else if (id && event.key === "Insert") app.addCorner(id);
    else if (!id && step) drawing.pan(-Math.sign(step[0]) * PAN_PX, Math.sign(step[1]) * PAN_PX);
    else if (zoom) drawing.zoom(zoom);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  sheet.addEventListener("focusin", (event) => {
    const id = event.target.getAttribute?.("data-handle");
    if (id && event.target.matches(":focus-visible")) drawing.reveal(anchorOf(app.setup, id));
  });
}
