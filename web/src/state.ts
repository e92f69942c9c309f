// What a viewer shows: one plain object. All of it is in the link (link.ts), and pictures follow from it alone (options.ts).
import { PATIENT_START, type Viewpoint } from "./camera";
import type { Measure } from "./measure";
import type { ShownShape } from "./shapes";
import type { ColorMap } from "./transfer";
import type { Vec3 } from "./vec";

export interface Surface { value: number; color: string; opacity: number }
export interface SlopePoint { slope: number; opacity: number } // slopes are data values per unit of the world, and rise
export type Bounds = readonly [number | null, number | null]; // null: not clipped
export type ClipBox = readonly [Bounds, Bounds, Bounds];
export type ClipPlane = readonly [number, number, number, number]; // keeps n . p + d >= 0

export interface KeyFrame extends Viewpoint { lookAt: Vec3 }

export const MOST_KEY_FRAMES = 100;

export interface State extends Viewpoint {
  dataset: string;
  projection: "orthographic" | "perspective";
  // The look
  renderer: string;
  parameters: Readonly<Record<string, string>>; // parameters of renderers, by their names; those that are missing have their standard values
  shading: string;
  lights: readonly Vec3[]; // none: a light at the eye, or with shadows beside it
  shadows: number; // strengths
  ambientOcclusion: number;
  background: string;
  preset: string;
  map: ColorMap | null; // instead of the preset
  range: readonly [number, number] | null; // the function is stretched over these values
  opacityDistance: number;
  slopes: readonly SlopePoint[]; // none: opacity does not depend on the gradient
  surfaces: readonly Surface[];
  surfacesAlone: boolean;
  clipBox: ClipBox | null;
  clipPlanes: readonly ClipPlane[];
  clipMode: "keep" | "cut-away";
  labels: "off" | "tint" | "highlight" | "surface";
  labelTint: number;
  labelSurface: "blocky" | "smooth"; // of labels that are "surface"
  labelsShown: string; // as 1,5-9,Precentral_L,Temporal_*; empty: all
  labelOpacities: Readonly<Record<string, number>>;
  shapes: readonly ShownShape[]; // that show, or have a look
  overlay: boolean; // it shows
  // Channels, by number or name, and the overlay. Those that a record does not name look as the dataset says.
  channels: readonly string[] | null; // which show; null: as the dataset says
  channelTransfers: Readonly<Record<string, string | ColorMap>>; // presets, or functions, instead of colour and gamma
  channelColors: Readonly<Record<string, string>>;
  channelRanges: Readonly<Record<string, readonly [number, number]>>;
  channelGammas: Readonly<Record<string, number>>;
  channelOpacities: Readonly<Record<string, number>>;
  blend: "auto" | "add" | "over" | "max";
  time: string; // a number, one with a unit, or "last"; empty: as the dataset says
  // Slices
  layout: "single" | "quad";
  crosshair: Vec3 | null; // null: the volume's centre
  window: number | null;
  level: number | null;
  sliceOpacity: number; // in the 3-D picture; 0: they do not show there
  measures: readonly Measure[];
  path: readonly KeyFrame[]; // key frames of a movie
  // The page
  legend: boolean; // the legend of labels
  marker: boolean;
  scaleBar: boolean;
  axes: string; // round the volume, in the 3-D picture: "off" or what the service draws into it
  colorBar: boolean;
  machine: boolean;
}

// `renderer`: the gateway's default stands in its place (link.ts).
export const INITIAL: State = {
  dataset: "",
  ...PATIENT_START, roll: 0, zoom: 1, lookAt: null, projection: "orthographic",
  renderer: "", parameters: {}, shading: "phong", lights: [], shadows: 0, ambientOcclusion: 0, background: "#0d1014",
  preset: "auto", map: null, range: null, opacityDistance: 1, slopes: [], surfaces: [], surfacesAlone: true,
  clipBox: null, clipPlanes: [], clipMode: "keep",
  labels: "off", labelTint: 0.5, labelSurface: "blocky", labelsShown: "", labelOpacities: {}, shapes: [],
  overlay: false, channels: null, channelTransfers: {}, channelColors: {}, channelRanges: {}, channelGammas: {}, channelOpacities: {}, blend: "auto", time: "",
  layout: "single", crosshair: null, window: null, level: null, sliceOpacity: 0, measures: [], path: [], legend: true,
  marker: true, scaleBar: true, axes: "off", colorBar: false, machine: false,
};

// What undo brings back: the look, not the place from which one looks.
export const LOOK = ["renderer", "parameters", "shading", "lights", "shadows", "ambientOcclusion", "background", "preset", "map", "range", "opacityDistance", "slopes",
  "surfaces", "surfacesAlone", "clipBox", "clipPlanes", "clipMode", "labels", "labelTint", "labelSurface", "labelsShown", "labelOpacities", "shapes", "overlay",
  "channels", "channelTransfers", "channelColors", "channelRanges", "channelGammas", "channelOpacities", "blend", "window", "level", "sliceOpacity", "measures", "path"] as const;
const UNDO_STEPS = 200;
const ONE_GESTURE_MS = 700;

export type Listener = (state: State, before: State) => void;

export class Store {
  private current: State;
  private readonly listeners = new Set<Listener>();
  private past: State[] = [];
  private future: State[] = [];
  private gesture = { name: "", at: -Infinity };
  private held = false; // a button or a finger is down

  constructor(initial: State) { this.current = initial; }

  get state(): State { return this.current; }
  get canUndo(): boolean { return this.past.length > 0; }
  get canRedo(): boolean { return this.future.length > 0; }

  // With `keys`: only of changes of these. What follows the look need not follow the view, which changes with each move of the hand.
  subscribe(listener: Listener, keys?: readonly (keyof State)[]): void {
    this.listeners.add(keys ? (state, before) => { if (keys.some(key => state[key] !== before[key])) listener(state, before); } : listener);
  }

  // From pressing to letting go is one gesture, however long it takes.
  press(): void { this.held = true; this.gesture = { name: "", at: -Infinity }; }
  letGo(): void { this.held = false; }

  // `gesture` names what the user does, for undo. Changes of one gesture that follow each other are one step.
  update(patch: Partial<State>, gesture = ""): void {
    if (gesture !== "") {
      const now = performance.now();
      if (gesture !== this.gesture.name || (!this.held && now - this.gesture.at > ONE_GESTURE_MS)) this.past = [...this.past.slice(1 - UNDO_STEPS), this.current];
      this.gesture = { name: gesture, at: now };
      this.future = [];
    }
    this.replace({ ...this.current, ...patch });
  }

  undo(): void { this.step(this.past, this.future); }
  redo(): void { this.step(this.future, this.past); }

  private step(from: State[], to: State[]): void {
    const look = from.pop();
    if (!look) return;
    to.push(this.current);
    this.gesture = { name: "", at: -Infinity };
    this.replace({ ...this.current, ...Object.fromEntries(LOOK.map(key => [key, look[key]])) });
  }

  private replace(next: State): void {
    const before = this.current;
    this.current = next;
    for (const listener of this.listeners) listener(next, before);
  }
}
