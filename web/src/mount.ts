// A viewer in an element of a document: makes the parts and connects them.
import { Api, ApiError, type Dataset, type Value } from "./api";
import { orbited, panned, rolled, type Side, sidesOf, startOf, zoomed } from "./camera";
import { carried } from "./carry";
import { wholeBox } from "./clip_handles";
import { ChannelRanges } from "./channel_ranges";
import { takesFunction } from "./channels";
import { channelsSection } from "./channels_section";
import { clipSection } from "./clip_section";
import type { Connection } from "./connection";
import { type Context, follow } from "./context";
import { openSection, section, toggle } from "./controls";
import { commandDialog, helpDialog, screenshotDialog } from "./dialogs";
import { copyText, h, put } from "./dom";
import { FunctionSource } from "./function_source";
import { GradientEditor } from "./gradient_editor";
import { Histograms } from "./histograms";
import { keepView, keyFramesSection } from "./key_frames";
import { type KeyGroup, listenToKeys } from "./keys";
import { type Fields, fieldsOf, sayDirection, stateOf } from "./link";
import { Labels } from "./labels";
import { labelsSection } from "./labels_section";
import { lightSection, renderingSection, surfacesSection } from "./look_sections";
import { Machine } from "./machine";
import { MEASURE_KINDS, type MeasureKind } from "./measure";
import { measureSection } from "./measure_section";
import { Measuring } from "./measuring";
import { movieDialog } from "./movie_dialog";
import { Notices } from "./notices";
import { Offers } from "./offers";
import { Player } from "./player";
import { Pointed } from "./pointed";
import { type Actions, Shell } from "./shell";
import { Sending } from "./sending";
import { shapesSection, showShape } from "./shapes_section";
import { simulationSection } from "./simulation_section";
import { Slices } from "./slices";
import { slicesSection } from "./slices_section";
import { INITIAL, LOOK, type State, Store } from "./state";
import { timesOf, timeText } from "./times";
import { TransferEditor } from "./transfer_editor";
import { Viewer } from "./viewer";
import { centreOf, type Volume, volumeOf } from "./volume";
import type { ServiceStatus } from "./session";

const NARROW_PIXELS = 760;
const RETRY_MS = 2000;
const TURN = { near: 5, far: 45 }, MOVE_PIXELS = { near: 20, far: 100 }, ZOOM_STEP = 1.15, ROLL_STEP = 5;

export type Theme = "light" | "dark";

// The place where a viewer stands.
export interface Host {
  isPage: boolean; // there is nothing else in the document: the viewer has the focus at once, and hears all keys
  panel: boolean; // whether the settings show at first, where there is room for them
  theme(): Theme; // asked for when the viewer begins, and once its place is in the document
  keepTheme?(theme: Theme): void;
  changed?(): void; // the state; first when the viewer is there
  link?(withToken: boolean): string; // to what shows; without this no link can be copied
  picked?(value: Value): void; // at a click in the 3-D picture
  error?(message: string): void; // one line, which the viewer shows, too
  refused?(why: string): void; // the gateway does not take the token, and there is no picture
  reached?(isOpen: boolean): void; // a stream of pictures has opened, or is lost
}

class Assembly {
  private readonly store: Store;
  private readonly context: Context;
  private readonly notices = new Notices();
  private readonly shell: Shell;
  private readonly sending: Sending;
  private readonly machine = new Machine(() => this.store.update({ machine: false }));
  private readonly player: Player;
  private readonly pointed: Pointed;
  private readonly viewer: Viewer;
  private readonly slices: Slices;
  private readonly clipping: HTMLDetailsElement;
  private readonly measuring: Measuring;
  private readonly measures: HTMLDetailsElement;
  private volume: Volume | null = null;
  private left: Volume | null = null; // the one before, whose view the other dataset takes over
  private starts: boolean; // the view has not been chosen yet
  private asking = ""; // the dataset that is being asked about
  private refused = false; // a view of the dataset
  private sent = ""; // a file of the user's that has become a dataset, until the gateway lists it
  private listed: readonly Dataset[] = []; // as the gateway told last
  private readonly shapes: ReturnType<typeof shapesSection>;
  private readonly simulation: ReturnType<typeof simulationSection>;
  private simulated: number | undefined; // the time that the simulation was at, as the gateway told last
  private readonly volumeListeners: ((volume: Volume | null) => void)[] = [];
  private readonly file = h("input", { type: "file" });

