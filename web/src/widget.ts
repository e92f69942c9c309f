// The module for other places than the gateway's own page: a notebook's widget, as anywidget renders it, and the element <slab-view>.
import type { Connection } from "./connection";
import { h } from "./dom";
import { defineElement } from "./element";
import { atMostEach, gatewayAt, STATE_MS, styledRoot, themeAround } from "./embedding";
import { KernelConnection, type Model } from "./kernel_connection";
import type { Fields } from "./link";
import { mountViewer } from "./mount";

const REACH_MS = 1500, LOST_MS = 4000;

const isThisMachine = (host: string): boolean => /^(localhost|127\..*|\[::1\])$/.test(host);
const same = (a: Fields, b: Fields): boolean => JSON.stringify(Object.entries(a).sort()) === JSON.stringify(Object.entries(b).sort());

// The gateway at the address, if it answers soon. An address of the kernel's machine means nothing on another one.
async function reached(address: string): Promise<Connection | null> {
  const control = new AbortController(), timer = setTimeout(() => control.abort(), REACH_MS);
  try {
    if (!address || (isThisMachine(new URL(address).hostname) && !isThisMachine(location.hostname))) return null;
    const gateway = gatewayAt(address);
    return (await gateway.request("datasets", {}, { signal: control.signal })).ok ? gateway : null;
  } catch {
    return null;
  } finally {
    clearTimeout(timer);
  }
}

// Traits: _address, _state, _height, _panel, and `channel`, which says how the gateway is reached. JupyterLab hears keys before any element, so an
// attribute tells it which are not its own.
function render({ model, el }: { model: Model; el: HTMLElement }): () => void {
  const place = el.appendChild(h("div", { "data-lm-suppress-shortcuts": "true" })), kernel = new KernelConnection(model);
  let gateway: Connection | null = null, tries = 0, lost = 0;
  let known: Fields | null = null; // the state that the kernel knows, in the viewer's spelling; null: there is no viewer yet
  const said = (): Fields => (model.get("_state") ?? {}) as Fields;

  // The gateway where its address answers, else the kernel. Streams that are open stay.
  const choose = async (address: unknown): Promise<void> => {
    const turn = ++tries, found = await reached(String(address ?? ""));
    if (turn !== tries) return;
    gateway = found;
    model.set("channel", gateway ? "gateway" : "kernel");
    model.save_changes();
  };
  let chosen = choose(model.get("_address"));
  const connection: Connection = {
    request: async (path, query, init) => {
      await chosen;
      const answer = await (gateway ?? kernel).request(path, query, init);
      if (!gateway || answer.status !== 401) return answer;
      chosen = choose(""); // another gateway is at that address now
      return connection.request(path, query, init);
    },
    open: () => (gateway ?? kernel).open(),
  };

  const written = atMostEach(STATE_MS, () => {
    const { state } = viewer;
    if (!known || same(state, known)) return;
    known = state;
    model.set("_state", state);
    model.save_changes();
  });
  const viewer = mountViewer(styledRoot(place), connection, said(), {
    isPage: false, panel: model.get("_panel") === true, theme: () => themeAround(el),
    changed: () => { known ??= viewer.state; written.call(); }, picked: value => model.send({ picked: value }), error: message => model.send({ error: message }),
    reached: isOpen => {
      if (!isOpen) { lost ||= setTimeout(() => { chosen = choose(""); }, LOST_MS); return; }
      clearTimeout(lost);
      lost = 0;
    },
  });
  const listeners = {
    "change:_address": () => { chosen = choose(model.get("_address")); },
    "change:_state": () => {
      if (same(viewer.state, said())) return;
      viewer.update(said());
      if (known) known = viewer.state;
    },
    "change:_height": () => { place.style.height = String(model.get("_height") || ""); },
  };
  for (const [event, listener] of Object.entries(listeners)) model.on(event, listener);
  listeners["change:_height"]();
  return () => {
    for (const [event, listener] of Object.entries(listeners)) model.off(event, listener);
    tries++;
    clearTimeout(lost);
    written.cancel();
    viewer.dispose();
    kernel.end();
    place.remove();
  };
}

defineElement();
export default { render };
