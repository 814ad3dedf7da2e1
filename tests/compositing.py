"""Mattes and parts of an EXR as independent libraries see them: `cryptomatte-api` and `OpenEXR` of PyPI.

Run by tests/compositing.rs:
    compositing.py probe                    exit code 77 when the modules are missing
    compositing.py mattes FILE NAME...      mattes by name, from the manifest, against the channels themselves
    compositing.py sums FILE LAYER...       layers that add up to the picture, in 16-bit floats
"""

import sys

try:
    import numpy as np
    import OpenEXR
    import cryptomatte_api
except ImportError as error:
    print(error)
    sys.exit(77)


def channels(path):
    with OpenEXR.File(path, separate_channels=True) as file:
        return {name: np.array(channel.pixels) for name, channel in file.channels().items()}


def mattes(path, *names):
    found = channels(path)
    loaded = {matte.metadata().name(): matte for matte in cryptomatte_api.Cryptomatte.load(path)}
    assert sorted(loaded) == ["CryptoMaterial", "CryptoObject"], sorted(loaded)
    objects = loaded["CryptoObject"]
    assert objects.num_levels() == 6, objects.num_levels()
    masks = objects.masks()
    assert set(names) <= set(masks), sorted(masks)
    height, width = found["A"].shape
    total = np.zeros((height, width))
    for name in names:
        mask = np.asarray(masks[name], dtype=np.float64).reshape(height, width)
        # The id that stands beside this name in most pixels, and what the channels say of it.
        own = np.zeros((height, width))
        for layer in ["CryptoObject00", "CryptoObject01", "CryptoObject02"]:
            for rank, weight in [("R", "G"), ("B", "A")]:
                ids = np.ascontiguousarray(found[f"{layer}.{rank}"]).view(np.uint32)
                own += np.where(ids == murmur3_32(name.encode()), found[f"{layer}.{weight}"], 0)
        assert np.abs(mask - own).max() <= 1e-6, name
        assert mask.max() == 1, (name, mask.max())
        total += mask
    assert np.abs(total - found["A"].astype(np.float64)).max() <= 2.0**-11, "mattes add up to coverage"


def murmur3_32(data, seed=0):
    """MurmurHash3, x86, 32 bits, written from the description; with the exponent that Cryptomatte asks for."""
    mask, h = 0xFFFFFFFF, seed
    rotl = lambda x, r: ((x << r) | (x >> (32 - r))) & mask
    mix = lambda k: rotl(k * 0xCC9E2D51 & mask, 15) * 0x1B873593 & mask
    n_whole = len(data) // 4 * 4
    for i in range(0, n_whole, 4):
        h = (rotl(h ^ mix(int.from_bytes(data[i : i + 4], "little")), 13) * 5 + 0xE6546B64) & mask
    if len(data) > n_whole:
        h ^= mix(int.from_bytes(data[n_whole:], "little"))
    h ^= len(data)
    for shift, factor in [(16, 0x85EBCA6B), (13, 0xC2B2AE35)]:
        h = (h ^ h >> shift) * factor & mask
    h ^= h >> 16
    return h ^ 1 << 23 if h >> 23 & 255 in (0, 255) else h


def sums(path, *layers):
    found = channels(path)
    for channel in "RGB":
        assert found[channel].dtype == np.float16, found[channel].dtype
        beauty = found[channel].astype(np.float64)
        parts = [found[f"{layer}.{channel}"] for layer in layers]
        assert all(part.dtype == np.float16 for part in parts)
        total = sum(part.astype(np.float64) for part in parts)
        # Each is within half a unit of 16-bit floats, or half of the smallest; no part is negative.
        bound = 2 * 2.0**-11 * beauty + (len(parts) + 1) * 2.0**-25
        assert beauty.max() > 0.1 and (np.abs(total - beauty) <= bound * (1 + 2.0**-10)).all(), channel


if __name__ == "__main__":
    {"probe": lambda: None, "mattes": mattes, "sums": sums}[sys.argv[1]](*sys.argv[2:])
