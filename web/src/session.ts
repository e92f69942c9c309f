// One stream of pictures of docs/http.md, with one view that changes. It connects again by itself.
import type { Api, Dataset, Options } from "./api";
import { EXPIRED, MADE_ROOM, type Stream } from "./connection";
import type { Vec3 } from "./vec";
import { VideoPictures } from "./video";

export interface Geometry {
  right: Vec3; up: Vec3; forward: Vec3; target: Vec3; target_depth: number; pixel_size: number;
  projection: "orthographic" | "perspective"; world: string; unit: string; // "voxel", "unknown" or a unit's symbol
}
export interface Span { worker: number; group: number; stage: string; begin_ms: number; end_ms: number }
export interface Statistics {
  latency_ms: number; queued_ms: number; encode_ms: number; round_trip_ms: number; attempts: number; workers: number; groups: number;
  imbalance: number; idle_share: number; missing?: string; bytes: { voxels: number; stored: number; sent: number; images: number; picture: number }; levels: { level: number; boxes: number; voxels: number }[];
  stages_ms: Record<string, number>; plan: Record<string, string>; timeline?: Span[];
}
export interface FrameHeader {
  frame: number; seq: number; final: boolean; type: string; key?: boolean; size: [number, number]; scale: number; coarseness: number; bounds: [number, number, number, number];
  background: [number, number, number, number]; geometry: Geometry; statistics: Statistics;
}
export interface WorkerStatus {
  worker: number; host: string; pid: number; threads: number; silent_ms: number; leaving: boolean;
  memory_bytes: number; cached_bytes: number; fetched_bytes: number; rendered_ranks: number;
}
export interface ServiceStatus {
  service: "ready" | "no-workers" | "gone"; reason: string; workers: WorkerStatus[]; workers_lost: number; queued: number; running: number;
  frames_done: number; datasets: Dataset[];
}
export interface Progress { seq: number; phase: "queued" | "loading" | "running"; queue_position: number; groups_done: number; group_count: number; attempt: number; workers: number; read_percent?: number }

export interface View { picture: "render" | "slice"; timeline: boolean; options: Options }
export interface SentView extends View { seq: number; inputAt: number } // inputAt: of the oldest input that it shows, as performance.now()
export interface Frame { header: FrameHeader; view: SentView; picture: ImageBitmap | null }
export type Reached = "connecting" | "open" | "lost";

export interface SessionEvents {
  // Draws the picture. It is acknowledged when the promise is kept.
  frame(frame: Frame): void;
  status?(status: ServiceStatus): void;
  progress?(progress: Progress): void;
  error?(message: string): void;
  connection?(state: Reached, reason: string): void;
}

const RETRY_MS = [250, 500, 1000, 2000, 4000];
// The gateway says something each second. After such a silence the connection is dead, even if nobody has closed it: a computer that slept, a
// network that changed. A large picture that is announced may take longer, at such a rate.
const SILENCE_MS = 4000, LOOK_MS = 500, LEAST_BYTES_A_MS = 100;
const KEPT_VIEWS = 256;

export class Session {
  private stream: Stream | null = null;
  private seq = 0;
  private attempts = 0;
  private timer = 0;
  private ended = false;
  private rests = false; // another page has the place, until the user wants another view
  private wanted: View | null = null;
  private sent = new Map<number, SentView>();
  private lastSent = "";
  private video = new VideoPictures();
  private drawn: Promise<void> = Promise.resolve(); // when all pictures that have come are drawn
  private silentAt = 0; // when the connection counts as dead, if nothing comes until then
  private lookedAt = 0;
  private readonly looking: number;

  constructor(private readonly api: Api, private readonly events: SessionEvents) {
    this.connect();
    this.looking = setInterval(() => this.look(), LOOK_MS);
    addEventListener("online", this.retryNow);
    document.addEventListener("visibilitychange", this.retryNow);
    api.ended.addEventListener("abort", this.end);
  }

  // The latest view wins; one that equals the last one is not sent.
  show(view: View, inputAt = performance.now()): void {
    this.wanted = view;
    const text = JSON.stringify(view);
    if (text === this.lastSent) return;
    if (this.rests) this.connect();
    if (!this.stream?.isOpen) return;
    this.lastSent = text;
    const seq = ++this.seq;
    this.sent.set(seq, { ...view, seq, inputAt });
    if (this.sent.size > KEPT_VIEWS) this.sent.delete(this.sent.keys().next().value as number);
    this.stream.send(JSON.stringify({ type: "view", seq, ...view, video: this.video.works }));
  }

  // The same view, of a dataset that has another time now.
  again(): void {
    this.lastSent = "";
    if (this.wanted) this.show(this.wanted);
  }

