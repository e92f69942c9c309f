// What the gateway offers: options with their limits, and what each renderer can do (docs/http.md, api/v1/options). Loaded before the page is made.

interface Offer { name: string; default?: string; min?: number; above?: number; max?: number; choices?: string[]; renderers?: Renderer[] }
export interface Renderer { name: string; title: string; abilities: string[]; parameters: string[] }

const offers = new Map<string, Offer>();

export async function loadOffers(): Promise<void> {
  const response = await fetch("api/v1/options", { cache: "no-store" });
  const { slice, render } = (await response.json()) as { slice: Offer[]; render: Offer[] };
  for (const offer of [...slice, ...render]) offers.set(offer.name, offer);
}

export const renderers = (): readonly Renderer[] => offers.get("renderer")?.renderers ?? [];
export const titleOf = ({ title }: Renderer): string => title.charAt(0).toUpperCase() + title.slice(1);

// Of an option that is a number.
export function limitsOf(name: string): readonly [number, number] {
  const offer = offers.get(name);
  return [offer?.above ?? offer?.min ?? -Infinity, offer?.max ?? Infinity];
}

export const choicesOf = (name: string): readonly string[] => offers.get(name)?.choices ?? [];

const has = (what: string, { abilities, parameters }: Renderer): boolean => abilities.includes(what) || parameters.includes(what);

// An ability ("isosurfaces") or a parameter ("sampling-rate") of a renderer; the service refuses the rest.
export const can = (what: string, renderer: string): boolean => renderers().some(each => each.name === renderer && has(what, each));

// The one with most abilities.
export function rendererThatCan(what: string): string {
  const able = renderers().filter(each => has(what, each)).sort((a, b) => b.abilities.length - a.abilities.length);
  return able[0]?.name ?? "";
}
export const titlesThatCan = (what: string): string => renderers().filter(each => has(what, each)).map(titleOf).join(", ");
