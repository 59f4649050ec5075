"""Arithmetic of colours as Blender's nodes have it, of numbers and of arrays."""

import math

import numpy as np

BLENDS = {
    "MIX": lambda a, b: b,
    "MULTIPLY": lambda a, b: a * b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: np.maximum(a - b, 0),
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b),
    "DIVIDE": lambda a, b: a / np.maximum(b, 1e-6),
    "DIFFERENCE": lambda a, b: abs(a - b),
    "DARKEN": np.minimum,
    "LIGHTEN": np.maximum,
    "OVERLAY": lambda a, b: np.where(np.asarray(a) < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b)),
}

ARRAY_MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "DIVIDE": lambda a, b: a / np.maximum(b, 1e-6),
    "POWER": lambda a, b: np.maximum(a, 0) ** b,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "SQRT": lambda a, _: np.sqrt(np.maximum(a, 0)),
    "LESS_THAN": lambda a, b: (a < b).astype(float),
    "GREATER_THAN": lambda a, b: (a > b).astype(float),
}

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

MATH = {
    "ADD": lambda a, b, *_: a + b,
    "SUBTRACT": lambda a, b, *_: a - b,
    "MULTIPLY": lambda a, b, *_: a * b,
    "DIVIDE": lambda a, b, *_: a / b if b else 0,
    "MULTIPLY_ADD": lambda a, b, c, *_: a * b + c,
    "POWER": lambda a, b, *_: abs(a) ** b if a else 0,
    "MINIMUM": lambda a, b, *_: min(a, b),
    "MAXIMUM": lambda a, b, *_: max(a, b),
    "SQRT": lambda a, *_: math.sqrt(max(a, 0)),
    "ABSOLUTE": lambda a, *_: abs(a),
    "LESS_THAN": lambda a, b, *_: float(a < b),
    "GREATER_THAN": lambda a, b, *_: float(a > b),
}


def to_grey(colours):
    return np.repeat((colours @ LUMINANCE)[..., None], 3, -1)


def shifted_hue(colours, hue, saturation, value):
    """Colours whose hue was turned (a half is none), and whose saturation and value were multiplied."""
    high, low = colours.max(-1), colours.min(-1)
    chroma = np.maximum(high - low, 1e-12)
    r, g, b = (colours[..., k] for k in range(3))
    sector = np.where(high == r, (g - b) / chroma % 6, np.where(high == g, (b - r) / chroma + 2, (r - g) / chroma + 4))
    turned = (sector / 6 + hue - 0.5) % 1
    share = np.clip((high - low) / np.maximum(high, 1e-12) * saturation, 0, 1)
    parts = [np.clip(np.abs((turned * 6 + k) % 6 - 3) - 1, 0, 1) for k in (0, 4, 2)]
    return np.stack([high * value * (1 - share + share * part) for part in parts], -1)


def blackbody(kelvin):
    """Linear Rec. 709 colour of a black body of luminance 1, as Cycles has it (fits of Charity's table by Helland, 2012)."""
    t = min(max(kelvin, 1000), 40000) / 100
    red = 255 if t <= 66 else 329.698727446 * (t - 60) ** -0.1332047592
    green = 99.4708025861 * math.log(t) - 161.1195681661 if t <= 66 else 288.1221695283 * (t - 60) ** -0.0755148492
    blue = 255 if t >= 66 else 0 if t <= 19 else 138.5177312231 * math.log(t - 10) - 305.0447927307
    linear = [(min(max(c, 0), 255) / 255) ** 2.2 for c in (red, green, blue)]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return tuple(c / luminance for c in linear)
