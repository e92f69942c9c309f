// Section of the panel: the cross-hair and the window of the slices, by numbers and by names.
import { takesFunction } from "./channels";
import { type Context, follow } from "./context";
import { choice, numberField, optionalField, section, slider } from "./controls";
import { h } from "./dom";
import { words } from "./offers";
import { AXES, AXIS_NAMES, clamp, withAxis } from "./vec";

const AUTOMATIC = "auto", OWN = "own", NO_WINDOW = { window: null, level: null };

export function slicesSection(context: Context): HTMLElement {
  const { store, offers } = context;
  const at = AXES.map(axis => numberField(`Cross-hair, ${AXIS_NAMES[axis]}`, value => {
    const volume = context.volume();
    if (volume) store.update({ crosshair: withAxis(store.state.crosshair ?? volume.centre, axis, clamp(value, volume.low[axis], volume.high[axis])) });
  }));
  const range = (): readonly [number, number] => context.volume()?.range ?? [0, 1];
  const window = optionalField("Window of the slices", value => { if (value === null || value > 0) store.update(value === null ? NO_WINDOW : { window: value, level: store.state.level ?? (range()[0] + range()[1]) / 2 }, "slice window"); });
  const level = optionalField("Level of the slices", value => store.update(value === null ? NO_WINDOW : { level: value, window: store.state.window ?? Math.max(range()[1] - range()[0], 1e-6) }, "slice level"));
  const preset = choice("Window for", [], value => {
    const chosen = offers.namedWindows.find(each => each.name === value);
    if (value !== OWN) store.update({ window: chosen?.width ?? null, level: chosen?.level ?? null }, "slice preset");
  });
  preset.element.title = "Hounsfield units, of CT";
  const inSpace = slider("In the 3-D picture", 0, 1, 0.05, v => (v === 0 ? "Off" : `${Math.round(v * 100)} %`),
    value => store.update({ sliceOpacity: value, ...(value > 0 && offers.turnTo("shapes", store.state.renderer)) }, "slice opacity"));
  const field = (name: string, input: HTMLElement): HTMLElement => h("label", {}, h("span", {}, name), input);
  const windowFields = h("div", { class: "fields" }, field("Window", window.input), field("Level", level.input));
  const element = section("Slices", true, h("div", { class: "fields thirds" }, ...at.map((each, axis) => field(AXIS_NAMES[axis] as string, each.input))),
    preset.element, windowFields, inSpace.element);
  const update = (): void => {
    const { state } = store, volume = context.volume();
    element.hidden = state.layout !== "quad" || !volume;
    preset.element.hidden = windowFields.hidden = !takesFunction(offers, state);
    if (!volume) return;
    const named = offers.namedWindows.find(each => each.width === state.window && each.level === state.level)?.name ?? (state.window === null ? AUTOMATIC : OWN);
    preset.fill([AUTOMATIC, ...offers.namedWindows.map(each => each.name), ...(named === OWN ? [OWN] : [])].map(name => [name, words(name)] as const));
    preset.set(named);
    at.forEach((each, i) => each.set((state.crosshair ?? volume.centre)[i] as number));
    window.set(state.window);
    level.set(state.level);
    inSpace.set(state.sliceOpacity);
    inSpace.element.hidden = !offers.titlesThatCan("shapes");
  };
  follow(context, ["layout", "crosshair", "window", "level", "channels", "sliceOpacity"], update);
  return element;
}
