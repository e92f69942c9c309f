// A plain viewer: drag turns, the wheel zooms. It speaks the protocol of docs/http.md and nothing else.
const background = "#101418";
const canvas = document.getElementById("view"), context = canvas.getContext("2d");
const say = document.getElementById("say"), dataset = document.getElementById("dataset"), renderer = document.getElementById("renderer");
const link = new URLSearchParams(location.hash.slice(1)), token = link.get("token") ?? "";
const view = { azimuth: 30, elevation: 20, zoom: 1 };
let socket = null, seq = 0;

function fit() {
  const scale = window.devicePixelRatio || 1;
  const width = Math.max(1, Math.round(canvas.clientWidth * scale)), height = Math.max(1, Math.round(canvas.clientHeight * scale));
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
}

function show() {
  if (!socket || socket.readyState !== WebSocket.OPEN || !dataset.value) return;
  fit();
  socket.send(JSON.stringify({ type: "view", seq: ++seq, picture: "render", options: {
    dataset: dataset.value, renderer: renderer.value, size: `${canvas.width}x${canvas.height}`, background, ...view } }));
}

async function draw(message) {
  const n = new DataView(message).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, n)));
  const [x, y, width, height] = header.bounds, up = 1 / header.scale;
  const picture = width > 0 ? await createImageBitmap(new Blob([new Uint8Array(message, 4 + n)], { type: header.type })) : null;
  context.fillStyle = background;
  context.fillRect(0, 0, canvas.width, canvas.height);
  if (picture) context.drawImage(picture, x * up, y * up, width * up, height * up);
  socket.send(JSON.stringify({ type: "ack", frame: header.frame }));
  const s = header.statistics;
  say.value = `${header.final ? "lossless" : "moving"}, ${s.latency_ms.toFixed(0)} ms, ${s.workers} workers, ${(s.bytes.picture / 1024).toFixed(0)} KiB`;
}

function fillDatasets(list) {
  const names = list.map(d => d.name);
  if (names.join("\n") === [...dataset.options].map(o => o.value).join("\n")) return;
  const before = dataset.value || link.get("dataset");
  dataset.replaceChildren(...names.map(name => Object.assign(document.createElement("option"), { value: name, textContent: name })));
  if (names.includes(before)) dataset.value = before;
  show();
}

function connect() {
  const address = new URL("api/v1/view", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  address.hash = "";
  socket = new WebSocket(address, ["slabstream.view.v1", `slabstream.token.${token}`]);
  socket.binaryType = "arraybuffer";
  seq = 0;
  socket.onopen = show;
  socket.onmessage = event => {
    if (typeof event.data !== "string") return void draw(event.data);
    const message = JSON.parse(event.data);
    if (message.type === "status") {
      fillDatasets(message.datasets);
      if (message.service !== "ready") say.value = message.reason;
    } else if (message.type === "error") {
      say.value = message.error;
    } else if (message.type === "progress" && message.phase === "loading") {
      say.value = "loading";
    }
  };
  socket.onclose = event => {
    say.value = event.reason || "not connected";
    setTimeout(connect, 1000);
  };
}

canvas.addEventListener("pointermove", event => {
  if (event.buttons !== 1) return;
  view.azimuth = (view.azimuth - event.movementX * 0.4) % 360;
  view.elevation = Math.max(-90, Math.min(90, view.elevation + event.movementY * 0.4));
  show();
});
canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  view.zoom = Math.max(0.1, Math.min(50, view.zoom * Math.exp(-event.deltaY * 0.001)));
  show();
}, { passive: false });
dataset.addEventListener("change", show);
renderer.addEventListener("change", show);
new ResizeObserver(show).observe(canvas);
connect();
