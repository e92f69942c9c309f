// The controls of the panel. Each shows a value by set() and tells of the user's changes.
import { h, icon, type IconName } from "./dom";
import { rounded } from "./vec";

export interface Control<T> { element: HTMLElement; set(value: T): void }
type Choice = readonly [value: string, label: string];
let ids = 0;
const newId = (): string => `c${++ids}`;

export function button(label: string, name: IconName | null, press: () => void, kind = ""): HTMLButtonElement {
  return h("button", { type: "button", class: `button ${kind}`, onclick: press }, name && icon(name), h("span", {}, label));
}

export function iconButton(label: string, name: IconName, press: () => void, key = ""): HTMLButtonElement {
  return h("button", { type: "button", class: "icon-button", "aria-label": label, title: key ? `${label} (${key})` : label, onclick: press }, icon(name));
}

// Buttons for undo and redo; refresh() says whether there is anything to bring back.
export function undoButtons(store: { undo(): void; redo(): void; readonly canUndo: boolean; readonly canRedo: boolean }): { elements: readonly HTMLElement[]; refresh(): void } {
  const undo = iconButton("Undo", "undo", () => store.undo(), "Ctrl+Z"), redo = iconButton("Redo", "redo", () => store.redo(), "Ctrl+Y");
  return { elements: [undo, redo], refresh: () => { undo.disabled = !store.canUndo; redo.disabled = !store.canRedo; } };
}

export function row(label: string, control: HTMLElement, id = ""): HTMLElement {
  return h("div", { class: "row" }, id ? h("label", { for: id }, label) : h("span", { class: "label" }, label), control);
}

export function choice(label: string, choices: readonly Choice[], change: (value: string) => void): Control<string> & { fill(choices: readonly Choice[]): void } {
  const id = newId();
  const select: HTMLSelectElement = h("select", { id, onchange: () => change(select.value) });
  const fill = (list: readonly Choice[]): void => select.replaceChildren(...list.map(([value, name]) => h("option", { value }, name)));
  fill(choices);
  return { element: row(label, select, id), fill, set: value => { select.value = value; } };
}

export function segmented(label: string, choices: readonly Choice[], change: (value: string) => void): Control<string> & { enable(value: string, on: boolean): void } {
  const name = newId();
  const inputs = choices.map(([value]) => h("input", { type: "radio", name, value, id: `${name}-${value}`, onchange: () => change(value) }));
  const element = h("fieldset", { class: "segmented" }, h("legend", { class: "offscreen" }, label),
    ...choices.map(([value, text], i) => h("span", {}, inputs[i] as HTMLInputElement, h("label", { for: `${name}-${value}` }, text))));
  return {
    element,
    set: value => { for (const input of inputs) input.checked = input.value === value; },
    enable: (value, on) => { for (const input of inputs) if (input.value === value) input.disabled = !on; },
  };
}

export function slider(label: string, low: number, high: number, step: number, text: (value: number) => string, change: (value: number) => void): Control<number> {
  const id = newId();
  const output = h("output", { for: id });
  const input: HTMLInputElement = h("input", { type: "range", id, min: low, max: high, step, oninput: () => { output.value = text(Number(input.value)); change(rounded(Number(input.value))); } });
  return { element: row(label, h("span", { class: "slider" }, input, output), id), set: value => { input.value = String(value); output.value = text(value); } };
}

export function numberField(label: string, change: (value: number) => void, step = "any"): Control<number> & { input: HTMLInputElement } {
  const input: HTMLInputElement = h("input", { type: "number", step, "aria-label": label, inputmode: "decimal", onchange: () => { if (Number.isFinite(input.valueAsNumber)) change(rounded(input.valueAsNumber)); } });
  return { element: input, input, set: value => { if (!input.matches(":focus") || input.valueAsNumber !== value) input.value = String(rounded(value, 5)); } };
}

// The same, and null while it is empty.
export function optionalField(label: string, change: (value: number | null) => void): Control<number | null> & { input: HTMLInputElement } {
  const field = numberField(label, change);
  field.input.placeholder = "Automatic";
  field.input.addEventListener("change", () => { if (field.input.value === "") change(null); });
  return { ...field, set: value => { if (value !== null) field.set(value); else if (!field.input.matches(":focus")) field.input.value = ""; } };
}

