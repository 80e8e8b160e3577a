# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Proxies: a modifier of Blender that shows another mesh in the viewport, and not in renders.

It is a group of geometry nodes without code of this extension: files with it work without.
"""

from contextlib import contextmanager

import bpy

NAME = "Meshlet Proxy"


def add(obj, stand_in):
    """Lets the viewport show the mesh of another object in place of the object's own."""
    group = bpy.data.node_groups.get(NAME) or _node_group()
    modifier = obj.modifiers.new(NAME, "NODES")
    modifier.node_group = group
    socket = next(s for s in group.interface.items_tree if s.name == "Proxy")
    modifier[socket.identifier] = stand_in
    obj.modifiers.move(len(obj.modifiers) - 1, 0)  # armatures then move either mesh


@contextmanager
def full_detail():
    """Shows the full meshes meanwhile: with "Apply Modifiers", exporters write what is shown."""
    shown = [
        modifier
        for obj in bpy.data.objects
        for modifier in obj.modifiers
        if modifier.type == "NODES"
        and modifier.node_group
        and modifier.node_group.name == NAME
        and modifier.show_viewport
    ]
    for modifier in shown:
        modifier.show_viewport = False
    try:
        yield
    finally:
        for modifier in shown:
            modifier.show_viewport = True


def _node_group():
    """The group: Is Viewport switches between the object's geometry and the proxy's."""
    group = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    group.is_modifier = True
    for name, in_out, kind in (
        ("Geometry", "INPUT", "NodeSocketGeometry"),
        ("Proxy", "INPUT", "NodeSocketObject"),
        ("Geometry", "OUTPUT", "NodeSocketGeometry"),
    ):
        group.interface.new_socket(name, in_out=in_out, socket_type=kind)
    source, result = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    proxy, switch = group.nodes.new("GeometryNodeObjectInfo"), group.nodes.new("GeometryNodeSwitch")
    viewport = group.nodes.new("GeometryNodeIsViewport")
    switch.input_type = "GEOMETRY"
    for place, node in enumerate((source, viewport, proxy, switch, result)):
        node.location = (200 * place, 0)
    group.links.new(source.outputs["Proxy"], proxy.inputs["Object"])
    group.links.new(viewport.outputs[0], switch.inputs["Switch"])
    group.links.new(source.outputs["Geometry"], switch.inputs["False"])
    group.links.new(proxy.outputs["Geometry"], switch.inputs["True"])
    group.links.new(switch.outputs[0], result.inputs["Geometry"])
    return group
