// The gateway through the kernel of a notebook: a widget's custom messages, which the kernel relays to the gateway beside it.
//   {ask: id, method, path} [body]   -> {answer: id, status, type} [body]       {cancel: id}
//   {open: id}                       -> {opened: id}                            {alive: [id, ...]} each 2 s: streams of a page that is gone end
//   {send: id, text, more: [text]}      {heard: id, text}, or {heard: id} [bytes]
//   {close: id}                      -> {closed: id, reason}
import type { Connection, Stream } from "./connection";

type Bytes = ArrayBuffer | ArrayBufferView;
// What anywidget gives: traits of an object in the kernel, and messages.
export interface Model {
  get(trait: string): unknown;
  set(trait: string, value: unknown): void;
  save_changes(): void;
  on(event: string, listener: (...given: never[]) => void): void;
  off(event: string, listener: (...given: never[]) => void): void;
  send(message: object, callbacks?: undefined, buffers?: ArrayBuffer[]): void;
}
interface Message { answer?: number; opened?: number; heard?: number; closed?: number; status?: number; type?: string; text?: string; reason?: string }
type Listener = (message: Message, bytes: ArrayBuffer) => void;

const ALIVE_MS = 2000;
// A kernel answers within 150 s, if only by an error (python/slabstream/relay.py), unless a cell keeps it busy. A movie is sent when it is whole.
const ANSWER_MINUTES = 3, MOVIE_MINUTES = 60;
const VIEW_MS = 50, UNANSWERED_MS = 250;
const VIEW = /^\{"type":"view"/, ACK = /^\{"type":"ack"/;

const bufferOf = (bytes: Bytes | undefined): ArrayBuffer =>
  bytes === undefined ? new ArrayBuffer(0) : bytes instanceof ArrayBuffer ? bytes : (bytes.buffer as ArrayBuffer).slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);

class KernelStream implements Stream {
  onopen = (): void => undefined;
  onmessage = (_: string | ArrayBuffer): void => undefined;
  onclose = (_: string): void => undefined;
  isOpen = false;
  private view: string | null = null; // that waits
  private viewAt = -Infinity; // when the last one was sent
  private answered = true; // by a picture, which was acknowledged
  private timer = 0;

  constructor(private readonly tell: (message: object) => void, private readonly id: number, private readonly ended: () => void) { tell({ open: id }); }

  hear({ opened, closed, text, reason }: Message, bytes: ArrayBuffer): void {
    if (opened !== undefined) { this.isOpen = true; this.onopen(); }
    else if (closed === undefined) this.onmessage(text ?? bytes);
    else { this.end(); this.onclose(reason ?? ""); }
  }

  // Each message keeps a notebook busy, and the newest view replaces those before it. So one goes with the acknowledgement of a picture, and not
  // sooner than 50 ms after the last one; or later, if no picture comes.
  send(text: string): void {
    if (VIEW.test(text)) { this.view = text; return this.flush([]); }
    if (ACK.test(text)) this.answered = true;
    this.flush([text]);
  }

  private flush(texts: string[]): void {
    const rest = this.viewAt + (this.answered ? VIEW_MS : UNANSWERED_MS) - performance.now();
    clearTimeout(this.timer);
    if (this.view !== null && rest <= 0) {
      texts.push(this.view);
      this.view = null;
      this.viewAt = performance.now();
      this.answered = false;
    } else if (this.view !== null) this.timer = setTimeout(() => this.flush([]), rest);
    const [text, ...more] = texts;
    if (text !== undefined) this.tell({ send: this.id, text, ...(more.length > 0 && { more }) });
  }

  close(): void { this.tell({ close: this.id }); this.end(); }
  private end(): void { this.isOpen = false; clearTimeout(this.timer); this.ended(); }
}

export class KernelConnection implements Connection {
  private readonly listeners = new Map<number, Listener>(); // by ids of requests and streams
  private readonly streams = new Set<number>();
  private readonly gone = new AbortController();
  private readonly timer = setInterval(() => { if (this.streams.size > 0) this.tell({ alive: [...this.streams] }); }, ALIVE_MS);

  constructor(private readonly model: Model) { model.on("msg:custom", this.hear); }

  end(): void {
    this.gone.abort();
    clearInterval(this.timer);
    this.model.off("msg:custom", this.hear);
  }

  async request(path: string, query: Record<string, string>, { method = "GET", body, signal }: { method?: string; body?: BodyInit | null; signal?: AbortSignal }): Promise<Response> {
    const bytes = body === null || body === undefined ? [] : [await new Response(body).arrayBuffer()], text = new URLSearchParams(query).toString();
    const minutes = path === "turntable.mp4" ? MOVIE_MINUTES : ANSWER_MINUTES;
    return new Promise((resolve, reject) => {
      const waiting = new AbortController(), nobody = new DOMException("Nobody waits for the answer.", "AbortError");
      const end = (): void => { this.listeners.delete(id); clearTimeout(timer); waiting.abort(); };
      const giveUp = (why: Error): void => { end(); this.tell({ cancel: id }); reject(why); };
      if (signal?.aborted || this.gone.signal.aborted) return reject(nobody);
      const id = this.listen(({ status = 502, type = "" }, answer) => {
        end();
        resolve(new Response(status === 204 ? null : answer, { status, headers: { "Content-Type": type } }));
      });
      const timer = setTimeout(() => giveUp(new Error(`The kernel has not answered for ${minutes} minutes. It is busy with a cell, or gone.`)), minutes * 60_000);
      for (const each of [signal, this.gone.signal]) each?.addEventListener("abort", () => giveUp(nobody), { signal: waiting.signal });
      try { this.model.send({ ask: id, method, path: text ? `${path}?${text}` : path }, undefined, bytes); } catch (error) { giveUp(error as Error); }
    });
  }

  open(): Stream {
    const id = this.listen((message, bytes) => stream.hear(message, bytes));
    this.streams.add(id);
    const stream = new KernelStream(message => this.tell(message), id, () => { this.listeners.delete(id); this.streams.delete(id); });
    return stream;
  }

  // Tabs that show the same widget hear each other's messages, so no two may choose the same id.
  private listen(listener: Listener): number {
    const id = Math.floor(Math.random() * Number.MAX_SAFE_INTEGER);
    this.listeners.set(id, listener);
    return id;
  }

  // A kernel that is gone is one that does not answer.
  private tell(message: object): void {
    try { this.model.send(message); } catch { /* the stream falls silent, and is opened again */ }
  }

  private readonly hear = (message: Message, buffers?: Bytes[]): void => {
    const id = message.answer ?? message.opened ?? message.heard ?? message.closed;
    if (id !== undefined) this.listeners.get(id)?.(message, bufferOf(buffers?.[0]));
  };
}