// A number that may be left out; then the field shows what it is without.
export function parameterField(label: string, standard: string, [low, high]: readonly [number, number], change: (value: string) => void): Control<string> {
  const id = newId();
  const bound = (x: number): number | null => (Number.isFinite(x) ? x : null);
  const input: HTMLInputElement = h("input", { type: "number", id, step: "any", placeholder: standard || " ", min: bound(low), max: bound(high), inputmode: "decimal", onchange: () => { if (input.checkValidity()) change(input.value); } });
  return { element: row(label, input, id), set: value => { if (!input.matches(":focus") || value === "") input.value = value; } };
}

export function textField(label: string, hint: string, pattern: string, change: (value: string) => void): Control<string> {
  const id = newId();
  const input: HTMLInputElement = h("input", { type: "text", id, placeholder: hint, pattern, spellcheck: "false", autocomplete: "off", onchange: () => { if (input.checkValidity()) change(input.value.trim()); } });
  return { element: row(label, input, id), set: value => { if (!input.matches(":focus")) input.value = value; } };
}

export function colorField(label: string, change: (value: string) => void): Control<string> & { input: HTMLInputElement } {
  const input: HTMLInputElement = h("input", { type: "color", "aria-label": label, oninput: () => change(input.value) });
  return { element: input, input, set: value => { input.value = value; } };
}

export function toggle(label: string, change: (on: boolean) => void): Control<boolean> {
  const id = newId();
  const input: HTMLInputElement = h("input", { type: "checkbox", role: "switch", id, onchange: () => change(input.checked) });
  return { element: h("div", { class: "row toggle" }, h("label", { for: id }, label), input), set: on => { input.checked = on; } };
}

export function section(title: string, open: boolean, ...content: HTMLElement[]): HTMLDetailsElement {
  return h("details", { class: "section", open }, h("summary", {}, h("h2", {}, title)), h("div", { class: "section-body" }, ...content));
}

export function openSection(element: HTMLDetailsElement): void {
  element.open = true;
  element.scrollIntoView({ block: "nearest" });
}

// A menu below a button. It closes with Escape, by a choice, and when the focus goes elsewhere.
export function menu(opener: HTMLButtonElement, label: string, items: () => HTMLElement[]): HTMLElement {
  const list = h("div", { class: "menu", role: "menu", "aria-label": label, hidden: true });
  const holder = h("div", { class: "menu-holder" }, opener, list);
  const outside = (event: Event): void => { if (!event.composedPath().includes(holder)) close(); };
  const close = (): void => { list.hidden = true; opener.setAttribute("aria-expanded", "false"); document.removeEventListener("pointerdown", outside); };
  opener.setAttribute("aria-haspopup", "menu");
  close();
  opener.addEventListener("click", () => {
    if (!list.hidden) return close();
    list.replaceChildren(...items());
    list.hidden = false;
    opener.setAttribute("aria-expanded", "true");
    document.addEventListener("pointerdown", outside);
    list.querySelector<HTMLElement>("[role=menuitem]")?.focus();
  });
  holder.addEventListener("focusout", event => { if (event.relatedTarget instanceof Node && !holder.contains(event.relatedTarget)) close(); });
  list.addEventListener("click", () => { close(); opener.focus(); });
  holder.addEventListener("keydown", event => {
    if (event.key === "Escape" && !list.hidden) { close(); opener.focus(); event.stopPropagation(); }
    const all = [...list.querySelectorAll<HTMLElement>("[role=menuitem]")], at = all.findIndex(item => item.matches(":focus"));
    const to = event.key === "ArrowDown" ? at + 1 : event.key === "ArrowUp" ? at - 1 + all.length : -1;
    if (at >= 0 && to >= 0) { all[to % all.length]?.focus(); event.preventDefault(); event.stopPropagation(); }
  });
  return holder;
}

export const menuItem = (label: string, key: string, press: () => void): HTMLElement =>
  h("button", { type: "button", role: "menuitem", class: "menu-item", onclick: press }, h("span", {}, label), key !== "" && h("kbd", {}, key));

// Rows of a list in the state, made anew only when their number changes, so that the focus stays.
export function rows<T>(make: (index: number) => { element: HTMLElement; set(item: T): void }): { element: HTMLElement; set(items: readonly T[]): void } {
  const element = h("div", { class: "list" });
  let made: { element: HTMLElement; set(item: T): void }[] = [];
  return {
    element,
    set: items => {
      if (made.length !== items.length) { made = items.map((_, i) => make(i)); element.replaceChildren(...made.map(each => each.element)); }
      items.forEach((item, i) => made[i]?.set(item));
    },
  };
}
