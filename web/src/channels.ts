// The channels and the overlay of the dataset that is shown: which of them show, how they look, and what the service is asked for.
import { type Dataset, NAMES, type Options, type Source } from "./api";
import type { Offers } from "./offers";
import type { State } from "./state";
import { timeOptions } from "./times";
import { type ColorMap, toParaView } from "./transfer";

export interface Channel { key: string; name: string; color: string; window: readonly [number, number] | null; shown: boolean } // `key`: in requests and links

export const GAMMAS = [0.01, 100] as const;
export const AS_SAID: Pick<State, "overlay" | "channels" | Looks | "blend"> = { overlay: false, channels: null, channelTransfers: {}, channelColors: {}, channelRanges: {}, channelGammas: {}, channelOpacities: {}, blend: "auto" };

// What the service takes where a file says nothing: colours by number, and how many show.
const COLORS = ["#ff00ff", "#00ff00", "#00ffff", "#ffff00", "#ff0000", "#3366ff", "#ff8000", "#ffffff"] as const;
const SHOWN_UNASKED = 4, MOST_SHOWN = 16;

export type Looks = "channelTransfers" | "channelColors" | "channelRanges" | "channelGammas" | "channelOpacities";
const TEXTS: { [K in Looks]: (value: State[K][string]) => string } = {
  channelTransfers: transfer => (typeof transfer === "string" ? transfer : JSON.stringify(toParaView(transfer))), channelColors: String, channelRanges: range => range.join(":"), channelGammas: String, channelOpacities: String,
};
const LOOKS = Object.keys(TEXTS) as Looks[];

// Those of a dataset that has several, else none.
export function channelsOf({ fields = [] }: Dataset): readonly Channel[] {
  let free = fields.some(field => field.channel && (field.color || field.window || !field.shown)) ? MOST_SHOWN : SHOWN_UNASKED;
  const all = fields.flatMap(({ name, channel, color, window, shown }, i) => (channel ? [{
    key: fields.some((other, j) => j !== i && other.name === String(i)) ? name : String(i), // a name counts before a number
    name: name || `Channel ${i}`, color: color ?? (COLORS[i % COLORS.length] as string), window, shown: shown && free-- > 0,
  }] : []));
  return all.length > 1 ? all : [];
}

export const OVERLAY: Channel = { key: "overlay", name: "Overlay", color: "#ff4fd8", window: null, shown: false };
export const hasOverlay = (dataset: Dataset | null): boolean => dataset?.fields?.some(({ channel, labels }) => !channel && !labels) ?? false;

const made = new WeakMap<Dataset, readonly Channel[]>(); // so that a channel stays the same object
// Of the shown dataset; null: they are not known yet.
export function channels({ dataset }: Offers): readonly Channel[] | null {
  if (dataset && !made.has(dataset)) made.set(dataset, channelsOf(dataset));
  return dataset && (made.get(dataset) ?? null);
}

// What the user says of a channel, and records where something else is said.
export const ownOf = <T>(record: Readonly<Record<string, T>>, { key, name }: Channel): T | undefined => record[key] ?? record[name];
export function withOwn<T>(record: Readonly<Record<string, T>>, { key, name }: Channel, value: T | undefined): Readonly<Record<string, T>> {
  const rest = Object.fromEntries(Object.entries(record).filter(([of]) => of !== key && of !== name));
  return value === undefined ? rest : { ...rest, [key]: value };
}

// A list of channels that the dataset has not says nothing.
export function shownChannels(offers: Offers, { channels: wanted }: State): readonly Channel[] {
  const all = channels(offers) ?? [], listed = all.filter(({ key, name }) => wanted?.includes(key) || wanted?.includes(name));
  return listed.length > 0 || wanted?.length === 0 ? listed : all.filter(({ shown }) => shown);
}
export const colorOf = (state: State, channel: Channel): string => ownOf(state.channelColors, channel) ?? channel.color;
// What its colour map is: a preset or a function; "": from clear to its colour; "auto": of the overlay, what the service takes.
export const transferOf = (state: State, channel: Channel): string | ColorMap =>
  ownOf(state.channelTransfers, channel) ?? (channel === OVERLAY && !ownOf(state.channelColors, channel) ? "auto" : "");

