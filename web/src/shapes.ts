// Shapes beside the volume, meshes, lines and points, each a dataset of its own: which show, and how.

export interface ShownShape {
  name: string; // of the dataset
  shown: boolean;
  color: string | null; // null: the colours that it has
  opacity: number; // in (0, 1]
  width: string; // of lines and points, "3px" or in units of the world; empty: their own
  map: string; // a colour map for its values; empty: the usual one
  range: string; // "0:1", that the map spans; empty: all values
}

export const MOST_SHAPES = 64, LEAST_OPACITY = 0.05;
const NEW: ShownShape = { name: "", shown: false, color: null, opacity: 1, width: "", map: "", range: "" };

export const shapeNamed = (shapes: readonly ShownShape[], name: string): ShownShape => shapes.find(each => each.name === name) ?? { ...NEW, name };

// With one of them, which may be new, looking otherwise.
export function withShape(shapes: readonly ShownShape[], name: string, patch: Partial<ShownShape>): readonly ShownShape[] {
  const changed = { ...shapeNamed(shapes, name), ...patch };
  return shapes.some(each => each.name === name) ? shapes.map(each => (each.name === name ? changed : each)) : [...shapes, changed].slice(-MOST_SHAPES);
}

const lookText = ({ color, opacity, width, map, range }: ShownShape): string =>
  Object.entries({ color, opacity: opacity === 1 ? "" : opacity, width, map, range }).map(([name, value]) => (value ? `,${name}=${value}` : "")).join("");

// As the command line takes them.
export const shapeOptions = (shapes: readonly ShownShape[]): string[] =>
  shapes.filter(each => each.shown).map(each => each.name.replace(/[,=\\]/g, "\\$&") + lookText(each));

export const shapesText = (shapes: readonly ShownShape[]): string =>
  shapes.map(each => encodeURIComponent(each.name) + (each.shown ? "" : ",shown=0") + lookText(each)).join(";");

const ALLOWED: Readonly<Record<string, RegExp>> = {
  shown: /^[01]$/, color: /^#[0-9a-f]{6}$/i, opacity: /^(1|0?\.\d*[1-9]\d*)$/, width: /^(\d+\.?\d*|\.\d+)(e[+-]?\d+)?(px)?$/, map: /^[\w-]{1,64}$/, range: /^[^:,;]+:[^:,;]+$/,
};
export function shapesIn(text: string): readonly ShownShape[] | undefined {
  const found: ShownShape[] = [];
  for (const item of text.split(";")) {
    const [name = "", ...looks] = item.split(","), pairs = looks.map(look => look.split("=") as [string, string]);
    if (name === "" || !pairs.every(([key, value]) => ALLOWED[key]?.test(value ?? ""))) return undefined;
    const { shown = "1", opacity = "1", ...others } = Object.fromEntries(pairs);
    try { found.push({ ...NEW, name: decodeURIComponent(name), shown: shown === "1", opacity: Number(opacity), ...others }); } catch { return undefined; }
  }
  return found.length <= MOST_SHAPES ? found : undefined;
}
