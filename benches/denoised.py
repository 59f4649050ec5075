"""Denoised pictures beside those of Blender Cycles with Open Image Denoise: errors, times and a sheet to look at.

    python -m venv venv && venv/bin/pip install bpy numpy pillow OpenEXR
    venv/bin/python benches/denoised.py OUT --ours target/release/raywright [--edge 384] [--samples 16,64]
    venv/bin/python benches/denoised.py OUT --ours target/release/raywright --goldens ../shared

The first form renders the scenes of paths.py with both. Errors are root relMSE to a converged picture of the same renderer, since the
two do not agree to the last per cent on glass and coats; a picture of 8-bit codes is no reference. The second form sets our pictures, at the
camera and light of `reference/gltf`, beside its Cycles pictures (128 samples and a denoiser), with the mean difference of codes. Those were
rendered at twice the dimensions that their scenarios name, and reduced to 512 pixels as codes, not as light: what is fine and of much
contrast, as writing, gets darker by that. So ours are rendered and reduced in the same way.
Sheets are written to OUT/*.png.
"""
import argparse, json, math, os, subprocess, sys, time
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from paths import cpu, model, read_exr, rel_mse, write_all
import resource

def display(rgb):
    """Linear light as 8-bit sRGB, clipped."""
    x = np.clip(rgb, 0, 1)
    return (np.where(x <= .0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - .055) * 255 + .5).astype('u1')

def ours(binary, out, scene, edge, spp, denoise, seed=0):
    """Colour and CPU seconds of the whole command."""
    light = ['--env', f'{out}/sky.hdr'] if scene == 'model' else ['--env', 'none']
    exr, begun = f'{out}/ours.exr', cpu(resource.RUSAGE_CHILDREN)
    subprocess.run([binary, 'render', f'{out}/{scene}.gltf', '--integrator', 'path', '--size', f'{edge}x{edge}', '--spp', str(spp), '--max-depth', '9',
                    '--seed', str(seed), '-q', '-o', exr] + light + ['--denoise'] * denoise, check=True)
    used = cpu(resource.RUSAGE_CHILDREN) - begun
    if not denoise: return read_exr(exr), used
    import OpenEXR
    with OpenEXR.File(exr) as f:
        c = f.channels()
        return (c['denoised'] if 'denoised' in c else c['denoised.RGB']).pixels[..., :3].astype(float) if 'denoised.R' not in c else \
            np.stack([c[f'denoised.{k}'].pixels for k in 'RGB'], -1).astype(float), used

def prepare_cycles(out, scene):
    import bpy, addon_utils
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for addon in ('io_scene_gltf2', 'cycles'): addon_utils.enable(addon)
    bpy.ops.import_scene.gltf(filepath=f'{out}/{scene}.gltf')
    s = bpy.context.scene; s.render.engine = 'CYCLES'; s.render.threads_mode = 'AUTO'
    s.camera = next(o for o in s.objects if o.type == 'CAMERA')
    s.render.resolution_percentage = 100
    c = s.cycles; c.device = 'CPU'; c.use_adaptive_sampling = False; c.pixel_filter_type = 'BOX'; c.blur_glossy = 0
    c.sample_clamp_indirect = c.sample_clamp_direct = 0
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = 8
    world = bpy.data.worlds.new('world'); s.world = world; world.use_nodes = True
    tree = world.node_tree; background = tree.nodes['Background']
    if scene == 'model':
        image = tree.nodes.new('ShaderNodeTexEnvironment'); image.image = bpy.data.images.load(os.path.abspath(f'{out}/sky.hdr'))
        mapping = tree.nodes.new('ShaderNodeMapping'); coordinates = tree.nodes.new('ShaderNodeTexCoord')
        mapping.inputs['Rotation'].default_value[2] = math.pi / 2
        tree.links.new(coordinates.outputs['Generated'], mapping.inputs['Vector'])
        tree.links.new(mapping.outputs['Vector'], image.inputs['Vector']); tree.links.new(image.outputs['Color'], background.inputs['Color'])
    else: background.inputs['Color'].default_value = (0, 0, 0, 1)
    settings = s.render.image_settings; settings.file_format = 'OPEN_EXR'; settings.color_depth = '32'; settings.color_mode = 'RGB'
    return s

def cycles(s, out, edge, spp, denoise, seed=0):
    import bpy
    s.render.resolution_x = s.render.resolution_y = edge
    s.cycles.samples, s.cycles.seed, s.cycles.use_denoising = spp, seed, denoise
    if denoise: s.cycles.denoiser = 'OPENIMAGEDENOISE'
    s.render.filepath = f'{os.path.abspath(out)}/cycles.exr'; begun = cpu()
    bpy.ops.render.render(write_still=True)
    return read_exr(f'{out}/cycles.exr'), cpu() - begun

def sheet(path, rows, cell):
    """Rows of (picture as codes, two lines below it)."""
    font = ImageFont.load_default(size=15)
    width, height, gap = cell, cell + 44, 8
    out = Image.new('RGB', (gap + (width + gap) * max(map(len, rows)), gap + (height + gap) * len(rows)), 'white')
    pen = ImageDraw.Draw(out)
    for y, row in enumerate(rows):
        for x, (codes, *lines) in enumerate(row):
            at = (gap + x * (width + gap), gap + y * (height + gap))
            out.paste(Image.fromarray(codes).convert('RGB').resize((cell, cell), Image.LANCZOS), at)
            for i, line in enumerate(lines): pen.text((at[0], at[1] + cell + 3 + 19 * i), line, fill='black', font=font)
    out.save(path)

