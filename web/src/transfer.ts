// Transfer functions as ParaView's colour maps: reading, writing, looking up. See docs/transfer.md.
import { boundsOf, type Region, readRegions, writeRegions } from "./regions";
import { clamp, rounded } from "./vec";

export interface ColorPoint { x: number; r: number; g: number; b: number } // colours from 0 to 1
export interface OpacityPoint { x: number; y: number; mid: number; sharp: number }
export const MATERIAL = ["ambient", "diffuse", "specular", "shininess"] as const;
export type Material = Readonly<Partial<Record<(typeof MATERIAL)[number], number>>>; // the page shows none of it, and keeps it
// Both lists ascend. Regions stand in the place of the curves, which are then kept for later; without regions neither list is empty.
export interface ColorMap { name: string; colors: readonly ColorPoint[]; opacities: readonly OpacityPoint[]; regions?: readonly Region[]; material?: Material }

const MOST_POINTS = 4096;

export function rangeOf(map: ColorMap): [number, number] {
  if (map.regions) { const { low, high } = boundsOf(map.regions.flatMap(region => region.corners)); return [low, high]; }
  const xs = [...map.colors, ...map.opacities].map(point => point.x);
  return [Math.min(...xs), Math.max(...xs)];
}

// The values that show: from where opacity begins to where it ends. The whole range if nothing shows, or if regions stand in the curves' place.
export function visibleRangeOf(map: ColorMap): [number, number] {
  const shows = map.regions ? [] : map.opacities.flatMap((p, i, all) => (p.y > 0 || (all[i - 1]?.y ?? 0) > 0 || (all[i + 1]?.y ?? 0) > 0 ? [p.x] : []));
  const low = Math.min(...shows), high = Math.max(...shows);
  return low < high ? [low, high] : rangeOf(map);
}

// The map with its first point at low and its last one at high.
export function stretched(map: ColorMap, [low, high]: readonly [number, number]): ColorMap {
  const [from, to] = rangeOf(map);
  const move = (x: number): number => rounded(to > from ? low + ((x - from) / (to - from)) * (high - low) : low);
  if (map.regions) return { ...map, regions: map.regions.map(region => ({ ...region, corners: region.corners.map(corner => ({ ...corner, value: move(corner.value) })) })) };
  return { ...map, colors: map.colors.map(p => ({ ...p, x: move(p.x) })), opacities: map.opacities.map(p => ({ ...p, x: move(p.x) })) };
}

function between<P extends { x: number }>(points: readonly P[], x: number): [P, P, number] {
  const first = points[0] as P, last = points[points.length - 1] as P;
  if (x <= first.x) return [first, first, 0];
  if (x >= last.x) return [last, last, 0];
  const next = points.findIndex(point => point.x > x);
  const a = points[next - 1] as P, b = points[next] as P;
  return [a, b, (x - a.x) / (b.x - a.x)];
}

export function colorAt(map: ColorMap, x: number): [number, number, number] {
  if (map.colors.length === 0) return [0, 0, 0];
  const [a, b, t] = between(map.colors, x);
  return [a.r + (b.r - a.r) * t, a.g + (b.g - a.g) * t, a.b + (b.b - a.b) * t];
}

// Between two points: half way at the midpoint; sharpness 0 is a straight line on either side, 1 a step.
export function opacityAt(map: ColorMap, x: number): number {
  if (map.opacities.length === 0) return 0;
  const [a, b, t] = between(map.opacities, x);
  if (a === b) return a.y;
  const mid = clamp(a.mid, 1e-5, 1 - 1e-5);
  const s = t < mid ? (0.5 * t) / mid : 0.5 + (0.5 * (t - mid)) / (1 - mid);
  if (a.sharp >= 0.99) return s < 0.5 ? a.y : b.y;
  if (a.sharp <= 0.01) return a.y + (b.y - a.y) * s;
  const steep = 1 + 10 * a.sharp; // the shape that ParaView shows: a power, mirrored at the middle
  const shaped = s < 0.5 ? 0.5 * Math.pow(2 * s, steep) : 1 - 0.5 * Math.pow(2 * (1 - s), steep);
  return a.y + (b.y - a.y) * shaped;
}

