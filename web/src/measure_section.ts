// Section of the panel: the measuring tools, and the measurements with their values.
import type { Context } from "./context";
import { button, iconButton, section } from "./controls";
import { copyText, h, put, putText, svg } from "./dom";
import { labelTable } from "./label_table";
import { MEASURE_KINDS, type Measure, nameOf, pointsOf, type Profile } from "./measure";
import type { Measuring } from "./measuring";

const PLOT = { width: 280, height: 64, edge: 4 } as const;

function plotOf({ values }: Profile): SVGElement {
  const known = values.filter((value): value is number => value !== null), low = Math.min(...known), high = Math.max(...known), { width, height, edge } = PLOT;
  let pen = "M"; // a gap where there is no value
  const path = values.map((value, i) => {
    if (value === null) { pen = "M"; return ""; }
    const x = edge + ((width - 2 * edge) * i) / (values.length - 1), y = height - edge - (high > low ? (value - low) / (high - low) : 0.5) * (height - 2 * edge);
    const piece = `${pen}${x.toFixed(1)} ${y.toFixed(1)}`;
    pen = "L";
    return piece;
  }).join("");
  return svg("svg", { class: "profile-plot", viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: "none", "aria-hidden": "true" }, svg("path", { d: path }));
}

export function measureSection(context: Context, measuring: Measuring): HTMLDetailsElement {
  const { store } = context;
  const tools = MEASURE_KINDS.map(({ kind, name, key }) => {
    const tool = button(name, null, () => measuring.take(kind), "quiet");
    tool.title = `${name} (${key.toUpperCase()})`;
    return { kind, tool };
  });
  const hint = h("p", { class: "hint", role: "status" });
  const list = h("ol", { class: "measures" });
  const copy = button("Copy", "copy", () => void copyText(measuring.table()).then(() => context.say("The measurements are copied.")), "quiet");
  const clear = button("Remove all", null, () => store.update({ measures: [] }, "no measures"), "quiet");
  const end = h("div", { class: "button-row" }, copy, clear);
  const labels = button("Labels…", null, () => void labelTable(context, store.state.dataset), "quiet");
  context.onVolume(volume => { labels.hidden = (volume?.labels ?? 0) === 0; });
  labels.hidden = true;
  const element = section("Measure", false, h("div", { class: "button-row" }, ...tools.map(each => each.tool), labels), hint, list, end);
  let made: { measure: Measure; text: HTMLElement; plot: HTMLElement; profile: Profile | null }[] = [];
  const draw = (): void => {
    const { measures } = store.state;
    put(context.element, "data-measuring", measuring.tool !== null);
    for (const { kind, tool } of tools) put(tool, "aria-pressed", String(kind === measuring.tool));
    const { tool, points } = measuring;
    putText(hint, tool ? `Click ${points.length === 0 ? "the first" : points.length + 1 < pointsOf(tool) ? "the next" : "the last"} point, in the picture or in a slice. Esc ends.` : measures.length === 0 ? "Choose what to measure, then click points in the picture or in slices." : "");
    hint.hidden = hint.textContent === "";
    end.hidden = measures.length === 0;
    if (made.length !== measures.length || made.some(({ measure }, i) => measure !== measures[i])) {
      made = measures.map(measure => ({ measure, text: h("span", { class: "measure-text" }), plot: h("div", { class: "profile" }), profile: null }));
      list.replaceChildren(...made.map(({ measure, text, plot }, i) => h("li", { "data-measure": measure.kind },
        h("div", { class: "measure-row" }, h("b", {}, `${i + 1} ${nameOf(measure.kind)}`), text, iconButton(`Remove measurement ${i + 1}`, "close", () => measuring.remove(i))), plot)));
    }
    for (const each of made) {
      putText(each.text, measuring.details(each.measure));
      const profile = measuring.profileOf(each.measure);
      if (profile !== each.profile) { each.profile = profile; each.plot.replaceChildren(...(profile?.values.some(value => value !== null) ? [plotOf(profile)] : [])); }
      each.plot.hidden = !each.plot.hasChildNodes();
    }
  };
  measuring.onChange(draw);
  draw();
  return element;
}
