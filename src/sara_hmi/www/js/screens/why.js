// Why the chair does what it does, and what would help; battery, sensors, the last stops.

import { button, el, fill } from '../dom.js';
import { batteryText } from '../status.js';
import { currentLanguage, has, say } from '../words.js';
import { whereCard } from './where.js';

export function show(app, screen) {
  const now = el('section', { class: 'card' });
  const help = el('p', { class: 'help' });
  const sentence = el('p', { class: 'big' });
  const assist = el('p', { class: 'doing' });
  fill(now, sentence, assist, help, el('div', { class: 'row', 'data-scan': 'row', 'data-scan-order': 1 },
    button(say('ui.say_it'), () => sayAll(app), { 'data-do': 'say' })));
  const where = whereCard(app);
  const battery = el('p', {});
  const sensors = el('ul', { class: 'sensors' });
  const history = el('ol', { class: 'history' });
  fill(screen,
    el('h1', {}, say('ui.why.title')), now, where.node,
    el('section', { class: 'card' }, el('h2', {}, say('ui.why.history')), history),
    el('section', { class: 'card' }, el('h2', {}, say('ui.why.sensors')), battery, sensors),
  );
  const told = {};
  const update = () => {
    const { chair } = app;
    put(told, 'sentence', say(chair.sentence.key, chair.sentence.values), (text) => { sentence.textContent = text; });
    put(told, 'assist', assistText(chair), (text) => { assist.textContent = text; });
    put(told, 'help', helpText(chair), (text) => { help.textContent = text; });
    where.update();
    put(told, 'battery', batteryText(chair) || say('ui.battery_unknown'), (text) => { battery.textContent = text; });
    put(told, 'sensors', JSON.stringify(chair.state?.connected ?? {}), () => drawSensors(chair, sensors));
    put(told, 'history', JSON.stringify(chair.history), () => drawHistory(chair, history));
  };
  update();
  return { update };
}

function put(told, name, value, act) {
  if (told[name] === value) return;
  told[name] = value;
  act(value);
}

/** The key of what would help; null where nobody knows. */
function helpKey(chair) {
  const reason = chair.state?.gate?.reasons?.[0];
  if (reason && !chair.connection.isSilent) return `help.${reason}`;
  if (!chair.isFree) return null;
  return chair.isLost ? 'ui.where.help' : 'ui.why.nothing';
}

function helpText(chair) {
  const key = helpKey(chair);
  return key ? say(key) : '';
}

/** What shared control does otherwise than asked, or why it does not help. */
function assistText(chair) {
  const does = chair.state?.assist?.does;
  return does && !chair.connection.isSilent ? say(`assist.${does}`) : '';
}

function sayAll(app) {
  const { key, values } = app.chair.sentence;
  if (app.settings.get('speech') === 'chair') {
    app.speech.say(key, values, true);
    if (helpKey(app.chair)) app.speech.say(helpKey(app.chair), {}, true);
  } else {
    app.speech.sayText(`${say(key, values)} ${helpText(app.chair)}`);
  }
}

function drawSensors(chair, list) {
  const connected = Object.entries(chair.state?.connected ?? {});
  fill(list, connected.length === 0 ? el('li', {}, say('ui.why.no_sensors')) : connected.map(([topic, alive]) => {
    return el('li', { 'data-alive': String(alive) },
      el('span', {}, topicName(topic)),
      el('strong', {}, say(alive ? 'ui.alive' : 'ui.silent')));
  }));
}

function drawHistory(chair, list) {
  const time = new Intl.DateTimeFormat(currentLanguage(), { hour: '2-digit', minute: '2-digit', second: '2-digit', hourCycle: 'h23' });
  const entries = [...(chair.history ?? [])].sort((a, b) => b.t - a.t);
  fill(list, entries.length === 0 ? el('li', {}, say('ui.why.no_history')) : entries.map(({ t, key, values }) =>
    el('li', {}, el('time', { datetime: new Date(t).toISOString() }, time.format(t)), el('span', {}, say(key, values)))));
}

/** A topic in words: those that are known, any sensor NAME_range, else its name. */
function topicName(topic) {
  const name = topic.replace(/^\//, '');
  if (has(`ui.topic.${name}`)) return say(`ui.topic.${name}`);
  if (name.endsWith('_range')) return say('ui.topic.range', { name: name.slice(0, -'_range'.length) });
  return name.replaceAll(/[_/]/g, ' ');
}
