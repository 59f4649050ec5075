"""Path tracing beside what people would pick instead: Blender Cycles, LuxCore and Mitsuba 3, one thread each, on seven scenes
of one description. First the means of the pictures: a row whose means differ by more than 1 % has no ratio. Then samples a CPU
second, time to equal noise, error and time of denoised pictures, and the first picture as a user would make it.

    python3.11 -m venv venv && venv/bin/pip install bpy==5.0.1 pyluxcore==2.11.2 mitsuba==3.9.0 pyoidn OpenEXR pillow numpy \\
        --extra-index-url https://download.blender.org/pypi/
    DRJIT_LIBLLVM_PATH=.../libLLVM.so venv/bin/python benches/peers.py OUT --ours target/release/raywright [--rounds 5]

OUT/peers.jsonl keeps every render, so that a run can be continued. --table prints the tables of it alone, --plot FILE.svg draws them.
Each program runs as a worker: a JSON job a line, CPU time of the render alone out; start, reading and compiling kernels are outside.
"""
import argparse, array, json, math, os, resource, statistics, subprocess, sys, time
import numpy as np
import paths
from paths import icosphere, quad

# ------------------------------------------------------------------------------------------------------------------ the scenes
WHITE = [.73] * 3

def join(meshes):
    offsets = np.cumsum([0] + [len(m['P']) for m in meshes])
    return {**{k: np.concatenate([m[k] for m in meshes]) for k in ('P', 'N', 'UV')}, 'I': np.concatenate([m['I'] + o for m, o in zip(meshes, offsets)]).astype('u4')}

def slab(low, high, turn=0.0):
    """A box of 12 triangles, turned about its vertical middle."""
    (a, b, c), (d, e, f) = low, high
    middle, k = np.array([(a + d) / 2, 0, (c + f) / 2]), math.radians(turn)
    rotation = np.array([[math.cos(k), 0, math.sin(k)], [0, 1, 0], [-math.sin(k), 0, math.cos(k)]])
    faces = [[(a, b, f), (d, b, f), (d, e, f), (a, e, f)], [(d, b, c), (a, b, c), (a, e, c), (d, e, c)], [(d, b, f), (d, b, c), (d, e, c), (d, e, f)],
             [(a, b, c), (a, b, f), (a, e, f), (a, e, c)], [(a, e, f), (d, e, f), (d, e, c), (a, e, c)], [(a, b, c), (d, b, c), (d, b, f), (a, b, f)]]
    return join([quad(*[rotation @ (np.array(p) - middle) + middle for p in face]) for face in faces])

def box():
    """Cornell's box, matte, with two blocks and the usual lamp."""
    cornell = paths.cornell()
    walls = [(m, look) for m, look in cornell['parts'] if 'diffuse' in look]
    lamp = quad([-.25, 1.999, -.2], [.25, 1.999, -.2], [.25, 1.999, .2], [-.25, 1.999, .2])
    return dict(cornell, name='box', parts=walls + [(lamp, dict(emits=17.0)), (slab([-.65, 0, -.7], [-.05, 1.2, -.1], -17), dict(diffuse=WHITE)), (slab([.05, 0, -.1], [.65, .6, .5], 18), dict(diffuse=WHITE))])

def room():
    made = paths.room()
    for mesh, look in made['parts']:
        if 'at' in look: mesh['P'] = (mesh['P'] + np.array(look.pop('at'))).astype('f4')
    return made

def window():
    """A closed room with one opening of 1.2 by 1 m, lit by the sky outside alone."""
    w, o, b = [.7, .68, .64], [.65, .45, .25], [.3, .35, .5]
    front = [slab([-3.2, 0, 3], [-2, 3, 3.2]), slab([-.8, 0, 3], [3.2, 3, 3.2]), slab([-2, 0, 3], [-.8, 1.1, 3.2]), slab([-2, 2.1, 3], [-.8, 3, 3.2])]
    legs = [slab([x, 0, z], [x + .08, .7, z + .08]) for x in (-1.6, .12) for z in (-1.6, -.68)]
    return dict(name='window', camera=dict(eye=[2.6, 1.6, 2.4], target=[-1.2, .9, -1.2], fov=60.0), env='sky.hdr', parts=[
        (slab([-3.2, -.2, -3.2], [3.2, 0, 3.2]), dict(diffuse=o)), (slab([-3.2, 3, -3.2], [3.2, 3.2, 3.2]), dict(diffuse=w)), (slab([-3.2, 0, -3.2], [3.2, 3, -3]), dict(diffuse=w)),
        (slab([-3.2, 0, -3], [-3, 3, 3]), dict(diffuse=b)), (slab([3, 0, -3], [3.2, 3, 3]), dict(diffuse=w)), (join(front), dict(diffuse=w)),
        (slab([-1.6, .7, -1.6], [.2, .78, -.6]), dict(diffuse=o)), (join(legs), dict(diffuse=o)), (icosphere([-.9, 1.03, -1.1], .25), dict(diffuse=w)), (icosphere([1.2, .4, -1.2], .4), dict(diffuse=[.6, .2, .15]))])

