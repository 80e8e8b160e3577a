"""Structural mutations of glTF JSON, and of the bytes beside it.

JSON objects are lists of pairs, so that a key may occur twice. `Raw` is text that the file gets as
it is, so that it may hold what Python's json module would not write.
"""

from __future__ import annotations

import json
from random import Random
from typing import Any

Pairs = type("Pairs", (list,), {"__doc__": "A JSON object: a list of [key, value]."})


class Raw(str):
    """Text of a JSON value."""


HUGE = Raw("9" * 400)
NUMBERS = [0, 1, -1, 2, 3, 4, 7, 16, 100, 255, 256, 65535, 65536, 2**24, 2**31 - 1, 2**31]
NUMBERS += [2**32 - 1, 2**32, 2**53, 2**63, 2**64, -(2**31), 5120, 5121, 5123, 5125, 5126]
NUMBERS += [0.5, 1.5, -0.0, 1e-320, 1e15, 1e30, 3e38, 1e39, 1e300, -1e300, 34962, 10497, 9728]
TOKENS = [HUGE, Raw("-" + HUGE), Raw("1e999"), Raw("NaN"), Raw("Infinity"), Raw("-Infinity")]
TOKENS += [Raw("9" * 5000), Raw("[" * 150 + "]" * 150), Raw("[" * 100_000 + "]" * 100_000)]
TOKENS += [Raw('{"a":' * 250 + "0" + "}" * 250), Raw(""), Raw("nul"), Raw("'x'"), Raw('"\\ud800"')]
TEXTS = ["", "x", "self", "__class__", "a" * 300, "line\nline", "\0", "VEC2", "MAT4", "SCALAR"]
TEXTS += ["MASK", "BLEND", "spot", "directional", "orthographic", "perspective", "image/png"]
URIS = ["data:,", "data:application/octet-stream;base64,AAAA", "/dev/zero", "../../dev/zero"]
URIS += ["missing.bin", "%00", "file:///etc/hostname", ".", "data.bin", "data:;base64,*", "%ff%fe"]
OTHERS = [None, True, False, [], Pairs(), [0], [[]], [None], Pairs([["a", 0]]), [0.0] * 5]
VALUES = [*NUMBERS, *NUMBERS, *TOKENS, *TEXTS, *URIS, *OTHERS]
NAMES = ["self", "__class__", "__dict__", "__init__", "args", "kwargs", "extensions", "extras", ""]
NAMES += ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "COLOR_0", "JOINTS_0", "_SELF", "\ud800"]
NAMES += [
    "bufferView",
    "count",
    "sparse",
    "mesh",
    "children",
    "matrix",
    "uri",
    "byteStride",
    "mode",
]
EXTENSIONS = ["KHR_draco_mesh_compression", "EXT_meshlet_edgebreaker", "EXT_meshlet_lod"]
EXTENSIONS += ["KHR_lights_punctual", "KHR_texture_transform", "EXT_mesh_gpu_instancing"]
EXTENSIONS += [
    "KHR_materials_unlit",
    "EXT_meshopt_compression",
    "EXT_structural_metadata",
    "ACME_x",
]
EXTREMES = (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\0\0\xc0\x7f", b"\0\0\x80\x7f", b"\1\0\0\0")


def parse(text: str) -> Any:
    return json.loads(text, object_pairs_hook=lambda pairs: Pairs(map(list, pairs)))


def written(value: Any) -> str:
    """The text of parsed JSON."""
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, Pairs):
        return "{" + ",".join(f"{json.dumps(k)}:{written(v)}" for k, v in value) + "}"
    if isinstance(value, list):
        return "[" + ",".join(map(written, value)) + "]"
    return json.dumps(value)


def copied(value: Any) -> Any:
    if isinstance(value, list):
        return type(value)(map(copied, value))
    return value


# --- places ---


def _children(value: Any) -> list[tuple[list[Any], int]]:
    """(list, index) of each value directly inside."""
    if isinstance(value, Pairs):
        return [(pair, 1) for pair in value]
    return [(value, i) for i in range(len(value))] if isinstance(value, list) else []


def _place(document: Any, random: Random) -> tuple[list[Any], int]:
    """(list, index) of a random value: as likely in a short list as in a long one."""
    holder, index = random.choice(_children(document))
    while (inside := _children(holder[index])) and random.random() < 0.85:
        holder, index = random.choice(inside)
    return holder, index


