// How a viewer reaches the gateway: requests, and streams of pictures (docs/http.md).
export interface Stream {
  onopen: () => void;
  onmessage: (data: string | ArrayBuffer) => void;
  onclose: (reason: string, code?: number) => void; // also if it never opened. `code`: of docs/http.md
  readonly isOpen: boolean;
  send(text: string): void; // while it is open
  close(): void;
}

export interface Connection {
  // `path` is below api/v1/. Rejects if no answer comes; every status is an answer.
  request(path: string, query: Record<string, string>, init: { method?: string; body?: BodyInit | null; signal?: AbortSignal }): Promise<Response>;
  open(): Stream; // of api/v1/view
}

export const EXPIRED = 4401, MADE_ROOM = 4408; // close codes

class SocketStream implements Stream {
  onopen = (): void => undefined;
  onmessage = (_: string | ArrayBuffer): void => undefined;
  onclose = (_: string, __?: number): void => undefined;
  private readonly socket: WebSocket;

  constructor(address: URL, token: string) {
    this.socket = new WebSocket(address, ["slabstream.view.v1", `slabstream.token.${token}`]);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.onopen();
    this.socket.onmessage = event => this.onmessage(event.data as string | ArrayBuffer);
    this.socket.onclose = event => this.onclose(event.reason, event.code);
  }

  get isOpen(): boolean { return this.socket.readyState === WebSocket.OPEN; }
  send(text: string): void { this.socket.send(text); }
  close(): void { this.socket.close(); }
}

// The gateway itself. `base`: the address to which api/v1/ is relative.
export class GatewayConnection implements Connection {
  constructor(private readonly base: URL, private readonly token: string) {}

  async request(path: string, query: Record<string, string>, init: RequestInit): Promise<Response> {
    const text = new URLSearchParams(query).toString(), { origin } = location;
    try {
      return await fetch(new URL(`api/v1/${path}${text ? `?${text}` : ""}`, this.base), { ...init, headers: { Authorization: `Bearer ${this.token}` }, cache: "no-store" });
    } catch (error) {
      if (origin === this.base.origin || init.signal?.aborted || !(await this.showsIcon())) throw error;
      throw new Error(`The gateway takes no requests from pages of ${origin}. Start it with --origin ${origin}.`);
    }
  }

  // A browser does not tell a page of another origin why it gets no answer. But it shows pictures, the gateway's own, too.
  private showsIcon(): Promise<boolean> {
    const icon = new Image();
    icon.src = new URL("assets/icon.svg", this.base).href;
    return icon.decode().then(() => true, () => false);
  }

  open(): Stream {
    const address = new URL("api/v1/view", this.base);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    return new SocketStream(address, this.token);
  }
}
