"""Times trimesh of PyPI on mesh files: load_trimesh.py FILE… prints MB/s, the best of three each."""

import os
import sys
import time

import trimesh

for path in sys.argv[1:]:
    seconds = []
    for _ in range(3):
        started = time.perf_counter()
        mesh = trimesh.load(path, process=False, force="mesh", skip_materials=True)
        seconds.append(time.perf_counter() - started)
    rate = os.path.getsize(path) * 1e-6 / min(seconds)
    print(f"{os.path.basename(path):14} {len(mesh.faces):9} triangles  trimesh    {rate:8.1f} MB/s")
