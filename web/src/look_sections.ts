// Sections of the panel: renderer, isosurfaces, light and background.
import { axesOf } from "./camera";
import { takesFunction } from "./channels";
import { type Context, follow } from "./context";
import { button, choice, colorField, iconButton, numberField, parameterField, row, rows, section, segmented, slider, toggle } from "./controls";
import { h } from "./dom";
import { type Offer, type Offers, titleOf, words } from "./offers";
import { projectionOf } from "./options";
import { LOOK, type State, type Surface } from "./state";
import { add, normalized, rounded, scale, type Vec3 } from "./vec";

const MOST_SURFACES = 8, MOST_LIGHTS = 4;

// Renderers that draw cells come before the others, and only for datasets that have cells.
function rendererChoices({ renderers, automaticRenderer }: Offers, cells: boolean): (readonly [string, string])[] {
  const [drawCells, others] = [true, false].map(draws => renderers.filter(each => each.abilities.includes("cells") === draws));
  const named = [...(cells ? drawCells ?? [] : []), ...(others ?? [])].map(each => [each.name, titleOf(each)] as const);
  return [[automaticRenderer, words(automaticRenderer)], ...named];
}

// What the chosen renderer has of its own, as the service describes it.
function parameterRows({ store, offers }: Context): { element: HTMLElement; set(state: State): void } {
  const element = h("div", { class: "list" });
  let renderer = "", made: { name: string; standard: string; set(value: string): void }[] = [];
  const make = ({ name, help, unit, choices, default: standard = "" }: Offer): typeof made[number] => {
    const put = (value: string): void => {
      const { [name]: _, ...others } = store.state.parameters;
      store.update({ parameters: value === "" || value === standard ? others : { ...others, [name]: value } }, name);
    };
    const label = unit ? `${words(name)}, ${unit}` : words(name);
    const control = choices ? choice(label, choices.map(each => [each, words(each)] as const), put) : parameterField(label, standard, offers.limitsOf(name), put);
    control.element.title = help.split("; for --renderer")[0] as string;
    element.append(control.element);
    return { name, standard: choices ? standard : "", set: control.set };
  };
  return {
    element,
    set: state => {
      if (state.renderer !== renderer) { renderer = state.renderer; element.replaceChildren(); made = offers.parametersOf(renderer).map(make); }
      for (const { name, standard, set } of made) set(state.parameters[name] ?? standard);
    },
  };
}

export function renderingSection(context: Context): HTMLElement {
  const { store, volume, offers } = context;
  const renderer = choice("Renderer", rendererChoices(offers, false), value => store.update({ renderer: value }, "renderer"));
  const parameters = parameterRows(context);
  const shading = segmented("Shading", [["phong", "Lit"], ["none", "Plain"], ["depth-gradient", "By depth"]], value => store.update({ shading: value }, "shading"));
  const shadingRow = row("Shading", shading.element);
  const projection = segmented("Projection", [["orthographic", "Parallel"], ["perspective", "Perspective"]], value => store.update({ projection: value as "orthographic" }));
  const background = colorField("Background", value => store.update({ background: value }, "background"));
  const offered = offers.offered("Annotations").find(({ name }) => name === "axes")?.choices ?? [];
  const axes = choice("Axes", offered.map(each => [each, words(each)] as const), value => store.update({ axes: value }));
  const update = (): void => {
    const { state } = store;
    axes.set(state.axes);
    renderer.fill(rendererChoices(offers, (volume()?.cells ?? 0) > 0 || (state.renderer !== offers.automaticRenderer && offers.can("cells", state.renderer))));
    renderer.set(state.renderer);
    parameters.set(state);
    shading.set(state.shading);
    shading.enable("depth-gradient", offers.can("depth-shading", state.renderer));
    projection.set(projectionOf(offers, state));
    projection.enable("perspective", offers.can("perspective", state.renderer));
    background.set(state.background);
    shadingRow.hidden = !offers.can("lights", state.renderer);
  };
  follow(context, [...LOOK, "projection", "axes"], update);
  return section("Rendering", true, renderer.element, parameters.element, shadingRow, row("Projection", projection.element), row("Background", background.element), axes.element);
}

const without = <T>(list: readonly T[], index: number): T[] => list.filter((_, i) => i !== index);
const withItem = <T>(list: readonly T[], index: number, item: T): T[] => list.map((old, i) => (i === index ? item : old));

