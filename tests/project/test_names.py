"""Names say what a value is: no participle stands for a noun."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("gltf_ext", "gltf_scene", "gltf_meshlet")
# Words for any value. Those of the industry, such as compressed, encoded and used, are not here.
WORDS = re.compile(
    "asked|begun|built|carried|chosen|counted|done|dropped|found|given|gone|held|here|joined|kept|"
    "known|left|lost|made|named|needed|opened|own|placed|shown|stated|taken|there|waiting|wanted|"
    "written"
)
TYPE = re.compile(r"(?:struct|class|enum(?: class)?) (\w+)(?: final)?(?: :.*)? \{")


def names_of(tree):
    """(name, line) of all variables, attributes, parameters, functions and classes."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Store):
            yield node.id if isinstance(node, ast.Name) else node.attr, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name, node.lineno


def is_forbidden(name):
    # Constants may be statuses.
    return not name.isupper() and WORDS.fullmatch(name.strip("_").lower()) is not None


def test_no_participle_is_a_name():
    problems = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        for name, line in names_of(ast.parse(path.read_text(encoding="utf-8")))
        if is_forbidden(name)
    ]
    assert not problems, "\n".join(problems)


def test_participles_are_noticed():
    source = "class Found:\n def kept(self, given):\n  self.left = made = given\nDONE = used = 1\n"
    names = [name for name, _ in names_of(ast.parse(source)) if is_forbidden(name)]
    assert sorted(names) == ["Found", "given", "kept", "left", "made"]


def types_of(source):
    """(namespace, name) of each C++ type that other files may see: outside anonymous namespaces."""
    namespaces = []
    for line in source.splitlines():
        if opened := re.match(r"(?:inline )?namespace ([\w:]*) ?\{", line):
            namespaces.append(opened[1])
        elif line.startswith("}  // namespace"):
            namespaces.pop()
        elif (defined := TYPE.match(line)) and "" not in namespaces:
            yield "::".join(namespaces), defined[1]


def test_each_type_of_the_codec_has_its_own_name():
    """Two of one name break the rule of one definition: at -O0 one takes the other's functions."""
    files = {}
    for path in sorted((ROOT / "codec").rglob("*.[hc]*")):
        for name in set(types_of(path.read_text(encoding="utf-8"))):
            files.setdefault(name, []).append(path.relative_to(ROOT).as_posix())
    assert len(files) > 100
    assert {name: paths for name, paths in files.items() if len(paths) > 1} == {}


def test_types_that_other_files_see_are_noticed():
    source = """namespace a {\nnamespace {\nstruct Own {\n}  // namespace
class Seen : public Base {\nstruct Declared;\n  struct Inner {\n}  // namespace a"""
    assert list(types_of(source)) == [("a", "Seen")]
