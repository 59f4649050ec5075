"""Materials of Raywright from Blender's shaders, by the names of `model.physical`."""

import math

from .nodes import ADJUSTED, Texture, ValueReader, colour, mean


class Reader(ValueReader):
    """Reads the shaders of one material. Each returns the inputs of a physical material, with Texture where a picture gives them."""

    def shader(self, socket, groups=()):
        """Inputs of a physical material, by Raywright's names, with Texture where a picture gives them; none of nothing."""
        found = self.origin(socket, groups)
        if found is None or found[1] is None:
            return None
        output, node, groups = found
        read = getattr(self, "shader_" + node.type.lower(), None)
        if read is None:
            self.notes.add(f"shader {node.bl_label}")
            return {"base_colour": (0.5, 0.5, 0.5), "specular": 0.0}
        return read(node, groups)

    def normal(self, node, groups, name="Normal"):
        socket = next((s for s in node.inputs if s.name == name), None)
        found = self.origin(socket, groups) if socket is not None and socket.is_linked else None
        if not found or found[1] is None:
            return {}
        _, inner, groups = found
        if inner.type == "BUMP":
            self.notes.add("bump maps")
            return self.normal(inner, groups)
        if inner.type == "NORMAL_MAP":
            value = self.input(inner, "Color", groups)
            if isinstance(value, Texture) and inner.space == "TANGENT":
                if value.changes:
                    self.notes.add(ADJUSTED)
                value = value.replaced(uv_name=inner.uv_map or value.uv_name, changes=(), factor=(1, 1, 1))
                return {"normal_texture": value, "normal_scale": self.constant(inner, "Strength", groups, 1)}
        self.notes.add("normals that are no tangent-space map")
        return {}

    def shader_bsdf_principled(self, node, groups):
        number = lambda name, fallback=0.0: self.input(node, name, groups, fallback)
        constant = lambda name, fallback=0.0: self.constant(node, name, groups, fallback)
        result = {
            "base_colour": colour(number("Base Color", (0.8,) * 3)),
            "metallic": number("Metallic"),
            "roughness": number("Roughness", 0.5),
            "ior": max(constant("IOR", 1.5), 1.0),
            "opacity": number("Alpha", 1.0),
            "transmission": number("Transmission Weight"),
            **self.normal(node, groups),
        }
        level, tint = constant("Specular IOR Level", 0.5), colour(number("Specular Tint", (1.0,) * 3))
        if level != 0.5 or tint != (1.0, 1.0, 1.0):
            tint = (1.0,) * 3 if isinstance(tint, Texture) else tint
            result.update(specular=1.0 if level > 0 else 0.0, specular_colour=tuple(2 * level * c for c in tint))
        self.principled_layers(node, groups, result, number, constant)
        strength = number("Emission Strength")
        light = self.emission(number("Emission Color", (1.0,) * 3), strength)
        if light:
            result["emission"] = light
        return result

    def principled_layers(self, node, groups, result, number, constant):
        if constant("Subsurface Weight") > 0:
            self.notes.add("subsurface scattering: the surface is matte")
        if constant("Diffuse Roughness") > 0:
            self.notes.add("roughness of the diffuse part")
        if constant("Coat Weight") > 0:
            result["clearcoat"] = {"factor": min(constant("Coat Weight"), 1.0), "roughness": constant("Coat Roughness", 0.03)}
            if abs(constant("Coat IOR", 1.5) - 1.5) > 0.01 or colour(number("Coat Tint", (1.0,) * 3)) != (1.0, 1.0, 1.0):
                self.notes.add("index and tint of a coat")
        if constant("Sheen Weight") > 0:
            tint = colour(number("Sheen Tint", (1.0,) * 3))
            tint = (1.0,) * 3 if isinstance(tint, Texture) else tint
            weight = min(constant("Sheen Weight"), 1.0)
            result["sheen"] = {"colour": tuple(min(weight * c, 1.0) for c in tint), "roughness": constant("Sheen Roughness", 0.5)}
            self.notes.add("sheen has other fibres than Cycles'")
        if constant("Anisotropic") > 0:
            result["anisotropy"] = {"strength": min(constant("Anisotropic"), 1.0), "rotation": 360 * constant("Anisotropic Rotation")}
            self.notes.add("anisotropy has another width than Cycles'")
        if constant("Thin Film Thickness") > 0:
            result["iridescence"] = {"thickness": constant("Thin Film Thickness"), "ior": constant("Thin Film IOR", 1.33)}
        if result["transmission"] == 1 and not isinstance(result["base_colour"], Texture):
            # Cycles takes the root at each of the two boundaries of a body.
            result["base_colour"] = tuple(math.sqrt(max(c, 0)) for c in result["base_colour"])

    def emission(self, light, strength):
        if isinstance(strength, Texture):
            strength = 1.0 if not isinstance(light, Texture) else strength
            self.notes.add(ADJUSTED)
            strength = 1.0
        strength = mean(strength)
        if strength <= 0:
            return None
        if isinstance(light, Texture):
            return light.replaced(factor=tuple(strength * c for c in light.factor))
        light = tuple(max(strength * c, 0) for c in colour(light))
        return light if any(light) else None

    def shader_emission(self, node, groups):
        light = self.emission(self.input(node, "Color", groups), self.input(node, "Strength", groups, 1.0))
        return {**BLACK, "emission": light} if light else dict(BLACK)

    shader_background = shader_emission

    def shader_bsdf_diffuse(self, node, groups):
        if self.constant(node, "Roughness", groups) > 0:
            self.notes.add("roughness of the diffuse part")
        return {"base_colour": colour(self.input(node, "Color", groups)), "specular": 0.0, **self.normal(node, groups)}

    def shader_subsurface_scattering(self, node, groups):
        self.notes.add("subsurface scattering: the surface is matte")
        return {"base_colour": colour(self.input(node, "Color", groups)), "specular": 0.0, **self.normal(node, groups)}

    def shader_bsdf_glossy(self, node, groups):
        tint = colour(self.input(node, "Color", groups))
        return {"base_colour": tint, "metallic": 1.0, "roughness": self.input(node, "Roughness", groups), **self.normal(node, groups)}

    def shader_bsdf_metallic(self, node, groups):
        return {"base_colour": colour(self.input(node, "Base Color", groups)), "metallic": 1.0, "roughness": self.input(node, "Roughness", groups), **self.normal(node, groups)}

    def shader_bsdf_glass(self, node, groups):
        return {
            "base_colour": colour(self.input(node, "Color", groups)),
            "transmission": 1.0,
            "roughness": self.input(node, "Roughness", groups),
            "ior": max(self.constant(node, "IOR", groups, 1.5), 1.0),
            **self.normal(node, groups),
        }

    def shader_bsdf_refraction(self, node, groups):
        self.notes.add("refraction without reflection: glass reflects, too")
        return self.shader_bsdf_glass(node, groups)

    def shader_bsdf_transparent(self, node, groups):
        tint = colour(self.input(node, "Color", groups, (1.0,) * 3))
        if isinstance(tint, Texture) or min(tint) < 0.999:
            self.notes.add("tinted transparency: its brightness alone counts")
        return {**BLACK, "opacity": 1 - (0.5 if isinstance(tint, Texture) else mean(tint))}

    def shader_bsdf_translucent(self, node, groups):
        tint = colour(self.input(node, "Color", groups))
        return {"base_colour": tint, "specular": 0.0, "diffuse_transmission": {"factor": 1.0, "colour": tint}}

    def shader_bsdf_sheen(self, node, groups):
        self.notes.add("sheen has other fibres than Cycles'")
        tint = colour(self.input(node, "Color", groups))
        return {**BLACK, "sheen": {"colour": (1.0,) * 3 if isinstance(tint, Texture) else tint, "roughness": self.constant(node, "Roughness", groups, 0.5)}}

    shader_bsdf_velvet = shader_bsdf_sheen

    def shader_mix_shader(self, node, groups):
        factor = self.value(node.inputs[0], groups)
        found = self.origin(node.inputs[0], groups)
        viewing = found and found[1] is not None and found[1].type in ("FRESNEL", "LAYER_WEIGHT")
        a, b = (self.shader(node.inputs[i], groups) or dict(BLACK) for i in (1, 2))
        if is_clear(a):
            return {**b, "opacity": factor}
        if is_clear(b):
            return {**a, "opacity": 1 - (0.5 if isinstance(factor, Texture) else mean(factor))}
        if viewing and b.get("metallic") == 1.0 and not a.get("metallic"):
            # Paint under a varnish, as Principled has it.
            return {**a, "specular": 1.0, "roughness": b["roughness"]}
        for matte, gloss, share in ((a, b, factor), (b, a, 1 - (0.5 if isinstance(factor, Texture) else mean(factor)))):
            if not isinstance(share, Texture) and mean(share) <= 0.5 and is_varnish(matte, gloss):
                # A varnish that reflects the share of the glossy shader head-on: 0.04 is that of index 1.5.
                tint = tuple(mean(share) / 0.04 * c for c in gloss["base_colour"])
                return {**matte, "specular": 1.0, "specular_colour": tint, "roughness": gloss["roughness"]}
        self.notes.add("mixed shaders: one surface with the mean of their inputs")
        return mixed_surfaces(a, b, 0.5 if isinstance(factor, Texture) else min(max(mean(factor), 0), 1))

    def shader_add_shader(self, node, groups):
        a, b = (self.shader(node.inputs[i], groups) or dict(BLACK) for i in (0, 1))
        for one, other in ((a, b), (b, a)):
            if is_dark(one):
                return {**other, **({"emission": one["emission"]} if "emission" in one else {})}
        self.notes.add("added shaders: the first alone counts")
        return a


