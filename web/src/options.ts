// The state as options of the gateway, which are those of the command line.
import type { Options } from "./api";
import { channelOptions } from "./channels";
import { boxText, slopeText } from "./link";
import type { Offers } from "./offers";
import { shapeOptions } from "./shapes";
import type { State } from "./state";
import { timeOptions } from "./times";
import { toParaView } from "./transfer";
import type { Vec3 } from "./vec";

// The automatic function stands in for regions that the renderer does not show.
function functionOf(offers: Offers, { map, preset, renderer }: State): unknown {
  if (!offers.can("regions", renderer) && (map ? map.regions : offers.hasRegions(preset))) return "auto";
  return map ? toParaView(map) : preset;
}

function transferOptions(offers: Offers, state: State): Options {
  const options: Options = { transfer: functionOf(offers, state) };
  if (state.range) options["scalar-range"] = state.range.join(":");
  if (state.opacityDistance !== 1) options["opacity-distance"] = state.opacityDistance;
  if (state.slopes.length > 0 && offers.can("gradient-opacity", state.renderer)) options["gradient-opacity"] = slopeText(state.slopes);
  return options;
}

export const labelMode = (offers: Offers, state: State): State["labels"] => (!offers.hasLabels ? "off" : offers.hasLabelsAlone ? "surface" : state.labels);

function labelOptions(offers: Offers, state: State, opacities: boolean): Options {
  const mode = labelMode(offers, state), options: Options = { "label-mode": mode };
  if (mode === "off") return {};
  if (mode !== "surface") options["label-tint"] = state.labelTint;
  else if (state.labelSurface === "smooth" && offers.can("smooth-labels", state.renderer)) options["label-surface"] = "smooth";
  if (state.labelsShown) options["labels-shown"] = state.labelsShown;
  const each = Object.entries(state.labelOpacities);
  if (opacities && each.length > 0) options["label-opacity"] = each.map(([label, opacity]) => `${label}=${opacity}`).join(",");
  return options;
}

// The projection that the renderer draws.
export const projectionOf = (offers: Offers, { projection, renderer }: State): State["projection"] => (offers.can("perspective", offers.fitting(renderer)) ? projection : "orthographic");

// The options of the picture, without its size.
// The planes of the slices, in the 3-D picture.
function planesOf({ crosshair, window, level, sliceOpacity }: State): string[] {
  const look = (sliceOpacity < 1 ? `,opacity=${sliceOpacity}` : "") + (window !== null && level !== null ? `,range=${level - window / 2}:${level + window / 2}` : "");
  return ["x", "y", "z"].map((axis, i) => axis + (crosshair ? `:${axis}=${crosshair[i]}` : "") + look);
}

export function renderOptions(offers: Offers, state: State): Options {
  const renderer = offers.fitting(state.renderer);
  const options: Options = {
    dataset: state.dataset, renderer, background: state.background, projection: projectionOf(offers, state),
    azimuth: state.azimuth, elevation: state.elevation, roll: state.roll, zoom: state.zoom,
    shading: state.shading === "depth-gradient" && !offers.can("depth-shading", renderer) ? "phong" : state.shading,
  };
  if (state.lookAt) options["look-at"] = state.lookAt.join(",");
  else options["fit"] = true;
  for (const { name } of offers.parametersOf(renderer)) if (state.parameters[name] !== undefined) options[name] = state.parameters[name];
  if (offers.can("shadows", renderer)) {
    if (state.shadows > 0) options["shadows"] = state.shadows;
    if (state.ambientOcclusion > 0) options["ambient-occlusion"] = state.ambientOcclusion;
  }
  if (state.lights.length > 0 && (offers.can("lights", renderer) || offers.can("shadows", renderer))) options["light"] = state.lights.map(light => light.join(","));
  const surfaces = offers.can("isosurfaces", renderer) ? state.surfaces : [], look: Options = {};
  if (surfaces.length > 0) look["isovalue"] = surfaces.map(s => `${s.value}:${s.color}:${s.opacity}`).join(",");
  if (offers.can("transfer", renderer) && (surfaces.length === 0 || !state.surfacesAlone)) Object.assign(look, transferOptions(offers, state));
  Object.assign(options, channelOptions(offers, state, look, offers.can("fields", renderer)), timeOptions(offers, state));
  if (state.axes !== "off") options["axes"] = state.axes;
  if (state.clipBox) options["clip-box"] = boxText(state.clipBox);
  if (state.clipPlanes.length > 0) options["clip-plane"] = state.clipPlanes.map(plane => plane.join(","));
  if (state.clipMode !== "keep" && (state.clipBox || state.clipPlanes.length > 0)) options["clip-mode"] = state.clipMode;
  const shapes = offers.can("shapes", renderer) ? shapeOptions(state.shapes) : [];
  if (shapes.length > 0) options["shape"] = shapes;
  if (state.sliceOpacity > 0 && offers.can("shapes", renderer)) options["plane"] = planesOf(state);
  if (offers.can("labels", renderer)) Object.assign(options, labelOptions(offers, state, true));
  return options;
}

export function sliceOptions(offers: Offers, state: State, plane: string, at: Vec3): Options {
  const window: Options = state.window !== null && state.level !== null ? { window: state.window, level: state.level } : {};
  const options: Options = { dataset: state.dataset, plane, at: at.join(","), background: state.background, ...channelOptions(offers, state, window, true), ...timeOptions(offers, state) };
  return Object.assign(options, labelOptions(offers, state, false));
}
