"""EXR files as an independent library sees them: the `OpenEXR` module of PyPI, the C++ library's own binding.

Run by tests/readers.rs:
    readers.py probe               exit code 77 when the modules are missing
    readers.py check FILE FOLDER   compare a file that flatray wrote with raw planes in FOLDER
    readers.py make FOLDER         write files for flatray to read
"""

import sys

try:
    import numpy as np
    import OpenEXR
except ImportError as error:
    print(error)
    sys.exit(77)


def check(path, folder):
    file = OpenEXR.File(path, separate_channels=True)
    assert len(file.parts) == 1, "one part"
    header = file.header()

    def window(name):
        low, high = header[name]
        return [int(v) for v in (*low, *high)]

    # Windows are inclusive in the file.
    assert window("displayWindow") == [0, 0, 99, 49], window("displayWindow")
    assert window("dataWindow") == [7, 5, 67, 39], window("dataWindow")
    assert header["type"] == OpenEXR.scanlineimage
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    assert header["lineOrder"] == OpenEXR.INCREASING_Y
    assert header["pixelAspectRatio"] == 1.0
    assert header["software"].startswith("flatray "), header["software"]
    rec709 = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290]
    assert np.allclose(header["chromaticities"], rec709, rtol=0, atol=1e-7), header["chromaticities"]

    channels = file.channels()
    assert list(channels) == ["A", "B", "G", "R", "id"], list(channels)
    for name, channel in channels.items():
        kind = np.uint32 if name == "id" else np.float32
        assert channel.pixels.dtype == kind, (name, channel.pixels.dtype)
        assert channel.pixels.shape == (35, 61)
        expected = np.fromfile(f"{folder}/{name}.raw", dtype="<u4")
        found = np.ascontiguousarray(channel.pixels).view(np.uint32).ravel()
        assert (found == expected).all(), f"channel {name} differs"


def make(folder):
    height, width = 37, 45
    # Every value is exact in 16 bits: small multiples of 1/64.
    ramp = (np.arange(height * width).reshape(height, width) % 200 / 64).astype("float32")
    color = {"R": ramp, "G": ramp * 2, "B": ramp * 4}
    scan = {"type": OpenEXR.scanlineimage}

    # The library writes into the dictionaries that it is given: it gets copies.
    def write(name, header, channels):
        OpenEXR.File(dict(header), dict(channels)).write(f"{folder}/{name}.exr")

    for name in ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24"]:
        method = getattr(OpenEXR, f"{name}_COMPRESSION")
        halves = {key: plane.astype("float16") for key, plane in color.items()}
        write(f"{name}_half", scan | {"compression": method}, halves)
        write(f"{name}_float", scan | {"compression": method}, color)
    for name in ["B44", "DWAA"]:
        write(f"{name}_refused", scan | {"compression": getattr(OpenEXR, f"{name}_COMPRESSION")}, color)

    tiles = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    write("tiled", tiles | {"compression": OpenEXR.ZIP_COMPRESSION}, color)
    write("grey", scan, {"Y": ramp})
    write("depth_refused", scan, {"Z": ramp})

    # Overscan, and a display window away from the origin: columns 3 … 42 and rows 0 … 36 of the pixels are inside.
    corners = lambda x0, y0, x1, y1: (np.array([x0, y0], dtype="int32"), np.array([x1, y1], dtype="int32"))
    windows = {"displayWindow": corners(-7, 10, 32, 60), "dataWindow": corners(-10, 20, 34, 56)}
    write("overscan", scan | windows, color)

    parts = [
        OpenEXR.Part(scan | {"compression": OpenEXR.ZIP_COMPRESSION}, {"Z": ramp}, "depth"),
        OpenEXR.Part(scan | {"compression": OpenEXR.PIZ_COMPRESSION}, color | {"id": ramp.astype("uint32")}, "beauty"),
    ]
    OpenEXR.File(parts).write(f"{folder}/parts.exr")


if __name__ == "__main__":
    if sys.argv[1:2] == ["check"]:
        check(*sys.argv[2:])
    elif sys.argv[1:2] == ["make"]:
        make(*sys.argv[2:])
