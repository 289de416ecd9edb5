// Draws map, plan, ranges, places, chair and marker.

import { placeName } from './words.js';

const COLOURS = { beyond: '#c9d3db', chair: '#0b4f8a', plan: '#0b7a3b', range: '#c2410c', marker: '#8a1c7c', ink: '#10202e', halo: '#ffffff' };

const HATCHED = { // kinds of edits
  keep_out: { line: '#a30f1f', fill: 'rgb(163 15 31 / 12%)', apart: 14 },
  slow: { line: '#8a5a00', fill: 'rgb(138 90 0 / 10%)', apart: 28 },
};

/** `scene`: {chair, view, marker: [x, y, yaw] or null, edit: {kind, points} or null}. */
export function paint(canvas, { chair, view, marker, edit }) {
  const ratio = window.devicePixelRatio || 1;
  view.width = canvas.clientWidth;
  view.height = canvas.clientHeight;
  if (canvas.width !== Math.round(view.width * ratio) || canvas.height !== Math.round(view.height * ratio)) {
    canvas.width = Math.round(view.width * ratio);
    canvas.height = Math.round(view.height * ratio);
  }
  view.fit(chair.map);
  const brush = canvas.getContext('2d');
  brush.setTransform(ratio, 0, 0, ratio, 0, 0);
  brush.fillStyle = COLOURS.beyond;
  brush.fillRect(0, 0, view.width, view.height);
  drawMap(brush, chair, view);
  drawEdits(brush, chair.edits ?? [], view, edit);
  drawPlan(brush, chair.plan, view);
  drawRanges(brush, chair, view);
  drawPlaces(brush, chair.places, view);
  const body = chair.welcome?.body;
  if (body && chair.state?.pose) drawBody(brush, body, chair.state.pose, view, COLOURS.chair, true);
  if (body && marker) drawBody(brush, body, marker, view, COLOURS.marker, false);
}

function drawMap(brush, { map, image }, view) {
  if (!map || !image) return;
  const [ox, oy, yaw] = map.origin;
  const [px, py] = view.toPixel(ox, oy);
  const size = map.resolution * view.scale;
  brush.save();
  brush.translate(px, py);
  brush.rotate(-yaw);
  brush.imageSmoothingEnabled = size < 1;
  brush.drawImage(image, 0, -map.height * size, map.width * size, map.height * size);
  brush.restore();
}

/** Keep-out and slow places, hatched; while somebody draws, also what else is drawn, numbered as in the list, and what is about to be. */
function drawEdits(brush, edits, view, edit) {
  edits.forEach(({ kind, points }, k) => {
    if (kind in HATCHED) hatch(brush, HATCHED[kind], corners(points, view));
    if (edit) outline(brush, kind, corners(points, view), COLOURS.ink, [6, 5]);
    if (edit) label(brush, String(k + 1), ...middle(corners(points, view)));
  });
  if (!edit) return;
  const spots = corners(edit.points, view);
  if (spots.length === 2 && edit.kind in HATCHED) hatch(brush, HATCHED[edit.kind], spots);
  if (spots.length === 2) outline(brush, edit.kind, spots, COLOURS.marker, []);
  for (const [x, y] of spots) {
    brush.fillStyle = COLOURS.marker;
    brush.strokeStyle = COLOURS.halo;
    brush.lineWidth = 3;
    brush.beginPath();
    brush.arc(x, y, 9, 0, 2 * Math.PI);
    brush.fill();
    brush.stroke();
  }
}

function corners(points, view) {
  return points.map(([x, y]) => view.toPixel(x, y));
}

function middle([[ax, ay], [bx, by]]) {
  return [(ax + bx) / 2, (ay + by) / 2];
}

function outline(brush, kind, [[ax, ay], [bx, by]], colour, dash) {
  brush.strokeStyle = colour;
  brush.lineWidth = kind === 'wall' ? 6 : 3;
  brush.setLineDash(dash);
  brush.beginPath();
  if (kind === 'wall') {
    brush.moveTo(ax, ay);
    brush.lineTo(bx, by);
  } else {
    brush.rect(ax, ay, bx - ax, by - ay);
  }
  brush.stroke();
  brush.setLineDash([]);
}

