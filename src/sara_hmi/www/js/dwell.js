// Pointers without a button (gaze, head, trackball): resting on something for a while presses it. A ring shrinks meanwhile.

import { el } from './dom.js';

const WOBBLE_PX = 6; // after a press, so much movement on the same target arms it again
const PRESSABLE = 'button:not([disabled]), a[href], canvas[data-dwell]';

export class Dwell {
  /** @param {{settings: Settings, busy: () => boolean, stop: () => void}} options `busy`: a step is being driven; not armed. */
  constructor({ settings, busy, stop }) {
    Object.assign(this, { settings, busy, stop });
    this.ring = el('div', { id: 'dwell', 'aria-hidden': 'true', hidden: true });
    document.body.append(this.ring);
    this.clear();
    window.addEventListener('pointermove', (event) => this.move(event));
    document.documentElement.addEventListener('pointerleave', () => this.clear());
    window.addEventListener('blur', () => this.clear());
    document.addEventListener('screen-changed', () => this.clear());
  }

  clear() {
    cancelAnimationFrame(this.frame);
    this.target = null;
    this.pressedAt = null;
    this.ring.hidden = true;
  }

  move(event) {
    if (this.settings.get('dwell') !== 'on' || event.pointerType === 'touch') return this.clear();
    const target = event.target.closest?.(PRESSABLE) ?? null;
    this.at = { x: event.clientX, y: event.clientY };
    this.ring.style.transform = `translate(${this.at.x}px, ${this.at.y}px)`;
    if (target === this.target && !this.movesAgain()) return;
    this.clear();
    if (target === null) return;
    this.target = target;
    this.since = performance.now();
    this.ring.hidden = false;
    this.draw();
  }

  /** Whether a target that was pressed is pointed at anew. */
  movesAgain() {
    const last = this.pressedAt;
    return last !== null && !this.busy() && Math.hypot(this.at.x - last.x, this.at.y - last.y) > WOBBLE_PX;
  }

  draw() {
    const time = this.settings.get('dwell_time') * 1000;
    const passed = performance.now() - this.since;
    if (!this.target.isConnected) return this.clear();
    this.ring.style.setProperty('--left', String(Math.max(0, 1 - passed / time)));
    if (passed < time) {
      this.frame = requestAnimationFrame(() => this.draw());
      return;
    }
    this.pressedAt = { ...this.at };
    this.ring.hidden = true;
    if (this.target.id === 'stop') this.stop();
    else if (this.target.matches('canvas')) this.target.dispatchEvent(new CustomEvent('dwell', { detail: this.at }));
    else this.target.click();
  }
}
