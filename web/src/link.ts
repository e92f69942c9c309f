// The whole state of a view as texts, by the names of the command line where there are such; and as a link's part behind '#'.
import { NAMES } from "./api";
import { GAMMAS, OVERLAY } from "./channels";
import { type Measure, MEASURE_KINDS, MOST_MEASURES } from "./measure";
import type { Offers } from "./offers";
import { type Bounds, type ClipBox, type ClipPlane, INITIAL, type KeyFrame, MOST_KEY_FRAMES, type SlopePoint, type State, type Surface } from "./state";
import { cornersOf, isArea, MOST_REGIONS, type Region } from "./regions";
import { shapesIn, shapesText } from "./shapes";
import { type ColorMap, MATERIAL } from "./transfer";
import type { Vec3 } from "./vec";
import type { SlabViewSetting } from "../package/slab-view";

type Name = SlabViewSetting | ""; // "": of a part of a setting
interface Field<T> { name: Name; write: (value: T) => string; read: (text: string, offers: Offers) => T | undefined }

const number = (text: string | undefined): number | undefined => (text === undefined || text.trim() === "" || !Number.isFinite(Number(text)) ? undefined : Number(text));
const numbers = (text: string, count: number): number[] | undefined => {
  const list = text.split(",").map(number);
  return list.length === count && list.every(n => n !== undefined) ? (list as number[]) : undefined;
};
const list = <T>(text: string | null, separator: string, read: (item: string) => T | undefined): T[] | undefined => {
  const items = text === null ? [] : text.split(separator).map(read);
  return items.every(item => item !== undefined) ? (items as T[]) : undefined;
};
const text = (name: Name, allowed: RegExp): Field<string> => ({ name, write: value => value, read: value => (allowed.test(value) ? value : undefined) });
const oneOf = <T extends string>(name: Name, ...values: T[]): Field<T> => ({ name, write: value => value, read: value => values.find(v => v === value) });
const within = (name: Name, limits: (offers: Offers) => readonly [number, number]): Field<number> => ({
  name, write: String, read: (value, offers) => { const n = number(value), [low, high] = limits(offers); return n !== undefined && n >= low && n <= high ? n : undefined; },
});
const real = (name: Name): Field<number> => within(name, offers => offers.limitsOf(name));
const flag = (name: Name): Field<boolean> => ({ name, write: value => (value ? "1" : "0"), read: value => (value === "1" ? true : value === "0" ? false : undefined) });
const nullable = <T>(field: Field<T>): Field<T | null> => ({ name: field.name, write: value => (value === null ? "" : field.write(value)), read: field.read });
const point = (name: Name): Field<Vec3> => ({ name, write: value => value.join(","), read: value => numbers(value, 3) as Vec3 | undefined });
const range = (name: Name): Field<readonly [number, number]> => ({
  name, write: value => value.join(":"),
  read: value => { const pair = numbers(value.replace(":", ","), 2); return pair && (pair[0] as number) < (pair[1] as number) ? (pair as [number, number]) : undefined; },
});

