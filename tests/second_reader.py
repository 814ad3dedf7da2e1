"""Mesh files as an independent library sees them: trimesh of PyPI, without merging or mending.

Run by tests/second_reader.rs: second_reader.py FOLDER prints name, triangles, and the box of each mesh in a folder, one a
line; exit code 77 when the module is missing.
"""

import gzip
import os
import sys

try:
    import numpy
    import trimesh
except ImportError as error:
    print(error)
    sys.exit(77)

for name in sorted(os.listdir(sys.argv[1])):
    plain = name[:-3] if name.endswith(".gz") else name
    kind = os.path.splitext(plain)[1].lower().lstrip(".")
    if kind not in ("ply", "obj", "stl", "off"):
        continue
    with (gzip.open if name.endswith(".gz") else open)(os.path.join(sys.argv[1], name), "rb") as file:
        mesh = trimesh.load(file, file_type=kind, process=False, force="mesh", skip_materials=True)
    # The box of what faces use, rounded as we round it.
    corners = mesh.vertices[mesh.faces.ravel()].astype(numpy.float32)
    numbers = [*corners.min(axis=0), *corners.max(axis=0)]
    print(name.replace(" ", "_"), len(mesh.faces), *(float(x).hex() for x in numbers))
