"""Values of Blender's nodes: numbers, colours and textures. What a node says beyond that is put into `notes`.

Only attributes of the nodes are read, so that stand-ins take their place in the tests.
"""

import math

import numpy as np

from .colours import ARRAY_MATH, BLENDS, LUMINANCE, MATH, blackbody, shifted_hue, to_grey

MAPPED = "a texture's coordinates other than UV maps"
MEAN = "procedural textures and ramps of them: their mean colour is shown"
ADJUSTED = "some combinations of pictures by nodes"


class Texture:
    """A picture by its coordinates, times a colour, or one of its channels. `changes` are pairs of a name and a function
    of linear pixels (an array of rows, columns, RGBA), which are applied to the whole picture in turn."""

    def __init__(self, image, nearest, clamp, uv_name, matrix, channel=None, factor=(1, 1, 1), changes=()):
        self.image, self.nearest, self.clamp = image, nearest, clamp
        self.uv_name, self.matrix, self.channel, self.factor, self.changes = uv_name, matrix, channel, factor, changes

    def replaced(self, **values):
        return Texture(**{**vars(self), **values})

    def changed(self, name, function):
        """The texture whose colours went through a function, after its own factor."""
        earlier = self.changes
        if self.factor != (1, 1, 1):
            factor = np.array(self.factor)
            earlier = (*earlier, (f"times {self.factor}", lambda colours: colours * factor))
        return self.replaced(changes=(*earlier, (name, function)), factor=(1, 1, 1))


def mean(value):
    """One number of a constant colour or number."""
    return sum(value) / 3 if isinstance(value, tuple) else value


def colour(value):
    return value if isinstance(value, (tuple, Texture)) else (value,) * 3


