// Mouse, pen and touch on the view: rotate, pan, zoom, choose.

const CLICK_PX = 5;

/** @param on {orbit(dx, dy), pan(dx, dy), zoom(factor, x, y), choose(x, y)}; dx, dy in CSS pixels, x, y within the element */
export function watchPointers(element, on) {
  const down = new Map();
  let moved = 0;
  let panning = false;

  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    if (!down.size) {
      moved = 0;
      panning = event.button === 1 || event.button === 2 || event.shiftKey;
    } else moved = Infinity;
    down.set(event.pointerId, [event.clientX, event.clientY]);
  });

  element.addEventListener("pointermove", (event) => {
    const last = down.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    moved += Math.hypot(dx, dy);
    if (down.size === 1) {
      if (panning) on.pan(dx, dy);
      else if (moved > CLICK_PX) on.orbit(dx, dy);
    } else {
      const [other] = [...down].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const before = Math.hypot(last[0] - other[0], last[1] - other[1]);
      const after = Math.hypot(event.clientX - other[0], event.clientY - other[1]);
      on.pan(dx / 2, dy / 2);
      if (before > 0 && after > 0) on.zoom(before / after);
    }
    down.set(event.pointerId, [event.clientX, event.clientY]);
  });

  const up = (event) => {
    if (!down.delete(event.pointerId)) return;
    const box = element.getBoundingClientRect();
    if (event.type === "pointerup" && moved <= CLICK_PX && event.button === 0) on.choose(event.clientX - box.left, event.clientY - box.top);
  };
  element.addEventListener("pointerup", up);
  element.addEventListener("pointercancel", up);
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const box = element.getBoundingClientRect();
      const lines = event.deltaMode === 1 ? 18 : 1;
      const x = ((event.clientX - box.left) / box.width) * 2 - 1;
      const y = 1 - ((event.clientY - box.top) / box.height) * 2;
      on.zoom(Math.exp(Math.min(Math.max(event.deltaY * lines, -240), 240) * 0.0016), x, y);
    },
    { passive: false },
  );
}
