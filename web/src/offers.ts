// What the gateway offers: options with their limits, and what each renderer can do (docs/http.md, api/v1/options); what the token gives; and what the dataset that
// a viewer shows has. Loaded before the viewer is made.
import type { Api, Dataset } from "./api";

export interface Offer {
  name: string; group: string; type?: string; help: string; unit?: string; default?: string; min?: number; above?: number; max?: number; choices?: string[]; presets?: string[]; region_presets?: string[]; renderers?: Renderer[]; windows?: NamedWindow[];
}
export interface NamedWindow { name: string; width: number; level: number }
export interface Renderer { name: string; title: string; abilities: string[]; parameters: Record<string, string> } // parameters with their standard values

export const titleOf = ({ title }: Renderer): string => title.charAt(0).toUpperCase() + title.slice(1);

// What the service calls something, as the page writes it: "dark-bone" is "Dark bone".
export function words(name: string): string {
  const text = name === "auto" ? "automatic" : name.replace(/-/g, " ").replace(/\b(ct|mri|2d)\b/g, short => short.toUpperCase());
  return text.charAt(0).toUpperCase() + text.slice(1);
}

const has = (what: string, { abilities, parameters }: Renderer): boolean => abilities.includes(what) || what in parameters;

export class Offers {
  dataset: Dataset | null = null; // that is shown; null: nothing is known of it
  private readonly byName = new Map<string, Offer>();

  constructor(private readonly ofPictures: readonly Offer[], ofSlices: readonly Offer[], private readonly rights: readonly string[] | undefined) {
    for (const offer of [...ofSlices, ...ofPictures]) this.byName.set(offer.name, offer);
  }

  static async load(api: Api): Promise<Offers> {
    const [options, access] = await Promise.all([api.ask("options"), api.access()]), { slice, render } = (await options.json()) as { slice: Offer[]; render: Offer[] };
    return new Offers(render, slice, access?.rights);
  }

  // Whether the token gives a right: to change parameters of simulations, to send files. An older gateway does not say so.
  may(right: "steer" | "send"): boolean { return this.rights?.includes(right) ?? true; }

  // Options of pictures under a heading that begins so.
  offered(group: string): readonly Offer[] { return this.ofPictures.filter(each => each.group.startsWith(group)); }
  get renderers(): readonly Renderer[] { return this.byName.get("renderer")?.renderers ?? []; }

  // The limits of an option that is a number.
  limitsOf(name: string): readonly [number, number] {
    const offer = this.byName.get(name);
    return [offer?.above ?? offer?.min ?? -Infinity, offer?.max ?? Infinity];
  }

  // Presets of transfer functions, but for the one that shows nothing.
  presetChoices(): (readonly [string, string])[] {
    return (this.byName.get("transfer")?.presets ?? ["auto"]).filter(name => name !== "none").map(name => [name, words(name)] as const);
  }

  // Whether a preset has regions of values and slopes.
  hasRegions(preset: string): boolean { return this.byName.get("transfer")?.region_presets?.includes(preset) ?? false; }

  // Windows of CT, in Hounsfield units.
  get namedWindows(): readonly NamedWindow[] { return this.byName.get("window")?.windows ?? []; }

  // The renderer unless the user chooses one: the service takes one that can do what is asked, and says which.
  get automaticRenderer(): string { return this.byName.get("renderer")?.default ?? ""; }

  // `cautious`: what is not known yet counts as missing.
  noteDataset(dataset: Dataset | undefined, cautious: boolean): void {
    this.dataset = dataset?.state === "ready" ? dataset : cautious ? { name: "", state: "unloaded" } : null;
  }
  get hasLabels(): boolean { return this.dataset === null || Number(this.dataset.layers?.labels ?? 0) > 0; }
  // Whether the dataset has no values, so that its labels always show, as surfaces.
  get hasLabelsAlone(): boolean { return this.dataset?.fields?.some(field => field.labels && field.shown) ?? false; }

  // The renderer, or the automatic one if it draws cells and the dataset has none.
  fitting(renderer: string): string {
    const chosen = this.renderers.find(({ name }) => name === renderer);
    return this.dataset !== null && !this.dataset.cells && chosen?.abilities.includes("cells") ? this.automaticRenderer : renderer;
  }

  // An ability ("isosurfaces") or a parameter ("sampling-rate") of a renderer; the service refuses the rest.
  can(what: string, renderer: string): boolean { return this.renderers.some(each => (each.name === renderer || renderer === this.automaticRenderer) && has(what, each)); }

  // What a renderer has that others do not; nothing, if the service chooses it.
  parametersOf(renderer: string): readonly Offer[] {
    const own = this.renderers.find(each => each.name === renderer)?.parameters ?? {};
    return Object.entries(own).flatMap(([parameter, standard]) => { const offer = this.byName.get(parameter); return offer ? [{ ...offer, default: standard }] : []; });
  }
  // Texts of parameters that `given` has under their names, if the service takes them.
  parametersIn(given: Readonly<Record<string, string>>): Record<string, string> {
    const isTaken = (name: string, value: string): boolean => {
      const [low, high] = this.limitsOf(name), choices = this.byName.get(name)?.choices ?? [], number = Number(value);
      return choices.length > 0 ? choices.includes(value) : value.trim() !== "" && number >= low && number <= high;
    };
    const all = new Set(this.renderers.flatMap(each => Object.keys(each.parameters)));
    return Object.fromEntries(Object.entries(given).filter(([name, value]) => all.has(name) && isTaken(name, value)));
  }

  // The one with most abilities.
  rendererThatCan(what: string): string {
    const able = this.renderers.filter(each => has(what, each)).sort((a, b) => b.abilities.length - a.abilities.length);
    return able[0]?.name ?? "";
  }
  // A change of the state after which the renderer can do it.
  turnTo(what: string, renderer: string): { renderer?: string } { return this.can(what, renderer) ? {} : { renderer: this.rendererThatCan(what) }; }
  titlesThatCan(what: string): string { return this.renderers.filter(each => has(what, each)).map(titleOf).join(", "); }
}