def beside(a):
    counts = [int(n) for n in a.samples.split(',')]
    if not os.path.exists(f'{a.out}/model.gltf'): write_all(a.out, 1024)
    rows = []
    print('| scene | samples | picture | root relMSE | CPU s |\n|---|---|---|---|---|')
    for scene in a.scenes.split(','):
        of_cycles = prepare_cycles(a.out, scene); row = []
        def truth(name, made):
            path = f'{a.out}/truth_{name}_{scene}_{a.edge}.npy'
            if not os.path.exists(path): np.save(path, made()[0])
            return np.load(path)
        true = dict(ours=truth('ours', lambda: ours(a.ours, a.out, scene, a.edge, a.truth, False, 999)), cycles=truth('cycles', lambda: cycles(of_cycles, a.out, a.edge, a.truth, False, 999)))
        print(f'<!-- {scene}: means ' + '; '.join(f'{k} {v.mean((0, 1)).round(4).tolist()}' for k, v in true.items()) + f', relMSE of one to the other {rel_mse(true["ours"], true["cycles"]):.3g} -->')
        for spp in counts:
            made = [('noisy', 'ours', *ours(a.ours, a.out, scene, a.edge, spp, False)), ('denoised', 'ours', *ours(a.ours, a.out, scene, a.edge, spp, True)),
                    ('Cycles, noisy', 'cycles', *cycles(of_cycles, a.out, a.edge, spp, False)), ('Cycles with Open Image Denoise', 'cycles', *cycles(of_cycles, a.out, a.edge, spp, True))]
            for name, whose, image, used in made:
                error = math.sqrt(rel_mse(image, true[whose]))
                print(f'| {scene} | {spp} | {name} | {error:.4f} | {used:.1f} |', flush=True)
                if 'noisy' not in name or spp == counts[0] and whose == 'ours': row.append((display(image), f'{name}, {spp} samples' if len(name) < 20 else f'Cycles + OIDN, {spp} samples', f'root relMSE {error:.3f}, {used:.0f} CPU s'))
        row.append((display(true['ours']), f'ours, {a.truth} samples', ''))
        rows.append(row)
    sheet(f'{a.out}/beside.png', rows, min(a.edge, 300))

def goldens(a):
    folder = f'{a.goldens}/reference/gltf'; scenarios = json.load(open(f'{folder}/scenarios.json')); rows = []
    print('| model | picture | mean difference of codes to Cycles |\n|---|---|---|')
    for name, s in scenarios.get('scenarios', scenarios).items():
        if not name.startswith('khronos') or not os.path.isdir(f'{folder}/{name}'): continue
        theirs = np.array(Image.open(f'{folder}/{name}/blender-cycles.webp').convert('RGBA')); h, w = theirs.shape[:2]
        o, t = s['orbit'], s['target']; th, ph, r = math.radians(o['theta']), math.radians(o['phi']), o['radius']
        target = [t[k] for k in 'xyz']; eye = [target[0] + r * math.sin(ph) * math.sin(th), target[1] + r * math.cos(ph), target[2] + r * math.sin(ph) * math.cos(th)]
        flat = lambda p: np.where(p[..., 3:] == 255, p[..., :3], 255).astype('u1')
        full = s['dimensions']
        row = [(flat(theirs), f'{name[8:]}: Cycles', '128 samples and a denoiser')]
        for spp, denoise in [(16, False), (16, True)]:
            png = f'{a.out}/golden.png'
            subprocess.run([a.ours, 'render', f"{a.goldens}/{s['model']}", '--env', f'{folder}/lightroom_14b_1k_reconstructed.hdr', '--integrator', 'path', '--eye=' + ','.join(map(str, eye)),
                            '--target=' + ','.join(map(str, target)), '--fov', str(s['verticalFoV']), '--size', f'{2 * full["width"]}x{2 * full["height"]}', '--background', 'transparent', '--tonemap', 'aces-hill', '--gamma', '2.2',
                            '--exposure', '0', '--max-depth', '12', '--spp', str(spp), '-q', '-o', png] + ['--denoise'] * denoise, check=True)
            image = np.array(Image.open(png).convert('RGBA').resize((w, h), Image.LANCZOS)); both = (image[..., 3] == 255) & (theirs[..., 3] == 255)
            apart = np.abs(image[both][:, :3].astype(float) - theirs[both][:, :3]).mean(); words = f"{spp} samples{', denoised' if denoise else ''}"
            print(f'| {name[8:]} | {words} | {apart:.2f} |', flush=True); row.append((flat(image), words, f'{apart:.2f} codes from Cycles'))
        near = sorted(s['meanAbsDiff8bit_vs_blender-cycles'].items(), key=lambda x: x[1])
        print(f"| {name[8:]} | others: {', '.join(f'{k} {v}' for k, v in near[:4])} | |"); rows.append(row)
    sheet(f'{a.out}/goldens.png', rows, 384)

if __name__ == '__main__':
    p = argparse.ArgumentParser(); p.add_argument('out'); p.add_argument('--ours', required=True); p.add_argument('--edge', type=int, default=384); p.add_argument('--samples', default='16,64')
    p.add_argument('--truth', type=int, default=4096); p.add_argument('--scenes', default='model,cornell'); p.add_argument('--goldens'); a = p.parse_args()
    a.ours = os.path.abspath(a.ours); os.makedirs(a.out, exist_ok=True)
    goldens(a) if a.goldens else beside(a)
