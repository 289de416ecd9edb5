// Drawing on the map: erase what does not stand there, close a door, keep the chair out, have it go slowly. Two points by taps, or by buttons alone.

import { button, el, fill } from '../dom.js';
import { number, say } from '../words.js';

const TOOLS = ['free', 'wall', 'keep_out', 'slow'];
const STEP = 0.1; // m
const APART = 0.5; // m, where the second point is put by a button, from the first

/** Draws into `scene.edit`: {kind, points}, null while nothing is drawn. `changed`: the map has to be painted. */
export class Editing {
  constructor(app, scene, { changed, left }) {
    Object.assign(this, { app, scene, changed, left });
    this.node = el('div', { class: 'marking editing' });
    this.list = el('ul', { class: 'places edits' });
  }

  begin() {
    this.scene.edit = { kind: 'wall', points: [] };
    this.draw();
    this.changed();
    this.node.querySelector('[data-edit="wall"]').focus();
  }

  end() {
    this.scene.edit = null;
    fill(this.node);
    this.changed();
    this.left();
  }

  /** A tap: the first point, then the second, which further taps move. */
  tap(x, y) {
    const { points } = this.scene.edit;
    this.setPoints([...points.slice(0, 1), [x, y]]);
  }

  setPoints(points) {
    const before = this.scene.edit.points.length;
    this.scene.edit.points = points;
    if (points.length !== before) this.draw();
    this.tell();
    this.changed();
  }

  /** The second point, beside the first. */
  addSecond() {
    const [[x, y]] = this.scene.edit.points;
    this.setPoints([[x, y], [x + APART, y + APART]]);
  }

  /** The newest point, moved. */
  move(dx, dy) {
    const points = [...this.scene.edit.points];
    const [x, y] = points.pop();
    this.setPoints([...points, [x + dx, y + dy]]);
  }

  tell() {
    const { points } = this.scene.edit;
    const line = this.node.querySelector('.marker');
    if (line) line.textContent = points.map(([x, y], k) => say(k ? 'ui.edit.second' : 'ui.edit.first', { x: number(x, 2), y: number(y, 2) })).join(' ');
  }

  draw() {
    const { kind, points } = this.scene.edit;
    const tools = TOOLS.map((name) => button(say(`ui.edit.${name}`), () => {
      this.scene.edit.kind = name;
      this.draw();
      this.changed();
    }, { 'data-edit': name, 'aria-pressed': String(name === kind) }));
    keepFocus(this.node, () => fill(this.node,
      el('div', { class: 'row tools', 'data-scan': 'row', role: 'group', 'aria-label': say('ui.edit.tools') }, tools),
      this.uses(),
      el('p', {}, say(`ui.edit.help.${kind}`)),
      el('p', { class: 'marker', role: 'status' }),
      ...(points.length > 0 ? this.moves() : [])), '[data-edit="draw"], [data-edit="next"], [data-edit="start"]');
    this.tell();
    document.dispatchEvent(new CustomEvent('screen-changed'));
  }

  moves() {
    const move = (text, name, dx, dy) => button(text, () => this.move(dx, dy), { 'aria-label': say(`ui.move.${name}`), 'data-move': name, class: 'small' });
    return [el('p', {}, say('ui.edit.move')), el('div', { class: 'row looks', 'data-scan': 'row', 'data-scan-order': 1, role: 'group', 'aria-label': say('ui.edit.move') },
      move('←', 'west', -STEP, 0), move('↑', 'north', 0, STEP), move('↓', 'south', 0, -STEP), move('→', 'east', STEP, 0))];
  }

  uses() {
    const { points } = this.scene.edit;
    const { view } = this.scene;
    const use = (name, act, kind = '') => button(say(`ui.edit.${name}`), act, { 'data-edit': name, class: kind });
    return el('div', { class: 'row uses', 'data-scan': 'row', 'data-scan-order': 0 },
      points.length === 0 && use('start', () => this.setPoints([[view.x, view.y]])),
      points.length === 1 && use('next', () => this.addSecond()),
      points.length === 2 && use('draw', () => this.send(), 'primary'),
      points.length > 0 && use('again', () => this.setPoints([])),
      points.length === 0 && this.app.chair.edits?.length > 0 && use('undo', () => this.takeBack(this.app.chair.edits.at(-1))),
      button(say('ui.done'), () => this.end(), { 'data-edit': 'done' }));
  }

  send() {
    const { kind, points } = this.scene.edit;
    if (this.app.command({ op: 'edit', kind, points })) this.setPoints([]);
  }

  takeBack(edit) {
    this.app.command({ op: 'unedit', ...edit });
  }

  /** The list of what is drawn, each with a button that takes it back. */
  showList() {
    const { chair } = this.app;
    keepFocus(this.list, () => fill(this.list, (chair.edits ?? []).map((edit, k) => {
      const text = itemText(edit, k + 1);
      return el('li', { 'data-drawn': k + 1 }, el('span', {}, text), chair.mayDrive && el('div', { class: 'row', 'data-scan': 'row' },
        button(say('ui.edit.remove'), () => this.takeBack(edit), { 'aria-label': `${say('ui.edit.remove')}: ${text}`, 'data-unedit': k + 1 })));
    })), '[data-unedit]');
    if (this.scene.edit) this.draw();
    document.dispatchEvent(new CustomEvent('screen-changed'));
  }
}

/** Change what is in a node; the focus stays on the same button, or goes to the first of `others` where that is gone. */
function keepFocus(node, change, others) {
  const held = node.contains(document.activeElement) ? { ...document.activeElement.dataset } : null;
  change();
  if (!held) return;
  const same = [...node.querySelectorAll('button')].find((one) => Object.entries(held).every(([key, value]) => one.dataset[key] === value));
  (same ?? node.querySelector(others) ?? document.querySelector('[data-edit]'))?.focus();
}

function itemText({ kind, points: [[ax, ay], [bx, by]] }, count) {
  const [width, height] = kind === 'wall' ? [Math.hypot(bx - ax, by - ay), 0] : [Math.abs(bx - ax), Math.abs(by - ay)];
  return say(`ui.edit.item.${kind}`, { number: number(count, 0), width: number(width), height: number(height) });
}
