//! What the viewer's page receives: frames of the picture or of a layer, and the status.

use raywright_core::RenderOutput;
use raywright_io::output::pixel_hash;

use super::super::layers;
use super::super::shared::ViewFrame;
use super::super::status::{SceneStatus, ViewStatus, list_effect_switches};
use super::ViewWorker;

impl ViewWorker {
    /// Publishes the rendered picture and keeps it for later requests.
    pub(super) fn publish_output(&mut self, rendered: RenderOutput) {
        let is_done = self.render.as_ref().is_some_and(|render| render.is_done);
        if let Some(render) = self.render.as_mut().filter(|_| is_done) {
            render.progress.hash = Some(pixel_hash(rendered.final_picture()));
        }
        // The preview has already shown a first-hit layer at full resolution.
        let frame = if self.shown_layer().is_some() {
            None
        } else {
            Some(self.encode_frame(&rendered, 1))
        };
        self.store_output(Some(rendered));
        self.publish_status(frame);
    }

    /// Keeps a rendered picture for later requests; `None` leaves no picture.
    pub(super) fn store_output(&mut self, rendered: Option<RenderOutput>) {
        if let Some(render) = &mut self.render {
            render.rendered = rendered;
        }
    }

    /// Converts a picture or preview to 8-bit codes for the page. `edge` is the edge of its pixels.
    pub(super) fn encode_frame(&self, rendered: &RenderOutput, edge: u32) -> ViewFrame {
        let (picture, noisy) = (rendered.final_picture(), &rendered.picture);
        let film = self.render.as_ref().map(|render| &render.film);
        // A preview has no samples in the film, and so no standard errors.
        let film = film.filter(|film| {
            self.view_request.1.layer == "stderr"
                && edge == 1
                && film.size() == [noisy.width, noisy.height]
        });
        let display = self
            .viewed_scene
            .as_ref()
            .map(|subject| subject.plan.display)
            .unwrap_or_default();
        let layer = self.shown_layer();
        let codes = self.session.run(|| match (layer, film) {
            (Some(layer), _) => layers::encode_layer(picture, layer),
            (None, Some(film)) => layers::encode_errors(film, noisy),
            (None, None) => layers::encode_colours(picture, display),
        });
        ViewFrame {
            number: 0,
            size: [picture.width, picture.height],
            edge,
            codes,
        }
    }

    /// Publishes the status, and a new picture if given.
    pub(super) fn publish_status(&self, frame: Option<ViewFrame>) {
        let (number, view_request) = &self.view_request;
        let phase = match &self.render {
            _ if self.failure.is_some() => "failed",
            Some(render) if render.is_done => "done",
            _ => "rendering",
        };
        let report = self
            .viewed_scene
            .as_ref()
            .map(|subject| subject.ready.effects());
        let status = ViewStatus {
            told: 0,
            picture: 0,
            wish: *number,
            phase,
            failure: self.failure.clone(),
            said: self.message.clone(),
            command: self.command.to_shell_text(&view_request.flags),
            flags: view_request.flags.clone(),
            layer: view_request.layer.clone(),
            size: self
                .render
                .as_ref()
                .map(|render| render.film.size())
                .unwrap_or_default(),
            progress: self.render.as_ref().map(|render| render.progress.clone()),
            scene: self.viewed_scene.as_ref().map(SceneStatus::from_scene),
            effects: report
                .map(|report| list_effect_switches(report, &self.costs))
                .unwrap_or_default(),
        };
        self.shared
            .publish_frame_and_status(frame, |reported, picture| {
                serde_json::to_string(&ViewStatus {
                    told: reported,
                    picture,
                    ..status
                })
                .unwrap_or_default()
            });
    }
}
