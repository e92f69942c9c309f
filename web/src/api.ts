// Requests to the gateway.
import type { Connection } from "./connection";
import type { BoxStatistics, Profile } from "./measure";
import type { Vec3 } from "./vec";

export type Options = Record<string, unknown>; // by the names of the command line

export class ApiError extends Error {
  constructor(readonly status: number, message: string) { super(message); }
}

// What requests call fields and times; the link, too.
export const NAMES = {
  channels: "channel", channelTransfers: "channel-transfer", channelColors: "channel-color", channelRanges: "channel-range", channelGammas: "channel-gamma", channelOpacities: "channel-opacity", blend: "blend", time: "time", field: "field",
} as const;
export interface Field { name: string; channel: boolean; labels?: boolean; color: string | null; window: [number, number] | null; shown: boolean }
export interface Times { count: number; step?: number | null; unit?: string } // `step`: from a time to the next one, if it is known
export type Source = Record<string, string>; // of what is asked about: the dataset, and which of its fields and times

export interface Level { size: [number, number, number]; spacing: [number, number, number]; voxel_bytes: number }
export interface Parameter { name: string; value: number; least: number; most: number }
export interface Simulation { time: number; simulated: number; parameters: Parameter[] } // time: a number
export interface Dataset {
  name: string; state: "unloaded" | "loading" | "ready" | "failed"; error?: string;
  size?: [number, number, number]; type?: string; spacing?: [number, number, number]; memory_bytes?: number;
  layers?: { labels: number | boolean }; cells?: number; levels?: Level[]; range?: { min: number; max: number };
  fields?: Field[]; times?: Times; field?: number; time?: number; // absent: one field, one time
  is_shape?: boolean; shape?: { kind: "mesh" | "lines" | "points" }; // `shape`: of one that is ready
  simulation?: Simulation; // whose processes hold the voxels
}
export interface Histogram { range: [number, number]; counts: number[]; percentiles: Record<string, number> }
export interface JointHistogram { range: [number, number]; steepest: number; values: number; slopes: number; counts: number[] } // counts[value * slopes + slope], of square roots of slopes
export interface LabelStatistics {
  unit: string; // that volumes are counted in
  labels: { value: number; name: string; volume: number; mean: number | null; deviation: number | null; least: number | null; largest: number | null }[];
}
export interface LabelName { value: number; name: string; color?: string }
export interface Value { inside?: boolean; hit?: boolean; at?: Vec3; voxel?: [number, number, number] | null; value?: number | null; label?: LabelName | null; fields?: { name: string; value: number | null }[]; shape?: string; shape_value?: number | null }

export class Api {
  private readonly missing = new Set<string>();
  refusal = ""; // why the gateway does not take the token, or not any more: nothing is asked from then on
  onRefused = (): void => undefined;

  // `ended`: nobody waits for answers any more.
  constructor(readonly connection: Connection, readonly ended: AbortSignal) {}

  refuse(why: string): void {
    if (this.refusal) return;
    this.refusal = why;
    this.onRefused();
  }

  // Whether the gateway has said that it has no such address.
  lacks(path: string): boolean { return this.missing.has(path); }

  ask = (path: string, fields: Record<string, string> = {}, body?: Options, signal?: AbortSignal): Promise<Response> =>
    this.request(path, fields, body ? { method: "POST", body: JSON.stringify(body) } : {}, signal);

  // Bytes, as they are.
  send = (path: string, fields: Record<string, string>, body: ArrayBuffer | null, signal?: AbortSignal): Promise<Response> =>
    this.request(path, fields, { method: "POST", body }, signal);

  private async request(path: string, fields: Record<string, string>, what: { method?: string; body?: BodyInit | null }, signal?: AbortSignal): Promise<Response> {
    if (this.ended.aborted) throw new DOMException("The viewer is gone.", "AbortError");
    if (this.refusal) throw new ApiError(401, this.refusal);
    const response = await this.connection.request(path, fields, { ...what, ...(signal ? { signal } : {}) });
    if (response.ok) return response;
    const answer = (await response.json().catch(() => null)) as { error?: string } | null;
    const error = new ApiError(response.status, answer?.error ?? `${path}: ${response.status} ${response.statusText}`);
    if (error.status === 401) this.refuse(error.message);
    throw error;
  }

  datasets = async (): Promise<Dataset[]> => ((await (await this.ask("datasets")).json()) as { datasets: Dataset[] }).datasets;
  picture = async (options: Options): Promise<Blob> => (await this.ask("render.png", {}, options)).blob();
  command = async (options: Options): Promise<{ command: string; files: Record<string, string> }> => (await this.ask("command", {}, options)).json();

  // A movie, while it is made.
  turntable = async (options: Options, signal: AbortSignal): Promise<ReadableStreamDefaultReader<Uint8Array>> => {
    const { body } = await this.ask("turntable.mp4", {}, options, signal);
    if (!body) throw new Error("the movie is empty");
    return body.getReader();
  };

  // Older gateways lack these: null.
  access = (): Promise<{ rights: string[] } | null> => this.maybe("access", {});
  histogram = (source: Source): Promise<Histogram | null> => this.maybe("histogram", source);
  jointHistogram = (source: Source): Promise<JointHistogram | null> => this.maybe("joint-histogram", source);
  transfer = (source: Source, transfer: string): Promise<unknown> => this.maybe("transfer", { ...source, transfer });
  labels = (dataset: string): Promise<{ labels: LabelName[]; complete?: boolean } | null> => this.maybe("labels", { dataset });
  value = (source: Source, at: Vec3, signal?: AbortSignal): Promise<Value | null> => this.maybe("value", { ...source, at: at.join(",") }, undefined, signal);
  profile = (source: Source, from: Vec3, to: Vec3): Promise<Profile | null> => this.maybe("profile", { ...source, from: from.join(","), to: to.join(",") });
  statistics = (source: Source, box: string): Promise<BoxStatistics | null> => this.maybe("statistics", { ...source, box });
  labelStatistics = (dataset: string): Promise<LabelStatistics | null> => this.maybe("statistics", { dataset, labels: "true" });
  pick = (options: Options, x: number, y: number, signal?: AbortSignal): Promise<Value | null> => this.maybe("pick", {}, { ...options, x, y }, signal);

  private async maybe<T>(path: string, fields: Record<string, string>, body?: Options, signal?: AbortSignal): Promise<T | null> {
    if (this.missing.has(path)) return null;
    try {
      return (await (await this.ask(path, fields, body, signal)).json()) as T;
    } catch (error) {
      if (!(error instanceof ApiError) || (error.status !== 404 && error.status !== 405)) throw error;
      // A gateway that knows the address says that the dataset is unknown, which the stream of pictures says too.
      if (error.status === 405 || !/dataset/i.test(error.message)) this.missing.add(path);
      return null;
    }
  }
}