BLACK = {"base_colour": (0.0, 0.0, 0.0), "specular": 0.0}


def is_dark(surface):
    return surface.get("base_colour") == (0.0, 0.0, 0.0) and not set(surface) - {"base_colour", "specular", "emission"}


def is_varnish(matte, gloss):
    return matte.get("specular") == 0 and set(matte) <= {"base_colour", "specular", "normal_texture", "normal_scale"} and gloss.get("metallic") == 1 and isinstance(gloss["base_colour"], tuple)


def is_clear(surface):
    return surface.get("opacity") == 0 and "emission" not in surface


def mixed_surfaces(a, b, factor):
    """One surface between two: means of numbers and colours; textures and layers of the one that weighs more."""
    heavier = a if factor <= 0.5 else b
    result = {}
    for key in {**a, **b}:
        x, y = (surface.get(key, DEFAULTS.get(key)) for surface in (a, b))
        if isinstance(x, float) and isinstance(y, float):
            result[key] = (1 - factor) * x + factor * y
        elif isinstance(x, tuple) and isinstance(y, tuple):
            result[key] = tuple((1 - factor) * p + factor * q for p, q in zip(x, y))
        elif key == "emission" and (x is None or y is None):
            light, share = (x, 1 - factor) if y is None else (y, factor)
            result[key] = light.replaced(factor=tuple(share * c for c in light.factor)) if isinstance(light, Texture) else tuple(share * c for c in light)
        elif key in heavier:
            result[key] = heavier[key]
        elif isinstance(x, Texture) or isinstance(y, Texture):
            result[key] = x if isinstance(x, Texture) else y
    return result


DEFAULTS = {"metallic": 0.0, "roughness": 1.0, "ior": 1.5, "transmission": 0.0, "opacity": 1.0, "specular": 1.0, "specular_colour": (1.0, 1.0, 1.0), "normal_scale": 1.0}