class ValueReader:
    """Reads the values of one material. Nodes of groups are read with the stack of the groups around them."""

    def __init__(self, notes):
        self.notes = notes
        self.uses_vertex_colours = False

    # ------------------------------------------------------------------------------------------------------------- links

    def origin(self, socket, groups):
        """The output and its groups that a linked input takes its value from; none of an input without a link."""
        while socket.is_linked and socket.links:
            link = socket.links[0]
            node, output = link.from_node, link.from_socket
            if getattr(node, "mute", False) or node.type == "REROUTE":
                passing = [i for i in node.inputs if i.type == output.type and i.is_linked] or [i for i in node.inputs if i.type == output.type]
                if not passing:
                    return None
                socket = passing[0]
            elif node.type == "GROUP" and node.node_tree:
                inner = next((n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and getattr(n, "is_active_output", True)), None)
                if inner is None:
                    return None
                socket, groups = next(i for i in inner.inputs if i.identifier == output.identifier), (*groups, node)
            elif node.type == "GROUP_INPUT" and groups:
                socket = next(i for i in groups[-1].inputs if i.identifier == output.identifier)
                groups = groups[:-1]
            else:
                return output, node, groups
        return socket, None, groups

    def default(self, socket):
        value = getattr(socket, "default_value", 0.0)
        return tuple(float(c) for c in value[:3]) if hasattr(value, "__len__") else float(value)

    # ------------------------------------------------------------------------------------------------------------ values

    def value(self, socket, groups=()):
        """A number, a colour or a texture."""
        found = self.origin(socket, groups)
        if found is None:
            return 0.0
        output, node, groups = found
        if node is None:
            return self.default(output)
        read = getattr(self, "value_" + node.type.lower(), None)
        if read:
            return read(node, output, groups)
        self.notes.add(MEAN)
        if node.type.startswith("TEX_"):
            return self.procedural(node, groups)
        return 0.5

    def input(self, node, name, groups, fallback=0.0):
        socket = next((s for s in node.inputs if s.name == name and getattr(s, "enabled", True)), None)
        return fallback if socket is None else self.value(socket, groups)

    def constant(self, node, name, groups, fallback=0.0):
        """A number of an input; of a texture a half, with a note."""
        value = self.input(node, name, groups, fallback)
        if isinstance(value, Texture):
            self.notes.add(ADJUSTED)
            return 0.5
        return mean(value)

    def procedural(self, node, groups):
        if node.type in ("TEX_CHECKER", "TEX_BRICK"):
            a, b = (colour(self.input(node, name, groups)) for name in ("Color1", "Color2"))
            if not isinstance(a, Texture) and not isinstance(b, Texture):
                return tuple((x + y) / 2 for x, y in zip(a, b))
        return 0.5

    def value_rgb(self, node, output, groups):
        return self.default(output)

    value_value = value_rgb

    def value_tex_image(self, node, output, groups):
        if node.image is None:
            return (1.0, 0.0, 1.0) if output.name != "Alpha" else 1.0
        if getattr(node, "projection", "FLAT") != "FLAT":
            self.notes.add(MAPPED)
        uv_name, matrix = self.coordinates(node.inputs[0], groups)
        channel = "alpha" if output.name == "Alpha" else None
        clamp = getattr(node, "extension", "REPEAT") in ("EXTEND", "CLIP")
        return Texture(node.image, getattr(node, "interpolation", "") == "Closest", clamp, uv_name, matrix, channel)

    def coordinates(self, socket, groups):
        """Name of the UV map (empty: the active one) and the 2 by 3 matrix of Mapping nodes before it."""
        found = self.origin(socket, groups)
        if not socket.is_linked or found is None or found[1] is None:
            return "", None
        output, node, groups = found
        if node.type == "UVMAP":
            return node.uv_map, None
        if node.type == "TEX_COORD" and output.name == "UV":
            return "", None
        if node.type == "MAPPING":
            name, inner = self.coordinates(node.inputs[0], groups)
            if inner is not None:
                self.notes.add(MAPPED)
            return name, self.mapping(node, groups)
        if node.type == "ATTRIBUTE":
            return node.attribute_name, None
        self.notes.add(MAPPED)
        return "", None

    def mapping(self, node, groups):
        triple = lambda name, fallback: colour(self.input(node, name, groups, fallback))
        move, turn, scale = triple("Location", (0, 0, 0)), triple("Rotation", (0, 0, 0)), triple("Scale", (1, 1, 1))
        if any(isinstance(part, Texture) for part in (move, turn, scale)):
            self.notes.add(MAPPED)
            return None
        cos, sin = math.cos(turn[2]), math.sin(turn[2])
        if getattr(node, "vector_type", "POINT") == "TEXTURE":
            x, y = (1 / s if s else 0 for s in scale[:2])
            return [[x * cos, x * sin, -x * (cos * move[0] + sin * move[1])], [-y * sin, y * cos, -y * (cos * move[1] - sin * move[0])]]
        return [[cos * scale[0], -sin * scale[1], move[0]], [sin * scale[0], cos * scale[1], move[1]]]

    def value_mix(self, node, output, groups):
        kind = {"RGBA": "_Color", "VECTOR": "_Vector"}.get(getattr(node, "data_type", "RGBA"), "_Float")
        socket = lambda name: next(s for s in node.inputs if s.identifier == name)
        factor = self.value(socket("Factor_Float"), groups)
        return self.mixed(getattr(node, "blend_type", "MIX"), factor, *(self.value(socket(n + kind), groups) for n in "AB"))

    def value_mix_rgb(self, node, output, groups):
        return self.mixed(node.blend_type, *(self.value(node.inputs[i], groups) for i in range(3)))

    def mixed(self, blend, factor, a, b):
        if isinstance(factor, Texture):
            self.notes.add(ADJUSTED)
            factor = 0.5
        factor = min(max(mean(factor), 0), 1)
        textures = [isinstance(v, Texture) for v in (a, b)]
        if not any(textures):
            a, b = colour(a), colour(b)
            return tuple(float((1 - factor) * x + factor * BLENDS.get(blend, BLENDS["MIX"])(x, y)) for x, y in zip(a, b))
        if blend == "MIX" and factor in (0, 1):
            return (a, b)[int(factor)]
        if blend == "MULTIPLY" and not all(textures):
            texture, other = (a, b) if textures[0] else (b, a)
            if textures[0] or factor == 1:
                weight = tuple((1 - factor) + factor * c for c in colour(other))
                return texture.replaced(factor=tuple(x * y for x, y in zip(texture.factor, weight)))
        if not all(textures):
            texture, other = (a, b) if textures[0] else (b, a)
            function, constant = BLENDS.get(blend, BLENDS["MIX"]), np.array(colour(other))
            pair = (lambda c: (c, constant)) if textures[0] else (lambda c: (constant, c))
            apply = lambda c: (1 - factor) * pair(c)[0] + factor * function(*pair(c))
            return texture.changed(f"{blend} {factor} {other} {textures[0]}", apply)
        self.notes.add(ADJUSTED)
        return a if factor <= 0.5 or blend != "MIX" else b

    def passing(self, node, name, groups):
        """A node that only changes colours: its input, with a note."""
        self.notes.add(ADJUSTED)
        return self.input(node, name, groups)

    def value_gamma(self, node, output, groups):
        value, power = self.input(node, "Color", groups), self.constant(node, "Gamma", groups, 1)
        if isinstance(value, Texture):
            return value.changed(f"gamma {power}", lambda c: np.maximum(c, 0) ** power)
        return tuple(max(c, 0) ** power for c in colour(value))

    def value_invert(self, node, output, groups):
        factor, value = (self.value(socket, groups) for socket in node.inputs[:2])
        factor = 0.5 if isinstance(factor, Texture) else mean(factor)
        if isinstance(value, Texture):
            return value.changed(f"invert {factor}", lambda c: c + factor * (1 - 2 * c))
        return tuple(c + factor * (1 - 2 * c) for c in colour(value))

    def on_colours(self, value, name, function):
        """A function of arrays of colours, applied to a constant or a texture."""
        if isinstance(value, Texture):
            return value.changed(name, function)
        return tuple(float(c) for c in function(np.array(colour(value), float)))

    def value_brightcontrast(self, node, output, groups):
        bright, contrast = (self.constant(node, socket.name, groups) for socket in node.inputs[1:3])
        function = lambda c: np.maximum((1 + contrast) * c + bright - contrast / 2, 0)
        return self.on_colours(self.input(node, "Color", groups), f"contrast {bright} {contrast}", function)

    def value_hue_sat(self, node, output, groups):
        hue, saturation, value = (self.constant(node, n, groups, d) for n, d in (("Hue", 0.5), ("Saturation", 1.0), ("Value", 1.0)))
        factor = next((s for s in node.inputs if s.name in ("Fac", "Factor")), None)
        share = self.value(factor, groups) if factor is not None else 1.0
        share = 0.5 if isinstance(share, Texture) else mean(share)
        function = lambda c: c + share * (shifted_hue(c, hue, saturation, value) - c)
        return self.on_colours(self.input(node, "Color", groups), f"hue {hue} {saturation} {value} {share}", function)

    def value_curve_rgb(self, node, output, groups):
        return self.passing(node, "Color", groups)

    def value_rgbtobw(self, node, output, groups):
        value = self.input(node, "Color", groups)
        if isinstance(value, Texture):
            return value.changed("grey", to_grey).replaced(channel="red")
        return mean(value)

    def value_separate_color(self, node, output, groups):
        value, index = self.value(node.inputs[0], groups), list(node.outputs).index(output)
        if isinstance(value, Texture):
            return value.replaced(channel=("red", "green", "blue")[index])
        return colour(value)[index]

    value_seprgb = value_separate_color

    def value_combine_color(self, node, output, groups):
        parts = [self.value(socket, groups) for socket in node.inputs[:3]]
        texture = next((part for part in parts if isinstance(part, Texture)), None)
        if texture:
            self.notes.add(ADJUSTED)
            return texture
        return tuple(mean(part) for part in parts)

    value_combrgb = value_combine_color

    def value_math(self, node, output, groups):
        values = [self.value(socket, groups) for socket in node.inputs]
        texture = next((v for v in values[:2] if isinstance(v, Texture)), None)
        if texture:
            return self.texture_math(node, texture, values)
        values = [mean(v) if not isinstance(v, Texture) else 0.5 for v in values]
        result = MATH[node.operation](*values) if node.operation in MATH else values[0]
        if node.operation not in MATH:
            self.notes.add(MEAN)
        return min(max(result, 0), 1) if getattr(node, "use_clamp", False) else result

    def texture_math(self, node, texture, values):
        function, others = ARRAY_MATH.get(node.operation), [v for v in values[:2] if v is not texture]
        if function is None or any(isinstance(v, Texture) for v in others):
            self.notes.add(ADJUSTED)
            return texture
        first, other = values[0] is texture, mean(others[0]) if others else 0.0
        apply = lambda c: function(c, other) if first else function(np.full_like(c, other), c)
        if not texture.channel:
            texture = texture.changed("grey", to_grey).replaced(channel="red")
        limit = (lambda c: np.clip(apply(c), 0, 1)) if getattr(node, "use_clamp", False) else apply
        return texture.changed(f"{node.operation} {other} {first} {limit is apply}", limit)

    def value_clamp(self, node, output, groups):
        return self.value(node.inputs[0], groups)

    def value_map_range(self, node, output, groups):
        value = self.value(node.inputs[0], groups)
        low, high, to_low, to_high = (self.constant(node, n, groups) for n in ("From Min", "From Max", "To Min", "To Max"))
        function = lambda c: to_low + (to_high - to_low) * np.clip((c - low) / (high - low if high != low else 1), 0, 1)
        mapped = self.on_colours(value, f"range {low} {high} {to_low} {to_high}", function)
        return mapped if isinstance(mapped, Texture) else mean(mapped)

    def value_valtorgb(self, node, output, groups):
        socket = node.inputs[0]
        value = self.value(socket, groups)
        index = 3 if output.name == "Alpha" else slice(0, 3)
        if isinstance(value, Texture):
            return self.ramp(node.color_ramp, value, output.name == "Alpha")
        if not socket.is_linked:
            result = node.color_ramp.evaluate(mean(value))[index]
            return tuple(result) if index != 3 else result
        self.notes.add(MEAN)
        samples = [node.color_ramp.evaluate((k + 0.5) / 16)[index] for k in range(16)]
        return sum(samples) / 16 if index == 3 else tuple(sum(s[c] for s in samples) / 16 for c in range(3))

    def ramp(self, ramp, value, is_alpha):
        steps = np.linspace(0, 1, 257)
        table = np.array([tuple(ramp.evaluate(float(x))) for x in steps])
        table = np.repeat(table[:, 3:], 3, 1) if is_alpha else table[:, :3]
        index = {"red": 0, "green": 1, "blue": 2}.get(value.channel)
        grey = (lambda c: c[..., index]) if index is not None else (lambda c: c @ LUMINANCE)
        apply = lambda c: np.stack([np.interp(grey(c), steps, table[:, k]) for k in range(3)], -1)
        return value.changed(f"ramp {value.channel} {hash(table.tobytes())}", apply).replaced(channel=None)

    def value_vertex_color(self, node, output, groups):
        if output.name == "Alpha":
            return 1.0
        self.uses_vertex_colours = True
        return (1.0, 1.0, 1.0)

    value_attribute = value_vertex_color

    def value_light_path(self, node, output, groups):
        return 1.0 if output.name == "Is Camera Ray" else 0.0

    def value_new_geometry(self, node, output, groups):
        return 0.0

    def value_fresnel(self, node, output, groups):
        index = max(self.constant(node, "IOR", groups, 1.5), 1e-3)
        return ((index - 1) / (index + 1)) ** 2

    def value_layer_weight(self, node, output, groups):
        return 0.04

    def value_blackbody(self, node, output, groups):
        return blackbody(self.constant(node, "Temperature", groups, 6500))
