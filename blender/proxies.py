# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Proxies: a modifier of Blender that shows another mesh in the viewport, and not in renders.

It is a group of geometry nodes without code of this extension: files with it work without.
"""

from contextlib import contextmanager

import bpy

NAME = "Meshlet Proxy"
MARK = "gltf_meshlet_proxy"  # a property of the group


def add(obj, stand_in):
    """Lets the viewport show the mesh of another object in place of the object's own."""
    group = next(filter(_is_proxy, bpy.data.node_groups), None) or _node_group()
    modifier = obj.modifiers.new(NAME, "NODES")
    modifier.node_group = group
    socket = next(s for s in group.interface.items_tree if s.name == "Proxy")
    if hasattr(modifier, "properties"):  # in Blender 5.3, not in 5.0
        getattr(modifier.properties.inputs, socket.identifier).value = stand_in
    else:
        modifier[socket.identifier] = stand_in
    obj.modifiers.move(len(obj.modifiers) - 1, 0)  # armatures then move either mesh


@contextmanager
def full_detail():
    """Shows the full meshes meanwhile: with "Apply Modifiers", exporters write what is shown."""
    shown = [
        modifier
        for obj in bpy.data.objects
        for modifier in obj.modifiers
        if modifier.type == "NODES" and _is_proxy(modifier.node_group) and modifier.show_viewport
    ]
    for modifier in shown:
        modifier.show_viewport = False
    try:
        yield
    finally:
        for modifier in shown:
            modifier.show_viewport = True


def _is_proxy(group):
    """Whether it is the group below, whatever its name is in this file."""
    return group is not None and MARK in group


def _node_group():
    """The group: Is Viewport switches between the object's geometry and the proxy's."""
    group = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    group[MARK] = group.is_modifier = True
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
