// Section of the panel: the channels of a dataset and its overlay, a row each.
import type { ChannelRanges } from "./channel_ranges";
import { AS_SAID, type Channel, channels, colorOf, GAMMAS, hasOverlay, isAsSaid, type Looks, OVERLAY, ownOf, shownChannels, transferOf, withOwn } from "./channels";
import { type Context, follow } from "./context";
import { button, choice, colorField, iconButton, numberField, section, toggle, undoButtons } from "./controls";
import { h, put, shown, svg } from "./dom";
import type { Histograms } from "./histograms";
import { words } from "./offers";
import { histogramPath, Scale } from "./plot";
import { drawMarks, editPoints, onWidth, placeIn } from "./point_gestures";
import { LOOK, type State } from "./state";
import { clamp } from "./vec";

const HEIGHT = 64, CURVE_STEPS = 24, KEY_STEPS = 100;
const ENDS = ["darkest", "brightest"] as const;
const OWN = "own"; // a function from a link

interface Row { element: HTMLElement; refresh(): void }

// A histogram with two handles: values up to the first one are clear, from the second one on they have the channel's full colour.
function rangePlot({ store }: Context, ranges: ChannelRanges, channel: Channel): Row {
  const plot = svg("svg", { class: "plot", role: "group", "aria-label": `Range of ${channel.name}`, height: HEIGHT }), bars = svg("path", { class: "of-channel" }), curve = svg("path", { class: "curve" }), marks = svg("g");
  const element = h("div", { class: "plot-frame" }, plot);
  let selected = 0, width = 280;
  plot.append(bars, curve, marks);
  const scale = (): Scale => new Scale(ranges.domain(channel), width, HEIGHT);
  const choose = (mark: SVGElement): void => { selected = Number(mark.dataset["index"]); };
  const nothing = (): void => undefined; // there are two, always
  editPoints(plot, {
    choose, dragTo: event => ranges.move(channel, selected, scale().value(placeIn(plot, width, event)[0])), add: nothing, remove: nothing,
    step: right => { const [from, to] = ranges.domain(channel); if (right !== 0) ranges.move(channel, selected, (ranges.of(channel)[selected] as number) + (right * (to - from)) / KEY_STEPS); },
  });
  const refresh = (): void => {
    const [low, high] = ranges.of(channel), histogram = ranges.histogram(channel), to = scale(), color = colorOf(store.state, channel), gamma = ownOf(store.state.channelGammas, channel) ?? 1;
    put(plot, "viewBox", `0 0 ${width} ${HEIGHT}`);
    put(bars, "d", histogram ? histogramPath(histogram, to) : "");
    put(bars, "fill", color);
    const ramp = Array.from({ length: CURVE_STEPS + 1 }, (_, i) => `${to.x(low + ((high - low) * i) / CURVE_STEPS).toFixed(1)} ${to.y(Math.pow(i / CURVE_STEPS, gamma)).toFixed(1)}`);
    put(curve, "d", `M${to.x(to.domain[0])} ${to.y(0)}L${ramp.join("L")}L${to.x(to.domain[1])} ${to.y(1)}`);
    drawMarks(marks, "circle", [low, high].map((value, i) => ({
      cx: to.x(value), cy: to.y(i), r: 5.5, "data-index": i, class: "point", fill: color, "aria-label": `${channel.name}, ${ENDS[i] as string} value`,
      "aria-valuenow": value, "aria-valuemin": to.domain[0], "aria-valuemax": to.domain[1], "aria-valuetext": shown(value),
    })), choose);
  };
  onWidth(element, wide => { width = wide; refresh(); });
  return { element, refresh };
}

