"""The built-in transfer functions."""
from __future__ import annotations

from .options import COMMANDS


def presets() -> dict[str, str]:
    """What the option `transfer` takes by name, and what each is for."""
    lines = COMMANDS["render"]["transfer"].help.split("\n")[1:]
    names = (line.strip().partition(": ") for line in lines)
    return {name: purpose for name, _, purpose in names}
