//! Thread pools and cancellation.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use rayon::ThreadPoolBuilder;
use raywright_core::prepare::PrepareError;
use raywright_core::scene::Scene;
use raywright_core::settings::Settings;
use raywright_core::{Observer, prepare};
use serde_json::{Value, json};

use crate::support::{DOWN, ball, classic, floor, scene, settings, sun};

/// Cancels from a given check on, and counts the checks.
struct StopsAtQuestion {
    requested: AtomicUsize,
    allowed: usize,
}

impl StopsAtQuestion {
    fn after(allowed: usize) -> Self {
        Self {
            requested: AtomicUsize::new(0),
            allowed,
        }
    }
}

impl Observer for StopsAtQuestion {
    fn is_cancelled(&self) -> bool {
        self.requested.fetch_add(1, Ordering::Relaxed) >= self.allowed
    }
}

/// `meshes` meshes of two triangles, each used twice, `materials` materials in use and as many
/// emissive balls, and `balls` balls.
fn made_of(meshes: usize, materials: usize, balls: u32) -> Scene {
    let square = json!({ "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "indices": [[0, 1, 2], [1, 3, 2]] });
    let mesh = |i: usize| json!({ "name": format!("mesh {i}"), "source": { "inline": square } });
    let shown = |i: usize| json!({ "shape": { "mesh": format!("mesh {}", i / 2) }, "material": "material 0" });
    let glow = json!({ "classic": { "emission": 1 } });
    let material = |i: usize| json!({ "name": format!("material {i}"), "model": glow });
    let glowing = |i: usize| ball([i as f64, 5.0, 0.0], 0.25, &format!("material {i}"));
    let many = json!({ "kind": { "scatter": { "count": balls, "min": [0, 0, 0], "max": [9, 9, 9], "seed": 1 } },
        "object": ball([0.0; 3], 0.1, "material 0") });
    scene(json!({
        "meshes": (0..meshes).map(mesh).collect::<Vec<Value>>(),
        "materials": (0..materials).map(material).collect::<Vec<Value>>(),
        "objects": (0..2 * meshes).map(shown).chain((0..materials).map(glowing)).collect::<Vec<Value>>(),
        "generators": [many],
        "lights": [sun([0.0, 1.0, 0.0])],
    }))
}

/// Protects: preparation ends at any cancelled check, with its own error; and it checks for each
/// mesh, each material and each few thousand objects, so that no user waits for them.
#[test]
fn preparation_can_be_stopped() {
    let questions = |scene: &Scene| {
        let patient = StopsAtQuestion::after(usize::MAX);
        assert!(prepare(scene, &settings(scene, DOWN), &patient).is_ok());
        patient.requested.into_inner()
    };
    let small = made_of(1, 1, 1);
    let requested = questions(&small);
    for allowed in 0..requested {
        let stopped = prepare(
            &small,
            &settings(&small, DOWN),
            &StopsAtQuestion::after(allowed),
        );
        assert_eq!(
            stopped.err(),
            Some(PrepareError::Cancelled),
            "after {allowed} of {requested}"
        );
    }
    assert!(
        prepare(
            &small,
            &settings(&small, DOWN),
            &StopsAtQuestion::after(requested)
        )
        .is_ok()
    );
    assert!(questions(&made_of(5, 1, 1)) >= requested + 4, "meshes");
    assert!(questions(&made_of(1, 5, 1)) >= requested + 4, "materials");
    // Each thousand once for the geometry and once for the emitters: more checks than either alone.
    assert!(
        questions(&made_of(1, 1, 40_001)) >= requested + 2 * 30,
        "objects"
    );
}

/// Records the names of the threads that call it.
#[derive(Default)]
struct ThreadRoll(Mutex<Vec<Option<String>>>);

impl Observer for ThreadRoll {
    fn is_cancelled(&self) -> bool {
        self.0
            .lock()
            .expect("no panic")
            .push(thread::current().name().map(str::to_owned));
        false
    }
}

/// Protects: work runs on the caller's own threads, and on all of them.
#[test]
fn work_is_done_on_the_callers_pool() {
    let scene = made_of(2, 2, 100);
    let settings = Settings {
        size: [64, 64],
        tile_size: 4,
        ..settings(&scene, DOWN)
    };
    let pool = ThreadPoolBuilder::new()
        .num_threads(3)
        .thread_name(|i| format!("mine {i}"))
        .build()
        .expect("three threads");
    let roll = ThreadRoll::default();
    let ready = pool
        .install(|| prepare(&scene, &settings, &roll))
        .expect("prepares");
    let prepared = roll.0.lock().expect("no panic").len();
    assert!(pool.install(|| ready.render(&roll)).finished);
    let mut seen = roll.0.into_inner().expect("no panic");
    assert!(prepared > 0 && seen.len() > prepared);
    assert!(
        seen.iter().flatten().all(|name| name.starts_with("mine ")) && !seen.contains(&None),
        "{seen:?}"
    );
    // A thread without a tile still checks once for cancellation.
    seen.drain(..prepared);
    seen.sort_unstable();
    seen.dedup();
    assert!(!seen.is_empty() && seen.len() <= 3, "{seen:?}");
}

/// Protects: a render needs no thread of the caller's pool that is busy with other work, even if it
/// is busy as long as the render takes.
#[test]
fn busy_threads_are_not_waited_for() {
    /// Time after which a render that waits has failed.
    const LONG: Duration = Duration::from_secs(30);
    let scene = floor(
        classic(json!({})),
        json!({ "lights": [sun([0.0, 1.0, 0.0])] }),
    );
    let settings = Settings {
        size: [16, 16],
        tile_size: 4,
        ..settings(&scene, DOWN)
    };
    let pool = ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .expect("two threads");
    let (begun, has_begun) = mpsc::channel();
    let (end, has_ended) = mpsc::channel();
    let (said, was_told) = mpsc::channel();
    pool.spawn(move || {
        begun.send(()).expect("someone waits for it");
        said.send(has_ended.recv_timeout(LONG).is_ok())
            .expect("someone waits for it");
    });
    has_begun.recv().expect("it begins");
    let finished = pool.install(|| {
        prepare(&scene, &settings, &())
            .expect("prepares")
            .render(&())
            .finished
    });
    // If the render waited, no receiver is left.
    let heard = end.send(());
    assert!(finished && heard.is_ok() && was_told.recv() == Ok(true));
}
