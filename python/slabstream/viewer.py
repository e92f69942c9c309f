"""view(): a dataset in a notebook, as a widget; where anywidget is missing, as a still picture with the address of the viewer's page."""
from __future__ import annotations

import base64
import html
import urllib.parse
from typing import TYPE_CHECKING, Any, Mapping

from .drafts import draft_of
from .errors import InvalidArgument, SlabstreamError
from .gateway import check_proxy, gateway_of, reaches_this_machine
from .image import Image
from .page_state import Texts, for_pictures, options_of, texts_of

if TYPE_CHECKING:
    from .widget import Widget

VIEWER_OPTIONS = ("height", "panel", "behind_proxy")  # of view(), beside those of pictures
MISSING = "pip install 'slabstream[widget]' makes a viewer of this picture"  # that needs anywidget, and websockets


class Viewer:
    """What is looked at: a dataset of a service, and how it looks at first. A notebook shows it as a still picture.

    `url`: the address of the viewer's page, whoever has it may use the service through it; None: a browser does not reach this machine.
    """

    def __init__(self, service: Any, name: str, keep: Any, behind_proxy: str | None, options: Mapping[str, Any]):
        self.service, self._keep, self._proxy = service, keep, behind_proxy or ""
        if behind_proxy is not None:
            check_proxy(behind_proxy)
        self._options = for_pictures(options)
        self._sent: list[Any] = []  # what keeps its shapes at the service
        self.first = self.texts(name, options)

    def texts(self, name: str, options: Mapping[str, Any]) -> Texts:
        """The page's state of these options."""
        draft = draft_of(name, options)
        self.service._settle([draft])
        self._sent += draft.sent
        return texts_of(draft, options)

    def gateway(self, gone: Any = None) -> Any:
        return gateway_of(self.service.address, self._proxy, gone)

    @property
    def address(self) -> str:
        """Of the gateway, for a browser, with the token; empty: it does not reach this machine. Unavailable: there is no gateway."""
        return str(self.gateway().url) if self._proxy or reaches_this_machine() else ""

    @property
    def url(self) -> str | None:
        try:
            address = self.address
        except SlabstreamError:
            return None
        return f"{address}&{urllib.parse.urlencode(self.first, quote_via=urllib.parse.quote)}" if address else None

    def asked(self, state: Mapping[str, str], options: Mapping[str, Any]) -> dict[str, Any]:
        """What the service is asked for, to show a state. `options` take precedence."""
        name = state.get("dataset", "")
        dataset = next((each for each in self.service.datasets() if each.name == name), None)
        return {"dataset": name, **options_of(state, dataset), **self._options, **options}

    def picture(self, **options: Any) -> Image:
        """The picture that it shows; `options` are those of render(), such as size=1024, and take precedence."""
        return self.service.render(**self.asked(self.first, options))  # type: ignore[no-any-return]

    def close(self) -> None:
        """Lets go of the volume and the shapes that were loaded for it."""
        self._keep, self._sent = None, []

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        png, url = self.picture().png(), self.url
        name = html.escape(self.first["dataset"])
        link = "" if url is None else f'<a href="{html.escape(url)}" target="_blank">Open the viewer of {name}</a>: {html.escape(url.partition("#")[0])}. '
        picture = f'<img alt="{name}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        return {"text/html": f"<div>{picture}</div><div>{link}{MISSING}</div>", "image/png": png, "text/plain": repr(self)}

    def __repr__(self) -> str:
        return f"<slabstream.Viewer of {self.first['dataset']}>"


def view(service: Any, name: str, keep: Any, height: int | str, panel: bool, behind_proxy: str | None, options: Mapping[str, Any]) -> Widget | Viewer:
    viewer = Viewer(service, name, keep, behind_proxy, options)
    if not (isinstance(height, str) or (isinstance(height, int) and not isinstance(height, bool) and 1 <= height <= 16384)):
        raise InvalidArgument(f"height {height!r} is neither a number of pixels in [1, 16384] nor a length of CSS")
    try:
        from .widget import Widget
    except ImportError:
        return viewer
    return Widget(viewer, height, panel)