const COLOR = /^#[0-9a-f]{6}$/i, NAME = /^[a-z][a-z0-9-]{0,40}$/;
const surfaces: Field<readonly Surface[]> = {
  name: "isovalue",
  write: value => value.map(s => `${s.value}:${s.color}:${s.opacity}`).join(","),
  read: value => list(value, ",", item => {
    const [v, color, opacity] = item.split(":"), at = number(v), o = number(opacity);
    return at !== undefined && color && COLOR.test(color) && o !== undefined ? { value: at, color, opacity: o } : undefined;
  }),
};
export const slopeText = (points: readonly SlopePoint[]): string => points.map(p => `${p.slope}:${p.opacity}`).join(",");
const slopes: Field<readonly SlopePoint[]> = {
  name: "gradient-opacity", write: slopeText,
  read: value => {
    const points = list(value, ",", (item): SlopePoint | undefined => {
      const [slope, opacity] = item.split(":").map(number);
      return slope !== undefined && slope >= 0 && opacity !== undefined && opacity >= 0 && opacity <= 1 ? { slope, opacity } : undefined;
    });
    return points?.every((p, i) => p.slope >= (points[i - 1]?.slope ?? 0)) ? points : undefined;
  },
};
export const boxText = (box: ClipBox): string => box.map(([low, high]) => `${low ?? ""}:${high ?? ""}`).join(",");
const clipBox: Field<ClipBox> = {
  name: "clip-box", write: boxText,
  read: value => {
    const axes = list(value, ",", (item): Bounds | undefined => {
      const ends = item.split(":");
      return ends.length === 2 ? [number(ends[0]) ?? null, number(ends[1]) ?? null] : undefined;
    });
    return axes?.length === 3 ? (axes as unknown as ClipBox) : undefined;
  },
};
const many = <T extends readonly number[]>(name: Name, count: number): Field<readonly T[]> => ({
  name, write: value => value.map(v => v.join(",")).join(";"), read: value => list(value, ";", item => numbers(item, count) as unknown as T | undefined),
});
const regions: Field<readonly Region[]> = {
  name: "", write: value => value.map(({ corners, r, g, b, opacity, softness }) => [r, g, b, opacity, softness, ...corners.flatMap(({ value, slope }) => [value, slope])].join(",")).join(";"),
  read: value => {
    const read = list(value, ";", (item): Region | undefined => {
      const given = item.split(",").map(number), [r, g, b, opacity, softness, ...numbers] = given as number[], corners = cornersOf(numbers);
      const shares = given.slice(0, 5).every(n => n !== undefined && n >= 0 && n <= 1), whole = numbers.length % 2 === 0 && given.every(n => n !== undefined);
      return shares && whole && isArea(corners) ? { corners, r, g, b, opacity, softness } as Region : undefined;
    });
    return read && read.length <= MOST_REGIONS ? read : undefined;
  },
};
const decoded = (text: string): string => { try { return decodeURIComponent(text); } catch { return ""; } };
const map: Field<ColorMap> = {
  name: "function",
  write: value => [encodeURIComponent(value.name), value.colors.map(p => [p.x, p.r, p.g, p.b].join(",")).join(";"),
    value.opacities.map(p => (p.mid === 0.5 && p.sharp === 0 ? [p.x, p.y] : [p.x, p.y, p.mid, p.sharp]).join(",")).join(";"),
    value.material ? MATERIAL.map(name => value.material?.[name] ?? "").join(",") : "", value.regions ? regions.write(value.regions) : ""].join("|").replace(/\|+$/, ""),
  read: (value, offers) => {
    const [name, colorText, opacityText, materialText, regionText] = value.split("|");
    const colors = list(colorText || null, ";", item => { const n = numbers(item, 4); return n && { x: n[0] as number, r: n[1] as number, g: n[2] as number, b: n[3] as number }; });
    const opacities = list(opacityText || null, ";", item => {
      const n = numbers(item, 4) ?? [...(numbers(item, 2) ?? []), 0.5, 0];
      return n.length === 4 ? { x: n[0] as number, y: n[1] as number, mid: n[2] as number, sharp: n[3] as number } : undefined;
    });
    const areas = regionText ? regions.read(regionText, offers) : [];
    if (!colors || !opacities || !areas || (areas.length === 0 && (colors.length === 0 || opacities.length === 0))) return undefined;
    const map = { name: decoded(name ?? ""), colors, opacities, ...(areas.length > 0 && { regions: areas }) };
    if (!materialText) return map;
    const texts = materialText.split(",");
    return { ...map, material: Object.fromEntries(MATERIAL.flatMap((each, i) => { const n = texts[i] ? number(texts[i] as string) : undefined; return n === undefined ? [] : [[each, n]]; })) };
  },
};
// "0=100:4000,1=5:7": a value each.
const each = <T>(name: Name, key: RegExp, { write, read }: Pick<Field<T>, "write" | "read">): Field<Readonly<Record<string, T>>> => ({
  name, write: value => Object.entries(value).map(([of, one]) => `${of}=${write(one)}`).join(","),
  read: (value, offers) => {
    const pairs = list(value, ",", item => { const [of, text] = item.split("="), one = text === undefined ? undefined : read(text, offers); return of && key.test(of) && one !== undefined ? ([of, one] as const) : undefined; });
    return pairs && Object.fromEntries(pairs);
  },
});
const share = within("", () => [0, 1]);
const transfer: Field<string | ColorMap> = { // a list's own marks stay apart from those of a function
  name: "", write: value => (typeof value === "string" ? value : encodeURIComponent(map.write(value))),
  read: (value, offers) => (NAME.test(value) ? value : map.read(decoded(value), offers)),
};
const CHANNEL = /^[^,=]+$/, NO_CHANNEL = "none";
const channels: Field<readonly string[]> = {
  name: NAMES.channels, write: value => value.join(",") || NO_CHANNEL,
  read: value => (value === NO_CHANNEL ? [] : value.split(",").every(channel => CHANNEL.test(channel)) ? value.split(",") : undefined),
};

