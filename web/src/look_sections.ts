// Sections of the panel: renderer, isosurfaces, light and background, layers.
import type { LabelName } from "./api";
import { axesOf } from "./camera";
import type { Context } from "./context";
import { button, choice, colorField, iconButton, numberField, row, section, segmented, slider, textField, toggle } from "./controls";
import { h, shown } from "./dom";
import { can, rendererThatCan, renderers, titleOf, titlesThatCan } from "./offers";
import { projectionOf } from "./options";
import { LOOK, type Surface } from "./state";
import { PRESETS } from "./transfer_editor";
import { add, normalized, rounded, scale, type Vec3 } from "./vec";

const MOST_SURFACES = 8, MOST_LIGHTS = 4;

// Those that draw cells come first, and only for datasets that have cells.
function rendererChoices(cells: boolean): (readonly [string, string])[] {
  const [drawCells, others] = [true, false].map(draws => renderers().filter(each => each.abilities.includes("cells") === draws));
  return [...(cells ? drawCells ?? [] : []), ...(others ?? [])].map(each => [each.name, titleOf(each)] as const);
}

export function renderingSection({ store, volume, onVolume }: Context): HTMLElement {
  const renderer = choice("Renderer", rendererChoices(false), value => store.update({ renderer: value }, "renderer"));
  const mode = choice("Show", [["maximum", "Largest value"], ["minimum", "Least value"], ["mean", "Mean value"]], value => store.update({ projectionMode: value }, "mode"));
  const sampling = slider("Samples a voxel", 0.5, 4, 0.5, v => shown(v, 2), value => store.update({ samplingRate: value }, "sampling"));
  const shading = segmented("Shading", [["phong", "Lit"], ["none", "Plain"], ["depth-gradient", "By depth"]], value => store.update({ shading: value }, "shading"));
  const shadingRow = row("Shading", shading.element);
  const projection = segmented("Projection", [["orthographic", "Parallel"], ["perspective", "Perspective"]], value => store.update({ projection: value as "orthographic" }));
  const background = colorField("Background", value => store.update({ background: value }, "background"));
  const update = (): void => {
    const { state } = store;
    renderer.fill(rendererChoices((volume()?.cells ?? 0) > 0 || can("cells", state.renderer)));
    renderer.set(state.renderer);
    mode.set(state.projectionMode);
    sampling.set(state.samplingRate);
    shading.set(state.shading);
    shading.enable("depth-gradient", can("depth-shading", state.renderer));
    projection.set(projectionOf(state));
    projection.enable("perspective", can("perspective", state.renderer));
    background.set(state.background);
    mode.element.hidden = !can("projection-mode", state.renderer);
    sampling.element.hidden = !can("sampling-rate", state.renderer);
    shadingRow.hidden = !can("lights", state.renderer);
  };
  store.subscribe(update, [...LOOK, "projection"]);
  onVolume(update);
  update();
  return section("Rendering", true, renderer.element, mode.element, sampling.element, shadingRow, row("Projection", projection.element), row("Background", background.element));
}

// Rows of a list in the state, made anew only when their number changes, so that the focus stays.
function rows<T>(make: (index: number) => { element: HTMLElement; set(item: T): void }): { element: HTMLElement; set(items: readonly T[]): void } {
  const element = h("div", { class: "list" });
  let made: { element: HTMLElement; set(item: T): void }[] = [];
  return {
    element,
    set: items => {
      if (made.length !== items.length) { made = items.map((_, i) => make(i)); element.replaceChildren(...made.map(each => each.element)); }
      items.forEach((item, i) => made[i]?.set(item));
    },
  };
}

const without = <T>(list: readonly T[], index: number): T[] => list.filter((_, i) => i !== index);
const withItem = <T>(list: readonly T[], index: number, item: T): T[] => list.map((old, i) => (i === index ? item : old));