  readonly end = (): void => {
    this.ended = true;
    clearTimeout(this.timer);
    clearInterval(this.looking);
    removeEventListener("online", this.retryNow);
    document.removeEventListener("visibilitychange", this.retryNow);
    this.api.ended.removeEventListener("abort", this.end);
    this.stream?.close();
    this.stream = null;
    this.video.close();
  };

  private readonly retryNow = (): void => {
    if (this.ended || document.hidden || this.stream) return;
    clearTimeout(this.timer);
    this.connect();
  };

  private heard(more = 0): void { this.silentAt = performance.now() + SILENCE_MS + more; }

  // If this page itself has slept, what came meanwhile may still wait to be read: it gets a moment.
  private look(): void {
    const now = performance.now(), late = now - this.lookedAt > 4 * LOOK_MS;
    this.lookedAt = now;
    const { stream } = this;
    if (!stream || now < this.silentAt) return;
    if (late) { this.silentAt = now + 2 * LOOK_MS; return; }
    this.lose(stream, "");
    stream.close();
  }

  private lose(stream: Stream, reason: string): void {
    if (this.stream !== stream) return;
    this.stream = null;
    if (this.ended) return;
    this.events.connection?.("lost", reason);
    if (!this.rests) this.timer = setTimeout(() => this.connect(), RETRY_MS[Math.min(this.attempts++, RETRY_MS.length - 1)]);
  }

  private connect(): void {
    if (this.api.refusal) return;
    this.rests = false;
    this.events.connection?.("connecting", "");
    const stream = this.stream = this.api.connection.open();
    this.video.close();
    this.video = new VideoPictures();
    this.heard();
    stream.onopen = () => {
      if (this.stream !== stream) return;
      this.heard();
      this.attempts = 0;
      this.seq = 0;
      this.sent.clear();
      this.lastSent = "";
      this.events.connection?.("open", "");
      if (this.wanted) this.show(this.wanted);
    };
    stream.onmessage = data => {
      if (this.stream !== stream) return;
      this.heard();
      if (typeof data === "string") this.onText(data);
      else this.drawn = this.onPicture(stream, data, this.drawn);
    };
    stream.onclose = (reason, code) => {
      if (code === EXPIRED) this.api.refuse(reason);
      this.rests = code === MADE_ROOM && this.stream === stream;
      this.lose(stream, reason);
    };
  }

  private onText(text: string): void {
    const message = JSON.parse(text) as { type: string; seq?: number; error?: string; bytes?: number; ping?: number };
    if (message.type === "ping") this.stream?.send(JSON.stringify({ type: "pong", ping: message.ping }));
    else if (message.type === "status") this.events.status?.(message as unknown as ServiceStatus);
    else if (message.type === "progress") this.events.progress?.(message as unknown as Progress);
    else if (message.type === "picture") this.heard((message.bytes ?? 0) / LEAST_BYTES_A_MS);
    else if (message.type === "error" && message.seq === this.seq) this.events.error?.(message.error ?? "");
  }

  // Several pictures may be on their way: they are decoded side by side and drawn one after the other.
  private async onPicture(stream: Stream, message: ArrayBuffer, before: Promise<void>): Promise<void> {
    const n = new DataView(message).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, n))) as FrameHeader;
    const view = this.sent.get(header.seq);
    const came = performance.now();
    const decoded = this.decode(header, new Uint8Array(message, 4 + n)).catch(() => null);
    await before.catch(() => undefined);
    const picture = await decoded;
    if (this.stream !== stream) return picture?.close();
    if (header.type === "video/vp9" && !picture) this.again(); // and from now on without video
    for (const seq of this.sent.keys()) if (seq < header.seq) this.sent.delete(seq);
    try {
      if (view && (picture || header.bounds[2] === 0)) this.events.frame({ header, view, picture });
    } finally {
      picture?.close();
      if (stream.isOpen) stream.send(JSON.stringify({ type: "ack", frame: header.frame, page_ms: performance.now() - came }));
    }
  }

  private async decode(header: FrameHeader, data: Uint8Array): Promise<ImageBitmap | null> {
    const { type } = header;
    if (type === "video/vp9") return this.video.decode(data, header.key === true);
    if (header.bounds[2] === 0) return null;
    // The pixels as they are: no profile of the screen's colours, which would change them.
    const colorSpaceConversion = "none";
    // Sooner there for pictures that move, where the browser has it (WebCodecs): a blob goes through another process.
    if (type === "image/jpeg" && "ImageDecoder" in globalThis) {
      const decoder = new ImageDecoder({ data, type, colorSpaceConversion });
      return decoder.decode().then(({ image }) => image).finally(() => decoder.close());
    }
    return createImageBitmap(new Blob([data], { type }), { colorSpaceConversion });
  }
}