const measures: Field<readonly Measure[]> = {
  name: "measure", write: value => value.map(({ kind, points }) => [kind, ...points.map(p => p.join(","))].join(":")).join(";"),
  read: value => {
    const read = list(value, ";", (item): Measure | undefined => {
      const [name, ...texts] = item.split(":"), kind = MEASURE_KINDS.find(each => each.kind === name), points = texts.map(each => numbers(each, 3));
      return kind && points.length === kind.points && points.every(p => p !== undefined) ? { kind: kind.kind, points: points as unknown as Vec3[] } : undefined;
    });
    return read && read.length <= MOST_MEASURES ? read : undefined;
  },
};

const path: Field<readonly KeyFrame[]> = {
  name: "path", write: value => value.map(({ azimuth, elevation, roll, zoom, lookAt }) => [azimuth, elevation, roll, zoom, ...lookAt].join(",")).join(";"),
  read: value => {
    const read = list(value, ";", (item): KeyFrame | undefined => {
      const n = numbers(item, 7) as [number, number, number, number, number, number, number] | undefined;
      return n && { azimuth: n[0], elevation: n[1], roll: n[2], zoom: n[3], lookAt: [n[4], n[5], n[6]] };
    });
    return read && read.length <= MOST_KEY_FRAMES ? read : undefined;
  },
};

type Named = Omit<State, "parameters">; // whose own names are those of their fields
const FIELDS: { [K in keyof Named]: Field<State[K]> } = {
  dataset: text("dataset", /^.{0,256}$/),
  azimuth: real("azimuth"), elevation: real("elevation"), roll: real("roll"),
  zoom: real("zoom"), lookAt: nullable(point("look-at")), projection: oneOf("projection", "orthographic", "perspective"),
  renderer: text("renderer", NAME),
  shading: text("shading", NAME), lights: many<Vec3>("light", 3), shadows: real("shadows"), ambientOcclusion: real("ambient-occlusion"), background: text("background", COLOR),
  preset: text("transfer", NAME), map: nullable(map), range: nullable(range("scalar-range")), opacityDistance: real("opacity-distance"), slopes,
  surfaces, surfacesAlone: flag("surfaces-alone"), clipBox: nullable(clipBox), clipPlanes: many<ClipPlane>("clip-plane", 4),
  clipMode: oneOf("clip-mode", "keep", "cut-away"),
  labels: oneOf("label-mode", "off", "tint", "highlight", "surface"), labelTint: real("label-tint"), labelSurface: oneOf("label-surface", "blocky", "smooth"), labelsShown: text("labels-shown", /^([^,]+(,[^,]+)*)?$/), labelOpacities: each("label-opacity", /^\d+$/, share),
  shapes: { name: "shape", write: shapesText, read: shapesIn },
  overlay: flag("overlay"), channels: nullable(channels), channelTransfers: each(NAMES.channelTransfers, CHANNEL, transfer), channelColors: each(NAMES.channelColors, CHANNEL, text("", COLOR)), channelRanges: each(NAMES.channelRanges, CHANNEL, range("")),
  channelGammas: each(NAMES.channelGammas, CHANNEL, within("", () => GAMMAS)), channelOpacities: each(NAMES.channelOpacities, CHANNEL, share), blend: oneOf(NAMES.blend, "auto", "add", "over", "max"),
  time: text(NAMES.time, /^(last|\d{1,9}|[\d.]+[a-zµ]{1,3})$/),
  layout: oneOf("layout", "single", "quad"), crosshair: nullable(point("at")), window: nullable(real("window")), level: nullable(real("level")), sliceOpacity: within("slice-opacity", () => [0, 1]),
  measures, path, legend: flag("legend"), marker: flag("orientation-marker"), scaleBar: flag("scale-bar"), axes: text("axes", NAME), colorBar: flag("color-bar"), machine: flag("machine"),
};

