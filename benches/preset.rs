//! The canonical preset: what a whole picture takes, on one thread and on two. Baselines for comparing two states of the code;
//! for comparing the two with each other see `interleaved.rs`.

#[path = "support/scenes.rs"]
mod scenes;
#[path = "support/threads.rs"]
mod threads;

use criterion::{BenchmarkId, Criterion, Throughput};

use scenes::{preset, ready};
use threads::threads;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let Some(whitted) = preset("whitted") else { return };
    let mut group = criterion.benchmark_group("preset");
    group.sample_size(10);
    for size in [[640, 360], [1920, 1080]] {
        group.throughput(Throughput::Elements(u64::from(size[0]) * u64::from(size[1])));
        let ready = ready(&whitted, size, |_| {});
        for count in [1, 2] {
            let pool = threads(count);
            let id = BenchmarkId::new(format!("{}x{}", size[0], size[1]), format!("{count} threads"));
            group.bench_function(id, |b| b.iter(|| pool.install(|| ready.render(&()))));
        }
    }
    group.finish();
    criterion.final_summary();
}
