// The page: a viewer that is all there is in its document. Its state is in the address.
import { fieldsInAddress, linkOf, showInAddress, takeToken } from "./address";
import { GatewayConnection } from "./connection";
import { tokenDialog } from "./dialogs";
import { h } from "./dom";
import { mountViewer, type Theme } from "./mount";

const ADDRESS_MS = 200;
const KEPT_THEME = "slabstream.theme";
const keptTheme = (): string | null => { try { return localStorage.getItem(KEPT_THEME); } catch { return null; } };
const isLight = keptTheme() ? keptTheme() === "light" : matchMedia("(prefers-color-scheme: light)").matches;
const theme: Theme = isLight ? "light" : "dark";
const token = takeToken();

function askForToken(reason: string): void {
  const place = document.querySelector<HTMLElement>(".viewer");
  if (!place || place.querySelector("dialog")) return;
  tokenDialog(place, reason, token => {
    const address = new URL(location.href);
    address.hash = `token=${encodeURIComponent(token)}&${address.hash.slice(1).replace(/(^|&)token=[^&]*/, "")}`;
    location.replace(address.href);
    location.reload();
  });
}

function open(): void {
  let timer = 0;
  const show = (): void => {
    document.title = viewer.state["dataset"] ? `${viewer.state["dataset"]} – Slabstream` : "Slabstream";
    showInAddress(viewer.state, token);
  };
  const viewer = mountViewer(document.body, new GatewayConnection(new URL(location.href), token), fieldsInAddress(), {
    isPage: true, panel: true, theme: () => theme,
    keepTheme: chosen => { try { localStorage.setItem(KEPT_THEME, chosen); } catch { /* it holds for this visit */ } },
    changed: () => { if (timer === 0) show(); clearTimeout(timer); timer = setTimeout(show, ADDRESS_MS); },
    link: withToken => linkOf(viewer.state, withToken ? token : ""),
    refused: why => askForToken(`The gateway says: ${why}.`),
  });
  addEventListener("hashchange", () => {
    if ("token" in fieldsInAddress()) return location.reload(); // a link of another start of the gateway, perhaps
    viewer.update(fieldsInAddress());
  });
}

document.body.replaceChildren();
if (token) open();
else {
  document.body.append(h("div", { class: "viewer", "data-theme": theme }, h("main", { class: "empty" }, h("h1", {}, "Slabstream"))));
  askForToken("This link gives no access.");
}