def lights(n=1000):
    """A hall with columns under a thousand triangles of light of unequal size, facing down."""
    r = np.random.default_rng(9)
    c = np.stack([r.uniform(-4.8, 4.8, n), r.uniform(2.4, 3.9, n), r.uniform(-4.8, 4.8, n)], 1)
    s, t = .06 * np.exp(.5 * r.normal(size=(n, 1))), r.uniform(0, 2 * np.pi, (n, 1))
    corner = lambda k: np.concatenate([np.cos(t + k), r.normal(size=(n, 1)) * .3, np.sin(t + k)], 1)
    p = np.stack([c + s * corner(k) for k in (0, 2 * np.pi / 3, 4 * np.pi / 3)], 1)
    up = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 1] > 0
    p[up] = p[up][:, ::-1]
    g = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]); g /= np.linalg.norm(g, axis=1)[:, None]
    lamp = dict(P=p.reshape(-1, 3).astype('f4'), N=np.repeat(g, 3, 0).astype('f4'), UV=np.zeros((3 * n, 2), 'f4'), I=np.arange(3 * n, dtype='u4').reshape(-1, 3))
    hall = [quad([-5, 0, 5], [5, 0, 5], [5, 0, -5], [-5, 0, -5]), quad([-5, 4, -5], [5, 4, -5], [5, 4, 5], [-5, 4, 5]), quad([-5, 0, -5], [5, 0, -5], [5, 4, -5], [-5, 4, -5]),
            quad([5, 0, 5], [-5, 0, 5], [-5, 4, 5], [5, 4, 5]), quad([-5, 0, 5], [-5, 0, -5], [-5, 4, -5], [-5, 4, 5]), quad([5, 0, -5], [5, 0, 5], [5, 4, 5], [5, 4, -5])]
    columns = [slab([x - .3, 0, z - .3], [x + .3, 3, z + .3]) for x in (-3, 0, 3) for z in (-3, 0, 2)]
    return dict(name='lights', camera=dict(eye=[0, 1.7, 4.8], target=[0, 1.5, 0], fov=63.0), env=None, parts=[(join(hall), dict(diffuse=[.7] * 3)), (join(columns), dict(diffuse=[.6, .5, .4])), (lamp, dict(emits=15.0))])

def glass():
    """A ball and a block of glass before a matte ball, under the sky."""
    return dict(name='glass', camera=dict(eye=[1.4, 1.2, 3.0], target=[0, .45, 0], fov=40.0), env='sky.hdr', parts=[
        (quad([-4, 0, 4], [4, 0, 4], [4, 0, -4], [-4, 0, -4]), dict(diffuse=[.6, .58, .55])), (icosphere([-.35, .5001, .2], .5), dict(glass=1.5)),
        (slab([.35, .0001, .3], [.95, .7, .7], 25), dict(glass=1.5)), (icosphere([.4, .4, -.7], .4), dict(diffuse=[.65, .25, .15]))])

SCENES = dict(box=box, room=room, window=window, lights=lights, glass=glass, cornell=paths.cornell, model=paths.model)
# Edge in pixels, and samples of a pixel in the parts `noise` and `means`.
SIZES = dict(box=(128, 16, 64), room=(128, 16, 64), window=(128, 64, 128), lights=(128, 16, 64), glass=(128, 16, 64), cornell=(64, 64, 1024), model=(128, 16, 64))
paths.SCENES.update(SCENES)
paths.UNDER_SKY += ('window', 'glass')
PEERS = ('ours', 'cycles', 'luxcore', 'mitsuba')
LABELS = dict(ours='Raywright', cycles='Cycles 5.0.1', luxcore='LuxCore 2.11', mitsuba='Mitsuba 3.9')
# Segments of a path, that from the camera and that to a light included; the others count bounces between the two.
SEGMENTS = 9

