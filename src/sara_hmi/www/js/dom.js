// Elements made in one call, and the shapes that screens share.

/** An element with attributes (`on*`: listeners; true: empty attribute; null or false: none) and children. */
export function el(name, attributes = {}, ...children) {
  const svg = name === 'svg' || name === 'path' || name === 'circle' || name === 'g';
  const node = svg ? document.createElementNS('http://www.w3.org/2000/svg', name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) node.addEventListener(key.slice(2), value);
    else if (value === true) node.setAttribute(key, '');
    else if (value !== null && value !== false && value !== undefined) node.setAttribute(key, value);
  }
  node.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

/** A large button with a text, and an icon above or before it. */
export function button(text, onclick, attributes = {}, iconName = null) {
  return el('button', { type: 'button', onclick, ...attributes }, iconName && icon(iconName), text && el('span', {}, text));
}

const ICONS = {
  go: 'M12 2a7 7 0 0 0-7 7c0 5 7 13 7 13s7-8 7-13a7 7 0 0 0-7-7zm0 9.5a2.5 2.5 0 1 1 0-5 2.5 2.5 0 0 1 0 5z',
  drive: 'M12 2l4 5h-3v4h4V8l5 4-5 4v-3h-4v4h3l-4 5-4-5h3v-4H7v3l-5-4 5-4v3h4V7H8z',
  map: 'M3 5l6-2v16l-6 2zM10 3l5 2v16l-5-2zM16 5l5-2v16l-5 2z',
  why: 'M12 2a10 10 0 1 0 0 20 10 10 0 0 0 0-20zm1 16h-2v-2h2zm1.6-6.2c-.9.8-1.6 1.4-1.6 2.7h-2c0-2.3 1.3-3.3 2.2-4.1.6-.5.9-.8.9-1.5a2.1 2.1 0 0 0-4.2 0H7.9a4.1 4.1 0 0 1 8.2 0c0 1.4-.8 2.2-1.5 2.9z',
  settings: 'M10.3 2h3.4l.5 2.7 1.7.9 2.6-.9 1.7 2.9-2 1.9v2l2 1.9-1.7 2.9-2.6-.9-1.7.9-.5 2.7h-3.4l-.5-2.7-1.7-.9-2.6.9-1.7-2.9 2-1.9v-2l-2-1.9 1.7-2.9 2.6.9 1.7-.9zM12 8a3 3 0 1 0 0 6 3 3 0 0 0 0-6z',
  up: 'M12 3l9 10h-6v8H9v-8H3z',
  down: 'M12 21L3 11h6V3h6v8h6z',
  left: 'M10 4v4h4a7 7 0 0 1 7 7v5h-4v-5a3 3 0 0 0-3-3h-4v4L2 10z',
  right: 'M14 4v4h-4a7 7 0 0 0-7 7v5h4v-5a3 3 0 0 1 3-3h4v4l8-6z',
  target: 'M11 1h2v4a7 7 0 0 1 6 6h4v2h-4a7 7 0 0 1-6 6v4h-2v-4a7 7 0 0 1-6-6H1v-2h4a7 7 0 0 1 6-6zM12 7a5 5 0 1 0 0 10 5 5 0 0 0 0-10zM12 10a2 2 0 1 1 0 4 2 2 0 0 1 0-4z',
  whole: 'M3 3h7v3H6v4H3zM14 3h7v7h-3V6h-4zM3 14h3v4h4v3H3zM18 14h3v7h-7v-3h4z',
  stop: 'M8 2h8l6 6v8l-6 6H8l-6-6V8zM8 8v8h8V8z',
};

export function icon(name) {
  return el('svg', { viewBox: '0 0 24 24', class: 'icon', 'aria-hidden': 'true', focusable: 'false' },
    el('path', { d: ICONS[name], 'fill-rule': 'evenodd' }));
}

/** Put new children into a node. */
export function fill(node, ...children) {
  node.replaceChildren(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
}

let pending = null;

/**
 * A question in place of the screen; the stop beside it stays. Resolves to the value of the chosen answer, or null if
 * another question comes between. `body`: nodes between title and answers. `answers`: {text, value, kind?}.
 */
export function ask(title, answers, body = []) {
  pending?.(null);
  const place = document.getElementById('question');
  return new Promise((resolve) => {
    const close = (value) => {
      pending = null;
      place.replaceChildren();
      showQuestion(place, false);
      resolve(value);
    };
    pending = close;
    fill(place,
      el('h2', { id: 'question-title', tabindex: -1 }, title),
      ...body,
      el('div', { class: 'answers', 'data-scan': 'items' },
        answers.map(({ text, value, kind }) => button(text, () => close(value), { class: kind ?? '', 'data-answer': value }))));
    showQuestion(place, true);
    (place.querySelector('input') ?? place.querySelector('.answers button')).focus();
  });
}

/** Take back the question that is shown, if any. */
export function withdrawQuestion() {
  pending?.(null);
}

function showQuestion(place, shown) {
  place.hidden = !shown;
  for (const id of ['screen', 'tabs']) document.getElementById(id).inert = shown;
  document.getElementById('screen').hidden = shown;
  document.dispatchEvent(new CustomEvent('screen-changed'));
}
