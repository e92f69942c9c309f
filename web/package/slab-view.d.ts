// Types of the element <slab-view>, which importing the package defines. docs/viewer.md of Slabstream says what each name means.

// Attributes and fields of the state, with the names and texts of a link to the viewer's page. A parameter of a renderer is one, too.
export type SlabViewSetting =
  | "dataset" | "time" | "azimuth" | "elevation" | "roll" | "zoom" | "look-at" | "projection"
  | "renderer" | "shading" | "light" | "shadows" | "ambient-occlusion" | "background"
  | "transfer" | "function" | "scalar-range" | "opacity-distance" | "gradient-opacity" | "isovalue" | "surfaces-alone"
  | "clip-box" | "clip-plane" | "clip-mode" | "label-mode" | "label-tint" | "label-surface" | "labels-shown" | "label-opacity"
  | "shape" | "overlay" | "channel" | "channel-transfer" | "channel-color" | "channel-range" | "channel-gamma" | "channel-opacity" | "blend"
  | "layout" | "at" | "window" | "level" | "slice-opacity" | "measure" | "path" | "legend" | "orientation-marker" | "scale-bar" | "axes" | "color-bar" | "machine";

type Known<T> = { readonly [name in SlabViewSetting]?: T };

export interface SlabViewState extends Known<string> { readonly [parameter: string]: string | undefined }
export interface SlabViewSettings extends Known<string | number | undefined> { readonly [parameter: string]: string | number | undefined }

export interface SlabViewAttributes extends Known<string | number | undefined> {
  readonly src?: string | undefined; // the gateway's address; it may hold the token, as in the link that `slabstream view` prints
  readonly token?: string | undefined;
  readonly panel?: "" | undefined; // the settings show at first
}

type Point = readonly [x: number, y: number, z: number];

// What was clicked at in the picture: the answer of api/v1/pick (docs/http.md).
export interface SlabViewPick {
  readonly hit?: boolean;
  readonly depth?: number;
  readonly at?: Point; // of the world
  readonly inside?: boolean;
  readonly voxel?: Point | null;
  readonly value?: number | null;
  readonly interpolated?: number | null;
  readonly label?: { readonly value: number; readonly name: string; readonly color?: string } | null;
  readonly fields?: readonly { readonly name: string; readonly value: number | null }[];
  readonly shape?: string; // a mesh, lines or points beside the volume was clicked at, or a "plane"
  readonly shape_number?: number;
  readonly shape_value?: number | null;
}

export interface SlabViewElement extends HTMLElement {
  get state(): SlabViewState;
  set state(settings: SlabViewSettings); // the whole state: what is left out has its first value, but the dataset stays
}

// They bubble.
export interface SlabViewEventMap {
  "slab-state": CustomEvent<SlabViewState>; // at most 10 times a second while it changes
  "slab-pick": CustomEvent<SlabViewPick>;
  "slab-error": CustomEvent<string>; // one line
}

declare global {
  interface HTMLElementTagNameMap { "slab-view": SlabViewElement }
  interface HTMLElementEventMap extends SlabViewEventMap {}
}
