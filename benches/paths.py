"""Path tracing beside Mitsuba 3, on scenes that this script makes and gives to both: samples a CPU second, CPU seconds to an
error, one thread against two. Contestants take turns; set-up and kernel compilation are apart.

    python -m venv venv && venv/bin/pip install mitsuba numpy pillow OpenEXR
    DRJIT_LIBLLVM_PATH=.../libLLVM.so venv/bin/python benches/paths.py OUT --ours target/release/raywright [--rounds 5]

Parts: --only means,speed,error,threads; --scenes real,room,cornell,instances,model (real: of the file that REAL names); --ours may be given more than once, to compare builds.
"""
import argparse, json, math, os, resource, statistics, struct, subprocess, sys, time
import numpy as np
from PIL import Image

# ------------------------------------------------------------------------------------------------------------------ the scenes
def grid_mesh(nu, nv, f):
    """A mesh of (nu+1)(nv+1) vertices from f(u, v) in [0,1]^2, with normals by differences and the texture coordinates u, v."""
    u, v = np.meshgrid(np.linspace(0, 1, nu + 1), np.linspace(0, 1, nv + 1))
    e = 1e-4
    p = f(u, v)
    n = np.cross(f(u + e, v) - f(u - e, v), f(u, v + e) - f(u, v - e))
    length = np.linalg.norm(n, axis=-1, keepdims=True)
    n = np.where(length > 1e-12, n / np.maximum(length, 1e-12), p / np.linalg.norm(p, axis=-1, keepdims=True))
    n = np.where((n * p).sum(-1, keepdims=True) < 0, -n, n)
    i = np.arange(nv)[:, None] * (nu + 1) + np.arange(nu)[None]
    a, b, c, d = i, i + 1, i + nu + 2, i + nu + 1
    t = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], 2).reshape(-1, 3)
    p, n = p.reshape(-1, 3), n.reshape(-1, 3)
    area = np.linalg.norm(np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]), axis=1)
    t = t[area > 1e-12]
    facing = (np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]) * n[t[:, 0]]).sum(1)
    t[facing < 0] = t[facing < 0][:, ::-1]
    return dict(P=p.astype('f4'), N=n.astype('f4'), UV=np.stack([u, v], -1).reshape(-1, 2).astype('f4'), I=t.astype('u4'))

def helmet(u, v):
    """A dented ball with ridges: concave in places, so that paths meet it more than once."""
    phi, th = 2 * np.pi * u, np.pi * np.clip(v, 0, 1)
    r = 0.85 + 0.09 * np.sin(5 * phi) * np.sin(th) ** 2 + 0.10 * np.cos(6 * th) - 0.25 * np.exp(-8 * ((phi - 1.0) ** 2 + (th - 1.5) ** 2))
    return np.stack([r * np.sin(th) * np.cos(phi), r * np.cos(th), r * np.sin(th) * np.sin(phi)], -1)

def noise(size, cells, seed):
    """Smooth noise in [0, 1] that repeats at the edges."""
    g = np.random.default_rng(seed).random((cells, cells))
    x = np.arange(size) / size * cells
    i, f = x.astype(int), x - np.floor(x)
    f = f * f * (3 - 2 * f)
    row = g[i] * (1 - f[:, None]) + g[(i + 1) % cells] * f[:, None]
    return row[:, i] * (1 - f) + row[:, (i + 1) % cells] * f

