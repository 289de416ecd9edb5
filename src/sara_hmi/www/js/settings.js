// What this screen's user has chosen. It stays in the browser.

const KEY = 'sara.settings';

/** Each setting: its values, the first of which is the default; or {min, max, step, start}. */
export const CHOICES = {
  language: ['en', 'es'],
  speech: ['off', 'screen', 'chair'],
  contrast: ['light', 'dark', 'high'],
  hands: ['right', 'left'],
  arrows: ['hold', 'step'],
  step: { min: 0.5, max: 3, step: 0.5, start: 1 },
  scan: ['off', 'auto', 'step'],
  scan_period: { min: 0.5, max: 5, step: 0.1, start: 1.5 },
  scan_touch: ['off', 'on'],
  dwell: ['off', 'on'],
  dwell_time: { min: 0.3, max: 3, step: 0.1, start: 1.2 },
  stop_keys: ['escape', 'escape_space', 'none'],
};

export class Settings extends EventTarget {
  constructor(storage = localStorage, preferred = navigator.language) {
    super();
    this.storage = storage;
    this.values = {};
    let kept = {};
    try {
      kept = JSON.parse(storage.getItem(KEY)) ?? {};
    } catch {
      kept = {};
    }
    for (const [name, choice] of Object.entries(CHOICES)) {
      this.values[name] = isAllowed(choice, kept[name]) ? kept[name] : choice.start ?? choice[0];
    }
    if (kept.language === undefined && preferred.startsWith('es')) this.values.language = 'es';
  }

  get(name) {
    return this.values[name];
  }

  /** Take over one value, keep it, tell whoever listens (`change`, detail: name). A value that is not allowed is an error. */
  set(name, value) {
    const choice = CHOICES[name];
    if (!Array.isArray(choice)) value = Math.round(value * 10) / 10;
    if (!isAllowed(choice, value)) throw new RangeError(`${name}: ${value}`);
    this.values[name] = value;
    try {
      this.storage.setItem(KEY, JSON.stringify(this.values));
    } catch {
      // A browser that keeps nothing: the setting holds until the page is closed.
    }
    this.dispatchEvent(new CustomEvent('change', { detail: name }));
  }
}

function isAllowed(choice, value) {
  if (Array.isArray(choice)) return choice.includes(value);
  return typeof value === 'number' && value >= choice.min && value <= choice.max;
}
