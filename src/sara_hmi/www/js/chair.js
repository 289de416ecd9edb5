// What the page knows of the chair: the newest frame of each kind.

const REST_V = 0.02; // m/s, slower than this is rest
const REST_W = 0.03; // rad/s
const CORRECTIONS = new Set(['LEFT', 'RIGHT', 'SLOWER', 'CALMER', 'VEERS', 'STOPS']); // of shared control: what it does otherwise than asked,
const UNHELPED = new Set(['OVERRIDE', 'INSISTED', 'OFF', 'UNKNOWN']); // and why it does not help
const HOLDS = new Set(['SLOWED', 'BLOCKED', 'FADING', 'BRAKING', 'HELD', 'WAITING', 'MANUAL']); // states of the gate: it does not pass commands as they are
const GOING = new Set(['going', 'pending']);

/** Collects the server's frames. Events: `change` (detail: the frame's op) after each. */
export class Chair extends EventTarget {
  constructor(connection) {
    super();
    this.connection = connection;
    this.forget();
    for (const op of ['welcome', 'state', 'ranges', 'plan', 'places', 'edits', 'map', 'history', 'driver', 'profile']) {
      connection.addEventListener(op, (event) => this.take(op, event.detail));
    }
    connection.addEventListener('map-image', (event) => this.takeImage(event.detail));
    connection.addEventListener('closed', () => {
      this.forget();
      this.emit('closed');
    });
  }

  forget() {
    this.welcome = null;
    this.state = null;
    this.ranges = {};
    this.plan = [];
    this.history = [];
    this.driver = null;
    this.driverName = '';
    this.places ??= {};
    this.edits ??= null; // what is drawn over the map; null: it cannot be drawn over
    this.map ??= null;
    this.image ??= null;
  }

  take(op, frame) {
    if (op === 'welcome') {
      this.welcome = frame;
      this.driver = frame.driver ?? null;
    } else if (op === 'state') {
      this.state = frame;
      if (frame.driver !== undefined) this.driver = frame.driver;
    } else if (op === 'driver') {
      this.driver = frame.session ?? null;
      this.driverName = frame.name ?? '';
    } else if (op === 'profile') {
      const { op: _, ...news } = frame;
      Object.assign(this.welcome ?? {}, news);
    } else if (op === 'map') {
      this.map = frame;
      this.image = null;
    } else if (op === 'edits') {
      this.edits = frame.edits;
    } else if (op === 'ranges') {
      const { op: _, ...ranges } = frame;
      this.ranges = ranges;
    } else {
      this[op] = frame.places ?? frame.points ?? frame.list;
    }
    this.emit(op);
  }

  async takeImage(blob) {
    const map = this.map;
    try {
      const image = await createImageBitmap(blob);
      if (map === this.map) this.image = image;
    } catch {
      this.image = null; // damaged on its way: the map stays empty
    }
    this.emit('map');
  }

  get session() {
    return this.welcome?.session ?? null;
  }

  get role() {
    return this.welcome?.role ?? null;
  }

  get mayDrive() {
    return this.role === 'rider' || this.role === 'carer';
  }

  get isDriver() {
    return this.session !== null && this.driver === this.session;
  }

  get isMoving() {
    return this.state !== null && (Math.abs(this.state.v) > REST_V || Math.abs(this.state.w) > REST_W);
  }

  get isGoing() {
    return GOING.has(this.state?.goal?.state);
  }

  get isPaused() {
    return this.state?.goal?.state === 'paused';
  }

  get isStopped() {
    return this.state?.stopped === true || (this.state?.gate?.reasons ?? []).includes('EMERGENCY_STOP');
  }

  /** Whether it says that nothing holds it up. */
  get isFree() {
    return !this.connection.isSilent && ['IDLE', 'DRIVING'].includes(this.state?.gate?.state);
  }

  /** Whether it is lost: true, false, or null where nobody says. Who has a map and no place on it is lost, too. */
  get lost() {
    if (!this.state) return null;
    return this.map && this.state.pose === null ? true : this.state.lost ?? null;
  }

  get isLost() {
    return this.lost === true;
  }

  /** The key and values of the sentence that says what the chair does. */
  get sentence() {
    const gate = this.state?.gate;
    if (this.connection.isSilent) return { key: 'ui.offline', values: {} };
    if (gate?.state === 'SILENT') return { key: 'error.no_gate', values: {} };
    if (!gate?.state) return { key: 'ui.no_gate', values: {} };
    const reason = gate.reasons?.[0];
    if (this.isLost && ['IDLE', 'DRIVING'].includes(gate.state)) return { key: 'ui.where.lost', values: {} };
    if (!reason && !['IDLE', 'DRIVING'].includes(gate.state)) return { key: `ui.state_alone.${gate.state}`, values: {} };
    return { key: `state.${gate.state}`, values: { reason: reason ? `reason.${reason}` : '' } };
  }

  /**
   * {asked, driven: {v, w}, key} where the chair does otherwise than asked, else null. Shares of the limits, -1 to 1. `driven`: what
   * shared control commands where that does so and the gate lets it, else the chair's motion. `key`: of shared control's sentence.
   */
  get deviation() {
    const { asked, v, w, assist, gate } = this.state ?? {};
    const limits = this.welcome?.limits ?? {};
    if (!asked || this.connection.isSilent) return null;
    const share = (value, most) => Math.max(-1, Math.min(1, value / (most || 1)));
    const shares = (v, w) => ({
      v: share(v, v < 0 ? limits.max_reverse ?? 0.4 : limits.max_forward ?? 0.8), w: share(w, limits.max_turn ?? 0.8),
    });
    const wanted = shares(asked.v, asked.w);
    const beside = (driven, least, key) => (Math.hypot(wanted.v - driven.v, wanted.w - driven.w) > least ? { asked: wanted, driven, key } : null);
    const key = CORRECTIONS.has(assist?.does) ? `assist.${assist.does}` : null;
    if (key && assist.command && !HOLDS.has(gate?.state)) {
      const { command } = assist;
      return beside(shares(command.v, command.w), 0.05, key) ?? beside(shares(v, w), 0.25, null);
    }
    return beside(shares(v, w), 0.25, gate?.state === 'SLOWED' ? key : null);
  }

  /** Whether this page may say how shared control is to help. */
  get mayAssist() {
    return this.mayDrive && (this.driver === null || this.isDriver);
  }

  /** The key of why shared control does not help; null where it helps, or does not run. */
  get unhelped() {
    const does = this.state?.assist?.does;
    return UNHELPED.has(does) && !this.connection.isSilent ? `assist.${does}` : null;
  }

  emit(op) {
    this.dispatchEvent(new CustomEvent('change', { detail: op }));
  }
}
