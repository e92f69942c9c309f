// The window with what each label of a dataset holds: volume, mean, deviation, least and largest value.
import type { Context } from "./context";
import { button } from "./controls";
import { dialog } from "./dialogs";
import { copyText, download, h, shown } from "./dom";

export async function labelTable({ api, say, element }: Context, dataset: string): Promise<void> {
  const status = h("p", { role: "status", class: "hint" }, "Measuring…");
  const table = h("div", { class: "label-table", tabindex: 0, role: "region", "aria-label": "Values of labels", hidden: true }), actions = h("div", { class: "dialog-actions", hidden: true });
  dialog(element, "Labels", status, table, actions);
  try {
    const answer = await api.labelStatistics(dataset);
    if (!answer) { status.textContent = "This gateway does not measure labels."; return; }
    const { unit, labels } = answer, number = (x: number | null): HTMLElement => h("td", {}, x === null ? "–" : shown(x));
    const csv = (): Promise<string> => api.ask("statistics", { dataset, labels: "true", format: "csv" }).then(response => response.text());
    const fail = (error: unknown): void => say(error instanceof Error ? error.message : String(error), "error");
    table.replaceChildren(h("table", {},
      h("thead", {}, h("tr", {}, ...["Label", "Name", `Volume, ${unit.replace("^3", "³")}`, "Mean", "Deviation", "Least", "Largest"].map(name => h("th", { scope: "col" }, name)))),
      h("tbody", {}, ...labels.map(({ value, name, volume, mean, deviation, least, largest }) =>
        h("tr", {}, h("td", {}, String(value)), h("td", {}, name), number(volume), number(mean), number(deviation), number(least), number(largest))))));
    actions.replaceChildren(button("Copy", "copy", () => void csv().then(copyText).then(() => { status.textContent = "Copied, as CSV."; }).catch(fail), "quiet"),
      button("Save CSV", "save", () => void csv().then(text => download(`${dataset}-labels.csv`, new Blob([text], { type: "text/csv" }))).catch(fail), "quiet"));
    status.textContent = "";
    table.hidden = actions.hidden = false;
  } catch (error) {
    status.textContent = error instanceof Error ? error.message : String(error);
  }
}
