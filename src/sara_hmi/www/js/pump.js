// From a deflected stick to commands: 20 Hz while it is held, one halt when it is not, and nothing afterwards.

const PERIOD_MS = 50;
const SOONEST_MS = 25; // a moved finger is passed on at once, but not more often
const FROZEN_MS = 300; // the page's own clock stood still for longer: whatever is held belongs to the past

/**
 * Holds the one command that is driven. A source (stick, button, keys) presses with a token of its own and moves only
 * with that token; `rest` takes it away from whoever holds it, and only a new press begins anew.
 */
export class Pump extends EventTarget {
  /** @param {{drive: Function, halt: Function, ready: () => boolean, take: () => boolean, now?: () => number, frozenMs?: number}} options */
  constructor({ drive, halt, ready, take, now = () => performance.now(), frozenMs = FROZEN_MS }) {
    super();
    Object.assign(this, { drive, halt, ready, take, now, frozenMs });
    this.holder = null;
    this.v = this.w = 0;
  }

  get isHeld() {
    return this.holder !== null;
  }

  /** A source takes hold. Returns the token with which it moves and releases; null and `rest` where another has the controls. */
  press(v, w) {
    this.rest('pressed');
    if (!this.take()) {
      this.emit('rest', 'refused'); // a hold that waited would drive at the moment the other lets go
      return null;
    }
    this.holder = Symbol('hold');
    this.v = v;
    this.w = w;
    this.tickedAt = this.now();
    this.sentAt = -Infinity;
    this.drove = false;
    this.flush();
    this.emit('held');
    return this.holder;
  }

  move(token, v, w) {
    if (token !== this.holder || token === null) return;
    if (!this.isAwake()) return;
    this.v = v;
    this.w = w;
    this.flush();
  }

  release(token) {
    if (token === this.holder) this.rest('released');
  }

  /** Stop, whoever holds; `why` is told to who shows it. */
  rest(why) {
    if (this.holder === null) return;
    clearTimeout(this.timer);
    this.holder = null;
    this.v = this.w = 0;
    this.halt();
    this.emit('rest', why);
  }

  tick() {
    if (this.isAwake()) this.flush();
  }

  isAwake() {
    const t = this.now();
    const slept = t - this.tickedAt > this.frozenMs;
    this.tickedAt = t;
    if (slept) this.rest('frozen');
    return !slept;
  }

  /** Look again in so many ms. */
  wait(ms) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.tick(), ms);
  }

  flush() {
    const t = this.now();
    if (this.holder === null) return;
    const early = this.sentAt + SOONEST_MS - t;
    this.wait(early > 0 ? early : PERIOD_MS);
    if (early > 0) return;
    if (!this.ready()) {
      if (this.drove) this.rest('slow');
      return;
    }
    if (this.v === 0 && this.w === 0) {
      if (this.drove) this.halt();
      this.drove = false;
    } else if (this.drive(this.v, this.w)) {
      this.drove = true;
    }
    this.sentAt = t;
  }

  emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}

/** Whatever may mean that nobody looks at the page or holds the stick any more: rest at once. */
export function restWhenLeft(pump, connection) {
  const rest = (why) => () => pump.rest(why);
  window.addEventListener('blur', rest('left'));
  // While Meta is down macOS tells of no other key that is let go.
  window.addEventListener('keydown', (event) => event.key === 'Meta' && pump.rest('left'), true);
  window.addEventListener('pagehide', () => {
    pump.rest('left');
    connection.drop(); // else a browser that keeps the page for "back" keeps its session, too, and with it the controls
  });
  window.addEventListener('resize', rest('turned'));
  window.addEventListener('contextmenu', (event) => {
    if (pump.isHeld) event.preventDefault();
  });
  document.addEventListener('freeze', rest('left'));
  document.addEventListener('visibilitychange', () => {
    if (document.visibilityState !== 'visible') pump.rest('left');
  });
  window.addEventListener('offline', () => {
    pump.rest('offline');
    connection.drop();
  });
  window.addEventListener('online', () => connection.open());
  connection.addEventListener('closed', rest('offline'));
  connection.addEventListener('ack', (event) => {
    const { ok, why } = event.detail;
    const isSlow = why === 'error.drive_late' || why === 'error.drive_lift';
    if (!ok && why !== 'error.drive_used') pump.rest(isSlow ? 'slow' : 'refused');
  });
}
