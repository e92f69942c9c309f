// Elements, in one call each.
type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | null | undefined | ((event: never) => void)>;

function fill(element: Element, attributes: Attributes, children: Child[]): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value as EventListener);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, String(value));
  }
  element.append(...(children.filter(child => child !== null && child !== undefined && child !== false) as (Node | string)[]));
}

export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  fill(element, attributes, children);
  return element;
}

export function svg<K extends keyof SVGElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): SVGElementTagNameMap[K] {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  fill(element, attributes, children);
  return element;
}

// Writes only what differs: the browser styles and lays out again after any write.
export function put(element: Element, name: string, value: string | boolean): void {
  if (typeof value === "boolean") { if (element.hasAttribute(name) !== value) element.toggleAttribute(name, value); }
  else if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}
export function putText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

const ICONS = {
  help: "M8 11.8v.01M6.2 6.2a1.8 1.8 0 1 1 2.6 1.6c-.6.3-.8.7-.8 1.4M14 8A6 6 0 1 1 2 8a6 6 0 0 1 12 0z",
  link: "M6.7 9.3a2.6 2.6 0 0 0 3.7 0l2.3-2.3a2.6 2.6 0 0 0-3.7-3.7l-.8.8M9.3 6.7a2.6 2.6 0 0 0-3.7 0L3.3 9A2.6 2.6 0 0 0 7 12.7l.8-.8",
  camera: "M2.5 5.5h2.3l1-1.7h4.4l1 1.7h2.3v7h-11zM8 11a2 2 0 1 0 0-4 2 2 0 0 0 0 4z",
  panel: "M2.5 3.5h11v9h-11zM10 3.5v9",
  theme: "M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11",
  single: "M2.5 3.5h11v9h-11z",
  quad: "M2.5 3.5h11v9h-11zM8 3.5v9M2.5 8h11",
  machine: "M2.5 4h6M10.5 4h3M2.5 8h3M7.5 8h6M2.5 12h8M12.5 12h1",
  reset: "M3 8a5 5 0 1 0 1.6-3.7L3 5.8M3 3v2.8h2.8",
  undo: "M3 6.5h6.5a3 3 0 0 1 0 6H6M5.5 4 3 6.5 5.5 9",
  redo: "M13 6.5H6.5a3 3 0 0 0 0 6H10M10.5 4 13 6.5 10.5 9",
  more: "M3.5 8h.01M8 8h.01M12.5 8h.01",
  close: "m4 4 8 8M12 4l-8 8",
  add: "M8 3v10M3 8h10",
  remove: "M3 8h10",
  save: "M8 2.5v7.5M5 7.2 8 10l3-2.8M3 13.5h10",
  open: "M8 10.5V3M5 5.8 8 3l3 2.8M3 13.5h10",
  copy: "M5.5 5.5h8v8h-8zM10.5 5.5v-3h-8v8h3",
  eye: "M1.5 8S4 3.8 8 3.8 14.5 8 14.5 8 12 12.2 8 12.2 1.5 8 1.5 8zM8 9.8a1.8 1.8 0 1 0 0-3.6 1.8 1.8 0 0 0 0 3.6z",
  play: "M5 3v10l8-5z",
  pause: "M5.5 3.5v9M10.5 3.5v9",
  back: "M4.5 3.5v9M11.5 3.5v9L6.5 8z",
  forth: "M11.5 3.5v9M4.5 3.5v9l5-4.5z",
  loop: "M4 6a4.5 4.5 0 0 1 8-.5M12 3v2.8H9.2M12 10a4.5 4.5 0 0 1-8 .5M4 13v-2.8h2.8",
  live: "M8 9.3a1.3 1.3 0 1 0 0-2.6 1.3 1.3 0 0 0 0 2.6zM4.8 11.2a4.5 4.5 0 0 1 0-6.4M11.2 4.8a4.5 4.5 0 0 1 0 6.4M2.8 13a7 7 0 0 1 0-10M13.2 3a7 7 0 0 1 0 10",
  views: "M8 2 13.5 5v6L8 14 2.5 11V5zM2.5 5 8 8l5.5-3M8 8v6",
} as const;
export type IconName = keyof typeof ICONS;

export const icon = (name: IconName): SVGElement => svg("svg", { viewBox: "0 0 16 16", class: "icon", "aria-hidden": "true" }, svg("path", { d: ICONS[name] }));

// Few digits, and a real minus.
export function shown(x: number, digits = 4): string {
  if (!Number.isFinite(x)) return "–";
  const size = Math.abs(x);
  const text = size !== 0 && (size >= 1e7 || size < 1e-4) ? x.toExponential(2) : String(Number(x.toPrecision(digits)));
  return text.replace("-", "−");
}

export function bytes(n: number): string {
  if (n < 1000) return `${n} B`;
  const units = ["kB", "MB", "GB", "TB"];
  let value = n / 1000, unit = 0;
  while (value >= 1000 && unit < 3) { value /= 1000; unit += 1; }
  return `${value < 10 ? value.toFixed(1) : value.toFixed(0)} ${units[unit] as string}`;
}

export function download(name: string, data: Blob): void {
  const link = h("a", { href: URL.createObjectURL(data), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

export async function copyText(text: string): Promise<void> {
  if (navigator.clipboard) return navigator.clipboard.writeText(text);
  const area = h("textarea", { class: "offscreen" }, text); // plain http, off this machine
  document.body.append(area);
  area.select();
  document.execCommand("copy");
  area.remove();
}
