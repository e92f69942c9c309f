"""The messages of proto/slabstream/v1, as classes: schema.Envelope(version=3), schema.FRAME_PHASE_QUEUED.

They are made from schema.bin, a FileDescriptorSet that protoc wrote and a test compares with proto/. So the package needs no protoc to be
installed, and takes any version of protobuf from 3.20 on.
"""
from __future__ import annotations

import dataclasses
import pathlib
from typing import Any, Callable, TypeVar, cast

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

PACKAGE = "slabstream.v1"
WIRE_VERSION = 3


def _load() -> dict[str, Any]:
    """Messages and values of enums, by name. The pool is our own: other modules may have the same schema in the common one."""
    pool = descriptor_pool.DescriptorPool()
    files = descriptor_pb2.FileDescriptorSet.FromString(pathlib.Path(__file__).with_name("schema.bin").read_bytes())
    for file in files.file:
        pool.AddSerializedFile(file.SerializeToString())
    if hasattr(message_factory, "GetMessageClass"):
        class_of = message_factory.GetMessageClass
    else:  # before protobuf 4.22
        class_of = message_factory.MessageFactory(pool).GetPrototype
    found: dict[str, Any] = {}
    for file in (file for file in files.file if file.package == PACKAGE):
        for message in file.message_type:
            found[message.name] = class_of(pool.FindMessageTypeByName(f"{PACKAGE}.{message.name}"))
        for enum in file.enum_type:
            found.update((value.name, value.number) for value in enum.value)
    return found


_NAMES = _load()


def word(message: Any, field: str, unknown: str = "") -> str:
    """The value of an enumeration as a word: "millimetre" of LENGTH_UNIT_MILLIMETRE. `unknown`: in place of 0, and of what is not known."""
    kind = message.DESCRIPTOR.fields_by_name[field].enum_type
    value = kind.values_by_number.get(getattr(message, field))
    if value is None or value.number == 0:
        return unknown
    prefix = kind.values_by_number[0].name.removesuffix("UNSPECIFIED")
    return str(value.name.removeprefix(prefix)).lower()


def zyx(vector: Any) -> tuple[Any, Any, Any]:
    return vector.z, vector.y, vector.x


def xyz(vector: Any) -> tuple[Any, Any, Any]:
    return vector.x, vector.y, vector.z


_Made = TypeVar("_Made")


def read(kind: Callable[..., _Made], message: Any, /, **given: Any) -> _Made:
    """A dataclass of this kind: fields that are not given are those of the message of the same names."""
    names = [field.name for field in dataclasses.fields(cast(Any, kind)) if field.name not in given]
    return kind(**given, **{name: getattr(message, name) for name in names})


def __getattr__(name: str) -> Any:
    if name in _NAMES:
        return _NAMES[name]
    raise AttributeError(f"the schema has no {name}")


def __dir__() -> list[str]:
    return sorted(_NAMES)