def textures(out, size):
    """Five maps as a scanned object has them: base colour, roughness and metalness in one, normals, occlusion, emission."""
    n = [noise(size, 8 << k, k) for k in range(6)]
    paint = (n[0] + 0.5 * n[2] + 0.25 * n[4]) / 1.75
    metal = (paint > 0.5).astype(float)
    base = np.stack([0.25 + 0.6 * metal * n[3] + 0.2 * n[5], 0.2 + 0.5 * n[3] + 0.1 * n[1], 0.15 + 0.5 * (1 - metal) * n[2] + 0.1 * n[5]], -1)
    rough = 0.15 + 0.6 * (0.6 * n[3] + 0.4 * n[5])
    height = 0.02 * (n[3] + 0.4 * n[5])
    dx, dy = [(np.roll(height, -1, a) - np.roll(height, 1, a)) * size / 2 / 12 for a in (1, 0)]
    normal = np.stack([-dx, dy, np.ones_like(dx)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    glow = ((n[4] > 0.93) * 1.0)[..., None] * np.array([1.0, 0.5, 0.2])
    save = lambda name, a: Image.fromarray((np.clip(a, 0, 1) * 255 + 0.5).astype('u1')).save(f'{out}/{name}.png', compress_level=1)
    save('base', base ** (1 / 2.2)); save('orm', np.stack([1 - 0.3 * n[1], rough, metal], -1)); save('normal', normal * 0.5 + 0.5)
    save('emission', glow); save('occlusion', np.stack([1 - 0.3 * n[1]] * 3, -1))
    save('rough', rough); save('metal', metal)

SUN = np.array([1.0, 0.6, -0.5]) / np.linalg.norm([1.0, 0.6, -0.5])
def sky(out, w=1024, h=512):
    phi, th = np.meshgrid((np.arange(w) + .5) / w * 2 * np.pi, (np.arange(h) + .5) / h * np.pi)
    d = np.stack([np.sin(phi) * np.sin(th), np.cos(th), -np.cos(phi) * np.sin(th)], -1)
    t, s = 0.5 * (d[..., 1:2] + 1), np.maximum((d * SUN).sum(-1, keepdims=True), 0)
    img = np.array([1.0, .85, .6]) * (1 - t) + np.array([.25, .45, .9]) * t + np.array([1.0, .9, .7]) * s ** 256 * 2 + np.array([1.0, .7, .3]) * s ** 32 * .3
    m = img.max(-1); e = np.floor(np.log2(m)) + 1
    rgbe = np.concatenate([np.clip(img * (256 / 2.0 ** e)[..., None], 0, 255).astype('u1'), (e + 128).astype('u1')[..., None]], -1)
    with open(f'{out}/sky.hdr', 'wb') as f:
        f.write(b'#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n' % (h, w) + rgbe.tobytes())

def icosphere(centre, radius, level=4):
    t = (1 + 5 ** .5) / 2
    v = [np.array(p) / np.linalg.norm(p) for p in [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t),
                                                  (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
         (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(level):
        middle, finer = {}, []
        def mid(a, b):
            k = (min(a, b), max(a, b))
            if k not in middle:
                m = v[a] + v[b]; v.append(m / np.linalg.norm(m)); middle[k] = len(v) - 1
            return middle[k]
        for a, b, c in f:
            ab, bc, ca = mid(a, b), mid(b, c), mid(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        f = finer
    n = np.array(v, 'f4')
    return dict(P=(n * radius + np.array(centre)).astype('f4'), N=n, UV=np.zeros((len(n), 2), 'f4'), I=np.array(f, 'u4'))

def quad(*corners):
    p = np.array(corners, 'f4'); n = np.cross(p[1] - p[0], p[2] - p[0]); n /= np.linalg.norm(n)
    return dict(P=p, N=np.tile(n, (4, 1)).astype('f4'), UV=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], 'f4'), I=np.array([[0, 1, 2], [0, 2, 3]], 'u4'))

def cornell():
    """An open box with a mirror and a glass ball under a small lamp: caustics are what takes the time."""
    white, red, green = [.73] * 3, [.63, .065, .05], [.14, .45, .091]
    return dict(name='cornell', camera=dict(eye=[0, 1, 3.9], target=[0, 1, 0], fov=40.0), env=None, parts=[
        (quad([-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]), dict(diffuse=white)), (quad([-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]), dict(diffuse=white)),
        (quad([-1, 0, -1], [1, 0, -1], [1, 2, -1], [-1, 2, -1]), dict(diffuse=white)), (quad([-1, 0, 1], [-1, 0, -1], [-1, 2, -1], [-1, 2, 1]), dict(diffuse=red)),
        (quad([1, 0, -1], [1, 0, 1], [1, 2, 1], [1, 2, -1]), dict(diffuse=green)),
        (quad([-.15, 1.999, -.15], [.15, 1.999, -.15], [.15, 1.999, .15], [-.15, 1.999, .15]), dict(emits=40.0)),
        (icosphere([-.45, .4, -.35], .4), dict(mirror=1)), (icosphere([.45, .35, .35], .35), dict(glass=1.5))])

def room():
    """A closed hall of 33,000 triangles with balls and columns under six small lamps of unequal power: which lamp is asked matters most."""
    white, warm, blue = [.7, .68, .64], [.65, .45, .25], [.2, .3, .6]
    x, y, z = 5.0, 3.0, 3.0
    walls = [([-x, 0, z], [x, 0, z], [x, 0, -z], [-x, 0, -z]), ([-x, y, -z], [x, y, -z], [x, y, z], [-x, y, z]), ([-x, 0, -z], [x, 0, -z], [x, y, -z], [-x, y, -z]),
             ([x, 0, z], [-x, 0, z], [-x, y, z], [x, y, z]), ([-x, 0, z], [-x, 0, -z], [-x, y, -z], [-x, y, z]), ([x, 0, -z], [x, 0, z], [x, y, z], [x, y, -z])]
    parts = [(quad(*w), dict(diffuse=[white, white, white, white, warm, blue][i])) for i, w in enumerate(walls)]
    for k in range(6):
        a, b, s = -4 + 1.6 * k, (-1.5, 1.5)[k % 2], .1 + .03 * k
        parts.append((quad([a - s, y - .01, b - s], [a + s, y - .01, b - s], [a + s, y - .01, b + s], [a - s, y - .01, b + s]), dict(emits=30.0 - 4 * k)))
        column = lambda u, v: np.stack([a + .25 * np.cos(2 * np.pi * u), y * v, -2 - .25 * np.sin(2 * np.pi * u)], -1)
        parts.append((grid_mesh(24, 8, lambda u, v: column(u, v) - [a, y / 2, -2]), dict(diffuse=white, at=[a, y / 2, -2])))
        parts.append((icosphere([a, .5, .6 * (-1) ** k], .5), dict(diffuse=[warm, blue, white][k % 3])))
    return dict(name='room', camera=dict(eye=[4.4, 1.6, 2.5], target=[-1, 1, -.5], fov=55.0), env=None, parts=parts)

def real():
    """A model that other programs made, with its own images (Suzanne of glTF's samples, or whatever file of one mesh and two images `REAL` names)."""
    path = os.environ['REAL']; folder = os.path.dirname(path); g = json.load(open(path)); p = g['meshes'][0]['primitives'][0]
    def read(i):
        a = g['accessors'][i]; v = g['bufferViews'][a['bufferView']]; kind = {5126: '<f4', 5123: '<u2', 5125: '<u4'}[a['componentType']]
        raw = open(f"{folder}/{g['buffers'][v['buffer']]['uri']}", 'rb').read(); n = dict(SCALAR=1, VEC2=2, VEC3=3)[a['type']]
        return np.frombuffer(raw, kind, a['count'] * n, v.get('byteOffset', 0) + a.get('byteOffset', 0)).reshape(-1, n) if n > 1 else np.frombuffer(raw, kind, a['count'], v.get('byteOffset', 0) + a.get('byteOffset', 0))
    at = p['attributes']; pbr = g['materials'][p['material']]['pbrMetallicRoughness']
    image = lambda key: f"{folder}/{g['images'][g['textures'][pbr[key]['index']]['source']]['uri']}"
    mesh = dict(P=read(at['POSITION']), N=read(at['NORMAL']), UV=read(at['TEXCOORD_0']), I=read(p['indices']).astype('u4').reshape(-1, 3))
    return dict(name='real', camera=dict(eye=[1.2, .8, 3.2], target=[0, 0, 0], fov=45.0), env='sky.hdr',
                parts=[(mesh, dict(images=dict(base=image('baseColorTexture'), orm=image('metallicRoughnessTexture'))))])

def instances():
    """One ball of 5,000 triangles shown 400 times over a floor, under the sky."""
    random = np.random.default_rng(7); places = np.stack([random.uniform(-6, 6, 400), random.uniform(.2, 3, 400), random.uniform(-6, 6, 400)], -1)
    return dict(name='instances', camera=dict(eye=[7, 4, 9], target=[0, 1, 0], fov=45.0), env='sky.hdr', parts=[
        (quad([-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]), dict(diffuse=[.5] * 3)), (icosphere([0, 0, 0], .3), dict(diffuse=[.7, .5, .3], places=places.tolist()))])

def model():
    return dict(name='model', camera=dict(eye=[1.6, .5, 2.4], target=[0, 0, 0], fov=45.0), env='sky.hdr', parts=[(grid_mesh(124, 62, helmet), dict(maps=1))])

# ----------------------------------------------------------------------------------------------------------------- their files
def turned(c):
    f = np.array(c['target'], float) - c['eye']; f /= np.linalg.norm(f)
    r = np.cross(f, [0, 1, 0]); r /= np.linalg.norm(r); m = np.stack([r, np.cross(r, f), -f], 1)
    w = math.sqrt(max(0, 1 + np.trace(m))) / 2
    return [(m[2, 1] - m[1, 2]) / (4 * w), (m[0, 2] - m[2, 0]) / (4 * w), (m[1, 0] - m[0, 1]) / (4 * w), w]

def write_gltf(s, out):
    blob, views, accessors, meshes, nodes, materials, used = b'', [], [], [], [], [], set()
    def add(a, kind, component, bounds=False):
        nonlocal blob
        views.append(dict(buffer=0, byteOffset=len(blob), byteLength=a.nbytes)); blob += a.tobytes() + b'\0' * (-a.nbytes % 4)
        d = dict(bufferView=len(views) - 1, componentType=component, count=a.size if kind == 'SCALAR' else len(a), type=kind)
        if bounds: d.update(min=a.min(0).tolist(), max=a.max(0).tolist())
        accessors.append(d); return len(accessors) - 1
    for m, look in s['parts']:
        pbr, d, e = dict(metallicFactor=0.0, roughnessFactor=1.0), {}, {}
        if 'diffuse' in look: pbr['baseColorFactor'] = look['diffuse'] + [1.0]; e['KHR_materials_specular'] = dict(specularFactor=0.0)
        if 'emits' in look: pbr['baseColorFactor'] = [0, 0, 0, 1]; d['emissiveFactor'] = [1, 1, 1]; e = dict(KHR_materials_emissive_strength=dict(emissiveStrength=look['emits']), KHR_materials_specular=dict(specularFactor=0.0))
        if 'mirror' in look: pbr.update(metallicFactor=1.0, roughnessFactor=0.0)
        if 'glass' in look: pbr['roughnessFactor'] = 0.0; e = dict(KHR_materials_transmission=dict(transmissionFactor=1.0), KHR_materials_ior=dict(ior=look['glass']), KHR_materials_volume=dict(thicknessFactor=1.0))
        if 'images' in look: pbr = dict(baseColorTexture=dict(index=0), metallicRoughnessTexture=dict(index=1))
        if 'maps' in look:
            pbr = dict(baseColorTexture=dict(index=0), metallicRoughnessTexture=dict(index=1))
            d.update(normalTexture=dict(index=2), emissiveTexture=dict(index=3), occlusionTexture=dict(index=4), emissiveFactor=[1, 1, 1])
        if e: d['extensions'] = e; used |= set(e)
        materials.append(dict(pbrMetallicRoughness=pbr, **d))
        at = dict(POSITION=add(m['P'], 'VEC3', 5126, True), NORMAL=add(m['N'], 'VEC3', 5126), TEXCOORD_0=add(m['UV'], 'VEC2', 5126))
        meshes.append(dict(primitives=[dict(attributes=at, indices=add(m['I'].ravel(), 'SCALAR', 5125), material=len(materials) - 1)]))
        nodes += [dict(mesh=len(meshes) - 1, translation=at) for at in look.get('places', [look.get('at', [0, 0, 0])])]
    c = s['camera']
    nodes.append(dict(camera=0, translation=c['eye'], rotation=turned(c)))
    g = dict(asset=dict(version='2.0'), scene=0, scenes=[dict(nodes=list(range(len(nodes))))], nodes=nodes, meshes=meshes, accessors=accessors, bufferViews=views,
             materials=materials, cameras=[dict(type='perspective', perspective=dict(yfov=math.radians(c['fov']), znear=.01, aspectRatio=1.0))],
             buffers=[dict(uri=s['name'] + '.bin', byteLength=len(blob))])
    if any('maps' in look for _, look in s['parts']):
        names = ['base', 'orm', 'normal', 'emission', 'occlusion']
        g.update(images=[dict(uri=n + '.png') for n in names], textures=[dict(source=i) for i in range(5)])
    if any('images' in look for _, look in s['parts']): g.update(images=[dict(uri='real_base.png'), dict(uri='real_orm.png')], textures=[dict(source=i) for i in range(2)])
    if used: g['extensionsUsed'] = sorted(used)
    open(f"{out}/{s['name']}.bin", 'wb').write(blob); json.dump(g, open(f"{out}/{s['name']}.gltf", 'w'))

def write_ply(path, m):
    v = np.concatenate([m['P'], m['N'], m['UV']], 1).astype('<f4')
    rec = np.zeros(len(m['I']), dtype=[('n', 'u1'), ('i', '<u4', 3)]); rec['n'] = 3; rec['i'] = m['I']
    head = 'ply\nformat binary_little_endian 1.0\nelement vertex %d\n' % len(v) + ''.join(f'property float {c}\n' for c in ('x', 'y', 'z', 'nx', 'ny', 'nz', 's', 't'))
    open(path, 'wb').write((head + 'element face %d\nproperty list uchar uint vertex_indices\nend_header\n' % len(m['I'])).encode() + v.tobytes() + rec.tobytes())

SCENES = dict(real=real, room=room, cornell=cornell, instances=instances, model=model)
UNDER_SKY = ('real', 'instances', 'model')

def write_all(out, size, names):
    os.makedirs(out, exist_ok=True); textures(out, size); sky(out)
    for s in [SCENES[name]() for name in names]:
        write_gltf(s, out)
        for look in (look['images'] for _, look in s['parts'] if 'images' in look):
            base, orm = Image.open(look['base']).convert('RGB'), Image.open(look['orm']).convert('RGB')
            base.save(f'{out}/real_base.png'); orm.save(f'{out}/real_orm.png')
            for name, band in (('rough', 1), ('metal', 2)): orm.split()[band].save(f'{out}/real_{name}.png')
        for i, (m, _) in enumerate(s['parts']): write_ply(f"{out}/{s['name']}_{i}.ply", m)

# ------------------------------------------------------------------------------------------------------------------ contestants
def cpu(who=resource.RUSAGE_SELF):
    r = resource.getrusage(who); return r.ru_utime + r.ru_stime

def read_exr(path):
    import OpenEXR
    with OpenEXR.File(path) as f:
        c = f.channels(); k = next((x for x in ('denoised', 'RGBA', 'RGB') if x in c), None)
        return (c[k].pixels[..., :3] if k else np.stack([c[x].pixels for x in 'RGB'], -1)).astype(float)

class Ours:
    """A build of ours, run as a command; what does not grow with samples (process, files, tree) is measured beside and taken off."""
    def __init__(self, binary, out, denoised=False): self.binary, self.out, self.denoised, self.name = binary, out, denoised, os.path.relpath(binary) + ' --denoise' * denoised
    def run(self, scene, edge, spp, threads=1, seed=0):
        extra = ['--denoise'] * (self.denoised and spp > 1)
        # The middle of an equirectangular picture is +x here, and +z in Mitsuba.
        extra += ['--env', f'{self.out}/sky.hdr', '--env-rotation', '90'] if scene in UNDER_SKY else ['--env', 'none']
        c, w, exr = cpu(resource.RUSAGE_CHILDREN), time.time(), f'{self.out}/ours.exr'
        subprocess.run([self.binary, 'render', f'{self.out}/{scene}.gltf', '--integrator', 'path', '--size', f'{edge}x{edge}', '--spp', str(spp), '--max-depth', '9',
                        '--threads', str(threads), '--seed', str(seed), '-q', '-o', exr] + extra, check=True)
        return cpu(resource.RUSAGE_CHILDREN) - c, time.time() - w, exr
    def render(self, scene, edge, spp, threads=1, seed=0):
        base, base_wall, _ = self.run(scene, edge, 1, threads, seed)
        used, wall, exr = self.run(scene, edge, spp, threads, seed)
        scale = spp / (spp - 1) if spp > 1 else 1
        return (used - base) * scale, (wall - base_wall) * scale, read_exr(exr)

class Mitsuba:
    def __init__(self, variant, out, sampler): self.variant, self.out, self.sampler, self.name, self.made = variant, out, sampler, f'mitsuba {variant} {sampler}', {}
    def scene(self, scene, edge):
        import mitsuba as mi
        mi.set_variant(self.variant)
        if (scene, edge) in self.made: return self.made[scene, edge]
        s = SCENES[scene](); c = s['camera']
        d = dict(type='scene', integrator=dict(type='path', max_depth=9, rr_depth=5), sensor=dict(type='perspective', fov=c['fov'], fov_axis='y',
                 to_world=mi.ScalarTransform4f().look_at(c['eye'], c['target'], [0, 1, 0]), sampler=dict(type=self.sampler),
                 film=dict(type='hdrfilm', width=edge, height=edge, rfilter=dict(type='box'), pixel_format='rgb')))
        rgb = lambda v: dict(type='rgb', value=v)
        image = lambda name, raw: dict(type='bitmap', filename=f'{self.out}/{name}.png', raw=raw)
        for i, (_, look) in enumerate(s['parts']):
            shape = dict(type='ply', filename=f'{self.out}/{scene}_{i}.ply')
            if 'diffuse' in look: shape['bsdf'] = dict(type='twosided', b=dict(type='diffuse', reflectance=rgb(look['diffuse'])))
            if 'emits' in look: shape.update(bsdf=dict(type='diffuse', reflectance=rgb([0, 0, 0])), emitter=dict(type='area', radiance=rgb([look['emits']] * 3)))
            if 'mirror' in look: shape['bsdf'] = dict(type='twosided', b=dict(type='conductor', material='none'))
            if 'glass' in look: shape['bsdf'] = dict(type='dielectric', int_ior=look['glass'], ext_ior=1.0)
            if 'maps' in look:
                inner = dict(type='principled', base_color=image('base', False), roughness=image('rough', True), metallic=image('metal', True))
                shape.update(flip_tex_coords=False, emitter=dict(type='area', radiance=image('emission', False)),
                             bsdf=dict(type='twosided', b=dict(type='normalmap', normalmap=image('normal', True), b=inner)))
            if 'images' in look:
                shape['bsdf'] = dict(type='twosided', b=dict(type='principled', base_color=image('real_base', False), roughness=image('real_rough', True), metallic=image('real_metal', True)))
                shape['flip_tex_coords'] = False
            move = lambda at: mi.ScalarTransform4f().translate(at)
            if 'at' in look: shape['to_world'] = move(look['at'])
            if 'places' in look:
                d[f'group{i}'] = dict(type='shapegroup', shape=shape)
                d.update({f'part{i}_{k}': dict(type='instance', group=dict(type='ref', id=f'group{i}'), to_world=move(at)) for k, at in enumerate(look['places'])})
            else: d[f'part{i}'] = shape
        if s['env']: d['sky'] = dict(type='envmap', filename=f'{self.out}/{s["env"]}')
        self.made[scene, edge] = mi.load_dict(d); return self.made[scene, edge]
    def pixels(self, made, spp, seed):
        import mitsuba as mi
        return np.array(mi.render(made, spp=spp, seed=seed))[..., :3].astype(float)
    def render(self, scene, edge, spp, threads=1, seed=0):
        """In pieces that fit the wavefront; the first piece of a size compiles and is thrown away."""
        import mitsuba as mi
        if 'llvm' in self.variant:
            import drjit as dr
            dr.set_thread_count(threads)
        made = self.scene(scene, edge)
        piece = spp if 'scalar' in self.variant else min(spp, max(1, (1 << 23) // edge ** 2))
        if (scene, edge, piece) not in self.made: self.pixels(made, piece, 1); self.made[scene, edge, piece] = True
        c, w, total, n = cpu(), time.time(), 0, 0
        while n < spp: total = total + self.pixels(made, piece, 1000 * seed + n + 7); n += piece
        return (cpu() - c) * spp / n, (time.time() - w) * spp / n, total / (n // piece)

# ----------------------------------------------------------------------------------------------------------------------- parts
def rel_mse(image, truth):
    """Trimmed of the worst 0.1 % of pixels, which fireflies rule."""
    q = np.sort(((image - truth) ** 2 / (truth ** 2 + .01)).mean(-1).ravel()); return q[:int(len(q) * .999)].mean()

def spread(x): return f'{statistics.median(x):.3g} [{min(x):.3g}, {max(x):.3g}]'

def speed(them, scene, edge, spp, rounds):
    rates = {t.name: [] for t in them}
    for r in range(rounds):
        for t in them[r % len(them):] + them[:r % len(them)]: rates[t.name].append(edge ** 2 * spp / t.render(scene, edge, spp, seed=r)[0] / 1e6)
    base = next((t.name for t in them if 'llvm' in t.name), them[0].name)
    for n, x in rates.items(): print(f'| {scene} {edge}² | {n} | {spread(x)} | {spread([a / b for a, b in zip(x, rates[base])])} |', flush=True)

def error(them, scene, edge, spps, truths, target, rounds):
    for t in them:
        found = []
        for spp in spps:
            runs = [t.render(scene, edge, spp, seed=r + 50) for r in range(rounds)]
            found.append((spp, statistics.median(r[0] for r in runs), statistics.median(rel_mse(r[2], truths(t)) for r in runs)))
        # Where the curve of log error over log time crosses the mark; beyond its ends by its last slope.
        (t0, e0), (t1, e1) = [(math.log(c), math.log(e)) for _, c, e in (sorted(found, key=lambda f: abs(math.log(f[2] / target)))[:2])]
        at = math.exp(t0 + (math.log(target) - e0) * (t1 - t0) / (e1 - e0)) if e1 != e0 else float('nan')
        print(f'| {scene} {edge}² to {target:g} | {t.name} | {at / edge ** 2 * 1e6:.3g} | ' + ', '.join(f'{s}: {e:.3g}' for s, _, e in found) + ' |', flush=True)

def main():
    ap = argparse.ArgumentParser(); ap.add_argument('out'); ap.add_argument('--ours', action='append', default=[]); ap.add_argument('--rounds', type=int, default=3)
    ap.add_argument('--only', default='means,speed,error,threads'); ap.add_argument('--scenes', default='room,cornell,instances,model'); ap.add_argument('--textures', type=int, default=2048)
    ap.add_argument('--edge', type=int, default=512); ap.add_argument('--truth', type=int, default=512); ap.add_argument('--boxes', default='64,128'); ap.add_argument('--box-truth', type=int, default=16384); ap.add_argument('--variants', default='llvm_ad_rgb,scalar_rgb'); a = ap.parse_args()
    only, scenes = a.only.split(','), a.scenes.split(',')
    if not all(os.path.exists(f'{a.out}/{name}.gltf') for name in scenes): write_all(a.out, a.textures, scenes)
    ours = [Ours(o, a.out) for o in a.ours]
    theirs = [Mitsuba(v, a.out, 'independent') for v in a.variants.split(',') if v]
    kept = {}
    def truth(t, scene, edge, spp):
        family = 'ours' if isinstance(t, Ours) else 'mitsuba'; path = f'{a.out}/truth_{family}_{scene}_{edge}_{spp}.npy'
        if path not in kept:
            if not os.path.exists(path): np.save(path, t.render(scene, edge, spp, seed=999, threads=2)[2])
            kept[path] = np.load(path)
        return kept[path]
    sizes = {name: [(a.edge, a.truth)] for name in SCENES}; sizes['cornell'] = [(int(e), a.box_truth) for e in a.boxes.split(',')]
    if 'means' in only:
        for scene in scenes:
            edge, spp = sizes[scene][0]
            images = [truth(t, scene, edge, spp) for t in ours[:1] + theirs[:1]]
            print(f'{scene}: means ' + '; '.join(str(i.mean((0, 1)).round(5).tolist()) for i in images) + (f'; relMSE of one to the other {rel_mse(*images):.3g}' if len(images) > 1 else ''), flush=True)
    if 'speed' in only:
        print('| scene | contestant | M samples a CPU s | over Mitsuba llvm |\n|---|---|---|---|')
        for scene in scenes:
            for edge, _ in sizes[scene]: speed(ours + theirs, scene, edge, 256 if scene == 'cornell' else 16, a.rounds)
    if 'error' in only or 'denoised' in only:
        best = [Mitsuba(v, a.out, 'multijitter') for v in a.variants.split(',')[:1] if v]
        print('| scene | contestant | CPU s a megapixel | trimmed relMSE by samples |\n|---|---|---|---|')
        for scene in scenes:
            for edge, spp in sizes[scene]:
                spps, target = ([256, 1024], 1e-2) if scene == 'cornell' else ([16, 64], 1e-2) if scene == 'room' else ([4, 16, 64], 1e-3)
                # A denoised picture reaches the mark with fewer samples.
                if 'denoised' in only: error([Ours(o, a.out, True) for o in a.ours], scene, edge, [8, 16, 32, 64, 256], lambda t: truth(t, scene, edge, spp), target, 2)
                if 'error' in only: error(ours + theirs[:1] + best, scene, edge, spps, lambda t: truth(t, scene, edge, spp), target, 2)
    if 'threads' in only:
        for o in ours:
            for scene in scenes:
                edge = sizes[scene][-1][0]; spp = 512 if scene == 'cornell' else 32
                walls = [[o.render(scene, edge, spp, threads=t, seed=r)[1] for t in (1, 2)] for r in range(a.rounds)]
                print(f'{o.name} {scene}: two threads are {spread([x / y for x, y in walls])} times as fast as one by the clock', flush=True)
if __name__ == '__main__': main()
