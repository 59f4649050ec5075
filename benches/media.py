"""Media beside Mitsuba 3, on five scenes of one description, one thread each: first the means of cells of the picture, in
standard errors and in per cent, then CPU time to equal noise beside the better of `volpath` and `volpathmis`.

    python3.11 -m venv venv && venv/bin/pip install mitsuba==3.9.0 OpenEXR pillow numpy
    DRJIT_LIBLLVM_PATH=.../libLLVM.so venv/bin/python benches/media.py OUT --ours target/release/raywright [--rounds 3]

Both follow paths to their ends by roulette alone, and sample with independent numbers in replicates. Kernels are compiled, and the
scene is read, before the clock. The cloud's formula is a grid of 128³ points in Mitsuba.
"""
import argparse, json, math, os, resource, statistics, subprocess
import numpy as np
import peers
from paths import cpu, read_exr

GREY, EDGE = [.6, .6, .6], 64
UNIT = lambda v: (np.array(v) / np.linalg.norm(v)).tolist()

# A scene: camera, walls (quads as corner and two edges, with a colour or a radiance), balls, a sky, lights, and the air.
def fog():
    """A room of fog with a lamp on its ceiling."""
    quads = [([-1, 0, 1], [2, 0, 0], [0, 0, -2], GREY, 0), ([-1, 2, -1], [2, 0, 0], [0, 0, 2], GREY, 0), ([-1, 0, -1], [2, 0, 0], [0, 2, 0], GREY, 0),
             ([-1, 0, 1], [0, 0, -2], [0, 2, 0], [.6, .06, .05], 0), ([1, 0, -1], [0, 0, 2], [0, 2, 0], [.12, .43, .1], 0), ([-.25, 1.99, -.25], [.5, 0, 0], [0, 0, .5], [0, 0, 0], 15)]
    return dict(eye=[0, 1, 3.4], target=[0, 1, 0], fov=38, quads=quads, air=dict(scattering=[.3, .35, .4], absorption=[.03, .02, .01], anisotropy=.5, radius=6))

def milk():
    """A ball of milk in a ball of glass, under a sky and a large lamp: both boundaries are smooth."""
    return dict(eye=[0, 1.6, 4], target=[0, 0, 0], fov=38, sky=[.5, .6, .8], quads=[([-3, -1.1, 3], [6, 0, 0], [0, 0, -6], GREY, 0), ([2, 3, -2], [2, -3, 0], [0, 0, 4], [0, 0, 0], 3)],
                balls=[([0, 0, 0], 1, dict(ior=1.5)), ([0, 0, 0], .8, dict(ior=1.34, outside=1.5, medium=dict(scattering=[5, 6, 8], absorption=[.01, .03, .1], anisotropy=.7)))])

def wax():
    """A ball of wax with a smooth boundary, on a floor under a sky and a lamp."""
    return dict(eye=[0, 1.6, 4], target=[0, 0, 0], fov=38, sky=[.3, .3, .35], quads=[([-3, -1.01, 3], [6, 0, 0], [0, 0, -6], GREY, 0), ([2, 3, -2], [2, -3, 0], [0, 0, 4], [0, 0, 0], 4)],
                balls=[([0, 0, 0], 1, dict(ior=1.43, medium=dict(scattering=[6, 9, 14], absorption=[.02, .1, .6], anisotropy=0)))])

def cloud():
    """A cloud by formula under a sun and a sky."""
    return dict(eye=[.6, .8, 4], target=[0, 0, 0], fov=38, sky=[.3, .4, .6], sun=([.5, .8, .3], [4, 3.8, 3.5]),
                cloud=dict(scattering=[6, 6, 6], absorption=[.3, .2, .1], anisotropy=.6, density='exp(-4*dot(p, p))*(1 + 0.6*sin(7*p.x)*cos(6*p.y + 1)*sin(5*p.z + 2))', max_density=1.6))

def spot():
    """The cone of a spot in fog, over a floor."""
    return dict(eye=[0, 1.2, 4], target=[0, .9, 0], fov=38, quads=[([-3, 0, 3], [6, 0, 0], [0, 0, -6], GREY, 0)], spot=([-1, 2.2, 0], UNIT([.7, -1, -.1]), 12, [40, 40, 40]),
                air=dict(scattering=[.1, .12, .15], absorption=[.02, .02, .02], anisotropy=.4, radius=8))

def beam():
    """The spot out of view. Points beside a lamp have noise without a bound in Mitsuba, so that `spot` has no means."""
    at, to = [-3, 5, 0], [.2, 0, 0]
    return dict(spot(), spot=(at, UNIT(np.subtract(to, at)), 7, [200, 200, 200]))