// `but`: what is said of this one does not count.
const isSaid = (state: State, but = ""): boolean => state.channels !== null || state.blend !== "auto" || LOOKS.some(look => Object.keys(state[look]).some(key => key !== but));
export const isAsSaid = (state: State): boolean => !state.overlay && !isSaid(state);

const hasChannels = (offers: Offers, state: State): boolean => (channels(offers) ? channels(offers)?.length !== 0 : isSaid(state, OVERLAY.key));
// Whether the transfer function can be that of what shows: it is one function, and channels have looks of their own.
export const takesFunction = (offers: Offers, state: State): boolean => !hasChannels(offers, state) || (channels(offers) ? shownChannels(offers, state) : state.channels ?? []).length === 1;

// Any look of the overlay shows it.
function lookOf(state: State, channel: Channel, look: Looks): string | null {
  const own = ownOf(state[look] as Readonly<Record<string, unknown>>, channel), replaced = (look === "channelColors" || look === "channelGammas") && transferOf(state, channel) !== "";
  return own !== undefined && !replaced ? (TEXTS[look] as (value: unknown) => string)(own) : look === "channelOpacities" && channel === OVERLAY ? "1" : null;
}
function looksOf(state: State, shown: readonly Channel[]): Record<string, string> {
  const each = LOOKS.map(look => [NAMES[look], shown.flatMap(channel => { const own = lookOf(state, channel, look); return own === null ? [] : [`${channel.key}=${own}`]; }).join(",")] as const);
  return Object.fromEntries([...each.filter(([, text]) => text !== ""), ...(state.blend === "auto" ? [] : [[NAMES.blend, state.blend] as const])]);
}
// Channels of which a state says something; in order, so that the same is asked once they are known.
const told = (state: State): Channel[] => [...new Set(LOOKS.flatMap(look => Object.keys(state[look])))].filter(key => key !== OVERLAY.key).sort().map(key => ({ key, name: key, color: "", window: null, shown: true }));

// `own`: options of the transfer function and the like. They count if they say something, and then the only channel has no other look.
// `several`: the renderer shows more than one.
export function channelOptions(offers: Offers, state: State, own: Options, several: boolean): Options {
  const known = channels(offers), over = state.overlay && several && (!known || hasOverlay(offers.dataset)) ? [OVERLAY] : [];
  const overlaid = over.length > 0 ? looksOf(state, over) : {};
  if (!hasChannels(offers, state)) return { ...own, ...overlaid };
  const shown = known ? shownChannels(offers, state) : told(state), keys = known ? shown.map(channel => channel.key) : state.channels, first = known?.[0]?.key ?? "0";
  if (keys?.length === 0) return { ...overlaid, [NAMES.channels]: first, [NAMES.channelOpacities]: [`${first}=0`, overlaid[NAMES.channelOpacities]].filter(Boolean).join(",") }; // none shows
  const which = state.channels && keys ? { [NAMES.channels]: keys.join(",") } : {};
  const says = takesFunction(offers, state) && Object.entries(own).some(([name, value]) => name !== "opacity-distance" && value !== "auto");
  return { ...which, ...(says ? { ...own, ...overlaid } : looksOf(state, [...shown, ...over])) };
}

// The fields that show, as requests name them.
export const shownKeys = (offers: Offers, state: State): readonly string[] => {
  const shown = channels(offers)?.length ? shownChannels(offers, state).map(({ key }) => key) : ["0"];
  return state.overlay && hasOverlay(offers.dataset) ? [...shown, OVERLAY.key] : shown;
};

// What questions are about: a channel, or the first one that shows.
export function sourceOf(offers: Offers, state: State, channel: Channel | undefined = shownChannels(offers, state)[0]): Source {
  return { dataset: state.dataset, ...(channel && { [NAMES.field]: channel.key }), ...timeOptions(offers, state) };
}
