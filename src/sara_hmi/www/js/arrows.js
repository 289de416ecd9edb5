// Four arrow buttons and the arrow keys: the way to drive without dragging. Held, or a step for each tap.

import { button, el } from './dom.js';
import { say } from './words.js';

const SPEED = 0.7; // share of the profile's limits
const WAYS = { up: [SPEED, 0], left: [0, SPEED], right: [0, -SPEED], down: [-SPEED, 0] };
const KEYS = { ArrowUp: 'up', ArrowDown: 'down', ArrowLeft: 'left', ArrowRight: 'right' };

/** The four buttons, in which a switch's scan finds a row. */
export function makeArrows(pump, settings) {
  let timer = null;
  const holds = () => settings.get('arrows') === 'hold';

  const make = (name) => {
    let token = null; // of this button: another's blur or lifted finger ends nothing of it
    const hold = () => {
      clearTimeout(timer);
      token = pump.press(...WAYS[name]);
    };
    const release = () => pump.release(token);
    const step = () => {
      hold();
      const mine = token;
      timer = setTimeout(() => pump.release(mine), settings.get('step') * 1000);
    };
    const node = button(say(`ui.way.${{ up: 'forward', down: 'back' }[name] ?? name}`), null, { class: `arrow arrow-${name}`, 'data-way': name }, name);
    node.addEventListener('pointerdown', (event) => {
      if (!holds() || event.button !== 0) return;
      node.setPointerCapture(event.pointerId);
      hold();
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) {
      node.addEventListener(end, () => holds() && release());
    }
    node.addEventListener('blur', release);
    node.addEventListener('click', (event) => (event.detail === 0 || !holds()) && step());
    node.addEventListener('keydown', (event) => {
      if (!isPress(event) || !holds() || event.metaKey) return; // with Meta its keyup may never come: it is a click then
      event.preventDefault();
      if (!event.repeat) hold();
    });
    node.addEventListener('keyup', (event) => {
      if (!isPress(event) || !holds()) return;
      event.preventDefault();
      release();
    });
    return node;
  };
  return el('div', { class: 'arrows', 'data-scan': 'row', 'data-scan-order': 1, role: 'group', 'aria-label': say('ui.arrows') }, Object.keys(WAYS).map(make));
}

function isPress(event) {
  return event.key === 'Enter' || event.key === ' ';
}

/** The keyboard's arrow keys drive while they are held, from anywhere on the Drive screen. Returns how to leave. */
export function driveByKeys(pump) {
  const held = new Set();
  let token = null;

  const sum = () => [...held].reduce(([v, w], name) => [v + WAYS[name][0], w + WAYS[name][1]], [0, 0]);
  const down = (event) => {
    const name = KEYS[event.key];
    if (!name || event.ctrlKey || event.altKey || event.metaKey || event.target.closest?.('#tabs, #question, input')) return;
    event.preventDefault();
    if (event.repeat || held.has(name)) return;
    if (held.size === 0) token = pump.press(...WAYS[name]); // whoever held before rests, at which `held` is cleared
    if (token !== null) held.add(name);
    if (held.size > 1) pump.move(token, ...sum());
  };
  const up = (event) => {
    if (!held.delete(KEYS[event.key])) return;
    if (held.size > 0) pump.move(token, ...sum());
    else pump.release(token);
  };
  const rested = () => held.clear();
  window.addEventListener('keydown', down);
  window.addEventListener('keyup', up);
  pump.addEventListener('rest', rested);
  return () => {
    window.removeEventListener('keydown', down);
    window.removeEventListener('keyup', up);
    pump.removeEventListener('rest', rested);
  };
}
