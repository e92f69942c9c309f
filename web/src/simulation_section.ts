// Section of the panel: how far the simulation is whose voxels are shown, and its parameters, which may be changed.
import type { Dataset, Parameter } from "./api";
import type { Context } from "./context";
import { numberField, row, section } from "./controls";
import { h, putText, shown } from "./dom";
import { clamp } from "./vec";

const ECHO_MS = 2500; // after a change: what the gateway tells until then may be older

export function simulationSection({ api, offers, say }: Context): { element: HTMLElement; set(dataset: Dataset | undefined): void } {
  const time = h("output", {}), list = h("div", { class: "list" });
  const element = section("Simulation", true, row("Time", time), list);
  let name = "", made = "", fields: { set(value: number): void }[] = [], changedAt = -Infinity;
  let wanted: Record<string, number> = {}, sending = false;
  // One order at a time, with what was chosen meanwhile.
  const send = async (): Promise<void> => {
    if (sending) return;
    for (sending = true; Object.keys(wanted).length > 0;) {
      const set = Object.entries(wanted).map(([parameter, value]) => `${parameter}=${value}`).join(",");
      wanted = {};
      await api.ask("parameters", {}, { dataset: name, set }).catch((error: Error) => say(error.message, "error"));
    }
    sending = false;
  };
  const field = ({ name: parameter, least, most }: Parameter): { element: HTMLElement; set(value: number): void } => {
    if (!offers.may("steer")) {
      const output = h("output", {});
      return { element: row(parameter, output), set: value => putText(output, shown(value)) };
    }
    const id = `parameter-${parameter}`;
    const change = (value: number): void => {
      const chosen = clamp(value, least, most);
      changedAt = performance.now();
      set(chosen);
      wanted[parameter] = chosen;
      void send();
    };
    const slider: HTMLInputElement = h("input", { type: "range", id, min: least, max: most, step: "any", oninput: () => change(Number(slider.valueAsNumber.toPrecision(4))) });
    const number = numberField(`${parameter}, ${shown(least)} to ${shown(most)}`, change);
    const set = (value: number): void => { slider.value = String(value); number.set(value); };
    return { element: row(parameter, h("span", { class: "slider steered" }, slider, number.input), id), set };
  };
  element.hidden = true;
  return {
    element,
    set: dataset => {
      element.hidden = !dataset?.simulation;
      if (!dataset?.simulation) return;
      const { time: number, simulated, parameters } = dataset.simulation, limits = JSON.stringify([dataset.name, parameters.map(each => ({ ...each, value: 0 }))]);
      putText(time, `${shown(simulated)} (${number})`);
      if (limits !== made) {
        made = limits;
        name = dataset.name;
        const rows = parameters.map(field);
        list.replaceChildren(...rows.map(each => each.element));
        fields = rows;
      } else if (performance.now() < changedAt + ECHO_MS) return;
      parameters.forEach(({ value }, i) => fields[i]?.set(value));
    },
  };
}