# ----------------------------------------------------------------------------------------------------------------- the workers
def read_picture(path, denoised=False):
    import OpenEXR
    with OpenEXR.File(path, separate_channels=True) as file:
        channels = {name: np.asarray(channel.pixels, 'f4') for name, channel in file.channels().items()}
    return np.stack([channels['denoised.' * denoised + c] for c in 'RGB'], -1)

class Ours:
    who = resource.RUSAGE_CHILDREN
    def __init__(self, out): self.out = out
    def load(self, scene, edge): pass
    def render(self, scene, edge, samples, seed, denoise):
        sky = ['--env', f'{self.out}/sky.hdr', '--env-rotation', '90'] if scene in paths.UNDER_SKY else ['--env', 'none']
        subprocess.run([os.environ['OURS'], 'render', f'{self.out}/{scene}.gltf', '--integrator', 'path', '--size', f'{edge}x{edge}', '--spp', str(samples), '--max-depth', str(SEGMENTS),
                        '--threads', '1', '--seed', str(seed), '-q', '-o', f'{self.out}/ours.exr', *sky, *['--denoise'] * denoise], check=True)
        return lambda: read_picture(f'{self.out}/ours.exr', denoise)

class Cycles:
    """Made equal: box filter, no clamping, no blurred caustics, no threshold of light; lamps emit from their front alone; the sky is turned by 90 degrees."""
    who = resource.RUSAGE_SELF
    def __init__(self, out):
        import bpy
        self.bpy, self.out, self.made = bpy, out, None
    def node(self, tree, kind, **inputs):
        node = tree.nodes.new('ShaderNode' + kind)
        for name, value in inputs.items(): node.inputs[name].default_value = (*value, 1) if isinstance(value, (list, tuple)) else value
        return node
    def material(self, look):
        material = self.bpy.data.materials.new('m')
        if not material.node_tree: material.use_nodes = True
        tree = material.node_tree; tree.nodes.clear(); out = tree.nodes.new('ShaderNodeOutputMaterial')
        if 'diffuse' in look: end = self.node(tree, 'BsdfDiffuse', Color=look['diffuse'], Roughness=0.0)
        if 'mirror' in look: end = self.node(tree, 'BsdfGlossy', Color=(1, 1, 1), Roughness=0.0)
        if 'glass' in look: end = self.node(tree, 'BsdfGlass', Color=(1, 1, 1), Roughness=0.0, IOR=look['glass'])
        if 'emits' in look:
            end, light, dark, side = (self.node(tree, k) for k in ('MixShader', 'Emission', 'BsdfDiffuse', 'NewGeometry'))
            light.inputs['Strength'].default_value = look['emits']; dark.inputs['Color'].default_value = (0, 0, 0, 1)
            for i, socket in enumerate((side.outputs['Backfacing'], light.outputs[0], dark.outputs[0])): tree.links.new(socket, end.inputs[i])
            material.cycles.emission_sampling = 'FRONT'
        tree.links.new(end.outputs[0], out.inputs['Surface']); return material
    def mesh(self, mesh, look):
        z_up = lambda a: np.stack([a[:, 0], -a[:, 2], a[:, 1]], 1).astype('f4')
        made = self.bpy.data.meshes.new('p'); n = len(mesh['I'])
        made.from_pydata(z_up(mesh['P']).tolist(), [], mesh['I'].tolist()); made.validate()
        p = mesh['P'][mesh['I']]; flat = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]); flat /= np.maximum(np.linalg.norm(flat, axis=1), 1e-20)[:, None]
        if np.abs(mesh['N'][mesh['I']] - flat[:, None]).max() > 1e-3:
            made.polygons.foreach_set('use_smooth', np.ones(n, bool)); made.normals_split_custom_set_from_vertices(z_up(mesh['N']).tolist())
        made.materials.append(self.material(look)); self.bpy.context.scene.collection.objects.link(self.bpy.data.objects.new('p', made))
    def load(self, scene, edge):
        if self.made == scene: return
        from mathutils import Vector
        bpy = self.bpy; bpy.ops.wm.read_factory_settings(use_empty=True); s = bpy.context.scene; self.made = scene; made = SCENES[scene]()
        s.render.engine, s.cycles.device, s.render.threads_mode, s.render.threads, s.render.use_persistent_data = 'CYCLES', 'CPU', 'FIXED', 1, True
        if scene == 'model': bpy.ops.import_scene.gltf(filepath=f'{self.out}/model.gltf')
        else:
            for mesh, look in made['parts']: self.mesh(mesh, look)
        view = made['camera']; place = lambda p: Vector((p[0], -p[2], p[1])); eye = place(view['eye'])
        lens = bpy.data.cameras.new('c'); camera = bpy.data.objects.new('c', lens); s.collection.objects.link(camera); s.camera = camera
        camera.location, camera.rotation_euler = eye, (place(view['target']) - eye).to_track_quat('-Z', 'Y').to_euler()
        lens.sensor_fit, lens.angle, lens.clip_start, lens.clip_end = 'VERTICAL', math.radians(view['fov']), .001, 1e4
        world = s.world = bpy.data.worlds.new('w')
        if not world.node_tree: world.use_nodes = True
        tree = world.node_tree; ground = next(n for n in tree.nodes if n.type == 'BACKGROUND'); ground.inputs['Color'].default_value = (0, 0, 0, 1)
        if made['env']:
            image, turn, coordinates = (self.node(tree, k) for k in ('TexEnvironment', 'Mapping', 'TexCoord'))
            image.image = bpy.data.images.load(os.path.abspath(f"{self.out}/{made['env']}")); turn.inputs['Rotation'].default_value[2] = math.pi / 2
            for a, b in ((coordinates.outputs['Generated'], turn.inputs[0]), (turn.outputs[0], image.inputs[0]), (image.outputs[0], ground.inputs['Color'])): tree.links.new(a, b)
    def render(self, scene, edge, samples, seed, denoise):
        s = self.bpy.context.scene; c, r = s.cycles, s.render; r.resolution_x = r.resolution_y = edge; r.resolution_percentage = 100
        c.samples, c.seed, c.use_adaptive_sampling, c.use_denoising, c.use_light_tree, c.use_auto_tile = samples, seed, False, denoise, True, False
        c.denoiser, c.denoising_use_gpu = 'OPENIMAGEDENOISE', False
        c.pixel_filter_type, c.blur_glossy, c.sample_clamp_indirect, c.sample_clamp_direct, c.light_sampling_threshold = 'BOX', 0, 0, 0, 0
        c.caustics_reflective = c.caustics_refractive = True
        c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = SEGMENTS - 2; c.min_light_bounces = c.min_transparent_bounces = 0
        f = r.image_settings
        if hasattr(f, 'media_type'): f.media_type = 'IMAGE'
        f.file_format, f.color_depth, f.color_mode, f.exr_codec, r.filepath = 'OPEN_EXR', '32', 'RGB', 'NONE', os.path.abspath(f'{self.out}/cycles.exr')
        self.bpy.ops.render.render(write_still=True)
        return lambda: read_picture(f'{self.out}/cycles.exr')

