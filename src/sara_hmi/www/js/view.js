// Between the map's metres and the canvas's pixels.

const NEAREST = 400; // pixels per metre
const FARTHEST = 4;

/** A view has the map point `x`, `y` (m) in its middle and `scale` pixels per metre; north is up. */
export class View {
  constructor() {
    this.x = this.y = 0;
    this.scale = 60;
    this.width = this.height = 1;
    this.fitted = false;
  }

  /** The whole map, once. */
  fit(map) {
    if (this.fitted || !map) return;
    const [width, height] = [map.width * map.resolution, map.height * map.resolution];
    this.scale = Math.min(NEAREST, Math.max(FARTHEST, 0.94 * Math.min(this.width / width, this.height / height)));
    const [ox, oy, yaw] = map.origin;
    this.x = ox + (Math.cos(yaw) * width - Math.sin(yaw) * height) / 2;
    this.y = oy + (Math.sin(yaw) * width + Math.cos(yaw) * height) / 2;
    this.fitted = true;
  }

  toPixel(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  toMap(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  zoom(factor) {
    this.scale = Math.min(NEAREST, Math.max(FARTHEST, this.scale * factor));
  }

  /** Shares of the canvas. */
  pan(dx, dy) {
    this.x += (dx * this.width) / this.scale;
    this.y += (dy * this.height) / this.scale;
  }
}
