// The map: where the chair is, its plan, what its sensors see. A tap marks a point; buttons move and turn it.

import { button, el, fill } from '../dom.js';
import { paint } from '../painter.js';
import { number, say } from '../words.js';
import { View } from '../view.js';
import { Editing } from './edit.js';
import { askName, placesRow } from './places.js';
import { whereCard } from './where.js';

const STEP = 0.25; // m
const TURN = Math.PI / 12;
const view = new View(); // stays while other screens are shown

export function show(app, screen) {
  const { chair } = app;
  const scene = { chair, view, marker: null, edit: null };
  const canvas = el('canvas', { id: 'map', role: 'img', 'data-dwell': true });
  const marking = el('div', { class: 'marking' });
  let frame = null;
  const draw = () => {
    frame ??= requestAnimationFrame(() => {
      frame = null;
      paint(canvas, scene);
    });
  };
  const mark = (pose) => {
    const was = scene.marker !== null;
    scene.marker = pose && [pose[0], pose[1], wrap(pose[2])];
    if (was !== (scene.marker !== null)) drawMarking(app, marking, scene, mark, editing);
    tellMarker(marking, scene.marker);
    draw();
  };
  const editing = new Editing(app, scene, { changed: draw, left: () => {
    drawMarking(app, marking, scene, mark, editing);
    marking.querySelector('[data-edit="begin"]')?.focus();
  } });
  const tap = (x, y) => {
    const box = canvas.getBoundingClientRect();
    const point = view.toMap(x - box.left, y - box.top);
    if (scene.edit) editing.tap(...point);
    else mark([...point, scene.marker?.[2] ?? chair.state?.pose?.[2] ?? 0]);
  };
  canvas.addEventListener('click', (event) => tap(event.clientX, event.clientY));
  canvas.addEventListener('dwell', (event) => tap(event.detail.x, event.detail.y));
  const sized = new ResizeObserver(draw);
  sized.observe(canvas);
  const saving = el('div', { class: 'saving' });
  const places = placesRow(app);
  const where = whereCard(app, true);
  const drawn = el('section', { class: 'card' }, el('h2', {}, say('ui.edit.list')), editing.list);
  fill(screen,
    el('h1', {}, say('ui.tab.map')),
    el('div', { class: 'mapside' }, canvas, el('div', { class: 'mapcontrols' }, marking, editing.node, looks(app, scene, draw), saving)),
    where.node, places.node, drawn,
  );
  drawMarking(app, marking, scene, mark, editing);
  const told = {};
  const update = (op) => {
    const pose = chair.state?.pose;
    const text = pose ? say('ui.map.label', { x: number(pose[0]), y: number(pose[1]) }) : say('ui.map.nowhere');
    if (told.label !== text) canvas.setAttribute('aria-label', (told.label = text));
    const news = JSON.stringify([chair.edits, chair.mayDrive]);
    if (told.edits !== news) {
      told.edits = news;
      if (scene.edit && (!chair.mayDrive || chair.edits === null)) editing.end();
      drawn.hidden = !chair.edits?.length;
      editing.showList();
      drawMarking(app, marking, scene, mark, editing);
    }
    const maps = chair.state?.maps === true && chair.mayDrive;
    if (told.maps !== maps) drawSaving(app, saving, (told.maps = maps));
    where.update();
    places.update(op);
    draw();
  };
  update();
  return {
    view,
    update,
    leave() {
      sized.disconnect();
      cancelAnimationFrame(frame);
    },
  };
}

/** Do something with the chair's pose, or say that there is none. */
function withPose(app, act) {
  const pose = app.chair.state?.pose;
  if (pose) act(pose);
  else app.notice('error.no_pose');
}

