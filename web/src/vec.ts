// Points and directions of the world.
export type Vec3 = readonly [number, number, number];

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vec3): number => Math.sqrt(dot(a, a));
export const normalized = (a: Vec3): Vec3 => scale(a, 1 / (length(a) || 1));
export const clamp = (x: number, low: number, high: number): number => Math.min(high, Math.max(low, x));
export const AXES = [0, 1, 2] as const;
export type Axis = (typeof AXES)[number];
export const AXIS_NAMES = ["x", "y", "z"] as const;
export const withAxis = (a: Vec3, axis: Axis, value: number): Vec3 => [axis === 0 ? value : a[0], axis === 1 ? value : a[1], axis === 2 ? value : a[2]];
// The nearest number with so many significant digits: what a link holds is then what the state holds.
export const rounded = (x: number, digits = 6): number => Number(x.toPrecision(digits));
export const roundedPoint = (a: Vec3): Vec3 => [rounded(a[0]), rounded(a[1]), rounded(a[2])];