export function surfacesSection(context: Context): HTMLElement {
  const { store } = context;
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
      ...(can("isosurfaces", store.state.renderer) ? {} : { renderer: rendererThatCan("isosurfaces") }),
    }, "surface");
  }, "quiet");
  const head = h("div", { class: "list-head", "aria-hidden": "true" }, h("span", {}, "Value"), h("span", {}, "Colour"), h("span", {}, "Opacity"));
  const alone = toggle("Surfaces alone", on => store.update({ surfacesAlone: on }, "alone"));
  const hint = h("p", { class: "hint" }, "Shown by ray casting and the Z-buffer.");
  const update = (): void => {
    const { surfaces, surfacesAlone, renderer } = store.state;
    list.set(surfaces);
    alone.set(surfacesAlone);
    head.hidden = alone.element.hidden = surfaces.length === 0;
    hint.hidden = surfaces.length === 0 || can("isosurfaces", renderer);
    addButton.disabled = surfaces.length >= MOST_SURFACES;
  };
  store.subscribe(update, LOOK);
  update();
  return section("Isosurfaces", false, head, list.element, hint, alone.element, addButton);
}

const DEGREE = Math.PI / 180;

// A light's direction as angles from the eye: to the right and upwards.
function fromEye(right: number, up: number, context: Context): Vec3 {
  const axes = axesOf(context.store.state), a = right * DEGREE, e = up * DEGREE;
  const v = add(add(scale(axes.right, Math.cos(e) * Math.sin(a)), scale(axes.up, Math.sin(e))), scale(axes.forward, -Math.cos(e) * Math.cos(a)));
  return normalized(v).map(x => rounded(x, 4)) as unknown as Vec3;
}

export function lightSection(context: Context): HTMLElement {
  const { store } = context;
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
  const hint = h("p", { class: "hint" }, "The light is at the eye. Fixed lights stay in place when the volume turns; they start at one side of the present view.");
  const adders = h("div", { class: "button-row" }, button("Left", "add", () => at(-50, 35), "quiet"), button("Above", "add", () => at(0, 70), "quiet"), button("Right", "add", () => at(50, 35), "quiet"));
  const head = h("div", { class: "list-head", "aria-hidden": "true" }, h("span", {}, "Towards x"), h("span", {}, "y"), h("span", {}, "z"));
  const update = (): void => {
    const { lights } = store.state;
    list.set(lights);
    head.hidden = lights.length === 0;
    hint.hidden = lights.length > 0;
    for (const child of adders.children) (child as HTMLButtonElement).disabled = lights.length >= MOST_LIGHTS;
  };
  store.subscribe(update, LOOK);
  update();
  return section("Light", false, hint, head, list.element, adders);
}

// ---- labels and the overlay

// "1,5-9" as a set; empty text: all.
const isShown = (shownText: string, label: number): boolean => shownText === "" || shownText.split(",").some(part => { const [first, last] = part.split("-").map(Number); return label >= (first ?? 0) && label <= (last ?? first ?? 0); });

export class LabelsSection {
  readonly element: HTMLElement;
  private names: LabelName[] = []; // all of the dataset if the gateway tells them, else those that were pointed at
  private readonly list = h("div", { class: "labels", role: "group", "aria-label": "Labels" });

