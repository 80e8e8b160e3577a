"""Reads SPIR-V: instructions, the layout of structures, the ids of specialisation constants."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

# Opcodes and decorations of the SPIR-V specification that this module reads.
OP_NAME = 5
OP_MEMBER_NAME = 6
OP_TYPE_INT = 21
OP_TYPE_FLOAT = 22
OP_TYPE_VECTOR = 23
OP_TYPE_MATRIX = 24
OP_TYPE_ARRAY = 28
OP_TYPE_RUNTIME_ARRAY = 29
OP_TYPE_STRUCT = 30
OP_CONSTANT = 43
OP_DECORATE = 71
OP_MEMBER_DECORATE = 72
DECORATION_SPEC_ID = 1
DECORATION_ARRAY_STRIDE = 6
DECORATION_OFFSET = 35

SCALARS = {OP_TYPE_INT: "u", OP_TYPE_FLOAT: "f"}  # -> numpy's kind

HEADER_WORDS = 5


def words_of(code: bytes) -> tuple[int, ...]:
    """The 32-bit words of a module."""
    return struct.unpack(f"<{len(code) // 4}I", code)


def instructions(words: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    """(position, opcode) of each instruction of a module."""
    position = HEADER_WORDS
    while position < len(words):
        yield position, words[position] & 0xFFFF
        position += max(words[position] >> 16, 1)


@dataclass
class Reflection:
    """One module.

    structures: name -> member -> [offset, type, lengths of arrays ...]. The type is numpy's or the
    name of a structure. uvec2 is a 64-bit address. Arrays without length have the length 0.
    strides: name -> bytes from one item to the next in an array of these structures.
    specialization: name -> id of a specialisation constant.
    """

    structures: dict[str, dict[str, list[Any]]] = field(default_factory=dict)
    strides: dict[str, int] = field(default_factory=dict)
    specialization: dict[str, int] = field(default_factory=dict)


def reflect(code: bytes) -> Reflection:
    """Reads a module that has names."""
    return _Reader(words_of(code)).reflection()


class _Reader:
    """Tables of a module's instructions, by the ids of their results or targets."""

    def __init__(self, words: tuple[int, ...]):
        self._words = words
        self._names: dict[int, str] = {}
        self._member_names: dict[tuple[int, int], str] = {}
        self._types: dict[int, tuple[int, tuple[int, ...]]] = {}
        self._constants: dict[int, int] = {}
        self._decorations: dict[tuple[int, int], int] = {}
        self._member_decorations: dict[tuple[int, int, int], int] = {}
        for position, opcode in instructions(words):
            end = position + (words[position] >> 16)
            self._read(opcode, position + 1, end)

    def reflection(self) -> Reflection:
        result = Reflection()
        for identifier, (opcode, members) in self._types.items():
            if opcode == OP_TYPE_STRUCT and (identifier, 0, DECORATION_OFFSET) in (
                self._member_decorations
            ):
                result.structures[self._names[identifier]] = {
                    self._member_names[identifier, index]: [
                        self._member_decorations[identifier, index, DECORATION_OFFSET],
                        *self._format(member),
                    ]
                    for index, member in enumerate(members)
                }
        for identifier, (opcode, operands) in self._types.items():
            stride = self._decorations.get((identifier, DECORATION_ARRAY_STRIDE))
            is_array = opcode in (OP_TYPE_ARRAY, OP_TYPE_RUNTIME_ARRAY)
            if is_array and stride is not None and self._types[operands[0]][0] == OP_TYPE_STRUCT:
                result.strides[self._names[operands[0]]] = stride
        for (target, decoration), value in self._decorations.items():
            # The size of a workgroup also has a nameless constant of the same id.
            if decoration == DECORATION_SPEC_ID and target in self._names:
                result.specialization[self._names[target]] = value
        return result

    def _read(self, opcode: int, begin: int, end: int) -> None:
        operands = self._words[begin:end]
        if opcode == OP_NAME:
            self._names[operands[0]] = _text(operands[1:])
        elif opcode == OP_MEMBER_NAME:
            self._member_names[operands[0], operands[1]] = _text(operands[2:])
        elif OP_TYPE_INT <= opcode <= OP_TYPE_STRUCT:
            self._types[operands[0]] = opcode, operands[1:]
        elif opcode == OP_CONSTANT:
            self._constants[operands[1]] = operands[2]
        elif opcode == OP_DECORATE and len(operands) == 3:
            self._decorations[operands[0], operands[1]] = operands[2]
        elif opcode == OP_MEMBER_DECORATE and len(operands) == 4:
            self._member_decorations[operands[0], operands[1], operands[2]] = operands[3]

    def _format(self, identifier: int) -> list[Any]:
        """The type of a member and the lengths of its arrays, as Reflection.structures has them."""
        opcode, operands = self._types[identifier]
        if opcode in SCALARS:
            signed = opcode == OP_TYPE_INT and operands[1]
            return [f"<{'i' if signed else SCALARS[opcode]}{operands[0] // 8}"]
        if opcode == OP_TYPE_STRUCT:
            return [self._names[identifier]]
        kind, *lengths = self._format(operands[0])
        if opcode == OP_TYPE_VECTOR and (kind, operands[1]) == ("<u4", 2):
            return ["<u8"]
        if opcode == OP_TYPE_ARRAY:
            return [kind, self._constants[operands[1]], *lengths]
        return [kind, 0 if opcode == OP_TYPE_RUNTIME_ARRAY else operands[1], *lengths]


def _text(words: tuple[int, ...]) -> str:
    """A string literal: UTF-8 that ends with a zero byte."""
    return struct.pack(f"<{len(words)}I", *words).split(b"\0", 1)[0].decode()
