// Section of the panel: the cross-hair and the window of the slices, by numbers.
import type { Context } from "./context";
import { button, numberField, section } from "./controls";
import { h } from "./dom";
import { AXES, AXIS_NAMES, clamp, withAxis } from "./vec";

export function slicesSection(context: Context): HTMLElement {
  const { store } = context;
  const at = AXES.map(axis => numberField(`Cross-hair, ${AXIS_NAMES[axis]}`, value => {
    const volume = context.volume();
    if (volume) store.update({ crosshair: withAxis(store.state.crosshair ?? volume.centre, axis, clamp(value, volume.low[axis], volume.high[axis])) });
  }));
  const range = (): readonly [number, number] => context.volume()?.range ?? [0, 1];
  const window = numberField("Window of the slices", value => { if (value > 0) store.update({ window: value, level: store.state.level ?? (range()[0] + range()[1]) / 2 }, "slice window"); });
  const level = numberField("Level of the slices", value => store.update({ level: value, window: store.state.window ?? Math.max(range()[1] - range()[0], 1e-6) }, "slice level"));
  window.input.placeholder = level.input.placeholder = "auto";
  const field = (name: string, input: HTMLElement): HTMLElement => h("label", {}, h("span", {}, name), input);
  const element = section("Slices", true, h("div", { class: "fields thirds" }, ...at.map((each, axis) => field(AXIS_NAMES[axis] as string, each.input))),
    h("div", { class: "fields" }, field("Window", window.input), field("Level", level.input), button("Automatic", null, () => store.update({ window: null, level: null }, "automatic"), "quiet")));
  const update = (): void => {
    const { state } = store, volume = context.volume();
    element.hidden = state.layout !== "quad" || !volume;
    if (!volume) return;
    at.forEach((each, i) => each.set((state.crosshair ?? volume.centre)[i] as number));
    if (state.window !== null) window.set(state.window); else window.input.value = "";
    if (state.level !== null) level.set(state.level); else level.input.value = "";
  };
  store.subscribe(update, ["layout", "crosshair", "window", "level"]);
  context.onVolume(update);
  update();
  return element;
}
