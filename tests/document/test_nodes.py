"""The node hierarchy: cycles, repeats, and depths that no recursion reaches."""

import pytest

from gltf_ext.document import nodes as nodes_module
from gltf_ext.document.document import Document
from gltf_ext.document.nodes import placed_nodes
from gltf_ext.errors import MeshletError


class CountingSet(set):
    """A set that counts the members that its methods look at."""

    work = 0

    def _counted(self, method, amount, *arguments):
        CountingSet.work += amount
        return getattr(set, method)(self, *arguments)

    def add(self, member):
        return self._counted("add", 1, member)

    def remove(self, member):
        return self._counted("remove", 1, member)

    def __contains__(self, member):
        return self._counted("__contains__", 1, member)

    def __or__(self, other):
        return CountingSet(self._counted("__or__", len(self) + len(other), other))

    def copy(self):
        return CountingSet(self._counted("copy", len(self)))


def document(nodes, **more):
    return Document({"asset": {"version": "2.0"}, "nodes": nodes, **more})


def chain(length):
    return [*({"children": [i + 1]} for i in range(length - 1)), {"translation": [1, 2, 3]}]


def test_deep_chains_take_linear_work(monkeypatch):
    """The ancestors of a node are not copied for each node below it."""
    monkeypatch.setattr(nodes_module, "set", CountingSet, raising=False)
    assert sum(1 for _ in placed_nodes(document(chain(20_000)))) == 20_000
    assert 20_000 < CountingSet.work < 100_000


def test_parents_come_first_and_move_their_children():
    nodes = [{"translation": [1, 0, 0], "children": [2, 1]}, {}, {"scale": [2, 2, 2]}]
    found = list(placed_nodes(document(nodes)))
    assert [matrix[0, 3] for _, matrix in found] == [1, 1, 1]
    assert [matrix[0, 0] for _, matrix in found] == [1, 2, 1]


@pytest.mark.parametrize("children", [[[0]], [[1], [0]], [[1], [2], [1]]])
def test_cycles_are_refused(children):
    nodes = [{"children": c} for c in children]
    with pytest.raises(MeshletError, match="its own ancestor"):
        list(placed_nodes(document(nodes, scenes=[{"nodes": [0]}])))


def test_a_node_may_have_two_parents():
    nodes = [{"children": [2]}, {"children": [2]}, {}]
    assert sum(1 for _ in placed_nodes(document(nodes))) == 4


def test_places_do_not_double_with_every_node():
    nodes = [*({"children": [i + 1, i + 1]} for i in range(40)), {}]
    with pytest.raises(MeshletError, match="too many parents"):
        list(placed_nodes(document(nodes)))


def test_transforms_beyond_floats_are_refused_without_a_warning(recwarn):
    nodes = [
        {"scale": [1e300] * 3, "rotation": [1e300] * 4, "children": [1]},
        {"scale": [1e300] * 3},
    ]
    small = [{"scale": [1e10] * 3, "children": [1]}, {"scale": [1e300] * 3}]
    for above in (nodes, small):
        with pytest.raises(MeshletError, match="transform is not finite"):
            list(placed_nodes(document(above)))
    assert not recwarn
