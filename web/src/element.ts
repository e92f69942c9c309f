// <slab-view src="https://host/render/" token="..." dataset="head" azimuth="30">: a viewer in any web page. Attributes have the names and texts
// of links (link.ts); one that changes moves the view. `panel` opens the settings. Events: slab-state, slab-pick, slab-error.
import { h } from "./dom";
import { atMostEach, gatewayAt, STATE_MS, styledRoot, themeAround } from "./embedding";
import type { Fields } from "./link";
import { type MountedViewer, mountViewer } from "./mount";
import type { SlabViewElement, SlabViewEventMap, SlabViewSettings, SlabViewState } from "../package/slab-view";

const CONNECTION = ["src", "token"];

// A server that renders pages imports the module, too, and has no elements.
const Base = (globalThis.HTMLElement ?? Object) as typeof HTMLElement;

class SlabView extends Base implements SlabViewElement {
  private viewer: MountedViewer | null = null;
  private left: Fields | null = null; // what it showed before it was taken out of the document
  private readonly told = atMostEach(STATE_MS, () => this.tell("slab-state", this.fields));
  private readonly watcher = new MutationObserver(changes => this.follow(changes.map(change => change.attributeName ?? "")));

  connectedCallback(): void {
    if (!this.shadowRoot) styledRoot(this);
    this.watcher.observe(this, { attributes: true });
    this.open(this.left ?? this.said());
  }

  disconnectedCallback(): void {
    this.watcher.disconnect();
    this.close();
  }

  get state(): SlabViewState { return this.fields; }
  set state(settings: SlabViewSettings) {
    const fields = Object.fromEntries(Object.entries(settings).flatMap(([name, value]) => (value === undefined ? [] : [[name, String(value)]])));
    if (this.viewer) this.viewer.update(fields); else this.left = fields;
  }

  private get fields(): Fields { return this.viewer?.state ?? this.left ?? this.said(); }

  private said(): Fields { return Object.fromEntries([...this.attributes].filter(({ name }) => !CONNECTION.includes(name)).map(({ name, value }) => [name, value])); }

  private open(fields: Fields): void {
    const src = this.getAttribute("src");
    try {
      if (!src) throw new Error();
      this.shadowRoot?.replaceChildren();
      this.viewer = mountViewer(this.shadowRoot as ShadowRoot, gatewayAt(src, this.getAttribute("token") ?? ""), fields, {
        isPage: false, panel: this.hasAttribute("panel"), theme: () => themeAround(this),
        changed: () => this.told.call(), picked: value => this.tell("slab-pick", value), error: message => this.tell("slab-error", message),
      });
    } catch {
      const message = `slab-view: src is "${src ?? ""}", must be the address of a gateway`;
      this.shadowRoot?.replaceChildren(h("p", { class: "viewer" }, message));
      this.tell("slab-error", message);
    }
  }

  private close(): void {
    this.told.cancel();
    this.left = this.fields;
    this.viewer?.dispose();
    this.viewer = null;
  }

  private follow(names: readonly string[]): void {
    if (names.some(name => CONNECTION.includes(name))) { this.close(); this.open({ ...this.left, ...this.said() }); return; }
    const fields: Record<string, string> = { ...this.fields };
    for (const name of names) {
      const value = this.getAttribute(name);
      if (value === null) delete fields[name]; else fields[name] = value;
    }
    this.state = fields;
  }

  private tell<K extends keyof SlabViewEventMap>(name: K, detail: SlabViewEventMap[K]["detail"]): void { this.dispatchEvent(new CustomEvent(name, { detail, bubbles: true })); }
}

// A document may load this module several times: each cell of a notebook does.
export function defineElement(): void { if (globalThis.customElements && !customElements.get("slab-view")) customElements.define("slab-view", SlabView); }
