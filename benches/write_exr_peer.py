"""Times the OpenEXR library of PyPI on the file that `cargo bench --bench write_exr` leaves: write_exr_peer.py FILE [THREADS]

The same channels of the same types, scan lines, ZIP; what it writes is read back and compared. Prints seconds, the median of nine.
"""

import os
import sys
import tempfile
import time

import numpy as np
import OpenEXR

path = sys.argv[1]
OpenEXR.set_global_thread_count(int(sys.argv[2]) if len(sys.argv) > 2 else os.cpu_count())
with OpenEXR.File(path, separate_channels=True) as file:
    channels = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
out = os.path.join(tempfile.gettempdir(), "write_exr_peer.exr")
seconds = []
for _ in range(9):
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    image = OpenEXR.File(header, dict(channels))
    started = time.perf_counter()
    image.write(out)
    seconds.append(time.perf_counter() - started)
with OpenEXR.File(out, separate_channels=True) as file:
    for name, channel in file.channels().items():
        assert np.array_equal(channel.pixels, channels[name], equal_nan=True), name
seconds.sort()
print(f"OpenEXR, {len(channels)} channels: {seconds[4]:.3f} s ({seconds[0]:.3f} to {seconds[-1]:.3f}), {os.path.getsize(out) * 1e-6:.1f} MB")