export function surfacesSection(context: Context): HTMLElement {
  const { store, offers } = context;
  const change = (index: number, patch: Partial<Surface>): void => {
    const surface = store.state.surfaces[index];
    if (surface) store.update({ surfaces: withItem(store.state.surfaces, index, { ...surface, ...patch }) }, `surface ${index}`);
  };
  const list = rows<Surface>(index => {
    const value = numberField(`Isovalue ${index + 1}`, v => change(index, { value: v }));
    const color = colorField(`Colour of surface ${index + 1}`, v => change(index, { color: v }));
    const opacity = numberField(`Opacity of surface ${index + 1}`, v => change(index, { opacity: Math.min(1, Math.max(0, v)) }), "0.05");
    return {
      element: h("div", { class: "list-row" }, value.input, color.input, opacity.input, iconButton(`Remove surface ${index + 1}`, "close", () => store.update({ surfaces: without(store.state.surfaces, index) }, "no surface"))),
      set: surface => { value.set(surface.value); color.set(surface.color); opacity.set(surface.opacity); },
    };
  });
  const addButton = button("Add a surface", "add", () => {
    const volume = context.volume(), [low, high] = volume?.range ?? [0, 1];
    const colors = ["#e0b089", "#f2ede4", "#7fb4d8", "#d98383"];
    store.update({
      surfaces: [...store.state.surfaces, { value: rounded(low + (high - low) * 0.35, 4), color: colors[store.state.surfaces.length % colors.length] as string, opacity: 1 }],
      ...offers.turnTo("isosurfaces", store.state.renderer),
    }, "surface");
  }, "quiet");
  const head = h("div", { class: "list-head", "aria-hidden": "true" }, h("span", {}, "Value"), h("span", {}, "Colour"), h("span", {}, "Opacity"));
  const alone = toggle("Surfaces alone", on => store.update({ surfacesAlone: on }, "alone"));
  const hint = h("p", { class: "hint" }, `Shown by: ${offers.titlesThatCan("isosurfaces")}.`);
  const element = section("Isosurfaces", false, head, list.element, hint, alone.element, addButton);
  const update = (): void => {
    const { surfaces, surfacesAlone, renderer } = store.state;
    element.hidden = !takesFunction(offers, store.state);
    list.set(surfaces);
    alone.set(surfacesAlone);
    head.hidden = alone.element.hidden = surfaces.length === 0;
    hint.hidden = surfaces.length === 0 || offers.can("isosurfaces", renderer);
    addButton.disabled = surfaces.length >= MOST_SURFACES;
  };
  follow(context, LOOK, update);
  return element;
}

const DEGREE = Math.PI / 180;

// A light's direction as angles from the eye: to the right and upwards.
function fromEye(right: number, up: number, context: Context): Vec3 {
  const axes = axesOf(context.store.state), a = right * DEGREE, e = up * DEGREE;
  const v = add(add(scale(axes.right, Math.cos(e) * Math.sin(a)), scale(axes.up, Math.sin(e))), scale(axes.forward, -Math.cos(e) * Math.cos(a)));
  return normalized(v).map(x => rounded(x, 4)) as unknown as Vec3;
}

export function lightSection(context: Context): HTMLElement {
  const { store, offers } = context;
  const list = rows<Vec3>(index => {
    const fields = (["x", "y", "z"] as const).map((axis, i) => numberField(`Light ${index + 1}, ${axis}`, value => {
      const light = [...(store.state.lights[index] ?? [0, 0, 1])];
      light[i] = value;
      if (light.some(c => c !== 0)) store.update({ lights: withItem(store.state.lights, index, light as unknown as Vec3) }, `light ${index}`);
    }, "0.1"));
    return {
      element: h("div", { class: "list-row" }, ...fields.map(field => field.input), iconButton(`Remove light ${index + 1}`, "close", () => store.update({ lights: without(store.state.lights, index) }, "no light"))),
      set: light => fields.forEach((field, i) => field.set(light[i] as number)),
    };
  });
  const at = (right: number, up: number): void => store.update({ lights: [...store.state.lights, fromEye(right, up, context)] }, "light");
  const hint = h("p", { class: "hint" }, "The light is at the eye, or beside it for shadows. Fixed lights stay in place when the volume turns; they start at one side of the present view.");
  const adders = h("div", { class: "button-row" }, button("Left", "add", () => at(-50, 35), "quiet"), button("Above", "add", () => at(0, 70), "quiet"), button("Right", "add", () => at(50, 35), "quiet"));
  const head = h("div", { class: "list-head", "aria-hidden": "true" }, h("span", {}, "Towards x"), h("span", {}, "y"), h("span", {}, "z"));
  const percent = (value: number): string => `${Math.round(100 * value)} %`;
  const shadows = slider("Shadows", 0, 1, 0.05, percent, value => store.update({ shadows: value }, "shadows"));
  const occlusion = slider("Ambient occlusion", 0, 1, 0.05, percent, value => store.update({ ambientOcclusion: value }, "ambient occlusion"));
  const element = section("Light", false, hint, head, list.element, adders, shadows.element, occlusion.element);
  const update = (): void => {
    const { lights, renderer } = store.state;
    const lit = offers.can("lights", renderer), shadowed = offers.can("shadows", renderer);
    element.hidden = !lit && !shadowed;
    shadows.set(store.state.shadows);
    occlusion.set(store.state.ambientOcclusion);
    shadows.element.hidden = occlusion.element.hidden = !shadowed;
    list.set(lights);
    list.element.hidden = adders.hidden = !lit;
    head.hidden = !lit || lights.length === 0;
    hint.hidden = !lit || lights.length > 0;
    for (const child of adders.children) (child as HTMLButtonElement).disabled = lights.length >= MOST_LIGHTS;
  };
  follow(context, LOOK, update);
  return element;
}