class LuxCore:
    """Made equal: no filter (its picture then lies a row lower), no clamping, the sky's y and z swapped. Its lamps show a dark back, not light, from behind."""
    who = resource.RUSAGE_SELF
    def __init__(self, out):
        import pyluxcore
        pyluxcore.Init(lambda line: None); self.lux, self.out, self.made = pyluxcore, out, {}
    def properties(self, values):
        made = self.lux.Properties()
        for key, value in values.items(): made.Set(self.lux.Property(key, value))
        return made
    def material(self, key, look):
        if 'diffuse' in look: return {key + 'type': 'matte', key + 'kd': look['diffuse']}
        if 'emits' in look: return {key + 'type': 'matte', key + 'kd': [0., 0., 0.], key + 'emission': [float(look['emits'])] * 3}
        if 'mirror' in look: return {key + 'type': 'mirror', key + 'kr': [1., 1., 1.]}
        if 'glass' in look: return {key + 'type': 'glass', key + 'kr': [1., 1., 1.], key + 'kt': [1., 1., 1.], key + 'interiorior': look['glass'], key + 'exteriorior': 1.0}
        maps = {}
        for name, gamma in (('base', 2.2), ('rough', 1.0), ('metal', 1.0), ('normal', 1.0), ('emission', 2.2)):
            maps.update({f'scene.textures.{name}.type': 'imagemap', f'scene.textures.{name}.file': f'{self.out}/{name}.png', f'scene.textures.{name}.gamma': gamma})
        maps.update({'scene.textures.bent.type': 'normalmap', 'scene.textures.bent.texture': 'normal', key + 'type': 'disney', key + 'basecolor': 'base', key + 'roughness': 'rough',
                     key + 'metallic': 'metal', key + 'specular': .5, key + 'bumptex': 'bent', key + 'emission': 'emission'})
        return maps
    def load(self, scene, edge):
        if (scene, edge) in self.made: return
        made, values = SCENES[scene](), {}; view = made['camera']
        for i, (_, look) in enumerate(made['parts']):
            values.update(self.material(f'scene.materials.m{i}.', look))
            values.update({f'scene.shapes.s{i}.type': 'mesh', f'scene.shapes.s{i}.ply': f'{self.out}/{scene}_{i}.ply', f'scene.objects.o{i}.shape': f's{i}', f'scene.objects.o{i}.material': f'm{i}'})
        row = 2 / edge
        values.update({'scene.camera.type': 'perspective', 'scene.camera.lookat.orig': view['eye'], 'scene.camera.lookat.target': view['target'], 'scene.camera.up': [0., 1., 0.], 'scene.camera.fieldofview': view['fov'],
                       'scene.camera.screenwindow': [-1., 1., -1. - row, 1. - row], 'scene.camera.autofocus.enable': 0, 'scene.camera.cliphither': 1e-3, 'scene.camera.clipyon': 1e4})
        if made['env']:
            values.update({'scene.lights.sky.type': 'infinite', 'scene.lights.sky.file': f"{self.out}/{made['env']}", 'scene.lights.sky.gamma': 1.0,
                           'scene.lights.sky.transformation': [1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1]})
        self.made = {(scene, edge): self.lux.Scene()}; self.made[scene, edge].Parse(self.properties(values))
    def render(self, scene, edge, samples, seed, denoise):
        depths = {f'path.pathdepth.{k}': SEGMENTS - 2 for k in ('total', 'diffuse', 'glossy', 'specular')}
        values = {'renderengine.type': 'PATHCPU', 'renderengine.seed': 1 + seed, 'sampler.type': 'SOBOL', 'sampler.sobol.adaptive.strength': 0.0, 'native.threads.count': 1, 'film.width': edge, 'film.height': edge,
                  'path.clamping.variance.maxvalue': 0.0, 'film.filter.type': 'NONE', 'batch.haltspp': samples, 'screen.refresh.interval': 1000, 'film.hw.enable': 0, 'film.imagepipelines.0.0.type': 'NOP',
                  'film.outputs.0.type': 'RGB_IMAGEPIPELINE', 'film.outputs.0.index': 0, 'film.outputs.0.filename': 'x.exr', **depths}
        if denoise:
            values.update({'film.imagepipelines.0.0.type': 'INTEL_OIDN', 'film.imagepipelines.0.0.prefilter.enable': 0, 'film.outputs.1.type': 'ALBEDO', 'film.outputs.1.filename': 'a.exr',
                           'film.outputs.2.type': 'AVG_SHADING_NORMAL', 'film.outputs.2.filename': 'n.exr'})
        session = self.lux.RenderSession(self.lux.RenderConfig(self.properties(values), self.made[scene, edge])); session.Start()
        while not session.HasDone(): time.sleep(.01); session.UpdateStats()
        session.Stop(); pixels = array.array('f', [0] * (edge * edge * 3)); session.GetFilm().GetOutputFloat(self.lux.FilmOutputType.RGB_IMAGEPIPELINE, pixels, 0)
        return lambda: np.array(pixels, 'f4').reshape(edge, edge, 3)[::-1]

