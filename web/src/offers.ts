// What the gateway offers: options with their limits, and what each renderer can do (docs/http.md, api/v1/options). Loaded before the page is made.
import type { Dataset } from "./api";
import type { Connection } from "./connection";

export interface Offer {
  name: string; group: string; type?: string; help: string; unit?: string; default?: string; min?: number; above?: number; max?: number; choices?: string[]; presets?: string[]; region_presets?: string[]; renderers?: Renderer[]; windows?: NamedWindow[];
}
export interface NamedWindow { name: string; width: number; level: number }
export interface Renderer { name: string; title: string; abilities: string[]; parameters: Record<string, string> } // parameters with their standard values

const offers = new Map<string, Offer>();
let ofPictures: readonly Offer[] = []; // not of slices

export async function loadOffers(connection: Connection): Promise<void> {
  const response = await connection.request("options", {}, {});
  const { slice, render } = (await response.json()) as { slice: Offer[]; render: Offer[] };
  for (const offer of [...slice, ...render]) offers.set(offer.name, offer);
  ofPictures = render;
}

// Options of pictures under a heading that begins so.
export const offered = (group: string): readonly Offer[] => ofPictures.filter(each => each.group.startsWith(group));
export const renderers = (): readonly Renderer[] => offers.get("renderer")?.renderers ?? [];
export const titleOf = ({ title }: Renderer): string => title.charAt(0).toUpperCase() + title.slice(1);

// The limits of an option that is a number.
export function limitsOf(name: string): readonly [number, number] {
  const offer = offers.get(name);
  return [offer?.above ?? offer?.min ?? -Infinity, offer?.max ?? Infinity];
}

export const choicesOf = (name: string): readonly string[] => offers.get(name)?.choices ?? [];

// What the service calls something, as the page writes it: "dark-bone" is "Dark bone".
export function words(name: string): string {
  const text = name === "auto" ? "automatic" : name.replace(/-/g, " ").replace(/\b(ct|mri|2d)\b/g, short => short.toUpperCase());
  return text.charAt(0).toUpperCase() + text.slice(1);
}

// Presets of transfer functions, but for the one that shows nothing.
export const presetChoices = (): (readonly [string, string])[] =>
  (offers.get("transfer")?.presets ?? ["auto"]).filter(name => name !== "none").map(name => [name, words(name)] as const);

// Whether a preset has regions of values and slopes.
export const hasRegions = (preset: string): boolean => offers.get("transfer")?.region_presets?.includes(preset) ?? false;

// Windows of CT, in Hounsfield units.
export const namedWindows = (): readonly NamedWindow[] => offers.get("window")?.windows ?? [];

const has = (what: string, { abilities, parameters }: Renderer): boolean => abilities.includes(what) || what in parameters;

// The renderer unless the user chooses one: the service takes one that can do what is asked, and says which.
export const automaticRenderer = (): string => offers.get("renderer")?.default ?? "";
// The dataset that is shown; null: nothing is known of it. `cautious`: what is not known yet counts as missing.
let shown: Dataset | null = null;
export function noteDataset(dataset: Dataset | undefined, cautious: boolean): void {
  shown = dataset?.state === "ready" ? dataset : cautious ? { name: "", state: "unloaded" } : null;
}
export const shownDataset = (): Dataset | null => shown;
export const hasLabels = (): boolean => shown === null || Number(shown.layers?.labels ?? 0) > 0;
// Whether it has no values, so that its labels always show, as surfaces.
export const hasLabelsAlone = (): boolean => shown?.fields?.some(field => field.labels && field.shown) ?? false;

// The renderer, or the automatic one if it draws cells and the dataset has none.
export function fitting(renderer: string): string {
  const chosen = renderers().find(({ name }) => name === renderer);
  return shown !== null && !shown.cells && chosen?.abilities.includes("cells") ? automaticRenderer() : renderer;
}

// An ability ("isosurfaces") or a parameter ("sampling-rate") of a renderer; the service refuses the rest.
export const can = (what: string, renderer: string): boolean => renderers().some(each => (each.name === renderer || renderer === automaticRenderer()) && has(what, each));

// What a renderer has that others do not; nothing, if the service chooses it.
export function parametersOf(renderer: string): readonly Offer[] {
  const own = renderers().find(each => each.name === renderer)?.parameters ?? {};
  return Object.entries(own).flatMap(([parameter, standard]) => { const offer = offers.get(parameter); return offer ? [{ ...offer, default: standard }] : []; });
}
const allParameters = (): ReadonlySet<string> => new Set(renderers().flatMap(each => Object.keys(each.parameters)));
// Texts of parameters that `given` has under their names, if the service takes them.
export function parametersIn(given: { get(name: string): string | null }): Record<string, string> {
  const isTaken = (name: string, value: string): boolean => {
    const [low, high] = limitsOf(name), choices = choicesOf(name), number = Number(value);
    return choices.length > 0 ? choices.includes(value) : value.trim() !== "" && number >= low && number <= high;
  };
  return Object.fromEntries([...allParameters()].flatMap(name => { const value = given.get(name); return value !== null && isTaken(name, value) ? [[name, value]] : []; }));
}

// The one with most abilities.
export function rendererThatCan(what: string): string {
  const able = renderers().filter(each => has(what, each)).sort((a, b) => b.abilities.length - a.abilities.length);
  return able[0]?.name ?? "";
}
// A change of the state after which the renderer can do it.
export const turnTo = (what: string, renderer: string): { renderer?: string } => (can(what, renderer) ? {} : { renderer: rendererThatCan(what) });
export const titlesThatCan = (what: string): string => renderers().filter(each => has(what, each)).map(titleOf).join(", ");
