// Fields for what the service draws onto a picture: a title, bars and marks, as many as it offers.
import { toggle } from "./controls";
import { h } from "./dom";
import { type Offers, words } from "./offers";
import type { Options } from "./api";
import type { State } from "./state";

const MOST_TITLE = 120;

export function annotationFields(offers: Offers, state: State): { elements: HTMLElement[]; options(): Options } {
  const shown: Record<string, boolean> = { "scale-bar": state.scaleBar, "color-bar": state.colorBar, "orientation-marker": state.marker };
  const flags = offers.offered("Annotations").filter(({ type }) => type === undefined).map(({ name, help }) => {
    const control = toggle(words(name), on => { shown[name] = on; });
    control.set(shown[name] ?? false);
    control.element.title = help;
    return { name, control };
  });
  const title: HTMLInputElement = h("input", { type: "text", id: "title", maxlength: MOST_TITLE, placeholder: "none", autocomplete: "off" });
  return {
    elements: [h("div", { class: "row" }, h("label", { for: "title" }, "Title"), title), ...flags.map(({ control }) => control.element)],
    options: () => ({ ...(title.value.trim() ? { title: title.value.trim() } : {}), ...Object.fromEntries(flags.filter(({ name }) => shown[name]).map(({ name }) => [name, true])) }),
  };
}
