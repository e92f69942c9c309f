// The channels of the dataset that is shown: which of them show, how they look, and what the service is asked for.
import { type Dataset, NAMES, type Options, type Source } from "./api";
import { shownDataset } from "./offers";
import type { State } from "./state";
import { timeOptions } from "./times";

export interface Channel { key: string; name: string; color: string; window: readonly [number, number] | null; shown: boolean } // `key`: in requests and links

export const GAMMAS = [0.01, 100] as const;
export const AS_SAID: Pick<State, "channels" | Looks | "blend"> = { channels: null, channelColors: {}, channelRanges: {}, channelGammas: {}, channelOpacities: {}, blend: "auto" };

// What the service takes where a file says nothing: colours by number, and how many show.
const COLORS = ["#ff00ff", "#00ff00", "#00ffff", "#ffff00", "#ff0000", "#3366ff", "#ff8000", "#ffffff"] as const;
const SHOWN_UNASKED = 4, MOST_SHOWN = 16;

export type Looks = "channelColors" | "channelRanges" | "channelGammas" | "channelOpacities";
const TEXTS: { [K in Looks]: (value: State[K][string]) => string } = { channelColors: String, channelRanges: range => range.join(":"), channelGammas: String, channelOpacities: String };

// Those of a dataset that has several, else none.
export function channelsOf({ fields = [] }: Dataset): readonly Channel[] {
  let free = fields.some(field => field.channel && (field.color || field.window || !field.shown)) ? MOST_SHOWN : SHOWN_UNASKED;
  const all = fields.flatMap(({ name, channel, color, window, shown }, i) => (channel ? [{
    key: fields.some((other, j) => j !== i && other.name === String(i)) ? name : String(i), // a name counts before a number
    name: name || `Channel ${i}`, color: color ?? (COLORS[i % COLORS.length] as string), window, shown: shown && free-- > 0,
  }] : []));
  return all.length > 1 ? all : [];
}

let known: Dataset | null = null, ofKnown: readonly Channel[] | null = null;
// Of the shown dataset; null: they are not known yet.
export function channels(): readonly Channel[] | null {
  const dataset = shownDataset();
  if (dataset !== known) { known = dataset; ofKnown = dataset && channelsOf(dataset); }
  return ofKnown;
}

// What the user says of a channel, and records where something else is said.
export const ownOf = <T>(record: Readonly<Record<string, T>>, { key, name }: Channel): T | undefined => record[key] ?? record[name];
export function withOwn<T>(record: Readonly<Record<string, T>>, { key, name }: Channel, value: T | undefined): Readonly<Record<string, T>> {
  const rest = Object.fromEntries(Object.entries(record).filter(([of]) => of !== key && of !== name));
  return value === undefined ? rest : { ...rest, [key]: value };
}

// A list of channels that the dataset has not says nothing.
export function shownChannels({ channels: wanted }: State): readonly Channel[] {
  const all = channels() ?? [], listed = all.filter(({ key, name }) => wanted?.includes(key) || wanted?.includes(name));
  return listed.length > 0 || wanted?.length === 0 ? listed : all.filter(({ shown }) => shown);
}
export const colorOf = (state: State, channel: Channel): string => ownOf(state.channelColors, channel) ?? channel.color;
export const isAsSaid = (state: State): boolean => state.channels === null && state.blend === "auto" && (Object.keys(TEXTS) as Looks[]).every(look => Object.keys(state[look]).length === 0);

const hasChannels = (state: State): boolean => (channels() ? channels()?.length !== 0 : !isAsSaid(state));
// Whether the transfer function can be that of what shows: it is one function, and channels have looks of their own.
export const takesFunction = (state: State): boolean => !hasChannels(state) || (channels() ? shownChannels(state) : state.channels ?? []).length === 1;

function lookOptions(state: State, look: Looks, shown: readonly Channel[]): Options {
  const write = TEXTS[look] as (value: unknown) => string, record: Readonly<Record<string, unknown>> = state[look];
  const each = channels() ? shown.flatMap(channel => { const own = ownOf(record, channel); return own === undefined ? [] : [[channel.key, own] as const]; }) : Object.entries(record);
  return each.length > 0 ? { [NAMES[look]]: each.map(([key, value]) => `${key}=${write(value)}`).join(",") } : {};
}

// `own`: options of the transfer function and the like. They count if they say something, and then the only channel has no other look.
export function channelOptions(state: State, own: Options): Options {
  if (!hasChannels(state)) return own;
  const known = channels(), shown = shownChannels(state), keys = known ? shown.map(channel => channel.key) : state.channels, first = known?.[0]?.key ?? "0";
  if (keys?.length === 0) return { [NAMES.channels]: first, [NAMES.channelOpacities]: `${first}=0` }; // nothing shows
  const which = state.channels && keys ? { [NAMES.channels]: keys.join(",") } : {};
  const says = takesFunction(state) && Object.entries(own).some(([name, value]) => name !== "opacity-distance" && value !== "auto");
  if (says) return { ...which, ...own };
  return Object.assign(which, ...(Object.keys(TEXTS) as Looks[]).map(look => lookOptions(state, look, shown)), state.blend !== "auto" && { [NAMES.blend]: state.blend });
}

// What questions are about: a channel, or the first one that shows.
export function sourceOf(state: State, channel: Channel | undefined = shownChannels(state)[0]): Source {
  return { dataset: state.dataset, ...(channel && { [NAMES.field]: channel.key }), ...timeOptions(state) };
}
