// A joystick for a finger or a mouse. Whoever lets go, loses the pointer or is cancelled has to take it again.

import { el } from './dom.js';

const DEAD = 0.12; // share of the way

/** {v, w} of an offset from the centre in shares of the radius: up is forward, left turns left; nothing in the dead zone. */
export function command(x, y) {
  const size = Math.hypot(x, y);
  if (size < DEAD) return { v: 0, w: 0 };
  const scale = (Math.min(1, size) - DEAD) / (1 - DEAD) / size;
  const round = (value) => Math.round(value * 1000) / 1000 || 0;
  return { v: round(-y * scale), w: round(-x * scale) };
}

export function makeStick(pump, label) {
  const knob = el('div', { class: 'knob' });
  const base = el('div', { id: 'stick', role: 'img', 'aria-label': label }, el('div', { class: 'cross' }), knob);
  let pointer = null;
  let token = null;
  let box = null; // where the stick was when it was taken: a page that shifts under the finger changes no command

  const place = (x, y) => {
    const size = Math.max(1, Math.hypot(x, y));
    knob.style.transform = `translate(${(x / size) * 100}%, ${(y / size) * 100}%)`;
  };
  const read = (event) => {
    const radius = box.width / 3; // the knob is a third of the base wide, its centre moves so far
    const x = (event.clientX - box.left - box.width / 2) / radius;
    const y = (event.clientY - box.top - box.height / 2) / radius;
    place(x, y);
    return command(x, y);
  };
  const drop = () => {
    pointer = null;
    place(0, 0);
    base.classList.remove('held');
  };
  base.addEventListener('pointerdown', (event) => {
    if (pointer !== null || event.button !== 0) return;
    event.preventDefault();
    box = base.getBoundingClientRect();
    const { v, w } = read(event);
    token = pump.press(v, w); // whoever held before rests, at which this stick forgets its pointer: it is noted below
    if (token === null) {
      place(0, 0);
      return;
    }
    pointer = event.pointerId;
    base.setPointerCapture(pointer);
    base.classList.add('held');
  });
  // pointerrawupdate comes at once, pointermove with the next picture; not every browser has the first.
  for (const name of ['pointerrawupdate', 'pointermove']) {
    base.addEventListener(name, (event) => {
      if (event.pointerId !== pointer) return;
      const { v, w } = read(event);
      pump.move(token, v, w);
    });
  }
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    base.addEventListener(name, (event) => {
      if (event.pointerId !== pointer) return;
      drop();
      pump.release(token);
    });
  }
  const rested = () => pointer !== null && drop();
  pump.addEventListener('rest', rested);
  return { node: base, leave: () => pump.removeEventListener('rest', rested) };
}
