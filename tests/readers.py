"""EXR files as independent libraries see them: the `OpenEXR` module of PyPI, which is the C++ library's own binding, and
`OpenImageIO`, which has readers and attributes of its own.

Run by tests/readers.rs; the exit code is 77 when the modules are missing:
    readers.py check FILE FOLDER     compare a file that flatray wrote with raw planes in FOLDER
    readers.py layouts FOLDER        compare files of every kind with raw planes in FOLDER/half and FOLDER/float
    readers.py layouts_oiio FOLDER   the same with OpenImageIO
    readers.py same_oiio A B         whether two images have the same pixels in the same windows
    readers.py make FOLDER           write files for flatray to read
"""

import sys

import glob
import os

try:
    import numpy as np
    if "oiio" in "".join(sys.argv[1:2]):
        import OpenImageIO as oiio
    else:
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


WINDOW = (7, 5, 139, 95)
SHAPE = (91, 133)
COLOR = ["A", "B", "G", "R", "diffuse.B", "diffuse.G", "diffuse.R"]
CHANNELS = sorted(COLOR + ["Z", "object.I", "CryptoObject00.R", "CryptoObject01.R"])
PARTS = {
    "rgba": ["A", "B", "G", "R"],
    "diffuse": ["diffuse.B", "diffuse.G", "diffuse.R"],
    "Z": ["Z"],
    "object": ["object.I"],
    "CryptoObject": ["CryptoObject00.R", "CryptoObject01.R"],
}


def kinds(folder):
    """Files with what their names say: compression, layout, color, parts."""
    paths = sorted(glob.glob(f"{folder}/*.exr"))
    assert len(paths) == 40, len(paths)
    for path in paths:
        yield path, *os.path.basename(path)[:-4].split("_")


def assert_same(path, folder, color, name, pixels):
    is_half = color == "half" and name in COLOR
    dtype = np.uint32 if name == "object.I" else np.float16 if is_half else np.float32
    assert pixels.dtype == dtype, (path, name, pixels.dtype)
    assert pixels.shape == SHAPE, (path, name, pixels.shape)
    bits = np.uint16 if is_half else np.uint32
    found = np.ascontiguousarray(pixels).view(bits).ravel()
    expected = np.fromfile(f"{folder}/{color}/{name}.raw", dtype=bits)
    n = (found != expected).sum()
    assert n == 0, f"{path}: channel {name} differs in {n} pixels"


def layouts(folder):
    for path, compression, layout, color, parts in kinds(folder):
        file = OpenEXR.File(path, separate_channels=True)
        expected = PARTS if parts == "multi" else {None: CHANNELS}
        assert len(file.parts) == len(expected), path
        for index, (part_name, names) in enumerate(expected.items()):
            header = file.header(index)
            if part_name:
                assert header["name"] == part_name, (path, header["name"])
            assert header["type"] == (OpenEXR.tiledimage if layout == "tiles" else OpenEXR.scanlineimage), path
            method = {"none": "NO"}.get(compression, compression.upper())
            assert header["compression"] == getattr(OpenEXR, f"{method}_COMPRESSION"), path
            assert header["lineOrder"] == OpenEXR.INCREASING_Y
            window = [int(v) for corner in header["dataWindow"] for v in corner]
            assert tuple(window) == WINDOW, (path, window)
            is_data = part_name and part_name not in ("rgba", "diffuse")
            assert header["colorInteropID"] == ("data" if is_data else "lin_rec709_scene"), path
            assert header["flatray/number"] == 7 and header["a text of more than thirty-one bytes"] == "равнина"
            assert (header["worldToNDC"] == np.arange(16, dtype="float32").reshape(4, 4)).all()
            channels = file.channels(index)
            assert list(channels) == names, (path, list(channels))
            for name, channel in channels.items():
                assert_same(path, folder, color, name, channel.pixels)


def layouts_oiio(folder):
    for path, _compression, layout, color, parts in kinds(folder):
        file = oiio.ImageInput.open(path)
        assert file, oiio.geterror()
        expected = list(PARTS.values()) if parts == "multi" else [CHANNELS]
        for index, names in enumerate(expected):
            assert file.seek_subimage(index, 0), path
            spec = file.spec()
            assert (spec.x, spec.y, spec.x + spec.width - 1, spec.y + spec.height - 1) == WINDOW, path
            assert (spec.full_width, spec.full_height) == (150, 100), path
            assert spec.tile_width == (64 if layout == "tiles" else 0), path
            assert spec.getattribute("flatray/number") == 7, path
            assert sorted(spec.channelnames) == names, (path, spec.channelnames)
            for at, name in enumerate(spec.channelnames):
                pixels = file.read_image(index, 0, at, at + 1, spec.channelformat(at))
                assert pixels is not None, (path, file.geterror())
                assert_same(path, folder, color, name, pixels[:, :, 0])
        assert not file.seek_subimage(len(expected), 0), path


def same_oiio(a, b):
    a, b = [oiio.ImageBuf(path) for path in (a, b)]
    assert a.roi == b.roi and a.roi_full == b.roi_full, (a.roi, b.roi)
    assert a.spec().channelnames == b.spec().channelnames
    a, b = [image.get_pixels(oiio.HALF).view(np.uint16) for image in (a, b)]
    assert (a == b).all(), f"{(a != b).sum()} values differ"


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
    commands = {run.__name__: run for run in [check, layouts, layouts_oiio, same_oiio, make]}
    commands[sys.argv[1]](*sys.argv[2:])
