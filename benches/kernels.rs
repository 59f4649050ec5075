//! Kernels and precisions, on the preset and on a mesh: baselines for comparing two states of the code; for comparing them
//! with each other see `interleaved.rs`.

#[path = "support/mesh.rs"]
mod mesh;
#[path = "support/scenes.rs"]
mod scenes;
#[path = "support/threads.rs"]
mod threads;

use criterion::{Criterion, Throughput};
use raywright::core::settings::{KernelChoice, PrecisionChoice};

use mesh::mesh;
use scenes::{preset, ready};
use threads::threads;

const SIZE: [u32; 2] = [320, 180];

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let alone = threads(1);
    let scenes = [("whitted", preset("whitted")), ("mesh", Some(mesh())), ("shapes", preset("shapes"))];
    for (name, scene) in scenes {
        let Some(scene) = scene else { continue };
        let mut group = criterion.benchmark_group(name);
        group.sample_size(20).throughput(Throughput::Elements(u64::from(SIZE[0]) * u64::from(SIZE[1])));
        for (precision_name, precision) in [("robust", PrecisionChoice::Robust), ("reference", PrecisionChoice::Reference)] {
            for (kernel_name, kernel) in [("fitting", KernelChoice::Fitting), ("general", KernelChoice::General)] {
                let ready = ready(&scene, SIZE, |s| {
                    s.precision = precision;
                    s.kernel = kernel;
                });
                let name = format!("{precision_name}, {kernel_name} kernel");
                group.bench_function(name, |b| b.iter(|| alone.install(|| ready.render(&()))));
            }
        }
        group.finish();
    }
    criterion.final_summary();
}
