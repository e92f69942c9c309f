// What is wrong with the page's names, roles and contrasts, as a list of sentences. The rules are those of WCAG 2.1 AA that a program can see.
const problems = [];
const visible = e => e.checkVisibility ? e.checkVisibility({ checkOpacity: false, checkVisibilityCSS: true }) : e.getClientRects().length > 0;
const what = e => `${e.tagName.toLowerCase()}${e.className && e.className.baseVal === undefined ? "." + String(e.className).replace(/\s+/g, ".") : ""} "${(e.textContent || "").trim().slice(0, 30)}"`;

function nameOf(e) {
  const labelled = e.getAttribute("aria-labelledby");
  return (e.getAttribute("aria-label") || (labelled && document.getElementById(labelled)?.textContent) || [...(e.labels || [])].map(l => l.textContent).join(" ") || (e.matches("button, a, summary, [role=menuitem]") && e.textContent) || e.getAttribute("title") || "").trim();
}

for (const e of document.querySelectorAll("button, a[href], input, select, textarea, summary, canvas, [role=slider], [role=menuitem], dialog")) {
  if (visible(e) && !nameOf(e)) problems.push(`no name: ${what(e)}`);
}
for (const e of document.querySelectorAll("img")) if (!e.hasAttribute("alt")) problems.push(`no alt: ${e.src}`);
for (const e of document.querySelectorAll("[role=slider]:not(input)")) if (visible(e)) for (const a of ["aria-valuenow", "aria-valuemin", "aria-valuemax"]) if (!e.hasAttribute(a)) problems.push(`${a} is missing: ${e.getAttribute("aria-label")}`);
for (const e of document.querySelectorAll("[tabindex]")) if (Number(e.getAttribute("tabindex")) > 0) problems.push(`tabindex above 0: ${what(e)}`);
const ids = [...document.querySelectorAll("[id]")].map(e => e.id);
for (const id of new Set(ids)) if (ids.filter(other => other === id).length > 1) problems.push(`id twice: ${id}`);
if (document.querySelectorAll("main").length !== 1 || document.querySelectorAll("h1").length !== 1) problems.push("not one main and one h1");
if (!document.documentElement.lang || !document.title) problems.push("no language or no title");

// ---- contrast of text with what lies behind it
const parse = text => { const n = text.match(/[\d.]+/g).map(Number); return { r: n[0], g: n[1], b: n[2], a: n[3] ?? 1 }; };
const over = (f, b) => ({ r: f.r * f.a + b.r * (1 - f.a), g: f.g * f.a + b.g * (1 - f.a), b: f.b * f.a + b.b * (1 - f.a), a: 1 });
const luminance = c => [c.r, c.g, c.b].map(v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4).reduce((s, v, i) => s + v * [0.2126, 0.7152, 0.0722][i], 0);
const contrast = (a, b) => { const [x, y] = [luminance(a), luminance(b)]; return (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05); };
function groundOf(e) {
  const layers = [];
  for (let at = e; at; at = at.parentElement) {
    const c = parse(getComputedStyle(at).backgroundColor);
    if (c.a > 0) layers.push(c);
    if (c.a === 1) break;
  }
  return layers.reverse().reduce((below, c) => over(c, below), { r: 255, g: 255, b: 255, a: 1 });
}
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
const seen = new Set();
while (walker.nextNode()) {
  const e = walker.currentNode.parentElement;
  if (!walker.currentNode.data.trim() || seen.has(e) || !visible(e) || e.closest("svg.drawing, svg.tools, .offscreen, option, noscript")) continue;
  seen.add(e);
  const style = getComputedStyle(e);
  const control = e.closest("button, .segmented span");
  if (control && (control.disabled || control.querySelector?.("input:disabled"))) continue;
  const color = e.closest("svg") ? style.fill : style.color;
  const ratio = contrast(over(parse(color), groundOf(e)), groundOf(e));
  if (ratio < 4.5) problems.push(`contrast ${ratio.toFixed(2)}: ${what(e)} ${color}`);
}
// Fields must be seen as such: 3 to 1 for their borders.
for (const e of document.querySelectorAll("select, input[type=text], input[type=number]")) {
  if (!visible(e)) continue;
  const ratio = contrast(parse(getComputedStyle(e).borderTopColor), groundOf(e.parentElement));
  if (ratio < 3) problems.push(`border's contrast ${ratio.toFixed(2)}: ${nameOf(e)}`);
}
return problems;
