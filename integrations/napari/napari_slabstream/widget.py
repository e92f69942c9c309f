"""The dock widget: it follows the viewer, and draws pictures on its canvas in place of the layers' volumes."""
from __future__ import annotations

from typing import Any

import numpy as np
from qtpy.QtCore import QEvent, QTimer, Signal
from qtpy.QtWidgets import QCheckBox, QLabel, QPushButton, QVBoxLayout, QWidget
from vispy.scene.visuals import Image
from vispy.visuals.transforms import STTransform

from .layers import NotShown, camera_model, camera_of, is_volume, look_options, place_of
from .pictures import Pictures, Shown, View

_BEHIND = -1  # drawn before the scene, so that points, tracks and surfaces stand in front of the volumes


class Volumes(QWidget):
    """Shows the volumes of all image layers by Slabstream while the viewer displays three dimensions. For Qt's thread."""

    pictured = Signal(bool)  # a picture is on the canvas; True: the sharp one of a view
    _came = Signal(object, object, bool, object)

    _docked = _stopped = False

    def __init__(self, napari_viewer: Any):
        super().__init__()
        self._viewer = getattr(napari_viewer, "__wrapped__", napari_viewer)  # the canvas is no public part of a viewer
        self._canvas = self._viewer.window._qt_viewer.canvas
        self._on = QCheckBox("Draw volumes by Slabstream")
        self._on.setChecked(True)
        again = QPushButton("Send data again")
        again.setToolTip("After arrays were changed in place")
        self._said = QLabel()
        self._said.setWordWrap(True)
        column = QVBoxLayout(self)
        for part in (self._on, again, self._said):
            column.addWidget(part)
        column.addStretch()
        self._node: Any = None
        self._view: View | None = None  # what the viewer shows
        self._drawn: View | None = None  # whose sharp picture is on the canvas
        self._hidden: set[Any] = set()
        self._notes: dict[Any, str] = {}
        self._pictures = Pictures(self._came.emit)
        self.destroyed.connect(self._pictures.end)  # a viewer that is closed closes no dock widget
        self._came.connect(self._draw)
        self._soon = QTimer(self, singleShot=True, interval=0)  # one look at the viewer for all its events of a moment
        self._soon.timeout.connect(self._look)
        self._on.toggled.connect(self._changed)
        again.clicked.connect(self._send_again)
        self._watched = [camera_model(self._viewer).events, self._viewer.dims.events, self._viewer.layers.events,
                         self._canvas._scene_canvas.events.resize]
        for events in self._watched:
            events.connect(self._changed)
        self._changed()

    def _changed(self, *_: Any) -> None:
        if not self._soon.isActive():
            self._soon.start()

    def _send_again(self) -> None:
        self._pictures.forget()
        self._view = None
        self._changed()

    def _look(self) -> None:
        """Wants the picture of what the viewer shows now, if that has changed."""
        notes: dict[Any, str] = {}
        view = self._view_now(notes) if self._on.isChecked() and self._viewer.dims.ndisplay == 3 else None
        drawn = {shown.layer for shown in view.layers} if view else set()
        self._hide(drawn - set(self._notes))  # of the last picture: a layer that was refused stays napari's
        if view is None and self._node is not None:
            self._node.visible = False
        if view != self._view or view is None:
            self._view = view
            self._say(notes)
            self._pictures.want(view)

    def _view_now(self, notes: dict[Any, str]) -> View | None:
        layers = [layer for layer in self._viewer.layers if is_volume(layer)]
        shown = []
        for layer in layers:
            if layer.visible:
                try:
                    path = layer.source.path
                    siblings = [other for other in layers if path is not None and other.source.path == path]
                    shown.append(Shown(layer, layer.data, id(layer.data), siblings, place_of(layer, self._viewer), look_options(layer),
                                       float(layer.opacity), str(layer.blending)))
                except NotShown as why:
                    notes[layer] = str(why)
        height, width = self._canvas.size
        background = tuple(self._canvas._scene_canvas.bgcolor.rgb.tolist())
        ratio = self._canvas._scene_canvas.native.devicePixelRatioF()
        return View(tuple(shown), camera_of(self._viewer, height, width), background, ratio) if shown else None

    def _hide(self, layers: set[Any]) -> None:
        """napari's own volumes of these layers; all others are as their layers say."""
        visuals = self._canvas.layer_to_visual
        for layer in self._hidden - layers:
            if layer in visuals:
                visuals[layer].node.visible = layer.visible
        for layer in layers:
            visuals[layer].node.visible = False
        self._hidden = layers

    @property
    def settled(self) -> bool:
        """The canvas has the sharp picture of what the viewer shows."""
        return self._drawn is self._view and not self._soon.isActive()

    def _draw(self, view: View, rgb: Any, sharp: bool, notes: dict[Any, str]) -> None:
        if self._view is None:
            return
        self._drawn = view if sharp else None
        if self._node is None:
            self._node = Image(parent=self._canvas.view, method="auto", interpolation="linear")
            self._node.order = _BEHIND
            self._node.set_gl_state(depth_test=False, blend=False)
        height, width = self._canvas.size
        self._node.set_data(np.uint8(255 * rgb + 0.5))
        self._node.transform = STTransform(scale=(width / rgb.shape[1], height / rgb.shape[0]))
        self._node.visible = True
        self._notes = notes
        self._hide({shown.layer for shown in self._view.layers} - set(notes))
        self._say(notes)
        self._canvas._scene_canvas.update()
        self.pictured.emit(sharp)

    def _say(self, notes: dict[Any, str]) -> None:
        self._said.setText("\n".join(f"{layer.name}: {note}" for layer, note in notes.items()))

    def event(self, event: Any) -> bool:
        if event.type() == QEvent.Type.ParentChange:
            if self._docked and self.parent() is None:  # its dock was closed
                self.stop()
            self._docked = True
        return bool(super().event(event))

    def closeEvent(self, event: Any) -> None:
        self.stop()
        super().closeEvent(event)

    def stop(self) -> None:
        """napari draws everything itself again, for good."""
        if self._stopped:
            return
        self._stopped = True
        for events in self._watched:
            events.disconnect(self._changed)
        self._soon.stop()
        self._view = self._drawn = None
        self._pictures.end()
        self._hide(set())
        if self._node is not None:
            self._node.parent = None
