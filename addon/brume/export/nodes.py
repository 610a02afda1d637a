# SPDX-License-Identifier: GPL-3.0-or-later
"""Following links in a node tree, through reroutes, groups and muted nodes."""

from typing import NamedTuple

import bpy

from ..compat import identity


class Place(NamedTuple):
    """An input socket, and the group nodes around it, outermost first."""
    socket: bpy.types.NodeSocket
    path: tuple = ()


class Source(NamedTuple):
    """What feeds an input: a node's output. Where node is None nothing does, and `socket` holds
    the value."""
    node: object
    output: object
    socket: object
    path: tuple

    def input(self, identifier):
        """A place among the node's inputs, or None."""
        socket = by_identifier(self.node.inputs, identifier)
        return socket and Place(socket, self.path)


def by_identifier(sockets, identifier):
    return next((s for s in sockets if s.identifier == identifier), None)


def _group_output(group):
    outputs = [n for n in group.node_tree.nodes if n.bl_idname == 'NodeGroupOutput']
    return next((n for n in outputs if n.is_active_output), outputs[0] if outputs else None)


def follow(place):
    socket, path = place
    while True:
        link = next((k for k in socket.links if k.is_valid and not k.is_muted), None)
        if link is None:
            return Source(None, None, socket, path)
        node, output = link.from_node, link.from_socket
        if node.mute:
            through = next((k for k in node.internal_links if k.to_socket == output), None)
            if through is None:
                return Source(None, None, socket, path)
            socket = through.from_socket
        elif node.bl_idname == 'NodeReroute':
            socket = node.inputs[0]
        elif node.bl_idname == 'ShaderNodeGroup':
            inner = _group_output(node) if node.node_tree else None
            inside = inner and by_identifier(inner.inputs, output.identifier)
            if inside is None:
                return Source(None, None, socket, path)
            socket, path = inside, (*path, node)
        elif node.bl_idname == 'NodeGroupInput' and path:
            socket = by_identifier(path[-1].inputs, output.identifier)
            path = path[:-1]
        else:
            return Source(node, output, socket, path)


def output_place(tree, identifier):
    """The place of an output's socket ('Surface', 'Volume') of a material's, world's or lamp's
    tree; None without an output node."""
    node = next(filter(None, map(tree.get_output_node, ('ALL', 'CYCLES', 'EEVEE'))), None)
    socket = node and by_identifier(node.inputs, identifier)
    return socket and Place(socket)


def output_source(tree, identifier):
    """What feeds an output's socket, or None."""
    place = output_place(tree, identifier)
    source = place and follow(place)
    return source if source and source.node else None


def identities(owner):
    """Of a material, world or lamp, of all node groups that it is made of, and of the objects whose
    coordinates it asks for."""
    found, trees = {identity(owner)}, [owner.node_tree]
    while trees:
        tree = trees.pop()
        for node in tree.nodes if tree else ():
            group = getattr(node, "node_tree", None)
            if group and identity(group) not in found:
                found.add(identity(group))
                trees.append(group)
            if node.bl_idname == 'ShaderNodeTexCoord' and node.object:
                found.add(identity(node.object))
    return found


def label(node):
    """How a report names a node: by its label in the add menu."""
    return node.bl_label if not node.label else f'{node.bl_label} "{node.label}"'
