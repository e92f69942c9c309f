// Section of the panel: shapes beside the volume, a row each.
import type { Dataset } from "./api";
import { type Context, follow } from "./context";
import { button, colorField, iconButton, section, slider } from "./controls";
import { h, put } from "./dom";
import { LEAST_OPACITY, shapeNamed, type ShownShape, withShape } from "./shapes";

const WHITE = "#ffffff", MOST_PIXELS = 20;

// Shows a shape, by a renderer that can.
export function showShape({ store, offers }: Context, name: string): void {
  store.update({ shapes: withShape(store.state.shapes, name, { shown: true }), ...offers.turnTo("shapes", store.state.renderer) }, "shape");
}

interface Row { element: HTMLElement; refresh(dataset: Dataset | undefined): void }

function shapeRow(context: Context, name: string): Row {
  const { store } = context, of = (): ShownShape => shapeNamed(store.state.shapes, name);
  const set = (patch: Partial<ShownShape>, what: string): void => store.update({ shapes: withShape(store.state.shapes, name, patch) }, `${what} of ${name}`);
  const eye = iconButton(`Show ${name}`, "eye", () => (of().shown ? set({ shown: false }, "shape") : showShape(context, name)));
  const color = colorField(`Colour of ${name}`, value => set({ color: value }, "color"));
  const own = button("Own", null, () => set({ color: null }, "color"), "quiet");
  own.setAttribute("aria-label", `Own colours of ${name}`);
  const opacity = slider("Opacity", LEAST_OPACITY, 1, 0.05, v => `${Math.round(v * 100)} %`, value => set({ opacity: value }, "opacity"));
  const width = slider("Width", 0, MOST_PIXELS, 0.5, v => (v === 0 ? "Own" : `${v} px`), value => set({ width: value === 0 ? "" : `${value}px` }, "width"));
  for (const [what, { element }] of Object.entries({ Opacity: opacity, Width: width })) element.querySelector("input")?.setAttribute("aria-label", `${what} of ${name}`);
  return {
    element: h("div", { class: "channel", role: "group", "aria-label": name, "data-shape": name }, h("div", { class: "channel-head" }, eye, color.input, h("span", { class: "label-name", title: name }, name), own), opacity.element, width.element),
    refresh: dataset => {
      const shape = of();
      put(eye, "aria-pressed", String(shape.shown));
      color.set(shape.color ?? WHITE);
      own.hidden = shape.color === null;
      opacity.set(shape.opacity);
      width.set(shape.width.endsWith("px") ? Number.parseFloat(shape.width) : 0);
      color.input.hidden = opacity.element.hidden = !shape.shown;
      width.element.hidden = !shape.shown || !dataset?.shape || dataset.shape.kind === "mesh";
    },
  };
}

// `set`: the datasets of the service.
export function shapesSection(context: Context): { element: HTMLElement; set(datasets: readonly Dataset[]): void } {
  const { store, offers } = context, hint = h("p", { class: "hint" }), list = h("div", { class: "list" }), element = section("Shapes", true, hint, list);
  let known: readonly Dataset[] = [], made = new Map<string, Row>();
  const update = (): void => {
    const { shapes, renderer } = store.state, names = [...new Set([...known, ...shapes].map(({ name }) => name))];
    if (names.join("\n") !== [...made.keys()].join("\n")) {
      made = new Map(names.map(name => [name, made.get(name) ?? shapeRow(context, name)]));
      list.replaceChildren(...[...made.values()].map(each => each.element));
    }
    element.hidden = names.length === 0 || !offers.titlesThatCan("shapes");
    hint.hidden = offers.can("shapes", renderer);
    hint.textContent = `Shapes are shown by: ${offers.titlesThatCan("shapes")}.`;
    for (const [name, each] of made) each.refresh(known.find(dataset => dataset.name === name));
  };
  follow(context, ["shapes", "renderer"], update);
  return { element, set: datasets => { known = datasets.filter(each => each.is_shape); update(); } };
}
