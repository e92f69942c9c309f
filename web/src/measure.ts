// Measurements: points of the world, and what follows from them alone.
import { add, clamp, dot, length, roundedPoint, scale, sub, type Vec3 } from "./vec";

export type MeasureKind = "distance" | "angle" | "profile" | "box";
// distance, profile: from, to. angle: its vertex in the middle. box: opposite corners, low before high along each axis.
export interface Measure { kind: MeasureKind; points: readonly Vec3[] }

export interface Profile { length: number; values: readonly (number | null)[] }
export interface BoxStatistics { voxels: number; non_finite: number; mean: number | null; deviation: number | null; least: number | null; largest: number | null }

export const MEASURE_KINDS: readonly { kind: MeasureKind; name: string; points: number; key: string }[] = [
  { kind: "distance", name: "Distance", points: 2, key: "d" }, { kind: "angle", name: "Angle", points: 3, key: "g" },
  { kind: "profile", name: "Profile", points: 2, key: "i" }, { kind: "box", name: "Box", points: 2, key: "x" },
];
export const MOST_MEASURES = 32;
export const pointsOf = (kind: MeasureKind): number => MEASURE_KINDS.find(each => each.kind === kind)?.points ?? 2;
export const nameOf = (kind: MeasureKind): string => MEASURE_KINDS.find(each => each.kind === kind)?.name ?? "";

export const distanceOf = ({ points }: Measure): number => length(sub(points[points.length - 1] as Vec3, points[0] as Vec3));

export function angleOf({ points }: Measure): number {
  const [a, vertex, b] = points as readonly [Vec3, Vec3, Vec3], u = sub(a, vertex), v = sub(b, vertex), lengths = length(u) * length(v);
  return lengths > 0 ? (Math.acos(clamp(dot(u, v) / lengths, -1, 1)) * 180) / Math.PI : 0;
}

// A box by two of its corners. Two points in a slice lie in a plane: such a box is as thick as a voxel, with the plane in its middle.
export function boxOf(a: Vec3, b: Vec3, spacing: Vec3): Measure {
  const middle = scale(add(a, b), 0.5);
  const half = [0, 1, 2].map(i => Math.max(Math.abs((a[i] as number) - (b[i] as number)), spacing[i] as number) / 2) as unknown as Vec3;
  return { kind: "box", points: [roundedPoint(sub(middle, half)), roundedPoint(add(middle, half))] };
}

export function cornersOfBox({ points }: Measure): Vec3[] {
  const [low, high] = points as readonly [Vec3, Vec3];
  return [0, 1, 2, 3, 4, 5, 6, 7].map(i => [i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]] as const);
}

// Edges between corners, whose numbers have a bit for each axis.
export const BOX_EDGES = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]] as const;

// The box as the gateway's `statistics` takes it.
export function boxRange({ points }: Measure): string {
  const [low, high] = points as readonly [Vec3, Vec3];
  return [0, 1, 2].map(i => `${low[i] as number}:${high[i] as number}`).join(",");
}
