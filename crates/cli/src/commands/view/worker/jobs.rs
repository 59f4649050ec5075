//! Jobs of the viewer between two slices of a render: saving the picture, and measuring the costs of
//! effects.

use std::time::Duration;

use raywright_core::RenderOutput;
use raywright_core::accuracy::measure_effects;
use raywright_io::output::PictureMetadata;

use super::super::save;
use super::super::shared::{SaveRequest, ViewJob};
use super::ViewWorker;
use crate::console::Verbosity;
use crate::origin;
use crate::progress::StepProgress;

/// Time limit for measuring the costs of effects.
const MEASURE_TIMEOUT: Duration = Duration::from_secs(20);

impl ViewWorker {
    /// Does a job, and sends its result to the thread that waits for it.
    pub(super) fn run_job(&mut self, job: ViewJob) {
        match job {
            // The thread that waits for the result may have ended.
            ViewJob::Save(view_request, tell) => {
                drop(tell.try_send(self.save_picture(&view_request)))
            }
            ViewJob::Measure => self.measure_effect_costs(),
        }
    }

    /// Saves the current picture under the name that the page gave. Returns an HTTP status and a
    /// message.
    fn save_picture(&mut self, view_request: &SaveRequest) -> (u16, String) {
        let (Some(subject), Some(render)) = (&self.viewed_scene, &self.render) else {
            return (503, "there is no picture yet".to_owned());
        };
        let own;
        let rendered = match &render.rendered {
            Some(rendered) => rendered,
            None => {
                own = RenderOutput::from_film_without_denoising(&render.film);
                &own
            }
        };
        if rendered.counters.samples == 0 {
            return (503, "there is no picture yet".to_owned());
        }
        let error = render
            .progress
            .error
            .as_ref()
            .filter(|_| subject.ready.is_path_traced());
        let mut metadata = PictureMetadata {
            command: self.command.to_shell_text(&self.view_request.1.flags),
            error: origin::format_error_metadata(error, rendered, &render.film),
            ..origin::picture_metadata(&subject.loaded, &subject.plan, &subject.task.choices)
        };
        if !render.is_done {
            let [minimum, maximum] = render.progress.samples;
            metadata.settings = origin::replace_sample_count(
                &metadata.settings,
                &format!("{minimum} to {maximum} samples"),
            );
        }
        if !subject.task.files.has_metadata {
            metadata = PictureMetadata::default();
        }
        let (display, inputs) = (subject.plan.display, &subject.loaded.inputs);
        self.session
            .run(|| save::save_picture(view_request, rendered, display, &metadata, inputs))
    }

    /// Measures the costs of effects. A newer request or job ends the measurement.
    fn measure_effect_costs(&mut self) {
        let Some(subject) = &self.viewed_scene else {
            return;
        };
        self.message = "measuring the costs of effects".to_owned();
        self.publish_status(None);
        let watch = self.request_observer();
        let mut steps = StepProgress::start(Verbosity::Quiet);
        let (scene, settings) = (&subject.loaded.scene, &subject.plan.settings);
        let measured = self
            .session
            .run(|| measure_effects(scene, settings, MEASURE_TIMEOUT, &watch, &mut steps));
        self.message = match measured {
            Ok(costs) => {
                self.costs = costs
                    .effects
                    .iter()
                    .map(|cost| (cost.effect.to_owned(), cost.ratio.median - 1.0))
                    .collect();
                "measured the costs of effects".to_owned()
            }
            Err(_) => "measuring was interrupted".to_owned(),
        };
        self.publish_status(None);
    }
}