function hatch(brush, { line, fill, apart }, [[ax, ay], [bx, by]]) {
  const [left, top, right, bottom] = [Math.min(ax, bx), Math.min(ay, by), Math.max(ax, bx), Math.max(ay, by)];
  brush.save();
  brush.beginPath();
  brush.rect(left, top, right - left, bottom - top);
  brush.fillStyle = fill;
  brush.fill();
  brush.strokeStyle = line;
  brush.lineWidth = 3;
  brush.stroke();
  brush.clip();
  brush.lineWidth = 2.5;
  brush.beginPath();
  for (let x = left - (bottom - top); x < right; x += apart) {
    brush.moveTo(x, bottom);
    brush.lineTo(x + bottom - top, top);
  }
  brush.stroke();
  brush.restore();
}

function label(brush, text, x, y) {
  brush.font = '700 17px system-ui, "DejaVu Sans", sans-serif';
  brush.textAlign = 'center';
  brush.lineWidth = 5;
  brush.strokeStyle = COLOURS.halo;
  brush.strokeText(text, x, y + 6);
  brush.fillStyle = COLOURS.ink;
  brush.fillText(text, x, y + 6);
}

function drawPlan(brush, plan, view) {
  if (plan.length < 2) return;
  brush.beginPath();
  for (const [x, y] of plan) brush.lineTo(...view.toPixel(x, y));
  brush.strokeStyle = COLOURS.plan;
  brush.lineWidth = 5;
  brush.lineJoin = brush.lineCap = 'round';
  brush.stroke();
}

/** Each range as an arc over its cone: an echo may come from anywhere on it. */
function drawRanges(brush, chair, view) {
  const pose = chair.state?.pose;
  if (!pose) return;
  brush.strokeStyle = COLOURS.range;
  brush.lineWidth = 4;
  for (const { pose: at, range, fov } of Object.values(chair.ranges)) {
    if (typeof range !== 'number') continue;
    const [x, y, yaw] = compose(pose, at);
    const [px, py] = view.toPixel(x, y);
    brush.beginPath();
    brush.arc(px, py, Math.max(2, range * view.scale), -yaw - fov / 2, -yaw + fov / 2);
    brush.stroke();
  }
}

/** A dot and a name for each place; the name above or below it, or not at all where others are. */
function drawPlaces(brush, places, view) {
  brush.font = '600 15px system-ui, "DejaVu Sans", sans-serif';
  brush.textAlign = 'center';
  brush.lineJoin = 'round';
  const taken = [];
  for (const [name, [x, y]] of Object.entries(places)) {
    const [px, py] = view.toPixel(x, y);
    brush.fillStyle = COLOURS.ink;
    brush.beginPath();
    brush.arc(px, py, 6, 0, 2 * Math.PI);
    brush.fill();
    const text = placeName(name);
    const half = brush.measureText(text).width / 2 + 3;
    const boxes = [py - 11, py + 24].map((bottom) => ({ left: px - half, right: px + half, top: bottom - 15, bottom }));
    const free = boxes.find((box) => !taken.some((other) => box.left < other.right && box.right > other.left && box.top < other.bottom && box.bottom > other.top));
    if (!free) continue;
    taken.push(free);
    brush.lineWidth = 4;
    brush.strokeStyle = COLOURS.halo;
    brush.strokeText(text, px, free.bottom);
    brush.fillText(text, px, free.bottom);
  }
}

/** The chair's outline (length, width, m) with an arrow forward; at least as large as a fingertip. */
function drawBody(brush, [length, width], [x, y, yaw], view, colour, filled) {
  const [px, py] = view.toPixel(x, y);
  const scale = Math.max(view.scale, 26 / length);
  const [l, w] = [(length * scale) / 2, (width * scale) / 2];
  brush.save();
  brush.translate(px, py);
  brush.rotate(-yaw);
  brush.lineWidth = 3;
  brush.strokeStyle = filled ? COLOURS.halo : colour;
  brush.fillStyle = filled ? colour : COLOURS.halo;
  brush.beginPath();
  brush.rect(-l, -w, 2 * l, 2 * w);
  brush.fill();
  brush.stroke();
  brush.beginPath();
  brush.moveTo(0.75 * l, 0);
  brush.lineTo(-0.2 * l, 0.75 * w);
  brush.lineTo(-0.2 * l, -0.75 * w);
  brush.closePath();
  brush.fillStyle = filled ? COLOURS.halo : colour;
  brush.fill();
  brush.restore();
}

export function compose([x, y, yaw], [dx, dy, turn]) {
  return [x + Math.cos(yaw) * dx - Math.sin(yaw) * dy, y + Math.sin(yaw) * dx + Math.cos(yaw) * dy, yaw + turn];
}
