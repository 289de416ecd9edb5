// The catalogue of one language: keys with {placeholders}. Everything shown comes from here.

export const LANGUAGES = { en: 'English', es: 'Español' };
let words = {};
let language = 'en';

export async function loadWords(name) {
  const response = await fetch(`words/${name}.json`);
  if (!response.ok) throw new Error(`words/${name}.json: ${response.status}`);
  words = await response.json();
  language = name;
  document.documentElement.lang = name;
}

export function currentLanguage() {
  return language;
}

export function has(key) {
  return Object.hasOwn(words, key);
}

/** The sentence of a key. A value that is itself a key stands for that key's sentence; an unknown key is a general sentence. */
export function say(key, values = {}) {
  const text = has(key) ? words[key] : words['ui.unknown_key'] ?? '';
  return text.replace(/\{(\w+)\}/g, (whole, name) => {
    const value = values[name];
    if (value === undefined || value === null) return '';
    if (typeof value === 'number') return number(value, Number.isInteger(value) ? 0 : 1);
    return has(value) ? say(value, { ...values, [name]: null }) : name === 'place' ? placeName(value) : String(value);
  });
}

/** A number as the language writes it. */
export function number(value, digits = 1) {
  return new Intl.NumberFormat(language, { minimumFractionDigits: digits, maximumFractionDigits: digits }).format(value);
}

/** A place's name for people: underscores are blanks, the first letter is large. "" is a pose without a name. */
export function placeName(name) {
  if (!name) return say('goal.unnamed');
  if (has(`place.${name}`)) return words[`place.${name}`];
  const text = name.replaceAll('_', ' ');
  return text.charAt(0).toLocaleUpperCase(language) + text.slice(1);
}