// Spaces and most marks are legible as they are in a fragment.
const escaped = (value: string): string => encodeURIComponent(value).replace(/%2C/g, ",").replace(/%3A/g, ":").replace(/%3B/g, ";").replace(/%23/g, "%23").replace(/%7C/g, "|");

// Names and texts, as in links.
export type Fields = Readonly<Record<string, string>>;

const initialOf = (offers: Offers): State => ({ ...INITIAL, renderer: offers.automaticRenderer });

// Only what differs from the first state, and the direction of the view, whose first one depends on the dataset.
export function fieldsOf(state: State, offers: Offers): Fields {
  const fields: Record<string, string> = {}, initial = initialOf(offers);
  const add = <K extends keyof Named>(key: K): void => {
    const value = FIELDS[key].write(state[key]);
    if (key === "azimuth" || key === "elevation" || value !== FIELDS[key].write(initial[key])) fields[FIELDS[key].name] = value;
  };
  (Object.keys(FIELDS) as (keyof Named)[]).forEach(add);
  return { ...fields, ...state.parameters };
}

// Short forms: overlay-range=3:8 says channel-range=overlay=3:8. In older links the function "one-color" stands beside a colour.
const OF_OVERLAY = { transfer: NAMES.channelTransfers, range: NAMES.channelRanges, weight: NAMES.channelOpacities, color: NAMES.channelColors };

// What is wrong or missing has its first value.
export function stateOf(fields: Fields, offers: Offers): State {
  const given: Record<string, string> = { ...fields };
  for (const [short, whole] of Object.entries(OF_OVERLAY)) {
    const value = given[`overlay-${short}`];
    if (value !== undefined && value !== "one-color") given[whole] = [given[whole], `${OVERLAY.key}=${value}`].filter(Boolean).join(",");
  }
  const state: State = { ...initialOf(offers), parameters: offers.parametersIn(given) };
  const take = <K extends keyof Named>(key: K): void => {
    const value = given[FIELDS[key].name];
    const read = value === undefined ? undefined : FIELDS[key].read(value, offers);
    if (read !== undefined) state[key] = read;
  };
  (Object.keys(FIELDS) as (keyof Named)[]).forEach(take);
  return state;
}

// Whether they say from where one looks; else the dataset does.
export const sayDirection = (fields: Fields): boolean => "azimuth" in fields || "elevation" in fields;

export const fragmentOf = (fields: Fields): string => Object.entries(fields).map(([name, value]) => `${name}=${escaped(value)}`).join("&");
export const fieldsIn = (fragment: string): Fields => Object.fromEntries([...new URLSearchParams(fragment.replace(/\+/g, "%2B"))].reverse()); // the first of a name counts
