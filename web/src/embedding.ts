// What viewers in other pages need.
import style from "../page.css";
import { GatewayConnection } from "./connection";
import { h } from "./dom";
import type { Theme } from "./mount";

// A shadow root with the viewer's style.
export function styledRoot(element: HTMLElement): ShadowRoot {
  const root = element.attachShadow({ mode: "open" });
  if ("adoptedStyleSheets" in root) { // which a strict policy of the page allows, too
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(style);
    root.adoptedStyleSheets = [sheet];
  } else (root as ShadowRoot).append(h("style", {}, style));
  return root;
}

// As light as what is behind the element.
export function themeAround(element: Element): Theme {
  for (let at: Element | null = element; at; at = at.parentElement) {
    const [r = 0, g = 0, b = 0, a = 1] = (getComputedStyle(at).backgroundColor.match(/[\d.]+/g) ?? []).map(Number);
    if (a > 0.5) return 0.3 * r + 0.6 * g + 0.1 * b > 127 ? "light" : "dark";
  }
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

// Of an address as `slabstream view` prints it, with the token behind '#'; or of that of its interface, api/v1. Throws if it is none.
export function gatewayAt(address: string, token = ""): GatewayConnection {
  const base = new URL(address, document.baseURI), told = /(?:^|[#&])token=([^&]*)/.exec(base.hash);
  base.pathname = base.pathname.replace(/(\/api\/v1)?\/?$/, "/");
  return new GatewayConnection(base, token || decodeURIComponent(told?.[1] ?? base.hash.slice(1)));
}

// Calls `run` soon after each call, but at most once in so many ms.
export function atMostEach(ms: number, run: () => void): { call(): void; cancel(): void } {
  let timer = 0, last = -Infinity;
  return {
    call: () => { timer ||= setTimeout(() => { timer = 0; last = performance.now(); run(); }, Math.max(0, last + ms - performance.now())); },
    cancel: () => clearTimeout(timer),
  };
}
export const STATE_MS = 100; // between two messages about the state
