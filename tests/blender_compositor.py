"""What Blender's compositor makes of an EXR with mattes and lobes. Not run by `cargo test`: Blender is 400 MB.

    python3 -m venv VENV && VENV/bin/pip install bpy==4.5.15      bpy wants an older numpy: an environment of its own
    VENV/bin/python tests/blender_compositor.py FLATRAY           FLATRAY is the program; ends with 0 if all is well

Renders scenes/light_groups.toml and asks, in Blender:
- that the matte of each object, extracted by the Cryptomatte node, is the renderer's own coverage within 1e-3. That
  coverage is counted apart from any matte, in a render of twice the size with one sample in the centre of each pixel: the
  same points as a grid of four.
- that the six lobes, added up by the compositor, are the beauty: each is within half a unit of 16-bit floats.
- that the light groups add up likewise.
"""

import os
import subprocess
import sys
import tempfile

import bpy
import numpy as np

SCENE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "scenes", "light_groups.toml")
WIDTH, HEIGHT = 96, 72
OBJECTS = ["floor", "clay", "mirror", "glass"]
LOBES = ["ambient", "diffuse", "specular", "reflection", "refraction", "background"]
LIGHTS = ["light_ambient", "light_key", "light_fill", "light_rim"]


def flatray(program, width, height, out, *options):
    size = ["--width", str(width), "--height", str(height), "-o", out, "--quiet"]
    subprocess.run([program, "render", SCENE, *size, *options], check=True)


class Compositor:
    """A node tree whose result goes to a 32-bit EXR, which is read back."""

    def __init__(self, folder):
        self.folder, self.n_runs = folder, 0
        self.scene = bpy.context.scene
        self.scene.use_nodes = True
        self.scene.render.engine = "CYCLES"
        self.scene.render.resolution_percentage = 100
        settings = self.scene.render.image_settings
        settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
        settings.exr_codec = "ZIP"
        self.tree = self.scene.node_tree
        self.tree.nodes.clear()

    def result(self, socket, width=WIDTH, height=HEIGHT):
        """Rows from the top, RGBA."""
        out = self.tree.nodes.new("CompositorNodeComposite")
        self.tree.links.new(socket, out.inputs["Image"])
        self.n_runs += 1
        self.scene.render.resolution_x, self.scene.render.resolution_y = width, height
        self.scene.render.filepath = os.path.join(self.folder, f"run{self.n_runs}.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(self.scene.render.filepath)
        image.colorspace_settings.name = "Non-Color"
        pixels = np.array(image.pixels[:], dtype=np.float64).reshape(height, width, 4)[::-1]
        bpy.data.images.remove(image)
        self.tree.nodes.clear()
        return pixels

    def source(self, image):
        node = self.tree.nodes.new("CompositorNodeImage")
        node.image = image
        return node

    def matte(self, image, name):
        node = self.tree.nodes.new("CompositorNodeCryptomatteV2")
        node.source, node.image = "IMAGE", image
        node.layer_name = "CryptoObject"
        node.matte_id = name
        return self.result(node.outputs["Matte"])[:, :, 0]

    def total(self, image, passes):
        node = self.source(image)
        socket = node.outputs[passes[0]]
        for name in passes[1:]:
            add = self.tree.nodes.new("CompositorNodeMixRGB")
            add.blend_type = "ADD"
            add.inputs["Fac"].default_value = 1.0
            self.tree.links.new(socket, add.inputs[1])
            self.tree.links.new(node.outputs[name], add.inputs[2])
            socket = add.outputs["Image"]
        return self.result(socket)[:, :, :3]

    def beauty(self, image):
        return self.result(self.source(image).outputs["Combined"])[:, :, :3]

    def ids(self, path):
        """The object ids of an image of twice the size, which Blender shows as floats."""
        image = bpy.data.images.load(path)
        return self.result(self.source(image).outputs["object"], 2 * WIDTH, 2 * HEIGHT)[:, :, 0]


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        picture, ids = os.path.join(folder, "picture.exr"), os.path.join(folder, "ids.exr")
        grid = ["--samples", "4", "--sampler", "grid", "--aov", "lobes,lights,cryptomatte"]
        flatray(program, WIDTH, HEIGHT, picture, *grid)
        flatray(program, 2 * WIDTH, 2 * HEIGHT, ids, "--samples", "1", "--aov", "object")
        compositor = Compositor(folder)
        found = compositor.ids(ids)
        image = bpy.data.images.load(picture)
        for row, name in enumerate(OBJECTS):
            own = (found == row + 1).reshape(HEIGHT, 2, WIDTH, 2).mean(axis=(1, 3))
            matte = compositor.matte(image, name)
            worst = np.abs(matte - own).max()
            print(f"matte of {name}: covers {own.sum():.2f} pixels, largest difference {worst:.2e}")
            assert own.sum() > 10 and worst <= 1e-3, name
        beauty = compositor.beauty(image)
        for what, passes in [("lobes", LOBES), ("lights", LIGHTS)]:
            total = compositor.total(image, passes)
            # Half of a unit of 16-bit floats for each part and for the beauty; parts are not negative. Sums in 32 bits.
            bound = 2 * beauty * 2.0**-11 + len(passes) * 2.0**-25 + len(passes) * beauty * 2.0**-24
            worst = np.abs(total - beauty)
            print(f"sum of {what}: largest difference {worst.max():.2e}, of the bound {(worst / bound).max():.2f}")
            assert beauty.max() > 0.5 and (worst <= bound * 1.001).all(), what
    print("all is well")


if __name__ == "__main__":
    main(sys.argv[1])
