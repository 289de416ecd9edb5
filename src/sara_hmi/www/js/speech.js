// Says sentences aloud, if the rider wants it: by the browser's voice, or by the chair's.

import { currentLanguage, say } from './words.js';

export class Speech {
  constructor(settings, connection) {
    this.settings = settings;
    this.connection = connection;
  }

  /** Say a key of the catalogue. `asked`: the rider pressed for it, so it is said even if speech is off. */
  say(key, values = {}, asked = false) {
    const voice = this.settings.get('speech');
    if (voice === 'off' && !asked) return;
    if (voice === 'chair') {
      this.connection.send({ op: 'say', key, values, language: currentLanguage(), ...(asked ? { asked } : {}) });
      return;
    }
    this.sayText(say(key, values));
  }

  /** Say a text that stands on the screen (the name of what is scanned). */
  sayText(text) {
    if (!('speechSynthesis' in window)) return;
    const utterance = new SpeechSynthesisUtterance(text);
    utterance.lang = currentLanguage();
    speechSynthesis.cancel();
    speechSynthesis.speak(utterance);
  }
}
