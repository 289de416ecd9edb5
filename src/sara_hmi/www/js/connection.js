// The WebSocket to the chair: hello, beats, round trip. Nothing is ever queued: what cannot leave now is dropped.

export const VERSION = 1;
const LIMITS = {
  staleBeatMs: 200, // older than this, the newest beat no longer proves that a command is fresh
  slowMs: 180, // a longer round trip is too slow: the server refuses commands older than 200 ms
  silentMs: 2000, // nothing came for so long, and a state comes ten times a second: what was heard last may not be so any more
  lostMs: 8000, // the same, or no connection came about: it is given up, and opened anew
};
const FULL_BUFFER = 2048; // bytes that wait in the browser: the network does not take them
const ECHO_PERIOD_MS = 500;
const RETRY_MS = [300, 600, 1200, 2000];

/**
 * One connection at a time; a lost one is opened anew and begins without a beat.
 * Events: one per `op` that the server sends (detail: the frame), `map-image` (detail: Blob), `open`, `closed`, `speed`.
 */
export class Connection extends EventTarget {
  /** @param {{url: string, hello: () => object, now?: () => number, limits?: object}} options `hello` gives the fields of each hello. */
  constructor({ url, hello, now = () => performance.now(), limits = {} }) {
    super();
    this.limits = { ...LIMITS, ...limits };
    this.url = url;
    this.hello = hello;
    this.now = now;
    this.socket = null;
    this.tries = 0;
    this.seq = 0;
    this.forget();
  }

  /** What belonged to a former connection counts no longer. */
  forget() {
    this.beat = null;
    this.beatAt = -Infinity;
    this.heardAt = this.now();
    this.roundTrip = null;
    this.askedAt = null;
    this.late = false;
  }

  get isOpen() {
    return this.socket !== null && this.socket.readyState === WebSocket.OPEN;
  }

  /** Whether the newest beat proves that a command of now would be fresh. */
  get hasBeat() {
    return this.beat !== null && this.now() - this.beatAt <= this.limits.staleBeatMs;
  }

  /** Whether commands would come too late to be followed. */
  get isSlow() {
    const waiting = this.askedAt === null ? 0 : this.now() - this.askedAt;
    return this.isOpen && (this.late || Math.max(this.roundTrip ?? 0, waiting) > this.limits.slowMs);
  }

  /** Whether nothing is heard of the chair: what it said last is no news. */
  get isSilent() {
    return !this.isOpen || this.now() - this.heardAt > this.limits.silentMs;
  }

  open() {
    clearTimeout(this.retry);
    if (this.socket !== null && this.socket.readyState <= WebSocket.OPEN) return;
    const socket = new WebSocket(this.url);
    socket.binaryType = 'blob';
    this.socket = socket;
    this.forget();
    socket.onopen = () => {
      this.tries = 0;
      this.send({ op: 'hello', version: VERSION, ...this.hello() });
      this.emit('open');
    };
    socket.onmessage = (event) => {
      if (socket === this.socket) this.receive(event.data);
    };
    socket.onclose = () => this.lost(socket);
    this.echoes ??= setInterval(() => this.ask(), ECHO_PERIOD_MS);
  }

  lost(socket) {
    if (socket !== this.socket) return;
    this.socket = null;
    this.forget();
    this.emit('closed');
    this.retry = setTimeout(() => this.open(), RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)]);
  }

  /** The network is gone, or was: do not wait until the browser notices. */
  drop() {
    const socket = this.socket;
    if (socket === null) return;
    socket.onclose = null;
    socket.close();
    this.lost(socket);
  }

  receive(data) {
    this.heardAt = this.now();
    if (typeof data !== 'string') {
      this.emit('map-image', data);
      return;
    }
    let frame;
    try {
      frame = JSON.parse(data);
    } catch {
      return;
    }
    if (frame === null || typeof frame.op !== 'string') return;
    if (frame.op === 'beat') this.takeBeat(frame.n);
    else if (frame.op === 'echo') this.takeEcho(frame.t);
    else if (frame.op === 'ack') this.takeAck(frame);
    this.emit(frame.op, frame);
  }

  takeBeat(n) {
    if (!Number.isInteger(n) || (this.beat !== null && n <= this.beat)) return;
    this.beat = n;
    this.beatAt = this.now();
  }

  takeEcho(t) {
    if (t !== this.askedAt) return;
    this.roundTrip = this.now() - t;
    this.askedAt = null;
    this.late = false;
    this.emit('speed');
  }

  takeAck(frame) {
    if (!frame.ok && frame.why === 'error.drive_late') {
      this.late = true; // until the next echo shows a quick way
      this.emit('speed');
    }
  }

  ask() {
    if (this.now() - this.heardAt > this.limits.lostMs) this.drop();
    if (!this.isOpen) return;
    if (this.askedAt === null) {
      this.askedAt = this.now();
      if (!this.send({ op: 'echo', t: this.askedAt })) this.askedAt = null;
    }
    this.emit('speed');
  }

  /** Send a frame now, or not at all. Returns whether it left. */
  send(frame) {
    if (!this.isOpen || this.socket.bufferedAmount > FULL_BUFFER) return false;
    this.socket.send(JSON.stringify(frame));
    return true;
  }

  /** Send what only makes the chair stop: it leaves even if older bytes wait before it. */
  sendStop(frame) {
    if (!this.isOpen) return false;
    this.socket.send(JSON.stringify(frame));
    return true;
  }

  /** v, w: -1 to 1. Dropped without a fresh beat, or if the network does not take it. */
  drive(v, w) {
    if (!this.hasBeat || this.isSlow) return false;
    return this.send({ op: 'drive', seq: ++this.seq, t: this.now(), n: this.beat, v, w });
  }

  halt() {
    return this.sendStop({ op: 'halt', seq: ++this.seq });
  }

  stop() {
    return this.sendStop({ op: 'stop' });
  }

  emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}
