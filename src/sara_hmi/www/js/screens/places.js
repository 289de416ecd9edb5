// The list of named places below the map: add where the chair is, rename, delete.

import { ask, button, el, fill } from '../dom.js';
import { placeName, say } from '../words.js';

const LONGEST = 40;

/** What a name must be for the places' file: a letter first, then letters, digits, _ and -; blanks become _. "" if it cannot. */
export function fileName(text) {
  const name = text.trim().replace(/\s+/g, '_').replace(/[^\p{L}\p{N}_-]/gu, '').replace(/^[^\p{L}]+/u, '');
  return name.slice(0, LONGEST);
}

/** The first of place_1, place_2, ... that is free: a name for who cannot type. */
function freeName(chair) {
  let k = 1;
  while (`${say('ui.place.stem')}_${k}` in chair.places) k += 1;
  return `${say('ui.place.stem')}_${k}`;
}

/** Ask for a name. Resolves to a name that is allowed, or null. */
export async function askName(app, title, name) {
  const input = el('input', { id: 'name', type: 'text', maxlength: LONGEST, autocomplete: 'off' });
  input.value = (name || freeName(app.chair)).replaceAll('_', ' ');
  const body = [el('label', { for: 'name' }, say('ui.place.name')), input];
  input.addEventListener('keydown', (event) => event.key === 'Enter' && document.querySelector('#question .primary').click());
  const answer = await ask(title, [
    { text: say('ui.save'), value: 'save', kind: 'primary' },
    { text: say('ui.back'), value: null },
  ], body);
  if (!answer) return null;
  const wanted = fileName(input.value);
  if (!wanted) app.notice('ui.place.bad_name');
  return wanted || null;
}

export function placesRow(app) {
  const list = el('ul', { class: 'places' });
  const add = el('div', { class: 'row', 'data-scan': 'row' });
  const node = el('section', { class: 'card' }, el('h2', {}, say('ui.places')), add, list);
  const addHere = async () => {
    const name = await askName(app, say('ui.place.add_here'), '');
    if (name) app.command({ op: 'place', name });
  };
  return {
    node,
    update(op) {
      if (op !== undefined && op !== 'places' && op !== 'welcome') return;
      const names = Object.keys(app.chair.places).sort((a, b) => placeName(a).localeCompare(placeName(b)));
      fill(add, app.chair.mayDrive ? button(say('ui.place.add_here'), addHere, { 'data-place-do': 'add' }) : []);
      fill(list, names.map((name) => item(app, name)));
      document.dispatchEvent(new CustomEvent('screen-changed'));
    },
  };
}

function item(app, name) {
  const rename = async () => {
    const to = await askName(app, say('ui.place.rename_to', { place: name }), name);
    if (to && to !== name) app.command({ op: 'rename', name, to });
  };
  const remove = async () => {
    const answer = await ask(say('ui.place.delete_question', { place: name }), [
      { text: say('ui.place.delete'), value: 'delete', kind: 'primary' },
      { text: say('ui.back'), value: null },
    ]);
    if (answer) app.command({ op: 'delete', name });
  };
  const label = (what) => `${say(`ui.place.${what}`)}: ${placeName(name)}`;
  return el('li', { 'data-name': name }, el('span', {}, placeName(name)), app.chair.mayDrive && el('div', { class: 'row', 'data-scan': 'row', 'aria-label': placeName(name) },
    button(say('ui.place.rename'), rename, { 'aria-label': label('rename'), 'data-place-do': 'rename' }),
    button(say('ui.place.delete'), remove, { 'aria-label': label('delete'), 'data-place-do': 'delete' })));
}
