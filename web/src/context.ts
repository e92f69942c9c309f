// What the parts of the page share.
import type { Api } from "./api";
import type { Store } from "./state";
import type { Volume } from "./volume";

export interface Context {
  store: Store;
  api: Api;
  volume(): Volume | null;
  onVolume(listener: (volume: Volume | null) => void): void;
  say(message: string, kind?: "note" | "error"): void; // a short message that goes away
}