  constructor(private readonly element: HTMLElement, private readonly api: Api, private readonly offers: Offers, fields: Fields, private readonly host: Host) {
    const { notices } = this, { ended } = api, { isPage } = host, store = this.store = new Store(stateOf(fields, offers));
    this.starts = !sayDirection(fields);
    const context: Context = this.context = {
      store, api, offers, element, ended, volume: () => this.volume, onVolume: listener => void this.volumeListeners.push(listener), say: (message, kind) => this.say(message, kind),
      takesWheel: () => isPage || element.matches(":focus-within"), picked: host.picked && (value => host.picked?.(value)),
    };
    const source: FunctionSource = new FunctionSource(context, () => { editor.refresh(); this.viewer.annotate(); });
    const labels = new Labels(context);
    const histograms = new Histograms(context), ranges = new ChannelRanges(context, histograms);
    this.player = new Player(context);
    this.measuring = new Measuring(context);
    this.measures = measureSection(context, this.measuring);
    this.pointed = new Pointed(context, label => labels.note(label));
    this.sending = new Sending(api, context.say, name => { this.sent = name; this.showSent(); });
    this.shell = new Shell(element, isPage, this.actions(), notices.status, notices.banner, notices.progress, notices.messages, this.pointed.element, this.player.element, this.machine.element, this.sending.element);
    const editor = new TransferEditor(context, source, histograms);
    this.clipping = clipSection(context);
    const bar = toggle("Colour bar", on => store.update({ colorBar: on }));
    store.subscribe(state => bar.set(state.colorBar), ["colorBar"]);
    bar.set(store.state.colorBar);
    const functions = section("Transfer function", true, editor.element, new GradientEditor(context).element, bar.element);
    this.simulation = simulationSection(context);
    this.shapes = shapesSection(context);
    this.shell.panel.append(this.simulation.element, channelsSection(context, ranges, histograms), functions, this.shapes.element, slicesSection(context), renderingSection(context), surfacesSection(context), this.clipping, this.measures, keyFramesSection(context), labelsSection(context, labels), lightSection(context), this.facts());
    this.viewer = new Viewer(context, source, this.pointed, this.measuring, labels, ranges, {
      drawn: ({ frame: { header, view } }) => { notices.onFrame(header.statistics.missing); this.machine.onFrame(header.statistics); this.know(); this.player.drawn(view.options); },
      status: status => this.onStatus(status), progress: progress => notices.onProgress(progress), error: message => { this.refused = true; this.player.pause(); notices.onError(message); host.error?.(message); },
      connection: (state, reason) => { notices.onConnection(state, reason); if (state !== "connecting") host.reached?.(state === "open"); if (state === "lost") void api.datasets().catch(() => undefined); }, // a socket does not say that it was refused; a request does
    });
    this.shell.panes.append(this.viewer.pane.element);
    this.slices = new Slices(context, this.shell.panes, this.measuring, ranges, at => this.pointed.atPoint(at));
    follow(context, LOOK, () => { functions.hidden = !offers.can("transfer", store.state.renderer) || !takesFunction(offers, store.state); });
    listenToKeys(element, isPage, ended, () => this.keyGroups(), () => store.undo(), () => store.redo());
    store.subscribe((state, before) => {
      if (state.dataset !== before.dataset) this.forgetVolume();
      else if (state.azimuth !== before.azimuth || state.elevation !== before.elevation) this.starts = false;
      this.show();
      host.changed?.();
    });
    element.addEventListener("pointerdown", () => store.press(), true);
    for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => store.letGo(), { capture: true, signal: ended });
    this.takesFiles(editor);
    api.onRefused = () => {
      const line = refusalText(api, host);
      notices.onRefused(line);
      host.error?.(line);
    };
    this.shell.setPanel(host.panel && element.clientWidth > NARROW_PIXELS);
    this.show();
    if (isPage) this.viewer.pane.canvas.focus({ preventScroll: true });
    ended.addEventListener("abort", () => this.end());
  }

  get fields(): Fields { return fieldsOf(this.store.state, this.offers); }

  // What a link says, in the place of what shows. If only the dataset is another one, the view stays as far as it fits.
  update(fields: Fields): void {
    const { dataset, ...others } = this.fields, wanted: Fields = { ...(dataset !== undefined && { dataset }), ...fields }, state = stateOf(wanted, this.offers);
    if (JSON.stringify(fieldsOf({ ...state, dataset: "" }, this.offers)) === JSON.stringify(others)) return state.dataset === dataset ? undefined : this.showDataset(state.dataset);
    const direction = !sayDirection(wanted) && this.volume?.name === state.dataset ? startOf(this.volume.world) : {};
    this.left = null;
    this.store.update({ ...state, ...direction });
    this.starts = !sayDirection(wanted);
  }

  private end(): void {
    this.viewer.pane.end();
    this.slices.end();
    this.pointed.clear();
    this.sending.cancel();
    for (const dialog of this.element.querySelectorAll("dialog")) dialog.close();
  }

  private say(message: string, kind?: "note" | "error"): void {
    if (this.api.ended.aborted) return;
    this.notices.say(message, kind);
    if (kind === "error") this.host.error?.(message);
  }

  private show(): void {
    const { state } = this.store;
    this.shell.showLayout(state.layout === "quad", state.machine);
    this.machine.setOpen(state.machine);
    this.slices.update();
  }

  // ---- the dataset

  private onStatus(status: ServiceStatus): void {
    this.notices.onStatus(status);
    this.machine.onStatus(status);
    const { dataset } = this.store.state, volumes = status.datasets.filter(each => !each.is_shape), first = volumes[0];
    if (!dataset && first) this.store.update({ dataset: first.name });
    this.listed = status.datasets;
    const shown = this.volume && this.listed.find(each => each.name === dataset), count = timesOf(shown ?? null).count;
    if (shown && shown.times && count !== timesOf(this.offers.dataset).count) { // it has grown
      this.offers.noteDataset(shown, false);
      this.store.update({});
      this.player.refresh();
    }
    this.follow(this.listed.find(each => each.name === dataset));
    this.shapes.set(status.datasets);
    this.shell.showDatasets(volumes, this.store.state.dataset);
    this.showSent();
    this.know();
  }

  // Pictures show the latest time of a simulation.
  private follow(dataset: Dataset | undefined): void {
    this.simulation.set(dataset);
    const time = dataset?.simulation?.time;
    if (time === this.simulated || document.hidden) return;
    this.simulated = time;
    this.viewer.pane.again();
    this.slices.again();
  }

  // The view, the look and what undo knows stay. What of it does not apply shows once the dataset is known.
  private showDataset(name: string): void {
    this.left = this.volume ?? this.left;
    this.starts = !this.left;
    this.offers.noteDataset(this.listed.find(each => each.name === name), true);
    this.store.update({ dataset: name });
  }

  // A file that has become a dataset: a shape shows beside the volume.
  private showSent(): void {
    const sent = this.listed.find(each => each.name === this.sent);
    if (!sent) return;
    this.sent = "";
    if (!sent.is_shape) return this.showDataset(sent.name);
    showShape(this.context, sent.name);
    this.say(this.store.state.dataset ? `${sent.name} shows beside the volume.` : `${sent.name} shows as soon as a volume is open.`);
  }

  private forgetVolume(): void {
    this.volume = null;
    this.refused = false;
    this.offers.noteDataset(this.listed.find(each => each.name === this.store.state.dataset), this.left !== null);
    for (const listener of this.volumeListeners) listener(null);
  }

  // Once a picture of the dataset is there, or none can be made of it as it was asked for although it is loaded, the gateway can tell of it;
  // what it tells may be a second old, so it is asked again then.
  private know(): void {
    const { dataset } = this.store.state, drawn = this.viewer.pane.shown?.frame.view.options["dataset"] === dataset;
    const loaded = drawn || (this.refused && this.listed.some(each => each.name === dataset && each.state === "ready"));
    if (this.volume?.name === dataset || this.asking === dataset || !loaded) return;
    this.asking = dataset;
    Promise.all([this.api.datasets(), centreOf(this.api, dataset)]).then(([list, { centre, world, unit }]) => {
      const entry = list.find((each: Dataset) => each.name === dataset);
      if (!entry || this.store.state.dataset !== dataset) return;
      this.volume = volumeOf(entry, centre, world, unit);
      if (!this.volume) return;
      this.offers.noteDataset(entry, false);
      if (this.starts) this.store.update(startOf(world));
      if (this.left) this.store.update(carried(this.store.state, this.left, this.volume));
      this.left = null;
      for (const listener of this.volumeListeners) listener(this.volume);
      this.show();
    }).catch((error: unknown) => this.say(error instanceof Error ? error.message : String(error), "error")).finally(() => { this.asking = ""; });
  }

  private facts(): HTMLElement {
    const list = h("dl", { class: "facts" }), element = section("Dataset", false, list);
    const update = (volume: Volume | null): void => {
      element.hidden = !volume;
      if (!volume) return;
      const fact = (name: string, value: string): HTMLElement => h("div", {}, h("dt", {}, name), h("dd", {}, value));
      const coarsest = volume.levels.length > 1 ? volume.levels[volume.levels.length - 1] : undefined;
      const times = timesOf(this.offers.dataset);
      const unit = volume.unit === "voxel" || volume.unit === "unknown" ? "" : ` ${volume.unit}`;
      list.replaceChildren(fact("Size", `${volume.size.join(" × ")} voxels`), ...(coarsest ? [fact("Levels", `${volume.levels.length}, down to ${coarsest.size.join(" × ")}`)] : []), ...(volume.cells > 0 ? [fact("Cells", `${volume.cells}`)] : []), fact("Spacing", `${volume.spacing.map(s => Number(s.toPrecision(4))).join(" × ")}${unit}`), fact("Values", `${volume.type}, ${volume.range.join(" to ")}`), ...(volume.channels.length > 0 ? [fact("Channels", volume.channels.map(({ name }) => name).join(", "))] : []), ...(times.count > 1 ? [fact("Times", `${times.count}${times.step ? `, every ${timeText(1, times)}` : ""}`)] : []),
        fact("World", volume.world === "patient" ? "a patient’s (R, A, S)" : volume.world === "scene" ? "a scene’s" : "the voxels’"), fact("Memory", `${(volume.memoryBytes / 1e6).toFixed(1)} MB`));
    };
    this.volumeListeners.push(update);
    update(null);
    return element;
  }

  // ---- what can be done

  private world(): string | undefined { return this.volume?.world ?? this.viewer.pane.shown?.frame.header.geometry.world; }
  private sides(): readonly Side[] { return sidesOf(this.world()); }

  private view(index: number): void {
    const side = this.sides()[index];
    if (side) this.viewer.move({ azimuth: side.azimuth, elevation: side.elevation, roll: 0 }, performance.now());
  }

  // The first view of the dataset: it frames what shows.
  private start(): Partial<State> {
    const { roll, zoom, lookAt } = INITIAL;
    return { ...startOf(this.world() ?? "patient"), roll, zoom, lookAt };
  }

  private reset(): void { this.store.update(this.start()); }

  // Its section opens with the box, and stays as it is when the box goes.
  private toggleBox(): void {
    const { store, clipping } = this, on = store.state.clipBox === null;
    store.update({ clipBox: on ? wholeBox : null }, "box");
    if (on) openSection(clipping);
  }

  // A tool to measure with, or none.
  private measure(tool: MeasureKind | null): void {
    this.measuring.take(tool);
    if (this.measuring.tool) openSection(this.measures);
  }

  private stageSize(): [number, number] {
    const { clientWidth, clientHeight } = this.shell.panes;
    return [Math.round(clientWidth * devicePixelRatio), Math.round(clientHeight * devicePixelRatio)];
  }
  private pictureSize(): [number, number] { return this.viewer.pane.shown?.frame.header.size ?? [1024, 1024]; }

  private copyLink(link: string, withToken: boolean): void {
    void copyText(link).then(() => this.notices.say(withToken ? "The link is copied. Everybody who has it may do what you may." : "The link is copied. It gives no access: others need their own."));
  }

  private actions(): Actions {
    const { store, host, element } = this;
    return {
      dataset: name => this.showDataset(name), open: this.offers.may("send") ? () => this.file.click() : null,
      view: index => this.view(index), sides: () => this.sides().map(side => side.name), reset: () => this.reset(),
      layout: quad => store.update({ layout: quad ? "quad" : "single" }), machine: () => store.update({ machine: !store.state.machine }),
      panel: () => this.shell.setPanel(!this.shell.panelOpen), theme: () => this.switchTheme(), help: () => helpDialog(element, this.keyGroups(), this.offers.may("send")),
      projection: () => store.update({ projection: store.state.projection === "orthographic" ? "perspective" : "orthographic" }),
      copyLink: host.link ? withToken => this.copyLink(host.link?.(withToken) ?? "", withToken) : null, command: () => void commandDialog(this.context, ...this.pictureSize()),
      screenshot: () => screenshotDialog(this.context, [this.viewer.part(), ...this.slices.parts()], ...this.stageSize(), this.pictureSize()), movie: () => movieDialog(this.context, ...this.pictureSize(), this.world() === "patient" ? this.start() : null),
    };
  }

  private switchTheme(): void {
    const theme = this.element.dataset["theme"] === "dark" ? "light" : "dark";
    put(this.element, "data-theme", theme);
    this.host.keepTheme?.(theme);
  }

  private keyGroups(): KeyGroup[] {
    const { store, viewer, player } = this, actions = this.actions(), { copyLink, open } = actions, timed = player.present;
    const turn = (right: number, up: number) => (far: boolean, at: number): void => {
      const step = far ? TURN.far : TURN.near, pixels = MOVE_PIXELS.near;
      viewer.move(far ? panned(store.state, right * pixels, -up * pixels, viewer.pixelSize()) : orbited(store.state, right * step, up * step), at);
    };
    const zoom = (factor: number) => (_: boolean, at: number): void => viewer.move(zoomed(store.state, factor, 0, 0, viewer.pixelSize()), at);
    const roll = (degrees: number) => (_: boolean, at: number): void => viewer.move(rolled(store.state, degrees), at);
    return [
      { title: "View", keys: [
        { keys: ["ArrowLeft"], label: "←", does: "Turn left (Shift: move)", run: turn(-1, 0) }, { keys: ["ArrowRight"], label: "→", does: "Turn right (Shift: move)", run: turn(1, 0) },
        { keys: ["ArrowUp"], label: "↑", does: "Turn up (Shift: move)", run: turn(0, 1) }, { keys: ["ArrowDown"], label: "↓", does: "Turn down (Shift: move)", run: turn(0, -1) },
        { keys: ["+", "="], label: "+", does: "Zoom in", run: zoom(ZOOM_STEP) }, { keys: ["-", "_"], label: "−", does: "Zoom out", run: zoom(1 / ZOOM_STEP) },
        { keys: timed ? ["<"] : [",", "<"], label: timed ? "<" : ",", does: "Roll left", run: roll(-ROLL_STEP) }, { keys: timed ? [">"] : [".", ">"], label: timed ? ">" : ".", does: "Roll right", run: roll(ROLL_STEP) },
        ...[0, 1, 2, 3, 4, 5].map(i => ({ keys: [String(i + 1)], label: String(i + 1), does: this.sides()[i]?.name ?? "", run: () => this.view(i) })),
        { keys: ["r"], label: "R", does: "Reset the view", run: actions.reset }, { keys: ["o"], label: "O", does: "Parallel or perspective", run: actions.projection },
      ] },
      { title: "Values", keys: [
        { keys: ["["], label: "[", does: "Narrower window", run: (_, at) => viewer.window(-0.1, 0, at) }, { keys: ["]"], label: "]", does: "Wider window", run: (_, at) => viewer.window(0.1, 0, at) },
        { keys: ["{"], label: "{", does: "Darker", run: (_, at) => viewer.window(0, -0.04, at) }, { keys: ["}"], label: "}", does: "Brighter", run: (_, at) => viewer.window(0, 0.04, at) },
      ] },
      ...(timed ? [{ title: "Time", keys: [
        { keys: [" "], label: "Space", does: "Play or pause", run: () => player.toggle() }, { keys: [","], label: ",", does: "Time before", run: () => player.step(-1) }, { keys: ["."], label: ".", does: "Next time", run: () => player.step(1) },
      ] }] : []),
      { title: "Measure", keys: [
        ...MEASURE_KINDS.map(({ kind, name, key }) => ({ keys: [key], label: key.toUpperCase(), does: name, run: () => this.measure(kind) })),
        { keys: [], label: "Enter", does: "Point at the cross-hair, in a slice", run: () => undefined },
        { keys: ["Escape"], label: "Esc", does: "Put the tool away", run: () => this.measuring.take(null) },
      ] },
      { title: "Page", keys: [
        { keys: ["l"], label: "L", does: "Slices beside the picture", run: () => actions.layout(store.state.layout === "single") }, { keys: ["m"], label: "M", does: "Machine panel", run: actions.machine },
        { keys: ["p"], label: "P", does: "Settings", run: actions.panel }, { keys: ["b"], label: "B", does: "Clip box", run: () => this.toggleBox() },
        { keys: ["a"], label: "A", does: "Axes and scale bar", run: () => store.update({ marker: !store.state.marker, scaleBar: !store.state.marker }) },
        ...(copyLink ? [{ keys: ["c"], label: "C", does: "Copy link", run: () => copyLink(false) }] : []), { keys: ["k"], label: "K", does: "Command", run: actions.command },
        ...(open ? [{ keys: ["f"], label: "F", does: "Open a file", run: open }] : []), { keys: ["s"], label: "S", does: "Save picture", run: actions.screenshot }, { keys: ["v"], label: "V", does: "Save movie", run: actions.movie }, { keys: ["n"], label: "N", does: "Add a key frame", run: () => keepView(this.context) }, { keys: ["?", "h"], label: "?", does: "This help", run: actions.help },
        { keys: [], label: "Ctrl+Z", does: "Undo", run: () => undefined }, { keys: [], label: "Ctrl+Y", does: "Redo", run: () => undefined },
      ] },
    ];
  }

  // A file that is dropped or chosen: a colour map, or else a volume or a shape, if the token lets one be sent.
  private takesFiles(editor: TransferEditor): void {
    const sends = this.offers.may("send");
    const take = (file: File | undefined): void => {
      if (file?.name.toLowerCase().endsWith(".json")) void editor.open(file);
      else if (file && sends) void this.sending.send(file);
      else if (file) this.say(`${file.name} is not sent: you may not send files here.`, "error");
    };
    this.file.addEventListener("change", () => { take(this.file.files?.[0]); this.file.value = ""; });
    const { element } = this;
    element.addEventListener("dragover", event => { event.preventDefault(); element.dataset["drop"] = sends ? "Drop a volume, a shape or a colour map" : "Drop a colour map"; });
    element.addEventListener("dragleave", event => { if (!(event.relatedTarget instanceof Node && element.contains(event.relatedTarget))) delete element.dataset["drop"]; });
    element.addEventListener("drop", event => {
      event.preventDefault();
      delete element.dataset["drop"];
      take(event.dataTransfer?.files[0]);
    });
  }
}

