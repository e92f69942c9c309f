// What the parts of the page share.
import type { Api } from "./api";
import type { State, Store } from "./state";
import type { Volume } from "./volume";

export interface Context {
  store: Store;
  api: Api;
  volume(): Volume | null;
  onVolume(listener: (volume: Volume | null) => void): void;
  say(message: string, kind?: "note" | "error"): void; // a short message that goes away
}

// Calls it now, and whenever the volume or one of these keys of the state changes.
export function follow({ store, onVolume }: Context, keys: readonly (keyof State)[], update: () => void): void {
  store.subscribe(update, keys);
  onVolume(update);
  update();
}
