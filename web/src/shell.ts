// The frame of a viewer: the bar above, the stage with the pictures, the panel beside it.
import type { Dataset } from "./api";
import { button, choice, iconButton, menu, menuItem } from "./controls";
import { h, put } from "./dom";

export interface Actions {
  dataset(name: string): void; open: (() => void) | null; view(index: number): void; sides(): readonly string[]; reset(): void; layout(quad: boolean): void; machine(): void; panel(): void; theme(): void; help(): void;
  copyLink: ((withToken: boolean) => void) | null; command(): void; screenshot(): void; movie(): void; projection(): void;
}

// In the list of datasets: its name, and what is known of its size.
function entryText({ name, size, levels }: Dataset): string {
  if (!size) return name;
  return `${name} (${size.join(" × ")}${levels && levels.length > 1 ? `, ${levels.length} levels` : ""})`;
}

export class Shell {
  readonly stage: HTMLElement;
  readonly panes = h("div", { class: "panes" });
  readonly panel = h("aside", { class: "panel", "aria-label": "Settings", id: "panel" });
  private readonly datasets = choice("Dataset", [], name => this.actions.dataset(name));
  private readonly layoutButtons: HTMLButtonElement[];
  private readonly machineButton: HTMLButtonElement;
  private readonly panelButton: HTMLButtonElement;
  private names = "";

  // `isPage`: the viewer is all that the page has, so it has the page's landmarks.
  constructor(element: HTMLElement, isPage: boolean, private readonly actions: Actions, status: HTMLElement, banner: HTMLElement, progress: HTMLElement, messages: HTMLElement, readout: HTMLElement, player: HTMLElement, machine: HTMLElement, sending: HTMLElement) {
    this.stage = h(isPage ? "main" : "div", { class: "stage", role: isPage ? null : "group", "aria-label": "Pictures" });
    const { copyLink, open } = actions, views = iconButton("Views", "views", () => undefined);
    const share = button("Share", "link", () => undefined, "share");
    this.layoutButtons = [iconButton("One picture", "single", () => actions.layout(false), "L"), iconButton("With slices", "quad", () => actions.layout(true), "L")];
    this.machineButton = iconButton("Machine panel", "machine", actions.machine, "M");
    this.panelButton = iconButton("Settings", "panel", actions.panel, "P");
    for (const each of this.layoutButtons) each.classList.add("layout-button"); // a narrow page has them in menus
    this.machineButton.classList.add("machine-button");
    this.panelButton.setAttribute("aria-controls", "panel");
    const header = h(isPage ? "header" : "div", { class: "bar" }, isPage && h("h1", { class: "brand" }, h("img", { src: "assets/icon.svg", alt: "", width: 20, height: 20 }), h("span", {}, "Slabstream")), this.datasets.element, open && iconButton("Open a file", "open", open, "F"),
      h("div", { class: "group", role: "group", "aria-label": "View" },
        menu(views, "Views", () => [...actions.sides().map((name, i) => menuItem(name, String(i + 1), () => actions.view(i))), h("hr"), menuItem("Reset the view", "R", actions.reset), menuItem("Parallel or perspective", "O", actions.projection), menuItem("Slices beside the picture", "L", () => actions.layout(this.panes.dataset["layout"] !== "quad")), menuItem("Machine panel", "M", actions.machine)]),
        iconButton("Reset the view", "reset", actions.reset, "R")),
      h("div", { class: "group", role: "group", "aria-label": "Layout" }, ...this.layoutButtons, this.machineButton),
      h("span", { class: "space" }), readout, status,
      h("div", { class: "group", role: "group", "aria-label": "Page" },
        menu(share, "Share", () => [...(copyLink ? [menuItem("Copy link", "C", () => copyLink(false)), menuItem("Copy link with access", "", () => copyLink(true))] : []), menuItem("Command…", "K", actions.command), menuItem("Save picture…", "S", actions.screenshot), menuItem("Save movie…", "V", actions.movie), menuItem("Help", "?", actions.help)]),
        iconButton("Light or dark", "theme", actions.theme), iconButton("Help", "help", actions.help, "?"), this.panelButton));
    this.datasets.element.classList.add("dataset");
    this.stage.append(h("div", { class: "canvas-area" }, progress, this.panes, banner, sending, messages), player, machine);
    element.replaceChildren(h("a", { class: "skip", href: "#", onclick: (event: Event) => { event.preventDefault(); this.panes.querySelector("canvas")?.focus(); } }, "Skip to the picture"), header, this.stage, this.panel);
  }

  showDatasets(list: readonly Dataset[], current: string): void {
    const entries = list.map(d => [d.name, entryText(d)] as const), names = JSON.stringify([entries, current]);
    if (names === this.names) return;
    this.names = names;
    const known = list.some(d => d.name === current) || current === "" ? entries : [[current, current] as const, ...entries];
    this.datasets.fill(known);
    this.datasets.set(current);
  }

  showLayout(quad: boolean, machine: boolean): void {
    put(this.panes, "data-layout", quad ? "quad" : "single");
    this.layoutButtons.forEach((each, i) => put(each, "aria-pressed", String(quad === (i === 1))));
    put(this.machineButton, "aria-pressed", String(machine));
  }

  get panelOpen(): boolean { return !this.panel.hidden; }
  setPanel(open: boolean): void {
    this.panel.hidden = !open;
    this.panelButton.setAttribute("aria-expanded", String(open));
  }
}
