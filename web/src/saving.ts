// Pictures as files: what panes show, rendered anew at any size, with the page's marks drawn over it or without.
import { type Annotations, Drawing } from "./annotations";
import type { Api } from "./api";
import type { Context } from "./context";
import { h, svg } from "./dom";
import { type Frame, Session, type View } from "./session";

// What a pane shows. `marks` are those of a file.
export interface Part { name: string; title: string; view: View; marks: Annotations }

const MARKS_SIDE = 600; // pixels of the shorter side of a picture whose marks have the page's own size

// A lossless picture of a view.
function draw(api: Api, view: View, canvas: HTMLCanvasElement, place: (frame: Frame) => void): Promise<Frame> {
  return new Promise((resolve, reject) => {
    if (api.refusal) return reject(new Error(api.refusal));
    const session: Session = new Session(api, {
      frame: frame => {
        if (!frame.header.final) return;
        place(frame);
        session.end();
        resolve(frame);
      },
      error: message => { session.end(); reject(new Error(message)); },
      connection: state => { if (state === "lost") { session.end(); reject(new Error("The gateway does not answer.")); } },
    });
    session.show({ ...view, timeline: false, options: { ...view.options, size: `${canvas.width}x${canvas.height}` } });
  });
}

// The drawing as a picture of its own, with the viewer's rules for it.
async function pictureOf(drawing: SVGElement, viewer: HTMLElement, width: number, height: number): Promise<HTMLImageElement> {
  const around = viewer.getRootNode() as Document | ShadowRoot, sheets = [...around.styleSheets, ...(around.adoptedStyleSheets ?? [])];
  const rules = sheets.flatMap(sheet => [...sheet.cssRules]).filter(rule => rule instanceof CSSStyleRule && (rule.style.getPropertyValue("--small") || /\.drawing/.test(rule.selectorText))).map(rule => rule.cssText);
  const root = svg("svg", { class: "viewer", xmlns: "http://www.w3.org/2000/svg", width, height }, svg("style", {}, rules.join("\n")), drawing);
  root.style.fontFamily = getComputedStyle(viewer).fontFamily;
  const image = h("img");
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(root))}`;
  await image.decode();
  return image;
}

async function pictureOfPart({ api, element }: Context, { view, marks }: Part, width: number, height: number, marked: boolean): Promise<HTMLCanvasElement> {
  const canvas = h("canvas", { width, height }), context = canvas.getContext("2d") as CanvasRenderingContext2D;
  const frame = await draw(api, view, canvas, ({ header, picture }) => {
    const [r, g, b, a] = header.background;
    context.fillStyle = `rgb(${[r, g, b].map(c => Math.round(c * 255)).join(" ")} / ${a})`;
    context.fillRect(0, 0, width, height);
    if (picture) context.drawImage(picture, header.bounds[0], header.bounds[1]);
  });
  if (!marked) return canvas;
  const drawing = new Drawing(), scale = Math.max(0.5, Math.min(width, height) / MARKS_SIDE);
  drawing.draw({ frame, cssWidth: width / scale, cssHeight: height / scale }, marks);
  context.drawImage(await pictureOf(drawing.element, element, width, height), 0, 0, width, height);
  return canvas;
}

export interface Saving { width: number; height: number; marked: boolean; transparent: boolean }

// One part, or four as the page arranges them.
export async function pictureFile(viewer: Context, parts: readonly Part[], { width, height, marked, transparent }: Saving): Promise<Blob> {
  const { background: _, ...clear } = parts[0]?.view.options ?? {};
  // The service's own file says how it was made.
  if (parts.length === 1 && parts[0]?.view.picture === "render" && !marked) return viewer.api.picture({ ...(transparent ? clear : parts[0].view.options), size: `${width}x${height}` });
  const canvas = h("canvas", { width, height }), context = canvas.getContext("2d") as CanvasRenderingContext2D;
  const across = parts.length > 1 ? 2 : 1, left = Math.floor(width / across), top = Math.floor(height / across);
  for (const [i, part] of parts.entries()) {
    const x = i % across === 0 ? 0 : left, y = i < across ? 0 : top, options = { ...part.view.options };
    if (transparent) delete options["background"];
    const one = await pictureOfPart(viewer, { ...part, view: { ...part.view, options } }, across === 1 ? width : x === 0 ? left : width - left, across === 1 ? height : y === 0 ? top : height - top, marked);
    context.drawImage(one, x, y);
  }
  return new Promise((resolve, reject) => canvas.toBlob(blob => (blob ? resolve(blob) : reject(new Error("The picture is too large for this browser."))), "image/png"));
}
