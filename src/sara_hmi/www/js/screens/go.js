// Go to a named place: tap, confirm, go; then pause, go on, cancel.

import { ask, button, el, fill } from '../dom.js';
import { number, placeName, say } from '../words.js';
import { whereCard } from './where.js';

const USES = 'sara.uses'; // how often each place was chosen here
const FEW = 4; // as many places are shown as near, or as often used

export function show(app, screen) {
  const filter = { name: 'all' };
  const journey = el('section', { class: 'journey', 'aria-label': say('ui.journey'), 'data-scan': 'row', 'data-scan-order': 0 });
  const tiles = el('div', { class: 'tiles' });
  const filters = el('div', { class: 'row filters', 'data-scan': 'row', 'data-scan-order': 6, role: 'group', 'aria-label': say('ui.filter') });
  const where = whereCard(app);
  const wide = matchMedia('(min-width: 600px)');
  const told = {};
  const draw = () => {
    drawFilters(filters, filter, () => draw());
    drawTiles(app, tiles, filter.name, wide.matches ? 3 : 2);
  };
  fill(screen, el('h1', {}, say('ui.go.title')), journey, where.node, filters, tiles);
  const update = (op) => {
    drawJourney(app, journey, told);
    where.update();
    if (op === undefined || op === 'places' || op === 'welcome') draw();
  };
  wide.addEventListener('change', draw);
  update();
  return { update, leave: () => wide.removeEventListener('change', draw) };
}

function uses() {
  try {
    return JSON.parse(localStorage.getItem(USES)) ?? {};
  } catch {
    return {};
  }
}

/** Names of the places to be shown, in the order of the alphabet. */
function chosen({ chair }, filter) {
  const names = Object.keys(chair.places);
  const pose = chair.state?.pose;
  const away = (name) => Math.hypot(chair.places[name][0] - pose[0], chair.places[name][1] - pose[1]);
  const used = uses();
  let some = names;
  if (filter === 'near' && pose) some = names.sort((a, b) => away(a) - away(b)).slice(0, FEW);
  if (filter === 'often') some = names.sort((a, b) => (used[b] ?? 0) - (used[a] ?? 0)).slice(0, FEW);
  return some.sort((a, b) => placeName(a).localeCompare(placeName(b)));
}

function drawFilters(row, filter, changed) {
  fill(row, ['all', 'near', 'often'].map((name) => button(say(`ui.filter.${name}`), () => {
    filter.name = name;
    changed();
    row.querySelector(`[data-filter="${name}"]`).focus();
    document.dispatchEvent(new CustomEvent('screen-changed'));
  }, { 'data-filter': name, 'aria-pressed': String(name === filter.name) })));
}

function drawTiles(app, tiles, filter, columns) {
  const names = chosen(app, filter);
  const rows = [];
  for (let k = 0; k < names.length; k += columns) rows.push(names.slice(k, k + columns));
  const focused = document.activeElement?.dataset?.place;
  tiles.style.setProperty('--columns', String(columns));
  fill(tiles, names.length === 0 ? el('p', {}, say('ui.no_places')) : rows.map((row) =>
    el('div', { class: 'tilerow', 'data-scan': 'row', 'data-scan-order': 1, 'aria-label': row.map(placeName).join(', ') },
      row.map((name) => button(placeName(name), () => confirm(app, name), { class: 'tile', 'data-place': name, disabled: !app.chair.mayDrive })))));
  if (focused) tiles.querySelector(`[data-place="${CSS.escape(focused)}"]`)?.focus();
  document.dispatchEvent(new CustomEvent('screen-changed'));
}

async function confirm(app, name) {
  app.speech.say('ui.go.question', { place: name });
  const answer = await ask(say('ui.go.question', { place: name }), [
    { text: say('ui.go.yes'), value: 'go', kind: 'primary' },
    { text: say('ui.back'), value: null },
  ]);
  if (answer && app.command({ op: 'go', place: name })) {
    const used = uses();
    localStorage.setItem(USES, JSON.stringify({ ...used, [name]: (used[name] ?? 0) + 1 }));
  }
  document.querySelector(`#screen [data-place="${CSS.escape(name)}"]`)?.focus();
}

/** Where the chair goes, how far it is, and what can be done about it. */
function drawJourney(app, section, told) {
  const goal = app.chair.state?.goal;
  const active = goal && ['going', 'paused', 'pending'].includes(goal.state);
  const kind = active ? `${goal.state} ${goal.place}` : 'none';
  if (told.kind !== kind) {
    told.kind = kind;
    told.left = null;
    told.whole = null;
    section.hidden = !active;
    fill(section, !active ? [] : [
      el('h2', {}, say(`goal.${goal.state}`, { place: goal.place })),
      el('p', { class: 'left' }), el('progress', { max: 100, value: 0, 'aria-label': say('ui.progress') }),
      el('div', { class: 'row' },
        goal.state === 'paused'
          ? button(say('ui.resume'), () => app.command({ op: 'resume' }), { class: 'primary', 'data-do': 'resume' })
          : button(say('ui.pause'), () => app.command({ op: 'pause' }), { class: 'primary', 'data-do': 'pause' }),
        button(say('ui.cancel'), () => app.command({ op: 'cancel' }), { 'data-do': 'cancel' })),
    ]);
    document.dispatchEvent(new CustomEvent('screen-changed'));
  }
  if (!active || typeof goal.left !== 'number') return;
  told.whole = Math.max(told.whole ?? 0, goal.left, 0.1);
  const text = say('ui.left', { metres: number(goal.left, goal.left < 10 ? 1 : 0) });
  if (text === told.left) return;
  told.left = text;
  section.querySelector('.left').textContent = text;
  section.querySelector('progress').value = 100 * (1 - goal.left / told.whole);
}
