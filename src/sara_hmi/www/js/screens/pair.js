// A page that the chair does not know yet: the code from the chair's own screen.

import { button, el, fill } from '../dom.js';
import { say } from '../words.js';

export function show(app, screen) {
  const input = el('input', { id: 'code', type: 'text', autocomplete: 'off', autocapitalize: 'characters', spellcheck: 'false', maxlength: 16 });
  const send = () => input.value.trim() && app.command({ op: 'pair', code: input.value.trim().toUpperCase() });
  input.addEventListener('keydown', (event) => event.key === 'Enter' && send());
  fill(screen,
    el('h1', {}, say('ui.tab.pair')),
    el('p', {}, say('ui.pair.text')),
    el('label', { for: 'code' }, say('ui.pair.code')), input,
    el('div', { class: 'row', 'data-scan': 'row' }, button(say('ui.pair.send'), send, { class: 'primary' })),
  );
  return {};
}
