"""Makes armillary.glb: an armillary sphere of brass over an enamelled globe, on a foot of turned wood. Needs numpy and pillow.

    python scenes/models/armillary.py scenes/models/armillary.glb

Metres, +Y up. Nothing in it is from elsewhere: continents and grain are noise.
"""
import io, json, math, struct, sys
import numpy as np
from PIL import Image

TILT = math.radians(23.4)

# --------------------------------------------------------------------------------------------------------------------- meshes
def surface(nu, rows, f, uv=(1, 1)):
    """Vertices of f(u, v) for u, v in [0, 1], with smooth normals by differences; `rows`: how many steps v takes, or its values."""
    values = np.linspace(0, 1, rows + 1) if isinstance(rows, int) else rows
    nv = len(values) - 1
    u, v = np.meshgrid(np.linspace(0, 1, nu + 1), values)
    e = 1e-5
    du, dv = f(u + e, v) - f(u - e, v), f(u, v + e) - f(u, v - e)
    n = np.cross(du, dv); n /= np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-30)
    i = (np.arange(nv)[:, None] * (nu + 1) + np.arange(nu)[None]).ravel()
    faces = np.concatenate([np.stack([i, i + 1, i + nu + 2], -1), np.stack([i, i + nu + 2, i + nu + 1], -1)])
    p = f(u, v).reshape(-1, 3)
    area = np.linalg.norm(np.cross(p[faces[:, 1]] - p[faces[:, 0]], p[faces[:, 2]] - p[faces[:, 0]]), axis=1)
    t = np.stack([u * uv[0], (1 - v) * uv[1]], -1).reshape(-1, 2)
    return dict(p=p, n=n.reshape(-1, 3), t=t, i=faces[area > 1e-14])

BEVEL = .022

def bar(a, width, height):
    """Cross-section of a flat bar with rounded edges, by its place a on the outline in turns: a quarter for each side."""
    wave = lambda x: np.clip(2 - 8 * np.abs((x + .5) % 1 - .5), -1, 1)
    smooth = lambda x: sum(wave(x + o) for o in np.linspace(-BEVEL, BEVEL, 15)) / 15
    return width / 2 * smooth(a), height / 2 * smooth(a - .25)

ROWS = np.sort(np.concatenate([[0, 1], *[np.array([-1, -.4, .4, 1]) * BEVEL + k / 4 + 1 / 4 for k in range(3)], [BEVEL * .4, BEVEL, 1 - BEVEL, 1 - BEVEL * .4]]))

def ring(radius, width, height, segments=128, uv=(1, 1)):
    """A ring about +Y: a bar of `width` across the radius and `height` along the axis."""
    def f(u, v):
        x, y = bar(v + 1 / 8, width, height)
        r, a = radius + x, 2 * np.pi * u
        return np.stack([r * np.cos(a), y, -r * np.sin(a)], -1)
    return surface(segments, ROWS, f, uv)

def turned(profile, segments=96, uv=(1, 1), steps=6):
    """A body of revolution about +Y from (radius, height) points, upwards, rounded by a Catmull-Rom curve."""
    k = np.array([profile[0]] + profile + [profile[-1]], float)
    count = len(profile) - 1
    def at(v):
        x = np.clip(v, 0, 1) * count; j = np.minimum(x.astype(int), count - 1); s = (x - j)[..., None]
        a, b, c, d = k[j], k[j + 1], k[j + 2], k[j + 3]
        return .5 * (2 * b + (c - a) * s + (2 * a - 5 * b + 4 * c - d) * s ** 2 + (3 * b - a - 3 * c + d) * s ** 3)
    def f(u, v):
        q, a = at(v), 2 * np.pi * u
        r = np.maximum(q[..., 0], 0)
        return np.stack([r * np.cos(a), q[..., 1], -r * np.sin(a)], -1)
    return surface(segments, count * steps, f, uv)

def ball(radius, segments=96, rows=48):
    return surface(segments, rows, lambda u, v: radius * np.stack([np.sin(np.pi * v) * np.cos(2 * np.pi * u), -np.cos(np.pi * v), -np.sin(np.pi * v) * np.sin(2 * np.pi * u)], -1))

def moved(mesh, matrix=np.eye(3), by=(0, 0, 0)):
    return dict(mesh, p=mesh['p'] @ np.asarray(matrix).T + by, n=mesh['n'] @ np.asarray(matrix).T)

