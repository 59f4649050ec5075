//! `--background`: colours with exact codes, coverage, and shadows as coverage. `--backdrop`: the
//! backdrop of a studio behind models.

use raywright::core::picture::Picture;

use crate::support::Sandbox;

/// A block on the ground, as a model, so that it gets a studio.
pub const BLOCK: &str = "mtllib b.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                     f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";

/// A folder with a red block, `b.obj`.
pub fn block() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("b.obj", BLOCK);
    sandbox.write("b.mtl", "newmtl m\nKd 0.8 0.1 0.05\n");
    sandbox
}

/// Renders the block with these flags, from above so that the ground is behind it.
#[track_caller]
fn render(sandbox: &Sandbox, more: &str) {
    let line = format!("render b.obj --view 30,30 -s 48x36 --spp 16 --zoom 0.6 -q {more}");
    sandbox
        .run(&line.split_whitespace().collect::<Vec<_>>())
        .exits_with(0);
}

/// Codes of display values.
fn codes(picture: &Picture) -> Vec<[u8; 3]> {
    picture
        .rgb
        .iter()
        .map(|rgb| rgb.map(|value| (255.0 * value).round() as u8))
        .collect()
}

/// Largest difference of codes.
fn apart(a: &[[u8; 3]], b: &[[u8; 3]]) -> u8 {
    a.iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| a.abs_diff(*b))
        .max()
        .unwrap_or(0)
}

/// Protects: a background colour keeps its exact codes where it is visible, in each format with
/// codes, for any exposure, tone map and curve, denoised or not; an OpenEXR file has its linear
/// value there, and no coverage.
#[test]
fn a_colour_has_exactly_its_codes() {
    let sandbox = block();
    for (colour, expected) in [
        ("white", [255; 3]),
        ("black", [0; 3]),
        ("#e6b219", [230, 178, 25]),
    ] {
        for more in [
            "",
            "--exposure 3 --tonemap aces",
            "--gamma 2.2 --tonemap agx --exposure -2",
            "--denoise",
            "--ground none",
        ] {
            render(
                &sandbox,
                &format!("--background {colour} -o a.png -o a.webp -o a.exr {more}"),
            );
            for name in ["a.png", "a.webp"] {
                let picture = sandbox.picture(name);
                assert_eq!(
                    (picture.alpha.as_ref(), codes(&picture)[0]),
                    (None, expected),
                    "{name} {colour} {more}"
                );
            }
            let (exr, code) = (sandbox.picture("a.exr"), f64::from(expected[1]) / 255.0);
            let linear = raywright::core::display::curve::decode_transfer(
                raywright::core::scene::TransferCurve::Srgb,
                code,
            );
            assert!(
                exr.alpha.is_none() && (f64::from(exr.rgb[0][1]) - linear).abs() < 1e-6,
                "{colour} {more}: {:?}",
                exr.rgb[0]
            );
        }
    }
    render(&sandbox, "--background white -o a.jpg --quality 100");
    assert_eq!(codes(&sandbox.picture("a.jpg"))[0], [255; 3]);
    render(
        &sandbox,
        "--background #e6b219 --rung output=16-bit -o a.png",
    );
    let [r, g, b] =
        sandbox.picture("a.png").rgb[0].map(|value| (65535.0 * f64::from(value)).round() as u32);
    assert_eq!([r, g, b], [230, 178, 25].map(|code| 257 * code));
}

/// Protects: a transparent picture over a page's colour equals a render with that background,
/// within two codes, shadow and edges included, from PNG and WebP; the premultiplied values of an
/// OpenEXR file over a linear colour give the linear picture.
#[test]
fn pages_show_what_backgrounds_show() {
    let sandbox = block();
    render(
        &sandbox,
        "--background transparent -o clear.png -o clear.webp -o clear.exr",
    );
    let exr = sandbox.picture("clear.exr");
    let alpha = exr.alpha.clone().expect("coverage");
    let is_shadow =
        |pixel: usize| exr.rgb[pixel] == [0.0; 3] && (0.05..0.95).contains(&alpha[pixel]);
    assert!(
        (0..alpha.len()).filter(|&pixel| is_shadow(pixel)).count() > 100,
        "the ground has a shadow"
    );
    assert!(alpha.contains(&0.0) && alpha.contains(&1.0));
    for (page, code) in [
        ("white", [255_u8; 3]),
        ("#808080", [128; 3]),
        ("#e6193c", [230, 25, 60]),
    ] {
        render(
            &sandbox,
            &format!("--background {page} -o direct.png -o direct.exr"),
        );
        let direct = codes(&sandbox.picture("direct.png"));
        for name in ["clear.png", "clear.webp"] {
            let clear = sandbox.picture(name);
            let over = |(rgb, &alpha): (&[f32; 3], &f32)| {
                core::array::from_fn(|i| {
                    (255.0 * alpha * rgb[i] + (1.0 - alpha) * f32::from(code[i])).round() as u8
                })
            };
            let laid: Vec<[u8; 3]> = clear
                .rgb
                .iter()
                .zip(clear.alpha.iter().flatten())
                .map(over)
                .collect();
            assert!(
                apart(&laid, &direct) <= 2,
                "{name} on {page}: {}",
                apart(&laid, &direct)
            );
        }
        let linear = sandbox.picture("direct.exr");
        let over = exr.composite_over(linear.rgb[0].map(f64::from));
        let apart = over
            .rgb
            .iter()
            .flatten()
            .zip(linear.rgb.iter().flatten())
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        assert!(apart < 1e-6, "{page}: {apart}");
    }
}

