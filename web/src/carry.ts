// What stays when another dataset is shown, so that two patients or two times can be compared: the camera, the colours, cuts and measurements,
// as far as they apply to the other one.
import { startOf } from "./camera";
import { AS_SAID } from "./channels";
import { rangeOf } from "./transfer";
import { INITIAL, type Bounds, type State } from "./state";
import { length, rounded, type Vec3 } from "./vec";
import type { Volume } from "./volume";

const inside = (p: Vec3, { low, high }: Volume): boolean => p.every((c, i) => c >= (low[i] as number) && c <= (high[i] as number));
const namesOf = ({ channels }: Volume): string => channels.map(channel => channel.name).join("\n");
const overlap = ([a, b]: readonly [number, number], [c, d]: readonly [number, number]): boolean => a <= d && c <= b;

// What has to change in the state that a volume was seen with, for another volume.
export function carried(state: State, from: Volume, to: Volume): Partial<State> {
  const patch: Partial<State> = {};
  const sameWorld = from.world === to.world && from.unit === to.unit;
  // The camera: the same directions and the same scale, so that lengths can be compared; what shows is framed anew if it is elsewhere.
  if ((from.world === "patient") !== (to.world === "patient")) Object.assign(patch, startOf(to.world), { roll: INITIAL.roll });
  if (!sameWorld || !state.lookAt || !inside(state.lookAt, to)) Object.assign(patch, { lookAt: null, zoom: INITIAL.zoom });
  else patch.zoom = rounded((state.zoom * length(to.extent)) / length(from.extent));
  // Colours: values that the other one does not have would show nothing.
  if (state.range && !overlap(state.range, to.range)) patch.range = null;
  if (state.map && !state.range && !overlap(rangeOf(state.map), to.range)) patch.map = null;
  const surfaces = state.surfaces.filter(({ value }) => value >= to.range[0] && value <= to.range[1]);
  if (surfaces.length < state.surfaces.length) patch.surfaces = surfaces;
  if (state.window !== null && state.level !== null && !overlap([state.level - state.window / 2, state.level + state.window / 2], to.range)) Object.assign(patch, { window: null, level: null });
  if (namesOf(from) !== namesOf(to)) Object.assign(patch, AS_SAID);
  // Places.
  const cutsThrough = ([low, high]: Bounds, i: number): boolean => overlap([low ?? -Infinity, high ?? Infinity], [to.low[i] as number, to.high[i] as number]);
  if (state.clipBox && !(sameWorld && state.clipBox.every(cutsThrough))) patch.clipBox = null;
  if (!sameWorld && state.shapes.length > 0) patch.shapes = [];
  if (!sameWorld && state.clipPlanes.length > 0) patch.clipPlanes = [];
  if (state.crosshair && !(sameWorld && inside(state.crosshair, to))) patch.crosshair = null;
  const measures = sameWorld ? state.measures.filter(({ points }) => points.every(p => inside(p, to))) : [];
  if (measures.length < state.measures.length) patch.measures = measures;
  return patch;
}
