// What the page knows of the dataset that it shows.
import type { Api, Dataset, Level } from "./api";
import { type Channel, channelsOf, hasOverlay, OVERLAY } from "./channels";
import { Session } from "./session";
import { add, rounded, scale, type Vec3 } from "./vec";

export interface Volume {
  name: string; size: Vec3; spacing: Vec3; extent: Vec3; centre: Vec3; low: Vec3; high: Vec3; // extent, low, high: of the world
  range: readonly [number, number]; type: string; memoryBytes: number; world: string; unit: string; labels: number; cells: number;
  levels: readonly Level[]; // finest first, at least one
  channels: readonly Channel[]; // none, if there is one; and the overlay
}

export function volumeOf(dataset: Dataset, centre: Vec3, world: string, unit: string): Volume | null {
  const { size, spacing, range } = dataset;
  if (!size || !spacing || !range) return null;
  const extent: Vec3 = [size[0] * spacing[0], size[1] * spacing[1], size[2] * spacing[2]];
  return {
    name: dataset.name, size, spacing, extent, centre, low: add(centre, scale(extent, -0.5)), high: add(centre, scale(extent, 0.5)),
    range: [range.min, range.max], type: dataset.type ?? "", memoryBytes: dataset.memory_bytes ?? 0, world, unit,
    labels: Number(dataset.layers?.labels ?? 0), cells: dataset.cells ?? 0,
    levels: dataset.levels ?? [], channels: [...channelsOf(dataset), ...(hasOverlay(dataset) ? [OVERLAY] : [])],
  };
}

// Where the middle of a volume lies. The picture that tells it is small and not shown.
export function centreOf(api: Api, dataset: string): Promise<{ centre: Vec3; world: string; unit: string }> {
  return new Promise((resolve, reject) => {
    const session: Session = new Session(api, {
      frame: ({ header: { geometry } }) => { session.end(); resolve({ centre: geometry.target, world: geometry.world, unit: geometry.unit }); },
      error: message => { session.end(); reject(new Error(message)); },
    });
    session.show({ picture: "render", timeline: false, options: { dataset, size: "16x16" } });
  });
}

// Slopes, the magnitudes of gradients, are data values per unit of the world. A slope of 1 voxel spans the range of values.
export function steepestOf(volume: Volume | null): number {
  const [low, high] = volume?.range ?? [0, 1];
  return rounded((high - low) / Math.min(...(volume?.spacing ?? [1])), 2) || 1;
}
export const STEEP = 0.25; // share of it that is steep: there plots of slopes end, unless it is known better
export const slopeUnit = (volume: Volume | null): string => `data values per ${volume ? unitName(volume.unit).replace(/s$/, "") : "unit"}`;

// A unit as it stands behind a number: "mm", "µm", or if the file states none, "voxels" or "units".
export const unitName = (unit: string): string => (unit === "voxel" ? "voxels" : unit === "unknown" || unit === "" ? "units" : unit);
