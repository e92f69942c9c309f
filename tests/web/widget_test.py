#!/usr/bin/env python3
"""The viewer in other pages than its own, in Chromium: as <slab-view> and as a notebook's widget, over the gateway and over a kernel.

    widget_test.py FOLDER_OF_PROGRAMS FOLDER_FOR_SCREENSHOTS CHROMIUM CHROMEDRIVER [unittest arguments]
"""
import gzip
import json
import sys
import time
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "gateway"))
from gateway_test import Programs, wait_until  # noqa: E402
from page import png_pixels  # noqa: E402

import browser  # noqa: E402
from browser import Viewer  # noqa: E402
from page_test import SIZE, ball, write_nrrd  # noqa: E402
from proxy import Proxy  # noqa: E402

SHOTS, CHROMIUM, CHROMEDRIVER = Path(sys.argv[2]), sys.argv[3], sys.argv[4]
MOST_BYTES = 150_000

# Runs before the page: keeps what viewers hold outside of their elements, and pictures by the element that shows them.
WATCH = """
window.kept = new Set(); window.pictures = []; window.told = []; window.pressed = [];
const lasts = (what, signal) => { kept.add(what); signal?.addEventListener('abort', () => kept.delete(what)); };
for (const target of [window, document]) {
  const add = target.addEventListener, remove = target.removeEventListener, held = new WeakMap();
  target.addEventListener = (type, listener, options) => {
    const what = {listens: type};
    held.set(listener, what);
    lasts(what, options?.signal);
    add.call(target, type, listener, options);
  };
  target.removeEventListener = (type, listener, options) => {
    kept.delete(held.get(listener));
    remove.call(target, type, listener, options);
  };
  target.theirs = add;
}
for (const [begin, end, repeats] of [['setTimeout', 'clearTimeout', false], ['setInterval', 'clearInterval', true]]) {
  const start = window[begin], stop = window[end], held = new Map();
  window[begin] = (run, ms) => {
    const what = {timer: begin, ms}, id = start(() => { if (!repeats) kept.delete(what); run(); }, ms);
    held.set(id, what);
    kept.add(what);
    return id;
  };
  window[end] = id => { kept.delete(held.get(id)); stop(id); };
}
window.WebSocket = class extends WebSocket {
  constructor(address, protocols, isOfKernel) {
    super(window.blocked && !isOfKernel ? 'ws://127.0.0.1:9/' : address, protocols);
    const what = {socket: isOfKernel ? 'kernel' : 'gateway'};
    kept.add(what);
    this.addEventListener('close', () => kept.delete(what));
  }
};
window.shadow = of => document.querySelector(of).shadowRoot;
document.theirs('slabstream:drawn', e => { pictures.push({...e.detail, of: e.target.id}); if (pictures.length > 400) pictures.shift(); });
for (const type of ['slab-state', 'slab-pick', 'slab-error'])
  document.theirs(type, e => told.push({type, of: e.target.id, detail: e.detail}));
document.theirs('keydown', e => pressed.push(e.key));
"""

