"""Pictures and textures of Blender in the scene file."""

import os

import numpy as np

from . import exr

READ = {".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".gif", ".tif", ".tiff", ".hdr", ".exr"}
LINEAR = {"Non-Color", "Raw", "Linear", "Linear Rec.709", "Generic Data"}
MOST_UV_SETS = 8


class Pictures:
    """Writes pictures that are not files beside the scene, and names images, textures and sets of coordinates."""

    def image(self, image, changes=()):
        """Name of a picture of Blender in the file. One that has no pixels is pink, as in Blender."""
        key = (image.name_full, *(name for name, _ in changes))
        if key not in self.image_names:
            path = self.changed_image(image, changes) if changes else self.image_file(image)
            if path is None:
                self.note("pictures that can't be read", image.name)
                path = self.png(np.array([[[255, 0, 255, 255]]], np.uint8))
            self.image_names[key] = f"image {len(self.image_names)}"
            self.description["images"].append({"name": self.image_names[key], "path": path})
        return self.image_names[key]

    def image_file(self, image):
        import bpy

        path = bpy.path.abspath(image.filepath, library=image.library) if image.filepath else ""
        ending = os.path.splitext(path)[1].lower()
        if image.source in {"TILED", "SEQUENCE", "MOVIE"}:
            self.note("tiles and frames of pictures: one alone is shown", image.name)
        elif not image.is_dirty and ending in READ:
            if image.packed_file:
                return self.write(f"image{len(self.image_names)}{ending}", bytes(image.packed_file.data))
            if image.source == "FILE" and os.path.isfile(path):
                return os.path.realpath(path).replace(os.sep, "/")
        pixels = image_pixels(image)
        if pixels is None:
            return None
        if not image.is_float:
            return self.png((np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8))
        name = f"image{len(self.image_names)}.exr"
        exr.write(os.path.join(self.folder, name), pixels)
        return name

    def changed_image(self, image, changes):
        """A picture whose linear colours went through functions, as sRGB codes."""
        pixels = image_pixels(image)
        if pixels is None:
            return None
        colours = pixels[..., :3].astype(float)
        if not is_linear(image):
            colours = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
        for _, function in changes:
            colours = function(colours)
        colours = np.clip(colours, 0, 1)
        pixels[..., :3] = np.where(colours <= 0.0031308, 12.92 * colours, 1.055 * colours ** (1 / 2.4) - 0.055)
        return self.png((np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8))

    def png(self, codes):
        name = f"image{len(self.image_names)}.png"
        exr.write_png(os.path.join(self.folder, name), codes)
        return name

    def write(self, name, content):
        with open(os.path.join(self.folder, name), "wb") as file:
            file.write(content)
        return name

    def texture(self, texture):
        """Use of a texture in a material."""
        image = self.image(texture.image, texture.changes)
        space = "linear" if is_linear(texture.image) and not texture.changes else "srgb"
        key = (image, texture.nearest, texture.clamp, space)
        if key not in self.texture_names:
            name = f"texture {len(self.texture_names)}"
            self.texture_names[key] = name
            wrap = "clamp" if texture.clamp else "repeat"
            entry = {"name": name, "image": image, "colour_space": space, "filter": "nearest" if texture.nearest else "bilinear"}
            self.description["textures"].append({**entry, "wrap_u": wrap, "wrap_v": wrap})
        use = {"name": self.texture_names[key], "uv_set": self.uv_set(texture.uv_name)}
        if texture.matrix is not None:
            # Blender's v grows upwards, the file's downwards.
            (a, b, c), (d, e, f) = texture.matrix
            use["uv_transform"] = [[a, -b, b + c], [-d, e, 1 - e - f]]
        if texture.channel:
            use["channel"] = texture.channel
        elif texture.factor != (1, 1, 1):
            use["factor"] = list(texture.factor)
        return use

    def uv_set(self, name):
        """Set 0 is the active map of each mesh; the others have one number in all meshes."""
        if not name:
            return 0
        if name not in self.uv_names:
            if len(self.uv_names) == MOST_UV_SETS - 1:
                self.note("more than eight UV maps", name)
                return 0
            self.uv_names.append(name)
        return 1 + self.uv_names.index(name)


def is_linear(image):
    return image.is_float or image.colorspace_settings.name in LINEAR


def image_pixels(image):
    """Pixels as Blender has them, rows from the top, RGBA; none of a picture that can't be read."""
    width, height = image.size
    if not width or not height:
        return None
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)[::-1]
    whole = np.ones((height, width, 4), np.float32)
    if image.channels < 3:
        whole[..., :3] = pixels[..., :1]
    else:
        whole[..., : image.channels] = pixels
    return whole