class Mitsuba:
    """LLVM, its multijitter sampler; kernels are compiled before the clock. Denoised by Open Image Denoise with albedo and normals."""
    who = resource.RUSAGE_SELF
    def __init__(self, out):
        import mitsuba as mi
        mi.set_variant('llvm_ad_rgb')
        import drjit
        drjit.set_thread_count(1); self.mi, self.peer, self.warm = mi, paths.Mitsuba('llvm_ad_rgb', out, 'multijitter'), set()
        self.layers = mi.load_dict(dict(type='aov', aovs='al:albedo,nn:sh_normal', img=dict(type='path', max_depth=SEGMENTS, rr_depth=5)))
    def load(self, scene, edge): self.peer.scene(scene, edge)
    def pixels(self, scene, edge, samples, seed, denoise):
        made = self.peer.scene(scene, edge)
        return np.array(self.mi.render(made, integrator=self.layers, spp=samples, seed=seed) if denoise else self.mi.render(made, spp=samples, seed=seed)).astype('f4')
    def prepare(self, scene, edge, samples, denoise):
        piece = min(samples, max(1, (1 << 23) // edge ** 2))
        if (scene, edge, piece, denoise) not in self.warm:
            for seed in (1, 2): self.filter(self.pixels(scene, edge, piece, seed, denoise), denoise)
            self.warm.add((scene, edge, piece, denoise))
        return piece
    def filter(self, pixels, denoise):
        if not denoise: return pixels
        import pyoidn
        colour, albedo, normal = (np.ascontiguousarray(p) for p in (pixels[..., :3], np.clip(pixels[..., -6:-3], 0, 1), pixels[..., -3:]))
        return np.asarray(pyoidn.denoise(colour, albedo, normal, hdr=True))
    def render(self, scene, edge, samples, seed, denoise):
        piece, total, done = min(samples, max(1, (1 << 23) // edge ** 2)), 0, 0
        while done < samples: total = total + self.pixels(scene, edge, piece, 100003 * seed + done + 7, denoise); done += piece
        picture = self.filter(total / (done // piece), denoise); return lambda: picture[..., :3]

def serve(kind, out):
    """Answers jobs until the input ends. What the programs print goes to standard error."""
    answers = os.fdopen(os.dup(1), 'w'); os.dup2(2, 1); peer = dict(ours=Ours, cycles=Cycles, luxcore=LuxCore, mitsuba=Mitsuba)[kind](out)
    for line in sys.stdin:
        job = json.loads(line); path = job.pop('path')
        peer.load(job['scene'], job['edge'])
        if kind == 'mitsuba': peer.prepare(job['scene'], job['edge'], job['samples'], job['denoise'])
        start, clock = paths.cpu(peer.who), time.time(); pixels = peer.render(**job); used = paths.cpu(peer.who) - start
        answer = dict(cpu=used, seconds=time.time() - clock, bytes=resource.getrusage(peer.who).ru_maxrss * 1024); np.save(path, pixels())
        print(json.dumps(answer), file=answers, flush=True)
    os._exit(0)

# ---------------------------------------------------------------------------------------------------------------- measurements
class Runs:
    """Renders of all programs, each kept in OUT/peers.jsonl and made once."""
    def __init__(self, out, ours):
        self.out, self.workers, self.environment = out, {}, {**os.environ, 'OURS': ours, 'OPENBLAS_NUM_THREADS': '1', 'OMP_NUM_THREADS': '1'}
        self.file = open(f'{out}/peers.jsonl', 'a+'); self.file.seek(0); self.kept = {r['key']: r for r in map(json.loads, self.file)}
    def do(self, who, scene, samples, seed, denoise):
        edge = SIZES[scene][0]; key = f'{who} {scene} {edge} {samples} {seed} {int(denoise)}'
        if key not in self.kept:
            if who not in self.workers:
                self.workers[who] = subprocess.Popen([sys.executable, __file__, self.out, '--serve', who], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=open(f'{self.out}/{who}.log', 'a'), text=True, env=self.environment)
            worker, path = self.workers[who], f'{self.out}/{key.replace(" ", "_")}.npy'
            worker.stdin.write(json.dumps(dict(scene=scene, edge=edge, samples=samples, seed=seed, denoise=denoise, path=path)) + '\n'); worker.stdin.flush()
            answer = worker.stdout.readline()
            if not answer: sys.exit(f'{who} ended at {scene}: see {self.out}/{who}.log')
            self.kept[key] = dict(json.loads(answer), key=key, path=path); print(json.dumps(self.kept[key]), file=self.file, flush=True)
        return self.kept[key]
    def picture(self, *job): return np.load(self.do(*job)['path']).astype(float)

def trimmed(errors): return np.sort(errors.ravel())[:int(errors.size * .999)].mean()

def measure(runs, scene, who, rounds):
    """All renders of a scene, in turns: seeds 1 and 2 are the pair of means, 10 and on the rounds."""
    _, samples, many = SIZES[scene]
    for seed in (1, 2):
        for peer in who: runs.do(peer, scene, many, seed, False)
    for r in range(rounds):
        for peer in who[r % len(who):] + who[:r % len(who)]:
            for n, denoise in ((1, False), (samples, False), (samples, True)): runs.do(peer, scene, n, 10 + r, denoise)

def figures(runs, scene, who, rounds):
    """Of each program: mean over ours, samples a CPU second, noise, CPU seconds a megapixel noisy and denoised, error denoised, memory."""
    edge, samples, many = SIZES[scene]; found = {}
    means = {p: np.mean([runs.picture(p, scene, many, seed, False) for seed in (1, 2)], 0) for p in who}
    truth = np.mean([means[p] for p in who], 0); weight = 1 / (truth ** 2 + .01 * (truth.mean() / .5) ** 2 if scene == 'window' else truth ** 2 + .01)
    for p in who:
        one, noisy, clean = ([runs.do(p, scene, n, 10 + r, d) for r in range(rounds)] for n, d in ((1, False), (samples, False), (samples, True)))
        fixed = min(r['cpu'] for r in one); per = [(r['cpu'] - fixed) * samples / (samples - 1) for r in noisy]
        pictures = [np.load(r['path']).astype(float) for r in noisy]
        pairs = [trimmed(((a - b) ** 2 / 2 * weight).mean(-1)) for a, b in zip(pictures, pictures[1:])]
        # A denoised picture against the noisy one of another seed, less the noise of that one.
        smooth = [np.load(r['path']).astype(float) for r in clean]; keep = np.ones(weight.shape[:2], bool)
        noise = ((pictures[0] - pictures[1]) ** 2 / 2 * weight).mean(-1); keep = noise <= np.quantile(noise, .995)
        crossed = [((a - b) ** 2 * weight).mean(-1)[keep].mean() - noise[keep].mean() for a, b in ((smooth[0], pictures[1]), (smooth[1], pictures[0]))]
        found[p] = dict(mean=means[p].mean((0, 1)) / means['ours'].mean((0, 1)), rate=[edge ** 2 * samples / c / 1e6 for c in per], noise=pairs, cost=[c / edge ** 2 * 1e6 for c in per],
                        clean_cost=[(r['cpu'] - fixed) / edge ** 2 * 1e6 for r in clean], clean_error=float(np.mean(crossed)), megabytes=max(r['bytes'] for r in noisy) / 1e6)
    return found

def spread(values, form='{:.3g}'): return form.format(statistics.median(values)) + f' [{form.format(min(values))}, {form.format(max(values))}]'

def agrees(row): return np.abs(row['mean'] - 1).max() < .01

def ratios(found, peer):
    """Ours over theirs: samples a CPU second, round by round, and CPU time to equal noise."""
    ours, theirs = found['ours'], found[peer]
    noise = statistics.median(ours['noise']) / statistics.median(theirs['noise'])
    return [a / b for a, b in zip(ours['rate'], theirs['rate'])], [noise * a / b for a, b in zip(ours['cost'], theirs['cost'])]

def table(runs, scenes, who, rounds):
    print('| scene | program | means over ours | M samples a CPU s | noise | ours over it: samples | CPU time to equal noise | denoised: error | CPU s a megapixel | MB |\n|---|---|---|---|---|---|---|---|---|---|')
    for scene in scenes:
        found = figures(runs, scene, who, rounds)
        for p in who:
            row = found[p]; rate, even = ratios(found, p) if p != 'ours' and agrees(row) else (None, None)
            print(f"| {scene} | {LABELS[p]} | {' '.join(f'{m:.3f}' for m in row['mean'])} | {spread(row['rate'])} | {statistics.median(row['noise']):.2e} | {spread(rate, '{:.2f}') if rate else ''} | {spread(even, '{:.2f}') if even else ''} | "
                  f"{row['clean_error']:.1e} | {spread(row['clean_cost'])} | {row['megabytes']:.0f} |", flush=True)

def plot(runs, scenes, who, rounds, path):
    """CPU time to equal noise, ours over theirs, a row a scene: left of the line ours is the faster one."""
    colours = dict(cycles='#d1690e', luxcore='#2a6fb0', mitsuba='#3c8d40'); left, right, top, row = 90, 560, 46, 34; low, high = math.log(.02), math.log(4)
    x = lambda ratio: left + (right - left) * (math.log(min(max(ratio, .02), 4)) - low) / (high - low)
    height = top + row * len(scenes) + 40; lines = [f'<svg xmlns="http://www.w3.org/2000/svg" width="600" height="{height}" font-family="sans-serif" font-size="13">', '<rect width="100%" height="100%" fill="white"/>']
    for k, p in enumerate(p for p in who if p != 'ours'): lines.append(f'<circle cx="{left + 140 * k}" cy="18" r="5" fill="{colours[p]}"/><text x="{left + 10 + 140 * k}" y="22">{LABELS[p]}</text>')
    for tick in (.02, .05, .1, .2, .5, 1, 2, 4):
        lines.append(f'<line x1="{x(tick):.1f}" x2="{x(tick):.1f}" y1="{top - 8}" y2="{height - 36}" stroke="{"#444" if tick == 1 else "#ddd"}"/><text x="{x(tick):.1f}" y="{height - 20}" text-anchor="middle">{tick:g}</text>')
    for k, scene in enumerate(scenes):
        y = top + row * k + row / 2 - 8; found = figures(runs, scene, who, rounds); lines.append(f'<text x="{left - 12}" y="{y + 4}" text-anchor="end">{scene}</text>')
        for j, p in enumerate(p for p in who if p != 'ours'):
            if not agrees(found[p]): continue
            even = ratios(found, p)[1]; at = y + 6 * (j - 1)
            lines.append(f'<line x1="{x(min(even)):.1f}" x2="{x(max(even)):.1f}" y1="{at}" y2="{at}" stroke="{colours[p]}" stroke-width="2"/><circle cx="{x(statistics.median(even)):.1f}" cy="{at}" r="5" fill="{colours[p]}"/>')
    lines.append(f'<text x="{(left + right) / 2}" y="{height - 3}" text-anchor="middle">CPU time to equal noise, Raywright\'s over theirs (below 1: Raywright is faster)</text></svg>')
    with open(path, 'w') as file: file.write('\n'.join(lines) + '\n')

FIRST = """
import sys, math, bpy
from mathutils import Vector
source, out, sky = sys.argv[1:4]; bpy.ops.wm.read_factory_settings(use_empty=True); bpy.ops.import_scene.gltf(filepath=source); s = bpy.context.scene
s.render.engine, s.cycles.device, s.cycles.samples, s.cycles.use_denoising, s.render.threads_mode, s.render.threads = 'CYCLES', 'CPU', 16, True, 'FIXED', 1
s.render.resolution_x, s.render.resolution_y, s.render.resolution_percentage = 640, 360, 100
world = s.world = bpy.data.worlds.new('w')
if not world.node_tree: world.use_nodes = True
tree = world.node_tree; image = tree.nodes.new('ShaderNodeTexEnvironment'); image.image = bpy.data.images.load(sky); tree.links.new(image.outputs[0], next(n for n in tree.nodes if n.type == 'BACKGROUND').inputs[0])
if s.camera is None: s.camera = next(o for o in s.objects if o.type == 'CAMERA')
s.render.filepath = out; bpy.ops.render.render(write_still=True)
"""

def first(out, ours, rounds):
    """From the start of a process to a denoised PNG of 640 x 360 with 16 samples, of a textured glTF model under a sky."""
    commands = dict(ours=[ours, 'render', f'{out}/model.gltf', '--env', f'{out}/sky.hdr', '--size', '640x360', '--spp', '16', '--denoise', '--threads', '1', '-q', '-o', f'{out}/first.png'],
                    cycles=[sys.executable, '-c', FIRST, os.path.abspath(f'{out}/model.gltf'), os.path.abspath(f'{out}/first_cycles.png'), os.path.abspath(f'{out}/sky.hdr')])
    used = {who: [] for who in commands}; memory = {}
    for _ in range(rounds):
        for who, command in commands.items():
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL); _, status, usage = os.wait4(process.pid, 0)
            if status: sys.exit(f'{who} failed: {" ".join(command)}')
            used[who].append(usage.ru_utime + usage.ru_stime); memory[who] = usage.ru_maxrss * 1024 / 1e6
    print('| first picture | CPU s | MB |\n|---|---|---|')
    for who in commands: print(f'| {LABELS[who]} | {spread(used[who])} | {memory[who]:.0f} |')

def write_scenes(out):
    os.makedirs(out, exist_ok=True); paths.textures(out, 1024); paths.sky(out)
    for make in SCENES.values():
        made = make(); paths.write_gltf(made, out)
        for i, (mesh, _) in enumerate(made['parts']): paths.write_ply(f"{out}/{made['name']}_{i}.ply", mesh)

def main():
    ap = argparse.ArgumentParser(); ap.add_argument('out'); ap.add_argument('--ours', default='target/release/raywright'); ap.add_argument('--rounds', type=int, default=5); ap.add_argument('--scenes', default=','.join(SCENES))
    ap.add_argument('--who', default=','.join(PEERS)); ap.add_argument('--serve'); ap.add_argument('--table', action='store_true'); ap.add_argument('--first', action='store_true'); ap.add_argument('--plot'); a = ap.parse_args()
    if a.serve: serve(a.serve, a.out)
    if not os.path.exists(f'{a.out}/model.gltf'): write_scenes(a.out)
    runs, scenes, who, ours = Runs(a.out, os.path.abspath(a.ours)), a.scenes.split(','), a.who.split(','), os.path.abspath(a.ours)
    if a.first: return first(a.out, ours, a.rounds)
    for scene in scenes if not a.table else (): measure(runs, scene, who, a.rounds); print(scene, 'done', file=sys.stderr, flush=True)
    table(runs, scenes, who, a.rounds)
    if a.plot: plot(runs, scenes, who, a.rounds, a.plot)
if __name__ == '__main__': main()
