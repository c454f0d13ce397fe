// When work is done: its first day, the working days of a week, the shifts of a day.
import { el } from "../page/dom.mjs";

const DAYS = ["Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"];
const SHIFT = /^([01]\d|2[0-3]):[0-5]\d-([01]\d|2[0-4]):[0-5]\d$/;

/** The shifts of a typed text, such as "07:00-12:00, 13:00-17:00"; null if one is none. */
export function shiftsOf(text) {
  const found = text.replaceAll("–", "-").split(",").map((one) => one.trim().replace(/\s*-\s*/, "-").replace(/\b(\d):/g, "0$1:")).filter(Boolean); // prettier-ignore
  return found.length && found.every((one) => SHIFT.test(one)) ? found : null;
}

/** The fields of the calendar. */
export function calendarFields(form) {
  const { app } = form;
  const change = (values, what) => app.change({ ...app.setup, calendar: { ...app.setup.calendar, ...values } }, what);
  const start = form.input("calendar-start", (setup) => setup.calendar.start ?? "", (value) => change({ start: value || null }, "first day of work"), "text"); // prettier-ignore
  start.type = "date";
  const shifts = form.input("calendar-shifts", (setup) => setup.calendar.shifts.join(", "), (text) => (shiftsOf(text) ? change({ shifts: shiftsOf(text) }, "shifts") : `“${text}” are no shifts: write them as 07:00-12:00, 13:00-17:00.`), "text"); // prettier-ignore
  const days = DAYS.map((day) => {
    const box = el("input", { type: "checkbox", "data-key": `calendar-${day}` });
    box.addEventListener("change", () => {
      const left = DAYS.filter((one) => (one === day ? box.checked : app.setup.calendar.days.includes(one)));
      if (!left.length) return void (box.checked = true);
      change({ days: left }, "working days");
    });
    form.fields.push({ update: (setup) => (box.checked = setup.calendar.days.includes(day)) });
    return el("label", {}, box, day);
  });
  return el("div", { class: "fields" }, el("label", {}, el("span", {}, "First day"), start), el("fieldset", { class: "units days" }, el("legend", { class: "unseen" }, "Working days"), ...days), el("label", {}, el("span", {}, "Shifts"), shifts), el("p", { class: "about" }, "Without a first day, times count working days. Holidays, breaks and weather days are in the site file."));
}