function wrap(angle) {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

/** Zoom and pan. */
function looks(app, { view: seen }, draw) {
  const act = (change) => () => {
    change();
    draw();
  };
  const look = (text, name, change, shape = null) => button(text, act(change), { 'aria-label': say(`ui.map.${name}`), 'data-look': name, class: 'small' }, shape);
  return el('div', { class: 'row looks', 'data-scan': 'row', role: 'group', 'aria-label': say('ui.map.looks') },
    look('+', 'closer', () => seen.zoom(1.5)), look('↑', 'north', () => seen.pan(0, 0.25)), look('−', 'farther', () => seen.zoom(1 / 1.5)),
    look('', 'chair', () => withPose(app, ([x, y]) => Object.assign(seen, { x, y })), 'target'),
    look('←', 'west', () => seen.pan(-0.25, 0)), look('↓', 'south', () => seen.pan(0, -0.25)), look('→', 'east', () => seen.pan(0.25, 0)),
    look('', 'whole', () => {
      seen.fitted = false;
    }, 'whole'));
}

/** While a map is being made: save it. */
function drawSaving(app, node, maps) {
  fill(node, maps ? [el('p', {}, say('ui.map.growing')), el('div', { class: 'row', 'data-scan': 'row' },
    button(say('ui.map.save'), () => app.command({ op: 'save_map' }), { 'data-save-map': 'now' }))] : []);
  document.dispatchEvent(new CustomEvent('screen-changed'));
}

/** Without a marker: how to set one. With one: move, turn, and what to do with it. */
function drawMarking(app, node, scene, mark, editing) {
  const changed = () => document.dispatchEvent(new CustomEvent('screen-changed'));
  if (!app.chair.mayDrive || scene.edit) {
    fill(node);
  } else if (!scene.marker) {
    fill(node, el('p', {}, say('ui.map.tap')), el('div', { class: 'row', 'data-scan': 'row' },
      button(say('ui.map.mark_middle'), () => {
        mark([scene.view.x, scene.view.y, app.chair.state?.pose?.[2] ?? 0]);
        node.querySelector('[data-move]').focus();
      }, { 'data-mark': 'middle' }),
      button(say('ui.map.mark_chair'), () => {
        withPose(app, (pose) => {
          mark(pose);
          node.querySelector('[data-move]').focus();
        });
      }, { 'data-mark': 'chair' }),
      app.chair.edits !== null && button(say('ui.edit.begin'), () => {
        editing.begin();
        drawMarking(app, node, scene, mark, editing);
      }, { 'data-edit': 'begin' })));
  } else {
    fill(node, moves(scene, mark), uses(app, node, scene, mark));
  }
  changed();
}

function moves(scene, mark) {
  const move = (text, name, dx, dy, turn) => button(text, () => {
    const [x, y, yaw] = scene.marker;
    mark([x + dx, y + dy, yaw + turn]);
  }, { 'aria-label': say(`ui.move.${name}`), 'data-move': name, class: 'small' });
  return [
    el('p', { class: 'marker', role: 'status' }),
    el('div', { class: 'row moves', 'data-scan': 'row', 'data-scan-order': 1, role: 'group', 'aria-label': say('ui.move') },
      move('↺', 'left', 0, 0, TURN), move('↑', 'north', 0, STEP, 0), move('↻', 'right', 0, 0, -TURN),
      move('←', 'west', -STEP, 0, 0), move('↓', 'south', 0, -STEP, 0), move('→', 'east', STEP, 0, 0)),
  ];
}

function uses(app, node, scene, mark) {
  const use = (name, frame) => button(say(`ui.map.${name}`), () => {
    if (app.command({ op: frame, pose: scene.marker })) {
      mark(null);
      if (frame === 'pose') app.notice('ui.map.told');
    }
    node.querySelector('button')?.focus();
  }, { 'data-use': name, class: name === 'go_here' ? 'primary' : '' });
  return el('div', { class: 'row', 'data-scan': 'row', 'data-scan-order': 0, role: 'group', 'aria-label': say('ui.map.uses') },
    use('go_here', 'go'), use('am_here', 'pose'),
    button(say('ui.place.save'), async () => {
      const name = await askName(app, say('ui.place.save'), '');
      if (name && app.command({ op: 'place', name, pose: scene.marker })) mark(null);
    }, { 'data-use': 'save' }),
    button(say('ui.map.unmark'), () => {
      mark(null);
      node.querySelector('button')?.focus();
    }, { 'data-use': 'unmark' }));
}

function tellMarker(node, marker) {
  const line = node.querySelector('.marker');
  if (!line || !marker) return;
  line.textContent = say('ui.map.marker', { x: number(marker[0], 2), y: number(marker[1], 2), degrees: number(Math.round((marker[2] * 180) / Math.PI) || 0, 0) });
}
