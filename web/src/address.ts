// The page's address: the state of its view behind '#', and the token, which comes in the link that the gateway prints and stays out of the
// address and of copied links.
import { type Fields, fieldsIn, fragmentOf } from "./link";

const KEPT = `slabstream.token ${location.pathname}`; // for one tab, so that it can be loaded again

export const fieldsInAddress = (): Fields => fieldsIn(location.hash.slice(1));

export function takeToken(): string {
  const { token } = fieldsInAddress();
  try {
    if (token) sessionStorage.setItem(KEPT, token);
    return token ?? sessionStorage.getItem(KEPT) ?? "";
  } catch {
    return token ?? ""; // a frame without storage: the address keeps the token
  }
}

function tokenIsKept(token: string): boolean {
  try { return sessionStorage.getItem(KEPT) === token; } catch { return false; }
}

export function linkOf(fields: Fields, token = ""): string {
  const link = new URL(location.href);
  link.hash = (token ? `token=${token}&` : "") + fragmentOf(fields);
  return link.href;
}

export function showInAddress(fields: Fields, token: string): void {
  history.replaceState(null, "", linkOf(fields, tokenIsKept(token) ? "" : token));
}