SCENES = dict(fog=fog, milk=milk, wax=wax, cloud=cloud, spot=spot, beam=beam)
# Samples of a pixel for the means and for the noise, of either program; and cells along an edge of the picture, whose means are compared.
SAMPLES = dict(fog=(16384, 64), milk=(8192, 64), wax=(2048, 64), cloud=(4096, 64), spot=(0, 64), beam=(16384, 0))
CELLS = dict(fog=4, milk=8, wax=16, cloud=16, beam=4)

def density(p):
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    return np.exp(-4 * (x * x + y * y + z * z)) * (1 + .6 * np.sin(7 * x) * np.cos(6 * y + 1) * np.sin(5 * z + 2))

class Ours:
    name, scenes = 'ours', SCENES
    def __init__(self, out, binary): self.out, self.binary = out, binary
    def write(self, name):
        s = SCENES[name](); materials, objects = [], []
        def add(shape, model, **terms): materials.append(dict(name=f'm{len(materials)}', model=dict(physical=model))); objects.append(dict(shape=shape, material=materials[-1]['name'], **terms))
        for corner, u, v, colour, light in s.get('quads', []):
            materials.append(dict(name=f'm{len(materials)}', model=dict(physical=dict(base_colour=0, specular=0, emission=light) if light else dict(base_colour=colour, specular=0, roughness=1))))
            objects.append(dict(shape=dict(quad=dict(corner=corner, edge_u=u, edge_v=v)), material=materials[-1]['name'], **(dict(side='outside') if light else {})))
        for k, (centre, radius, look) in enumerate(s.get('balls', [])):
            add(dict(sphere=dict(centre=centre, radius=radius)), dict(transmission=1, roughness=0, ior=look['ior'], priority=k + 1, **(dict(interior=look['medium']) if 'medium' in look else {})))
        if 'cloud' in s: add(dict(box=dict(min=[-1] * 3, max=[1] * 3)), dict(boundary='none', interior=s['cloud']))
        lights = []
        if 'sun' in s: lights.append(dict(kind=dict(directional=dict(to_light=s['sun'][0])), colour=s['sun'][1]))
        if 'spot' in s:
            at, along, angle, colour = s['spot']; lights.append(dict(kind=dict(spot=dict(position=at, direction=along, inner_angle=angle * .9999, outer_angle=angle)), colour=colour))
        scene = dict(format=1, cameras=[dict(pose=dict(look_at=dict(eye=s['eye'], target=s['target'])), projection=dict(pinhole=dict(vertical_fov=s['fov'])))], materials=materials, objects=objects, lights=lights)
        scene['sky'] = dict(constant=s.get('sky', 0))
        if 'air' in s: scene['air'] = s['air']
        with open(f'{self.out}/{name}.scene.json', 'w') as file: json.dump(scene, file)
    def run(self, name, samples, seed):
        self.write(name); start = cpu(resource.RUSAGE_CHILDREN)
        subprocess.run([self.binary, 'render', f'{self.out}/{name}.scene.json', '--integrator', 'path', '--size', f'{EDGE}x{EDGE}', '--spp', str(samples), '--max-depth', 'unlimited', '--threads', '1',
                        '--seed', str(seed), '--no-denoise', '-q', '-o', f'{self.out}/ours.exr'], check=True)
        return cpu(resource.RUSAGE_CHILDREN) - start, read_exr(f'{self.out}/ours.exr')
    def render(self, name, samples, seed):
        """CPU seconds without those of a picture of one sample, and the picture."""
        fixed = self.run(name, 1, seed)[0]; used, picture = self.run(name, samples, seed)
        return (used - fixed) * samples / (samples - 1), picture

