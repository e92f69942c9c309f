// The module for other places than the gateway's own page: a notebook's widget, as anywidget renders it, and the element <slab-view>.
import type { Connection } from "./connection";
import { h } from "./dom";
import { defineElement } from "./element";
import { atMostEach, gatewayAt, STATE_MS, styledRoot, themeAround } from "./embedding";
import { KernelConnection, type Model } from "./kernel_connection";
import type { Fields } from "./link";
import { type MountedViewer, mountViewer } from "./mount";

const REACH_MS = 1500;

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
  const place = el.appendChild(h("div", { "data-lm-suppress-shortcuts": "true" })), root = styledRoot(place);
  let viewer: MountedViewer | null = null, kernel: KernelConnection | null = null, left: Fields | null = null, starts = 0;
  const wanted = (): Fields => (model.get("_state") ?? {}) as Fields;
  const written = atMostEach(STATE_MS, () => {
    if (!viewer || same(viewer.state, wanted())) return;
    model.set("_state", viewer.state);
    model.save_changes();
  });
  const stop = (): void => {
    starts++;
    written.cancel();
    left = viewer?.state ?? left;
    viewer?.dispose();
    kernel?.end();
    viewer = kernel = null;
  };
  const start = async (): Promise<void> => {
    stop();
    const turn = starts, gateway = await reached(String(model.get("_address") ?? ""));
    if (turn !== starts) return;
    model.set("channel", gateway ? "gateway" : "kernel");
    model.save_changes();
    viewer = mountViewer(root, gateway ?? (kernel = new KernelConnection(model)), left ?? wanted(), {
      isPage: false, panel: model.get("_panel") === true, theme: () => themeAround(el),
      changed: () => written.call(), picked: value => model.send({ picked: value }), error: message => model.send({ error: message }),
    });
  };
  const follow = (): void => {
    if (!viewer) left = null;
    else if (!same(viewer.state, wanted())) viewer.update(wanted());
  };
  const resize = (): void => { place.style.height = String(model.get("_height") || ""); };
  const listeners = { "change:_address": (): void => void start(), "change:_state": follow, "change:_height": resize };
  for (const [event, listener] of Object.entries(listeners)) model.on(event, listener);
  resize();
  void start();
  return () => {
    for (const [event, listener] of Object.entries(listeners)) model.off(event, listener);
    stop();
    place.remove();
  };
}

defineElement();
export default { render };