function channelRow(context: Context, ranges: ChannelRanges, channel: Channel, show: (shown: readonly Channel[], what: string) => void, solo: () => void): Row {
  const { store, offers } = context, { name, key } = channel, isOverlay = channel === OVERLAY;
  const withLook = (look: Looks, value: unknown): Partial<State> => ({ [look]: withOwn(store.state[look] as Readonly<Record<string, unknown>>, channel, value) });
  const set = (look: Looks, value: unknown): void => store.update(withLook(look, value), `${look} ${key}`);
  const factor = (what: string, look: "channelGammas" | "channelOpacities", [low, high]: readonly [number, number]) => numberField(`${what} of ${name}`, value => { const held = clamp(value, low, high); set(look, held === 1 ? undefined : held); }, "0.05");
  const isOn = (): boolean => (isOverlay ? store.state.overlay : shownChannels(offers, store.state).includes(channel)), others = (): readonly Channel[] => shownChannels(offers, store.state).filter(each => each !== channel);
  const eye = iconButton(`Show ${name}`, "eye", () => (isOverlay ? store.update({ overlay: !isOn(), ...(isOn() ? {} : offers.turnTo("fields", store.state.renderer)) }, "overlay") : show(isOn() ? others() : [...others(), channel], "channel")));
  const color = colorField(`Colour of ${name}`, value => set("channelColors", value));
  const auto = button("Auto", null, () => ranges.set(channel, ranges.usual(channel), `auto ${key}`), "quiet"), alone = button("Solo", null, solo, "quiet");
  auto.setAttribute("aria-label", `Auto: range of ${name} from its histogram`);
  alone.setAttribute("aria-label", `Solo: only ${name}`);
  const presets = offers.presetChoices().filter(([preset]) => !offers.hasRegions(preset) && (preset !== "auto" || isOverlay)), first = transferOf(store.state, channel);
  const map = choice(`Colours of ${name}`, [["", "Its colour"], ...presets, ...(typeof first === "string" ? [] : [[OWN, "A function of its own"] as const])], value => store.update({
    ...withLook("channelTransfers", value === "" || value === "auto" ? undefined : value === OWN ? first : value),
    ...(isOverlay && { ...withLook("channelColors", value === "" ? colorOf(store.state, channel) : undefined) }),
  }, `map ${key}`));
  const ends = ["from", "to"].map((end, i) => numberField(`${name}, ${end}`, value => ranges.move(channel, i, value)));
  const gamma = factor("Gamma", "channelGammas", GAMMAS), opacity = factor("Opacity", "channelOpacities", [0, 1]);
  const plot = rangePlot(context, ranges, channel);
  const fields = h("div", { class: "fields fourths" }, ...(["From", "To", "Gamma", "Opacity"] as const).map((text, i) => h("label", {}, h("span", {}, text), ([...ends, gamma, opacity][i] as typeof gamma).input)));
  return {
    element: h("div", { class: "channel", role: "group", "aria-label": name, "data-channel": key }, h("div", { class: "channel-head" }, eye, color.input, h("span", { class: "label-name", title: name }, name), auto, alone), map.element, plot.element, fields),
    refresh: () => {
      const { state } = store, on = isOn(), transfer = transferOf(state, channel);
      put(eye, "aria-pressed", String(on));
      put(alone, "aria-pressed", String(on && others().length === 0));
      alone.hidden = isOverlay;
      color.set(colorOf(state, channel));
      color.input.disabled = gamma.input.disabled = transfer !== "";
      auto.hidden = map.element.hidden = plot.element.hidden = fields.hidden = !on;
      map.set(typeof transfer === "string" ? transfer : OWN);
      if (!on) return;
      ends.forEach((end, i) => end.set(ranges.of(channel)[i] as number));
      gamma.set(ownOf(state.channelGammas, channel) ?? 1);
      opacity.set(ownOf(state.channelOpacities, channel) ?? 1);
      plot.refresh();
    },
  };
}

export function channelsSection(context: Context, ranges: ChannelRanges, histograms: Histograms): HTMLElement {
  const { store, offers } = context, list = h("div", { class: "list" });
  let made: readonly Channel[] = [], rows: readonly Row[] = [], before: State["channels"] = null; // before: what showed before one was alone
  const all = (): readonly Channel[] => channels(offers) ?? [];
  const rowsOf = (): readonly Channel[] => [...all(), ...(hasOverlay(offers.dataset) ? [OVERLAY] : [])];
  const show = (wanted: readonly Channel[], what: string): void => store.update({ channels: all().filter(channel => wanted.includes(channel)).map(channel => channel.key) }, what);
  const solo = (channel: Channel): void => {
    const now = shownChannels(offers, store.state);
    if (now.length === 1 && now[0] === channel) return store.update({ channels: before }, "solo");
    if (now.length > 1) before = store.state.channels;
    show([channel], "solo");
  };
  const blend = choice("Blend", (["auto", "add", "over", "max"] as const).map(each => [each, words(each)] as const), value => store.update({ blend: value as "auto" }, "blend"));
  const legend = toggle("Names in the picture", on => store.update({ colorBar: on }));
  const undo = undoButtons(store), reset = button("As the file says", "reset", () => store.update(AS_SAID, "channels"), "quiet");
  const element = section("Channels", true, list, blend.element, legend.element, h("div", { class: "button-row" }, ...undo.elements, reset));
  const update = (): void => {
    const wanted = rowsOf();
    element.hidden = wanted.length === 0;
    if (element.hidden) return;
    if (made.length !== wanted.length || made.some((channel, i) => channel !== wanted[i])) {
      made = wanted;
      before = null;
      rows = made.map(channel => channelRow(context, ranges, channel, show, () => solo(channel)));
      list.replaceChildren(...rows.map(row => row.element));
    }
    for (const row of rows) row.refresh();
    blend.set(store.state.blend);
    legend.set(store.state.colorBar);
    undo.refresh();
    reset.disabled = isAsSaid(store.state);
  };
  histograms.onChange(update);
  follow(context, [...LOOK, "colorBar"], update);
  return element;
}
