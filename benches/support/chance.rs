//! Randomly sampled pictures, and how often the intervals of their pixels contain the truth.

use raywright::core::metrics::student_factor_95;
use raywright::core::picture::Picture;
use raywright::core::settings::{Aov, Sampling, Settings, default_replicates};
use raywright::core::{Scene, prepare};
use raywright::io::{Input, LoadOptions, load};

/// A sphere with a soft shadow on a floor: an area light is sampled.
const SOFT_LIGHT: &str = r#"
format = 1

[[cameras]]
pose.look_at = { eye = [0, 2.2, 4.2], target = [0, 0.3, 0] }
projection.pinhole.vertical_fov = 38

[[materials]]
name = "matte"
model.classic = { colour = "0.5 + 0.3 * fbm(1.5 * p, 3)" }

[[materials]]
name = "lamp"
model.classic = { local = 0, emission = 12 }

[[objects]]
shape.plane = { point = [0, 0, 0], normal = [0, 1, 0] }
material = "matte"

[[objects]]
shape.sphere = { centre = [0, 0.7, 0], radius = 0.7 }
material = "matte"

[[objects]]
shape.disk = { centre = [1.5, 3.5, 1], normal = [-0.4, -1, -0.2], radius = 1 }
material = "lamp"
"#;

/// Spheres before, in and behind the focal plane, on a mottled floor under a sky: a lens is
/// sampled.
const LENS: &str = r#"
format = 1

[render]
pattern = "centre"

[classic]
ambient = 0.2

[[cameras]]
pose.look_at = { eye = [0, 1.1, 4], target = [0, 0.4, 0] }
projection.thin_lens = { pinhole = { vertical_fov = 40 }, aperture_radius = 0.25, focus_distance = 3.2 }

[sky.gradient]
bottom = 0.6
top = 1

[[lights]]
kind.directional.to_light = [1, 2, 1.5]
colour = 0.8

[[materials]]
name = "mottled"
model.classic = { colour = "0.5 + 0.4 * fbm(4 * p, 4)" }

[[objects]]
shape.plane = { point = [0, 0, 0], normal = [0, 1, 0] }
material = "mottled"

[[objects]]
shape.sphere = { centre = [-0.7, 0.5, 1], radius = 0.5 }
material = "mottled"

[[objects]]
shape.sphere = { centre = [0.7, 0.5, -1.5], radius = 0.5 }
material = "mottled"
"#;

/// Both scenes with their names.
pub fn scenes() -> [(&'static str, Scene); 2] {
    [("soft light", SOFT_LIGHT), ("lens", LENS)].map(|(name, text)| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("chance.scene.toml");
        std::fs::write(&path, text).expect("the folder can be written to");
        (
            name,
            load(&Input::Path(path), &LoadOptions::default())
                .unwrap_or_else(|e| panic!("{e}"))
                .scene,
        )
    })
}

/// Sampling settings.
#[derive(Clone, Copy)]
pub struct SamplingCase {
    pub size: [u32; 2],
    pub samples: u32,
    /// Number of replicates; `None` for the default.
    pub replicates: Option<u32>,
}

/// A picture with its standard errors.
pub fn picture(scene: &Scene, render: SamplingCase, seed: u64) -> Picture {
    let mut settings = Settings::from_scene(scene);
    settings.size = render.size;
    (settings.sampling, settings.replicates, settings.seed) =
        (Sampling::General(render.samples), render.replicates, seed);
    settings.aovs = vec![Aov::StandardError];
    prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture
}

fn errors(picture: &Picture) -> &[f32] {
    &picture
        .layer("stderr.G")
        .unwrap_or_else(|| panic!("it was asked for"))
        .samples
}

/// Statistics of many pictures.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoverageTally {
    /// Random pixels in all pictures.
    pub intervals: u64,
    /// Pixels whose interval contains the truth.
    pub held: u64,
    /// Pixels whose interval has zero width, since all replicates agree.
    pub empty: u64,
    squares: f64,
    claimed: f64,
}

impl CoverageTally {
    /// Fraction of intervals that contain the truth.
    pub fn coverage(&self) -> f64 {
        self.held as f64 / self.intervals.max(1) as f64
    }
    /// Root mean square of the true pixel errors.
    pub fn error(&self) -> f64 {
        (self.squares / self.intervals.max(1) as f64).sqrt()
    }
    /// Root mean square of the estimated pixel errors.
    pub fn claimed(&self) -> f64 {
        (self.claimed / self.intervals.max(1) as f64).sqrt()
    }
}

/// Judges pictures of several seeds by a reference, whose variance is added to that of each pixel.
/// Pixels that are deterministic in both the reference and the picture are not counted.
pub fn judge(
    scene: &Scene,
    reference: &Picture,
    render: SamplingCase,
    seeds: core::ops::Range<u64>,
) -> CoverageTally {
    let factor = student_factor_95(
        render
            .replicates
            .unwrap_or(default_replicates(render.samples))
            .min(render.samples)
            - 1,
    );
    let mut tally = CoverageTally::default();
    for seed in seeds {
        let found = picture(scene, render, seed);
        let errors = errors(&found).iter().zip(self::errors(reference));
        for ((pixel, truth), (&error, &of_truth)) in
            found.rgb.iter().zip(&reference.rgb).zip(errors)
        {
            if error.max(of_truth) <= 0.0 {
                continue;
            }
            let off = f64::from(pixel[1]) - f64::from(truth[1]);
            let (error, of_truth) = (f64::from(error.max(0.0)), f64::from(of_truth));
            tally.intervals += 1;
            tally.empty += u64::from(error == 0.0);
            tally.held +=
                u64::from(off.abs() <= factor * (error * error + of_truth * of_truth).sqrt());
            tally.squares += off * off;
            tally.claimed += error * error;
        }
    }
    tally
}
