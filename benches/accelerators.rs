//! Queries and builds alone: closest hit by scan and by tree, any hit by tree, and how long each builder preset takes, on
//! generated scenes of constant fill. `raywright bench` measures the first in turns and fits the growth; this is the baseline
//! for comparing two states of the code.

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput};
use raywright::bvh::{AcceleratorKind, BuildQuality, Geometry, Interval, PrimitiveSet, Ray};
use raywright::core::bench::{Kind, group, rays};

const SEED: u64 = 1;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    closest(&mut criterion);
    any(&mut criterion);
    build(&mut criterion);
    criterion.final_summary();
}

fn scene(kind: Kind, count: u32) -> PrimitiveSet<f32> {
    group(kind, count, SEED).unwrap_or_else(|e| panic!("{e}"))
}

fn geometry(kind: Kind, count: u32, accelerator: AcceleratorKind) -> Geometry<f32> {
    Geometry::new(scene(kind, count), accelerator)
}

fn closest(criterion: &mut Criterion) {
    let rays: Vec<Ray<f32>> = rays(4096, SEED + 1);
    for (name, kind) in Kind::ALL {
        let mut group = criterion.benchmark_group(format!("closest hit, {name}"));
        group.sample_size(20).throughput(Throughput::Elements(rays.len() as u64));
        for (accelerator_name, accelerator, counts) in [
            ("scan", AcceleratorKind::Linear, &[8, 32, 1000][..]),
            ("tree", AcceleratorKind::default(), &[8, 32, 1000, 100_000][..]),
        ] {
            for &count in counts {
                let geometry = geometry(kind, count, accelerator);
                group.bench_function(BenchmarkId::new(accelerator_name, count), |b| {
                    b.iter(|| {
                        for ray in &rays {
                            black_box(geometry.closest(black_box(ray), Interval::positive(), &mut ()));
                        }
                    });
                });
            }
        }
        group.finish();
    }
}

/// Whether there is anything: a shadow ray.
fn any(criterion: &mut Criterion) {
    let rays: Vec<Ray<f32>> = rays(4096, SEED + 1);
    let mut group = criterion.benchmark_group("any hit");
    group.sample_size(20).throughput(Throughput::Elements(rays.len() as u64));
    for (name, kind) in Kind::ALL {
        let geometry = geometry(kind, 100_000, AcceleratorKind::default());
        group.bench_function(BenchmarkId::new(name, 100_000), |b| {
            b.iter(|| {
                for ray in &rays {
                    black_box(geometry.any(black_box(ray), Interval::positive(), &mut |_| true, &mut ()));
                }
            });
        });
    }
    group.finish();
}

/// All threads of the machine.
fn build(criterion: &mut Criterion) {
    const COUNT: u32 = 100_000;
    let scene = scene(Kind::Triangles, COUNT);
    let mut group = criterion.benchmark_group("build, triangles");
    group.sample_size(10).throughput(Throughput::Elements(u64::from(COUNT)));
    for quality in BuildQuality::ALL {
        group.bench_function(format!("{quality:?}"), |b| {
            b.iter_batched(
                || scene.clone(),
                |group| Geometry::new(group, AcceleratorKind::Tree(quality)),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}