def about(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array(dict(x=[[1, 0, 0], [0, c, -s], [0, s, c]], y=[[c, 0, s], [0, 1, 0], [-s, 0, c]], z=[[c, -s, 0], [s, c, 0], [0, 0, 1]])[axis])

# ------------------------------------------------------------------------------------------------------------------- textures
def noise(h, w, cells, seed):
    """Smooth noise in [0, 1], periodic in both directions; cells = (down, across)."""
    g = np.random.default_rng(seed).random(cells)
    def along(a, n, axis):
        x = np.arange(n) / n * a.shape[axis]; i = x.astype(int); f = x - i; f = f * f * (3 - 2 * f)
        f = f[:, None] if axis == 0 else f[None]
        return np.take(a, i, axis) * (1 - f) + np.take(a, (i + 1) % a.shape[axis], axis) * f
    return along(along(g, h, 0), w, 1)

def octaves(h, w, cells, count, seed):
    parts = [noise(h, w, (cells[0] << k, cells[1] << k), seed + k) / 2 ** k for k in range(count)]
    return sum(parts) / sum(2.0 ** -k for k in range(count))

def mix(a, b, x):
    return np.asarray(a) * (1 - x[..., None]) + np.asarray(b) * x[..., None]

def coded(a):
    return (np.clip(a, 0, 1) * 255 + .5).astype('u1')

def wood():
    h, w = 512, 1024
    wave = octaves(h, w, (3, 6), 4, 1)
    grain = octaves(h, w, (2, 128), 3, 20)
    lines = .5 + .5 * np.sin(2 * np.pi * (9 * wave + np.arange(w) / w * 4))
    colour = mix(mix([.34, .155, .07], [.52, .27, .125], lines ** 1.5), [.20, .08, .035], .55 * np.clip(grain * 1.6 - .45, 0, 1))
    return coded(colour)

def globe():
    """Gold leaf on blue enamel: colour, and metalness with roughness."""
    h, w = 512, 1024
    land = octaves(h, w, (3, 5), 6, 41)
    latitude = np.abs(np.linspace(-1, 1, h))[:, None]
    land = land + .10 * np.cos(latitude * 3) - .05
    gold = np.clip((land - .545) / .008, 0, 1)
    u, v = np.arange(w) / w * 24, np.arange(h) / h * 12
    line = lambda x, width: np.clip(1.4 - np.abs(x - np.round(x)) / width, 0, 1)
    net = np.maximum(line(u, .018)[None] * np.ones((h, 1)), line(v, .018)[:, None] * np.ones((1, w))) * (1 - gold)
    sea = mix([.010, .045, .20], [.02, .12, .33], octaves(h, w, (4, 8), 4, 77))
    colour = mix(sea, [.95, .72, .32], np.maximum(gold, .75 * net))
    metal = np.maximum(gold, .75 * net)
    rough = .22 + .25 * octaves(h, w, (16, 32), 3, 5) * gold
    srgb = np.where(colour <= .0031308, 12.92 * colour, 1.055 * np.maximum(colour, 1e-9) ** (1 / 2.4) - .055)
    return coded(srgb), coded(np.stack([np.ones_like(metal), rough, metal], -1))

def scale():
    """A band of degrees cut into brass: colour and roughness. Down: once around the bar, across: a twelfth of the ring."""
    h, w = 256, 1024
    x, y = np.arange(w) / w * 30, np.arange(h) / h
    deep = np.zeros((h, w))
    for i in range(30):
        length, width = (.20, .16) if i % 10 == 0 else (.13, .12) if i % 5 == 0 else (.08, .09)
        near = np.clip(1.5 - np.abs(x - i - .5) / width, 0, 1)[None]
        for side in range(4): # cut from one edge of each side inwards
            off = ((y - side / 4 - .03) % 1)[:, None]
            deep = np.maximum(deep, near * (off < length) * 1.0)
    wear = octaves(h, w, (4, 16), 5, 9)
    colour = mix(mix([.80, .56, .22], [.90, .67, .30], wear), [.11, .07, .03], .9 * deep)
    srgb = 1.055 * colour ** (1 / 2.4) - .055
    rough = .20 + .22 * wear + .4 * deep
    return coded(srgb), coded(np.stack([np.ones_like(rough), rough, 1 - .5 * deep], -1))

def brass():
    h, w = 512, 512
    wear = octaves(h, w, (8, 8), 5, 3)
    scratches = np.clip(octaves(h, w, (2, 128), 2, 13) * 2 - 1.1, 0, 1)
    rough = .14 + .24 * wear + .10 * scratches
    return coded(np.stack([np.ones_like(rough), rough, np.ones_like(rough)], -1))

# ----------------------------------------------------------------------------------------------------------------------- file
def parts():
    """Meshes by material."""
    all = {k: [] for k in ('brass', 'scale', 'wood', 'globe', 'steel')}
    sky = np.array([0, .315, 0])                         # where the sphere's middle is
    tilt = about('z', -math.radians(38)) @ np.eye(3)     # the axis leans as at 52 degrees north
    put = lambda kind, mesh, turn=np.eye(3), by=sky: all[kind].append(moved(mesh, turn, by))
    lean = lambda turn=np.eye(3): tilt @ turn
    # Horizon and meridian stand still.
    put('scale', ring(.200, .030, .007, 144, (12, 1)))
    put('scale', ring(.178, .008, .016, 144, (12, 1)), about('x', math.pi / 2))
    # What turns: colures, equator, tropics, polar circles, ecliptic.
    r = .160
    for turn in (0, math.pi / 2): put('brass', ring(r, .005, .009, uv=(6, .2)), lean(about('y', turn) @ about('x', math.pi / 2)))
    put('brass', ring(r, .005, .010, uv=(6, .2)), lean())
    for degrees in (23.4, -23.4, 66.6, -66.6):
        a = math.radians(degrees)
        put('brass', ring(r * math.cos(a), .0045, .007, uv=(6, .2)), lean(), sky + tilt @ [0, r * math.sin(a), 0])
    put('scale', ring(r + .0035, .0045, .034, 144, (12, 1)), lean(about('z', TILT)))
    # The axis, its knobs, the globe.
    put('steel', turned([(0, -.205), (.0028, -.205), (.0028, -.1), (.0028, 0), (.0028, .1), (.0028, .205), (0, .205)], 32), lean())
    for side in (1, -1): put('brass', ball(.0095, 48, 24), lean(), sky + tilt @ [0, side * .206, 0])
    put('globe', ball(.062), lean(about('y', .6)))
    # Foot, stem, and the four arms that hold the horizon.
    put('wood', turned([(0, .000), (.092, .000), (.098, .004), (.098, .012), (.088, .018), (.080, .021), (.077, .026), (.060, .031), (.036, .037), (.026, .046), (.024, .052), (.0, .053)], 96, (3, 1)), by=np.zeros(3))
    put('brass', turned([(0, .050), (.020, .050), (.021, .054), (.012, .058), (.0085, .066), (.0075, .080), (.0115, .087), (.0115, .091), (.0075, .098), (.0085, .108), (.014, .114), (.014, .119), (0, .121)], 64, (2, 1)), by=np.zeros(3))
    for quarter in range(4):
        def arm(u, v):
            a = u * math.pi / 2
            radius, rise = .200 * np.sin(a), .1165 + (.315 - .0035 - .1165) * (1 - np.cos(a))
            x, y = bar(v + 1 / 8, .007, .010)
            out = radius + x * np.cos(a - .2); up = rise + x * -np.sin(a)
            return np.stack([out, up, y], -1)
        put('brass', surface(32, ROWS, arm, (2, .2)), about('y', math.pi / 4 + quarter * math.pi / 2), np.zeros(3))
    return all

def join(meshes):
    base, out = 0, []
    for m in meshes:
        out.append(m['i'] + base); base += len(m['p'])
    return dict({k: np.concatenate([m[k] for m in meshes]) for k in 'pnt'}, i=np.concatenate(out).astype('<u2' if base < 65535 else '<u4'))

def steps(a, most, kind):
    """Numbers from 0 or -1 to 1 as whole steps of 1/most, in rows whose length is a multiple of four bytes."""
    a = np.round(a * most).astype(kind); width = 4 // a.itemsize
    return np.pad(a, ((0, 0), (0, -a.shape[1] % width)))

def write(path):
    blob, views, accessors, meshes, nodes, images, textures = bytearray(), [], [], [], [], [], []
    def view(data, **more):
        views.append(dict(buffer=0, byteOffset=len(blob), byteLength=len(data), **more)); blob.extend(data + b'\0' * (-len(data) % 4)); return len(views) - 1
    def add(a, kind, component, **more):
        stride = dict(byteStride=a.strides[0]) if 'VEC' in kind else {}
        accessors.append(dict(bufferView=view(a.tobytes(), **stride), componentType=component, count=len(a), type=kind, **more)); return len(accessors) - 1
    def texture(codes, quality=90):
        file = io.BytesIO(); Image.fromarray(codes).save(file, 'JPEG', quality=quality)
        images.append(dict(bufferView=view(file.getvalue()), mimeType='image/jpeg')); textures.append(dict(source=len(images) - 1, sampler=0))
        return dict(index=len(textures) - 1)
    globe_colour, globe_rough = globe(); scale_colour, scale_rough = scale()
    coat = lambda factor, rough: dict(KHR_materials_clearcoat=dict(clearcoatFactor=factor, clearcoatRoughnessFactor=rough))
    materials = dict(
        brass=dict(pbrMetallicRoughness=dict(baseColorFactor=[.84, .58, .24, 1], metallicRoughnessTexture=texture(brass()))),
        scale=dict(pbrMetallicRoughness=dict(baseColorTexture=texture(scale_colour), metallicRoughnessTexture=texture(scale_rough))),
        wood=dict(pbrMetallicRoughness=dict(baseColorTexture=texture(wood()), metallicFactor=0, roughnessFactor=.5), extensions=coat(.7, .12)),
        globe=dict(pbrMetallicRoughness=dict(baseColorTexture=texture(globe_colour), metallicRoughnessTexture=texture(globe_rough)), extensions=coat(1, .02)),
        steel=dict(pbrMetallicRoughness=dict(baseColorFactor=[.42, .44, .47, 1], metallicFactor=1, roughnessFactor=.25)))
    for k, (name, list) in enumerate(parts().items()):
        # Positions in 65535 steps of the box's longest side, normals in 32767 and coordinates in 65535 of the widest: three fifths of floats.
        m = join(list); low, size, wide = m['p'].min(0), np.ptp(m['p'], 0).max(), m['t'].max()
        p = steps((m['p'] - low) / size, 65535, '<u2')
        at = dict(POSITION=add(p, 'VEC3', 5123, normalized=True, min=p.min(0)[:3].tolist(), max=p.max(0)[:3].tolist()),
                  NORMAL=add(steps(m['n'], 32767, '<i2'), 'VEC3', 5122, normalized=True),
                  TEXCOORD_0=add(steps(m['t'] / wide, 65535, '<u2'), 'VEC2', 5123, normalized=True))
        for key, value in materials[name]['pbrMetallicRoughness'].items():
            if key.endswith('Texture'): value['extensions'] = dict(KHR_texture_transform=dict(scale=[wide, wide]))
        index = add(m['i'].ravel(), 'SCALAR', 5123 if m['i'].dtype.itemsize == 2 else 5125)
        meshes.append(dict(name=name, primitives=[dict(attributes=at, indices=index, material=k)])); nodes.append(dict(mesh=k, name=name, translation=low.tolist(), scale=[size] * 3))
        print(name, len(m['p']), 'vertices', len(m['i']), 'triangles')
    g = dict(asset=dict(version='2.0', generator='scenes/models/armillary.py of Raywright', copyright='MIT OR Apache-2.0'), scene=0, scenes=[dict(nodes=[*range(len(nodes))])],
             nodes=nodes, meshes=meshes, accessors=accessors, bufferViews=views, images=images, textures=textures, samplers=[dict(wrapS=10497, wrapT=10497)],
             materials=[dict(v, name=k) for k, v in materials.items()], buffers=[dict(byteLength=len(blob))], extensionsUsed=['KHR_materials_clearcoat', 'KHR_mesh_quantization', 'KHR_texture_transform'], extensionsRequired=['KHR_mesh_quantization'])
    text = json.dumps(g, separators=(',', ':')).encode(); text += b' ' * (-len(text) % 4); body = bytes(blob) + b'\0' * (-len(blob) % 4)
    with open(path, 'wb') as file:
        file.write(struct.pack('<4sII', b'glTF', 2, 28 + len(text) + len(body)) + struct.pack('<I4s', len(text), b'JSON') + text + struct.pack('<I4s', len(body), b'BIN\0') + body)

if __name__ == '__main__':
    write(sys.argv[1])
