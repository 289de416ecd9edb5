// Begins the page: connection, screens, stop, and what all screens show.

import { Chair } from './chair.js';
import { Connection } from './connection.js';
import { ask, button, el, fill, icon, withdrawQuestion } from './dom.js';
import { Dwell } from './dwell.js';
import { Pump, restWhenLeft } from './pump.js';
import { Scanner } from './scan.js';
import * as drive from './screens/drive.js';
import * as go from './screens/go.js';
import * as map from './screens/map.js';
import * as pair from './screens/pair.js';
import * as settingsScreen from './screens/settings.js';
import * as why from './screens/why.js';
import { Settings } from './settings.js';
import { Speech } from './speech.js';
import { Status } from './status.js';
import { Stop } from './stop.js';
import { currentLanguage, loadWords, say } from './words.js';

const SCREENS = { go, drive, map, why, settings: settingsScreen };
const TOKEN = 'sara.token';
const WORDS_AGAIN_MS = 1000;

class App {
  constructor() {
    this.settings = new Settings();
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    this.connection = new Connection({
      url: `${scheme}://${location.host}/ws`,
      hello: () => ({ language: this.settings.get('language'), ...(this.token ? { token: this.token } : {}) }),
    });
    this.chair = new Chair(this.connection);
    this.speech = new Speech(this.settings, this.connection);
    this.pump = new Pump({
      drive: (v, w) => this.connection.drive(v, w),
      halt: () => this.connection.halt(),
      ready: () => this.chair.isDriver && this.connection.hasBeat && !this.connection.isSlow,
      take: () => this.chair.isDriver || (this.chair.driver === null && this.connection.send({ op: 'take' })),
    });
    restWhenLeft(this.pump, this.connection);
    this.stopper = new Stop(this);
    this.status = new Status(this);
    this.shown = null;
  }

  get token() {
    return localStorage.getItem(TOKEN);
  }

  set token(value) {
    localStorage.setItem(TOKEN, value);
  }

  async begin() {
    this.dress();
    await this.fetchWords();
    this.stopper.begin();
    this.status.begin();
    this.scanner = new Scanner({
      settings: this.settings,
      moving: () => this.chair.isMoving || this.chair.isGoing || this.pump.isHeld,
      stop: () => this.stopper.byOneSwitch(),
      tell: (text) => this.settings.get('speech') === 'screen' && this.speech.sayText(text),
    });
    this.dwell = new Dwell({ settings: this.settings, busy: () => this.pump.isHeld, stop: () => this.stopper.press() });
    this.settings.addEventListener('change', (event) => this.settingChanged(event.detail));
    this.chair.addEventListener('change', (event) => this.heard(event.detail));
    this.connection.addEventListener('speed', () => this.heard('speed')); // twice a second, also while nothing comes
    this.listen();
    window.addEventListener('hashchange', () => this.route());
    this.route();
    this.connection.open();
    window.sara = this; // for the browser's console, and tests
  }

  /** Until they are there: without words the page can say nothing, not even that there is no connection. */
  async fetchWords() {
    for (;;) {
      try {
        return await loadWords(this.settings.get('language'));
      } catch {
        await new Promise((resolve) => setTimeout(resolve, WORDS_AGAIN_MS));
      }
    }
  }

  listen() {
    const on = (op, act) => this.connection.addEventListener(op, (event) => act(event.detail));
    on('error', (frame) => this.notice(frame.key, frame.values));
    on('saved', (frame) => this.notice(frame.key, frame.values));
    on('ended', (frame) => {
      this.notice(frame.key, frame.values);
      this.speech.say(frame.key, frame.values);
    });
    on('asked', (frame) => this.handOver(frame));
    on('paired', (frame) => {
      this.token = frame.token;
      history.replaceState(null, '', '#go');
      this.connection.drop();
      this.connection.open();
    });
  }

  /** Somebody else wants to drive. */
  async handOver({ session, name, seconds }) {
    this.pump.rest('asked');
    this.isAsked = true;
    const over = setTimeout(withdrawQuestion, seconds * 1000);
    const answer = await ask(say('ui.asked', { name: name || say('ui.somebody') }), [
      { text: say('ui.grant'), value: 'grant' },
      { text: say('ui.refuse'), value: 'refuse' },
    ]);
    clearTimeout(over);
    this.isAsked = false;
    if (answer) this.command({ op: answer, session });
  }

  /** Send a command, or say that it was not sent. Returns whether it was. */
  command(frame) {
    this.notice(null);
    const sent = this.connection.send(frame);
    if (!sent) this.notice('ui.not_sent');
    return sent;
  }

  notice(key, values = {}) {
    document.getElementById('notice').textContent = key ? say(key, values) : '';
  }

  heard(op) {
    if (op === 'welcome') {
      this.route();
      const code = /#code=([\w-]+)/.exec(location.hash)?.[1];
      if (code && this.chair.role === 'none') this.connection.send({ op: 'pair', code });
    }
    if (this.isAsked && !this.chair.isDriver) withdrawQuestion(); // there is nothing to hand over any more
    this.stopper.update();
    this.status.update();
    this.current?.update?.(op);
  }

  settingChanged(name) {
    this.dress();
    if (name === 'language' && this.settings.get('language') !== currentLanguage()) this.changeLanguage();
  }

  /** To the chosen one; without its words the language stays as it is. */
  async changeLanguage() {
    const changed = await loadWords(this.settings.get('language')).then(() => true, () => false);
    if (!changed) this.settings.set('language', currentLanguage());
    this.stopper.begin();
    this.status.begin();
    this.show(this.shown, true);
    if (!changed) this.notice('ui.not_sent');
  }

  /** What the style sheet needs to know. */
  dress() {
    document.body.dataset.hands = this.settings.get('hands');
    document.body.dataset.contrast = this.settings.get('contrast');
  }

  route() {
    const wanted = location.hash.slice(1);
    if (this.chair.role === 'none') this.show('pair');
    else this.show(wanted in SCREENS ? wanted : 'go');
  }

  show(name, again = false) {
    if (name === this.shown && !again) return;
    this.pump.rest('left');
    this.current?.leave?.();
    withdrawQuestion();
    this.notice(null);
    const moved = this.shown !== null && this.shown !== name;
    this.shown = name;
    const screen = document.getElementById('screen');
    screen.className = `screen-${name}`;
    this.current = (SCREENS[name] ?? pair).show(this, screen);
    document.title = `${say(`ui.tab.${name}`)} - SARA`;
    this.tabs();
    this.stopper.update();
    this.status.update();
    screen.scrollTop = 0;
    if (moved) screen.focus({ preventScroll: true });
    document.dispatchEvent(new CustomEvent('screen-changed'));
  }

  tabs() {
    const nav = document.getElementById('tabs');
    nav.setAttribute('aria-label', say('ui.tabs'));
    const focused = document.activeElement?.dataset?.tab;
    fill(nav, this.chair.role === 'none' ? [] : Object.keys(SCREENS).map((name) =>
      button(say(`ui.tab.${name}`), () => { location.hash = name; },
        { 'data-tab': name, 'aria-current': name === this.shown ? 'page' : null }, name)));
    nav.querySelector(`[data-tab="${focused}"]`)?.focus();
  }
}

export { ask, button, el, fill, icon };

new App().begin();
