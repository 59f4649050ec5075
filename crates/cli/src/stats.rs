//! Statistics of a render for `--stats`, as JSON that scripts can rely on. Later versions may add
//! fields; a removed or renamed field changes [`FORMAT`].

use raywright_core::film::Uncertainty;
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::LoadedScene;
use serde_json::{Value, json};

use crate::session::StageSeconds;
use crate::{machine, origin};

/// Version of the layout of the statistics.
pub const FORMAT: u32 = 2;

/// Returns the statistics of a picture. `samples` counts those of all pixels together, `dropped`
/// those left out because they were not finite, `cut_short` the rays that ended because they crossed
/// the largest allowed number of surfaces without a change of direction. `error` is absent where the
/// samples allow no estimate, and `denoised` for a picture that is not denoised; its `brightened` is
/// the relative change of the picture's light.
pub fn render_stats(
    (loaded, ready): (&LoadedScene, &ReadyScene),
    (rendered, error): (&RenderOutput, Option<Uncertainty>),
    seconds: StageSeconds,
) -> Value {
    let (counters, held) = (&rendered.counters, ready.memory());
    let mut stats = json!({
        "format": FORMAT,
        "version": env!("CARGO_PKG_VERSION"),
        "command": origin::command_line(),
        "scene_hash": loaded.hash.to_string(),
        "seconds": seconds,
        "rays": {
            "camera": counters.camera,
            "reflection": counters.reflection,
            "refraction": counters.refraction,
            "scatter": counters.scatter,
            "shadow": counters.shadow,
        },
        "samples": counters.samples,
        "dropped": counters.dropped,
        "cut_short": counters.cut_short,
        "effects": ready.effects().effects,
        "memory": {
            "peak_bytes": machine::peak_memory_bytes(),
            "geometry_bytes": held.geometry,
            "texture_bytes": held.textures,
        },
        "accelerator": origin::accelerator_name(ready.settings().accelerator),
        "warnings": loaded.warnings,
    });
    if let Some(error) = error {
        stats["error"] = json!(error);
    }
    if let Some(denoised) = rendered.denoise_output() {
        stats["denoised"] = json!(denoised.error);
        stats["denoised"]["brightened"] = json!(denoised.light_change);
    }
    stats
}