/// Protects: a film keeps its background and its shadows: resumed, merged from parts, and denoised
/// later it gives the picture of a single run; a sheet, an animation and a picture of one pixel
/// have the colour too.
#[test]
fn films_know_their_background() {
    let sandbox = block();
    render(&sandbox, "--background #e6b219 -o whole.png -o whole.exr");
    for part in ["1/2", "2/2"] {
        render(
            &sandbox,
            &format!(
                "--background #e6b219 --part {part} --checkpoint {}.film",
                &part[..1]
            ),
        );
    }
    sandbox
        .run(&["merge", "1.film", "2.film", "-o", "merged.png", "-q"])
        .exits_with(0);
    assert!(sandbox.picture("merged.png") == sandbox.picture("whole.png"));
    render(
        &sandbox,
        "--background #e6b219 --spp 16 --denoise -o denoised.png --checkpoint d.film",
    );
    sandbox
        .run(&["denoise", "d.film", "-o", "later.png", "-q"])
        .exits_with(0);
    assert!(sandbox.picture("later.png") == sandbox.picture("denoised.png"));
    // Another background over the same film is another picture of the same samples.
    render(
        &sandbox,
        "--background white --spp 16 --denoise --resume d.film -o white.png",
    );
    assert_eq!(codes(&sandbox.picture("white.png"))[0], [255; 3]);
    let views = "b.obj --views front,left -s 48x36 --spp 4 --background #e6b219 --sheet s.png -q";
    sandbox
        .run(&views.split(' ').collect::<Vec<_>>())
        .exits_with(0);
    assert!(
        codes(&sandbox.picture("s.png"))
            .iter()
            .filter(|&&code| code == [230, 178, 25])
            .count()
            > 200
    );
    render(
        &sandbox,
        "--background #e6b219 -s 1x1 --zoom 0.01 --allow-empty -o one.png",
    );
    assert_eq!(codes(&sandbox.picture("one.png")), [[230, 178, 25]]);
}

/// Protects: a denoised shadow is smoother than a noisy one, as coverage and as colour: away from
/// edges its pixels differ less from their neighbours.
#[test]
fn shadows_are_denoised() {
    let sandbox = block();
    let rough = |more: &str| {
        render(
            &sandbox,
            &format!("--background transparent -o a.png {more}"),
        );
        let alpha = sandbox.picture("a.png").alpha.expect("coverage");
        let is_shadow = |pixel: &usize| {
            alpha[pixel - 1..pixel + 2]
                .iter()
                .all(|alpha| (0.02..0.9).contains(alpha))
        };
        let steps = (1..alpha.len() - 1)
            .filter(is_shadow)
            .map(|pixel| f64::from(alpha[pixel] - alpha[pixel - 1]).abs());
        let (sum, count) = steps.fold((0.0, 0), |(sum, count), step| (sum + step, count + 1));
        assert!(count > 50, "{count}");
        sum / f64::from(count)
    };
    let [noisy, denoised] = ["--no-denoise", "--denoise"].map(rough);
    assert!(denoised < 0.6 * noisy, "{denoised} {noisy}");
}

/// Protects: all pictures of a run have the same backdrop, chosen by its first model or the flag; a
/// single picture has the backdrop that contrasts with it, and in a run neither camera nor time
/// changes the choice.
#[test]
fn runs_have_one_backdrop() {
    let sandbox = block();
    for (name, grey) in [("bright", 0.9), ("dark", 0.02)] {
        sandbox.write(
            format!("{name}.obj"),
            BLOCK.replace("b.mtl", &format!("{name}.mtl")),
        );
        sandbox.write(
            format!("{name}.mtl"),
            format!("newmtl m\nKd {grey} {grey} {grey}\n"),
        );
    }
    let corners = |words: &str| {
        let count = words.matches(".obj").count();
        let name = if count == 1 { "0.png" } else { "%d.png" };
        let line = format!("{words} -s 32x24 --spp 4 --ground none -o {name} -q");
        sandbox
            .run(&line.split(' ').collect::<Vec<_>>())
            .exits_with(0);
        (0..count)
            .map(|i| codes(&sandbox.picture(&format!("{i}.png")))[0][0])
            .collect::<Vec<_>>()
    };
    let [bright, dark] = ["bright.obj", "dark.obj"].map(|name| corners(name)[0]);
    assert!(dark > bright + 50, "{dark} {bright}");
    assert_eq!(corners("bright.obj dark.obj"), [bright; 2]);
    assert_eq!(corners("dark.obj bright.obj"), [dark; 2]);
    // A picture without a studio between them changes nothing.
    let line = "bright.obj preset:whitted dark.obj -s 32x24 --spp 4 --ground none -o %d.png -q";
    sandbox
        .run(&line.split(' ').collect::<Vec<_>>())
        .exits_with(0);
    let corner = |name: &str| codes(&sandbox.picture(name))[0][0];
    assert_eq!(["0.png", "2.png"].map(corner), [bright; 2]);
    assert_eq!(corners("bright.obj dark.obj --backdrop light"), [dark; 2]);
    assert_eq!(corners("dark.obj bright.obj --backdrop dark"), [bright; 2]);
    assert_eq!(corners("dark.obj bright.obj --backdrop auto"), [dark; 2]);
    sandbox
        .run(&["render", "dark.obj", "--backdrop", "grey"])
        .exits_with(2)
        .prints_like("`auto`, `dark` or `light`");
}
