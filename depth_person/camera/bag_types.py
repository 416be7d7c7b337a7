"""The message types that rosbags hold."""
from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
import logging
from typing import Any

from rosbags.interfaces import Connection, MessageDefinition, MessageDefinitionFormat
from rosbags.typesys import (
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
    Stores,
    TypesysError,
)
from rosbags.typesys.store import Typestore

#: What rosbags makes of definitions: name -> constants and fields.
Types = dict[str, Any]
LOG = logging.getLogger(__name__)
#: Stands above each part of a definition in the IDL.
_IDL_RULE = '=' * 80 + '\n'


@lru_cache(maxsize=1)
def jazzy_types() -> Typestore:
    """Return the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def types_for(connections: Iterable[Connection]) -> Typestore:
    """Return Jazzy's message types, with those added that only a bag defines."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for connection in connections:
        if connection.msgtype in store.types:
            continue
        try:
            found = _parse(connection.msgdef, connection.msgtype)
            store.register({name: fields for name, fields in found.items()
                            if name not in store.types})
        except TypesysError as error:
            LOG.warning('the definition of %s cannot be parsed: %s', connection.msgtype, error)
    return store


def _parse(definition: MessageDefinition, msgtype: str) -> Types:
    if definition.format == MessageDefinitionFormat.MSG:
        return get_types_from_msg(definition.data, msgtype)
    found: Types = {}
    if definition.format == MessageDefinitionFormat.IDL:
        for part in definition.data.split(_IDL_RULE):
            text = part.partition('\n')[2] if part.startswith('IDL: ') else part
            if text.strip():
                found.update(get_types_from_idl(text))
    return found
