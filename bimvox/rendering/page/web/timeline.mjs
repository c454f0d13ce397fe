// The time of the plan: slider, lifts as bands, play, speed.
import { byId, el, fill } from "./dom.mjs";
import { clock, nameOf } from "./words.mjs";

const SPEEDS = [1, 2, 5, 10, 20, 50, 100, 200, 500];
const THUMB = 6;

export class Timeline {
  constructor(app) {
    this.app = app;
    this.slider = byId("time");
    this.ticks = byId("ticks");
    fill(byId("speed"), ...SPEEDS.map((speed) => el("option", { value: speed, selected: speed === app.speed }, `${speed}×`)));
    byId("speed").addEventListener("change", (event) => app.setSpeed(Number(event.target.value)));
    byId("play").addEventListener("click", () => app.toggle());
    byId("previous").addEventListener("click", () => app.stepLift(-1));
    byId("next").addEventListener("click", () => app.stepLift(1));
    this.slider.addEventListener("input", () => app.seek(Number(this.slider.value)));
    new ResizeObserver(() => this.drawTicks()).observe(this.ticks);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.drawTicks());
  }

  /** Takes over the time span of the current revision. */
  render() {
    const { plan } = this.app;
    this.slider.min = plan.begins;
    this.slider.max = plan.ends;
    this.slider.disabled = !plan.timed.length;
    byId("play").disabled = !plan.timed.length;
    byId("total").textContent = `/ ${plan.timeAt(plan.ends)}`;
    this.drawTicks();
  }

  update() {
    const { app } = this;
    this.slider.value = app.time;
    const at = app.plan.timeAt(app.time);
    const said = app.lift ? `${at}, lift ${app.lift.number} of ${app.plan.lifts.length}` : at;
    if (this.slider.getAttribute("aria-valuetext") !== said) this.slider.setAttribute("aria-valuetext", said);
    byId("clock").textContent = at;
    const play = byId("play");
    play.classList.toggle("playing", app.playing);
    play.setAttribute("aria-label", app.playing ? "Pause" : "Play");
    byId("speed").value = String(app.speed);
    if (this.lift !== app.lift || this.chosen !== app.chosen) this.drawTicks();
  }

  nextSpeed(step) {
    const at = SPEEDS.indexOf(this.app.speed) + step;
    if (SPEEDS[at]) this.app.setSpeed(SPEEDS[at]);
  }

  /** One band per lift, one row per crane: the lift under way blue, the chosen one black, a red mark above 90 % of the capacity, waits left open. */
  drawTicks() {
    const { app, ticks } = this;
    this.lift = app.lift;
    this.chosen = app.chosen;
    const scale = devicePixelRatio || 1;
    const [width, height] = [ticks.clientWidth, ticks.clientHeight];
    ticks.width = width * scale;
    ticks.height = height * scale;
    const draw = ticks.getContext("2d");
    draw.scale(scale, scale);
    const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
    const { plan } = app;
    const x = (time) => THUMB + ((time - plan.begins) / Math.max(plan.ends - plan.begins, 1e-9)) * (width - 2 * THUMB);
    if (plan.cranes > 1) this._drawRows(draw, x, height, colour);
    else plan.timed.forEach((lift, n) => {
      const [from, to] = [x(lift.begins_s), x(plan.endOf(lift))];
      draw.fillStyle = colour(lift === app.lift ? "--accent" : n % 2 ? "--line" : "--press");
      draw.fillRect(from, height - 17, Math.max(to - from, 0.6), 11);
      if (lift.part === app.chosen) {
        draw.fillStyle = colour("--ink");
        draw.fillRect(from - 0.5, height - 6, Math.max(to - from + 1, 3), 4);
      }
      if (lift.critical) {
        draw.fillStyle = colour("--bad");
        draw.fillRect(from, height - 20, Math.max(to - from, 1.5), 3);
      }
    });
    this._drawHours(draw, x, width, colour("--faint"));
  }

  /** The lifts of every crane in a separate row. */
  _drawRows(draw, x, height, colour) {
    const { app } = this;
    const { plan } = app;
    const tall = Math.max(1, Math.floor(13 / plan.cranes) - 1);
    plan.ofCrane.forEach((lifts, crane) => {
      const top = height - 18 + crane * (tall + 1);
      lifts.forEach((lift, n) => {
        const busy = plan.busyOf(lift);
        draw.fillStyle = colour(lift === app.lift ? "--accent" : n % 2 ? "--faint" : "--line");
        for (const [start, end] of busy) draw.fillRect(x(start), top, Math.max(x(end) - x(start), 0.6), tall);
        if (lift.critical) {
          draw.fillStyle = colour("--bad");
          draw.fillRect(x(busy[0][0]), top, Math.max(x(busy.at(-1)[1]) - x(busy[0][0]), 1.5), 2);
        }
        if (lift.part === app.chosen) {
          draw.fillStyle = colour("--ink");
          draw.fillRect(x(lift.begins_s) - 0.5, height - 4, Math.max(x(plan.endOf(lift)) - x(lift.begins_s) + 1, 3), 3);
        }
      });
    });
  }

  _drawHours(draw, x, width, ink) {
    const { plan } = this.app;
    const long = plan.ends - plan.begins;
    const step = [60, 300, 600, 1800, 3600, 7200, 18000, 36000, 86400].find((seconds) => (seconds / Math.max(long, 1)) * width > 62) ?? 86400;
    draw.fillStyle = ink;
    draw.font = "11px system-ui, sans-serif";
    draw.textAlign = "center";
    for (let at = Math.ceil(plan.begins / step) * step; at <= plan.ends; at += step) {
      draw.fillRect(x(at), 14, 1, 8);
      if (x(at) > 14 && x(at) < width - 16) draw.fillText(clock(at).replace(/:00$/, ""), x(at), 11);
    }
  }
}

/** The lift under way, in words. */
export function nowWords(app) {
  const { lift, plan } = app;
  if (!lift) return null;
  return { title: `Lift ${lift.order + 1} of ${plan.lifts.length}: ${nameOf(app.parts[lift.part])}`, phase: plan.phaseAt(lift, app.time) };
}
