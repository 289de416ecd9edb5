// The emergency stop: on every screen, on press, whatever else happens. And its release, after a question.

import { ask, fill, icon, el } from './dom.js';
import { say } from './words.js';

const PAUSE_WAIT_MS = 1500; // a pause that has not come by then becomes a stop
const STOP_WAIT_MS = 2000; // a stop of which the chair has said nothing by then may not have come: the network is silent

export class Stop {
  constructor(app) {
    this.app = app;
    this.node = document.getElementById('stop');
    this.reset = document.getElementById('reset');
    this.node.addEventListener('pointerdown', () => this.press());
    this.node.addEventListener('click', (event) => event.detail === 0 && this.press());
    this.node.addEventListener('keydown', (event) => {
      if ((event.key === ' ' || event.key === 'Enter') && !event.repeat) {
        event.preventDefault();
        this.press();
      }
    });
    window.addEventListener('keydown', (event) => this.key(event), true);
    this.reset.addEventListener('click', () => this.askReset());
  }

  begin() {
    fill(this.node, icon('stop'), el('span', {}, say('ui.stop')));
    this.reset.textContent = say('ui.reset');
    this.update();
  }

  key(event) {
    const keys = this.app.settings.get('stop_keys');
    const isSpace = event.key === ' ' && keys === 'escape_space' && this.app.settings.get('scan') === 'off' && event.target.type !== 'text';
    if (!((event.key === 'Escape' && keys !== 'none') || isSpace)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat) this.press();
  }

  press() {
    this.app.pump.rest('stopped');
    const sent = this.app.connection.stop();
    this.tell(sent);
    clearTimeout(this.unheard);
    if (sent) this.unheard = setTimeout(() => this.app.chair.isStopped || this.tell(false), STOP_WAIT_MS);
  }

  tell(sent) {
    this.app.notice(sent ? 'ui.stop_sent' : 'ui.stop_not_sent');
    this.app.speech.say(sent ? 'ui.stop_sent' : 'ui.stop_not_sent');
  }

  /** A press of the only switch while the chair moves: a goal is paused, anything else is stopped; so is what does not pause. */
  byOneSwitch() {
    const { chair, pump, connection } = this.app;
    if (pump.isHeld) {
      pump.rest('stopped');
    } else if (chair.isGoing && !this.pausing) {
      if (!connection.send({ op: 'pause' })) return this.press();
      this.app.notice('ui.pausing');
      this.pausing = setTimeout(() => {
        this.pausing = null;
        if (chair.isGoing) this.press();
      }, PAUSE_WAIT_MS);
    } else {
      this.press();
    }
  }

  update() {
    const { chair } = this.app;
    if (this.pausing && chair.isPaused) {
      clearTimeout(this.pausing);
      this.pausing = null;
    }
    const hidden = !(chair.isStopped && chair.mayDrive);
    if (this.reset.hidden === hidden) return;
    this.reset.hidden = hidden;
    document.dispatchEvent(new CustomEvent('screen-changed'));
  }

  async askReset() {
    const answer = await ask(say('ui.reset_question'), [
      { text: say('ui.reset_yes'), value: 'reset', kind: 'primary' },
      { text: say('ui.back'), value: null },
    ], [el('p', {}, say('ui.reset_text'))]);
    if (answer) this.app.command({ op: 'reset' });
  }
}
