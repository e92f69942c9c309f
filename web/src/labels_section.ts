// Section of the panel: labels.
import type { LabelName } from "./api";
import { type Context, follow } from "./context";
import { row, section, segmented, slider, textField, toggle } from "./controls";
import { h } from "./dom";
import { isListed, type Labels, labelText, listOf } from "./labels";
import { labelMode } from "./options";
import { LOOK } from "./state";
import { rounded } from "./vec";

// A row for each label: whether it shows, its colour, its name, its opacity.
function labelList({ store }: Context, labels: Labels): { element: HTMLElement; refresh(): void } {
  const element = h("div", { class: "labels", role: "group", "aria-label": "Labels" });
  let made: readonly LabelName[] = [];
  // A list names what is shown. Where not all labels are known, it would hide the others, too: there the opacity 0 hides one of them, but
  // not in slices, and for highlights not its material alone.
  const setShown = (label: LabelName, on: boolean): void => {
    const { labels: mode, labelsShown, labelOpacities } = store.state;
    if (!isListed(labelsShown, label)) return store.update({ labelsShown: `${labelsShown},${label.value}` }, "label");
    if (!on && (mode === "highlight" || labels.complete)) {
      const rest = listOf(labels.names.filter(known => known !== label && isListed(labelsShown, known)), labels.names);
      return store.update(rest ? { labelsShown: rest } : { labels: "off" }, "label");
    }
    const rest = Object.fromEntries(Object.entries(labelOpacities).filter(([key]) => key !== String(label.value)));
    store.update({ labelOpacities: on ? rest : { ...rest, [label.value]: 0 } }, "label");
  };
  const make = (label: LabelName): HTMLElement => {
    const name = labelText(label);
    const box: HTMLInputElement = h("input", { type: "checkbox", "aria-label": `Show ${name}`, onchange: () => setShown(label, box.checked) });
    const opacity: HTMLInputElement = h("input", { type: "range", min: 0, max: 1, step: 0.05, "aria-label": `Opacity of ${name}`, oninput: () => store.update({ labelOpacities: { ...store.state.labelOpacities, [label.value]: rounded(Number(opacity.value)) } }, `opacity ${label.value}`) });
    const only = h("button", { type: "button", class: "only", "aria-label": `Show only ${name}`, onclick: () => store.update({ labelsShown: store.state.labelsShown === String(label.value) ? "" : String(label.value) }, "only") }, "only");
    const swatch = h("span", { class: "swatch", "aria-hidden": "true" });
    if (label.color) swatch.style.background = label.color;
    return h("div", { class: "label-row", "data-label": label.value }, box, swatch, h("span", { class: "label-name", title: name }, name), only, opacity);
  };
  return {
    element,
    refresh: () => {
      if (made !== labels.names) { made = labels.names; element.replaceChildren(...made.map(make)); }
      made.forEach((label, i) => {
        const [box, opacity] = (element.children[i] as HTMLElement).querySelectorAll("input");
        if (box) box.checked = labels.shows(label);
        if (opacity) opacity.value = String(store.state.labelOpacities[label.value] ?? 1);
      });
    },
  };
}

export function labelsSection(context: Context, labels: Labels): HTMLElement {
  const { store, offers } = context, list = labelList(context, labels);
  const mode = segmented("Labels", [["off", "Off"], ["tint", "Tint"], ["highlight", "Highlight"], ["surface", "Solid"]], value => store.update({ labels: value as "off", ...(value !== "off" ? offers.turnTo("labels", store.state.renderer) : {}) }, "labels"));
  const tint = slider("Tint", 0, 1, 0.05, v => `${Math.round(v * 100)} %`, value => store.update({ labelTint: value }, "tint"));
  const smooth = toggle("Smooth surfaces", on => store.update({ labelSurface: on ? "smooth" : "blocky", ...(on ? offers.turnTo("smooth-labels", store.state.renderer) : {}) }, "surfaces of labels"));
  const which = textField("Shown", "all, or 1,5-9,Frontal_*", "[^,]+(,[^,]+)*", value => store.update({ labelsShown: value }, "labels shown"));
  const legend = toggle("Legend", on => store.update({ legend: on }));
  const hint = h("p", { class: "hint" });
  const element = section("Labels", false, row("Shown as", mode.element), tint.element, smooth.element, which.element, legend.element, hint, list.element);
  const update = (): void => {
    const { state } = store, shownAs = labelMode(offers, state), on = shownAs !== "off";
    element.hidden = !context.volume()?.labels;
    mode.set(shownAs);
    for (const other of ["off", "tint", "highlight"]) mode.enable(other, !offers.hasLabelsAlone);
    tint.set(state.labelTint);
    smooth.set(state.labelSurface === "smooth");
    which.set(state.labelsShown);
    legend.set(state.legend);
    tint.element.hidden = shownAs !== "tint" && shownAs !== "highlight";
    smooth.element.hidden = shownAs !== "surface";
    which.element.hidden = list.element.hidden = legend.element.hidden = !on;
    hint.hidden = !on || (offers.can("labels", state.renderer) && labels.names.length > 0);
    hint.textContent = !offers.can("labels", state.renderer) ? `Labels are shown by: ${offers.titlesThatCan("labels")}.` : "Point at a label in the picture to list it here.";
    list.refresh();
  };
  labels.onChange(update);
  follow(context, [...LOOK, "legend"], update);
  return element;
}
