// What each user can adjust: language, speech, scanning, dwell, hands, contrast, arrows; how much
// shared control helps; and the carer's invitation.

import { ask, button, el, fill } from '../dom.js';
import { CHOICES } from '../settings.js';
import { LANGUAGES, number, say } from '../words.js';

const GROUPS = [
  ['ui.settings.screen', ['language', 'contrast', 'hands']],
  ['ui.settings.speech', ['speech']],
  ['ui.settings.driving', ['arrows', 'step', 'stop_keys']],
  ['ui.settings.switches', ['scan', 'scan_period', 'scan_touch']],
  ['ui.settings.dwell', ['dwell', 'dwell_time']],
];

export function show(app, screen) {
  const invite = el('section', { class: 'card' });
  const help = el('section', { class: 'card', hidden: true });
  const [first, ...others] = GROUPS.map(([title, names]) =>
    el('section', { class: 'card' }, el('h2', {}, say(title)), names.map((name) => setting(app, name))));
  fill(screen, el('h1', {}, say('ui.tab.settings')), first, help, others, invite);
  const invited = (event) => showInvitation(event.detail);
  app.connection.addEventListener('invited', invited);
  const told = {};
  const update = (op) => {
    offerHelp(app, help, told);
    if (op !== undefined && op !== 'welcome') return;
    fill(invite, app.chair.role !== 'rider' ? [] : [
      el('h2', {}, say('ui.settings.others')), el('p', {}, say('ui.invite.text')),
      el('div', { class: 'row', 'data-scan': 'row' }, ['carer', 'look'].map((role) =>
        button(say(`ui.invite.${role}`), () => app.command({ op: 'invite', role }), { 'data-invite': role }))),
    ]);
    invite.hidden = app.chair.role !== 'rider';
  };
  update();
  return { update, leave: () => app.connection.removeEventListener('invited', invited) };
}

/** How much shared control helps, where it runs and there is a choice: the chair's own setting, not this browser's. */
function offerHelp(app, card, told) {
  const { chair } = app;
  const { profile, profiles = [] } = chair.state?.assist ?? {};
  const wanted = JSON.stringify([profile, profiles, chair.mayAssist]);
  if (told.help === wanted) return;
  told.help = wanted;
  const focused = document.activeElement?.dataset?.help;
  card.hidden = profiles.length < 2;
  fill(card, card.hidden ? [] : [
    el('h2', {}, say('ui.help')), el('p', {}, say('ui.help.text')),
    el('div', { class: 'row choice', 'data-scan': 'row', role: 'group', 'aria-label': say('ui.help') }, profiles.map((name) =>
      button(say(`ui.help.${name}`, {}, name), () => app.command({ op: 'help', name }),
        { 'data-help': name, 'aria-pressed': String(name === profile), disabled: !chair.mayAssist }))),
  ]);
  card.querySelector(`[data-help="${focused}"]`)?.focus();
  document.dispatchEvent(new CustomEvent('screen-changed'));
}

function setting(app, name) {
  const choice = CHOICES[name];
  const title = say(`ui.set.${name}`);
  const row = el('div', { class: 'row choice', 'data-scan': 'row', role: 'group', 'aria-label': title });
  const draw = () => fill(row, Array.isArray(choice) ? choices(app, name, draw, row) : stepper(app, name, draw, row));
  draw();
  return el('div', { class: 'setting' }, el('p', { class: 'label', 'aria-hidden': 'true' }, title), row);
}

function choices(app, name, draw, row) {
  return CHOICES[name].map((value) => button(name === 'language' ? LANGUAGES[value] : say(`ui.set.${name}.${value}`), () => {
    app.settings.set(name, value);
    draw();
    refocus(row, value);
  }, { 'data-set': name, 'data-value': value, lang: name === 'language' ? value : null, 'aria-pressed': String(app.settings.get(name) === value) }));
}

function stepper(app, name, draw, row) {
  const { min, max, step } = CHOICES[name];
  const value = app.settings.get(name);
  const change = (by) => () => {
    app.settings.set(name, Math.min(max, Math.max(min, value + by)));
    draw();
    refocus(row, by < 0 ? 'less' : 'more');
  };
  const text = say('ui.seconds', { seconds: number(value, 1) });
  return [
    button('−', change(-step), { 'data-set': name, 'data-value': 'less', class: 'stepper', 'aria-label': say('ui.less', { what: `ui.set.${name}` }) }),
    el('output', { 'data-output': name, 'aria-live': 'polite' }, text),
    button('+', change(step), { 'data-set': name, 'data-value': 'more', class: 'stepper', 'aria-label': say('ui.more', { what: `ui.set.${name}` }) }),
  ];
}

function refocus(row, value) {
  row.querySelector(`[data-value="${value}"]`)?.focus();
  document.dispatchEvent(new CustomEvent('screen-changed'));
}

/** The code and its picture, for a person who stands beside the chair. */
function showInvitation({ code, url, svg, role }) {
  const body = [el('p', { class: 'code' }, code), el('p', {}, say('ui.invite.how', { url }))];
  if (svg) body.push(el('img', { class: 'qr', alt: say('ui.invite.qr'), src: `data:image/svg+xml,${encodeURIComponent(svg)}` }));
  ask(say('ui.invite.title', { role: `ui.role.${role}` }), [{ text: say('ui.done'), value: null }], body);
}
