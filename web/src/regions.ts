// Regions of two-dimensional transfer functions: polygons in the plane of values and slopes. See docs/transfer.md.
import { rounded } from "./vec";

export interface Corner { value: number; slope: number } // slopes are data values per unit of the world
export interface Region { corners: readonly Corner[]; r: number; g: number; b: number; opacity: number; softness: number } // all but corners from 0 to 1
export const MOST_REGIONS = 16, MOST_CORNERS = 32, FEWEST_CORNERS = 3;

export interface Bounds { low: number; high: number; least: number; most: number } // low and high of values, least and most of slopes
export function boundsOf(corners: readonly Corner[]): Bounds {
  const values = corners.map(corner => corner.value), slopes = corners.map(corner => corner.slope);
  return { low: Math.min(...values), high: Math.max(...values), least: Math.min(...slopes), most: Math.max(...slopes) };
}
export const boxOf = (low: number, high: number, least: number, most: number): Corner[] =>
  [{ value: low, slope: least }, { value: high, slope: least }, { value: high, slope: most }, { value: low, slope: most }];

// Whether the service takes it.
export function isArea(corners: readonly Corner[]): boolean {
  const { low, high, least, most } = boundsOf(corners);
  return corners.length >= FEWEST_CORNERS && corners.length <= MOST_CORNERS && low < high && least >= 0 && least < most;
}

// How opaque a region is at a value and a slope, as the service has it: the distance to the border is measured where the region is as wide
// and as high as 1, and the axis of values is no border.
export function opacityIn({ corners, opacity, softness }: Region): (value: number, slope: number) => number {
  const { low, high, least, most } = boundsOf(corners);
  const places = corners.map(({ value, slope }) => ({ x: (value - low) / (high - low), y: (slope - least) / (most - least), onAxis: slope === 0 }));
  const edges = places.map((a, i) => [a, places[(i + 1) % places.length] as typeof a] as const);
  return (value, slope) => {
    if (!(value >= low && value <= high && slope >= least && slope <= most)) return 0;
    const x = (value - low) / (high - low), y = (slope - least) / (most - least);
    let inside = false, square = 1;
    for (const [a, b] of edges) {
      const dx = b.x - a.x, dy = b.y - a.y;
      if (a.y > y !== b.y > y && x < a.x + ((y - a.y) / dy) * dx) inside = !inside;
      if (a.onAxis && b.onAxis) continue;
      const t = Math.min(1, Math.max(0, ((x - a.x) * dx + (y - a.y) * dy) / (dx * dx + dy * dy || 1)));
      square = Math.min(square, (x - a.x - t * dx) ** 2 + (y - a.y - t * dy) ** 2);
    }
    return inside ? opacity * (softness > 0 ? Math.min((2 * Math.sqrt(square)) / softness, 1) : 1) : 0;
  };
}

// ---- in files

export const writeRegions = (regions: readonly Region[]): object[] => regions.map(({ corners, r, g, b, opacity, softness }) =>
  ({ Corners: corners.flatMap(({ value, slope }) => [value, slope]), Color: [r, g, b], Opacity: opacity, Softness: softness }));

export const cornersOf = (numbers: readonly number[]): Corner[] =>
  Array.from({ length: numbers.length >> 1 }, (_, i) => ({ value: rounded(numbers[2 * i] as number, 8), slope: rounded(numbers[2 * i + 1] as number, 8) }));

function readRegion(json: unknown): Region {
  if (typeof json !== "object" || json === null) throw new Error("is not an object");
  const fields = json as Record<string, unknown>;
  const numbers = (field: string, count?: number): number[] => {
    const list = fields[field];
    if (!Array.isArray(list) || !list.every(n => typeof n === "number" && Number.isFinite(n))) throw new Error(`has no list of numbers ${field}`);
    if (count !== undefined && list.length !== count) throw new Error(`has ${list.length} numbers in ${field}, must have ${count}`);
    return list as number[];
  };
  const share = (name: string, value: unknown): number => {
    if (typeof value !== "number" || !(value >= 0 && value <= 1)) throw new Error(`has the ${name} ${String(value)}, must be in [0, 1]`);
    return rounded(value, 4);
  };
  const box = fields["Corners"] === undefined, [from, to] = box ? numbers("Values", 2) : [], [least, most] = box ? numbers("Slopes", 2) : [];
  const list = box ? [] : numbers("Corners"), corners = box ? boxOf(from as number, to as number, least as number, most as number) : cornersOf(list);
  if (list.length % 2 !== 0 || !isArea(corners)) throw new Error(`must have ${FEWEST_CORNERS} to ${MOST_CORNERS} corners of different values and slopes, no slope below 0`);
  const [r, g, b] = numbers("Color", 3).map(c => share("Color", c)) as [number, number, number];
  return { corners, r, g, b, opacity: share("Opacity", fields["Opacity"] ?? 1), softness: share("Softness", fields["Softness"] ?? 0.25) };
}

// Throws an Error with a sentence.
export function readRegions(json: unknown): Region[] {
  if (!Array.isArray(json) || json.length === 0 || json.length > MOST_REGIONS) throw new Error(`Regions is not a list of 1 to ${MOST_REGIONS} regions`);
  return json.map((each, i) => {
    try { return readRegion(each); } catch (error) { throw new Error(`Regions[${i}] ${(error as Error).message}`); }
  });
}
