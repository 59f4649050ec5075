//! Rendering, in parallel over tiles. The pixels and samples of a tile are rendered one after the
//! other. No ray allocates memory or takes a lock.

mod camera_samples;
mod corner_samples;
mod feature_edges;
mod output;
mod queue;
mod sample_stream;
mod tile_job;

use core::marker::PhantomData;
use std::sync::{Mutex, MutexGuard};

use raywright_bvh::Real;

pub use self::output::RenderOutput;
use self::queue::{WorkQueue, WorkUnit};
use self::tile_job::TileJob;
use crate::camera::PreparedCamera;
use crate::film::{Film, FilmPart, TileUpdate};
use crate::integrator::LightTransport;
use crate::observer::Observer;
use crate::prepare::PreparedScene;
use crate::settings::Settings;
pub use output::RenderStage;

/// Renders the samples of `part` that the film lacks, on the current thread pool. Each pass over
/// the picture adds some samples of one replicate. So a stopped render has nearly equal numbers of
/// samples everywhere.
pub(crate) fn render<'a, R: Real, T: LightTransport<'a, R>>(
    (scene, camera): (&'a PreparedScene<R>, &PreparedCamera<R>),
    settings: &Settings,
    film: &mut Film,
    part: &FilmPart,
    observer: &'a dyn Observer,
) {
    let (plan, filter_sampler) = (film.plan().clone(), settings.filter.sampler());
    let queue = Mutex::new(WorkQueue::new(film, part));
    // A separate closure: in the loop's condition, the lock would be held until the work is done.
    let exchange = |finished: Option<TileUpdate>| {
        lock_ignoring_poison(&queue).store_result_and_take_unit(finished, observer)
    };
    let work = || {
        let mut finished = None;
        let mut tracer = T::new(
            scene,
            settings.max_depth,
            !plan.layers.mean.is_empty(),
            observer,
        );
        while !observer.is_cancelled()
            && let Some(next) = exchange(finished.take())
        {
            let WorkUnit {
                tile,
                replicate,
                samples,
                start,
            } = next;
            let area = plan.tile_rect(tile);
            let job = TileJob::<R, T> {
                camera,
                settings,
                plan: &plan,
                filter_sampler: &filter_sampler,
                area,
                tile,
                replicate,
                samples,
                observer,
                transport: PhantomData,
            };
            let Some(tile_update) = job.run(&start, &mut tracer) else {
                break;
            };
            finished = Some(tile_update);
        }
        lock_ignoring_poison(&queue).finish_worker(finished, &tracer.into_light_usage(), observer);
    };
    // Each thread takes the next unit of work from the queue, so that units are finished nearly in
    // order and no thread waits for another. Not a broadcast, which ends only after every thread of
    // the pool has taken part: a caller's pool may have other work.
    rayon::scope(|scope| (0..rayon::current_num_threads()).for_each(|_| scope.spawn(|_| work())));
}

/// Locks a mutex, even if a thread panicked while it held the lock. Such a panic ends the render
/// anyway.
fn lock_ignoring_poison<'a, T>(mutex: &'a Mutex<T>) -> MutexGuard<'a, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}
