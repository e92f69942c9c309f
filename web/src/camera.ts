// The view: where one stands, by the definitions of docs/rendering.md, and how gestures move it.
import type { Options } from "./api";
import type { Geometry } from "./session";
import { add, clamp, dot, length, rounded, roundedPoint, scale, sub, type Vec3 } from "./vec";

const DEGREE = Math.PI / 180;
export const ZOOM = { least: 0.05, most: 200 };
const FOV_DEGREES = 30; // the service's

export interface Side { name: string; azimuth: number; elevation: number }
export const PATIENT_SIDES: readonly Side[] = [
  { name: "Anterior", azimuth: 180, elevation: 0 }, { name: "Posterior", azimuth: 0, elevation: 0 },
  { name: "Left", azimuth: 270, elevation: 0 }, { name: "Right", azimuth: 90, elevation: 0 },
  { name: "Superior", azimuth: 0, elevation: 90 }, { name: "Inferior", azimuth: 180, elevation: -90 },
];
export const OTHER_SIDES: readonly Side[] = [
  { name: "Front", azimuth: 0, elevation: 0 }, { name: "Back", azimuth: 180, elevation: 0 },
  { name: "Left", azimuth: 270, elevation: 0 }, { name: "Right", azimuth: 90, elevation: 0 },
  { name: "Top", azimuth: 0, elevation: 90 }, { name: "Bottom", azimuth: 0, elevation: -90 },
];
export const sidesOf = (world: string | undefined): readonly Side[] => (world === "patient" ? PATIENT_SIDES : OTHER_SIDES);

export interface Viewpoint {
  azimuth: number; // degrees
  elevation: number;
  roll: number;
  zoom: number;
  lookAt: Vec3 | null; // null: the middle of what shows (the service's `fit`)
}

// Where a view begins: the service's default view (common/view/default_view.h).
type Start = Pick<Viewpoint, "azimuth" | "elevation">;
export const PATIENT_START: Start = { azimuth: 180, elevation: 0 };
export const startOf = (world: string): Start => (world === "patient" ? PATIENT_START : { azimuth: 30, elevation: 20 });

// Directions of the world to the right, upwards and away from the viewer.
export function axesOf({ azimuth, elevation, roll }: Viewpoint): { right: Vec3; up: Vec3; forward: Vec3 } {
  const a = azimuth * DEGREE, e = elevation * DEGREE, r = roll * DEGREE;
  const right: Vec3 = [Math.cos(a), Math.sin(a), 0];
  const up: Vec3 = [-Math.sin(e) * Math.sin(a), Math.sin(e) * Math.cos(a), Math.cos(e)];
  const forward: Vec3 = [-Math.cos(e) * Math.sin(a), Math.cos(e) * Math.cos(a), -Math.sin(e)];
  return { right: add(scale(right, Math.cos(r)), scale(up, Math.sin(r))), up: sub(scale(up, Math.cos(r)), scale(right, Math.sin(r))), forward };
}

// In (-180, 180].
const angle = (degrees: number): number => rounded(180 - ((((180 - degrees) % 360) + 360) % 360), 6);

// Turns by degrees to the right and upwards in the picture, for any roll.
export function orbited(view: Viewpoint, rightwards: number, upwards: number): Partial<Viewpoint> {
  const r = view.roll * DEGREE;
  const across = rightwards * Math.cos(r) - upwards * Math.sin(r), along = rightwards * Math.sin(r) + upwards * Math.cos(r);
  return { azimuth: angle(view.azimuth - across), elevation: rounded(clamp(view.elevation - along, -90, 90)) };
}

// Moves what is seen by pixels of a picture in which one is `pixelSize` wide.
export function panned(view: Viewpoint, x: number, y: number, pixelSize: number): Partial<Viewpoint> {
  if (!view.lookAt) return {};
  const { right, up } = axesOf(view);
  return { lookAt: roundedPoint(add(view.lookAt, add(scale(right, -x * pixelSize), scale(up, y * pixelSize)))) };
}

// Magnifies about a point, in pixels to the right of and below the picture's centre.
export function zoomed(view: Viewpoint, factor: number, x: number, y: number, pixelSize: number): Partial<Viewpoint> {
  const zoom = rounded(clamp(view.zoom * factor, ZOOM.least, ZOOM.most));
  const moved = 1 - view.zoom / zoom;
  return { zoom, ...panned(view, -x * moved, -y * moved, pixelSize) };
}

export const rolled = (view: Viewpoint, degrees: number): Partial<Viewpoint> => ({ roll: angle(view.roll + degrees) });

// The zoom of a view with `look-at` that shows the same as a picture made with `fit`.
export function zoomOf(geometry: Geometry, width: number, height: number, extent: Vec3): number {
  const radius = length(extent) / 2;
  const half = geometry.projection === "perspective" ? radius / Math.cos((FOV_DEGREES / 2) * DEGREE) : radius;
  return (2 * half) / (Math.min(width, height) * geometry.pixel_size);
}

// Pixels from the picture's upper left corner.
export function project(geometry: Geometry, width: number, height: number, p: Vec3): [number, number] {
  const from = sub(p, geometry.target);
  const depth = geometry.target_depth + dot(from, geometry.forward);
  const k = geometry.projection === "perspective" ? Math.max(depth, 1e-3 * geometry.target_depth) / geometry.target_depth : 1;
  const pixel = k * geometry.pixel_size;
  return [width / 2 + dot(from, geometry.right) / pixel, height / 2 - dot(from, geometry.up) / pixel];
}

// The point of the world at a pixel, at the target's depth.
export function unproject(geometry: Geometry, width: number, height: number, x: number, y: number): Vec3 {
  const pixel = geometry.pixel_size;
  return add(geometry.target, add(scale(geometry.right, (x - width / 2) * pixel), scale(geometry.up, (height / 2 - y) * pixel)));
}

// How a picture lies in that of a later view: magnified by `zoom` and turned clockwise by `roll`, in radians, about the picture's centre, where its
// pixel (x, y) is then. Other differences of the views do not move a picture in its plane. null: they are not of the same thing.
export interface Placing { x: number; y: number; zoom: number; roll: number }
export function placing(geometry: Geometry, width: number, height: number, was: Options, is: Options): Placing | null {
  if (["dataset", "projection", "fit", "size"].some(name => was[name] !== is[name])) return null;
  const at = is["look-at"], point = typeof at === "string" ? (at.split(",").map(Number) as unknown as Vec3) : geometry.target;
  const [x, y] = project(geometry, width, height, point);
  return { x, y, zoom: Number(is["zoom"]) / Number(was["zoom"]), roll: (Number(is["roll"]) - Number(was["roll"])) * DEGREE };
}
