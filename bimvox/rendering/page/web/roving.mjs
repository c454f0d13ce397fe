// A list of buttons as one stop of the Tab key: arrow keys, Home and End move between them.

/** Where keys lead, from a place among so many. */
const WAYS = { ArrowDown: (at) => at + 1, ArrowUp: (at) => at - 1, Home: () => 0, End: (_, last) => last };

export class Roving {
  /**
   * @param box The element around the list.
   * @param selector What of it are the buttons.
   */
  constructor(box, selector) {
    this.box = box;
    this.selector = selector;
    this.stop = null;
    box.addEventListener("focusin", (event) => this.stopAt(event.target.closest(selector)));
    box.addEventListener("keydown", (event) => this._key(event));
  }

  /** Takes over the buttons that the list has now. */
  renew() {
    const buttons = [...this.box.querySelectorAll(this.selector)];
    for (const button of buttons) button.tabIndex = -1;
    const seen = buttons.filter(isSeen);
    this.stopAt(seen.includes(this.stop) ? this.stop : seen[0] ?? buttons[0]);
  }

  /** Makes a button the one that Tab reaches. */
  stopAt(button) {
    if (!button) return;
    if (this.stop) this.stop.tabIndex = -1;
    this.stop = button;
    button.tabIndex = 0;
  }

  _key(event) {
    const way = WAYS[event.key];
    const button = event.target.closest(this.selector);
    if (!way || !button || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    const buttons = [...this.box.querySelectorAll(this.selector)].filter(isSeen);
    const at = Math.min(buttons.length - 1, Math.max(0, way(buttons.indexOf(button), buttons.length - 1)));
    event.preventDefault();
    event.stopPropagation();
    buttons[at].focus();
  }
}

/** Whether a button is not in a closed group. */
const isSeen = (button) => button.getClientRects().length > 0;
