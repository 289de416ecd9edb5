// Where am I: whether the chair is sure of its place, in words, and one button per named place that tells it.

import { button, el, fill } from '../dom.js';
import { placeName, say } from '../words.js';

const COLUMNS = 3;

/** The card of a screen. always: it is also shown while the chair is not lost. */
export function whereCard(app, always = false) {
  const node = el('section', { class: 'card where', 'aria-label': say('ui.where') });
  let told = null;
  return {
    node,
    update() {
      const { chair } = app;
      const { lost } = chair;
      const names = chair.mayDrive ? Object.keys(chair.places) : [];
      const kind = JSON.stringify([lost, names]);
      if (kind === told) return;
      told = kind;
      const inside = node.contains(document.activeElement);
      const focused = document.activeElement?.dataset?.here;
      node.hidden = !always && lost !== true;
      fill(node, node.hidden ? [] : content(app, lost, names));
      if (inside) (node.querySelector(`[data-here="${CSS.escape(focused ?? '')}"]`) ?? document.getElementById('screen')).focus({ preventScroll: true });
      document.dispatchEvent(new CustomEvent('screen-changed'));
    },
  };
}

function content(app, lost, names) {
  const sorted = names.sort((a, b) => placeName(a).localeCompare(placeName(b)));
  const rows = [];
  for (let k = 0; k < sorted.length; k += COLUMNS) rows.push(sorted.slice(k, k + COLUMNS));
  const text = { true: 'lost', false: 'found', null: 'unknown' }[lost];
  return [
    el('h2', {}, say('ui.where')), el('p', {}, say(`ui.where.${text}`)), lost && el('p', { class: 'help' }, say('ui.where.help')),
    el('div', { class: 'here' }, rows.map((row) =>
      el('div', { class: 'row', 'data-scan': 'row', 'data-scan-order': lost ? 0 : 7, role: 'group', 'aria-label': row.map(placeName).join(', ') },
        row.map((place) => button(say('ui.where.here', { place }), () => {
          if (app.command({ op: 'pose', place })) app.notice('ui.where.told', { place });
        }, { 'data-here': place }))))),
  ];
}