// What to do then, in a line.
function refusalText({ refusal }: Api, { isPage }: Host): string {
  return `${refusal.charAt(0).toUpperCase()}${refusal.slice(1)}. ${isPage ? "Open a new link to go on." : "Load the page again to go on."}`;
}

export interface MountedViewer {
  readonly state: Fields; // names and texts as in links
  update(fields: Fields): void; // the whole state; what is missing has its first value, but the dataset stays
  dispose(): void; // nothing is left
}

// Places a viewer in `root`, which needs the style of page.css. Viewers share nothing, so there can be many.
export function mountViewer(root: HTMLElement | ShadowRoot, connection: Connection, initial: Fields, host: Host): MountedViewer {
  const end = new AbortController(), api = new Api(connection, end.signal), element = h("div", { class: "viewer", "data-theme": host.theme() });
  const showAlone = (text: string): void => element.replaceChildren(h(host.isPage ? "main" : "div", { class: "empty" }, h(host.isPage ? "h1" : "p", {}, text)));
  let fields = initial, assembly: Assembly | null = null, timer = 0;
  const start = (): void => void Offers.load(api).then(offers => {
    if (end.signal.aborted) return;
    put(element, "data-theme", host.theme());
    assembly = new Assembly(element, api, offers, fields, host);
    host.changed?.();
  }).catch((error: unknown) => {
    if (end.signal.aborted) return;
    const { message: why } = error as Error, message = api.refusal ? refusalText(api, host) : error instanceof ApiError ? `The gateway says: ${why}.` : error instanceof TypeError ? `The gateway does not answer: ${why}.` : why;
    showAlone(message);
    host.error?.(message);
    if (!api.refusal) timer = setTimeout(start, RETRY_MS);
    else host.refused?.(api.refusal);
  });
  showAlone("Connecting…");
  root.append(element);
  start();
  return {
    get state() { return assembly?.fields ?? fields; },
    update: next => { if (assembly) assembly.update(next); else fields = next; },
    dispose: () => { clearTimeout(timer); end.abort(); element.remove(); },
  };
}