  constructor(private readonly context: Context) {
    const { store } = context;
    const mode = segmented("Labels", [["off", "Off"], ["tint", "Tint"], ["surface", "Solid"]], value => store.update({ labels: value as "off", ...(value !== "off" && !can("labels", store.state.renderer) ? { renderer: rendererThatCan("labels") } : {}) }, "labels"));
    const tint = slider("Tint", 0, 1, 0.05, v => `${Math.round(v * 100)} %`, value => store.update({ labelTint: value }, "tint"));
    const which = textField("Shown", "all, or 1,5-9", "[0-9]+(-[0-9]+)?(,[0-9]+(-[0-9]+)?)*", value => store.update({ labelsShown: value }, "labels shown"));
    const overlay = toggle("Overlay", on => store.update({ overlay: on, ...(on && !can("overlay", store.state.renderer) ? { renderer: rendererThatCan("overlay") } : {}) }, "overlay"));
    const overlayPreset = choice("Overlay’s function", PRESETS.map(name => [name, name] as const), value => store.update({ overlayPreset: value }, "overlay preset"));
    const weight = slider("Weight", 0, 1, 0.05, v => `${Math.round(v * 100)} %`, value => store.update({ overlayWeight: value }, "weight"));
    const hint = h("p", { class: "hint" });
    this.element = section("Layers", false, row("Labels", mode.element), tint.element, which.element, hint, this.list, overlay.element, overlayPreset.element, weight.element);
    const update = (): void => {
      const { state } = store, volume = context.volume(), labels = (volume?.labels ?? 0) > 0, on = labels && state.labels !== "off";
      this.element.hidden = !labels && !volume?.overlay;
      mode.set(state.labels);
      tint.set(state.labelTint);
      which.set(state.labelsShown);
      overlay.set(state.overlay);
      overlayPreset.set(state.overlayPreset);
      weight.set(state.overlayWeight);
      (mode.element.parentElement as HTMLElement).hidden = !labels;
      tint.element.hidden = !labels || state.labels !== "tint";
      which.element.hidden = this.list.hidden = !on;
      hint.hidden = !on || (can("labels", state.renderer) && this.names.length > 0);
      hint.textContent = !can("labels", state.renderer) ? `Labels are shown by: ${titlesThatCan("labels")}.` : `${volume?.labels ?? 0} labels. Point at one in the picture to list it here.`;
      overlay.element.hidden = !volume?.overlay;
      overlayPreset.element.hidden = weight.element.hidden = !volume?.overlay || !state.overlay;
      this.refresh();
    };
    store.subscribe(update, LOOK);
    context.onVolume(volume => {
      this.names = [];
      this.list.replaceChildren();
      update();
      if (volume && volume.labels > 0) context.api.labels(volume.name).then(answer => { this.names = answer?.labels ?? []; update(); }).catch(() => undefined);
    });
    update();
  }

  // A label that was pointed at.
  note(label: LabelName): void {
    if (this.names.some(known => known.value === label.value)) return;
    this.names = [...this.names, label].sort((a, b) => a.value - b.value);
    this.refresh();
  }

  private refresh(): void {
    const { store } = this.context, { labelsShown, labelOpacities } = store.state;
    if (this.list.childElementCount !== this.names.length) {
      this.list.replaceChildren(...this.names.map(label => {
        const name = label.name || `Label ${label.value}`;
        const box: HTMLInputElement = h("input", { type: "checkbox", "aria-label": `Show ${name}`, onchange: () => this.setShown(label.value, box.checked) });
        const opacity: HTMLInputElement = h("input", { type: "range", min: 0, max: 1, step: 0.05, "aria-label": `Opacity of ${name}`, oninput: () => store.update({ labelOpacities: { ...store.state.labelOpacities, [label.value]: rounded(Number(opacity.value)) } }, `opacity ${label.value}`) });
        const only = h("button", { type: "button", class: "only", "aria-label": `Show only ${name}`, onclick: () => store.update({ labelsShown: store.state.labelsShown === String(label.value) ? "" : String(label.value) }, "only") }, "only");
        const swatch = h("span", { class: "swatch", "aria-hidden": "true" });
        if (label.color) swatch.style.background = label.color;
        return h("div", { class: "label-row", "data-label": label.value }, box, swatch, h("span", { class: "label-name", title: name }, name), only, opacity);
      }));
    }
    this.names.forEach((label, i) => {
      const [box, opacity] = (this.list.children[i] as HTMLElement).querySelectorAll("input");
      if (box) box.checked = isShown(labelsShown, label.value) && labelOpacities[label.value] !== 0;
      if (opacity) opacity.value = String(labelOpacities[label.value] ?? 1);
    });
  }

  // The opacity 0 hides one of all labels; a list of what is shown is changed as such.
  private setShown(label: number, on: boolean): void {
    const { store } = this.context, { labelsShown, labelOpacities } = store.state;
    if (labelsShown === "" || isShown(labelsShown, label)) {
      const rest = Object.fromEntries(Object.entries(labelOpacities).filter(([key]) => key !== String(label)));
      return store.update({ labelOpacities: on ? rest : { ...rest, [label]: 0 } }, "label");
    }
    store.update({ labelsShown: labelsShown ? `${labelsShown},${label}` : "" }, "label");
  }
}