export function ramp(low: number, high: number): ColorMap {
  return {
    name: "ramp",
    colors: [{ x: low, r: 0.2, g: 0.2, b: 0.2 }, { x: high, r: 1, g: 1, b: 1 }],
    opacities: [{ x: low, y: 0, mid: 0.5, sharp: 0 }, { x: high, y: 1, mid: 0.5, sharp: 0 }],
  };
}

export function toParaView(map: ColorMap): object[] {
  const curves = { ColorSpace: "RGB", RGBPoints: map.colors.flatMap(p => [p.x, p.r, p.g, p.b]), Points: map.opacities.flatMap(p => [p.x, p.y, p.mid, p.sharp]) };
  return [{ Name: map.name, ...(map.regions ? { Regions: writeRegions(map.regions) } : curves), ...(map.material && { Material: map.material }) }];
}

function groups(list: unknown, field: string): number[][] {
  if (!Array.isArray(list) || list.length % 4 !== 0 || !list.every(n => typeof n === "number" && Number.isFinite(n))) {
    throw new Error(`${field} is not a list of numbers in groups of four`);
  }
  if (list.length > 4 * MOST_POINTS) throw new Error(`${field} has ${list.length / 4} points, at most ${MOST_POINTS} are taken`);
  const points: number[][] = [];
  for (let i = 0; i < list.length; i += 4) points.push((list as number[]).slice(i, i + 4));
  points.forEach((point, i) => {
    if (i > 0 && (point[0] as number) < ((points[i - 1] as number[])[0] as number)) throw new Error(`${field}: values must ascend`);
  });
  return points;
}

function materialOf(json: unknown): Material {
  if (typeof json !== "object" || json === null) throw new Error("Material is not an object");
  for (const [name, value] of Object.entries(json)) {
    if (!(MATERIAL as readonly string[]).includes(name)) throw new Error(`Material has the field "${name}", must be one of: ${MATERIAL.join(", ")}`);
    const [least, most] = name === "shininess" ? [1, 1000] : [0, 1];
    if (typeof value !== "number" || !(value >= least && value <= most)) throw new Error(`Material.${name} is ${String(value)}, must be in [${least}, ${most}]`);
  }
  return json as Material;
}

function curvesOf(preset: Record<string, unknown>): Pick<ColorMap, "colors" | "opacities"> {
  const share = (x: number | undefined): number => rounded(clamp(x ?? 0, 0, 1), 4);
  const colors = groups(preset["RGBPoints"], "RGBPoints").map(([x = 0, r, g, b]) => ({ x: rounded(x, 8), r: share(r), g: share(g), b: share(b) }));
  const first = colors[0], last = colors[colors.length - 1];
  if (!first || !last) throw new Error("RGBPoints is empty");
  const opacities = preset["Points"] === undefined
    ? [{ x: first.x, y: 0, mid: 0.5, sharp: 0 }, { x: last.x, y: 1, mid: 0.5, sharp: 0 }]
    : groups(preset["Points"], "Points").map(([x = 0, y, mid, sharp]) => ({ x: rounded(x, 8), y: share(y), mid: share(mid ?? 0.5), sharp: share(sharp) }));
  if (opacities.length === 0) throw new Error("Points is empty");
  return { colors, opacities };
}

// From the JSON of a preset or of a list of presets, of which the first counts. Throws an Error with a sentence.
export function parseParaView(json: unknown): ColorMap {
  const preset = (Array.isArray(json) ? json[0] : json) as Record<string, unknown> | null | undefined;
  if (typeof preset !== "object" || preset === null || !("RGBPoints" in preset || "Regions" in preset)) throw new Error("this is not a colour map of ParaView: it has no RGBPoints");
  const name = typeof preset["Name"] === "string" ? preset["Name"].slice(0, 80) : "dropped";
  const map = "Regions" in preset ? { name, colors: [], opacities: [], regions: readRegions(preset["Regions"]) } : { name, ...curvesOf(preset) };
  return preset["Material"] === undefined ? map : { ...map, material: materialOf(preset["Material"]) };
}

const channel = (c: number): string => Math.round(clamp(c, 0, 1) * 255).toString(16).padStart(2, "0");
export const hexOf = ([r, g, b]: readonly [number, number, number]): string => `#${channel(r)}${channel(g)}${channel(b)}`;
export const rgbOf = (hex: string): [number, number, number] =>
  [1, 3, 5].map(i => rounded(parseInt(hex.slice(i, i + 2), 16) / 255, 4)) as [number, number, number];