class Mitsuba:
    scenes = SCENES
    def __init__(self, integrator):
        import mitsuba as mi
        mi.set_variant('llvm_ad_rgb')
        import drjit
        drjit.set_thread_count(1); self.mi, self.name, self.made = mi, integrator, {}
    def scene(self, name):
        mi, s = self.mi, SCENES[name](); T = mi.ScalarTransform4f; rgb = lambda v: dict(type='rgb', value=v)
        def medium(m):
            attenuation = np.array(m['scattering']) + m['absorption']; phase = dict(type='hg', g=m['anisotropy']) if m['anisotropy'] else dict(type='isotropic')
            albedo = (np.array(m['scattering']) / attenuation).tolist()
            if 'density' not in m: return dict(type='homogeneous', albedo=rgb(albedo), sigma_t=rgb((attenuation / attenuation.max()).tolist()), scale=float(attenuation.max()), phase=phase)
            n = 128; at = np.linspace(-1, 1, n); z, y, x = np.meshgrid(at, at, at, indexing='ij')
            # A grid of three channels, since the attenuation of each differs.
            data = density(np.stack([x, y, z], -1))[..., None] * attenuation
            grid = mi.VolumeGrid(np.ascontiguousarray(data, 'f4')); place = T().translate([-1] * 3).scale(2)
            return dict(type='heterogeneous', albedo=dict(type='constvolume', value=rgb(albedo)), sigma_t=dict(type='gridvolume', grid=grid, to_world=place, filter_type='trilinear', raw=True), phase=phase)
        d = dict(type='scene', integrator=dict(type=self.name, max_depth=-1, rr_depth=5))
        if 'air' in s:
            d['air'] = medium(s['air']); bounds = bounds_of(s)
            d['ball'] = dict(type='sphere', center=bounds, radius=s['air']['radius'], bsdf=dict(type='null'), interior=dict(type='ref', id='air'))
        d['sensor'] = dict(type='perspective', fov=s['fov'], fov_axis='y', to_world=T().look_at(s['eye'], s['target'], [0, 1, 0]), sampler=dict(type='independent'),
                           film=dict(type='hdrfilm', width=EDGE, height=EDGE, rfilter=dict(type='box'), pixel_format='rgb'), **(dict(medium=dict(type='ref', id='air')) if 'air' in s else {}))
        for k, (corner, u, v, colour, light) in enumerate(s.get('quads', [])):
            o, u, v = (np.array(x, float) for x in (corner, u, v)); m = np.eye(4); m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u / 2, v / 2, np.cross(u, v) / np.linalg.norm(np.cross(u, v)), o + (u + v) / 2
            look = dict(type='diffuse', reflectance=rgb(colour))
            d[f'quad{k}'] = dict(type='rectangle', to_world=T(m), bsdf=look if light else dict(type='twosided', b=look), **(dict(emitter=dict(type='area', radiance=rgb([light] * 3))) if light else {}))
            if 'air' in s: d[f'quad{k}'].update(interior=dict(type='ref', id='air'), exterior=dict(type='ref', id='air'))
        for k, (centre, radius, look) in enumerate(s.get('balls', [])):
            d[f'ball{k}'] = dict(type='sphere', center=centre, radius=radius, bsdf=dict(type='dielectric', int_ior=look['ior'], ext_ior=look.get('outside', 1.0)), **(dict(interior=medium(look['medium'])) if 'medium' in look else {}))
        if 'cloud' in s: d['cloud'] = dict(type='cube', bsdf=dict(type='null'), interior=medium(s['cloud']))
        if 'sky' in s: d['sky'] = dict(type='constant', radiance=rgb(s['sky']))
        if 'sun' in s: d['sun'] = dict(type='directional', direction=[-x for x in s['sun'][0]], irradiance=rgb(s['sun'][1]))
        if 'spot' in s:
            at, along, angle, colour = s['spot']; to = (np.array(at) + along).tolist()
            d['spot'] = dict(type='spot', to_world=T().look_at(at, to, [0, 1, .1]), cutoff_angle=angle, beam_width=angle * .9999, intensity=rgb(colour), **(dict(medium=dict(type='ref', id='air')) if 'air' in s else {}))
        return mi.load_dict(d)
    def pixels(self, name, samples, seed): return np.array(self.mi.render(self.made[name], spp=samples, seed=seed))[..., :3].astype(float)
    def render(self, name, samples, seed):
        if name not in self.made: self.made[name] = self.scene(name)
        piece, total, done = min(samples, 256), 0, 0
        if (name, piece) not in self.made: self.pixels(name, piece, 1); self.made[name, piece] = True
        start = cpu()
        while done < samples: total = total + self.pixels(name, piece, 100003 * seed + done + 7); done += piece
        return (cpu() - start) * samples / done, total / (done // piece)

class Cycles(peers.Cycles):
    """Balls are meshes of 20480 triangles; bodies have a surface of glass or none. Fog, cloud and wax alone: Cycles knows no nested bodies."""
    name, scenes = 'Cycles', ('fog', 'cloud', 'wax')
    def __init__(self, out): super().__init__(out); peers.SEGMENTS = 1026
    def volume(self, tree, m):
        """Scattering and absorption of a medium, times the cloud's formula."""
        link, node = tree.links.new, lambda kind, *sources, **terms: self.formula(tree, kind, sources, terms)
        both, parts = tree.nodes.new('ShaderNodeAddShader'), [('VolumeScatter', m['scattering'], lambda c: c), ('VolumeAbsorption', m['absorption'], lambda c: 1 - c)]
        if 'density' in m:
            point = tree.nodes.new('ShaderNodeNewGeometry').outputs['Position']; axes = tree.nodes.new('ShaderNodeSeparateXYZ'); link(point, axes.inputs[0]); x, z, y = axes.outputs
            wave = node('MULTIPLY', node('MULTIPLY', node('SINE', node('MULTIPLY', x, 7)), node('COSINE', node('MULTIPLY_ADD', y, 6, 1))), node('SINE', node('MULTIPLY_ADD', z, -5, 2)))
            square = node('MULTIPLY_ADD', x, x, node('MULTIPLY_ADD', y, y, node('MULTIPLY', z, z)))
            shape = node('MULTIPLY', node('EXPONENT', node('MULTIPLY', square, -4)), node('MULTIPLY_ADD', wave, .6, 1))
        for k, (kind, rate, colour) in enumerate(parts):
            most = max(rate); shader = self.node(tree, kind, Color=[colour(c / most) for c in rate], Density=most)
            if k == 0: shader.inputs['Anisotropy'].default_value = m['anisotropy']
            if 'density' in m: link(node('MULTIPLY', shape, most), shader.inputs['Density'])
            link(shader.outputs[0], both.inputs[k])
        return both.outputs[0]
    def formula(self, tree, kind, sources, terms):
        made = tree.nodes.new('ShaderNodeMath'); made.operation = kind
        for socket, source in zip(made.inputs, sources):
            if isinstance(source, (int, float)): socket.default_value = source
            else: tree.links.new(source, socket)
        return made.outputs[0]
    def material(self, look):
        made = super().material({'diffuse': [1] * 3, **look}); tree = made.node_tree; out = next(n for n in tree.nodes if n.type == 'OUTPUT_MATERIAL')
        if 'medium' in look: tree.links.new(self.volume(tree, look['medium']), out.inputs['Volume'])
        if 'open' in look: tree.links.remove(out.inputs['Surface'].links[0])
        return made
    def render(self, name, samples, seed):
        if self.made != name:
            s = SCENES[name](); quads = [(peers.quad(c, *(np.add(c, d).tolist() for d in (u, np.add(u, v), v))), dict(emits=light) if light else dict(diffuse=colour)) for c, u, v, colour, light in s.get('quads', [])]
            bodies = [(peers.icosphere(c, r), dict(glass=look['ior'], medium=look['medium'])) for c, r, look in s.get('balls', [])]
            if 'air' in s: bodies.append((peers.icosphere(bounds_of(s), s['air']['radius']), dict(open=True, medium=s['air'])))
            if 'cloud' in s: bodies.append((peers.slab([-1] * 3, [1] * 3), dict(open=True, medium=s['cloud'])))
            peers.SCENES[name] = lambda: dict(camera=dict(eye=s['eye'], target=s['target'], fov=s['fov']), parts=quads + bodies, env=None)
            self.load(name, EDGE); scene = self.bpy.context.scene
            ground = next(n for n in scene.world.node_tree.nodes if n.type == 'BACKGROUND'); ground.inputs['Color'].default_value = (*s.get('sky', [0] * 3), 1)
            if 'sun' in s:
                to, light = s['sun']; lamp = self.bpy.data.lights.new('sun', 'SUN'); lamp.angle, lamp.energy, lamp.color = 0, 1, light; sun = self.bpy.data.objects.new('sun', lamp); scene.collection.objects.link(sun)
                from mathutils import Vector
                sun.rotation_euler = Vector((to[0], -to[2], to[1])).to_track_quat('Z', 'Y').to_euler()
            self.draw(1, seed)
        fixed = self.draw(1, seed)[0]; used, picture = self.draw(samples, seed); return (used - fixed) * samples / (samples - 1), picture
    def draw(self, samples, seed):
        self.bpy.context.scene.cycles.volume_bounces = 1024; start = cpu(); picture = super().render(self.made, EDGE, samples, seed, False); return cpu() - start, picture()

def bounds_of(s):
    """The centre of the box about the bounded objects, which is that of the air."""
    points = [np.array(c) + i * np.array(u) + j * np.array(v) for c, u, v, *_ in s['quads'] for i in (0, 1) for j in (0, 1)]
    return ((np.min(points, 0) + np.max(points, 0)) / 2).tolist()

def rel_mse(a, b, truth):
    """Noise of one picture, of a pair of seeds; trimmed of the worst 0.1 % of pixels."""
    q = np.sort(((a - b) ** 2 / 2 / (truth ** 2 + .01 * truth.mean() ** 2)).mean(-1).ravel()); return q[:int(len(q) * .999)].mean()

def cells(picture, count):
    n = EDGE // count; return picture.reshape(count, n, count, n, 3).mean((1, 3))

def means(them, name, kept):
    """Four pictures of each: mean and standard error of every cell."""
    found = {}
    for who in them:
        many = [who.render(name, SAMPLES[name][0] // 4, 100 + k)[1] for k in range(4)]; kept[who.name, name] = np.mean(many, 0)
        each = np.array([cells(p, CELLS[name]) for p in many]); found[who.name] = each.mean(0), each.std(0, ddof=1) / 2, np.mean(many, (0, 1, 2))
    ours = found['ours']
    for who in list(found)[1:]:
        theirs = found[who]; error = np.hypot(ours[1], theirs[1]); off = (ours[0] - theirs[0]) / np.maximum(theirs[0], 1e-9); settled = error / np.maximum(theirs[0], 1e-9) < .0025
        sigma = (np.abs(ours[0] - theirs[0]) / np.maximum(error, 1e-12))[error > 1e-6 * theirs[0]]
        print(f"| {name} | {who} | {' '.join(f'{a / b - 1:+.2%}' for a, b in zip(ours[2], theirs[2]))} | {settled.mean():.0%} | {(np.abs(off[settled]) < .005).mean() if settled.any() else float('nan'):.1%} | "
              f"{off[settled].min() if settled.any() else 0:+.2%} to {off[settled].max() if settled.any() else 0:+.2%} | {np.sqrt((sigma ** 2).mean()):.2f} | {np.median(off):+.2%} |", flush=True)

def times(them, name, rounds, kept):
    samples = SAMPLES[name][1]; them = [who for who in them if name in who.scenes]; found = {who.name: [] for who in them}
    for r in range(rounds):
        for who in them[r % len(them):] + them[:r % len(them)]: found[who.name].append([who.render(name, samples, 10 + 2 * r + k) for k in (0, 1)])
    truth = kept.get(('ours', name), np.mean([p for pair in found['ours'] for _, p in pair], 0)); cost = {}
    for who, pairs in found.items(): cost[who] = [(a[0] + b[0]) / 2 * rel_mse(a[1], b[1], truth) for a, b in pairs], [(a[0] + b[0]) / 2 for a, b in pairs], [rel_mse(a[1], b[1], truth) for a, b in pairs]
    best = min((w for w in cost if 'vol' in w), key=lambda w: statistics.median(cost[w][0]))
    for other in [best] + [w for w in cost if w == 'Cycles']:
        ratio = [a / b for a, b in zip(cost['ours'][0], cost[other][0])]
        print(f"| {name} | {other} | {statistics.median(ratio):.2f} [{min(ratio):.2f}, {max(ratio):.2f}] | " + ' | '.join(f"{statistics.median(cost[w][1]):.2f}, {statistics.median(cost[w][2]):.2e}" for w in cost) + ' |', flush=True)

def main():
    ap = argparse.ArgumentParser(); ap.add_argument('out'); ap.add_argument('--ours', default='target/release/raywright'); ap.add_argument('--rounds', type=int, default=3)
    ap.add_argument('--scenes', default=','.join(SCENES)); ap.add_argument('--only', default='means,times'); ap.add_argument('--samples', type=float, default=1, help='factor on the samples of the means'); ap.add_argument('--integrators', default='volpath,volpathmis'); ap.add_argument('--cycles', action='store_true', help='and beside Cycles, where it can make the scene'); a = ap.parse_args()
    os.makedirs(a.out, exist_ok=True); them, kept = [Ours(a.out, os.path.abspath(a.ours))] + [Mitsuba(kind) for kind in a.integrators.split(',')], {}
    if a.cycles: them.append(Cycles(a.out))
    for name, (many, few) in SAMPLES.items(): SAMPLES[name] = (int(many * a.samples), few)
    if 'means' in a.only:
        print('| scene | integrator | means of ours over it | cells settled to .25 % | of these within .5 % | least, greatest | root mean square of sigmas | median cell |\n|---|---|---|---|---|---|---|---|')
        for name in (n for n in a.scenes.split(',') if SAMPLES[n][0]): means(them, name, kept)
    if 'times' in a.only:
        print('| scene | beside | CPU time to equal noise, ours over it | CPU s and noise: ours | volpath | volpathmis | Cycles |\n|---|---|---|---|---|---|---|')
        for name in (n for n in a.scenes.split(',') if SAMPLES[n][1]): times(them, name, a.rounds, kept)
if __name__ == '__main__': main()
