"""PNG files as an independent library sees them: `pypng` of PyPI.

Run by tests/png_readers.rs:
    png_reader.py FILE BITS RAW    compare a file that flatray wrote with the RGBA samples in RAW, 16 bits each; exit code 77
                                   when the module is missing
"""

import struct
import sys

try:
    import png
except ImportError as error:
    print(error)
    sys.exit(77)


def check(path, bits, raw):
    chunks = list(png.Reader(filename=path).chunks())
    kinds = [kind for kind, _ in chunks]
    assert kinds[:3] == [b"IHDR", b"gAMA", b"sRGB"], kinds
    assert set(kinds[3:-1]) == {b"IDAT"} and kinds[-1] == b"IEND", kinds
    assert struct.unpack(">I", chunks[1][1]) == (45455,), chunks[1]
    assert chunks[2][1] == b"\0", chunks[2]

    width, height, rows, info = png.Reader(filename=path).read()
    assert (info["bitdepth"], info["planes"], info["alpha"], info["greyscale"]) == (bits, 4, True, False), info
    expected = open(raw, "rb").read()
    expected = struct.unpack(f"<{len(expected) // 2}H", expected)
    found = [sample for row in rows for sample in row]
    assert len(found) == width * height * 4
    differing = sum(a != b for a, b in zip(found, expected, strict=True))
    assert differing == 0, f"{differing} samples differ"


if __name__ == "__main__":
    check(sys.argv[1], int(sys.argv[2]), sys.argv[3])
