// What the parts of a viewer share.
import type { Api, Value } from "./api";
import type { Offers } from "./offers";
import type { State, Store } from "./state";
import type { Volume } from "./volume";

export interface Context {
  store: Store;
  api: Api;
  offers: Offers;
  element: HTMLElement; // in which all of the viewer lies
  ended: AbortSignal; // the viewer is gone: what listens outside of its element stops
  volume(): Volume | null;
  onVolume(listener: (volume: Volume | null) => void): void;
  say(message: string, kind?: "note" | "error"): void; // a short message that goes away
  takesWheel(): boolean; // else the wheel scrolls what is around the viewer
  picked?: ((value: Value) => void) | undefined; // somebody clicked there
}

// Calls it now, and whenever the volume or one of these keys of the state changes.
export function follow({ store, onVolume }: Context, keys: readonly (keyof State)[], update: () => void): void {
  store.subscribe(update, keys);
  onVolume(update);
  update();
}
