// Drive by hand: joystick, arrows, keys; the speed profile; who has the controls.

import { driveByKeys, makeArrows } from '../arrows.js';
import { button, el, fill } from '../dom.js';
import { makeStick } from '../stick.js';
import { number, say } from '../words.js';

const SLOW = new Set(['error.drive_late', 'error.drive_lift', 'error.drive_used']); // of these the rest tells, or nobody needs to

export function show(app, screen) {
  const { chair, pump, connection, settings } = app;
  const stick = makeStick(pump, say('ui.stick'));
  const banner = el('p', { class: 'banner', role: 'status' });
  const ask = el('div', { class: 'row', 'data-scan': 'row', 'data-scan-order': 0 });
  const speed = el('p', { class: 'speed' });
  const profiles = el('div', { class: 'row profiles', 'data-scan': 'row', role: 'group', 'aria-label': say('ui.profile') });
  const alone = el('div', { class: 'alone', 'data-scan': 'row' });
  fill(screen,
    el('h1', {}, say('ui.tab.drive')),
    banner,
    el('div', { class: 'controls' }, el('div', { class: 'sticks' }, stick.node), makeArrows(pump, settings)),
    el('div', { class: 'speedrow' }, speed, alone, ask), profiles,
  );
  const leaveKeys = driveByKeys(pump);
  const rested = ({ detail }) => {
    const key = { slow: 'ui.rest.slow', offline: 'ui.rest.offline', frozen: 'ui.rest.left', left: 'ui.rest.left', turned: 'ui.rest.left' }[detail];
    if (key) app.notice(key);
  };
  const held = () => app.notice(null);
  pump.addEventListener('rest', rested);
  pump.addEventListener('held', held);
  const told = {};
  const update = () => {
    tellState(app, banner, told);
    offer(app, ask, told);
    offerProfiles(app, profiles, told);
    offerOverride(app, alone, told);
    put(speed, say('ui.speed', { kmh: speedText(app) }));
    stick.node.classList.toggle('off', !canDrive(app));
  };
  const refused = ({ detail: { ok, why } }) => !ok && !SLOW.has(why) && app.notice(why);
  connection.addEventListener('ack', refused);
  update();
  return {
    update,
    leave() {
      pump.removeEventListener('rest', rested);
      pump.removeEventListener('held', held);
      connection.removeEventListener('ack', refused);
      stick.leave();
      leaveKeys();
      if (chair.mayDrive) connection.send({ op: 'release' }); // the controls, or the wish to have them
    },
  };
}

function speedText({ chair, connection }) {
  const v = connection.isSilent ? null : chair.state?.v ?? null;
  return v === null ? '–' : number(Math.abs(v) * 3.6, 1);
}

function canDrive({ chair, connection }) {
  return connection.isOpen && chair.mayDrive && !connection.isSlow && !chair.isStopped && (chair.driver === null || chair.isDriver);
}

function tellState(app, banner, told) {
  const { chair, connection } = app;
  let key = app.settings.get('arrows') === 'hold' ? 'ui.drive.ready' : 'ui.drive.ready_step';
  if (!connection.isOpen) key = 'ui.offline';
  else if (chair.welcome && !chair.mayDrive) key = 'ui.drive.look';
  else if (connection.isSlow) key = 'ui.drive.slow';
  else if (chair.isStopped) key = 'ui.drive.stopped';
  else if (chair.driver !== null && !chair.isDriver) key = 'ui.drive.other';
  if (key.startsWith('ui.drive.ready') && chair.unhelped) key = chair.unhelped;
  const text = say(key, { name: chair.driverName || say('ui.somebody') });
  if (told.banner === text) return;
  told.banner = text;
  banner.textContent = text;
  banner.dataset.kind = key.startsWith('ui.drive.ready') ? 'good' : 'mind';
}

/** The button that asks for the controls, or gives them back. */
function offer(app, row, told) {
  const { chair } = app;
  const wanted = !chair.mayDrive ? 'none' : chair.isDriver ? 'release' : chair.driver === null ? 'none' : 'take';
  if (told.offer === wanted) return;
  told.offer = wanted;
  fill(row, wanted === 'none' ? [] : button(say(`ui.${wanted}`), () => app.command({ op: wanted }), { 'data-offer': wanted }));
  document.dispatchEvent(new CustomEvent('screen-changed'));
}

/** Where shared control helps: the button that switches its help off for a while and on again. */
function offerOverride(app, row, told) {
  const { chair } = app;
  const there = Boolean(chair.state?.assist) && chair.state.assist.does !== 'OFF';
  if (told.assisted !== there) {
    told.assisted = there;
    fill(row, there ? button(' ', () => app.command({ op: 'override', on: !(app.chair.state?.assist?.left > 0) }), { 'data-do': 'override' }) : []);
    document.dispatchEvent(new CustomEvent('screen-changed'));
  }
  if (!there) return;
  const { left, lasts } = chair.state.assist;
  const press = row.firstElementChild;
  press.disabled = !chair.mayAssist;
  put(press.firstChild, left > 0 ? say('ui.override.end', { seconds: left }) : say('ui.override.begin', { seconds: lasts }));
}

function put(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

function offerProfiles(app, row, told) {
  const { profiles = [], profile } = app.chair.welcome ?? {};
  const wanted = JSON.stringify([profiles, profile]);
  if (told.profiles === wanted) return;
  told.profiles = wanted;
  const focused = document.activeElement?.dataset?.profile;
  fill(row, profiles.map((name) => button(say(`ui.profile.${name}`, {}, name), () => app.command({ op: 'profile', name }),
    { 'data-profile': name, 'aria-pressed': String(name === profile), disabled: !app.chair.mayDrive })));
  row.querySelector(`[data-profile="${focused}"]`)?.focus();
}
