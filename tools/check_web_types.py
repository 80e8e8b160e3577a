"""Checks the types of web/ with TypeScript: python tools/check_web_types.py

The sources are JavaScript, whose types the compiler infers (checkJs); the published declarations
lie beside them, where the compiler would read them instead. So it gets a copy of both, in folders
of their own, and a file that assigns every module to its declaration: a name, a member, a parameter
or a result that only one of them has is an error.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WEB = ROOT / "web"
MODULES = ROOT / "build" / "node" / "node_modules"
FOLDER = ROOT / "build" / "web-types"
OTHERS = {  # engines of the tests' machine
    "three": ["@types/three"],
    "three/addons/*": ["@types/three/examples/jsm/*"],
    "@babylonjs/*": ["@babylonjs/*"],
    "@gltf-transform/*": ["@gltf-transform/*"],
}
# A module's exports; of classes without the static members, which come from engines.
INSTANCES = """
type Exports<Module> = {
  [Name in keyof Module]: Module[Name] extends abstract new (...given: infer Given) => infer One
    ? new (...given: Given) => One
    : Module[Name];
};
"""
OPTIONS = {
    "allowJs": True,
    "checkJs": True,
    "noEmit": True,
    "strict": False,  # parameters have no types, but for those of the declarations
    "strictBindCallApply": True,
    "skipLibCheck": True,
    "target": "esnext",
    "module": "esnext",
    "moduleResolution": "bundler",
    "lib": ["esnext", "dom", "dom.iterable"],
}


def main() -> int:
    """Print errors with the places in web/. Return the exit status."""
    compiler = MODULES / "typescript" / "bin" / "tsc"
    needed = [compiler, *(MODULES / path.split("*")[0] for [path] in OTHERS.values())]
    if not all(path.exists() for path in needed):
        print("check_web_types: TypeScript or an engine is not installed (make .venv/web)")
        return 0
    copy()
    done = subprocess.run(
        ["node", compiler, "--pretty", "false", "-p", FOLDER], capture_output=True, text=True
    )
    text = re.sub(r"[^\s\"(]*/?web-types/(?:sources|published)/", "web/", done.stdout)
    print(re.sub(r"^(?:sources|published)/", "web/", text, flags=re.M) + done.stderr, end="")
    return done.returncode


def copy() -> None:
    shutil.rmtree(FOLDER, ignore_errors=True)
    for file in sorted([*WEB.rglob("*.js"), *WEB.rglob("*.d.ts")]):
        kind = "published" if file.suffix == ".ts" else "sources"
        copied = FOLDER / kind / file.relative_to(WEB)
        copied.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copied)
    paths = {name: [str(MODULES / path) for path in found] for name, found in OTHERS.items()}
    types = [str(MODULES / "@webgpu" / "types"), str(MODULES / "@types" / "node")]
    options = {**OPTIONS, "paths": paths, "types": types}
    settings = {"compilerOptions": options, "include": ["sources/**/*", "published/**/*", "*.ts"]}
    (FOLDER / "tsconfig.json").write_text(json.dumps(settings))
    (FOLDER / "exports.ts").write_text("".join(assignments()))


def assignments() -> list[str]:
    """Lines of TypeScript that assign each module of the package to its declaration."""
    exports = json.loads((WEB / "package.json").read_text())["exports"].values()
    lines = [INSTANCES]
    for number, entry in enumerate(one for one in exports if isinstance(one, dict)):
        module, types = (entry[key].removesuffix(".d.ts") for key in ("default", "types"))
        lines += [
            f"import * as source{number} from './sources/{module}';\n",
            f"import * as published{number} from './published/{types}.js';\n",
            f"export const check{number}: Exports<typeof published{number}> = source{number};\n",
        ]
    return lines


if __name__ == "__main__":
    sys.exit(main())
