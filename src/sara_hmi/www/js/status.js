// What every screen shows at its top: what the chair does, whether it is heard, who drives; and where it does otherwise than asked.

import { el, fill } from './dom.js';
import { number, say } from './words.js';

// So long a deviation must last until it is shown: a chair that follows needs a moment to get going, and to come to rest.
const LASTS_MS = 400;
const FOLLOWING_MS = 2500;
const AGAIN_MS = 10000; // what shared control does is spoken once in this time
const LOW = [0.1, 0.2]; // of a full battery: each is spoken of once
const CHARGED = 0.05; // more than that, and it is spoken of again

export class Status {
  constructor(app) {
    this.app = app;
    this.since = null;
    this.spoken = {};
    this.unhelped = null;
    this.low = Infinity; // of LOW, what was spoken of last
  }

  begin() {
    this.told = this.deviating = null;
    fill(document.getElementById('deviation'), el('svg'), el('p', { role: 'status' }));
    this.update();
  }

  update() {
    this.tell();
    this.facts();
    this.deviation();
    this.tellUnhelped();
    this.tellBattery();
  }

  /** Say that shared control does not help, wherever it is shown. */
  tellUnhelped() {
    const key = this.app.chair.unhelped;
    if (key !== this.unhelped && key) this.app.speech.say(key);
    this.unhelped = key;
  }

  /** Say that the battery is low, wherever it is shown. */
  tellBattery() {
    const share = this.app.chair.state?.battery?.share;
    if (typeof share !== 'number') return;
    const low = LOW.find((level) => share <= level) ?? Infinity;
    if (low < this.low) this.app.speech.say('ui.battery_low', { percent: number(share * 100, 0) });
    if (low < this.low || share > this.low + CHARGED) this.low = low;
  }

  /** The sentence for everybody, and for screen readers. */
  tell() {
    const { chair, connection } = this.app;
    let told = { key: 'ui.offline', values: {} };
    if (chair.role === 'none') told = { key: 'ui.not_paired', values: {} };
    else if (connection.isOpen && chair.state) told = this.sentence();
    else if (connection.isOpen) told = { key: 'ui.connecting', values: {} };
    const text = say(told.key, told.values);
    if (text === this.told) return;
    this.told = text;
    const node = document.getElementById('sentence');
    node.textContent = text;
    node.dataset.kind = this.kind(told.key);
    this.app.speech.say(told.key, told.values);
  }

  sentence() {
    const { chair } = this.app;
    const goal = chair.state.goal;
    const gate = chair.sentence;
    if (goal && ['going', 'paused', 'pending'].includes(goal.state)) {
      const values = { place: goal.place };
      if (gate.key === 'ui.where.lost') return { key: 'ui.where.waits', values };
      if (gate.key === 'state.DRIVING' || gate.key === 'state.IDLE') return { key: `goal.${goal.state}`, values };
    }
    return gate;
  }

  kind(key) {
    if (key.startsWith('ui.')) return 'grave';
    return { DRIVING: 'good', IDLE: 'good', SLOWED: 'mind', BLOCKED: 'mind', FADING: 'mind' }[key.split('.')[1]] ?? (key.startsWith('goal.') ? 'good' : 'grave');
  }

  facts() {
    const { connection } = this.app;
    const texts = connection.isSilent ? [] : this.known();
    if (connection.isSlow) texts.push(say('ui.slow_short'));
    const text = texts.join(' · ');
    const node = document.getElementById('facts');
    if (node.textContent !== text) node.textContent = text;
  }

  /** Battery, and who drives. */
  known() {
    const { chair } = this.app;
    const texts = [batteryText(chair)].filter(Boolean);
    if (chair.isDriver) texts.push(say('ui.you_drive'));
    else if (chair.driver !== null) texts.push(say('ui.other_drives', { name: chair.driverName || say('ui.somebody') }));
    return texts;
  }

  deviation() {
    const node = document.getElementById('deviation');
    const found = this.app.chair.deviation;
    const now = performance.now();
    this.since = found ? this.since ?? now : null;
    if (!found || now - this.since < this.patience(found)) {
      if (!found && !node.hidden) {
        node.hidden = true;
        this.deviating = null;
      }
      return;
    }
    const text = deviationText(found);
    const shown = text + drawn(found.asked) + drawn(found.driven);
    if (shown === this.deviating) return;
    this.deviating = shown;
    node.hidden = false;
    node.firstElementChild.replaceWith(arrows(found));
    if (node.lastElementChild.textContent !== text) node.lastElementChild.textContent = text;
    if (found.key && !(now - this.spoken[found.key] < AGAIN_MS)) {
      this.spoken[found.key] = now;
      this.app.speech.say(found.key);
    }
  }

  patience({ key }) {
    if (key) return LASTS_MS;
    return ['DRIVING', 'IDLE'].includes(this.app.chair.state.gate?.state) ? FOLLOWING_MS : LASTS_MS;
  }
}

/** How full the battery is; empty where it does not say. */
export function batteryText(chair) {
  const { share, volts } = chair.state?.battery ?? {};
  if (typeof share === 'number') {
    return say(share <= LOW.at(-1) ? 'ui.battery_low' : 'ui.battery', { percent: number(share * 100, 0) });
  }
  return volts ? say('ui.battery_volts', { volts: number(volts, 1) }) : '';
}

/** forward, left, ... of a command in shares; `still` below a tenth. */
export function way({ v, w }) {
  if (Math.hypot(v, w) < 0.1) return 'still';
  const along = v > 0.1 ? 'forward' : v < -0.1 ? 'back' : '';
  const turn = w > 0.15 ? 'left' : w < -0.15 ? 'right' : '';
  return [along, turn].filter(Boolean).join('_') || 'still';
}

/** A motion, rounded: its arrow is drawn anew where this changes. */
function drawn({ v, w }) {
  return ` ${way({ v, w })} ${Math.round(8 * v)} ${Math.round(8 * w)}`;
}

function deviationText({ asked, driven, key }) {
  if (key) return say(key);
  const [wanted, done] = [way(asked), way(driven)];
  if (wanted === 'still') return say('ui.coasting');
  if (wanted === done) return say('ui.slower', { way: `ui.way.${wanted}` });
  return say('ui.otherwise', { asked: `ui.way.${wanted}`, driven: `ui.does.${done}` });
}

/** Two arrows from one point, the longer one of full length: asked (outline) and driven (filled); a dot where the chair stands. */
function arrows({ asked, driven }) {
  const longest = Math.max(Math.hypot(asked.v, asked.w), Math.hypot(driven.v, driven.w));
  const draw = ({ v, w }, name, wide) => {
    const size = Math.hypot(v, w);
    if (size < 0.1) return el('circle', { cx: 0, cy: 0, r: 8, class: name });
    const degrees = (Math.atan2(-w, v) * 180) / Math.PI;
    const long = 16 + 26 * (size / longest);
    const [shaft, head] = [wide, 2 * wide + 3];
    return el('path', { d: `M${-shaft} 0V${-long + 16}H${-head}L0 ${-long}L${head} ${-long + 16}H${shaft}V0z`, transform: `rotate(${degrees})`, class: name });
  };
  return el('svg', { viewBox: '-44 -44 88 88', 'aria-hidden': 'true' }, draw(asked, 'asked', 8), draw(driven, 'driven', 4));
}