TWO = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Two volumes</title>
<script type="module" src="assets/widget.js"></script>
<style>body { margin: 8px; height: 2000px; background: #fff; }
slab-view { width: 470px; height: 320px; float: left; margin-right: 8px; }</style></head>
<body><input id="field"><br><slab-view id="one" src="." token="TOKEN" dataset="patient" azimuth="200" renderer="raycast"></slab-view>
<slab-view id="two" src="./api/v1#token=TOKEN" dataset="sphere" orientation-marker="0"></slab-view></body></html>"""

# A kernel as the Python client has it: relays to the gateway at this page's address. `answers`: whether it does.
KERNEL = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>A notebook</title>
<style>body { background: #111; }</style></head>
<body><div id="cell"></div><script type="module">
import widget from './assets/widget.js';
class Model {
  constructor(traits) {
    this.traits = traits;
    this.sockets = new Map();
    this.listeners = [];
    this.sent = [];
    this.written = [];
    this.answers = true;
  }
  get(name) { return this.traits[name]; }
  set(name, value) { this.traits[name] = value; this.fire(`change:${name}`); }
  save_changes() { this.written.push(this.traits._state.azimuth); }
  on(event, listener) { this.listeners.push([event, listener]); }
  off(event, listener) { this.listeners = this.listeners.filter(([e, l]) => e !== event || l !== listener); }
  fire(event, ...given) { for (const [of, listener] of [...this.listeners]) if (of === event) listener(...given); }
  tell(message, bytes) { if (this.answers) this.fire('msg:custom', message, bytes ? [new DataView(bytes)] : []); }
  send(message, callbacks, buffers = []) {
    this.sent.push(message);
    if (!this.answers) return;
    if (message.ask !== undefined) void this.ask(message, buffers);
    if (message.open !== undefined) this.open(message.open);
    if (message.send !== undefined) for (const text of [message.text, ...message.more ?? []]) this.sockets.get(message.send)?.send(text);
    if (message.close !== undefined) this.sockets.get(message.close)?.close();
  }
  async ask({ask, method, path}, [body]) {
    const answer = await fetch(`api/v1/${path}`, {method, body, headers: {Authorization: 'Bearer TOKEN'}});
    this.tell({answer: ask, status: answer.status, type: answer.headers.get('Content-Type')}, await answer.arrayBuffer());
  }
  open(id) {
    const address = new URL('api/v1/view', location.href.replace('http', 'ws'));
    const socket = new WebSocket(address, ['slabstream.view.v1', 'slabstream.token.TOKEN'], true);
    socket.binaryType = 'arraybuffer';
    this.sockets.set(id, socket);
    socket.onopen = () => this.tell({opened: id});
    socket.onmessage = ({data}) => typeof data === 'string' ? this.tell({heard: id, text: data}) : this.tell({heard: id}, data);
    socket.onclose = ({reason}) => { this.sockets.delete(id); this.tell({closed: id, reason}); };
  }
}
window.start = traits => {
  window.model = new Model({_address: '', _state: {}, _height: '300px', _panel: false, ...traits});
  window.cell = document.querySelector('#cell');
  window.stop = widget.render({model, el: cell});
};
</script></body></html>"""


class WidgetTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.programs = Programs()
        cls.addClassCleanup(cls.programs.close)
        write_nrrd(cls.programs.folder / "p.nrrd", SIZE, ball)
        cls.programs.run("sphere", "--class", 1, "--size", 24, "--occupancy", 0.2, "-o", "s.nrrd")
        cls.service, cls.endpoint = cls.programs.up("--data", "patient=p.nrrd", "--data", "sphere=s.nrrd")
        cls.process, cls.gateway = cls.programs.gateway("--endpoint", cls.endpoint)
        wait_until(lambda: cls.gateway.request("/readyz")[0] == 200, "ready")
        pages = {path: text.replace("TOKEN", cls.gateway.token) for path, text in {"/two": TWO, "/kernel": KERNEL}.items()}
        answers = {path: lambda fields, body, text=text: text for path, text in pages.items()}
        cls.proxy = Proxy(cls.gateway.host, cls.gateway.port, answers=answers)
        cls.addClassCleanup(cls.proxy.close)
        cls.driver = browser.start(CHROMIUM, CHROMEDRIVER)
        cls.addClassCleanup(cls.driver.quit)

    def open(self, path):
        tab = Viewer(self.driver, f"http://127.0.0.1:{self.proxy.port}{path}", script=WATCH)
        self.addCleanup(tab.close)
        return tab

    def final(self, tab, of, condition="true"):
        """The lossless picture of an element whose options `o` fulfil a condition; its pixels are those of the command line."""
        drawn = tab.until(f"""(d => {{ const o = d?.options; return d?.final && o['look-at'] && ({condition}) ? d : null; }})
            (pictures.filter(d => d.of === arguments[0] && d.pane === '3d').pop())""", of)
        shown = tab.js("""(c => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            return [c.width, c.height, [...d].map(b => b.toString(16).padStart(2, '0')).join('')]; })
            (shadow(arguments[0]).querySelector('[data-pane="3d"] canvas'))""", f"#{of}" if of else "#cell > div")
        options = {name: value for name, value in drawn["options"].items() if name != "dataset"}
        arguments = [f"--{name}" if value is True else f"--{name}={value}" for name, value in options.items()]
        self.programs.run("render", drawn["options"]["dataset"], "--endpoint", self.endpoint, "-o", "cli.png", *arguments)
        width, height, expected = png_pixels((self.programs.folder / "cli.png").read_bytes())
        self.assertEqual(shown[:2], [width, height])
        self.assertTrue(bytes.fromhex(shown[2]) == expected, "the pixels are those of the command line")
        return drawn

    def place(self, tab, of):
        """The middle of the element's picture."""
        return tab.js("""(b => [b.left + b.width / 2, b.top + b.height / 2])
            (shadow(arguments[0]).querySelector('canvas').getBoundingClientRect())""", of)

    def mouse(self, tab, of, *places):
        """Presses in the middle of the picture, moves to these places, which count from there, and lets go."""
        x, y = self.place(tab, of)
        tab.command("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
        for dx, dy in places:
            tab.command("Input.dispatchMouseEvent", type="mouseMoved", x=x + dx, y=y + dy, button="left", buttons=1)
        dx, dy = places[-1] if places else (0, 0)
        tab.command("Input.dispatchMouseEvent", type="mouseReleased", x=x + dx, y=y + dy, button="left", clickCount=1)

    def wheel(self, tab, of):
        x, y = self.place(tab, of)
        tab.command("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-100)

    def key(self, tab, key):
        for kind in ("keyDown", "keyUp"):
            tab.command("Input.dispatchKeyEvent", type=kind, key=key, code=f"Key{key.upper()}", text=key if kind == "keyDown" else "")

    def test_the_module_is_small(self):
        status, headers, body = self.gateway.request("/assets/widget.js", headers={"Accept-Encoding": "gzip"})
        self.assertEqual((status, headers["Content-Type"]), (200, "text/javascript"))
        self.assertLessEqual(len(body), MOST_BYTES)
        self.assertIn(b"slab-view", gzip.decompress(body))

    def test_two_elements_in_a_page_are_apart(self):
        tab = self.open("/two")
        one, two = self.final(tab, "one"), self.final(tab, "two")
        self.assertEqual((one["options"]["dataset"], two["options"]["dataset"]), ("patient", "sphere"))
        self.assertEqual((one["options"]["azimuth"], two["options"]["azimuth"]), (200, 30), "of a link, and of the dataset")
        tab.save(SHOTS, "elements")
        self.assertTrue(tab.js("document.activeElement === document.body"), "nobody takes the focus")

        # The hand turns one of them, and the page hears of it. A click picks.
        tab.js("(pictures.length = 0, told.length = 0, true)")
        self.mouse(tab, "#one", (20, 10), (50, 25))
        turned = self.final(tab, "one", "o.azimuth !== 200")
        self.assertAlmostEqual(turned["options"]["azimuth"], 180, places=3)
        azimuth = str(turned["options"]["azimuth"])
        tab.until("told.some(t => t.type === 'slab-state' && t.of === 'one' && t.detail.azimuth === arguments[0])", azimuth)
        self.assertEqual(tab.js("document.querySelector('#one').state.azimuth"), azimuth)
        self.mouse(tab, "#one")
        picked = tab.until("told.find(t => t.type === 'slab-pick')")
        self.assertEqual((picked["of"], picked["detail"]["hit"]), ("one", True))
        self.assertEqual(tab.js("pictures.filter(d => d.of === 'two').length"), 0, "the other one stands still")

        # Keys are those of the viewer that has the focus, and nobody else's.
        tab.js("(pressed.length = 0, true)")
        self.key(tab, "l")
        tab.until("shadow('#one').querySelectorAll('.pane').length === 4")
        self.assertEqual(tab.js("[pressed, shadow('#two').querySelectorAll('.pane').length]"), [[], 1])
        for pane in ("axial", "coronal", "sagittal"):
            tab.until("pictures.some(d => d.of === 'one' && d.pane === arguments[0] && d.final)", pane)
        tab.save(SHOTS, "elements-slices")
        self.key(tab, "l")
        tab.js("(document.querySelector('#field').focus(), true)")
        self.key(tab, "m")
        self.assertEqual(tab.js("[document.querySelector('#field').value, pressed.join('')]"), ["m", "m"])
        self.assertTrue(tab.js("shadow('#one').querySelector('.machine').hidden"))

        # So is the wheel: elsewhere it scrolls the page.
        zoom = tab.js("document.querySelector('#two').state.zoom")
        tab.js("(window.scrolled = 0, addEventListener('wheel', e => { scrolled += e.defaultPrevented ? 0 : 1; }), true)")
        self.wheel(tab, "#two")
        tab.until("scrolled === 1")
        self.assertEqual(tab.js("document.querySelector('#two').state.zoom"), zoom)

        # Attributes move the view, and so does the property.
        tab.js("""(e => { e.setAttribute('azimuth', '80'); e.setAttribute('elevation', '-10'); return true; })
            (document.querySelector('#two'))""")
        self.final(tab, "two", "o.azimuth === 80 && o.elevation === -10")
        tab.js("(document.querySelector('#two').state = {dataset: 'sphere', roll: '45', azimuth: '10'}, true)")
        self.final(tab, "two", "o.roll === 45 && o.azimuth === 10 && o.elevation === 0")
        tab.js("(document.querySelector('#two').setAttribute('dataset', 'patient'), true)")
        self.final(tab, "two", "o.dataset === 'patient'")

    def test_an_element_that_is_removed_leaves_nothing(self):
        tab = self.open("/two")
        self.final(tab, "one")
        self.final(tab, "two")
        tab.js("(shadow('#one').querySelector('canvas').focus(), true)")
        self.key(tab, "l")
        tab.until("shadow('#one').querySelectorAll('.pane').length === 4")
        self.key(tab, "k")
        tab.until("shadow('#one').querySelector('dialog pre') !== null")
        self.assertGreaterEqual(tab.js("[...kept].filter(k => k.socket).length"), 5)
        tab.js("""(window.gone = [], document.querySelectorAll('slab-view').forEach(e => {
            gone.push(new WeakRef(e), new WeakRef(e.shadowRoot.querySelector('.viewer'))); e.remove(); }), true)""")
        tab.until("kept.size === 0")
        # Not while this script runs: what lies on its stack is taken for pointers, and may hold an element for ever.
        tab.until("(gc({ type: 'major', execution: 'async' }), gone.every(g => g.deref() === undefined))")

        # One that comes back shows what it showed; one that has no gateway says so.
        tab.js("""(e => { const given = {id: 'three', src: '.', token: arguments[0], dataset: 'sphere'};
            for (const [name, value] of Object.entries(given)) e.setAttribute(name, value);
            document.body.append(e); return true; })(document.createElement('slab-view'))""", self.gateway.token)
        self.final(tab, "three", "o.azimuth === 30")
        tab.js("(document.querySelector('#three').state = {azimuth: '70'}, true)")
        self.final(tab, "three", "o.azimuth === 70")
        tab.js("(pictures.length = 0, document.body.prepend(document.querySelector('#three')), true)")
        self.final(tab, "three", "o.azimuth === 70")
        tab.js("(document.querySelector('#three').removeAttribute('src'), true)")
        tab.until("told.some(t => t.type === 'slab-error' && t.detail.includes('src is \"\"'))")
        self.assertIn("must be the address of a gateway", tab.js("shadow('#three').textContent"))

    def test_an_element_whose_token_expires_goes_on_with_another_one(self):
        tab = self.open("/two")
        make = """(e => { const given = {id: 'short', src: '.', token: arguments[0], dataset: 'patient', azimuth: '40'};
            for (const [name, value] of Object.entries(given)) e.setAttribute(name, value);
            document.querySelector('#field').after(e); return true; })(document.createElement('slab-view'))"""
        self.final(tab, "one")
        for seconds in (3, 15, 60):  # until one is long enough for the first picture
            until = int(time.time()) + seconds
            tab.js("(document.querySelector('#short')?.remove(), told.length = 0, true)")
            tab.js(make, self.gateway.holding(exp=until).token)
            drawn = "pictures.some(d => d.of === 'short' && d.final && d.options['look-at'])"
            tab.until(f"{drawn} || told.some(t => t.type === 'slab-error' && t.of === 'short')")
            if tab.js(drawn):
                break
        line = time.strftime("The token expired at %Y-%m-%dT%H:%M:%SZ. Load the page again to go on.", time.gmtime(until))
        tab.until("told.some(t => t.type === 'slab-error' && t.of === 'short' && t.detail === arguments[0])", line)
        tab.until("shadow('#short').querySelector('.banner:not([hidden])')?.textContent === arguments[0]", line)
        tab.js("(pictures.length = 0, document.querySelector('#short').setAttribute('token', arguments[0]), true)", self.gateway.token)
        self.final(tab, "short", "o.azimuth === 40")

    def widget(self, traits=""):
        tab = self.open("/kernel")
        tab.until("window.start !== undefined")
        tab.js(f"(start({{{traits}}}), true)")
        return tab

    def test_a_notebook_shows_it_over_the_kernel(self):
        tab = self.widget("_state: {dataset: 'patient', azimuth: '200'}")
        self.final(tab, "", "o.azimuth === 200")
        tab.save(SHOTS, "widget")
        self.assertEqual(tab.js("[model.get('channel'), cell.firstElementChild.clientHeight]"), ["kernel", 300])
        self.assertEqual(tab.js("[...kept].filter(k => k.socket).length"), 1, "that of the kernel, in this test")

        # The state goes both ways.
        self.mouse(tab, "#cell > div", (25, 0), (50, 0))
        self.final(tab, "", "o.azimuth !== 200")
        tab.until("model.get('_state').azimuth === '180' && model.get('_state').dataset === 'patient'")
        tab.js("(model.set('_state', {dataset: 'patient', azimuth: '90', elevation: '20'}), true)")
        self.final(tab, "", "o.azimuth === 90 && o.elevation === 20")
        tab.until("model.get('_state')['look-at'] !== undefined")
        # What the kernel says does not come back to it, not even in the viewer's own spelling, unless something changed.
        tab.js("(model.set('_state', {...model.get('_state'), azimuth: '100.0'}), model.written = [], true)")
        self.final(tab, "", "o.azimuth === 100")
        tab.js("(model.set('_state', {...model.get('_state'), azimuth: '110.0'}), true)")
        self.final(tab, "", "o.azimuth === 110")
        self.assertEqual(tab.js("[model.get('_state').azimuth, model.written]"), ["110.0", []])
        tab.js("(model.set('_state', {dataset: 'sphere', ...model.get('_state'), dataset: 'sphere'}), true)")
        self.final(tab, "", "o.dataset === 'sphere'")
        tab.until("model.get('_state').dataset === 'sphere'")
        tab.js("(model.set('_height', '420px'), true)")
        self.final(tab, "", "o.size.endsWith('x372')")

        # Of many views few go to the kernel: messages are dear. The last one does.
        before = tab.js("model.sent.length")
        turn = """const done = arguments[0], canvas = shadow('#cell > div').querySelector('canvas');
            let n = 0;
            const send = (type, clientX, buttons) => {
              canvas.dispatchEvent(new PointerEvent(type, {bubbles: true, pointerId: 1, button: 0, buttons, clientX}));
            };
            canvas.setPointerCapture = () => undefined; send('pointerdown', 0, 1);
            const step = () => {
              send('pointermove', ++n, 1);
              if (n < 100) return requestAnimationFrame(step);
              send('pointerup', n, 0);
              done();
            };
            step();"""
        tab.driver.execute_async_script(turn)
        tab.until("(d => d.final && String(d.options.azimuth) === model.get('_state').azimuth)(pictures[pictures.length - 1])")
        texts = tab.js("model.sent.slice(arguments[0]).flatMap(m => [m.text, ...m.more ?? []]).filter(text => text)", before)
        views = sum(json.loads(text)["type"] == "view" for text in texts)
        self.assertLessEqual(views, 50, "for 100 moves")

        # A click picks; errors are told.
        self.mouse(tab, "#cell > div")
        tab.until("model.sent.some(m => m.picked?.hit === true)")
        tab.js("(model.set('_state', {dataset: 'sphere', renderer: 'nothing'}), true)")
        tab.until("model.sent.some(m => m.error?.includes('nothing'))")
        tab.js("(model.set('_state', {dataset: 'sphere', azimuth: '10'}), true)")
        self.final(tab, "", "o.azimuth === 10")

        # It says that it lives, and then that nobody answers; it goes on when somebody does.
        stream = tab.js("model.sent.find(m => m.open !== undefined).open")
        tab.until("model.sent.some(m => m.alive?.includes(arguments[0]))", stream)
        tab.js("(model.answers = false, model.sent.length = 0, window.timer = setTimeout, true)")
        tab.js("(window.setTimeout = (run, ms) => timer(run, ms === 180000 ? 1 : ms), true)")
        self.key(tab, "k")
        tab.until("shadow('#cell > div').querySelector('.message.error')?.textContent === arguments[0]",
                  "The kernel has not answered for 3 minutes. It is busy with a cell, or gone.")  # fmt: skip
        ask = tab.js("model.sent.find(m => m.ask !== undefined && m.path.startsWith('command')).ask")
        self.assertTrue(tab.js("model.sent.some(m => m.cancel === arguments[0])", ask))
        tab.until("shadow('#cell > div').querySelector('.banner:not([hidden])')?.textContent.includes('no longer answers')")
        tab.until("model.sent.some(m => m.open !== undefined && m.open !== arguments[0])", stream)
        tab.save(SHOTS, "widget-alone")
        tab.js("(model.answers = true, pictures.length = 0, true)")
        tab.until("shadow('#cell > div').querySelector('.banner').hidden")
        tab.js("(model.set('_state', {...model.get('_state'), azimuth: '50'}), true)")
        self.final(tab, "", "o.azimuth === 50")

        # Nothing is left.
        tab.js("(model.sent.length = 0, stop(), true)")
        self.assertEqual(tab.js("[model.listeners.length, cell.childElementCount]"), [0, 0])
        self.assertEqual(tab.js("model.sent.filter(m => m.close !== undefined).length"), 1)
        tab.until("(model.sockets.forEach(s => s.close()), kept.size === 0)")

    def test_a_notebook_shows_it_over_the_gateway_where_that_answers(self):
        address = f"new URL('./#token={self.gateway.token}', location.href).href"
        tab = self.widget(f"_address: {address}, _state: {{dataset: 'sphere'}}, _panel: true")
        self.final(tab, "")
        self.assertEqual(tab.js("[model.get('channel'), model.sent.length]"), ["gateway", 0])
        self.assertEqual(tab.js("[...kept].filter(k => k.socket).map(k => k.socket)"), ["gateway"])
        # The gateway falls silent: the picture stays, and soon the kernel carries what comes next.
        tab.js("(window.canvas = shadow('#cell > div').querySelector('canvas'), window.blocked = true)")
        self.proxy.cut()
        tab.until("model.get('channel') === 'kernel'")
        tab.js("(model.set('_state', {...model.get('_state'), azimuth: '60'}), true)")
        self.final(tab, "", "o.azimuth === 60")
        self.assertTrue(tab.js("canvas.isConnected && [...kept].some(k => k.socket === 'kernel')"))
        # Another address, where it answers.
        tab.js("(window.blocked = false, model.set('_address', model.get('_address').replace('#', '?again#')), true)")
        tab.until("model.get('channel') === 'gateway'")
        tab.js("(stop(), true)")
        tab.until("(model.sockets.forEach(s => s.close()), kept.size === 0)")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]])