def _containers(document: Any, kind: type) -> list[list[Any]]:
    found, level = [], [document]
    while level:
        found += [v for v in level if type(v) is kind and v]
        level = [holder[index] for v in level for holder, index in _children(v)]
    return found


# --- mutations of parsed JSON ---


def _replace(document: Any, random: Random) -> None:
    holder, index = _place(document, random)
    holder[index] = copied(random.choice(VALUES))


def _tweak(document: Any, random: Random) -> None:
    """A number near the old one, or of the size of an index."""
    for _ in range(20):
        holder, index = _place(document, random)
        old = holder[index]
        if type(old) in (int, float):
            changes = [old + 1, old - 1, old * 2, -old, old // 2, random.randrange(20), old + 0.5]
            holder[index] = random.choice([*changes, *NUMBERS])
            return


def _swap(document: Any, random: Random) -> None:
    """A value from elsewhere in the file."""
    (holder, index), (other, place) = _place(document, random), _place(document, random)
    holder[index] = copied(other[place])


def _list(document: Any, random: Random) -> None:
    values = random.choice(_containers(document, list) or [[0]])
    change = random.randrange(6)
    if change == 0:
        values.pop(random.randrange(len(values)))
    elif change == 1:
        values.append(copied(random.choice(values)))
    elif change == 2:
        values.extend(copied(values[-1:]) * random.choice([9, 300]))
    elif change == 3:
        values.reverse()
    elif change == 4:
        values.append(copied(random.choice(VALUES)))
    else:
        values.clear()


def _keys(document: Any, random: Random) -> None:
    pairs = random.choice(_containers(document, Pairs))
    pair = random.choice(pairs)
    change = random.randrange(5)
    if change == 0:
        pairs.remove(pair)
    elif change == 1:
        pairs.append([pair[0], copied(random.choice([*VALUES, pair[1]]))])
    elif change == 2:
        pair[0] = random.choice(NAMES)
    elif change == 3:
        pairs.append([random.choice(NAMES), copied(pair[1])])
    else:
        value = random.choice([Pairs(), *VALUES])
        pairs.append(["extensions", Pairs([[random.choice(EXTENSIONS), copied(value)]])])


def _nodes(document: Any, random: Random) -> None:
    """Circles, repeats and indices out of range in the tree of nodes."""
    nodes = next((value for key, value in document if key == "nodes"), None)
    objects = [n for n in nodes if isinstance(n, Pairs)] if type(nodes) is list else []
    if not objects:
        return
    indices = [random.randrange(-1, len(nodes) + 1) for _ in range(random.choice([1, 2, 50]))]
    random.choice(objects).append(["children", indices])
    if random.random() < 0.2:  # every place of a node doubles those below
        nodes += [Pairs([["children", [len(nodes) + i + 1] * 2]]) for i in range(30)]


STRUCTURAL = (
    _replace,
    _replace,
    _replace,
    _tweak,
    _tweak,
    _tweak,
    _swap,
    _list,
    _keys,
    _keys,
    _nodes,
)


# --- mutations of text and bytes ---


def _damaged_text(text: str, random: Random) -> str:
    at = random.randrange(len(text))
    return random.choice(
        [
            text[:at],
            text[:at] + random.choice('{}[]",:0x\\\0é') + text[at:],
            text[:at] + text[at + 1 :],
            "\ufeff" + text,
            text + text,
            "",
            "null",
            "[]",
        ]
    )


def _damaged_bytes(data: bytes, random: Random) -> bytes:
    result = bytearray(data)
    for _ in range(random.choice([1, 1, 2, 4])):
        at = random.randrange(len(data))
        change = random.randrange(4)
        if change == 0:
            result[at] ^= 1 << random.randrange(8)
        elif change == 1:
            result[at : at + 1] = bytes([random.randrange(256)])
        else:
            at -= at % 4
            result[at : at + 4] = random.choice(EXTREMES)
    return bytes(result[: random.randrange(len(data)) if random.random() < 0.05 else len(data)])


def mutated(text: str, binary: bytes, random: Random) -> tuple[str, bytes]:
    """(JSON text, binary chunk) with one to three changes; mostly of the JSON."""
    if binary and random.random() < 0.1:
        return text, _damaged_bytes(binary, random)
    if random.random() < 0.03:
        return _damaged_text(text, random), binary
    document = parse(text)
    for _ in range(random.choice([1, 1, 1, 2, 3])):
        if document and _containers(document, Pairs):
            random.choice(STRUCTURAL)(document, random)
    return written(document), binary
