// One or two switches: rows light up in turn, then what is in the chosen row. Auto: by time; step: by the first switch.

const DEBOUNCE_MS = 300; // a hand that trembles presses once
const FIRST = 1.5; // the first of a round stays so much longer
const ROUNDS = 2; // within a row, then back to the rows

const isShown = (node) => node.getClientRects().length > 0;

/**
 * What can be scanned, as [row, items]: each `data-scan="row"`, and each button of a `data-scan="items"` as a row of its own.
 * Lower `data-scan-order` first.
 */
export function rows(root = document) {
  const found = [...root.querySelectorAll('[data-scan]')].flatMap((row) => {
    const items = [...row.querySelectorAll('button:not([disabled])')].filter((item) => isShown(item) && !item.closest('[inert]'));
    const order = Number(row.dataset.scanOrder ?? 5);
    if (row.dataset.scan === 'items') return items.map((item) => ({ order, row: item, items: [item] }));
    return items.length > 0 ? [{ order, row, items }] : [];
  });
  return found.sort((a, b) => a.order - b.order).map(({ row, items }) => [row, items]);
}

export class Scanner {
  /** @param {{settings: Settings, moving: () => boolean, stop: () => void, tell: (text: string) => void}} options */
  constructor({ settings, moving, stop, tell }) {
    Object.assign(this, { settings, moving, stop, tell });
    this.pressedAt = -Infinity;
    this.restart();
    document.addEventListener('screen-changed', () => this.restart());
    window.addEventListener('keydown', (event) => this.key(event), true);
    window.addEventListener('keyup', (event) => this.swallow(event), true);
    window.addEventListener('pointerdown', (event) => this.touch(event), true);
    window.addEventListener('click', (event) => this.swallowClick(event), true);
    settings.addEventListener('change', ({ detail }) => ['scan', 'scan_period'].includes(detail) && this.restart());
  }

  get mode() {
    return this.settings.get('scan');
  }

  restart() {
    clearTimeout(this.timer);
    this.row = this.item = null;
    this.round = 0;
    this.show();
    if (this.mode === 'auto') this.timer = setTimeout(() => this.next(), 0);
  }

  /** The next row, or the next item of the chosen row. */
  next() {
    clearTimeout(this.timer);
    const all = rows();
    const inRow = this.item !== null && all.find(([row]) => row === this.row);
    let first;
    if (inRow) {
      const k = inRow[1].indexOf(this.item) + 1;
      first = k === inRow[1].length;
      if (first && ++this.round >= ROUNDS) return this.restart();
      this.item = inRow[1][k % inRow[1].length];
    } else {
      this.item = null;
      const k = all.findIndex(([row]) => row === this.row) + 1;
      first = k === 0 || k === all.length;
      this.row = all.length ? all[k % all.length][0] : null;
    }
    this.show();
    this.arm(first);
  }

  arm(first) {
    if (this.mode !== 'auto') return;
    this.timer = setTimeout(() => this.next(), this.settings.get('scan_period') * 1000 * (first ? FIRST : 1));
  }

  /** The switch that chooses. */
  choose() {
    const found = rows().find(([row]) => row === this.row);
    if (!found) return this.restart();
    const [, items] = found;
    if (this.item === null && items.length > 1) {
      this.item = items[0];
      this.round = 0;
      this.show();
      clearTimeout(this.timer);
      this.arm(true);
      return;
    }
    const chosen = this.item ?? items[0];
    this.restart();
    if (items.includes(chosen)) chosen.click();
  }

  /** A press of a switch: stops a chair that moves, whatever lights up. */
  press(step) {
    const t = performance.now();
    if (t - this.pressedAt < DEBOUNCE_MS) return;
    if (this.moving()) this.stop();
    else if (step && this.mode === 'step') this.next();
    else this.choose();
    this.pressedAt = t;
  }

  key(event) {
    if (this.mode === 'off' || ![' ', 'Enter'].includes(event.key) || isText(event.target)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat) this.press(event.key === ' ');
  }

  swallow(event) {
    if (this.mode === 'off' || ![' ', 'Enter'].includes(event.key) || isText(event.target)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }

  touch(event) {
    this.swallows = false;
    if (this.mode === 'off' || event.target.closest?.('#stop')) return;
    const everywhere = this.settings.get('scan_touch') === 'on';
    if (!everywhere && !this.moving()) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.swallows = true;
    this.press(false);
  }

  /** The click that follows a touch that was a press of the switch, however long it lasted. */
  swallowClick(event) {
    if (event.detail === 0 || !this.swallows) return;
    this.swallows = false;
    event.preventDefault();
    event.stopImmediatePropagation();
  }

  show() {
    for (const node of document.querySelectorAll('.scanned')) node.classList.remove('scanned');
    const lit = this.item ?? this.row;
    if (this.mode === 'off' || !lit) return;
    lit.classList.add('scanned');
    (lit.querySelector('button') ?? lit).scrollIntoView({ block: 'nearest' });
    this.tell(lit.getAttribute('aria-label') ?? lit.textContent);
  }
}

function isText(node) {
  return node instanceof HTMLInputElement && node.type === 'text';
}
